"""Figures of a gait: mean, spread and stated interval of each quantity, by side."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from shadowpuppet.body.skeleton import SIDES
from shadowpuppet.geometry import Array
from shadowpuppet.io.intervals import HALF_WIDTH
from shadowpuppet.motion.contact.steps import Gait


class Spread(NamedTuple):
    """A quantity over steps or strides."""

    number: int
    mean: float
    sd: float
    """Over the steps or strides; NaN for fewer than two."""
    stated: float
    """Half width of the 90 % interval of one step or stride by the run's own statement, which holds for the mean, too: errors of
    neighbouring frames are alike. NaN for times, whose error is not stated."""


class GaitParameter(NamedTuple):
    """A quantity of a gait."""

    name: str
    unit: str
    left: Spread
    right: Spread
    both: Spread

    @property
    def symmetry(self) -> float:
        """Symmetry index, %: left less right, over their mean (Robinson, Herzog and Nigg 1987). NaN if a side is unknown."""
        middle = (self.left.mean + self.right.mean) / 2
        return 100 * (self.left.mean - self.right.mean) / middle if middle else np.nan


class _Quantity(NamedTuple):
    name: str
    unit: str
    of: Callable[[Any], float]
    """Of a `Step` or a `Stride`."""
    sd: Callable[[Any], float] | None = None


_STEPS = (_Quantity("step length", "m", lambda s: s.length, lambda s: s.length_sd),
          _Quantity("step width", "m", lambda s: s.width, lambda s: s.width_sd),
          _Quantity("step time", "s", lambda s: s.end - s.begin))
_STRIDES = (_Quantity("stride length", "m", lambda s: s.length, lambda s: s.length_sd),
            _Quantity("stride time", "s", lambda s: s.end - s.begin),
            _Quantity("cadence", "steps/min", lambda s: 120 / (s.end - s.begin)),
            _Quantity("speed", "m/s", lambda s: s.length / (s.end - s.begin), lambda s: s.length_sd / (s.end - s.begin)),
            _Quantity("stance", "%", lambda s: 100 * s.stance))


def gait_figures(gait: Gait) -> list[GaitParameter]:
    """All quantities of a gait; none without a full stride."""
    if not gait.strides:
        return []
    return [_figure(each, of) for of, quantities in ((gait.strides, _STRIDES), (gait.counted, _STEPS)) for each in quantities]


def _figure(quantity: _Quantity, of: Sequence[Any]) -> GaitParameter:
    by_side = {side: [each for each in of if each.side == side] for side in SIDES}
    return GaitParameter(quantity.name, quantity.unit, *(_spread(quantity, own) for own in (*by_side.values(), of)))


def _spread(quantity: _Quantity, of: Sequence[Any]) -> Spread:
    values = np.array([quantity.of(each) for each in of])
    if not len(values):
        return Spread(0, np.nan, np.nan, np.nan)
    sd = np.array([np.nan if quantity.sd is None else quantity.sd(each) for each in of])
    return Spread(len(values), float(values.mean()), spread_of(values), float(HALF_WIDTH * np.sqrt((sd**2).mean())))


def spread_of(values: Array) -> float:
    """Standard deviation of values (N,); NaN for fewer than two."""
    return float(values.std(ddof=1)) if len(values) > 1 else np.nan
