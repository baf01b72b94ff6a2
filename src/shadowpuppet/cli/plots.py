"""Plots, for which the extra `report` is needed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from shadowpuppet.errors import ShadowPuppetError

AXES = {"particles": "particles in a call", "width": "width of the picture, pixels (4:3)", "cards": "cards of cardbox that are drawn"}
COLOURS = {"cardbox": "#1b6ca8", "boxes": "#d1495b", "rounded": "#3a7d44"}


SEVERAL = {"particles": "particles", "points": "surface points", "cameras": "cameras"}
KINDS = {"forces": ("forces", "#d1495b"), "gauss_newton": ("Gauss-Newton", "#1b6ca8"), "hull": ("visual hull", "#3a7d44")}


def plot_curves(curves: Mapping[str, Any], path: Path) -> None:
    """Microseconds a particle against each axis of `bench.curves.curves`, and milliseconds against those of `bench.multi.curves` below,
    into a .png, .pdf or .svg. Raises `ShadowPuppetError`."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    rows = 2 if "multi" in curves else 1
    figure = Figure(figsize=(11, 3.4 * rows), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(rows, len(AXES), squeeze=False)
    for axes, (name, label) in zip(panels[0], AXES.items()):
        lines = {body: (curves[name][body], colour) for body, colour in COLOURS.items() if body in curves[name]}
        _panel(axes, curves[name]["values"], label, lines, log=name != "cards")
    panels[0, 0].set_ylabel("microseconds a particle")
    for axes, (name, label) in zip(panels[1], SEVERAL.items()) if rows > 1 else ():
        known = curves["multi"][name]
        lines = {said: (known[kind], colour) for kind, (said, colour) in KINDS.items() if kind in known}
        _panel(axes, known["values"], label, lines, log=False)
        axes.set_ylabel("ms a frame" if name == "cameras" else "ms for ten iterations")
    try:
        figure.savefig(path, dpi=110)
    except OSError as error:
        raise ShadowPuppetError(f"{path}: cannot be written ({(error.strerror or str(error)).lower()})") from None


def _panel(axes: Any, values: Sequence[float], label: str, lines: Mapping[str, tuple[Sequence[float], str]], log: bool) -> None:
    """One of the plots: what is measured against `values`, a line each."""
    for name, (measured, colour) in lines.items():
        axes.plot(values, measured, ".-", color=colour, label=name)
    if log:
        axes.set_xscale("log")
        axes.minorticks_off()
    else:
        axes.set_xlim(left=0)
    axes.set_xticks(values, [str(value) for value in values], fontsize=7, rotation=0 if log or len(values) < 6 else 45)
    axes.set_xlabel(label)
    axes.set_ylim(bottom=0)
    axes.grid(alpha=0.3)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, fontsize=8)
