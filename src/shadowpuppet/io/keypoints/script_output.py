"""Keypoints as a script writes them, `keypoints/<camera>.jsonl`: a line of what they are, then one line a frame, from the film's first on.

    {"names": ["nose", "left_shoulder", ...], "detector": "MediaPipe", "origin": 0.5}
    {"people": [{"id": 0, "points": [[x, y, confidence], null, ...]}]}

`origin` is the place of the first pixel's centre, and is subtracted; a point that is missing is null; `id` may be left out.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array
from shadowpuppet.io.files.text import errors_named, read_text
from shadowpuppet.io.keypoints.film_keypoints import FilmKeypoints
from shadowpuppet.io.keypoints.gathering import Gathered, brief, check_keys, json_of, numbers_of

ORIGINS = (0.0, 0.5, 1.0)
"""Places of the first pixel's centre that programs have."""


@dataclass(frozen=True)
class Header:
    """What a script says of its keypoints before the first frame."""

    names: tuple[str, ...]
    """Landmarks, as the script names them."""
    detector: str
    origin: float = 0.0
    """Place of the first pixel's centre, subtracted from all points."""


def read_jsonl(path: Path, size: tuple[int, int]) -> FilmKeypoints:
    """A script's keypoints of a film of a `size`. Raises `FormatError`, naming file and line."""
    with errors_named(path):
        first, *others = read_text(path).splitlines()
        header = header_of(first)
        gathered = Gathered(header.names, header.detector, size)
        for frame, line in enumerate(others):
            with errors_named(f"{path}: line {frame + 2}"):
                for person, points in people_of(line, header):
                    gathered.add(frame, person, points)
        return gathered.film()


def header_of(line: str) -> Header:
    """What the first line says. Raises `ShadowPuppetError`, with only the reason."""
    values = _table(json_of(line), ("names", "detector", "origin"), 'a line {"names": [...], "detector": "...", "origin": 0.5}')
    names, detector, origin = values.get("names"), values.get("detector"), values.get("origin", 0.0)
    if not isinstance(names, list) or not names or not all(isinstance(name, str) for name in names):
        raise ShadowPuppetError(f"names: found {brief(names)}, expected a list of landmarks' names")
    if not isinstance(detector, str):
        raise ShadowPuppetError(f"detector: found {brief(detector)}, expected its name")
    if isinstance(origin, bool) or origin not in ORIGINS:
        raise ShadowPuppetError(f"origin: found {brief(origin)}, expected the place of the first pixel's centre: 0, 0.5 or 1")
    return Header(tuple(names), detector, float(origin))


def people_of(line: str, header: Header) -> Iterator[tuple[int, Array]]:
    """Number (-1 if unknown) and points (K, 3) of the persons in a frame's line: x and y in pixels, their centres at whole numbers, and
    the confidence; NaN for what is missing. Raises `ShadowPuppetError`, with only the reason."""
    people = _table(json_of(line), ("people",), 'a line {"people": [...]}').get("people")
    if not isinstance(people, list):
        raise ShadowPuppetError(f"people: found {brief(people)}, expected a list")
    for n, person in enumerate(people):
        values = _table(person, ("id", "points"), '{"id": 0, "points": [...]}')
        number, points = values.get("id", -1), values.get("points")
        if not isinstance(number, int) or isinstance(number, bool) or not -1 <= number < 2**31:
            raise ShadowPuppetError(f"people[{n}].id: found {brief(number)}, expected a whole number from -1 on")
        if not isinstance(points, list) or len(points) != len(header.names):
            raise ShadowPuppetError(f"people[{n}].points: found {brief(points)}, expected a list of {len(header.names)}, one for each name")
        held = [[np.nan] * 3 if point is None else point for point in points]
        yield number, numbers_of(held, f"people[{n}].points", (len(held), 3)) - np.array([header.origin, header.origin, 0])


def _table(value: Any, known: tuple[str, ...], expected: str) -> Mapping[str, Any]:
    if not isinstance(value, dict):
        raise ShadowPuppetError(f"found {brief(value)}, expected {expected}")
    check_keys(value, known)
    return value
