"""Is the world's Z up? A person who walks does not lie, nor stand on the head, in all that is seen of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import RUINOUS, Finding
from shadowpuppet.geometry import Array
from shadowpuppet.pipeline.findings.scale import Moment, is_slender
from shadowpuppet.threads import one_blas_thread
from shadowpuppet.tracking.multiview.seen_stature import person_points, seen_stature
from shadowpuppet.tracking.multiview.settings import MultiviewSettings

END = 0.1
"""Share of the height that counts as its upper and its lower end: head, and feet."""
WALKED = 0.2
"""Least way of the middle of a person who walks, over the height."""
UPSIDE_DOWN = np.diag([1.0, -1.0, -1.0, 1.0])
"""The motion (4, 4) of the world that turns it over."""


@one_blas_thread()
def up_caution(cameras: Sequence[Camera], moments: Sequence[Moment], settings: MultiviewSettings) -> Finding | None:
    """A word on a world whose Z is not up, by moments of a person who walks; None if it may be up.

    Feet are spread and a head is not; where the upper end is the wider one, a body is fitted both ways, too.
    """
    points = [person_points(cameras, moment.masks, settings.hull).points for moment in moments]
    if len(moments) < 2 or not all(is_slender(moment.extents) and len(each) for moment, each in zip(moments, points)):
        return None
    middles, height = np.array([each.mean(0) for each in points]), float(np.median([moment.extents[0] for moment in moments]))
    if np.linalg.norm(np.ptp(middles, axis=0)) < WALKED * height:
        return None
    axes = np.array([np.linalg.svd(each - middle, full_matrices=False)[2][0] for each, middle in zip(points, middles)])
    if (np.abs(axes[:, 2]) < 0.5**0.5).all():
        along = "xyz"[int(np.abs(axes).mean(0).argmax())]
        return _caution("lies in all frames of a walk", f"{along} or -{along}")
    on_head = (axes[:, 2] ** 2 > 0.5).all() and all(map(_is_top_heavy, points))
    if on_head and _fits_turned_over(cameras, moments[len(moments) // 2], settings):
        return _caution("stands on the head in all frames of a walk", "-z")
    return None


def _is_top_heavy(points: Array) -> bool:
    """Whether the upper end of surface points (P, 3) is spread more than the lower one."""
    low, high = np.percentile(points[:, 2], [1, 99])
    ends = [points[points[:, 2] > high - END * (high - low)], points[points[:, 2] < low + END * (high - low)]]
    return float(ends[0][:, :2].std(0).max()) > float(ends[1][:, :2].std(0).max())


def _fits_turned_over(cameras: Sequence[Camera], moment: Moment, settings: MultiviewSettings) -> bool:
    """Whether a body fits a moment better in the world turned over."""
    over = [replace(camera, T_camera_world=camera.T_camera_world @ UPSIDE_DOWN) for camera in cameras]
    here, there = (seen_stature(np.random.default_rng(0), world, moment.masks, settings) for world in (cameras, over))
    return there is not None and (here is None or there.overlap > here.overlap)


def _caution(what: str, up: str) -> Finding:
    return Finding(f"the person {what}: the calibration's Z is not up, it seems; say up = \"{up}\" in recording.toml, or write the "
                   "calibration upright: `shadowpuppet info calibration.toml --up ... --to up.toml`",
                   f"Z is not up, it seems: up = \"{up}\"", RUINOUS)
