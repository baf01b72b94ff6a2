"""Colours of hands and bare forearms are learnt where they are seen, and find arms before the trunk; like clothes, they change nothing."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from people import camera, picture, shapes_of

from shadowpuppet.camera.bits import unpack
from shadowpuppet.camera.colour_codes import NUMBER, ColourCode, colour_codes, step_of, thinned
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.tracking.arm_colours import ENOUGH, ENOUGH_REST, ArmColours, ColourCounts, distinct, kind_of
from shadowpuppet.tracking.doubt.monocular import MonocularDoubt
from shadowpuppet.tracking.monocular.settings import make_settings
from shadowpuppet.tracking.monocular.tracker import MonocularTracker, State

SKIN, SHIRT, WALL, HAIR = (130, 160, 210), (120, 60, 40), (200, 200, 200), (20, 30, 60)
"""Blue, green, red."""
BARE = {"left_hand", "right_hand", "left_forearm", "right_forearm"}


@cache
def view(size: tuple[int, int] = (320, 240)) -> Picture:
    return picture("rounded", camera(size))


def painted(pose: np.ndarray, of: Picture, skin: set[str], noise: float = 4.0, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Image (H, W, 3) and mask (H, W) of a person in a shirt, `skin` bare; arms are before the trunk."""
    mask = of.mask(pose)
    image = np.where(mask[..., None], SHIRT, WALL).astype(float)
    for parts, colour in ((("head", "neck"), HAIR), (tuple(skin), SKIN)):
        image[unpack(of.draw(pose, shapes_of(of.body, *parts)), of.camera.size[0])] = colour
    return np.clip(image + noise * np.random.default_rng(seed).standard_normal(image.shape), 0, 255).astype(np.uint8), mask


def poses_of_arms(frames: int) -> np.ndarray:
    """The arms spread, then the left one comes before the trunk, (T, D)."""
    skeleton, along = view().body.skeleton, np.linspace(0, 1, frames)
    before = np.clip(2 * along - 0.6, 0, 1)
    return np.array([skeleton.pose(left_shoulder_abduction=1.1 - 0.9 * b, left_elbow_roll=-0.9, left_elbow_flexion=0.5 + 1.4 * b,
                                   right_shoulder_abduction=0.6, right_elbow_flexion=0.3) for b in before])


def counts_of(skin: set[str], of: Picture, frames: int = 12) -> tuple[ColourCounts, list[ColourCode]]:
    counts, found = None, []
    for n, pose in enumerate(poses_of_arms(30)[:frames]):
        image, mask = painted(pose, of, skin, seed=n)
        found.append(colour_codes(image))
        counts = ArmColours(of).learnt(counts, found[-1], mask, pose)
    return counts, found


# Colours --------------------------------------------------------------------------------------------------------------


@given(st.integers(1, 40), st.integers(1, 40), st.booleans(), st.integers(0, 1000))
def test_codes_are_sixteen_levels_a_channel(width, height, grey, seed):
    image = np.random.default_rng(seed).integers(0, 256, (height, width) if grey else (height, width, 3), np.uint8)
    codes = colour_codes(image)
    for row in range(height):
        for column in range(width):
            blue, green, red = (int(value) // 16 for value in np.broadcast_to(image[row, column], 3))
            assert codes[row, column] == 256 * blue + 16 * green + red < NUMBER


def test_there_are_about_as_many_in_large_pictures():
    assert [step_of(size) for size in ((160, 120), (320, 240), (518, 496), (640, 480), (1280, 720))] == [1, 1, 2, 2, 3]
    image = np.random.default_rng(0).integers(0, 256, (480, 640, 3), np.uint8)
    assert np.array_equal(colour_codes(image), colour_codes(image[::2, ::2]))
    assert np.array_equal(thinned(image), image[::2, ::2])


def test_without_an_image_there_are_none():
    assert colour_codes(None) is None


# Learning -------------------------------------------------------------------------------------------------------------


def test_kinds_of_parts():
    parts = ("left_hand", "right_lower_arm", "right_forearm", "left_upper_arm", "neck", "torso", "left_shank")
    assert [kind_of(part) for part in parts] == ["hand", "forearm", "forearm", "upper_arm", "head", "rest", "rest"]


@pytest.mark.parametrize("size", [(320, 240), (640, 480)])
@pytest.mark.parametrize(("skin", "expected"), [(BARE, ("hand", "forearm")), ({"left_hand", "right_hand"}, ("hand",)), (set(), ())])
def test_what_is_bare_is_learnt(size, skin, expected):
    kinds, of_arms = distinct(counts_of(skin, view(size))[0])
    assert kinds == expected
    if kinds:
        skin_code, shirt_code = (int(colour_codes(np.full((1, 1, 3), colour, np.uint8))[0, 0]) for colour in (SKIN, SHIRT))
        assert of_arms[skin_code]
        assert not of_arms[shirt_code]


def test_only_what_is_seen_apart_is_counted():
    pose = poses_of_arms(30)[0]
    image, mask = painted(pose, view(), BARE, noise=0)
    counts = ArmColours(view()).learnt(None, colour_codes(image), mask, pose)
    skin_code, shirt_code, hair_code = (int(colour_codes(np.full((1, 1, 3), c, np.uint8))[0, 0]) for c in (SKIN, SHIRT, HAIR))
    for number, code in zip(counts, (skin_code, skin_code, shirt_code)):
        assert number[code] == number.sum() > 0
    assert sum(number[hair_code] for number in counts) == 0


def test_counts_add_up_and_too_few_say_nothing():
    counts, _ = counts_of(BARE, view(), 1)
    twice, _ = counts_of(BARE, view(), 2)
    assert all((more >= less).all() and more.sum() > less.sum() for more, less in zip(twice, counts))
    assert counts.rest.sum() > ENOUGH_REST
    assert distinct(ColourCounts(*(number * (number.sum() > 0) * 0 for number in counts)))[0] == ()
    few = counts.hand.copy()
    few[few > 0] = (ENOUGH - 1) // np.count_nonzero(few)
    assert distinct(counts._replace(hand=few))[0] == ()


def test_a_body_without_hands_is_known_by_its_forearms():
    assert distinct(counts_of(BARE, view())[0]._replace(hand=np.zeros(NUMBER, np.int64)), "forearm")[0] == ("forearm",)
    assert distinct(counts_of(BARE, view())[0]._replace(hand=np.zeros(NUMBER, np.int64)))[0] == ()


# Finding --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("size", [(320, 240), (640, 480)])
def test_an_arm_before_the_trunk_is_seen(size):
    of = view(size)
    counts, _ = counts_of(BARE, of)
    pose = poses_of_arms(30)[-1]
    image, mask = painted(pose, of, BARE)
    seen = ArmColours(of).seen(counts, colour_codes(image), mask, pose, of.empty())
    assert set(seen.parts) == BARE
    counted = ~unpack(seen.observation.ignore, size[0])
    drawn = unpack(of.draw(pose, shapes_of(of.body, *BARE)), size[0]) & counted
    found = unpack(seen.observation.silhouette, size[0]) & counted
    assert (drawn & found).sum() / (drawn | found).sum() > 0.8
    trunk = unpack(of.draw(pose, shapes_of(of.body, "torso")), size[0])
    assert (drawn & trunk).sum() > 100 * step_of(size) ** 2  # the case is what it says


def test_head_and_legs_do_not_count():
    counts, _ = counts_of(BARE, view())
    pose = poses_of_arms(30)[0]
    _, mask = painted(pose, view(), BARE)
    everywhere = colour_codes(np.full((240, 320, 3), SKIN, np.uint8))
    seen = ArmColours(view()).seen(counts, everywhere, mask, pose, view().empty())
    ignored = unpack(seen.observation.ignore, 320)
    assert ignored[unpack(view().draw(pose, shapes_of(view().body, "head")), 320)].all()
    assert ignored[view().legs(pose)].all()


def test_only_arms_before_the_trunk_count():
    """Beside it the silhouette shows them."""
    counts, _ = counts_of(BARE, view())
    trunk_parts = shapes_of(view().body, "torso", "waist", "shoulders")
    for n, reaches_over in ((0, False), (-1, True)):
        pose = poses_of_arms(30)[n]
        image, mask = painted(pose, view(), BARE)
        seen = ArmColours(view()).seen(counts, colour_codes(image), mask, pose, view().empty())
        counted = ~unpack(seen.observation.ignore, 320)
        trunk = unpack(view().draw(pose, trunk_parts), 320)
        left, right = (unpack(view().draw(pose, shapes_of(view().body, f"{side}_hand")), 320) for side in ("left", "right"))
        assert (counted & left).any() == reaches_over
        assert not (counted & right & ~trunk).any()
        assert (counted & trunk).sum() > 0.5 * trunk.sum()


# Tracking -------------------------------------------------------------------------------------------------------------


def followed(skin: set[str], codes: bool, seed: int = 0) -> list[State]:
    of = MonocularTracker(view(), make_settings("default", {"torso": {"particles": 200}, "arm": {"particles": 300}, "explore": 300}))
    rng, states = np.random.default_rng(seed), []
    for n, pose in enumerate(poses_of_arms(30)):
        image, mask = painted(pose, view(), skin, seed=n)
        seen = colour_codes(image) if codes else None
        states.append(of.step(rng, states[-1], mask, codes=seen) if states else of.start(rng, mask))
    return states


def hand_errors(states: list[State]) -> np.ndarray:
    """Distance of the left hand from the true one in the picture, pixels."""
    found, true = (view().camera.project(view().points_world(poses, ["left_hand"])[:, 0])
                   for poses in (np.array([state.pose for state in states]), poses_of_arms(30)))
    return np.linalg.norm(found - true, axis=1)


def test_an_arm_before_the_trunk_is_followed():
    before = slice(20, None)
    with_colours, without = (np.mean([hand_errors(followed(BARE, codes, seed))[before] for seed in range(2)]) for codes in (True, False))
    assert with_colours < 8
    assert without > 1.5 * with_colours


def test_hands_like_the_clothes_change_nothing():
    plain, coloured = followed(set(), codes=False), followed(set(), codes=True)
    assert all(np.array_equal(one.pose, other.pose) for one, other in zip(plain, coloured))
    assert coloured[-1].colours is not None
    assert plain[-1].colours is None


def test_what_is_learnt_is_kept_and_grows():
    states = followed(BARE, codes=True)
    known = [state.colours for state in states if state.colours is not None]
    assert all(later.rest.sum() >= earlier.rest.sum() for earlier, later in pairwise(known))
    assert distinct(known[-1])[0] == ("hand", "forearm")


def test_the_papers_filter_does_without():
    of, pose = MonocularTracker(view(), make_settings("liu2011")), poses_of_arms(30)[0]
    image, mask = painted(pose, view(), BARE)
    rng = np.random.default_rng(0)
    assert of.step(rng, of.start(rng, mask), mask, codes=colour_codes(image)).colours is None


# Doubt ----------------------------------------------------------------------------------------------------------------


def test_an_arm_that_is_elsewhere_does_not_match():
    """As many pixels as the true arm and the wrong one have together, over the wrong one's."""
    counts, _ = counts_of(BARE, view())
    true, wrong = poses_of_arms(30)[-1], poses_of_arms(30)[0]
    image, mask = painted(true, view(), BARE)
    colours = ArmColours(view())
    seen = colours.seen(counts, colour_codes(image), mask, true, view().empty())
    right = colours.mismatch(seen, true)
    assert set(right) == {"left_arm", "right_arm"}
    assert max(right.values()) < 0.3
    found = colours.mismatch(seen, wrong)
    drawn = {side: unpack(view().draw(wrong, shapes_of(view().body, f"{side}_hand", f"{side}_forearm")), 320) for side in ("left", "right")}
    shown, counted = unpack(seen.observation.silhouette, 320), ~unpack(seen.observation.ignore, 320)
    over = (shown & counted & ~drawn["left"] & ~drawn["right"]).sum()
    for side, own in drawn.items():
        expected = ((own & counted & ~shown).sum() + over) / (own & counted).sum()
        assert found[f"{side}_arm"] == pytest.approx(min(expected, 1.0))
    assert found["left_arm"] == 1


def test_doubt_about_an_arm_before_the_trunk_ends_where_its_colours_show_it():
    states = followed(BARE, codes=True)
    doubt, pose = MonocularDoubt(MonocularTracker(view(), make_settings("default"))), poses_of_arms(30)[-1]
    mask = view().mask(pose)
    seen = states[-1]._replace(pose=pose)
    blind = seen._replace(observation=replace(seen.observation, arms=None))
    hand = doubt.names.index("left_hand")
    known, unknown = (doubt.evidence(state, mask, 0.0, None)[0].components for state in (seen, blind))
    assert known["hidden"][hand, 0] < 0.3 * unknown["hidden"][hand, 0]
    assert unknown["hidden"][hand, 0] > 0.1
