"""Static clutter: lines and things that are no part of the person are found and removed; a person keeps every pixel."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shadowpuppet.silhouette.clutter import Part, find_clutter

HEIGHT, WIDTH, COUNT = 96, 128, 16


def person(x, arm=0.0, legs=True):
    """A person at x, 60 pixels high, with an arm raised by an angle; without legs as one whom a table hides."""
    mask = np.zeros((HEIGHT, WIDTH), np.uint8)
    cv2.circle(mask, (x, 26), 5, 1, -1)
    cv2.rectangle(mask, (x - 7, 32), (x + 7, 58), 1, -1)
    cv2.line(mask, (x + 6, 36), (x + 6 + round(22 * np.cos(arm)), 36 + round(22 * np.sin(arm))), 1, 5)
    if legs:
        for side in (-4, 4):
            cv2.rectangle(mask, (x + side - 2, 58), (x + side + 2, 84), 1, -1)
    return mask > 0


def walking():
    return [person(x) for x in np.linspace(20, 100, COUNT).astype(int)]


def standing():
    return [person(60, arm) for arm in np.linspace(-1.5, 1.5, COUNT)]


def drawn(masks, draw):
    out = []
    for mask in masks:
        bits = mask.astype(np.uint8)
        draw(bits)
        out.append(bits > 0)
    return out


def cable(bits):
    cv2.line(bits, (74, 0), (76, HEIGHT - 1), 1, 1)


def bench(bits):
    cv2.rectangle(bits, (100, 70), (120, 84), 1, -1)


def overlap(a, b):
    return np.count_nonzero(a & b) / np.count_nonzero(a | b)


@pytest.mark.parametrize("masks", [walking(), standing(), [person(60, 1.0)] * COUNT, [person(60)] * 3, [np.zeros((9, 9), bool)] * 20, []])
def test_a_person_alone_has_no_clutter(masks):
    assert find_clutter(masks) is None


@pytest.mark.parametrize("people", [walking(), standing()])
def test_a_cable_is_found_and_removed(people):
    masks = drawn(people, cable)
    clutter = find_clutter(masks)
    assert clutter is not None
    assert {part.kind for part in clutter.parts} == {"line"}
    removed = [clutter.removed(mask) for mask in masks]
    assert min(overlap(*each) for each in zip(removed, people)) > 0.93
    assert np.mean([overlap(*each) for each in zip(removed, people)]) > 0.98 > np.mean([overlap(*each) for each in zip(masks, people)])


def test_an_arm_before_a_cable_gets_no_hole():
    masks = drawn(standing(), cable)
    clutter = find_clutter(masks)
    assert clutter is not None
    arm = standing()[COUNT // 2]
    crossing = np.s_[34:39, 70:80]
    assert arm[crossing].all()
    assert clutter.removed(masks[COUNT // 2])[crossing].all()
    assert not clutter.removed(drawn([person(20)], cable)[0])[:, 70:80].any()


@pytest.mark.parametrize(("times", "width"), [(1, 7), (2, 9)])
def test_gaps_that_are_closed_are_wider_than_the_thickest_line_and_its_margins(times, width):
    masks = [np.kron(mask, np.ones((times, times), bool)) for mask in drawn(walking(), cable)]
    assert find_clutter(masks).width == width  # lines under 3 and under 4 pixels


def test_the_mask_itself_is_not_changed():
    masks = drawn(walking(), cable)
    before = masks[0].copy()
    find_clutter(masks).removed(masks[0])
    np.testing.assert_array_equal(masks[0], before)


def test_a_cable_may_vanish_in_some_masks():
    masks = drawn(walking(), cable)
    masks[4] = walking()[4]
    assert find_clutter(masks).parts[0].share == pytest.approx(1 - 1 / COUNT, abs=0.02)
    masks[7:12] = walking()[7:12]
    assert find_clutter(masks) is None


def test_a_person_who_holds_still_may_hold_a_stick():
    assert find_clutter(drawn([person(60, 1.0)] * COUNT, cable)) is None


def test_a_thing_that_the_person_walks_away_from_is_removed_while_they_do_not_touch_it():
    people = [person(x) for x in np.linspace(20, 104, COUNT).astype(int)]
    masks = drawn(people, bench)
    clutter = find_clutter(masks)
    assert [part.kind for part in clutter.parts] == ["thing"]
    np.testing.assert_array_equal(clutter.removed(masks[0]), people[0])
    np.testing.assert_array_equal(clutter.removed(masks[-1]), masks[-1])  # a leg touches it


def test_a_strip_of_the_person_that_a_gap_cuts_off_is_no_line():
    def gap(bits):
        bits[30:70, 63:66] = 0  # in the colour of the background: the strip right of it is 2 pixels wide

    masks = drawn(standing(), gap)
    for mask in masks:
        mask[30:70, 66:68] = True
    assert find_clutter(masks) is None


def test_an_outline_aslant_that_stays_is_no_line():
    def lying(bits):
        cv2.line(bits, (20, 90), (70, 50), 1, 12)

    assert find_clutter(drawn(standing(), lying)) is None


def test_a_short_line_may_be_a_finger_and_a_long_one_may_not():
    def finger(bits, length=14):
        cv2.line(bits, (60, 22 - length), (60, 22), 1, 1)

    assert find_clutter(drawn(standing(), finger)) is None
    assert find_clutter(drawn(standing(), lambda bits: finger(bits, 22))) is not None


def test_feet_that_stay_when_legs_are_lost_are_no_thing():
    def feet(bits):
        cv2.rectangle(bits, (54, 78), (66, 84), 1, -1)

    assert find_clutter(drawn([person(60, arm, legs=False) for arm in np.linspace(-1.5, 1.5, COUNT)], feet)) is None


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_nothing_is_removed_from_people_who_move_at_random(seed):
    rng = np.random.default_rng(seed)
    x = 60 + np.cumsum(rng.integers(-3, 4, COUNT))
    arms = np.cumsum(rng.normal(0, 0.4, COUNT))
    assert find_clutter([person(int(at), float(arm)) for at, arm in zip(x, arms)]) is None


@pytest.mark.parametrize(("part", "told"), [
    (Part("line", (10, 0, 2, 90), 0.98), "a thin upright line at x = 22, from y = 0 to 270, in 98 % of the frames"),
    (Part("line", (10, 40, 90, 2), 1.0), "a thin level line at y = 123, from x = 20 to 200, in 100 % of the frames"),
    (Part("line", (10, 40, 50, 50), 1.0), "a thin line within x 20 to 120, y 120 to 270, in 100 % of the frames"),
    (Part("thing", (10, 40, 50, 50), 1.0), "something that stays at x 20 to 120, y 120 to 270 while the person goes elsewhere, in 100 %"),
])  # fmt: skip
def test_parts_are_described_in_the_film_s_pixels(part, told):
    assert part.described((2, 3)).startswith(told)
