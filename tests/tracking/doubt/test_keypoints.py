"""Doubt by keypoints: what no camera shows, depth before one camera, rays that miss the body, sides that may be exchanged."""

from __future__ import annotations

import actor
import numpy as np

from benchmarks.detector import EXACT, detected
from shadowpuppet.camera.keypoints import Keypoints
from shadowpuppet.motion.limbs import LIMBS
from shadowpuppet.tracking.doubt.keypoints import KeypointView, keypoint_view
from shadowpuppet.tracking.keypoints.definitions import landmarks_of
from shadowpuppet.tracking.multiview.keypoint_evidence import keypoint_evidence
from shadowpuppet.tracking.multiview.refinement.refiner import Refiner
from shadowpuppet.tracking.multiview.settings import MultiviewSettings

BODY = actor.body()
MARKS, POSE, NAMES = landmarks_of(BODY), actor.walk(BODY.skeleton, 1)[0], BODY.landmark_names
PLACES = BODY.skeleton.points(POSE[None], MARKS.joints, MARKS.places)[0]
WRIST, ELBOW = NAMES.index("left_wrist"), NAMES.index("left_elbow")


def view(cameras: int = 5, places=PLACES, without: str = "") -> KeypointView:
    """What cameras say of `POSE` that see landmarks at places (K, 3), but those `without`."""
    own = actor.cameras()[:cameras]
    found = detected(np.random.default_rng(0), own, np.zeros(1), MARKS.names, places[None], EXACT)[0]
    hidden = np.array([bool(without) and without in name for name in MARKS.names])
    found = [Keypoints(each.names, np.where(hidden[:, None], np.nan, each.xy), np.where(hidden, 0, each.confidence), each.person, "made")
             for each in found]
    seen = keypoint_evidence(Refiner(BODY), own, MultiviewSettings(), found, [None] * cameras, None, POSE)
    assert seen is not None
    return keypoint_view(BODY, POSE, seen)


def test_what_cameras_see_is_known_and_what_none_sees_is_not():
    whole, armless = view(), view(without="left_wrist")
    assert whole.known.tolist() == [1.0] * len(LIMBS)
    assert armless.known[LIMBS.index("left_arm")] < 0.7
    assert armless.known[LIMBS.index("right_arm")] == 1.0
    assert armless.components["posterior"][WRIST].max() > 3 * whole.components["posterior"][WRIST].max()
    assert np.allclose(armless.components["posterior"][ELBOW], whole.components["posterior"][ELBOW], rtol=0.5)


def test_one_camera_does_not_tell_how_far_away_a_wrist_is():
    towards = PLACES[MARKS.names.index("left_wrist")] - actor.cameras()[0].centre
    along = np.abs(towards / np.linalg.norm(towards))
    one, five = (view(cameras).components["posterior"][WRIST] for cameras in (1, 5))
    assert one @ along > 3 * five @ along


def test_rays_that_miss_the_body_are_far_from_it():
    moved = PLACES + np.where([["left_elbow" in name or "left_wrist" in name] for name in MARKS.names], 0.06, 0.0)
    found = view(places=moved).components["apart"]
    assert 0.02 < found[WRIST, 0] < 0.1
    assert found[NAMES.index("right_wrist"), 0] < 1e-3


def test_sides_that_rays_tell_apart_are_not_exchanged_and_others_may_be():
    assert view().components["exchanged"].max() < 1e-3
    assert view(without="_").components["exchanged"][WRIST].max() > 0.2  # but the nose
