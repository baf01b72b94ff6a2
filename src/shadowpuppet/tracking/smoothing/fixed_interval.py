"""Fixed-interval smoothing of measured points: white jerk, whose strength follows the local speed, as people's accelerations do.

The estimate of a whole interval minimises sum((x - y)^2 / r) + sum((third difference of x)^2 / q): the maximum a posteriori of a random
walk of accelerations, the same as a Kalman filter and a Rauch-Tung-Striebel pass backwards (Rauch, Tung and Striebel 1965), solved at
once as a banded system.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.geometry import Array
from shadowpuppet.motion.interpolation import filled

ORDER = 3
"""Order of the differences that are white noise: of jerk."""
PACE = 8.0
"""Acceleration over speed (1/s) of people's joints: root mean squares within some tenths of a second, on made recordings 6 to 11 at any
speed from 2 cm/s to 5 m/s (motion capture: 9 to 14 in the median, above 0.2 m/s); and jerk over acceleration."""
LEAST = 0.5
"""Acceleration (m/s^2) of a person who stands still, sway and tremor."""
CORRELATION = 0.1
"""Time (s) for which jerk keeps its direction."""
WINDOW = 0.15
"""Standard deviation (s) of the window in which speed is averaged."""
INDEPENDENT = 0.15
"""Share of the stated deviation that is independent from frame to frame; 0.13 to 0.15 on made recordings, with one camera and several."""
OUTLIER = 2.0
"""Distance of a measured point, in stated deviations, from which its weight falls."""
FAINT = 1e-6
"""Share of the weight of a measured point that the straight line through a gap has, so that few frames determine a path."""
ROUNDS = 4
"""Rounds in which speed and outliers are estimated again."""


class Smoothed(NamedTuple):
    """Smoothed points and what they were smoothed by."""

    points: Array
    """Of shape (T, M, 3)."""
    precision: Array
    """Of the measured points, of shape (T, M, 3); faint where unknown."""
    variances: Array
    """Of the third derivatives between four frames, of shape (T - 3, M)."""


def smooth(times: Array, points: Array, sd: Array, least: Array, rounds: int = ROUNDS) -> Smoothed:
    """Points (T, M, 3) at times (T,), seconds, smoothed over the whole interval; unknown ones, not a number, are interpolated.

    `sd`: stated deviations (T, M, 3), in the points' unit; `least` (M,): acceleration of each point of a person who stands still;
    `rounds` of estimating speeds and outliers. Fewer than four frames are only interpolated.
    """
    known: NDArray[np.bool_] = np.asarray(np.isfinite(points).all(2))
    measured = x = filled(times, points)
    precision, variances = np.where(known[..., None], 1.0, FAINT) / (INDEPENDENT * sd) ** 2, np.ones((0, points.shape[1]))
    if len(times) > ORDER:
        given, radius, third = precision, (sd**2).sum(2), differences(times)
        for _ in range(rounds):
            variances = jerks(times, x, least)
            x = solve(third, measured, precision, variances)
            trust = 1 / (1 + ((x - measured) ** 2).sum(2) / (OUTLIER**2 * radius)) ** 2
            precision = given * trust[..., None]
    return Smoothed(x, precision, variances)


def jerks(times: Array, points: Array, least: Array) -> Array:
    """Variances (T - 3, M) of the jerk, along each axis, between four frames, from the local speeds of points (T, M, 3)."""
    step = float(np.median(np.diff(times)))
    from scipy.ndimage import gaussian_filter1d  # takes a third of a second to import

    speed = gaussian_filter1d((np.gradient(points, times, axis=0) ** 2).sum(2), WINDOW / step, axis=0, mode="nearest")
    acceleration = np.maximum(PACE**2 * speed, least**2)
    between = 0.5 * (acceleration[1:-2] + acceleration[2:-1])
    return PACE**2 * between / 3 * max(CORRELATION / step, 1.0)


def differences(times: Array) -> Array:
    """Coefficients (T - 3, 4) of the third derivative between four frames at times (T,): divided differences."""
    four = np.stack([times[k : len(times) - ORDER + k] for k in range(ORDER + 1)], 1)
    apart = four[:, :, None] - four[:, None, :] + np.eye(ORDER + 1)
    return 6 / apart.prod(2)


def solve(third: Array, measured: Array, precision: Array, variances: Array) -> Array:
    """Points (T, M, 3) of least squares: `third` (T - 3, 4) of `differences`, measured points and their precisions (T, M, 3), variances
    of the third differences (T - 3, M)."""
    T, M, _ = measured.shape
    from scipy.linalg import solveh_banded  # takes a third of a second to import

    out, band, pairs = np.empty_like(measured), np.zeros((ORDER + 1, T)), _products(third)
    for m in range(M):
        band[:] = 0
        for (i, j), product in pairs.items():
            band[ORDER - (j - i), j : j + T - ORDER] += product / variances[:, m]
        own = band[ORDER].copy()
        for axis in range(3):
            band[ORDER] = own + precision[:, m, axis]
            out[:, m, axis] = solveh_banded(band, precision[:, m, axis] * measured[:, m, axis], check_finite=False)
    return out


def _products(third: Array) -> dict[tuple[int, int], NDArray]:
    """Products (T - 3,) of two coefficients."""
    return {(i, j): third[:, i] * third[:, j] for i in range(ORDER + 1) for j in range(i, ORDER + 1)}
