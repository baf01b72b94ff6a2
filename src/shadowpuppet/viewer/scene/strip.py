"""A whole run at a glance: status of every limb, width of the intervals, overlap and error in each frame, and its doubtful moments."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.geometry import Array
from shadowpuppet.io.intervals import HALF_WIDTH
from shadowpuppet.motion.motion import STATUSES
from shadowpuppet.motion.synchronization import nearest, step_of
from shadowpuppet.viewer.scene.scene import Chart, SceneFigure, Stage

APART = 0.25
"""Seconds without doubt that end a doubtful moment."""


class Strip(NamedTuple):
    """A figure over all frames of a scene's timeline."""

    name: str
    limbs: tuple[str, ...]
    """Limbs with a status; a figure with statuses of frames alone has `whole body`."""
    status: NDArray[np.int8]
    """Index in `STATUSES`, of shape (T, limbs); -1: no frame."""
    width: Array
    """Widest 90 % interval of any joint along any axis, millimetres, of shape (T,); NaN where none is stated."""
    overlap: Array
    """0..1, of shape (T,)."""
    error: Array
    """Mean joint error, millimetres, of shape (T,)."""

    @property
    def doubtful(self) -> NDArray[np.bool_]:
        """Frames (T,) with a limb that is not vouched for."""
        return np.asarray((self.status > STATUSES.index("tracked")).any(1))


def strips_of(scene: Stage) -> list[Strip]:
    """A strip for each figure that has statuses."""
    figures = [figure for figure in scene.figures if figure.status is not None]
    charts = {chart.name: chart for chart in scene.charts}
    return [_strip(scene, figure, charts.get("error"), k) for k, figure in enumerate(figures)]


def doubtful_moments(scene: Stage) -> list[int]:
    """Frames of the timeline at which doubtful moments begin."""
    doubtful = [strip.doubtful for strip in strips_of(scene)]
    frames = np.flatnonzero(np.logical_or.reduce(doubtful)) if doubtful else np.zeros(0, int)
    return [int(n) for k, n in enumerate(frames) if k == 0 or scene.times[n] - scene.times[frames[k - 1]] > APART]


def nearest_frames(times: Array, wanted: Array) -> NDArray[np.int64]:
    """Index of the nearest of `times` (K,), seconds, for each of `wanted` (T,); -1 where none is within a step."""
    found = nearest(times, wanted)
    return np.where(np.abs(times[found] - wanted) <= step_of(times), found, -1)


def _strip(scene: Stage, figure: SceneFigure, errors: Chart | None, k: int) -> Strip:
    assert figure.status is not None
    frames = nearest_frames(figure.times, scene.times)
    limbs = figure.limbs if figure.limb_status is not None else ("whole body",)
    names = figure.limb_status if figure.limb_status is not None else figure.status[:, None]
    codes = np.searchsorted(np.sort(STATUSES), names)
    status = np.argsort(STATUSES)[codes].astype(np.int8)[frames]
    status[frames < 0] = -1
    width = np.full(len(figure.times), np.nan)
    if figure.joint_sd is not None:
        sd = figure.joint_sd.reshape(len(width), -1)
        stated = np.isfinite(sd).any(1)
        width[stated] = 2000 * HALF_WIDTH * np.nanmax(sd[stated], 1)
    overlap = np.full(len(width), np.nan) if figure.overlap is None else figure.overlap
    return Strip(figure.name, tuple(limb.replace("_", " ") for limb in limbs), status, _at(width, frames), _at(overlap, frames),
                 _errors(scene, errors, k))  # fmt: skip


def _at(values: Array, frames: NDArray[np.int64]) -> Array:
    return np.where(frames < 0, np.nan, values[frames])


def _errors(scene: Stage, errors: Chart | None, k: int) -> Array:
    """Errors of the k-th figure at the timeline's frames: the first curve is the first's, `mean, beside` the second's."""
    name = ("mean", "mean, beside")[k] if k < 2 else ""
    if errors is None or name not in errors.curves or not len(errors.times):
        return np.full(len(scene.times), np.nan)
    return _at(errors.curves[name], nearest_frames(errors.times, scene.times))
