"""Clothes, hair and skin of a person."""

from __future__ import annotations

import colorsys
from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class Clothes:
    """Shirt, trousers, shoes, hair and skin of one person."""

    looseness: float = 0.012
    """Looseness of shirt and trousers, metres."""
    sleeve: float = 0.35
    """End of the sleeves, fraction of the arm from shoulder to wrist."""
    hair: float = 0.012
    """Thickness of the hair, metres."""
    stripes: float = 0.0
    """Darkness of the shirt's stripes."""
    colours: dict[str, tuple[float, ...]] = field(default_factory=dict)
    """RGB, 0 to 1, by material."""

    @classmethod
    def draw(cls, rng: np.random.Generator) -> Clothes:
        """Random everyday clothes."""

        def colour(low: float, high: float, saturation: float) -> tuple[float, ...]:
            return colorsys.hsv_to_rgb(rng.uniform(), rng.uniform(0.1, saturation), rng.uniform(low, high))

        tone, shade = rng.uniform(0, 1), rng.uniform(0.3, 1.4)
        skin = tuple(a + tone * (b - a) for a, b in zip((0.86, 0.66, 0.55), (0.42, 0.27, 0.20)))
        colours = {"skin": skin, "hair": (0.30 * shade, 0.20 * shade, 0.13 * shade), "eyes": (0.12, 0.10, 0.09),
                   "lips": (0.85 * skin[0], 0.6 * skin[1], 0.6 * skin[2]), "shirt": colour(0.25, 0.85, 0.8),
                   "trousers": colour(0.1, 0.45, 0.5), "shoes": colour(0.1, 0.4, 0.3)}
        return cls(rng.uniform(0.006, 0.022), float(rng.choice([0.28, 0.36, 0.9])), rng.uniform(0.004, 0.022),
                   float(rng.choice([0, 0, 0.35])), colours)
