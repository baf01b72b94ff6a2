"""Style of plots, and writing of pictures."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.io.files.text import reason

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
"""Distinct for colour-blind readers too (Okabe & Ito 2008)."""
LARGEST = 150_000
"""Most bytes of a picture in the documentation."""
DPI = 110


def new_figure(rows: int = 1, columns: int = 1, width: float = 9.0, height: float = 3.2, **how: Any) -> tuple[Figure, np.ndarray]:
    """A figure, `height` inches a row, and its panels (rows, columns); `how` as for `Figure.subplots`."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height * rows), layout="constrained")
    FigureCanvasAgg(figure)
    return figure, figure.subplots(rows, columns, squeeze=False, **how)


def label(axes: Axes, x: str, y: str, title: str = "", legend: bool = True) -> None:
    """Set the names of the axes, a light grid, and a legend without a frame."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.set_title(title, fontsize=9)
    axes.grid(alpha=0.3, linewidth=0.5)
    axes.spines[["top", "right"]].set_visible(False)
    if legend:
        axes.legend(frameon=False, fontsize=7)


def save_picture(picture: Any, path: Path) -> None:
    """Write a figure, or an image (H, W, 3), blue green red, as PNG, in as many colours as `LARGEST` bytes allow.

    Raises `ShadowPuppetError` where it cannot be written.
    """
    from PIL import Image

    if isinstance(picture, np.ndarray):
        image = Image.fromarray(np.ascontiguousarray(picture[..., ::-1]))
    else:
        picture.set_dpi(DPI)
        picture.canvas.draw()
        image = Image.fromarray(np.asarray(picture.canvas.buffer_rgba())[..., :3])
    part = path.with_name(f"{path.name}.part")
    try:
        for colours in (0, 256, 128, 64, 32, 16):  # MAXCOVERAGE keeps the colour of thin lines
            some = image.quantize(colours, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE) if colours else image
            some.save(part, "PNG", optimize=True)
            if part.stat().st_size <= LARGEST:
                break
        part.replace(path)
    except OSError as error:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)
        raise ShadowPuppetError(f"{path}: cannot be written ({reason(error)})") from None
