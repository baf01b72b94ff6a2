"""Doubt about several cameras' estimates: it grows with surface that is missing, or that nothing explains, and with frozen cameras."""

from __future__ import annotations

from functools import cache

import actor
import numpy as np

from shadowpuppet.tracking.doubt.multiview import MultiviewDoubt, count_still
from shadowpuppet.tracking.multiview.settings import make_multiview_settings
from shadowpuppet.tracking.multiview.surface.visual_hull import SurfacePoints
from shadowpuppet.tracking.multiview.tracker import MultiviewState, MultiviewTracker
from shadowpuppet.tracking.particle_filter import Particles

BODY = actor.body()
NAMES = BODY.landmark_names
POSE = actor.stance(BODY.skeleton)
HAND, FOOT = NAMES.index("left_hand"), NAMES.index("right_ankle")


@cache
def tracker() -> MultiviewTracker:
    return MultiviewTracker(BODY, actor.cameras(), make_multiview_settings("default", {"particles": 8}))


def surface() -> SurfacePoints:
    return actor.surface(BODY, POSE, np.random.default_rng(1))


def doubt(seen: SurfacePoints | None = None, spread: float = 0.0, before=None, seconds: float = 0.0, views=None):
    poses = POSE + spread * np.random.default_rng(0).normal(size=(8, len(POSE)))
    state = MultiviewState(POSE, 0 * POSE, Particles(poses, np.zeros(8), np.zeros(8)), 0.0, 0.9, "tracked")
    views = [None] * len(actor.cameras()) if views is None else views
    return MultiviewDoubt(tracker())(state, surface() if seen is None else seen, views, seconds, before)


def some(which) -> SurfacePoints:
    whole = surface()
    keep = which(whole.points)
    return SurfacePoints(*(values[keep] for values in whole))


def test_a_body_that_explains_its_surface_and_silhouettes_is_vouched_for():
    found, _ = doubt(views=actor.masks(BODY, POSE))
    assert found.joint_sd.shape == (len(NAMES), 3)
    assert found.pose_sd.shape == POSE.shape
    assert (found.joint_sd > 0).all()
    assert np.isfinite(found.pose_sd).all()
    assert set(found.limb_status) == {"tracked"}
    again, _ = doubt(views=actor.masks(BODY, POSE))
    assert all(np.array_equal(a, b) for a, b in zip(found[:3], again[:3]))
    assert not found.modes


def test_an_arm_without_surface_is_more_doubtful_than_one_with_it():
    hand = BODY.points(POSE[None])[0][HAND]
    (whole, _), (bare, _) = doubt(), doubt(some(lambda points: np.linalg.norm(points - hand, axis=1) > 0.45))
    assert bare.joint_sd[HAND].max() > 1.3 * whole.joint_sd[HAND].max()


def test_particles_that_disagree_make_the_joints_doubtful():
    (one, _), (other, _) = doubt(), doubt(spread=0.1)
    assert (other.joint_sd >= one.joint_sd).all()
    assert other.joint_sd[HAND].max() > 1.1 * one.joint_sd[HAND].max()


def test_a_joint_that_was_near_its_counterpart_may_be_confused_with_it():
    found, before = doubt()
    near = before._replace(apart=np.zeros_like(before.apart))
    confused, _ = doubt(before=near, seconds=0.05)
    assert confused.joint_sd[FOOT].max() > found.joint_sd[FOOT].max()
    later, _ = doubt(before=near, seconds=5.0)
    np.testing.assert_allclose(later.joint_sd[FOOT], found.joint_sd[FOOT], rtol=0.3)


def test_one_camera_that_repeats_its_silhouette_is_counted_and_an_empty_one_is_not():
    mask, other, empty = np.eye(4, dtype=bool), ~np.eye(4, dtype=bool), np.zeros((4, 4), bool)
    _, before = doubt()
    before = before._replace(masks=(mask, mask, empty), still=2)
    assert count_still(before, [mask, other, empty]) == 3
    assert count_still(before, [other, other, empty]) == 0
    assert count_still(before, [other, None, empty]) == 0
    assert count_still(None, [mask]) == 0
