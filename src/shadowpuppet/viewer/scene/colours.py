"""Colours of figures: the overlay's for left, right and middle, with a little of a second run's or a person's own."""

from __future__ import annotations

import numpy as np

from shadowpuppet.geometry import Array
from shadowpuppet.viewer.scene.scene import Figure

MIXED = {"estimate": ((0, 0, 0), 0.0), "truth": ((0, 0, 0), 0.0), "other": ((112, 64, 170), 0.35), "mean": ((150, 156, 164), 0.35)}
"""Colour mixed into that of a kind of figure, and its share."""
TINT = 0.5
"""Share of a person's own tint."""


def mesh_colours(figure: Figure) -> Array:
    """Colours of the points of a figure's mesh, sRGB, 0..255, of shape (V, 3)."""
    linear = np.clip(figure.mesh.colours, 0, 1)
    own = 255 * np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    mixed, share = MIXED[figure.kind] if figure.tint is None else (figure.tint, TINT)
    return np.asarray(((1 - share) * own + share * np.array(mixed)).round())
