"""Plots, for which the extra `report` is needed."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from shadowpuppet.errors import ShadowPuppetError

AXES = {"particles": "particles in a call", "width": "width of the picture, pixels (4:3)", "cards": "cards of cardbox that are drawn"}
COLOURS = {"cardbox": "#1b6ca8", "boxes": "#d1495b", "rounded": "#3a7d44"}


def plot_curves(curves: Mapping[str, Any], path: Path) -> None:
    """Microseconds a particle against each axis of `bench.curves.curves`, into a .png, .pdf or .svg. Raises `ShadowPuppetError`."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 3.4), layout="constrained")
    FigureCanvasAgg(figure)
    for axes, (name, label) in zip(figure.subplots(1, len(AXES)), AXES.items()):
        values = curves[name]["values"]
        for body in (body for body in COLOURS if body in curves[name]):
            axes.plot(values, curves[name][body], ".-", color=COLOURS[body], label=body)
        if name != "cards":
            axes.set_xscale("log")
            axes.minorticks_off()
        axes.set_xticks(values, [str(value) for value in values], fontsize=7)
        axes.set_xlabel(label)
        axes.set_ylim(bottom=0)
        axes.grid(alpha=0.3)
        axes.spines[["top", "right"]].set_visible(False)
        axes.legend(frameon=False, fontsize=8)
    figure.axes[0].set_ylabel("microseconds a particle")
    try:
        figure.savefig(path, dpi=110)
    except OSError as error:
        raise ShadowPuppetError(f"{path}: cannot be written ({(error.strerror or str(error)).lower()})") from None
