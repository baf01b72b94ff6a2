"""Is the world's Z up? A person who walks does not lie, nor stand on the head, in all that is seen of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import RUINOUS, Finding
from shadowpuppet.geometry import Array
from shadowpuppet.io.calibration.calibration_files import rotated_up
from shadowpuppet.pipeline.findings.scale import Moment
from shadowpuppet.threads import one_blas_thread
from shadowpuppet.tracking.multiview.seen_stature import seen_stature
from shadowpuppet.tracking.multiview.settings import MultiviewSettings

END = 0.1
"""Share of the height that counts as its upper and its lower end: head, and feet."""
WALKED = 0.2
"""Least way of the middle of a person who walks, over the height."""


@one_blas_thread()
def up_caution(cameras: Sequence[Camera], moments: Sequence[Moment], settings: MultiviewSettings) -> Finding | None:
    """A word on a world whose Z is not up, by moments of a person who walks; None if it may be up.

    Feet are spread and a head is not; where the upper end is the wider one, a body must also fit a moment better in the world turned over.
    Of a person who lies, a fitted body tells which end is the head: a lying body fits, too.
    """
    slender = [moment for moment in moments if moment.is_slender]
    if len(slender) < 2 or 2 * len(slender) <= len(moments):
        return None
    points, height = [moment.points for moment in slender], float(np.median([moment.extents[0] for moment in slender]))
    middles = np.array([each.mean(0) for each in points])
    way = float(np.linalg.norm(np.ptp(middles, axis=0)))
    if way < WALKED * height:
        return None
    axes = np.array([np.linalg.svd(each - middle, full_matrices=False)[2][0] for each, middle in zip(points, middles)])
    off = np.degrees(np.arccos(np.minimum(np.abs(axes[:, 2]), 1)))
    along = "xyz"[int(np.abs(axes).mean(0).argmax())]
    lies = off > 45
    if lies.all():
        seen, ups = "lies in all frames of a walk of {way:.1f} m, {off:.0f} degrees off Z", (along, f"-{along}")
    elif not lies.any() and 2 * sum(map(_is_top_heavy, points)) > len(points):
        seen, ups = "stands on the head in all frames of a walk of {way:.1f} m", ("z", "-z")
    else:
        return None
    overlaps = _overlaps(cameras, slender[len(slender) // 2], settings, ups)
    up, fits = max(overlaps, key=lambda each: overlaps[each]), ", ".join(f"{each} up {value:.2f}" for each, value in overlaps.items())
    if up == "z" or not overlaps[up]:
        return None
    return Finding.of(f"the person {seen}: the calibration's Z is not up, it seems (a body overlaps the silhouettes with {{fits}}); say "
                      "up = \"{up}\" in recording.toml, or write the calibration upright: `shadowpuppet info calibration.toml --up {up} "
                      "--to up.toml`", "Z is not up, it seems: up = \"{up}\"", RUINOUS,
                      up=up, fits=fits, way=way, off=float(np.median(off)))


def _is_top_heavy(points: Array) -> bool:
    """Whether the upper end of surface points (P, 3) is spread more than the lower one."""
    low, high = np.percentile(points[:, 2], [1, 99])
    ends = [points[points[:, 2] > high - END * (high - low)], points[points[:, 2] < low + END * (high - low)]]
    return float(ends[0][:, :2].std(0).max()) > float(ends[1][:, :2].std(0).max())


def _overlaps(cameras: Sequence[Camera], moment: Moment, settings: MultiviewSettings, ups: Sequence[str]) -> dict[str, float]:
    """Overlap of silhouettes and a body fitted to a moment in worlds whose directions `ups` are up; 0 where none fits."""
    fits = {up: seen_stature(np.random.default_rng(0), rotated_up(tuple(cameras), up), moment.masks, settings) for up in ups}
    return {up: 0.0 if fit is None else fit.overlap for up, fit in fits.items()}
