"""Offsets of films by their sound: found to a part of a frame where something is heard, and not stated where nothing is."""

from __future__ import annotations

import noises
import numpy as np
import pytest

from shadowpuppet.calibration.sound_offset import (
    HOP,
    MIN_OVERLAP,
    RATE,
    SPEED_OF_SOUND,
    _likenesses,
    best_shift,
    onset_strengths,
    sound_offsets,
)

PLACES = np.array([[0, 0, 1], [3, 0, 1], [0, 3, 1.0], [3, 3, 1]])


def offsets(sounds, begins=None, places=PLACES):
    names = [f"cam{n + 1}" for n in range(len(sounds))]
    return sound_offsets(names, sounds, begins or [0.0] * len(sounds), places[: len(sounds)])


@pytest.mark.parametrize("kinds", [("claps",), ("steps",), ("voice",), ("steps", "voice", "claps")])
@pytest.mark.parametrize("seed", [1, 2])
def test_films_that_began_at_other_times_are_put_in_step(kinds, seed):
    rng = np.random.default_rng(seed)
    late = np.array([0.0, 0.72, -0.31, 2.4])
    source = rng.uniform(0, 3, 3)
    room = noises.events(rng, 14, RATE, kinds)
    found = offsets([noises.heard(rng, room, RATE, each, way=np.linalg.norm(place - source), loudness=rng.uniform(0.05, 0.5))
                     for each, place in zip(late, PLACES)])
    error = np.array(found.seconds) - late
    assert np.ptp(error) < 2 * 4.3 / SPEED_OF_SOUND  # the sound's way is not known
    assert found.spread[0] < 0.03
    assert np.median(found.seconds) == pytest.approx(0, abs=1e-3)


def test_the_intervals_hold_the_offsets():
    inside = []
    for seed in range(25):
        rng = np.random.default_rng(seed)
        late = rng.uniform(-1, 1, 3)
        room, source = noises.events(rng, 10, RATE), rng.uniform(-1, 4, 3)
        found = offsets([noises.heard(rng, room, RATE, each, way=np.linalg.norm(place - source)) for each, place in zip(late, PLACES)])
        inside += [abs(a - b) <= width for a, b, width in zip(found.seconds, late - np.median(late), found.spread)]
    assert np.mean(inside) > 0.85


@pytest.mark.parametrize("make", [
    lambda rng, n: 0.1 * rng.standard_normal(n),  # each microphone's own noise
    lambda rng, n: np.zeros(n),
    lambda rng, n: np.sin(np.arange(n) * 0.05) + 0.01 * rng.standard_normal(n),  # a hum
])
def test_nothing_is_stated_where_no_sound_is_shared(make):
    for seed in range(4):
        rng = np.random.default_rng(seed)
        assert offsets([make(rng, 12 * RATE) for _ in range(3)]).seconds == (None, None, None)


def bangs(rng, *times: float) -> np.ndarray:
    """Some bangs in a quiet room, (N,)."""
    sound, t = np.zeros(12 * RATE), np.arange(RATE // 4) / RATE
    for time in times:
        sound[round(time * RATE) :][: len(t)] += np.exp(-t / 0.01) * rng.standard_normal(len(t))
    return sound


def test_a_bang_of_its_own_in_each_film_is_nothing_shared():
    for seed in range(8):
        rng = np.random.default_rng(seed)
        sounds = [noises.heard(rng, bangs(rng, rng.uniform(1, 10)), RATE, 0.0) for _ in range(2)]
        assert offsets(sounds).seconds == (None, None)


@pytest.mark.parametrize(("claps", "least"), [((3.1, 4.0, 6.5, 7.1), 8), ((3.1, 5.0), 5), ((3.1,), 0)])
def test_of_some_claps_most_confirm_one_another_and_one_alone_says_nothing(claps, least):
    stated = 0
    for seed in range(8):
        rng = np.random.default_rng(seed)
        room = bangs(rng, *claps)
        first, second = offsets([noises.heard(rng, room, RATE, late) for late in (0.0, 0.6)]).seconds
        assert first is None or second - first == pytest.approx(0.6, abs=0.01)
        stated += first is not None
    assert stated >= least
    assert stated == 0 or len(claps) > 1


def test_of_beats_that_repeat_themselves_none_is_chosen(rng):
    beat = np.tile(np.exp(-np.arange(RATE // 2) / 100) * rng.standard_normal(RATE // 2), 24)
    assert offsets([noises.heard(rng, beat, RATE, late) for late in (0.0, 0.2)]).seconds == (None, None)


def test_a_film_without_sound_is_left_out_and_begins_are_counted(rng):
    room = noises.events(rng, 10, RATE)
    sounds = [noises.heard(rng, room, RATE, 0.0), None, noises.heard(rng, room[RATE:], RATE, 0.0)]
    found = offsets(sounds, begins=[0.0, 0.0, 1.0])  # the third's sound begins a second into its film
    assert found.seconds[1] is None
    assert abs(found.seconds[2] - found.seconds[0]) < 0.005


def test_short_films_have_no_offset(rng):
    room = noises.events(rng, 1.5, RATE)
    assert best_shift(onset_strengths(room), onset_strengths(room)) is None


@pytest.mark.parametrize("lag", [-3.25, 0.0, 1.1])
def test_the_sign_is_that_of_a_later_second_sound(rng, lag):
    room = noises.events(rng, 15, RATE)
    n = round(lag * RATE)
    second = np.concatenate([np.zeros(max(n, 0)), room[max(-n, 0) :]])
    assert best_shift(onset_strengths(room), onset_strengths(second)) == pytest.approx(lag, abs=0.002)


def test_in_few_shifts_the_best_of_noise_is_not_taken_for_an_offset():
    rng = np.random.default_rng(3)
    for _ in range(12):  # 0.3 s more than they must have in common: no other shift is far enough off to compare with
        assert best_shift(*(onset_strengths(rng.standard_normal(round(2.3 * RATE))) for _ in range(2))) is None


@pytest.mark.parametrize(("first", "second"), [(80, 80), (80, 150), (150, 80)])
def test_likeness_at_each_shift_is_that_of_the_plain_loop(first, second):
    rng, least = np.random.default_rng(0), MIN_OVERLAP * RATE / HOP
    first, second = round(least) + first, round(least) + second
    a, b = rng.random((2, first)), rng.random((2, second))
    found = _likenesses(a, b)
    assert found is not None
    lags, likeness = found
    shared = {}
    for lag in range(-first + 1, second):
        begin, end = max(0, -lag), min(first, second - lag)
        if end - begin >= least:
            shared[lag] = (a[:, begin:end] * b[:, begin + lag : end + lag]).sum() / np.sqrt(end - begin)
    assert lags.tolist() == list(shared)
    np.testing.assert_allclose(likeness, list(shared.values()))
