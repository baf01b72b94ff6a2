"""Involuntary motion (sway, breathing, restlessness, tremor), and the band-limited noise that it is made of."""

from __future__ import annotations

import numpy as np

from shadowpuppet.geometry import Array
from shadowpuppet.synthetic.person.kinematics import CHANNELS

RESTLESSNESS = {"sway_x": (0.006, 0.35), "sway_y": (0.006, 0.35), "spine_bow": (0.8, 0.4), "spine_side": (0.8, 0.4),
                "spine_twist": (1.0, 0.4), "head_nod": (2.5, 0.4), "head_tilt": (2.0, 0.4), "head_turn": (4.0, 0.35), "side": (1.2, 0.7),
                "front": (1.2, 0.7), "roll": (1.5, 0.7), "elbow": (1.8, 0.7), "supination": (4.0, 0.5), "wrist_flex": (4.0, 0.6),
                "wrist_side": (2.0, 0.6), "shrug": (1.0, 0.3), "protract": (1.5, 0.3), "curl": (5.0, 0.4)}
"""Standard deviation (degrees; sway in metres) and highest frequency (Hz) of involuntary motion by channel."""
TREMOR = {"side": 0.25, "front": 0.25, "elbow": 0.35, "wrist_flex": 0.5, "head_nod": 0.15, "spine_side": 0.08}
"""Standard deviation, degrees, of the faster part, up to 5 Hz."""


def band_noise(t: Array, highest: float, rng: np.random.Generator, terms: int = 14) -> Array:
    """Smooth noise of unit variance at times `t` (s) with frequencies up to `highest` (Hz): a random Fourier series."""
    frequency, phase = rng.uniform(0.12, 1, terms) * highest, rng.uniform(0, 2 * np.pi, terms)
    return np.sqrt(2 / terms) * np.cos(2 * np.pi * np.multiply.outer(t, frequency) + phase).sum(-1)


def involuntary_motion(t: Array, rng: np.random.Generator) -> Array:
    """Sway, breathing, restlessness and tremor at times `t` (T,), of shape (T, `CHANNELS`)."""
    total = np.zeros((len(t), len(CHANNELS)))
    for column, channel in enumerate(CHANNELS):
        name = without_side(channel)
        size, highest = RESTLESSNESS.get(name, (0.0, 1.0))
        size = size if name.startswith("sway") else np.radians(size)
        total[:, column] = size * band_noise(t, highest, rng) + np.radians(TREMOR.get(name, 0.0)) * band_noise(t, 5.0, rng)
        total[:, column] += np.radians(0.4) * np.sin(2 * np.pi * 0.25 * t) if name in ("shrug", "spine_bow") else 0.0
    return total


def without_side(channel: str) -> str:
    """A channel's name without its side."""
    return channel.removeprefix("left_").removeprefix("right_")
