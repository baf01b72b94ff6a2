"""Keypoints gathered while a file is read, a person at a time; and what all readers check."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.camera.keypoints import LANDMARKS
from shadowpuppet.errors import ShadowPuppetError, shown, warn
from shadowpuppet.geometry import Array
from shadowpuppet.io.files.table import shorten
from shadowpuppet.io.keypoints.film_keypoints import FilmKeypoints, film_keypoints
from shadowpuppet.io.projects import MOST_FRAMES

UNUSED = "-"
"""Name of a landmark that is known, and not used."""
COMPACT = {landmark.replace("_", ""): landmark for landmark in LANDMARKS}
OTHERS = {"footindex": "bigtoe", "toe": "bigtoe", "littletoe": "smalltoe", "little": "pinky", "pelvis": "midhip", "tophead": "headtop"}
"""Other programs' names of landmarks, without side and underscores."""
WORDS = re.compile("[A-Z]?[a-z]+|[A-Z]+(?![a-z])")
SIDES = {"l": "left", "left": "left", "r": "right", "right": "right"}


class Gathered:
    """Keypoints of a film, gathered a person at a time."""

    def __init__(self, names: Sequence[str], detector: str, size: tuple[int, int], raw: bool = False) -> None:
        """Names of the K landmarks, as the file has them; detector and model; the film's size. `raw`: confidences are a network's scores,
        which are not bounded (OpenPose's reach 1.4, those of SimCC 10), and are clipped to 0 to 1. Raises `ShadowPuppetError` if no
        landmark is known."""
        self.known = known_names(names)
        self.detector, self.size, self.raw = detector, size, raw
        self._frames, self._persons, self._points = list[int](), list[int](), list[NDArray[np.float32]]()

    def add(self, frame: int, person: int, points: Array) -> None:
        """Add the points (K, 3) of one person in a frame: pixels with centres at whole numbers, confidence. Raises `ShadowPuppetError`."""
        if not 0 <= frame < MOST_FRAMES:
            raise ShadowPuppetError(f"frame: found {frame}, expected 0 to under {MOST_FRAMES}")
        self._frames.append(frame)
        self._persons.append(person)
        with np.errstate(over="ignore"):
            self._points.append(points[list(self.known.values())].astype(np.float32))

    def film(self) -> FilmKeypoints:
        """All of them. Raises `ShadowPuppetError` as `film_keypoints` does."""
        points = np.array(self._points, np.float32).reshape(-1, len(self.known), 3)
        xy, confidence = points[..., :2], points[..., 2]
        if self.raw:
            confidence = confidence.clip(0, 1)
        seen = xy[confidence > 0]
        if np.isfinite(seen).any() and not (seen > 1).any():
            raise ShadowPuppetError("points: found none beyond 1, expected pixels, no shares of the picture")
        return film_keypoints(tuple(self.known), self._frames, self._persons, xy, confidence, self.detector, self.size)


def known_names(names: Sequence[str]) -> dict[str, int]:
    """Place of each landmark in a file's list, by its name here; warns of those that are not used. Raises `ShadowPuppetError` if none is
    known, or one is there twice."""
    found, left = dict[str, int](), list[str]()
    for n, name in enumerate(names):
        landmark = landmark_of(name)
        if landmark in found:
            raise ShadowPuppetError(f"names: found {names[found[landmark]]!r} and {name!r}, expected every landmark once")
        if landmark is not None:
            found[landmark] = n
        elif name != UNUSED:
            left.append(name)
    if not found:
        raise ShadowPuppetError(f"names: found {shorten(names)!r}, expected some of {', '.join(LANDMARKS)}")
    if left:
        warn(f"keypoints: landmarks that are not known are left out: {shorten(left)}; known: {', '.join(LANDMARKS)}")
    return found


def landmark_of(name: str) -> str | None:
    """A landmark's name here by another program's, such as `LShoulder` or `ankle_right`; None if it is not known."""
    words = [word.lower() for word in WORDS.findall(name[:80])]
    side = "".join(SIDES[word] for word in words if word in SIDES)
    part = "".join(word for word in words if word not in SIDES)
    return COMPACT.get(side + OTHERS.get(part, part))


def json_of(text: str) -> Any:
    """The values in a text of JSON, in which numbers may be NaN. Raises `ShadowPuppetError`, with only the reason."""
    try:
        return json.loads(text)
    except RecursionError:
        raise ShadowPuppetError("found JSON nested too deeply, expected keypoints") from None
    except ValueError as error:
        raise ShadowPuppetError(f"found no JSON ({error}), expected keypoints") from None


def check_keys(table: Mapping[str, object], known: Iterable[str]) -> None:
    """Raise `ShadowPuppetError` for a key that is not known."""
    names = tuple(known)
    unknown = sorted(set(table) - set(names))
    if unknown:
        raise ShadowPuppetError(f"found the key {unknown[0][:80]!r}; keys known there: {', '.join(names)}")


def numbers_of(value: object, what: str, shape: tuple[int, ...]) -> Array:
    """Numbers of a shape, NaN among them. Raises `ShadowPuppetError`."""
    try:
        array = np.asarray(value)
    except ValueError:  # lists of unequal lengths
        array = np.empty(0, object)
    if array.dtype.kind not in "iuf" or array.size != np.prod(shape):
        raise ShadowPuppetError(f"{what}: found {brief(value)}, expected {' x '.join(map(str, shape))} numbers")
    return array.astype(float).reshape(shape)


def brief(value: object) -> str:
    """A value for a message, in few words: it may be nested deeply."""
    return f"a list of {len(value)}" if isinstance(value, list) else "a table" if isinstance(value, dict) else shown(value)[:80]
