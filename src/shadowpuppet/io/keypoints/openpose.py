"""Reads a folder of OpenPose's files, one a frame, as Pose2Sim and other programs also write them.

    film_000000000012_keypoints.json    {"people": [{"person_id": [-1], "pose_keypoints_2d": [x, y, confidence, ...]}]}

The last number of a file's name is its frame. What is missing is 0, 0, 0, or NaN.
"""

from __future__ import annotations

import re
from pathlib import Path

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.io.files.text import errors_named
from shadowpuppet.io.keypoints.film_keypoints import FilmKeypoints
from shadowpuppet.io.keypoints.gathering import Numbered, json_file
from shadowpuppet.io.keypoints.models import Model
from shadowpuppet.io.keypoints.names import brief

POINTS = "pose_keypoints_2d"
FILE_KEYS = ("version", "people", "part_candidates")
PERSON_KEYS = ("person_id", POINTS, "pose_keypoints_3d", *(f"{part}_keypoints_{n}d" for part in ("face", "hand_left", "hand_right")
                                                           for n in (2, 3)))  # fmt: skip
"""Keys that are known; of a person's, only the first two are used."""


def read_openpose(folder: Path, size: tuple[int, int], model: Model | None = None) -> FilmKeypoints:
    """Keypoints in a folder's files of a film of a `size`. Raises `FormatError`, naming the file."""
    gathered, frames = Numbered(size, model), dict[int, Path]()
    with errors_named(folder):
        files = sorted(path for path in folder.iterdir() if path.suffix.lower() == ".json" and path.name[0] != ".")
        if not files:
            raise ShadowPuppetError("found no files of JSON in it, expected one for each frame")
        for path in files:
            with errors_named(path):
                frame = last_number(path.stem)
                if frames.setdefault(frame, path) is not path:
                    raise ShadowPuppetError(f"found frame {frame} in it and in {frames[frame].name}, expected every frame once")
                _read_frame(gathered, frame, json_file(path))
        return gathered.film(folder)


def last_number(name: str) -> int:
    """The last number in a name. Raises `ShadowPuppetError` if there is none."""
    numbers = re.findall("[0-9]+", name)
    if not numbers or len(numbers[-1]) > 20:
        raise ShadowPuppetError(f"frame: found no number in {name[:80]!r}, expected the frame's at its end")
    return int(numbers[-1])


def _read_frame(gathered: Numbered, frame: int, values: object) -> None:
    people = values.get("people") if isinstance(values, dict) else None
    if not isinstance(values, dict) or not isinstance(people, list):
        raise ShadowPuppetError(f"people: found {brief(people)}, expected a list")
    gathered.note_keys(values, FILE_KEYS)
    for person in people:
        if not isinstance(person, dict) or POINTS not in person:
            raise ShadowPuppetError(f"people: found {brief(person)} without {POINTS}, expected it in each of them")
        gathered.note_keys(person, PERSON_KEYS)
        if person[POINTS] != []:  # only a face or hands were found
            gathered.add(frame, person_id(person.get("person_id")), person[POINTS])


def person_id(value: object) -> int:
    """A person's number, alone or in a list; -1 if it is not known."""
    value = value[0] if isinstance(value, list) and len(value) == 1 else value
    return int(value) if isinstance(value, int | float) and 0 <= value < 2**31 else -1
