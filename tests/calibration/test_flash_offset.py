"""Offsets of films by flashes of light."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shadowpuppet.calibration.flash_offset import Light, flash_offsets, flashes, shared_shift

RATE, SECONDS, PARTS = 30.0, 10.0, 48
MOMENTS = (1.3, 2.05, 4.4)


def light(moments=(), late=0.0, rate=RATE, seed=0, height=0.5, share=1.0, length=0.0):
    """A film of a flickering, noisy picture that begins `late` seconds before the others, so that all comes later on its clock."""
    rng = np.random.default_rng(seed)
    times = np.arange(round(SECONDS * rate)) / rate
    parts = 90 + 10 * np.sin(times)[:, None] + rng.normal(0, 1.5, (len(times), PARTS))
    for moment in moments:
        lit = (times >= moment + late - 1e-9) & (times < moment + late + max(length, 1 / rate) - 1e-9)
        parts[np.ix_(lit, np.arange(PARTS) < share * PARTS)] *= 1 + height
    return Light(times, parts)


def offsets(*films):
    return flash_offsets([f"cam{n}" for n in range(len(films))], films)


@settings(max_examples=30)
@given(st.lists(st.floats(-0.9, 2.0), min_size=2, max_size=4), st.sampled_from([1, 2, 3]))
def test_films_that_share_flashes_are_put_in_step(late, number):
    found = offsets(*(light(MOMENTS[:number], each, seed=n) for n, each in enumerate(late)))
    assert found.seconds == pytest.approx(np.array(late) - np.median(late), abs=1.5 / RATE)
    assert all(0 < spread < 1.5 / RATE for spread in found.spread)


def test_three_flashes_tell_more_than_one():
    one, three = (offsets(light(MOMENTS[:n]), light(MOMENTS[:n], 0.5)).spread[0] for n in (1, 3))
    assert three < 0.7 * one


def test_films_of_other_rates_are_put_in_step():
    assert offsets(light(MOMENTS), light(MOMENTS, 0.4, rate=60)).seconds == pytest.approx((-0.2, 0.2), abs=0.03)


@pytest.mark.parametrize("more", [{"share": 0.2}, {"length": 1.0}, {"height": 0.04}], ids=["a screen", "a lamp", "a glint"])
def test_what_is_no_flash(more):
    apart = (1.3, 4.4)
    assert len(flashes(light(apart))) == 2
    assert len(flashes(light(apart, **more))) == 0
    assert not offsets(light(apart, **more), light(apart, 0.5, **more)).known


def test_a_film_without_flashes_has_no_offset():
    found = offsets(light(MOMENTS), light(), light(MOMENTS, 1.0))
    assert found.seconds == (pytest.approx(-0.5, abs=0.04), None, pytest.approx(0.5, abs=0.04))


@pytest.mark.parametrize("other", [(0.7, 3.3, 5.2), (0.7, 5.2), (1.3, 1.9, 3.1, 5.2, 6.6)], ids=str)
def test_flashes_of_their_own_tell_nothing(other):
    assert not offsets(light(MOMENTS), light(other)).known


def test_flashes_at_even_intervals_tell_nothing_if_some_are_missing():
    assert shared_shift(np.array([1.0, 2.0, 3.0]), np.array([2.0, 3.0]), 1 / RATE, (0, 10), (0, 10)) is None


def test_flashes_outside_of_what_both_films_show_do_not_count():
    late = 5.0  # the first two of the second film's come before the first film begins
    assert offsets(light((1.0, 3.0)), light((-4.0, -3.0, 1.0, 3.0), late)).seconds == pytest.approx((-2.5, 2.5), abs=0.04)


@pytest.mark.parametrize("number", [0, 1, 2])
def test_films_of_few_frames_have_no_flashes(number):
    few = light(MOMENTS)
    assert not offsets(light(MOMENTS), Light(few.times[:number], few.parts[:number])).known
