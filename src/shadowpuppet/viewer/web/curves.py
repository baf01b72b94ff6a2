"""A plot of curves around the current time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from shadowpuppet.geometry import Array
from shadowpuppet.viewer.scene.scene import Chart

if TYPE_CHECKING:
    import viser

AROUND = 3.0
"""Seconds plotted before and after the current time."""
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7a7a7a", "#a6761d", "#6a3d9a")
HEIGHT = 170
"""Pixels."""


class CurvePlot:
    """A plot of one chart, chosen by the user."""

    def __init__(self, server: viser.ViserServer, charts: Sequence[Chart], first: Chart) -> None:
        """`first`: the chart shown at first."""
        self.server, self.charts, self.now = server, {chart.name: chart for chart in charts}, 0.0
        self.folder = server.gui.add_folder(None)
        with self.folder:
            self.choice = server.gui.add_dropdown("of", tuple(self.charts), initial_value=first.name)
        self.plot: Any = None
        self.choice.on_update(lambda _: self._replace())
        self._replace()

    @property
    def chart(self) -> Chart:
        """The chosen chart."""
        return self.charts[self.choice.value]

    def to(self, now: float) -> None:
        """Plot the curves around the time `now`, seconds."""
        self.now = now
        self.plot.data = data_around(self.chart, now)

    def _replace(self) -> None:
        """Replace the plot by that of the chosen chart."""
        chart, low, high = self.chart, *limits(self.chart)
        names = list(chart.curves)[: len(COLOURS)]
        series = [{"label": "s"}, *({"label": name, "stroke": COLOURS[n], "width": 1.6, "points": {"show": False}} for n, name in
                  enumerate(names)), {"label": "now", "stroke": "#333333", "width": 1.2, "points": {"show": False}}]  # fmt: skip
        with self.folder:
            plot = self.server.gui.add_uplot(
                data_around(chart, self.now), tuple(series), title=f"{chart.name}, {chart.unit}", height=HEIGHT,  # pyright: ignore[reportArgumentType]
                scales={"x": {"time": False}, "y": {"range": (low, high)}}, legend={"show": len(names) <= 4, "live": False},
                padding=(4, 8, 0, 0))  # fmt: skip
        if self.plot is not None:
            self.plot.remove()
        self.plot = plot


def limits(chart: Chart) -> tuple[float, float]:
    """Least and greatest plotted value, with a margin."""
    known = np.concatenate([values[np.isfinite(values)] for values in chart.curves.values()] or [np.zeros(1)])
    low, high = (float(known.min()), float(known.max())) if len(known) else (0.0, 1.0)
    low = min(low, 0.0) if chart.unit in ("mm", "of 1") else low
    margin = 0.06 * max(high - low, 1e-3)
    return low - margin * (low < 0 or chart.unit not in ("mm", "of 1")), high + margin


def data_around(chart: Chart, now: float) -> tuple[Array, ...]:
    """Times (K,), the curves' values at them, and a vertical line at `now`: NaN except at two equal times."""
    low, high = limits(chart)
    near = np.flatnonzero(np.abs(chart.times - now) <= AROUND)
    before, after = near[chart.times[near] <= now], near[chart.times[near] > now]
    times = np.concatenate([[now - AROUND], chart.times[before], [now, now], chart.times[after], [now + AROUND]])
    curves, none = [], np.full(1, np.nan)
    for values in list(chart.curves.values())[: len(COLOURS)]:
        here = np.repeat(values[before[-1:]] if len(before) else none, 2)
        curves.append(np.concatenate([none, values[before], here, values[after], none]))
    line = np.full(len(times), np.nan)
    line[len(before) + 1 : len(before) + 3] = low, high
    return (times, *curves, line)
