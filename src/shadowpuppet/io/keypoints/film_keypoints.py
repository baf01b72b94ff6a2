"""The keypoints of one camera's whole film, and their own format: `keypoints/<camera>.npz`, arrays without pickled objects.

    names       (K,)       landmarks, of `camera.keypoints.LANDMARKS`
    frame       (M,)       frames of the film, counted from 0, one for each person in them; frames without a person are left out
    person      (M,)       the person's number, -1 if unknown
    xy          (M, K, 2)  pixels of the whole film, their centres at whole numbers; NaN for what is missing
    confidence  (M, K)     from 0 (missing) to 1
    detector    ()         detector and model
    size        (2,)       width and height of the film
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shadowpuppet.camera.keypoints import LANDMARKS, Keypoints
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.io.files.npz import archive_bytes, read_arrays
from shadowpuppet.io.files.table import shorten
from shadowpuppet.io.files.text import errors_named, write_whole
from shadowpuppet.io.picture_sizes import differ_by_padding
from shadowpuppet.io.projects import MOST_FRAMES

DIMENSIONS = {"names": 1, "frame": 1, "person": 1, "xy": 3, "confidence": 2, "detector": 0, "size": 1}
"""Arrays of the file and their numbers of dimensions."""


@dataclass(frozen=True, eq=False)
class FilmKeypoints:
    """Keypoints of M detections of persons in one camera's whole film; `film_keypoints` makes one of any arrays."""

    names: tuple[str, ...]
    """Landmarks, some of `LANDMARKS`; K."""
    frame: NDArray[np.int64]
    """Frame of each detection, of shape (M,), counted from 0 in the film, as its ready masks are; never decreasing."""
    person: NDArray[np.int64]
    """The file's numbers of the persons, of shape (M,); -1 where unknown."""
    xy: NDArray[np.float32]
    """Pixels of the whole film, of shape (M, K, 2); NaN where a landmark is missing."""
    confidence: NDArray[np.float32]
    """From 0, where a landmark is missing, to 1, of shape (M, K)."""
    detector: str
    size: tuple[int, int]
    """Width and height of the film, pixels."""

    def at(self, frame: int) -> Keypoints:
        """What was found in a frame, counted from 0 in the film."""
        there = slice(*np.searchsorted(self.frame, [frame, frame + 1]).tolist())
        return Keypoints(self.names, self.xy[there].astype(float), self.confidence[there].astype(float), self.person[there], self.detector)

    @property
    def persons(self) -> NDArray[np.int64]:
        """Number of detections in each frame that has any."""
        return np.unique(self.frame, return_counts=True)[1]


def film_keypoints(names: Sequence[str], frame: ArrayLike, person: ArrayLike, xy: ArrayLike, confidence: ArrayLike, detector: str,
                   size: tuple[int, int]) -> FilmKeypoints:
    """Keypoints of a film of a `size`, in order of frames. Points outside the picture, those without confidence, and persons without any
    point are left out. Raises `ShadowPuppetError`, with only the reason, for values that cannot be keypoints."""
    named = tuple(map(str, names))
    _check(0 < len(named) == len(set(named)) and set(named) <= set(LANDMARKS), "names", shorten(named), "landmarks, each once: "
           + ", ".join(LANDMARKS))
    frames, persons = np.asarray(frame, np.int64), np.asarray(person, np.int64)
    with np.errstate(over="ignore"):
        points, sure = np.array(xy, np.float32), np.array(confidence, np.float32)
    number, (width, height) = len(frames), size
    for name, array, shape in (("person", persons, (number,)), ("xy", points, (number, len(named), 2)),
                               ("confidence", sure, (number, len(named)))):
        _check(array.shape == shape, name, f"shape {array.shape}", f"{shape}")
    _check(bool(((frames >= 0) & (frames < MOST_FRAMES)).all()), "frame", f"{frames.min(initial=0)} to {frames.max(initial=0)}",
           f"numbers from 0 to under {MOST_FRAMES}")
    _check(bool((persons >= -1).all()), "person", persons.min(initial=0), "-1 or more")
    extreme = [float(np.nanmin(sure, initial=0)), float(np.nanmax(sure, initial=0))]
    _check(extreme[0] >= 0 and extreme[1] <= 1, "confidence", f"{extreme[0]:g} to {extreme[1]:g}", "0 to 1")
    inside = np.all((points >= -0.5) & (points <= np.array([width, height]) - 0.5), axis=-1) & (sure > 0)
    points[~inside], sure[~inside] = np.nan, 0
    order = np.argsort(frames, kind="stable")
    order = order[inside.any(1)[order]]
    return FilmKeypoints(named, frames[order], persons[order], points[order], sure[order], detector, (int(width), int(height)))


def write_keypoints(path: Path, film: FilmKeypoints) -> None:
    """Write a film's keypoints (.npz) so that `read_npz` gives back the same bits. Raises `ShadowPuppetError` if that fails."""
    write_whole(path, archive_bytes(names=np.array(film.names, str), frame=film.frame, person=film.person, xy=film.xy,
                                    confidence=film.confidence, detector=film.detector, size=film.size))


def read_npz(path: Path, size: tuple[int, int]) -> FilmKeypoints:
    """Keypoints (.npz) of a film of a `size`. Raises `FormatError`, naming file and array."""
    with errors_named(path):
        arrays = read_arrays(path)
        for name in DIMENSIONS:
            _check_array(name, arrays)
        unknown = sorted(set(arrays) - set(DIMENSIONS))
        _check(not unknown, "arrays", shorten(unknown), f"only {', '.join(DIMENSIONS)}")
        _check(arrays["size"].shape == (2,), "size", arrays["size"].tolist(), "width and height")
        check_size((int(arrays["size"][0]), int(arrays["size"][1])), size)
        return film_keypoints(arrays["names"].tolist(), arrays["frame"], arrays["person"], arrays["xy"], arrays["confidence"],
                              str(arrays["detector"]), size)


def check_size(found: tuple[int, int], expected: tuple[int, int]) -> None:
    """Raise `ShadowPuppetError`, with only the reason, for keypoints in pictures of another size than the film's, padding apart."""
    if found != expected and not differ_by_padding(found, expected):
        raise ShadowPuppetError(f"size: found keypoints in pictures of {found[0]} x {found[1]} pixels, expected the film's "
                                f"{expected[0]} x {expected[1]}")


def _check_array(name: str, arrays: dict[str, NDArray[Any]]) -> None:
    kinds = {"names": "U", "detector": "U", "xy": "fiu", "confidence": "fiu"}.get(name, "iu")
    array = arrays.get(name)
    _check(array is not None and array.dtype.kind in kinds and array.ndim == DIMENSIONS[name], name,
           "no such array" if array is None else f"{array.dtype} of shape {array.shape}",
           f"{'text' if kinds == 'U' else 'numbers' if len(kinds) == 3 else 'whole numbers'} of {DIMENSIONS[name]} dimensions")


def _check(good: bool, what: str, found: object, expected: str) -> None:
    if not good:
        raise ShadowPuppetError(f"{what}: found {found}, expected {expected}")
