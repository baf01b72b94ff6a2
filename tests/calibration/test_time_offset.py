"""Time offsets of films: what is wrong in one pair, or in some silhouettes, does not reach the others."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from shadowpuppet.calibration.time_offset import QUANTILE, _compared, _half_width, _Pair, _solved

LATE = (0.0, 4.0, -2.0, 1.0)


def pairs(**wrong: float) -> list[_Pair]:
    """All pairs of four films that are `LATE`; `p01` and other arguments give a pair's error in sets."""
    return [_Pair(i, j, LATE[j] - LATE[i] + wrong.get(f"p{i}{j}", 0.0), 10.0) for i, j in combinations(range(4), 2)]


def signals(rng, late: int, sets: int = 90) -> np.ndarray:
    """Tangent angles (2, 2, F) in pixels of two films, the second `late` sets late."""
    t = np.arange(sets)
    first = np.stack([30 * np.sin(0.21 * t) + 8 * np.sin(0.63 * t), 25 * np.cos(0.17 * t) + 6 * np.sin(0.5 * t)])
    t = t - late
    second = np.stack([30 * np.sin(0.21 * t) + 8 * np.sin(0.63 * t), 25 * np.cos(0.17 * t) + 6 * np.sin(0.5 * t)])
    return np.stack([first, second]) + rng.normal(0, 0.5, (2, 2, sets))


def test_offsets_of_pairs_that_fit():
    late, known = _solved(4, pairs())
    assert known.all()
    np.testing.assert_allclose(late, LATE, atol=1e-3)  # whose lower median is zero


@pytest.mark.parametrize("bad", ["p01", "p13", "p23"])
def test_one_bad_pair_moves_no_film(bad):
    late, _ = _solved(4, pairs(**{bad: 9.0}))
    np.testing.assert_allclose(late - late[0], LATE, atol=0.1)


def test_a_limb_that_is_missing_at_times_hides_no_offset():
    rng = np.random.default_rng(3)
    both = signals(rng, 5)
    both[1, :, rng.choice(90, 14, replace=False)] += 400  # the tangent jumps to another limb
    found = _compared(0, 1, both, 30)
    assert found is not None
    assert found.shift == pytest.approx(5, abs=0.2)


def wandering(rng, sets: int, size: float, slow: float = 6.0) -> np.ndarray:
    """A smooth signal (2, F) of the standard deviation `size`, pixels."""
    smooth = gaussian_filter1d(rng.normal(size=(2, sets)), slow, axis=1)
    return size * smooth / smooth.std()


@pytest.mark.parametrize("memory", [0.1, 4.0, 20.0])
def test_silhouettes_of_a_person_who_is_still_give_no_offset(memory):
    rng = np.random.default_rng(8)
    for _ in range(12):  # noise of each film's own, which changes quickly or drifts
        noise = np.stack([wandering(rng, 240, 1.0, memory), wandering(rng, 240, 1.0, memory)])
        assert _compared(0, 1, noise, 120) is None


def test_intervals_of_shifts_hold_what_is_true():
    rng, held = np.random.default_rng(4), []
    for _ in range(40):
        late, motion = rng.uniform(-6, 6), wandering(rng, 300, 30.0)
        x = np.arange(240) + 30.0
        both = np.stack([[np.interp(x - shift, np.arange(300), each) for each in motion] for shift in (0.0, late)])
        found = _compared(0, 1, both + np.stack([wandering(rng, 240, 1.5, 1.0), wandering(rng, 240, 1.5, 1.0)]), 120)
        assert found is not None
        held.append(abs(found.shift - late) <= QUANTILE * np.sqrt(found.variance))
    assert 0.78 <= np.mean(held) <= 0.99


def test_sway_of_less_than_the_grid_of_pixels_gives_no_offset():
    rng = np.random.default_rng(5)
    for _ in range(6):  # the same sway in both, which whole pixels round each in its own way
        sway = wandering(rng, 240, 1.0, 10.0)
        assert _compared(0, 1, np.round(np.stack([sway + 0.2, sway - 0.3])), 120) is None


def test_quick_movements_that_are_not_the_same_give_no_offset():
    rng = np.random.default_rng(1)
    for _ in range(12):  # by chance some shift is alike enough, but most of the difference is left at it
        assert _compared(0, 1, np.stack([wandering(rng, 240, 30.0, 1.0), wandering(rng, 240, 30.0, 1.0)]), 120) is None


def test_a_width_falls_with_pairs_that_agree_and_grows_with_those_that_do_not():
    assert _half_width([0.0], [4.0]) == pytest.approx(QUANTILE * 2)
    assert _half_width([0.0] * 2, [4.0] * 2) == _half_width([0.0] * 3, [4.0] * 3) == pytest.approx(QUANTILE * np.sqrt(2))
    assert _half_width([2.0] * 4, [0.0] * 4) == pytest.approx(QUANTILE * 1.4826)
