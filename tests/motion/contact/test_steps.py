"""Steps and strides: of made walks, whose cadence, stride and width are known; and laws that hold for every walk."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from walkers import walking

from shadowpuppet.body.skeleton import other_side
from shadowpuppet.motion.contact.contact import contacts_of
from shadowpuppet.motion.contact.steps import Gait, find_gait
from shadowpuppet.motion.motion import JointTable

walks = cache(walking)
SIDES = ("left", "right")


def gait_of(table: JointTable, sd: float | None = None, sure: np.ndarray | None = None) -> Gait:
    contacts = contacts_of(table)
    assert contacts is not None
    return find_gait(table.times, contacts, table.names, table.positions, None if sd is None else np.full_like(table.positions, sd), sure)


def mean(of, name: str, side: str = "") -> float:
    return float(np.mean([getattr(each, name) for each in of if side in ("", each.side)]))


def apart(table: JointTable) -> float:
    """How far apart (m) the tracks of both heels are, while they lie on the floor, of a walk straight along -Y."""
    heels = [table.select([f"{side}_heel"]).positions[:, 0] for side in SIDES]
    left, right = (heel[heel[:, 2] < 0.01, 0].mean() for heel in heels)
    return float(left - right)


@pytest.mark.parametrize(("jogging", "speed", "stance"), [(False, None, 0.62), (False, 0.7, 0.62), (True, None, 0.38)])
def test_a_made_walk_has_its_own_stride_cadence_and_stance(jogging, speed, stance):
    walk, table = walks(jogging=jogging, speed=speed)
    gait = gait_of(table)
    assert len(gait.strides) >= 10
    assert mean(gait.strides, "length") == pytest.approx(walk.cycle.stride, rel=0.02)
    assert mean(gait.strides, "seconds") == pytest.approx(walk.cycle.stride / walk.speed, rel=0.02)
    for side in SIDES:
        assert mean(gait.strides, "stance", side) == pytest.approx(stance, abs=0.04)
        assert mean(gait.counted, "length", side) == pytest.approx(walk.cycle.stride / 2, rel=0.03)
        assert mean(gait.counted, "width", side) == pytest.approx(apart(table), abs=0.004)


def test_on_a_bend_widths_of_both_sides_are_those_on_a_line():
    (_, straight), (_, bent) = walks(), walks(path="circle", size=1.3)
    line, circle = gait_of(straight), gait_of(bent)
    assert np.degrees(mean(circle.counted, "turn")) == pytest.approx(26, abs=2)
    for side in SIDES:
        assert mean(circle.counted, "width", side) == pytest.approx(mean(line.counted, "width", side), abs=0.008)
        assert mean(circle.strides, "stance", side) == pytest.approx(mean(line.strides, "stance", side), abs=0.02)


def test_steps_through_a_turn_are_left_out_and_counted():
    _, table = walks(path="line", size=4.0)
    gait = gait_of(table)
    assert gait.left_out["turning"] >= 2
    assert len(gait.counted) + sum(gait.left_out.values()) == len(gait.steps)
    assert mean(gait.strides, "length") == pytest.approx(mean(gait_of(walks()[1]).strides, "length"), rel=0.08)  # slower near the turns


def test_doubtful_steps_are_left_out_but_not_for_a_moments_doubt():
    _, table = walks()
    whole = gait_of(table)
    step = whole.counted[6]
    within = (table.times >= step.begin) & (table.times <= step.end)
    gait = gait_of(table, sure=~within)
    assert gait.left_out["doubtful"] == 1
    assert len(gait.strides) == len(whole.strides) - 2
    moment = within & (table.times < step.begin + 0.05)
    assert gait_of(table, sure=~moment).left_out == whole.left_out


def test_a_strike_that_a_gap_hides_is_none():
    _, table = walks()
    whole = gait_of(table)
    hidden = table.positions.copy()
    strike = whole.counted[8].end
    hidden[(table.times > strike - 0.05) & (table.times < strike + 0.08)] = np.nan
    gait = gait_of(replace(table, positions=hidden))
    assert gait.left_out["doubtful"] >= 2
    assert len(gait.counted) >= len(whole.counted) - 4
    assert np.ptp([each.seconds for each in gait.strides]) <= np.ptp([each.seconds for each in whole.strides]) + 0.04


def test_a_step_with_a_pause_is_left_out_and_counted():
    _, table = walks()
    both_stand = np.flatnonzero(table.times > gait_of(table).counted[8].end)[4]
    held = np.sort(np.concatenate([np.arange(len(table.times)), np.full(100, both_stand)]))
    gait = gait_of(JointTable(np.arange(len(held)) / 60.0, table.names, table.positions[held]))
    assert gait.left_out["paused"] == 1
    assert len(gait.strides) == len(gait_of(table).strides) - 2


def test_who_marches_makes_no_stride_and_who_stands_no_strike():
    _, table = walks()
    on_spot = table.positions.copy()
    on_spot[..., :2] -= table.positions[:, [table.names.index("pelvis")], :2]
    assert not gait_of(replace(table, positions=on_spot)).strides
    still = gait_of(replace(table, positions=np.repeat(table.positions[:1], len(table.times), 0)))
    assert still.strikes == {"left": 0, "right": 0}
    assert not still.steps


def test_a_foot_that_loses_touch_for_a_moment_has_one_stance():
    _, table = walks()
    lifted = table.positions.copy()
    step = gait_of(table).counted[5]
    feet = [n for n, name in enumerate(table.names) if name in (f"{step.side}_heel", f"{step.side}_toe")]
    lifted[np.ix_((table.times > step.end + 0.2) & (table.times < step.end + 0.3), feet, [2])] += 0.1
    assert gait_of(replace(table, positions=lifted)).strikes == gait_of(table).strikes


def test_stated_deviations_are_those_of_two_footprints():
    _, table = walks()
    gait = gait_of(table, sd=0.01)
    for each in (*gait.counted, *gait.strides):
        assert each.length_sd == pytest.approx(0.01 * np.sqrt(2))
    assert np.isnan(gait_of(table).strides[0].length_sd)


@settings(max_examples=8, deadline=None)
@given(turn=st.floats(-3, 3), shift=st.floats(-20, 20), bend=st.booleans())
def test_a_mirrored_walk_has_its_sides_exchanged_wherever_it_is(turn, shift, bend):
    _, table = walks(path="circle", size=2.5) if bend else walks()
    c, s = np.cos(turn), np.sin(turn)
    mirrored = table.positions[:, other_side(table.names)] * [1, -1, 1] @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T + [shift, 0, 0]
    one, other = gait_of(table), gait_of(replace(table, positions=mirrored))
    assert len(one.strides) == len(other.strides)
    for side, opposite in (SIDES, SIDES[::-1]):
        for of, names in (("strides", ("length", "seconds", "stance")), ("counted", ("length", "width"))):
            for name in names:
                assert mean(getattr(other, of), name, side) == pytest.approx(mean(getattr(one, of), name, opposite), abs=1e-6)
    assert mean(other.counted, "turn") == pytest.approx(-mean(one.counted, "turn"), abs=1e-6)


@settings(max_examples=6, deadline=None)
@given(slower=st.floats(0.95, 1.15))
def test_a_slower_film_has_longer_strides_in_time_and_the_same_in_length(slower):
    _, table = walks()
    one, other = gait_of(table), gait_of(replace(table, times=slower * table.times))
    assert mean(other.strides, "seconds") == pytest.approx(slower * mean(one.strides, "seconds"), rel=0.01)
    assert mean(other.strides, "length") == pytest.approx(mean(one.strides, "length"), rel=0.01)
