"""Arms in several cameras' pictures: colours are learnt where arms are seen, and must be covered by the arms of a pose."""

from __future__ import annotations

from functools import cache

import actor
import numpy as np
import pytest

from shadowpuppet.camera.bits import unpack
from shadowpuppet.camera.colour_codes import step_of, thinned
from shadowpuppet.tracking.arm_colours import kind_of
from shadowpuppet.tracking.multiview.arms_in_views import PLENTY, ArmsInViews
from shadowpuppet.tracking.multiview.settings import MultiviewSettings
from shadowpuppet.tracking.multiview.tracker import MultiviewTracker

SKIN, SHIRT, WALL = 2000, 300, 4000
"""Numbers of colours."""
BODY = actor.body()
POSE = actor.stance(BODY.skeleton)
ELBOW = BODY.skeleton.dof_indices(["left_elbow_flexion"])


@cache
def arms() -> ArmsInViews:
    return ArmsInViews(BODY, actor.cameras())


def seen(pose: np.ndarray, bare: tuple[str, ...] = ("hand", "forearm"), shirt: int = SHIRT) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Masks and colours of a person with bare arms; arms are before the trunk in all cameras."""
    masks, codes = actor.masks(BODY, pose), []
    for view, mask in zip(arms().views, masks):
        found = np.where(thinned(mask), shirt, WALL).astype(np.uint16)
        found[unpack(view.picture.draw(pose, view.shapes_of(bare)), view.picture.camera.size[0])] = SKIN
        codes.append(found)
    return masks, codes


def counted(frames: int = 12, **given):
    counts = ()
    for pose in actor.walk(BODY.skeleton, frames, 5.0):
        masks, codes = seen(pose, **given)
        counts = arms().learnt(counts, codes, masks, pose)
    return counts


def bent(pose: np.ndarray, by: float = 0.8) -> np.ndarray:
    pose = pose.copy()
    pose[ELBOW] += by
    return pose


def test_pictures_are_those_whose_colours_are_kept():
    for view, camera in zip(arms().views, actor.cameras()):
        width, height = camera.size
        assert view.picture.camera.size == thinned(np.zeros((height, width), bool)).shape[::-1]
        assert step_of(view.picture.camera.size) == 1


def test_what_no_arm_covers_costs():
    counts, (masks, codes) = counted(), seen(POSE)
    cost = arms().uncovered(counts, codes, masks, POSE)
    assert cost is not None
    poses = np.array([POSE, bent(POSE, 0.2), bent(POSE)])
    found, naive, area = cost(poses), np.zeros(3), sum(thinned(mask).sum() for mask in masks)
    for n, pose in enumerate(poses):
        for view, seen_here, mask in zip(arms().views, codes, masks):
            own = np.logical_or.reduce([view.drawn(pose, kind) for kind in ("hand", "forearm", "upper_arm")])
            naive[n] += np.count_nonzero((seen_here == SKIN) & thinned(mask) & ~own)
    assert 0 == found[0] < found[1] < found[2]
    assert (found <= naive / area).all()
    assert (found >= 0.3 * naive / area).all()  # what is narrower than three pixels does not count


def test_a_camera_without_a_picture_or_a_person_says_nothing():
    counts, (masks, codes) = counted(), seen(POSE)
    whole = arms().uncovered(counts, codes, masks, POSE)
    assert whole is not None
    for gone_masks, gone_codes in (([None, *masks[1:]], codes), (masks, [None, *codes[1:]])):
        part = arms().uncovered(counts, gone_codes, gone_masks, POSE)
        assert part is not None
        assert 0 < part(bent(POSE)[None])[0] != whole(bent(POSE)[None])[0]
    same = arms().learnt(counts, [None] * len(masks), masks, POSE)
    assert all(one is other for one, other in zip(same, counts))
    assert arms().learnt((), codes, [None] * len(masks), POSE) == (None,) * len(masks)


def test_a_camera_that_knows_enough_learns_no_more():
    counts, (masks, codes) = counted(), seen(POSE)
    enough = counts[0]._replace(hand=counts[0].hand * PLENTY)
    found = arms().learnt((enough, *counts[1:]), codes, masks, POSE)
    assert found[0] is enough
    assert all(one.rest.sum() > other.rest.sum() for one, other in zip(found[1:], counts[1:]))


@pytest.mark.parametrize("given", [{"bare": ("upper_arm",)}, {"shirt": SKIN}])
def test_gloves_of_the_shirts_colour_say_nothing(given):
    masks, codes = seen(POSE, **given)
    assert arms().uncovered(counted(**given), codes, masks, POSE) is None


def test_a_shadow_of_that_colour_far_from_the_arms_does_not_count():
    counts, (masks, codes) = counted(), seen(POSE)
    clean = arms().uncovered(counts, codes, masks, POSE)
    for mask, colours in zip(masks, codes):
        assert mask.shape == colours.shape
        bottom = np.flatnonzero(mask.any(1))[-1]
        mask[bottom - 4 : bottom, :5] = True
        colours[bottom - 4 : bottom, :5] = SKIN
    found = arms().uncovered(counts, codes, masks, POSE)
    assert clean is not None
    assert found is not None
    area = [sum(thinned(mask).sum() for mask in each) for each in (seen(POSE)[0], masks)]
    np.testing.assert_allclose(found(POSE[None]) * area[1], clean(POSE[None]) * area[0])


def test_a_tracker_learns_colours_and_uses_them_and_without_pictures_nothing_changes():
    tracker = MultiviewTracker(BODY, actor.cameras(), MultiviewSettings(particles=6, arm_colours=0.1))
    off = MultiviewTracker(BODY, actor.cameras(), MultiviewSettings(particles=6, arm_colours=0.0))
    shown = {}
    for name, each, given in (("colours", tracker, True), ("none", tracker, False), ("off", off, True)):
        rng, state = np.random.default_rng(3), None
        for pose in actor.walk(BODY.skeleton, 6, 5.0):
            masks, codes = seen(pose)
            points = actor.hull().points(masks)
            state = each.start(rng, points, masks) if state is None else each.step(rng, state, points, masks, codes=codes if given else ())
        shown[name] = state
    assert sum(counts is not None and counts.hand.sum() > 0 for counts in shown["colours"].colours) == len(actor.cameras())
    assert shown["none"].colours == shown["off"].colours == ()
    np.testing.assert_array_equal(shown["none"].pose, shown["off"].pose)


def test_kinds_are_those_of_this_body():
    assert {kind_of(part) for part in BODY.parts} >= {"hand", "forearm", "upper_arm", "head", "rest"}


@pytest.mark.parametrize(("cameras", "chosen", "weight"), [(3, None, 0.1), (4, None, 0.1), (5, None, 0.0), (5, 0.2, 0.2), (3, 0.0, 0.0)])
def test_few_cameras_look_for_colours(cameras, chosen, weight):
    assert MultiviewTracker(BODY, actor.cameras()[:cameras], MultiviewSettings(arm_colours=chosen)).arm_colours == weight
