"""Paths over the floor: place and heading by length."""

from __future__ import annotations

from typing import Literal

import numpy as np

from shadowpuppet.geometry import Array

PathName = Literal["line", "circle", "ellipse", "spot"]
TURN_RADIUS = 0.42
"""Radius of the turn at the ends of a line, metres."""
PATH_STEP = 0.01
"""Distance between a path's samples, metres."""


class Path:
    """A path from the origin facing -Y; `circle`, `ellipse` and `line` repeat, `spot` stays in place (a treadmill)."""

    def __init__(self, name: PathName, size: float, length: float) -> None:
        """size: radius of the circle, half the longer axis of the ellipse (the other: 0.6 of it), length of the line; metres.

        length: needed length, metres. Circle, ellipse and the turns of the line go left.
        """
        from scipy.interpolate import CubicSpline

        s = np.arange(0.0, length + 2 * PATH_STEP + 1.0, PATH_STEP)
        heading = {"line": _line, "circle": lambda s, r: s / r, "ellipse": _ellipse, "spot": lambda s, r: 0 * s}[name](s, size)
        middle = (heading[1:] + heading[:-1]) / 2
        place = np.zeros((len(s), 2))
        place[1:] = np.cumsum(PATH_STEP * np.column_stack([np.sin(middle), -np.cos(middle)]), 0)
        self.still = name == "spot"
        self.samples, self.bend = s, np.gradient(heading, PATH_STEP)
        self._heading, self._place = CubicSpline(s, heading), CubicSpline(s, place)

    def heading(self, s: Array) -> Array:
        """Heading, rad to the left of -Y, at lengths `s` (...), metres; straight on before the beginning."""
        return self._heading(np.maximum(s, 0))

    def place(self, s: Array, aside: Array) -> Array:
        """Places (..., 2) `aside` (metres to the left) of the path at lengths `s` (...)."""
        turn = self.heading(s)
        left = np.stack([np.cos(turn), np.sin(turn)], -1)
        ahead = np.stack([np.sin(turn), -np.cos(turn)], -1)
        return self._place(np.maximum(s, 0)) + np.minimum(s, 0)[..., None] * ahead + np.asarray(aside)[..., None] * left


def _line(s: Array, size: float) -> Array:
    """Headings along a line there and back, with half circles at its ends."""
    around = np.pi * TURN_RADIUS
    lap = size + around
    sharp = np.floor(s / lap) * np.pi + np.clip((s % lap - size) / TURN_RADIUS, 0, np.pi)
    window = np.hanning(61)
    return np.convolve(np.pad(sharp, 30, "edge"), window / window.sum(), "valid").astype(float)


def _ellipse(s: Array, size: float) -> Array:
    """Headings along an ellipse that begin along its longer axis."""
    angle = np.linspace(0, 2 * np.pi, 4001)
    ahead = np.column_stack([0.6 * np.sin(angle), np.cos(angle)]) * size
    length = np.concatenate([[0], np.cumsum(np.linalg.norm((ahead[1:] + ahead[:-1]) / 2, axis=1) * (angle[1] - angle[0]))])
    heading = np.unwrap(np.arctan2(ahead[:, 0], ahead[:, 1]))
    laps = np.floor(s / length[-1])
    return 2 * np.pi * laps + np.interp(s - laps * length[-1], length, heading)
