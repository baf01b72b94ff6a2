"""A calibration in words: where cameras stand, what they look at, what of it they see together, and what is odd about it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.geometry import Array
from shadowpuppet.io.calibration.calibration_files import UPS, Calibration, examine_calibration

PERSON = (0.0, 0.9, 1.8)
"""Heights (metres) at which a standing person must be in the picture to be seen whole."""
UPRIGHT = 0.7
"""Cosine of the mean way up in the pictures to Z under which Z is not up; and to another axis, from which on it is that one."""
SPREADS = (0.3, 30.0)
"""Metres between the cameras farthest apart, beyond which lengths are hardly in metres."""
ASIDE = 0.2
"""How far from the picture's middle, over its size, a principal point is odd."""
PAST = 0.35
"""How far beside the place that all look at a camera may look, over its distance, before that is said."""
AHEAD = 4.0
"""Metres before cameras that the top view takes in where they do not look at one place, and its least side."""
SIDE = 48
"""Columns of the top view, and twice its rows."""


@dataclass(frozen=True, kw_only=True)
class Standpoint:
    """One camera; plain values."""

    name: str
    size: tuple[int, int]
    """Width and height, pixels."""
    fov: tuple[float, float]
    """Across and down, degrees, without distortion."""
    lens: str
    """pinhole, distorted or fisheye."""
    bend: float
    """By how many pixels distortion moves the picture's corners, at most."""
    place: tuple[float, float, float]
    """Metres."""
    facing: float
    """The way it looks, seen from above: degrees counter-clockwise from x."""
    down: float
    """By how many degrees it looks down from the level."""
    roll: float
    """By how many degrees its pictures are turned clockwise about its axis."""
    away: float | None
    """Metres to the place that all look at; None where there is none."""
    placed: bool
    """Whether the file tells where it stands."""


@dataclass(frozen=True, kw_only=True)
class CalibrationLook:
    """What a calibration tells; plain values, so that it can be saved."""

    path: str
    format: str
    unit: str
    """What the file's lengths are in."""
    unit_told: bool
    """Whether the file says so, or the user; metres are taken otherwise."""
    cameras: tuple[Standpoint, ...]
    middle: tuple[float, float, float] | None
    """The place that all look at, nearest to their axes, metres."""
    apart: tuple[float, float] | None
    """Metres between the cameras nearest to each other and those farthest apart."""
    seen: tuple[tuple[int, ...], ...]
    """How many cameras see a standing person whole, by rows of a map from its top (greatest y) and columns from its left."""
    corners: tuple[float, float, float, float]
    """Of the map: least x and y, greatest x and y, metres."""
    notes: tuple[str, ...]
    """How it was read."""
    doubts: tuple[str, ...]
    """What is odd, and the remedy, a sentence each."""


def look_at_calibration(path: str | Path, unit: str | None = None, up: str | None = None) -> tuple[CalibrationLook, Calibration]:
    """What a calibration tells, and its cameras. Raises `CalibrationError`."""
    found = examine_calibration(path, unit, up)
    cameras, middle = found.cameras, meeting_point(found.cameras)
    gaps = [float(np.linalg.norm(a.centre - b.centre)) for a, b in combinations(cameras, 2)]
    corners = _corners(cameras, middle)
    look = CalibrationLook(
        path=str(path), format=found.format, unit=found.unit, unit_told=found.unit_known,
        cameras=tuple(_standpoint(camera, middle) for camera in cameras), middle=_three(middle) if middle is not None else None,
        apart=(min(gaps), max(gaps)) if gaps else None, seen=tuple(map(tuple, _seen(cameras, corners).tolist())), corners=corners,
        notes=found.notes, doubts=tuple(_doubts(found, middle)),
    )  # fmt: skip
    return look, found


def meeting_point(cameras: Sequence[Camera]) -> Array | None:
    """The place (3,) nearest to the cameras' optical axes; None where these are nearly parallel, or it lies behind most of them."""
    axes = np.array([camera.T_camera_world[2, :3] for camera in cameras]).reshape(-1, 3)
    across = np.eye(3) - axes[:, :, None] * axes[:, None, :]
    A, b = across.sum(0), sum((P @ camera.centre for P, camera in zip(across, cameras)), np.zeros(3))
    if len(cameras) < 2 or np.linalg.cond(A) > 1e4:
        return None
    middle = np.linalg.solve(A, b)
    ahead = [axis @ (middle - camera.centre) > 0 for axis, camera in zip(axes, cameras)]
    return middle if 2 * sum(ahead) > len(cameras) else None


def way_up(cameras: Sequence[Camera]) -> Array:
    """What is up in the pictures, on the whole, in the world (3,), at most 1 long."""
    return -np.mean([camera.T_camera_world[1, :3] for camera in cameras], 0)


def _standpoint(camera: Camera, middle: Array | None) -> Standpoint:
    R, (width, height) = camera.T_camera_world[:3, :3], camera.size
    fov = [float(np.degrees(2 * np.arctan(side / 2 / focal))) for side, focal in zip(camera.size, np.diag(camera.matrix))]
    lens = "fisheye" if camera.fisheye else "distorted" if camera.distortion.any() else "pinhole"
    away = float(np.linalg.norm(middle - camera.centre)) if middle is not None else None
    return Standpoint(
        name=camera.name, size=(width, height), fov=(fov[0], fov[1]), lens=lens, bend=_bend(camera), place=_three(camera.centre),
        facing=float(np.degrees(np.arctan2(R[2, 1], R[2, 0]))),
        down=float(np.degrees(-np.arcsin(np.clip(R[2, 2], -1, 1)))), roll=float(np.degrees(np.arctan2(-R[0, 2], -R[1, 2]))), away=away,
        placed=camera.oriented,
    )  # fmt: skip


def _bend(camera: Camera) -> float:
    """Pixels by which distortion moves the corners of the picture."""
    if not (camera.fisheye or camera.distortion.any()):
        return 0.0
    width, height = camera.size
    corners = np.array([[0, 0, 1], [width - 1, 0, 1], [0, height - 1, 1], [width - 1, height - 1, 1]], float)
    seen = replace(camera, T_camera_world=np.eye(4)).project(corners @ np.linalg.inv(camera.matrix).T)
    return float(np.linalg.norm(seen - corners[:, :2], axis=1).max())


def _three(values: Array) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z


def _corners(cameras: Sequence[Camera], middle: Array | None) -> tuple[float, float, float, float]:
    """A square about all that stands in the map."""
    ahead = [middle] if middle is not None else [camera.centre + AHEAD * camera.T_camera_world[2, :3] for camera in cameras]
    points = np.array([camera.centre for camera in cameras] + ahead)[:, :2]
    half = 0.55 * max(float(np.ptp(points, axis=0).max()), AHEAD)
    x, y = (points.min(0) + points.max(0)) / 2
    return float(x - half), float(y - half), float(x + half), float(y + half)


def cells(corners: tuple[float, float, float, float]) -> Array:
    """Middles (SIDE / 2, SIDE, 2) of the map's cells, metres, the greatest y first."""
    x0, y0, x1, y1 = corners
    xs, ys = ((np.arange(n) + 0.5) / n for n in (SIDE, SIDE // 2))
    return np.stack(np.broadcast_arrays(x0 + xs * (x1 - x0), (y1 - ys * (y1 - y0))[:, None]), -1)


def _seen(cameras: Sequence[Camera], corners: tuple[float, float, float, float]) -> Array:
    """How many cameras see a person whole who stands on the floor, Z = 0, by cells of the map."""
    places = cells(corners)
    people = np.concatenate([np.broadcast_to(places[:, :, None], (*places.shape[:2], len(PERSON), 2)),
                             np.broadcast_to(np.array(PERSON)[:, None], (*places.shape[:2], len(PERSON), 1))], -1)
    count = np.zeros(places.shape[:2], int)
    for camera in cameras:
        pixels = camera.project(people)
        inside = (pixels >= 0).all(-1) & (pixels <= np.array(camera.size) - 1).all(-1)  # not a number is not inside
        count += inside.all(-1)
    return count


def _doubts(found: Calibration, middle: Array | None) -> Iterator[str]:
    cameras = found.cameras
    placed = [camera for camera in cameras if camera.oriented]
    if placed:
        yield from _up_doubts(placed)
    gaps = {(a.name, b.name): float(np.linalg.norm(a.centre - b.centre)) for a, b in combinations(placed, 2)}
    if gaps and not found.unit_known and not SPREADS[0] < max(gaps.values()) < SPREADS[1]:
        yield (f"the cameras stand up to {max(gaps.values()):.3g} m apart: is that in metres? say what the file's lengths are in: "
               "--unit mm, or unit = \"mm\" in recording.toml")
    same = [pair for pair, gap in gaps.items() if gap < 1e-3]
    if same:
        yield f"cameras {' and '.join(same[0])} stand at the same place: is one of them a copy?"
    for camera in cameras:
        yield from _lens_doubts(camera)
        if middle is not None and len(placed) > 2:
            beside = np.linalg.norm(np.cross(camera.T_camera_world[2, :3], middle - camera.centre)) / np.linalg.norm(middle - camera.centre)
            if beside > PAST or camera.T_camera_world[2, :3] @ (middle - camera.centre) < 0:
                yield f"camera {camera.name!r} looks past the place that the others look at"


def _up_doubts(cameras: Sequence[Camera]) -> Iterator[str]:
    mean = way_up(cameras)
    if mean[2] < UPRIGHT:
        named = {name: float(np.dot(axis, mean)) for name, axis in UPS.items() if axis is not None}
        best = max(named, key=lambda name: named[name])
        up = best if named[best] > UPRIGHT else "cameras"
        told = f"its direction {best} is" if up == best else "none of its axes is"
        yield (f"by the pictures the world's Z is not up, {told}: say so, with --up {up} here and up = \"{up}\" in recording.toml, or "
               f"write it upright: --up {up} --to calibration.toml")
        return
    low = [camera.name for camera in cameras if camera.centre[2] < 0]
    if low:
        yield f"camera{'s' if len(low) > 1 else ''} {', '.join(low)} below the floor, Z = 0: the world's origin is not on the floor"


def _lens_doubts(camera: Camera) -> Iterator[str]:
    aside = np.abs(camera.matrix[:2, 2] / (np.array(camera.size) - 1) - 0.5)
    if (aside > ASIDE).any():
        x, y = camera.matrix[:2, 2]
        yield (f"camera {camera.name!r}: the principal point {x:.0f}, {y:.0f} is far from the middle of {camera.size[0]} x "
               f"{camera.size[1]} pixels: was it calibrated in pictures of another size?")
    corner = np.abs(np.array([[0, 0], np.array(camera.size) - 1]) - camera.matrix[:2, 2]).max(0) / np.diag(camera.matrix)[:2]
    if camera.reach < 0.9 * float(np.linalg.norm(corner)) and not camera.fisheye:
        share = camera.reach / float(np.linalg.norm(corner))
        yield (f"camera {camera.name!r}: its distortion turns back at {100 * share:.0f} % of the way to the picture's corners: what lies "
               "beyond is seen wrongly; calibrate with the board in the corners, too")
