"""Time offsets of films: what is wrong in one pair, or in some silhouettes, does not reach the others."""

from __future__ import annotations

from itertools import combinations

import made_rig
import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from shadowpuppet.calibration.silhouettes import silhouettes_of
from shadowpuppet.calibration.time_offset import _compared, _linked, _Shift, _solved, time_offsets
from shadowpuppet.io.intervals import HALF_WIDTH

LATE = (0.0, 4.0, -2.0, 1.0)


def shifts(**wrong: float) -> list[_Shift]:
    """Two of all pairs of four films that are `LATE`; `p01` and other arguments give a pair's error in sets."""
    return [_Shift(i, j, LATE[j] - LATE[i] + wrong.get(f"p{i}{j}", 0.0), 0.01) for i, j in combinations(range(4), 2) for _ in range(2)]


def signals(rng, late: int, sets: int = 90) -> np.ndarray:
    """Tangent angles (2, F) in pixels of two films, the second `late` sets late."""
    t = np.arange(sets)
    first = 30 * np.sin(0.21 * t) + 8 * np.sin(0.63 * t)
    t = t - late
    second = 30 * np.sin(0.21 * t) + 8 * np.sin(0.63 * t)
    return np.stack([first, second]) + rng.normal(0, 0.5, (2, sets))


def test_offsets_of_pairs_that_fit():
    late, spread = _solved(4, shifts())
    np.testing.assert_allclose(late, LATE, atol=1e-3)  # whose lower median is zero
    assert (spread < 0.4).all()


@pytest.mark.parametrize("bad", ["p01", "p13", "p23"])
def test_one_bad_pair_moves_no_film_far_and_widens_its_interval(bad):
    late, spread = _solved(4, shifts(**{bad: 9.0}))
    assert (np.abs(late - late[0] - LATE) < np.maximum(spread, spread[0]) + 0.05).all()
    assert (np.abs(late - late[0] - LATE) < 0.7).all()
    assert (spread > _solved(4, shifts())[1]).all()


def test_a_film_that_one_pair_alone_tells_is_less_certain():
    late, spread = _solved(4, [each for each in shifts() if 3 not in each[:2] or each.first == 0])
    np.testing.assert_allclose(late - late[0], LATE, atol=1e-3)
    assert (spread[:3] < 0.5).all()
    assert 2.0 < spread[3] < 2.2
    late, _ = _solved(4, [_Shift(0, 1, 4.2, 0.01), _Shift(0, 2, 4.0, 0.01), _Shift(1, 2, -0.2, 0.01), _Shift(2, 3, -1.0, 0.01)])
    np.testing.assert_allclose(late, (-4.0, 0.2, 0.0, -1.0), atol=1e-3)  # not against the fourth, the lower median of all
    late, spread = _solved(2, shifts()[:2])  # two cameras have one pair only
    np.testing.assert_allclose(late, LATE[:2], atol=1e-3)
    assert (spread > 2.0).all()
    assert np.isnan(_solved(4, [])[0]).all()


def test_films_of_two_groups_are_not_compared():
    apart = [_Shift(i, j, 1.0, 0.01) for i, j in [*combinations(range(3), 2), *combinations(range(3, 7), 2)]]
    films, used = _linked(7, apart)
    assert films == [3, 4, 5, 6]
    assert len(used) == 6


def test_pairs_that_differ_widen_intervals():
    narrow, wide = (_solved(4, [each._replace(sets=each.sets + size * rng.normal()) for each in shifts()])[1].mean()
                    for size in (0.05, 1.0) for rng in (np.random.default_rng(2),))
    assert wide > 2 * narrow


def test_a_limb_that_is_missing_at_times_hides_no_offset():
    rng = np.random.default_rng(3)
    both = signals(rng, 5)
    both[1, rng.choice(90, 14, replace=False)] += 400  # the tangent jumps to another limb
    found = _compared(0, 1, both, 30)
    assert found is not None
    assert found.sets == pytest.approx(5, abs=0.2)


def wandering(rng, sets: int, size: float, slow: float = 6.0) -> np.ndarray:
    """A smooth signal (F,) of the standard deviation `size`, pixels."""
    smooth = gaussian_filter1d(rng.normal(size=sets), slow)
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
        both = np.stack([np.interp(x - shift, np.arange(300), motion) for shift in (0.0, late)])
        found = _compared(0, 1, both + np.stack([wandering(rng, 240, 1.5, 1.0), wandering(rng, 240, 1.5, 1.0)]), 120)
        assert found is not None
        held.append(abs(found.sets - late) <= HALF_WIDTH * np.sqrt(found.variance))
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


# From silhouettes


@pytest.fixture(scope="module")
def masks(cameras):
    return made_rig.masks(cameras, 70)


def silhouettes(rows):
    return [silhouettes_of(row) for row in rows]


@pytest.mark.parametrize("late", [(0, 0, 0, 0), (0, 4, 0, 0), (0, 0, -3, 0), (0, 2, 0, -5)])
def test_frames_by_which_films_are_late(cameras, masks, late):
    found = time_offsets(cameras, silhouettes(made_rig.shifted(masks, late)))
    np.testing.assert_allclose(found.frames, late, atol=0.15)
    assert max(found.spread) < 0.3
    assert found.pairs[0][1] == pytest.approx(late[1] - late[0], abs=0.15)
    assert found.pairs[1][0] == pytest.approx(late[0] - late[1], abs=0.15)


def test_half_frames_are_reported(cameras):
    masks = made_rig.masks(cameras, 120)
    rows = [[masks[20 + 2 * f - (3 if k == 1 else 0)][k] for k in range(4)] for f in range(45)]  # every second: 1.5 sets
    np.testing.assert_allclose(time_offsets(cameras, silhouettes(rows)).frames, (0, 1.5, 0, 0), atol=0.25)


def test_two_cameras_are_distinguished_only(cameras, masks):
    found = time_offsets(cameras[:2], silhouettes([row[:2] for row in made_rig.shifted(masks, (0, 4, 0, 0))]))
    assert found.frames[0] == 0
    assert found.frames[1] == pytest.approx(4, abs=0.15)


def test_a_camera_that_was_moved_a_little_is_not_late(cameras, masks):
    wrong = [cameras[0], made_rig.moved(cameras[1], right=2), *cameras[2:]]
    np.testing.assert_allclose(time_offsets(wrong, silhouettes(made_rig.shifted(masks, (0, 3, 0, 0)))).frames, (0, 3, 0, 0), atol=0.6)


def test_a_person_who_stands_still_tells_nothing(cameras, masks):
    still = silhouettes([masks[0]] * 50)
    assert time_offsets(cameras, still).frames == (None,) * 4
    assert time_offsets(cameras, still[:10]).frames == (None,) * 4
    assert time_offsets(cameras, [[None] * 4] * 50).frames == (None,) * 4
