"""Reads results of AlphaPose and in COCO's layout, a list of persons.

    [{"image_id": "12.jpg", "category_id": 1, "keypoints": [x, y, confidence, ...], "score": 2.9, "idx": 1}]

The last number of an image's name is its frame. Numbers without a name are those of any data set: they are frames only if they follow each
other, from 0 or 1 on.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.io.keypoints.film_keypoints import FilmKeypoints
from shadowpuppet.io.keypoints.gathering import Numbered
from shadowpuppet.io.keypoints.models import Model
from shadowpuppet.io.keypoints.names import brief
from shadowpuppet.io.keypoints.openpose import last_number, person_id

KEYS = ("image_id", "category_id", "keypoints", "idx", "track_id", "score", "box", "bbox", "id", "area", "center", "scale")
"""Keys that are known; the first five are used, the others are a person's box."""


def read_alphapose(path: Path, values: Any, size: tuple[int, int], model: Model | None = None) -> FilmKeypoints:
    """Keypoints in the values of a file. Raises `ShadowPuppetError`, with only the reason."""
    gathered, first = Numbered(size, model), _first(values)
    for person in values:
        if not isinstance(person, dict) or person.get("category_id", 1) != 1:
            raise ShadowPuppetError(f"found {brief(person)} among persons, expected tables with category_id 1 or none")
        gathered.note_keys(person, KEYS)
        gathered.add(_frame(person.get("image_id")) - first, person_id(person.get("idx", person.get("track_id"))), person.get("keypoints"))
    return gathered.film(path)


def _first(values: Any) -> int:
    """The number of the film's first frame."""
    images = (person.get("image_id") for person in values if isinstance(person, dict))
    numbers = {image for image in images if isinstance(image, int)}
    low, high = min(numbers, default=0), max(numbers, default=-1)
    if numbers and (low not in (0, 1) or high - low >= len(numbers)):
        raise ShadowPuppetError(f"image_id: found {len(numbers)} numbers from {low} to {high}, expected all from 0 or 1 on, "
                                "or images' names such as 12.jpg")
    return low if numbers else 0


def _frame(image: object) -> int:
    if isinstance(image, str):
        return last_number(Path(image).stem)
    if not isinstance(image, int) or isinstance(image, bool):
        raise ShadowPuppetError(f"image_id: found {brief(image)}, expected an image's name or number")
    return image
