"""Reads Vicon's calibrations (.xcp), XML of Nexus, Shogun and Blade.

`POSITION` is the camera's in millimetres, `ORIENTATION` the quaternion (x y z w) that rotates the world to the camera's axes, which are
OpenCV's. Vicon maps distorted pixels to undistorted ones, by 1 + k1 r^2 + k2 r^4 + k3 r^6 with r in pixels from the centre of
distortion; OpenCV maps the other way. OpenCV's coefficients are fitted to that over the whole picture, by least squares.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from shadowpuppet.errors import CalibrationError
from shadowpuppet.geometry import Array, rigid, rotation_from_quaternion
from shadowpuppet.io.calibration._xml import Entry, entries, of_films, tree_of
from shadowpuppet.io.calibration.draft import Draft, Drafts, numbers_of

GRID = 33
"""Grid points along each side at which distortion is compared."""
MAX_DISPLACEMENT = 5.0
"""Greatest relative displacement k1 r^2 at the picture's corner with r in pixels; if it is greater, r is taken to be in focal lengths."""
MAX_MISFIT = 0.5
"""Greatest misfit of the fitted distortion, pixels, without a remark."""
CAMERA_KEYS = ("ACTIVE_THRESHOLD", "DEVICEID", "DISPLAY_TYPE", "ISDV", "NAME", "PIXEL_ASPECT_RATIO", "SENSOR", "SENSOR_SIZE", "SYSTEM",
               "TYPE", "USERID")
"""Attributes of a camera; `SKEW` is refused unless it is zero."""
FRAME_KEYS = ("FOCAL_LENGTH", "FRAME", "IMAGE_ERROR", "ORIENTATION", "POSITION", "PRINCIPAL_POINT", "VICON_RADIAL", "VICON_RADIAL2",
              "WORLD_ERROR")


class ViconDistortion(NamedTuple):
    """Vicon's distortion."""

    centre: Array
    """Pixels (2,)."""
    k: Array
    """Coefficients (3,) of r^2, r^4, r^6, with r in pixels."""


def read_vicon(path: Path) -> Drafts:
    """Cameras of an .xcp file: those that make films (`of_films`). Raises `CalibrationError`."""
    cameras = list(entries(path, tree_of(path), ".//Camera", "DEVICEID"))
    used = of_films(path, cameras, "TYPE")
    posed = [entry for entry in used if entry.element.find("KeyFrames/KeyFrame") is not None]
    if not posed:
        raise CalibrationError(f"{path}: no calibrated camera in it, expected <Camera> with <KeyFrames><KeyFrame> in it")
    notes: list[str] = []
    if len(used) < len(cameras):
        notes.append(f"cameras for markers are left out: {', '.join(entry.camera for entry in cameras if entry not in used)}")
    if len(posed) < len(used):
        notes.append(f"not calibrated, left out: {', '.join(entry.camera for entry in used if entry not in posed)}")
    unused = [key for entry in posed for key in (*entry.unknown(CAMERA_KEYS), *entry.child("KeyFrames/KeyFrame").unknown(FRAME_KEYS))]
    return Drafts(tuple(_draft(entry, notes) for entry in posed), "mm", tuple(notes), tuple(unused))


def _draft(entry: Entry, notes: list[str]) -> Draft:
    frame = entry.child("KeyFrames/KeyFrame")
    size = entry.numbers("SENSOR_SIZE", (2,))
    focal, aspect = frame.number("FOCAL_LENGTH"), entry.number("PIXEL_ASPECT_RATIO", "1")
    if not (focal > 0 and aspect > 0 and (size > 0).all() and (size < 1e5).all()):
        raise CalibrationError(f"{entry.path}: camera {entry.camera!r}: found a focal length of {focal:g}, an aspect ratio of {aspect:g} "
                               f"and a sensor of {size.tolist()}, expected positive numbers")
    principal = frame.numbers("PRINCIPAL_POINT", (2,))
    matrix = np.array([[focal, 0, principal[0]], [0, focal / aspect, principal[1]], [0, 0, 1]])
    R, place = _rotation(frame), frame.numbers("POSITION", (3,))
    try:
        with np.errstate(all="ignore"):
            lens, off = opencv_distortion(matrix, size, _bend(frame, principal, size, focal))
    except CalibrationError as error:
        raise CalibrationError(f"{entry.path}: camera {entry.camera!r}: {error}") from None
    if off > MAX_MISFIT:
        notes.append(f"camera {entry.camera!r}: OpenCV's distortion follows Vicon's within {off:.1f} pixels only")
    return Draft(name=entry.camera, matrix=matrix, distortion=lens, T=rigid(R, -R @ place), size=size.tolist())


def _rotation(frame: Entry) -> Array:
    q = frame.numbers("ORIENTATION", (4,))
    length = float(np.linalg.norm(q))
    if abs(length - 1) > 0.01:
        raise CalibrationError(f"{frame.path}: camera {frame.camera!r}: ORIENTATION: found a quaternion of length {length:g}, expected 1")
    return rotation_from_quaternion(q / length)


def _bend(frame: Entry, principal: Array, size: Array, focal: float) -> ViconDistortion:
    text = frame.element.get("VICON_RADIAL2")
    values = numbers_of(text.partition(" ")[2] if text and text[:1].isalpha() else text, (5,))
    if values is not None:
        centre, k = values[:2], values[2:]
    else:
        centre, k = principal, np.append(frame.numbers("VICON_RADIAL", (2,), "0 0"), 0.0)
    corner = float(np.linalg.norm(size)) / 2
    return ViconDistortion(centre, k / focal ** np.array([2, 4, 6]) if abs(k[0]) * corner**2 > MAX_DISPLACEMENT else k)


def opencv_distortion(matrix: Array, size: Array, bend: ViconDistortion) -> tuple[Array, float]:
    """OpenCV's k1 k2 p1 p2 k3 for Vicon's distortion, and the largest misfit in a picture of `size` (2,), pixels."""
    across = [np.linspace(0, side - 1, GRID) for side in size]
    pixels = np.stack(np.meshgrid(*across), -1).reshape(-1, 2)
    r2 = ((pixels - bend.centre) ** 2).sum(1)
    straight = bend.centre + (pixels - bend.centre) * (1 + r2 * (bend.k[0] + r2 * (bend.k[1] + r2 * bend.k[2])))[:, None]
    focal, principal = np.diag(matrix)[:2], matrix[:2, 2]
    (x, y), moved = ((straight - principal) / focal).T, (pixels - straight) / focal
    r2 = x * x + y * y
    rows = np.concatenate([np.stack([x * r2, x * r2**2, 2 * x * y, r2 + 2 * x * x, x * r2**3], 1),
                           np.stack([y * r2, y * r2**2, r2 + 2 * y * y, 2 * x * y, y * r2**3], 1)])
    wanted = moved.T.ravel()
    if not (np.isfinite(rows).all() and np.isfinite(wanted).all()):
        raise CalibrationError(f"found the distortion {bend.k.tolist()} about {bend.centre.tolist()}, expected that of a lens")
    lens = np.linalg.lstsq(rows, wanted, rcond=None)[0]
    return lens, float(np.abs((rows @ lens - wanted).reshape(2, -1) * focal[:, None]).max())
