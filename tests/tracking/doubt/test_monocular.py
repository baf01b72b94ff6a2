"""Doubt about one camera's estimates: it grows with what the silhouette does not show, contradicts or repeats."""

from __future__ import annotations

from functools import cache

import numpy as np
import people
import pytest
from legs import over_floor, wide

from shadowpuppet.motion.limbs import limbs_of
from shadowpuppet.tracking.doubt.mirror import Mirrors, _weights
from shadowpuppet.tracking.doubt.monocular import MonocularDoubt
from shadowpuppet.tracking.doubt.variance import variance_model
from shadowpuppet.tracking.monocular.settings import make_settings
from shadowpuppet.tracking.monocular.standing_place import lowest
from shadowpuppet.tracking.monocular.tracker import MonocularTracker
from shadowpuppet.tracking.silhouette_cost import Observation

NAMES = people.picture().body.landmark_names
LEFT_HAND, RIGHT_HAND = NAMES.index("left_hand"), NAMES.index("right_hand")


@cache
def tracker() -> MonocularTracker:
    return MonocularTracker(people.picture(), make_settings("liu2011", {}))


def pose(**angles: float) -> np.ndarray:
    spread = {"left_shoulder_abduction": 1.3, "right_shoulder_abduction": 1.3}
    return people.picture().body.skeleton.pose(**(spread | angles))


def state(at: np.ndarray, mask: np.ndarray | None = None):
    """The state of an estimate that all particles agree on."""
    mask = people.picture().mask(at) if mask is None else mask
    begun = tracker().start(np.random.default_rng(0), mask)
    particles = [each._replace(poses=np.repeat(at[None, stage.dofs], len(each.poses), axis=0))
                 for stage, each in zip(tracker().stages, begun.particles)]
    return tracker().judge(at, particles, tracker().observe(mask, at))


def doubt(at: np.ndarray, mask: np.ndarray | None = None, before=None, seconds: float = 0.0):
    mask = people.picture().mask(at) if mask is None else mask
    return MonocularDoubt(tracker())(state(at, mask), mask, seconds, before)


def test_the_same_frame_has_the_same_doubt_and_a_fitting_estimate_of_a_stretched_body_little():
    (one, _), (other, _) = doubt(pose()), doubt(pose())
    assert all(np.array_equal(a, b) for a, b in zip(one[:3], other[:3]))
    assert [mode.weight for mode in one.modes] == [mode.weight for mode in other.modes]
    assert one.joint_sd.shape == (len(NAMES), 3)
    assert one.pose_sd.shape == (len(pose()),)
    assert np.isfinite(one.joint_sd).all()
    assert (one.joint_sd > 0).all()
    assert np.isfinite(one.pose_sd).all()
    assert one.limb_status == ("tracked",) * 3


def test_an_arm_before_the_trunk_is_doubtful_and_the_other_is_not_affected():
    hidden = pose(left_shoulder_abduction=0.1, left_elbow_roll=1.5, left_elbow_flexion=2.0)
    (seen, _), (unseen, _) = doubt(pose()), doubt(hidden)
    assert (unseen.joint_sd[LEFT_HAND] > 1.5 * seen.joint_sd[LEFT_HAND]).any()
    np.testing.assert_allclose(unseen.joint_sd[RIGHT_HAND], seen.joint_sd[RIGHT_HAND], rtol=0.5)


@pytest.mark.parametrize(("degrees", "statuses"), [(60, {"tracked"}), (85, {"uncertain"})])
def test_a_trunk_that_bows_as_low_as_a_seated_person_is_not_vouched_for(degrees, statuses):
    found, _ = doubt(pose(torso_bow=np.radians(degrees), left_shoulder_abduction=1.2, right_shoulder_abduction=1.2))
    assert {found.limb_status[0]} == statuses


def test_silhouette_that_nothing_explains_near_an_arm_makes_it_doubtful():
    mask = people.picture().mask(pose())
    pixel = np.rint(people.picture().camera.project(people.picture().points_world(pose()[None])[0][LEFT_HAND])).astype(int)
    more = mask.copy()
    more[pixel[1] + 6 : pixel[1] + 30, pixel[0] - 10 : pixel[0] + 10] = True
    (clean, _), (odd, _) = doubt(pose(), mask), doubt(pose(), more)
    assert odd.joint_sd[LEFT_HAND].max() > 1.2 * clean.joint_sd[LEFT_HAND].max()


def test_an_arm_outside_the_silhouette_is_doubtful():
    without = people.picture().mask(pose(left_shoulder_abduction=0.0))
    (clean, _), (odd, _) = doubt(pose()), doubt(pose(), without)
    assert odd.joint_sd[LEFT_HAND].max() > 1.5 * clean.joint_sd[LEFT_HAND].max()
    assert odd.limb_status[1] != "tracked"


def test_a_silhouette_that_does_not_change_makes_all_limbs_doubtful_after_a_while():
    before, found = None, []
    for n in range(30):
        now, before = doubt(pose(), before=before, seconds=n / 15)
        found.append(now)
    assert found[2].limb_status == found[0].limb_status == ("tracked",) * 3
    assert found[-1].limb_status == ("predicted",) * 3
    assert (found[-1].joint_sd >= found[0].joint_sd - 1e-12).all()


FORWARD = {"left_shoulder_abduction": 1.1, "left_shoulder_forward": 0.5, "left_elbow_flexion": 0.3}
MIRRORS = Mirrors(people.picture())


def images(at: np.ndarray, mask: np.ndarray):
    points = people.picture().points(at[None])[0]
    return points, MIRRORS.images(at, points, Observation.of(mask))


def test_mirror_images_are_found_within_the_joints_limits_and_count_where_the_silhouette_allows_them():
    forward = pose(**FORWARD)
    points, seen = images(forward, people.picture().mask(forward))
    allowed = seen.displacements(points)
    assert allowed[LEFT_HAND, 2] > 0.1 > 0.05 > allowed[NAMES.index("neck")].max()
    low, high = people.picture().body.skeleton.limits
    found = MIRRORS.nearest(forward, points)
    assert (found >= low - 1e-9).all()
    assert (found <= high + 1e-9).all()
    _, elsewhere = images(forward, np.zeros_like(people.picture().mask(forward)))
    assert np.isfinite(elsewhere.displacements(points)).all()


def test_an_arm_that_points_to_the_camera_may_point_away_from_it():
    forward = pose(**FORWARD)
    found = doubt(forward)[0].modes
    points, world = images(forward, people.picture().mask(forward))[0], people.picture().points_world(forward[None])[0]
    own = [mode for mode in found if mode.limb == "left_arm"]
    assert own
    assert [mode.weight for mode in own] == sorted((mode.weight for mode in own), reverse=True)
    assert 0 < sum(mode.weight for mode in own) < 1
    T = people.picture().camera.T_camera_world
    depth = points[LEFT_HAND, 2] - points[NAMES.index("left_shoulder"), 2]
    other = (own[0].joints[LEFT_HAND] @ T[:3, :3].T + T[:3, 3])[2] - points[NAMES.index("left_shoulder"), 2]
    assert depth * other < 0 or abs(other - depth) > 0.1
    assert np.linalg.norm(own[0].joints[LEFT_HAND] - world[LEFT_HAND]) > 0.1
    assert np.isnan(own[0].joints[[NAMES.index("neck"), RIGHT_HAND, NAMES.index("left_shoulder")]]).all()


def test_an_arm_in_the_plane_of_the_picture_has_no_other_place():
    flat = pose(left_shoulder_abduction=1.57, right_shoulder_abduction=1.57)
    assert all(mode.weight < 0.5 for mode in doubt(flat)[0].modes)


def test_images_that_differ_from_no_other_place_are_no_modes_and_cheaper_ones_weigh_more():
    ends, same = np.zeros((2, 3)), np.zeros(3)
    far, near, other = (np.full((2, 3), x) for x in (0.2, 0.19, -0.2))
    weights = variance_model("monocular").modes
    assert weights is not None
    assert _weights(ends, np.array([far, near, ends + 0.01]), same) == {0: pytest.approx(1 / (1 + weights.odds))}
    found = _weights(ends, np.array([far, other, near]), np.array([100.0, 0, 50]))
    assert list(found) == [1, 2]
    assert found[1] > found[2] > 0.15
    assert not _weights(ends, np.array([far] * 3), np.full(3, 1e6))


def test_the_spread_is_that_of_the_particles_where_they_are_equally_good():
    """Half of an arm's particles are where the estimate is, half 0.4 rad off; costs of the others are too high to count."""
    body, at = people.picture().body, pose()
    k = body.skeleton.dof_names.index("left_shoulder_abduction")
    off = at.copy()
    off[k] += 0.4
    begun, particles = state(at), []
    for stage, each in zip(tracker().stages, begun.particles):
        poses, costs = np.repeat(at[None, stage.dofs], 300, axis=0), np.zeros(300)
        if k in stage.dofs:
            poses[:100] = off[stage.dofs]
            poses[200:], costs[200:] = 0.0, 1e6
        particles.append(each._replace(poses=poses, costs=costs))
    points = people.picture().points(at[None])[0]
    moved = people.picture().points(off[None])[0] - points
    found = MonocularDoubt(tracker())._spread(begun._replace(particles=tuple(particles)), points)
    assert abs(moved[LEFT_HAND]).max() > 0.1
    np.testing.assert_allclose(found, abs(moved) * np.sqrt(0.5), atol=2e-3)


# A whole body


@pytest.fixture(scope="module")
def stands():
    """A tracker of a whole person over a floor, and an upright pose on it."""
    view = wide(over_floor("anatomical"))
    assert view.floor is not None
    pose = view.body.skeleton.pose()
    pose[view.body.skeleton.dof_indices(["root_z"])] = view.floor - lowest(view)
    return MonocularTracker(view, make_settings(overrides={"body": "anatomical"})), pose


def evidence(tracker: MonocularTracker, pose: np.ndarray, mask: np.ndarray):
    """The components of a whole body's doubt by which its place is judged, of the pelvis, by name."""
    state = tracker.start(np.random.default_rng(0), mask)._replace(pose=pose)
    found, _ = MonocularDoubt(tracker).evidence(state, mask, 0.0, None)
    at = tracker.picture.body.landmark_names.index("pelvis")
    return {name: found.components[name][at] for name in ("stature", "no_stature", "floor")}


def test_who_stands_where_stature_and_floor_say_is_sure_and_who_is_elsewhere_is_not(stands):
    tracker, pose = stands
    mask = tracker.picture.mask(pose)
    right = evidence(tracker, pose, mask)
    assert right["stature"][2] < 0.1
    assert right["floor"][2] < 0.1
    assert not right["no_stature"].any()
    moved = pose.copy()
    moved[tracker.picture.body.skeleton.dof_indices(["root_x"])] -= 0.5
    off = evidence(tracker, moved, mask)
    assert off["stature"][2] == pytest.approx(0.5, abs=0.1)
    assert off["floor"][2] == pytest.approx(0.5, abs=0.1)


def test_a_silhouette_that_the_picture_cuts_off_shows_no_stature(stands):
    tracker, pose = stands
    mask = tracker.picture.mask(pose)
    mask[-1, np.flatnonzero(mask.any(0))[0]] = True
    found = evidence(tracker, pose, mask)
    assert found["no_stature"].tolist() == [0, 0, 1]
    assert not found["stature"].any()


def test_legs_have_the_calibrated_limits_and_crossing_limbs_are_doubted(stands):
    tracker, pose = stands
    state = tracker.start(np.random.default_rng(0), tracker.picture.mask(pose))._replace(pose=pose)
    doubt = MonocularDoubt(tracker)
    found, _ = doubt(state, tracker.picture.mask(pose), 0.0, None)
    assert len(found.limb_status) == len(limbs_of(doubt.names)) == 5
    components = doubt.evidence(state, tracker.picture.mask(pose), 0.0, None)[0].components
    ankles = [doubt.names.index(f"{side}_ankle") for side in ("left", "right")]
    np.testing.assert_allclose(components["swapped"][ankles[0]], np.abs(np.diff(tracker.picture.points(pose[None])[0, ankles], axis=0))[0])
