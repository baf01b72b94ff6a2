"""How the charts of the pages are drawn: colours, figures as SVG, long series reduced."""

from __future__ import annotations

import contextlib
import io
import re
from collections.abc import Iterable, Iterator, Sequence
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


@contextlib.contextmanager
def drawing(name: str, size: tuple[float, float], rows: int = 1, ratios: Sequence[float] = (1,),
            columns: int | None = None) -> Iterator[tuple[Any, Any]]:
    """A matplotlib figure with panels, in our style: `name`: of the figure, for its ids; `size`: inches; `rows` of panels with `ratios` of
    heights; `columns`: None for one, whose panels then are a plain array."""
    from matplotlib import rc_context
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    style: dict[Any, Any] = {**STYLE, "svg.hashsalt": name}
    with rc_context(style):
        figure = Figure(figsize=size, layout="constrained")
        FigureCanvasSVG(figure)
        yield figure, figure.subplots(rows, columns or 1, height_ratios=ratios, squeeze=columns is None)


def legend_above(figure: Any, panels: Iterable[Any], **more: Any) -> None:
    """A legend above all panels, each label once."""
    drawn = {label: handle for axes in panels for handle, label in zip(*axes.get_legend_handles_labels())}
    figure.legend(drawn.values(), drawn.keys(), loc="outside upper center", ncols=len(drawn), **more)


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
