"""Overview of a calibration: where cameras stand, what they look at and see together, and what is implausible."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.geometry import Array
from shadowpuppet.io.calibration.calibration_files import UPS, Calibration, examine_calibration

PERSON_HEIGHTS = (0.0, 0.9, 1.8)
"""Heights (metres) of a standing person that must lie in the picture for the person to be seen whole."""
MIN_UP_COSINE = 0.7
"""Least cosine of the pictures' mean up direction to an axis that counts as up."""
LEVEL_SHARE = 0.9
"""The world's Z is doubted if it is upright in the pictures, turned by quarters, by less than this share of the direction they agree on."""
RIG_EXTENT = (0.3, 30.0)
"""Plausible range of the greatest distance between cameras, metres."""
MAX_CENTRE_OFFSET = 0.2
"""Greatest plausible distance of the principal point from the picture's middle, over its size."""
MAX_AIM_OFFSET = 0.35
"""Greatest distance of a camera's axis from the place that all look at, over its distance to the camera."""
VIEW_DISTANCE = 4.0
"""Metres in front of each camera that the top view shows if the cameras do not look at one place; also its least side."""
MAP_COLUMNS = 48
"""Columns of the top view; it has half as many rows."""


@dataclass(frozen=True, kw_only=True)
class CameraPlacement:
    """Place, direction and lens of one camera; plain values."""

    name: str
    size: tuple[int, int]
    """Width and height, pixels."""
    fov: tuple[float, float]
    """Horizontal and vertical field of view, degrees, without distortion."""
    lens: str
    """pinhole, distorted or fisheye."""
    bend: float
    """Greatest displacement of the picture's corners by distortion, pixels."""
    place: tuple[float, float, float]
    """Camera centre, metres."""
    facing: float
    """Viewing direction seen from above, degrees counter-clockwise from x."""
    down: float
    """Angle below the horizontal, degrees."""
    roll: float
    """Clockwise roll about its axis, degrees."""
    away: float | None
    """Distance to the place that all look at, metres; None if there is none."""
    placed: bool
    """Whether the file gives its place and orientation."""


@dataclass(frozen=True, kw_only=True)
class CalibrationLook:
    """Overview of a calibration; plain values, so that it can be saved."""

    path: str
    format: str
    unit: str
    """Unit of the file's lengths."""
    unit_told: bool
    """Whether the file or the user states the unit; metres are assumed otherwise."""
    cameras: tuple[CameraPlacement, ...]
    middle: tuple[float, float, float] | None
    """The point nearest to all optical axes, metres."""
    apart: tuple[float, float] | None
    """Least and greatest distance between two cameras, metres."""
    seen: tuple[tuple[int, ...], ...]
    """Number of cameras that see a standing person whole, by rows (from the greatest y) and columns of a map."""
    corners: tuple[float, float, float, float]
    """Least x and y, greatest x and y of the map, metres."""
    notes: tuple[str, ...]
    """How the file was read."""
    doubts: tuple[str, ...]
    """What is implausible, and the remedy, a sentence each."""


def look_at_calibration(path: str | Path, unit: str | None = None, up: str | None = None) -> tuple[CalibrationLook, Calibration]:
    """Overview of a calibration file, and its cameras. Raises `CalibrationError`."""
    found = examine_calibration(path, unit, up)
    cameras, middle = found.cameras, meeting_point(found.cameras)
    gaps = [float(np.linalg.norm(a.centre - b.centre)) for a, b in combinations(cameras, 2)]
    corners = _corners(cameras, middle)
    look = CalibrationLook(
        path=str(path), format=found.format, unit=found.unit, unit_told=found.unit_known,
        cameras=tuple(_placement(camera, middle) for camera in cameras), middle=_three(middle) if middle is not None else None,
        apart=(min(gaps), max(gaps)) if gaps else None, seen=tuple(map(tuple, _seen(cameras, corners).tolist())), corners=corners,
        notes=found.notes, doubts=tuple(_doubts(found, middle)),
    )  # fmt: skip
    return look, found


def meeting_point(cameras: Sequence[Camera]) -> Array | None:
    """The point (3,) nearest to the cameras' optical axes; None if they are nearly parallel, or it lies behind most cameras."""
    axes = np.array([camera.T_camera_world[2, :3] for camera in cameras]).reshape(-1, 3)
    across = np.eye(3) - axes[:, :, None] * axes[:, None, :]
    A, b = across.sum(0), sum((P @ camera.centre for P, camera in zip(across, cameras)), np.zeros(3))
    if len(cameras) < 2 or np.linalg.cond(A) > 1e4:
        return None
    middle = np.linalg.solve(A, b)
    ahead = [axis @ (middle - camera.centre) > 0 for axis, camera in zip(axes, cameras)]
    return middle if 2 * sum(ahead) > len(cameras) else None


def up_direction(cameras: Sequence[Camera]) -> Array:
    """Mean of the pictures' up directions in the world, of shape (3,), of length at most 1."""
    return -np.mean([camera.T_camera_world[1, :3] for camera in cameras], 0)


def upright(cameras: Sequence[Camera]) -> float:
    """Mean cosine between the world's Z and the nearest side of each picture: a camera that is rolled by quarter turns says nothing against
    Z, as pictures are mounted so."""
    return float(np.mean([np.abs(camera.T_camera_world[:2, 2]).max() for camera in cameras]))


def _placement(camera: Camera, middle: Array | None) -> CameraPlacement:
    R, (width, height) = camera.T_camera_world[:3, :3], camera.size
    fov = [float(np.degrees(2 * np.arctan(side / 2 / focal))) for side, focal in zip(camera.size, np.diag(camera.matrix))]
    lens = "fisheye" if camera.fisheye else "distorted" if camera.distortion.any() else "pinhole"
    away = float(np.linalg.norm(middle - camera.centre)) if middle is not None else None
    return CameraPlacement(
        name=camera.name, size=(width, height), fov=(fov[0], fov[1]), lens=lens, bend=_bend(camera), place=_three(camera.centre),
        facing=float(np.degrees(np.arctan2(R[2, 1], R[2, 0]))),
        down=float(np.degrees(-np.arcsin(np.clip(R[2, 2], -1, 1)))), roll=float(np.degrees(np.arctan2(-R[0, 2], -R[1, 2]))), away=away,
        placed=camera.oriented,
    )  # fmt: skip


def _bend(camera: Camera) -> float:
    """Greatest displacement of the picture's corners by distortion, pixels."""
    if not (camera.fisheye or camera.distortion.any()):
        return 0.0
    width, height = camera.size
    corners = np.array([[0, 0, 1], [width - 1, 0, 1], [0, height - 1, 1], [width - 1, height - 1, 1]], float)
    distorted = replace(camera, T_camera_world=np.eye(4)).project(corners @ np.linalg.inv(camera.matrix).T)
    return float(np.linalg.norm(distorted - corners[:, :2], axis=1).max())


def _three(values: Array) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z


def _corners(cameras: Sequence[Camera], middle: Array | None) -> tuple[float, float, float, float]:
    """A square around the cameras and what they look at."""
    ahead = [middle] if middle is not None else [camera.centre + VIEW_DISTANCE * camera.T_camera_world[2, :3] for camera in cameras]
    points = np.array([camera.centre for camera in cameras] + ahead)[:, :2]
    half = 0.55 * max(float(np.ptp(points, axis=0).max()), VIEW_DISTANCE)
    x, y = (points.min(0) + points.max(0)) / 2
    return float(x - half), float(y - half), float(x + half), float(y + half)


def map_cells(corners: tuple[float, float, float, float]) -> Array:
    """Centres (rows, columns, 2) of the map's cells, metres, the greatest y first."""
    x0, y0, x1, y1 = corners
    xs, ys = ((np.arange(n) + 0.5) / n for n in (MAP_COLUMNS, MAP_COLUMNS // 2))
    return np.stack(np.broadcast_arrays(x0 + xs * (x1 - x0), (y1 - ys * (y1 - y0))[:, None]), -1)


def _seen(cameras: Sequence[Camera], corners: tuple[float, float, float, float]) -> Array:
    """Number of cameras that see the whole of a person standing on the floor (Z = 0), for each cell of the map."""
    places = map_cells(corners)
    people = np.concatenate([np.broadcast_to(places[:, :, None], (*places.shape[:2], len(PERSON_HEIGHTS), 2)),
                             np.broadcast_to(np.array(PERSON_HEIGHTS)[:, None], (*places.shape[:2], len(PERSON_HEIGHTS), 1))], -1)
    count = np.zeros(places.shape[:2], int)
    for camera in cameras:
        pixels = camera.project(people)
        inside = (pixels >= 0).all(-1) & (pixels <= np.array(camera.size) - 1).all(-1)  # NaN is not inside
        count += inside.all(-1)
    return count


def _doubts(found: Calibration, middle: Array | None) -> Iterator[str]:
    cameras = found.cameras
    placed = [camera for camera in cameras if camera.oriented]
    if placed:
        yield from _up_doubts([camera for camera in found.shown if camera.oriented])
    gaps = {(a.name, b.name): float(np.linalg.norm(a.centre - b.centre)) for a, b in combinations(placed, 2)}
    if gaps and not found.unit_known and not RIG_EXTENT[0] < max(gaps.values()) < RIG_EXTENT[1]:
        yield (f"the cameras stand up to {max(gaps.values()):.3g} m apart: is that in metres? say what the file's lengths are in: "
               "--unit mm, or unit = \"mm\" in recording.toml")
    same = [pair for pair, gap in gaps.items() if gap < 1e-3]
    if same:
        yield f"cameras {' and '.join(same[0])} stand at the same place: is one of them a copy?"
    for camera in cameras:
        yield from _lens_doubts(camera)
        if middle is not None and len(placed) > 2:
            beside = np.linalg.norm(np.cross(camera.T_camera_world[2, :3], middle - camera.centre)) / np.linalg.norm(middle - camera.centre)
            if beside > MAX_AIM_OFFSET or camera.T_camera_world[2, :3] @ (middle - camera.centre) < 0:
                yield f"camera {camera.name!r} looks past the place that the others look at"


def _up_doubts(cameras: Sequence[Camera]) -> Iterator[str]:
    mean, of_z = up_direction(cameras), upright(cameras)
    if of_z < max(MIN_UP_COSINE, LEVEL_SHARE * np.abs(mean).max()):
        named = {name: float(np.dot(axis, mean)) for name, axis in UPS.items() if axis is not None}
        best = max(named, key=lambda name: named[name])
        up = best if named[best] > MIN_UP_COSINE else "cameras"
        subject = f"its direction {best} is" if up == best else "none of its axes is"
        yield (f"by the pictures the world's Z is not up, {subject}: say so, with --up {up} here and up = \"{up}\" in recording.toml, or "
               f"write it upright: --up {up} --to calibration.toml")
        return
    low = [camera.name for camera in cameras if camera.centre[2] < 0]
    if low:
        yield f"camera{'s' if len(low) > 1 else ''} {', '.join(low)} below the floor, Z = 0: the world's origin is not on the floor"


def _lens_doubts(camera: Camera) -> Iterator[str]:
    aside = np.abs(camera.matrix[:2, 2] / (np.array(camera.size) - 1) - 0.5)
    if (aside > MAX_CENTRE_OFFSET).any():
        x, y = camera.matrix[:2, 2]
        yield (f"camera {camera.name!r}: the principal point {x:.0f}, {y:.0f} is far from the middle of {camera.size[0]} x "
               f"{camera.size[1]} pixels: was it calibrated in pictures of another size?")
    corner = np.abs(np.array([[0, 0], np.array(camera.size) - 1]) - camera.matrix[:2, 2]).max(0) / np.diag(camera.matrix)[:2]
    if camera.reach < 0.9 * float(np.linalg.norm(corner)) and not camera.fisheye:
        share = camera.reach / float(np.linalg.norm(corner))
        yield (f"camera {camera.name!r}: its distortion turns back at {100 * share:.0f} % of the way to the picture's corners: what lies "
               "beyond is seen wrongly; calibrate with the board in the corners, too")
