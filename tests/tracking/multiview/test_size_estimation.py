"""Who is in the first frames: sizes found from hulls alone, held where they are known, and nobody said so."""

from __future__ import annotations

import functools
from functools import partial

import actor
import numpy as np
import pytest

from benchmarks.detector import EXACT, detected
from shadowpuppet.body.anthropometry import SOLE, stature_of
from shadowpuppet.body.models import WHOLE, average_sizes, make_body, shares_of
from shadowpuppet.body.sizes import AnatomicalSizes
from shadowpuppet.body.whole_body import anatomical
from shadowpuppet.errors import TrackingError
from shadowpuppet.tracking.keypoints.definitions import landmarks_of
from shadowpuppet.tracking.multiview import size_estimation
from shadowpuppet.tracking.multiview.height_estimation import FirstFrame, first_frames
from shadowpuppet.tracking.multiview.settings import MultiviewSettings
from shadowpuppet.tracking.multiview.size_estimation import (
    CLOTHES,
    JOINT_DEVIATION,
    SIZES_FROM_JOINTS,
    SPINE,
    SPINE_DEVIATION,
    STATURE_DEVIATION,
    Front,
    dressed,
    estimate_sizes,
    shared_deviations,
    size_deviations,
)
from shadowpuppet.tracking.multiview.tracker import MultiviewState, MultiviewTracker
from shadowpuppet.tracking.particle_filter import Particles

SETTINGS = MultiviewSettings(particles=8)
NAMES = AnatomicalSizes.names()
GIRTHS = {"thigh_width": 1.25, "waist_depth": 1.35, "waist_width": 1.2, "pelvis_width": 1.2, "pelvis_depth": 1.2, "upper_arm_width": 1.2}
MEAN = actor.sizes()
WIDTHS = ("width", "depth", "thickness")


@functools.cache
def stout() -> tuple[AnatomicalSizes, np.ndarray, list]:
    """Somebody of average bones and wide girths, who walks and bends knees and elbows."""
    true = actor.sizes(**GIRTHS)
    body = anatomical(true)
    poses = actor.walk(body.skeleton, 6, 5.0)
    rng = np.random.default_rng(2)
    for joint in ("left_elbow", "right_elbow", "left_knee", "right_knee"):
        poses[:, body.skeleton.dof_indices([f"{joint}_flexion"])] += rng.uniform(0, 0.5, (len(poses), 1))
    masks = [actor.masks(body, pose) for pose in poses]
    return true, poses, [(actor.hull().points(row), row) for row in masks]


def measured(spread, first=None, expected=MEAN, seed: int = 0, library=None):
    first = stout()[2] if first is None else first
    library = actor.walk(actor.body().skeleton, 12) if library is None else library
    make = partial(make_body, "anatomical")
    return estimate_sizes(np.random.default_rng(seed), make, expected, spread, actor.cameras(), first, SETTINGS, library)


def test_girths_are_found_where_the_bones_are_known():
    true, poses, _ = stout()
    spread = size_deviations(MEAN, shown=True)
    known = np.isin(NAMES, SIZES_FROM_JOINTS)
    found = measured(np.where(known, spread, 4 * spread))  # more than people differ, so that a few frames decide
    before, after = (np.array([abs(getattr(sizes, name) - getattr(true, name)) for name in GIRTHS]) for sizes in (MEAN, found.sizes))
    assert after.sum() < 0.5 * before.sum()
    assert found.frames >= 5
    assert found.overlap > 0.85
    assert found.residual < 0.01
    for name in set(NAMES) & set(SIZES_FROM_JOINTS):
        most = SPINE_DEVIATION if name in SPINE else 5 * JOINT_DEVIATION
        assert getattr(found.sizes, name) == pytest.approx(getattr(MEAN, name), abs=most)
    np.testing.assert_array_equal(found.body.points(poses), anatomical(found.sizes).points(poses))


def test_a_height_is_enough_to_begin_with():
    """Somebody of 1.75 m, taken to be of 1.62 m."""
    short = average_sizes("anatomical", 1.62)
    assert isinstance(short, AnatomicalSizes)
    found = measured(size_deviations(short, shown=False), expected=short)
    long = ("thigh_length", "shank_length", "upper_arm_length", "forearm_length", "lumbar_height", "thorax_height")
    before, after = (sum(getattr(sizes, name) for name in long) for sizes in (short, found.sizes))
    true = sum(getattr(stout()[0], name) for name in long)
    assert abs(after - true) < 0.6 * abs(before - true)


def test_known_sizes_are_kept_and_the_person_is_looked_for_all_the_same():
    true = stout()[0]
    found = measured(np.zeros(len(NAMES)), expected=true)
    assert found.sizes == true
    assert found.frames == 6
    assert found.overlap > 0.9


@pytest.mark.whole
def test_the_same_seed_measures_the_same():
    spread = size_deviations(MEAN, shown=True)
    one, other = (measured(spread) for _ in range(2))
    assert (one.sizes, one.residual, one.overlap, one.frames) == (other.sizes, other.residual, other.overlap, other.frames)


def test_nobody_is_said():
    nobody = [np.zeros_like(mask) for mask in stout()[2][0][1]]
    with pytest.raises(TrackingError, match=r"nobody is found in the first 3 frames' silhouettes: .*`shadowpuppet info` tells"):
        measured(size_deviations(MEAN, shown=True), [(actor.hull().points(nobody), nobody)] * 3)


def test_a_person_in_a_few_frames_only_is_taken_as_expected():
    """Of too few frames nothing is solved for; those without anybody do no harm."""
    first = stout()[2]
    nobody = [np.zeros_like(mask) for mask in first[0][1]]
    gone = actor.hull().points(nobody), nobody
    found = measured(size_deviations(MEAN, shown=False), [gone, gone, *first[:2], gone])
    assert found.sizes == MEAN
    assert found.frames == 2
    assert np.isnan(found.residual)


def test_who_is_found_in_a_later_frame_is_followed_back_to_the_first():
    first, seen = stout()[2], []

    class Watched(MultiviewTracker):
        def start(self, rng, points, masks, **more):
            seen.append(masks)
            return super().start(rng, points, masks, **more)

    tracker = Watched(anatomical(stout()[0]), tuple(actor.cameras()), SETTINGS)
    found = size_estimation._followed(np.random.default_rng(0), tracker, first, 3, None)
    assert {n for n, _ in found} >= set(range(1, len(first)))
    assert seen[0] is first[3][1]
    assert actor.apart(tracker.body, np.array([state.pose for _, state in found]), stout()[1][[n for n, _ in found]]).max() < 0.05


def test_a_body_that_faces_the_wrong_way_at_first_is_measured_both_ways(monkeypatch):
    """An unlucky search, as of a person who stands upright before three cameras; and silhouettes that show the front are searched once."""
    true, poses, first = stout()
    heading = [size_estimation.heading_of(actor.body(), pose) for pose in poses]
    search, asked = MultiviewTracker.search, list[float | None]()

    def unlucky(self, rng, observation, facing=None):
        asked.append(facing)
        return search(self, rng, observation, heading[0] + np.pi if facing is None else facing)

    clear = measured(np.zeros(len(NAMES)), expected=true)
    assert clear.front is None
    monkeypatch.setattr(MultiviewTracker, "search", unlucky)
    monkeypatch.setattr(size_estimation, "ALIKE", np.inf)
    found = measured(np.zeros(len(NAMES)), expected=true)
    assert np.cos(size_estimation.heading_of(found.body, found.pose) - heading[-1]) > 0.9
    assert found.overlap > 0.9
    assert found.front is not None
    assert found.front.lead > 0.2
    assert found.front.heading == pytest.approx(heading[0], abs=0.3)
    assert found.front.heading_in(first[0][0]) == found.front.heading
    assert found.front.heading_in(first[1][0]) is None
    assert asked[0] is None


@pytest.mark.parametrize(("cameras", "turns"), [(2, [90, 180, 270]), (3, [180])])
def test_two_cameras_may_show_each_of_four_quarters(cameras, turns, monkeypatch):
    tracker, (frame, *_) = MultiviewTracker(actor.body(), actor.cameras()[:cameras], SETTINGS), first_frames(stout()[2])
    pose = stout()[1][0]
    state = MultiviewState(pose, 0 * pose, Particles(pose[None], np.zeros(1), np.zeros(1)), 1.0, 0.9, "tracked")
    heading = actor.body().skeleton.dof_names.index("root_heading")
    here, asked = size_estimation.heading_of(actor.body(), state.pose), list[float]()

    def start(self, rng, points, masks, facing, keypoints):
        asked.append(facing)
        pose = state.pose.copy()
        pose[heading] = here if len(asked) == 1 else facing + 0.1  # the first one turns back while it is fitted
        return state._replace(pose=pose, cost=1.1 if len(asked) < 3 else 2.0)

    monkeypatch.setattr(MultiviewTracker, "start", start)
    found = size_estimation._other_fronts(np.random.default_rng(0), tracker, [frame], 0, state)
    np.testing.assert_allclose(np.degrees(np.array(asked) - here), turns)
    assert found == asked[1:2]  # neither what turns back nor what costs much more


def test_the_front_of_two_cameras_is_always_kept():
    true, poses, first = stout()
    pair = [(frame[0], frame[1][:2]) for frame in first]
    found = estimate_sizes(np.random.default_rng(0), anatomical, true, np.zeros(len(NAMES)), actor.cameras()[:2], pair, SETTINGS,
                           both_fronts=False)
    assert found.front is not None
    assert found.front.lead == np.inf
    assert np.cos(found.front.heading - size_estimation.heading_of(actor.body(), poses[0])) > 0.7


def with_keypoints(exchanged: tuple[int, ...] = ()) -> list[FirstFrame]:
    """The first frames with keypoints, in some of them with left for right in all cameras."""
    true, poses, first = stout()
    body = anatomical(true)
    marks = landmarks_of(body)
    joints = body.skeleton.points(poses, marks.joints, marks.places)
    joints[list(exchanged)] = joints[list(exchanged)][:, marks.mirrored]
    found = detected(np.random.default_rng(0), actor.cameras(), np.arange(len(poses)) / 20, marks.names, joints, EXACT)
    return [FirstFrame(*frame, seen) for frame, seen in zip(first, found, strict=True)]


@pytest.mark.parametrize("exchanged", [(), (2,)])
def test_the_front_that_keypoints_show_together_is_searched_for_and_no_other(monkeypatch, exchanged):
    true, poses, _ = stout()
    search, asked = MultiviewTracker.search, list[float | None]()

    def watched(self, rng, observation, facing=None):
        asked.append(facing)
        return search(self, rng, observation, facing)

    monkeypatch.setattr(MultiviewTracker, "search", watched)
    monkeypatch.setattr(size_estimation, "ALIKE", np.inf)
    found = measured(np.zeros(len(NAMES)), with_keypoints(exchanged), true)
    assert found.front is None
    assert None not in asked
    assert np.cos(np.array(asked) - size_estimation.heading_of(actor.body(), poses[0])).min() > 0.9


def test_a_front_is_known_in_its_own_frame_only():
    points = stout()[2][0][0]
    front = Front(0.5, points.points.mean(0), 0.1)
    assert front.heading_in(points) == 0.5
    assert front.heading_in(points._replace(points=points.points + np.array([0, 0, 0.02]))) is None
    assert front.heading_in(points._replace(points=points.points[:0])) is None


# What is known before -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", WHOLE)
def test_bones_that_joints_show_are_sharp_and_all_else_as_people_differ(name):
    sizes = average_sizes(name, 1.7)
    shown, guessed = (size_deviations(sizes, shown=choice) for choice in (True, False))
    shares = shares_of(type(sizes))
    for size, (shorter, longer), (other, same) in zip(sizes.names(), shown.T, guessed.T):
        assert longer == (JOINT_DEVIATION if size in SIZES_FROM_JOINTS else other), size
        assert shorter == (SPINE_DEVIATION if size in SPINE else longer), size
        assert other == same == pytest.approx(shares[size][1] * 1.7, rel=0.05)
    np.testing.assert_allclose(size_deviations(average_sizes(name, 0.9), shown=False) / guessed, 0.9 / 1.7, rtol=0.03)
    assert set(SIZES_FROM_JOINTS) >= {"thigh_length", "forearm_length", "hip_distance"}


@pytest.mark.parametrize("name", WHOLE)
def test_dressed_people_are_wider_and_no_taller(name):
    sizes = average_sizes(name, 1.7)
    worn = dressed(sizes)
    for size in sizes.names():
        factor = CLOTHES if size.split("_")[-1] in WIDTHS else 1
        assert getattr(worn, size) == pytest.approx(factor * getattr(sizes, size)), size
    stature, girth = shared_deviations(worn, cameras=3)
    assert stature_of(dict(zip(sizes.names(), sizes.to_array() + stature))) == pytest.approx(1.7 - SOLE + STATURE_DEVIATION)
    np.testing.assert_array_equal(girth > 0, [size.split("_")[-1] in WIDTHS for size in sizes.names()])
    np.testing.assert_array_equal(shared_deviations(worn, cameras=2), [stature])  # two cameras' hulls do not tell the girth
