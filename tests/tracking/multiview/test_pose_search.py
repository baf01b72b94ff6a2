"""A first pose from one frame: postures in all directions, and a person found in any of them."""

from __future__ import annotations

import actor
import numpy as np
import pytest

from shadowpuppet.body.models import WHOLE
from shadowpuppet.tracking.multiview import pose_search
from shadowpuppet.tracking.multiview.observation import BodyInViews, MultiviewObservation
from shadowpuppet.tracking.multiview.pose_search import HEADINGS, place_postures, search, stood
from shadowpuppet.tracking.multiview.posture_prior import usual_postures
from shadowpuppet.tracking.multiview.proposals import GLOBAL_DOFS
from shadowpuppet.tracking.multiview.refinement.refiner import Refiner


@pytest.mark.parametrize("name", WHOLE)
def test_postures_are_placed_where_the_points_are_in_all_directions(name):
    of, middle = actor.body(name), np.array([1.0, -2.0, 0.9])
    base = usual_postures(of.skeleton)[:3]
    found = place_postures(of, base, middle)
    assert found.shape == (3 * HEADINGS, len(of.skeleton.dofs))
    root = of.skeleton.dof_indices(GLOBAL_DOFS)
    turns = found[:, root[3]].reshape(3, HEADINGS)
    np.testing.assert_allclose(np.diff(turns), 2 * np.pi / HEADINGS)
    rest = np.setdiff1d(np.arange(found.shape[1]), root)
    np.testing.assert_array_equal(found[:, rest], np.repeat(base, HEADINGS, 0)[:, rest])
    limbs = actor.limbs_of(of)
    areas = limbs.lengths * limbs.radii.mean((1, 2))
    middles = of.skeleton.points(found, limbs.joints, (limbs.starts + limbs.ends) / 2)
    np.testing.assert_allclose(np.average(middles, 1, areas), np.tile(middle, (len(found), 1)), atol=1e-9)
    facing = found[HEADINGS // 2]
    assert facing[root[3]] == pytest.approx(0)


@pytest.mark.parametrize("name", WHOLE)
def test_postures_are_stood_on_the_floor(name):
    of = actor.body(name)
    poses = place_postures(of, usual_postures(of.skeleton)[:40], np.zeros(3))
    found, limbs = stood(of, poses, 0.2), actor.limbs_of(of)
    up = of.skeleton.dof_names.index("root_z")
    np.testing.assert_array_equal(np.delete(found, up, 1), np.delete(poses, up, 1))
    axes = np.stack([of.skeleton.points(found, limbs.joints, places)[..., 2] for places in (limbs.starts, limbs.ends)], -1)
    np.testing.assert_allclose((axes - limbs.radii.min(2)).min((1, 2)), 0.2)


def found_in(pose, rng, number: int = 4, name: str = "anatomical", library=None, facing=None):
    of = actor.body(name)
    observation = MultiviewObservation(BodyInViews(of, ()), actor.surface(of, pose, np.random.default_rng(1), 25, 0.004), ())
    refiner = Refiner(of)

    def weigh(poses):
        costs = refiner.costs(poses, observation.full)
        return costs, -costs / 1e-6

    return of, search(rng, of, refiner, observation, library, weigh, number, facing)


@pytest.mark.parametrize("heading", [0.1, 1.3, 3.1, -2.0])
def test_a_person_is_found_whichever_way_they_face(heading, rng):
    pose = actor.stance(actor.body().skeleton, 0.35, heading, (0.4, -0.3))
    of, found = found_in(pose, rng)
    assert actor.apart(of, found.best, pose)[0] < 0.03
    assert abs(np.angle(np.exp(1j * (found.best[3] - heading)))) < 0.2
    assert (found.poses.shape, found.costs.shape, found.log_weights.shape) == ((4, 32), (4,), (4,))
    assert (np.diff(found.costs) >= 0).all()
    np.testing.assert_array_equal(found.poses, of.skeleton.clamp(found.poses))


@pytest.mark.parametrize("turn", [0.5, np.pi])
def test_a_person_is_searched_for_about_a_direction(turn, rng):
    pose = actor.stance(actor.body().skeleton, 0.35, 0.4)
    of, found = found_in(pose, rng, facing=0.4 + turn)
    assert np.cos(found.best[3] - 0.4 - turn) > 0
    assert (actor.apart(of, found.best, pose)[0] < 0.03) == (turn < 1)


@pytest.mark.parametrize(("cameras", "number"), [(2, 3), (3, 7)])
def test_before_two_cameras_a_direction_is_that_of_a_quarter(cameras, number, rng, monkeypatch):
    of, about, towards = actor.body(), [], pose_search._towards

    def watched(*given):
        about.append(towards(*given))
        return about[-1]

    monkeypatch.setattr(pose_search, "_towards", watched)
    observation = MultiviewObservation(BodyInViews(of, ()), actor.surface(of, actor.stance(of.skeleton), rng, 5), (None,) * cameras)
    search(rng, of, Refiner(of), observation, None, lambda poses: (np.zeros(len(poses)), np.zeros(len(poses))), 1, 0.0)
    assert len(np.unique(about[0][:, 3].round(6))) == number  # of 16 in a turn


@pytest.mark.parametrize(("hips", "knees", "bow"), [(80, 92, 4), (6, 84, 3), (4, 8, -84), (4, 8, 82)])
@pytest.mark.parametrize("heading", [0.3, 2.2])
def test_a_person_who_sits_kneels_or_lies_is_found_facing_where_they_face(hips, knees, bow, heading, rng):
    """Their front and back differ little: from standing postures alone one is found turned round, at nearly the same cost."""
    skeleton = actor.body().skeleton
    pose = actor.stance(skeleton, 0.0, heading)
    legs = skeleton.dof_indices(["left_hip_y", "right_hip_y", "left_knee_flexion", "right_knee_flexion", "root_bow"])
    pose[legs] = np.radians([-hips, -hips, knees, knees, bow])
    of, found = found_in(pose, rng)
    assert actor.apart(of, found.best, pose)[0] < 0.03
    assert abs(np.angle(np.exp(1j * (found.best[3] - heading)))) < 0.3


def test_cylinders_are_found_too(rng):
    pose = actor.stance(actor.body("cylinders").skeleton, 0.3, 0.8)
    of, found = found_in(pose, rng, name="cylinders")
    assert actor.apart(of, found.best, pose)[0] < 0.05


def test_a_library_s_postures_are_tried_in_any_place_and_direction(rng):
    """An unusual one that is among them is found."""
    skeleton = actor.body().skeleton
    pose = actor.stance(skeleton, 0.0, 2.0)
    pose[skeleton.dof_indices(["left_hip_y", "left_knee_flexion", "right_shoulder_y", "root_bow"])] = -1.3, 1.9, -2.6, 0.3
    library = np.tile(pose, (3, 1))
    library[:, :4] = rng.normal(size=(3, 4))
    of, found = found_in(pose, rng, library=library)
    assert actor.apart(of, found.best, pose)[0] < 0.02


def test_of_a_long_library_some_are_tried(monkeypatch, rng):
    tried = []
    monkeypatch.setattr(pose_search, "place_postures", lambda of, some, middle: tried.append(some) or place_postures(of, some, middle))
    monkeypatch.setattr(pose_search, "MAX_LIBRARY_POSES", 7)
    poses = actor.walk(actor.body().skeleton, 30)
    found_in(poses[3], rng, library=poses)
    usual = usual_postures(actor.body().skeleton)
    assert len(tried[0]) == 7 + len(usual)
    assert (tried[0][:7, None] == poses).all(2).any(1).all()
    np.testing.assert_array_equal(tried[0][7:], usual)


@pytest.mark.parametrize("number", [1, 30])
def test_as_many_are_given_as_asked_for_and_the_same_seed_finds_the_same(number):
    pose = actor.stance(actor.body().skeleton)
    one, other = (found_in(pose, np.random.default_rng(3), number)[1] for _ in range(2))
    assert one.poses.shape == (number, 32)
    for a, b in zip(one, other):
        np.testing.assert_array_equal(a, b)


def test_postures_on_the_floor_are_tried_too(monkeypatch, rng):
    pose, lowest = actor.stance(actor.body().skeleton, 0.3, 1.0), []
    monkeypatch.setattr(pose_search, "place_postures", lambda of, some, middle: place_postures(of, some, middle + 5.0))
    monkeypatch.setattr(pose_search, "stood", lambda of, poses, floor: lowest.append(floor) or np.tile(pose, (len(poses), 1)))
    of, found = found_in(pose, rng)
    assert actor.apart(of, found.best, pose)[0] < 0.01
    assert lowest == [pytest.approx(0.0, abs=0.05)]


def test_furniture_in_the_silhouettes_draws_no_limbs_out_of_them(rng):
    """A block under a seat and a back, which are in the hull, too."""
    of, cameras, heading = actor.body(), actor.cameras(3), 0.3
    pose = actor.stance(of.skeleton, 0.0, heading)
    legs = of.skeleton.dof_indices(["left_hip_y", "right_hip_y", "left_knee_flexion", "right_knee_flexion"])
    pose[legs] = np.radians([-85, -85, 88, 88])
    masks, pelvis = actor.masks(of, pose, 3), of.points(pose[None], names=["pelvis"])[0, 0]
    turn = np.array([[np.cos(heading), np.sin(heading), 0], [-np.sin(heading), np.cos(heading), 0], [0, 0, 1]])
    for box in (((-0.18, 0.18), (-0.18, 0.18), (-0.5, -0.12)), ((-0.24, -0.17), (-0.18, 0.18), (-0.5, 0.3))):
        corners = np.stack(np.meshgrid(*box), -1).reshape(-1, 3) @ turn + pelvis
        for camera, mask in zip(cameras, masks, strict=True):
            mask |= filled(camera.project(corners), mask.shape)
    observation, refiner = MultiviewObservation(BodyInViews(of, cameras), actor.hull(3).points(masks), masks), Refiner(of)

    def weigh(poses):
        costs = refiner.costs(poses, observation.full) + 0.1 * observation.mismatch(poses)
        return costs, -costs / 1e-5

    found = search(rng, of, refiner, observation, None, weigh, 8)
    assert found.costs[0] < 1.05 * weigh(pose[None])[0][0]


def filled(corners, shape) -> np.ndarray:
    """The convex hull of pixels (K, 2) as a mask of a shape (H, W)."""
    import cv2

    out = np.zeros(shape, np.uint8)
    cv2.fillConvexPoly(out, cv2.convexHull(np.rint(corners).astype(np.int32)), 1)
    return out.view(bool)
