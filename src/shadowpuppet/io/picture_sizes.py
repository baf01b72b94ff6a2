"""Sizes of pictures against those of their calibrated cameras: what differs by padding alone, and what does not fit."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from shadowpuppet.errors import RecordingError, warn
from shadowpuppet.video import camera_number, open_frames

if TYPE_CHECKING:
    from shadowpuppet.io.recording import View

BLOCK, MAX_PADDING = 16, 0.05
"""Pixels to a side of H.264's blocks, and the largest share of a picture's side by which they may exceed it to be taken for padding."""


def fitting(view: View) -> View:
    """The view, its camera of the film's size if the two differ by the padding of H.264 alone, with a warning.

    Each source is opened once, live cameras are not. Raises `RecordingError` if pictures do not have their camera's size, which an empty
    scene and masks may have without the film's padding, or with it.
    """
    found = None if camera_number(view.video) is not None else open_frames(view.video).size
    view = view if found is None else _without_padding(view, found)
    for source in (view.video, view.background, view.masks):
        if source is not None and camera_number(source) is None:
            size = found if found is not None and source is view.video else open_frames(source).size
            _check_size(source, size, view)
    return view


def _without_padding(view: View, found: tuple[int, int]) -> View:
    """The view of a film whose pictures have a size.

    H.264 codes blocks of 16 pixels, and some programs show the rows and columns that fill the last ones: 1088 rows of 1080. They are added
    at the bottom and the right, so that the other pixels and the camera's matrix stay.
    """
    expected = view.camera.size
    if found == expected or not differ_by_padding(found, expected):
        return view
    which = ("film", "calibration") if sum(found) > sum(expected) else ("calibration", "film")
    warn(f"{view.video}: found pictures of {found[0]} x {found[1]} pixels, the calibration of camera {view.camera.name!r} is for "
         f"{expected[0]} x {expected[1]}; the {which[0]} has the padding of H.264 at the bottom or right, the {which[1]} has not: points "
         "stay where they are")
    return replace(view, camera=replace(view.camera, size=found))


def differ_by_padding(first: tuple[int, int], second: tuple[int, int]) -> bool:
    """Whether two sizes (width, height) are equal but for the padding of H.264."""
    return all(_is_padded(a, b) or _is_padded(b, a) for a, b in zip(first, second))


def _is_padded(size: int, bare: int) -> bool:
    """Whether `size` is `bare`, or `bare` filled up to whole blocks of H.264."""
    return size == bare or (size == -(-bare // BLOCK) * BLOCK and size - bare < MAX_PADDING * bare)


def _check_size(source: Path | str | int, found: tuple[int, int], view: View) -> None:
    width, height = view.camera.size
    if found != (width, height) and not (source is not view.video and differ_by_padding(found, (width, height))):
        raise RecordingError(f"{source}: found pictures of {found[0]} x {found[1]} pixels, the calibration of camera "
                             f"{view.camera.name!r} is for {width} x {height}; "
                             + _remedy(found, (width, height), source is view.video))


def _remedy(found: tuple[int, int], expected: tuple[int, int], is_film: bool) -> str:
    """What to do about pictures of another size than the calibration's: of the film itself, or of the empty scene or masks."""
    scale = found[0] / expected[0]
    if found == expected[::-1]:
        return "they are turned by a quarter: turn one of them"
    if not is_film:
        return "they must come from the same camera at the same setting as the film, which has that size"
    if math.isclose(scale, found[1] / expected[1], rel_tol=0.01):
        return f"they have the same shape: scale the film, or set size to {list(found)} and multiply the matrix by {scale:g}"
    return "give the film that was calibrated, or calibrate this one"
