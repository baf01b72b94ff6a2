"""Floor and contact of the soles: of points whose contacts are known by construction."""

from __future__ import annotations

import numpy as np
import pytest

from shadowpuppet.evaluation.standing import agreement, depth, slide
from shadowpuppet.motion.contact.contact import FootEvent, contacts_of, find_contacts, floor_height, foot_events, under_feet
from shadowpuppet.motion.motion import JointTable

RATE, FLOOR = 60.0, 0.12
TIMES = np.arange(180) / RATE


def stepping(period: float = 1.0, swing: float = 0.4, rate_of: float = 1.2) -> np.ndarray:
    """A heel (180, 3) that stands on a floor at `FLOOR`, then swings forward by 1.2 m, again and again."""
    phase = TIMES / period % 1
    part = np.clip((phase - (1 - swing)) / swing, 0, 1)
    forward = rate_of * (np.floor(TIMES / period) + part**2 * (3 - 2 * part))
    return np.column_stack([forward, 0 * TIMES, FLOOR + 0.15 * np.sin(np.pi * part) ** 2])


def table(*points: np.ndarray, names: tuple[str, ...] = ("left_heel",)) -> JointTable:
    return JointTable(TIMES, names, np.stack(points, 1))


def test_what_stands_is_in_contact_and_what_swings_is_not():
    heel = stepping() + np.random.default_rng(1).normal(0, 0.001, (180, 3))
    found = contacts_of(table(heel))
    assert found is not None
    assert found.floor == pytest.approx(FLOOR, abs=0.003)
    truth = (TIMES % 1 < 0.6)[:, None]
    rates = agreement(found.touching, truth)
    assert min(rates.values()) > 0.9
    assert found.probability[truth].mean() > 0.9
    assert found.probability[~truth].mean() < 0.25


def test_low_but_fast_is_no_contact_and_neither_is_slow_but_high():
    fast = np.column_stack([3 * TIMES, 0 * TIMES, 0 * TIMES])
    high = np.column_stack([0 * TIMES, 0 * TIMES, 0 * TIMES + 0.3])
    still = np.zeros((180, 3))
    found = contacts_of(table(fast, high, still, names=("left_toe", "right_heel", "right_toe")))
    assert found is not None
    assert found.touching.all(0).tolist() == [False, False, True]
    assert found.touching.any(0).tolist() == [False, False, True]


def test_unknown_frames_are_unknown_and_not_in_contact():
    heel = np.zeros((180, 3))
    heel[50:60] = np.nan
    found = contacts_of(table(heel))
    assert found is not None
    assert np.isnan(found.probability[50:60]).all()
    assert not found.touching[50:60].any()
    assert found.touching[:50].all()
    assert found.touching[60:].all()


def test_hysteresis_bridges_a_moment_and_drops_a_short_contact():
    height = np.full(180, 0.3)
    height[20:100] = 0.0
    height[60] = 0.08  # one frame
    height[150] = 0.0
    found = find_contacts(TIMES, ["left_heel"], np.column_stack([0 * TIMES, 0 * TIMES, height])[:, None], floor=0.0)
    assert found is not None
    assert not found.touching[110:].any()
    assert found.touching[30:55].all()


def test_no_soles_or_nothing_that_stands_has_no_contacts():
    assert contacts_of(table(stepping(), names=("left_hand",))) is None
    assert contacts_of(table(np.column_stack([3 * TIMES] * 3))) is None
    assert contacts_of(table(np.full((180, 3), np.nan))) is None
    assert np.isnan(floor_height(np.zeros((9, 1)), np.ones((9, 1))))
    assert floor_height(np.array([[0.0]] + 20 * [[1.0]]), np.zeros((21, 1))) == pytest.approx(1.0)  # the percentile is between them


def test_events_are_strikes_and_offs_of_the_whole_foot():
    spans = ((0.75, 0.25), (1.05, 0.45))
    heel, toe = (np.column_stack([0 * TIMES, 0 * TIMES, np.where(np.abs(TIMES - middle) < half, 0, 0.2)]) for middle, half in spans)
    found = find_contacts(TIMES, ["left_heel", "left_toe"], np.stack([heel, toe], 1), floor=0.0)
    assert found is not None
    first, second = foot_events(TIMES, found)
    assert (first.side, first.strike, second.strike) == ("left", True, False)
    assert first.time == pytest.approx(0.5, abs=0.08)
    assert second.time == pytest.approx(1.5, abs=0.08)
    assert isinstance(first, FootEvent)


def test_slide_is_the_speed_along_the_floor_while_in_contact():
    points = np.stack([np.column_stack([0.03 * TIMES, 0.04 * TIMES, TIMES])], 1)
    touching = np.ones((180, 1), bool)
    assert slide(TIMES, points, touching) == pytest.approx(0.05)
    points[90:] += 5.0  # a step between two contacts does not count
    touching[89:91] = False
    assert slide(TIMES, points, touching) == pytest.approx(0.05)
    assert np.isnan(slide(TIMES, points, ~np.ones((180, 1), bool)))


def test_depth_counts_what_is_below_the_floor_alone():
    points = np.zeros((4, 1, 3))
    points[:, 0, 2] = [0.1, 0.08, 0.12, 0.0]
    touching = np.array([[True], [True], [True], [False]])
    assert depth(points, touching, 0.1)["mean"] == pytest.approx(0.02 / 3)
    assert depth(points, ~touching & touching, 0.1) == {}


def test_agreement_of_known_contacts():
    found, truth = np.array([[1, 1, 0, 0]], bool), np.array([[1, 0, 0, 1]], bool)
    assert agreement(found, truth) == {"precision": 0.5, "recall": 0.5}
    assert np.isnan(agreement(~found & found, truth)["precision"])


def test_the_floor_is_under_the_lowest_foot():
    names = ("pelvis", "left_ankle", "left_heel")
    positions = np.full((100, 3, 3), np.nan)
    positions[:, :, 2] = [-0.3, -1.1, -1.2]
    positions[:50, 2, 2], positions[7, 2, 2] = -1.0, -5.0
    assert under_feet(names, positions, 0.8) == pytest.approx(-1.2)
    assert under_feet(names[:1], positions[:, :1], 0.8) == pytest.approx(-1.1)
    assert np.isnan(under_feet(names, np.full_like(positions, np.nan), 0.8))
