"""The search for a first pose: what it tries, and that it finds people who stand in a coarse pose anywhere in the picture."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from people import BODIES, camera, picture

from shadowpuppet.body.models import average_sizes, make_body
from shadowpuppet.body.segments import coarse_arms, parts_of
from shadowpuppet.body.skeleton import SIDES
from shadowpuppet.camera.rasterize import Picture, place
from shadowpuppet.tracking.monocular.pose_search import search_pose, search_turned
from shadowpuppet.tracking.silhouette_cost import Observation

LIBRARY = coarse_arms()
VIEW = picture("rounded")
"""Level with the camera, so that nothing of the legs' place is in the way."""


def overlap(view, pose, mask) -> float:
    return Observation.without_legs(mask, view, pose).cost_and_overlap(view.draw(pose))[1]


def test_coarse_arms_are_possible_and_no_two_are_alike():
    low, high = (limit[-4:] for limit in VIEW.body.skeleton.limits)
    assert ((low <= LIBRARY) & (high >= LIBRARY)).all()
    assert len(np.unique(LIBRARY, axis=0)) == len(LIBRARY)
    straight = LIBRARY[:, 3] < np.radians(10)
    assert (LIBRARY[straight, 2] == 0).all()  # a straight arm has no roll


def test_every_direction_of_an_arm_is_near_a_coarse_one():
    """An arm somewhere within its limits lies within 25 degrees of one that is tried; where arms are used, closer."""
    a, f = np.radians(np.meshgrid(np.arange(-10, 175, 5), np.arange(-10, 91, 5)))
    wanted = np.stack([np.sin(f), np.cos(f) * np.sin(a), -np.cos(f) * np.cos(a)], -1).reshape(-1, 3)
    a, f = LIBRARY[:, 0], LIBRARY[:, 1]
    tried = np.stack([np.sin(f), np.cos(f) * np.sin(a), -np.cos(f) * np.cos(a)], -1)
    assert np.degrees(np.arccos(np.clip(wanted @ tried.T, -1, 1).max(1))).max() < 25


@pytest.mark.parametrize("body", BODIES)
def test_an_arm_s_parts(body):
    hand = ["left_hand"] if body == "rounded" else []
    assert parts_of(picture(body).body, "left_arm") == ["left_upper_arm", "left_forearm", *hand]


@given(st.integers(0, len(LIBRARY) - 1), st.integers(0, len(LIBRARY) - 1), st.floats(-0.6, 0.6))
@settings(max_examples=15, deadline=None)
def test_who_stands_in_a_coarse_pose_is_found(left, right, y):
    pose = np.array([y, 0, 0, 0, *LIBRARY[left], *LIBRARY[right]])
    mask = VIEW.mask(pose)
    found = search_pose(VIEW, mask)
    assert abs(found.pose[0] - y) < 0.03
    assert overlap(VIEW, found.pose, mask) > 0.85
    assert found.cost <= 0.15 * mask.sum()


def test_level_arms_are_found_to_the_pixel():
    straight = np.radians([90, 0, 0, 5])
    step = np.linspace(-1, 1, 161) * 2.5 / 2 / 0.87  # the places that are tried
    pose = np.array([step[95], 0, 0, 0, *straight, *straight])
    found = search_pose(VIEW, VIEW.mask(pose))
    np.testing.assert_allclose(found.pose, pose, atol=1e-9)
    assert found.cost == 0


def test_all_arms_come_back_the_best_first():
    mask = VIEW.mask(np.array([0.1, 0, 0, 0, *LIBRARY[100], *LIBRARY[200]]))
    found = search_pose(VIEW, mask)
    assert list(found.limbs) == ["left_arm", "right_arm"]
    for side, arms in zip(SIDES, found.limbs.values()):
        np.testing.assert_array_equal(arms[0], found.pose[VIEW.body.skeleton.dof_indices(
            [f"{side}_{name}" for name in ("shoulder_abduction", "shoulder_forward", "elbow_roll", "elbow_flexion")])])
        np.testing.assert_array_equal(np.unique(arms, axis=0), np.unique(LIBRARY, axis=0))


def test_legs_do_not_count():
    view = picture("rounded", camera((160, 200)), elevation=0.3)
    pose = np.array([0.2, 0, 0, 0, *LIBRARY[40], *LIBRARY[60]])
    mask = view.mask(pose)
    bare, dressed = search_pose(view, mask), search_pose(view, mask | view.legs(pose, spread=np.radians(10)))
    assert overlap(view, dressed.pose, mask) > overlap(view, bare.pose, mask) - 0.05
    assert dressed.cost < 1.3 * bare.cost + 50


def test_same_mask_same_pose():
    mask = VIEW.mask(np.array([0.1, 0.3, 0, 0, *LIBRARY[7], *LIBRARY[300]]))
    np.testing.assert_array_equal(search_pose(VIEW, mask).pose, search_pose(VIEW, mask.copy()).pose)


def test_nobody_is_found_where_nobody_is_but_a_pose_comes_back():
    for mask in (np.zeros((120, 160), bool), np.ones((120, 160), bool)):
        found = search_pose(VIEW, mask)
        assert np.isfinite(found.pose).all()
        assert overlap(VIEW, found.pose, mask) < 0.5


def whole(distance: float = 3.4) -> Picture:
    view = camera((160, 120))
    return Picture(make_body("anatomical", average_sizes("anatomical", 1.75)), view, place(view, distance, -0.1))


def test_who_sits_lower_than_measured_is_found_lower():
    view = whole()
    skeleton = view.body.skeleton
    pose = skeleton.pose(root_z=-0.4, left_hip_y=-1.4, right_hip_y=-1.4, left_knee_flexion=1.4, right_knee_flexion=1.4,
                         left_shoulder_x=0.9, right_shoulder_x=-0.9)
    mask = view.mask(pose)
    upright, found = search_pose(view, mask), search_turned(view, mask)
    assert upright.overlap < 0.6
    assert found.overlap > upright.overlap + 0.1
    assert found.pose[skeleton.dof_indices(["root_z"])[0]] == pytest.approx(-0.4, abs=0.12)


def test_who_fits_is_not_searched_for_elsewhere(monkeypatch):
    mask = VIEW.mask(np.array([0.1, 0, 0, 0, *LIBRARY[40], *LIBRARY[60]]))
    monkeypatch.setattr("shadowpuppet.tracking.monocular.pose_search._heights", None)
    np.testing.assert_array_equal(search_turned(VIEW, mask).pose, search_pose(VIEW, mask).pose)


@pytest.mark.parametrize("view", [VIEW, whole()], ids=["upper", "whole"])
def test_the_turned_search_never_does_worse(view, rng):
    for _ in range(2):
        low, high = np.clip(view.body.skeleton.limits, -1.2, 1.2)
        pose = rng.uniform(low, high)
        pose[: 3 if view is not VIEW else 1] = 0.0
        mask = view.mask(pose)
        assert search_turned(view, mask).overlap >= search_pose(view, mask).overlap
    nothing = np.zeros((120, 160), bool)
    np.testing.assert_array_equal(search_turned(view, nothing).pose, search_pose(view, nothing).pose)


def test_the_overlap_is_that_of_the_pose():
    mask = VIEW.mask(np.array([0.1, 0.3, 0, 0, *LIBRARY[7], *LIBRARY[300]]))
    found = search_pose(VIEW, mask)
    assert found.overlap == pytest.approx(overlap(VIEW, found.pose, mask), abs=0.02)
