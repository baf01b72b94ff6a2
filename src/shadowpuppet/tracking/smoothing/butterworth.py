"""The low-pass filter that biomechanists report: Butterworth, second order, forward and backward."""

from __future__ import annotations

import numpy as np

from shadowpuppet.errors import SettingsError
from shadowpuppet.geometry import Array
from shadowpuppet.motion.interpolation import filled

PASSES = 2
CORRECTION = (2 ** (1 / PASSES) - 1) ** 0.25
"""Factor of the tangent of the cut-off of one pass by which both passes together have the cut-off asked for (Winter 2009, 3.4.4.2)."""
PADDING = 9
"""Frames by which an interval is continued at its ends, turned about them."""


def filtered(times: Array, points: Array, cutoff: float) -> Array:
    """Points (T, M, 3) at times (T,), seconds, without frequencies above `cutoff` (Hz, -3 dB), without lag: fourth order in all. Unknown
    points, not a number, are interpolated. Intervals of up to `PADDING` frames are not filtered. Raises `SettingsError` for a cut-off that
    the frame rate does not allow."""
    from scipy.signal import butter, sosfiltfilt

    points = filled(times, points)
    if len(times) <= PADDING:
        return points
    rate = 1 / float(np.median(np.diff(times)))
    check_cutoff(cutoff, rate)
    once = rate / np.pi * np.arctan(np.tan(np.pi * cutoff / rate) / CORRECTION)
    return sosfiltfilt(butter(2, once, fs=rate, output="sos"), points, axis=0, padlen=PADDING)


def check_cutoff(cutoff: float, rate: float) -> None:
    """Raise `SettingsError` for a cut-off (Hz) that is not below half the rate (frames/s)."""
    if cutoff >= rate / 2:
        raise SettingsError(f"cutoff: found {cutoff:g} Hz, expected less than half the rate of {rate:.4g} frames/s")
