"""The low-pass filter: its cut-off is that of both passes together, it has no lag, and it refuses what a rate does not allow."""

from __future__ import annotations

import numpy as np
import pytest

from shadowpuppet.errors import SettingsError
from shadowpuppet.tracking.smoothing.butterworth import check_cutoff, filtered

TIMES = np.arange(600) / 60


def gain(frequency: float, cutoff: float = 6.0) -> float:
    wave = np.stack([np.sin(2 * np.pi * frequency * TIMES), np.cos(2 * np.pi * frequency * TIMES), 0 * TIMES], 1)
    found = filtered(TIMES, wave[:, None], cutoff)[:, 0]
    middle = slice(150, 450)
    assert abs((found[middle, 0] * wave[middle, 1]).mean()) < 0.01  # in phase
    return float(np.sqrt((found[middle] ** 2).sum() / (wave[middle] ** 2).sum()))


def test_the_gain_is_minus_three_decibels_at_the_cutoff():
    assert gain(6.0) == pytest.approx(np.sqrt(0.5), abs=0.01)
    assert gain(1.0) == pytest.approx(1.0, abs=0.01)
    assert gain(20.0) < 0.02


def test_a_cutoff_beyond_half_the_rate_is_refused():
    with pytest.raises(SettingsError, match=r"cutoff: found 8 Hz, expected less than half the rate of 15 frames/s"):
        check_cutoff(8.0, 15.0)
    with pytest.raises(SettingsError, match="cutoff"):
        filtered(np.arange(50) / 10, np.zeros((50, 1, 3)), 6.0)


@pytest.mark.parametrize("frames", [1, 2, 9, 10])
def test_short_intervals_stay_or_are_filtered(frames, rng):
    points = rng.normal(size=(frames, 2, 3))
    found = filtered(TIMES[:frames], points, 6.0)
    assert np.isfinite(found).all()
    assert np.array_equal(found, points) == (frames < 10)
