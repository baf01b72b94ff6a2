"""One camera's passes over a film: about a profile the forward pass alone counts, elsewhere the one that fits better."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
from runs import body_of, root_of
from smoothers import motion_of

from shadowpuppet.pipeline.person import MonocularSubject
from shadowpuppet.tracking.smoothing.facing import BESIDE

NAME, FRAMES = "rounded", 60
BODY = body_of(NAME)
NAMES = BODY.skeleton.dof_names


def points(poses: np.ndarray) -> np.ndarray:
    return BODY.points(poses, root_of(BODY))


def passing(arm: float, overlap: float, twist: float = 0.0):
    """A pass that has the left arm so far in front (rad), a twist (rad) of the trunk in frame 30, and an overlap."""
    poses = np.zeros((FRAMES, len(NAMES)))
    poses[:, NAMES.index("left_shoulder_abduction")] = 1.0
    poses[:, NAMES.index("left_shoulder_forward")] = arm
    poses[30, NAMES.index("torso_twist")] = twist
    motion = motion_of(NAME, poses)
    return replace(motion, overlap=np.full(FRAMES, overlap))


def test_about_a_profile_the_forward_pass_alone_counts():
    """There the passes may be mirror images of each other."""
    turned, better = passing(0.2, 0.80, np.radians(80)), passing(0.25, 0.95)
    near = np.abs(turned.times - turned.times[30]) <= BESIDE + 1e-6
    subject = SimpleNamespace(joints=points)
    both, share = MonocularSubject.blended(subject, turned, better)
    np.testing.assert_array_equal(share, ~near)
    np.testing.assert_array_equal(both.poses[near], turned.poses[near])
    _, other = MonocularSubject.blended(subject, better, turned)  # whichever of them is in profile
    assert not other[near].any()
