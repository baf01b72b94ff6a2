"""A plot of a batch's errors and overlaps; needs the extra `report`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from shadowpuppet.errors import ShadowPuppetError, reason
from shadowpuppet.pipeline.batch.summary import BatchRun

MEASURES = ((("errors", "mean_mm"), "mean joint error, mm"), (("overlap", "mean"), "mean overlap with the silhouettes"))
"""Measures that are drawn: keys in metrics.json, and labels."""
COLOURS = ("#1b6ca8", "#d1495b", "#3a7d44", "#b07d12", "#6a4c93", "#4d4d4d")
MAX_ROWS = 60
"""Greatest number of rows in a plot; further ones are left out, and the title says so."""


def can_plot() -> bool:
    """Whether Matplotlib is installed."""
    return find_spec("matplotlib") is not None


def rows_of(runs: Sequence[BatchRun]) -> dict[tuple[str, str], list[BatchRun]]:
    """Runs grouped by recording and settings; those of a group differ in their seed."""
    rows: dict[tuple[str, str], list[BatchRun]] = {}
    for run in runs:
        rows.setdefault((run.task.name, run.task.choice), []).append(run)
    return rows


def measured(run: BatchRun, place: Sequence[str]) -> float:
    """The number at keys `place` of a run's metrics; NaN if there is none."""
    value: Any = run.metrics
    for key in place:
        value = value.get(key) if isinstance(value, Mapping) else None
    return float(value) if isinstance(value, (int, float)) else np.nan


def plot_batch(runs: Sequence[BatchRun], path: Path) -> None:
    """Plot error and overlap to a .png, .pdf or .svg file: a row for each recording and settings, a point per run, median and quartiles.

    Raises `ShadowPuppetError` if it cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    rows = rows_of(runs)
    shown = dict(list(rows.items())[:MAX_ROWS])
    measures = [m for m in MEASURES if any(np.isfinite(measured(run, m[0])) for run in runs)] or [MEASURES[-1]]
    figure = Figure(figsize=(2.5 + 4.2 * len(measures), 1.3 + 0.3 * len(shown)), layout="constrained")
    FigureCanvasAgg(figure)
    names = list(dict.fromkeys(name for name, _ in rows))
    panels = figure.subplots(1, len(measures), squeeze=False, sharey=True)[0]
    for axes, (place, label) in zip(panels, measures):
        for y, ((name, _), of) in enumerate(shown.items()):
            _row(axes, y, np.array([measured(run, place) for run in of]), COLOURS[names.index(name) % len(COLOURS)])
        axes.set_xlabel(label)
        axes.grid(axis="x", alpha=0.3)
        axes.spines[["top", "right", "left"]].set_visible(False)
        axes.tick_params(axis="y", length=0)
        axes.set_yticks(range(len(shown)), [_label(key, of, len(names) > 1) for key, of in shown.items()], fontsize=8)
    panels[0].set_ylim(len(shown) - 0.4, -0.6)
    done = sum(run.status == "done" for run in runs)
    left_out = f"; {len(rows) - MAX_ROWS} more rows in the table" if len(rows) > MAX_ROWS else ""
    of = f" of {names[0]}" if len(names) == 1 else ""
    figure.suptitle(f"{done} of {len(runs)} runs{of}; a point each, line: median, bar: quartiles{left_out}", fontsize=9)
    try:
        figure.savefig(path, dpi=110)
    except OSError as error:
        raise ShadowPuppetError(f"{path}: cannot be written ({reason(error)})") from None


def _row(axes: Any, y: int, values: np.ndarray, colour: str) -> None:
    values = values[np.isfinite(values)]
    if not len(values):
        axes.plot([], [])
        return
    offsets = 0.5 * (0.618034 * np.arange(len(values)) % 1) - 0.25  # so that points do not hide each other
    axes.plot(values, y + offsets, "o", color=colour, ms=3.5, alpha=0.45 if len(values) > 20 else 0.7, mew=0)
    low, middle, high = np.percentile(values, (25, 50, 75))
    axes.barh(y, high - low, 0.62, low, color=colour, alpha=0.18, lw=0)
    axes.plot([middle, middle], [y - 0.36, y + 0.36], color=colour, lw=2)


def _label(key: tuple[str, str], runs: Sequence[BatchRun], several: bool) -> str:
    name, choice = key
    done = sum(run.status == "done" for run in runs)
    said = ", ".join(filter(None, [name if several or not choice else "", choice]))
    return said if done == len(runs) else f"{said}\n{done} of {len(runs)}"
