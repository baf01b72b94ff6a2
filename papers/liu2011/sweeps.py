"""What the sweeps share: the tracker run many times at each of some settings, and what is measured of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from papers.common.plotting import COLOURS, label
from papers.liu2011.repeats import FAR, LOST, Runs
from shadowpuppet.geometry import Array
from shadowpuppet.motion.metrics import UPPER_JOINTS

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class Measured(NamedTuple):
    """Of R runs with one choice of settings, a number each, (R,)."""

    error: Array
    """Mean 3D error of shoulders, elbows and hands (base of the fingers), mm."""
    cost: Array
    """Mean 2D error, pixels."""
    far: Array
    """Share of these joints that is far off, percent."""
    lost: Array
    """Share of frames that are lost, percent."""


NAMES = {"error": "3D error (mm)", "cost": "2D error (pixels)", "far": "joints over 30 cm off (%)", "lost": "frames lost (%)"}
COLUMNS = tuple(f"{name}{what}" for name in Measured._fields for what in ("", "_se"))
"""Of a table: mean and standard error of each."""


def measured(runs: Runs) -> Measured:
    """What is told of each run."""
    errors = runs.errors(UPPER_JOINTS)
    return Measured(1000 * np.nanmean(errors, axis=(1, 2)), runs.costs.mean(1), 100 * (errors > FAR).mean((1, 2)),
                    100 * (runs.overlaps < LOST).mean(1))


def cells(values: Measured) -> list[float]:
    """Mean and standard error of each, as `COLUMNS`."""
    return [float(value) for each in values for value in (each.mean(), _error(each))]


def plot(axes: Axes, x: Sequence[float], points: Sequence[Measured], what: str, n: int, **how: Any) -> None:
    """A line of means with standard errors, in the n-th colour."""
    values = [getattr(each, what) for each in points]
    axes.errorbar(x, [each.mean() for each in values], [_error(each) for each in values], fmt=".-", color=COLOURS[n], linewidth=1,
                  capsize=2, **how)


def finish(panels: Sequence[Axes], whats: Sequence[str], x: str, title: str) -> None:
    """Names of the axes, from zero on; the legend in the first, the title above it."""
    for n, (axes, what) in enumerate(zip(panels, whats)):
        axes.set_ylim(bottom=0)
        label(axes, x, NAMES[what], title if n == 0 else "", legend=n == 0)


def _error(values: Array) -> float:
    return float(values.std(ddof=1) / np.sqrt(len(values))) if len(values) > 1 else np.nan
