"""Keypoints gathered while a file is read, a person at a time; and what all readers check."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.errors import FILE_MEMORY, FormatError, ShadowPuppetError, warn
from shadowpuppet.geometry import Array
from shadowpuppet.io.calibration.keys import unknown_keys
from shadowpuppet.io.files.table import shorten
from shadowpuppet.io.files.text import read_limited
from shadowpuppet.io.keypoints.film_keypoints import FilmKeypoints, film_keypoints
from shadowpuppet.io.keypoints.models import MODELS, Model, model_by_count
from shadowpuppet.io.keypoints.names import brief, known_names
from shadowpuppet.io.projects import MOST_FRAMES

FACE = ("left_eye", "right_eye", "left_ear", "right_ear")
"""Landmarks that are near the nose in any posture."""


class Gathered:
    """Keypoints of a film, gathered a person at a time."""

    def __init__(self, names: Sequence[str], detector: str, size: tuple[int, int], raw: bool = False) -> None:
        """Names of the K landmarks, as the file has them; detector and model; the film's size. `raw`: confidences are a network's scores,
        which are not bounded (OpenPose's reach 1.4, AlphaPose's 6), and are clipped to 0 to 1. Raises `ShadowPuppetError` if no landmark
        is known."""
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
        film = film_keypoints(tuple(self.known), self._frames, self._persons, xy, confidence, self.detector, self.size)
        if np.isfinite(seen).any() and not len(film.frame):
            raise ShadowPuppetError(f"points: found all outside the picture of {self.size[0]} x {self.size[1]} pixels, expected those of "
                                    "its film")
        return film


class Numbered:
    """Keypoints of a network whose landmarks have numbers and no names, gathered a person at a time."""

    def __init__(self, size: tuple[int, int], stated: Model | None, names: Sequence[str] = ()) -> None:
        """The film's size; the model, if it is stated, or the landmarks' names that the file states."""
        self.size, self.stated, self.names, self.unused = size, stated, names, set[str]()
        self._model, self._gathered = stated, None if stated is None else Gathered(stated.landmarks, stated.name, size, raw=True)

    def note_keys(self, table: Mapping[str, object], known: Collection[str]) -> None:
        """Remember the keys of a table that are not known. Raises `CalibrationError`, with only the reason, for one that may change where
        points are."""
        if not table.keys() <= set(known):
            self.unused.update(unknown_keys("", table, known))

    def add(self, frame: int, person: int, values: object, scores: object = None) -> None:
        """Add one person in a frame: x, y and confidence of each landmark, or x and y (and more) of each and their `scores`. Raises
        `ShadowPuppetError`."""
        if not isinstance(values, list) or (scores is not None and not isinstance(scores, list)):
            raise ShadowPuppetError(f"keypoints: found {brief(values)} and scores {brief(scores)}, expected lists of numbers")
        count = len(values) // 3 if scores is None else len(scores)
        if self._gathered is None:
            self._model = model_by_count(count, self.names)
            self._gathered = Gathered(self._model.landmarks, self._model.name, self.size, raw=True)
        assert self._model is not None
        if count != len(self._model.landmarks):
            raise ShadowPuppetError(f"keypoints: found {count} landmarks, expected {len(self._model.landmarks)} as in {self._model.name}")
        if scores is None:
            points = numbers_of(values, "keypoints", (count, 3))
        else:
            xy = numbers_of([each[:2] if isinstance(each, list) else each for each in values], "keypoints", (count, 2))
            points = np.column_stack([xy, numbers_of(scores, "scores", (count,))])
        self._gathered.add(frame, person, points - np.array([self._model.origin, self._model.origin, 0]))

    def film(self, path: Path) -> FilmKeypoints:
        """All of them; warns of keys that are not known. Raises `ShadowPuppetError`, also for BODY_25B that is taken for BODY_25."""
        if self.unused:
            warn(f"{path}: keys that are not known are not used: {shorten(sorted(self.unused))}")
        film = (self._gathered or Gathered(MODELS["COCO_17"], "COCO_17", self.size)).film()
        if film.detector == "BODY_25" and self.stated is None and size_of_face(film, "BODY_25B") < size_of_face(film, "BODY_25"):
            raise ShadowPuppetError("model: found 25 landmarks a person that fit BODY_25B better than BODY_25, expected it to be stated: "
                                    "[keypoints] with model = \"BODY_25B\" in recording.toml, or pose_model in Pose2Sim's Config.toml")
        return film


def size_of_face(film: FilmKeypoints, model: str) -> float:
    """Median distance, pixels, from the nose to what is near it in a film of BODY_25, if its numbers are those of another model; NaN if
    none is seen."""
    column = [film.names.index(name) for name in MODELS["BODY_25"]]
    near = [column[MODELS[model].index(name)] for name in FACE]
    away = np.linalg.norm(film.xy[:, near] - film.xy[:, film.names.index("nose"), None], axis=-1)
    return float(np.median(away[np.isfinite(away)])) if np.isfinite(away).any() else np.nan


def json_file(path: Path) -> Any:
    """The values in a file of JSON. Raises `FormatError`."""
    text = read_limited(path, FILE_MEMORY // 4, FormatError, "keypoints in JSON")
    return json_of(text)


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
