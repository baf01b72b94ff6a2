"""How the charts of the pages are drawn: colours, figures as SVG, long series reduced."""

from __future__ import annotations

import io
import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from shadowpuppet.geometry import Array

# Colours that colour-blind people can tell apart: Okabe & Ito 2008.
BLUE, ORANGE, GREEN, PINK, GREY = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#8a8f98"
SIDES = {"left": GREEN, "right": PINK}
READABLE = 1.1
"""Least size at which charts are shown: narrower pages scroll them sideways, so that letters stay readable."""
POINTS = 1200
"""Greatest number of points of a line; more do not show."""
INK = "#2b2f36"
STYLE = {"svg.fonttype": "none", "font.size": 9.5, "axes.edgecolor": "#c4c9d0", "axes.labelcolor": INK, "text.color": INK,
         "xtick.color": "#5b6470", "ytick.color": "#5b6470", "axes.grid": True, "grid.color": "#e6e9ed", "grid.linewidth": 0.8,
         "axes.axisbelow": True, "axes.spines.top": False, "axes.spines.right": False, "legend.frameon": False, "legend.fontsize": 9,
         "lines.linewidth": 1.5}  # fmt: skip


class Drawing:
    """Context of a matplotlib figure with panels, in our style."""

    def __init__(self, name: str, size: tuple[float, float], rows: int = 1, ratios: Sequence[float] = (1,),
                 columns: int | None = None) -> None:
        """`name`: of the figure, for its ids; `size`: inches; `rows` of panels with `ratios` of heights; `columns`: None for one, whose
        panels then are a plain array."""
        from matplotlib import rc_context

        style: dict[Any, Any] = {**STYLE, "svg.hashsalt": name}
        self._context = rc_context(style)
        self._size, self._rows, self._ratios, self._columns = size, rows, ratios, columns

    def __enter__(self) -> tuple[Any, Any]:
        from matplotlib.backends.backend_svg import FigureCanvasSVG
        from matplotlib.figure import Figure

        self._context.__enter__()
        figure = Figure(figsize=self._size, layout="constrained")
        FigureCanvasSVG(figure)
        return figure, figure.subplots(self._rows, self._columns or 1, height_ratios=self._ratios, squeeze=self._columns is None)

    def __exit__(self, *error: Any) -> None:
        self._context.__exit__(*error)


def svg(figure: Any, name: str) -> str:
    """The figure's SVG without header and metadata, with unique ids."""
    out = io.StringIO()
    figure.savefig(out, format="svg", transparent=True, dpi=150, metadata={"Date": None, "Creator": None})
    text = out.getvalue()
    text = re.sub(r"\s*<metadata>.*?</metadata>", "", text[text.index("<svg") :], flags=re.DOTALL)
    text = re.sub(r'(\bid="|"#|url\(#)', lambda found: f"{found[1]}{name}-", text)
    least = READABLE * 72 * figure.get_size_inches()[0]
    return re.sub(r'<svg [^>]*?viewBox="([^"]*)"[^>]*>', rf'<svg viewBox="\1" style="min-width:{least:.0f}px" role="img" '
                  r'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink">', text, count=1)


def binned(times: Array, series: Sequence[Array]) -> tuple[Array, ...]:
    """Times and series (T,) reduced to `POINTS` means of neighbours."""
    if len(times) <= POINTS:
        return (times, *series)
    groups = np.arange(len(times)) * POINTS // len(times)

    def mean(values: Array) -> Array:
        known = np.isfinite(values)
        counts = np.bincount(groups[known], minlength=POINTS)
        return np.where(counts > 0, np.bincount(groups[known], values[known], POINTS) / np.maximum(counts, 1), np.nan)

    return (mean(times), *(mean(np.asarray(values)) for values in series))


def span(*times: Array) -> tuple[float, float]:
    """Least and greatest of times; for a single one half a second to both sides."""
    known = np.concatenate(times)
    low, high = float(known.min()), float(known.max())
    return (low, high) if high > low else (low - 0.5, high + 0.5)
