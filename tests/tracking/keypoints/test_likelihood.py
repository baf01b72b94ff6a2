"""How likely keypoints are: as the plain formula says; outliers and exchanged sides cost a bounded amount; slopes are the costs' own."""

from __future__ import annotations

import actor
import numpy as np
import pytest

from benchmarks.detector import EXACT, USUAL, detected
from shadowpuppet.body.jacobian import make_chain, place_one
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.keypoints.definitions import ARMS, Landmarks, landmarks_of
from shadowpuppet.tracking.keypoints.likelihood import BOX, EXCHANGED, NU, exchanges, odds_turned, surprises
from shadowpuppet.tracking.keypoints.sights import NO_SIGHTS, Sights, sights_of
from shadowpuppet.tracking.multiview.refinement.keypoint_rays import pull_to_rays

MARKS = landmarks_of(actor.body())


def places(pose: Array) -> Array:
    return actor.body().skeleton.points(np.atleast_2d(pose), MARKS.joints, MARKS.places)


def seen(pose: Array, by=EXACT, seed: int = 0) -> Sights:
    """What the actor's cameras see of a pose (D,)."""
    points = places(pose)[0]
    keypoints = detected(np.random.default_rng(seed), actor.cameras(), np.zeros(1), MARKS.names, points[None], by)[0]
    return sights_of(actor.cameras(), keypoints, (0,) * len(keypoints), MARKS, points.mean(0))


def plain(points: Array, sights: Sights, marks: Landmarks) -> float:
    """The mixture by its definition, camera by camera and exchange by exchange."""
    total = 0.0
    for camera in set(sights.cameras.tolist()):
        mixture = 0.0
        for arms, legs in ((False, False), (True, False), (False, True), (True, True)):
            density = EXCHANGED if arms or legs else 1 - 3 * EXCHANGED
            for m in np.flatnonzero(sights.cameras == camera):
                k, outlying, square = sights.landmarks[m], sights.outlying[m], sights.squares[m]
                k = marks.mirrored[k] if (arms if marks.limbs[k] == ARMS else legs) else k
                away = points[k] - sights.origins[m]
                r2 = away @ away - (away @ sights.rays[m]) ** 2
                student = (1 + r2 / (NU * square)) ** (-NU / 2 - 1) / (2 * np.pi * square)
                best = (1 - outlying) / (2 * np.pi * square) + outlying / BOX
                density *= ((1 - outlying) * student + outlying / BOX) / best
            mixture += density
        total -= np.log(mixture)
    return total


@pytest.mark.kernels
def test_the_surprise_is_that_of_the_plain_formula():
    poses = actor.walk(actor.body().skeleton, 4)
    sights = seen(poses[1])
    found = surprises(places(poses), sights, MARKS)
    assert found == pytest.approx([plain(points, sights, MARKS) for points in places(poses)], rel=1e-9)
    assert found.argmin() == 1


@pytest.mark.kernels
def test_before_one_camera_the_distance_may_be_left_to_others():
    poses = actor.walk(actor.body().skeleton, 4)
    sights = seen(poses[1]).only(seen(poses[1]).cameras == 0)
    view, points = sights.rays.mean(0), places(poses)
    moved = []
    for each in points:
        off = np.einsum("mai,mi->ma", sights.across, each[sights.landmarks] - sights.origins)
        weights = (1 - sights.outlying) / (sights.squares + (off**2).sum(1) / NU)
        along = sights.across @ view
        moved.append(each - (weights * (off * along).sum(1)).sum() / (weights * (along**2).sum(1)).sum() * view)
    kept = points.copy()
    found = surprises(points, sights, MARKS, anywhere=True)
    assert found == pytest.approx([plain(each, sights, MARKS) for each in moved], rel=1e-9)
    assert np.array_equal(points, kept)
    assert surprises(points[:1] - 0.3 * view, sights, MARKS, anywhere=True) == pytest.approx(found[:1], abs=0.5)


def test_all_sides_exchanged_speak_for_the_other_front_by_a_bounded_amount():
    pose = actor.walk(actor.body().skeleton, 1)[0]
    sights = seen(pose).only(seen(pose).cameras == 0)
    points, most = places(pose)[0], np.log((1 - EXCHANGED) / EXCHANGED)
    assert odds_turned(points, sights, MARKS) == pytest.approx(-most, abs=0.01)
    assert odds_turned(points[MARKS.mirrored], sights, MARKS) == pytest.approx(most, abs=0.01)


def test_keypoints_on_something_else_cost_a_bounded_amount():
    pose = actor.walk(actor.body().skeleton, 1)[0]
    sights = seen(pose)
    one = sights._replace(origins=sights.origins + 50 * sights.across[:, 0] * (np.arange(len(sights.cameras)) == 0)[:, None])
    far = one._replace(origins=one.origins + 1000 * sights.across[:, 0] * (np.arange(len(sights.cameras)) == 0)[:, None])
    costs = [surprises(places(pose), each, MARKS)[0] for each in (sights, one, far)]
    assert costs[0] < costs[1] < costs[0] + 20
    assert costs[2] == pytest.approx(costs[1], abs=1e-3)


def test_a_camera_that_exchanges_the_sides_is_found_and_hardly_costs():
    pose = actor.walk(actor.body().skeleton, 1)[0]
    sights = seen(pose)
    turned = np.where((sights.cameras == 2) & (MARKS.limbs[sights.landmarks] == ARMS), MARKS.mirrored[sights.landmarks], sights.landmarks)
    wrong = sights._replace(landmarks=turned)
    found = exchanges(places(pose)[0], wrong, MARKS)
    assert found[2, 0] > 0.99
    assert found[[0, 1, 3, 4], 0].max() < 0.01
    assert found[:, 1].max() < 0.01
    more = surprises(places(pose), wrong, MARKS) - surprises(places(pose), sights, MARKS)
    assert more == pytest.approx(np.log((1 - 3 * EXCHANGED) / EXCHANGED), abs=0.1)


def sums_of(pose: Array, sights: Sights, weight: float = 1.0) -> tuple[float, Array, Array]:
    """What `pull_to_rays` returns, and the joints' sums; transforms of the pose."""
    chain = make_chain(actor.body().skeleton)
    J, D = len(chain.parents), len(pose)
    T, sums = np.zeros((J, 3, 4)), np.zeros((J, 27))
    place_one(pose, chain, T, np.zeros((D, 6)), np.zeros((3, 3, 3)))
    work = np.zeros((len(MARKS.names), 3)), np.zeros((sights.size, 2, 2))
    cost = pull_to_rays(T, MARKS.arrays, sights, weight, np.zeros(3), sums, *work, True)
    return cost, sums, T


@pytest.mark.kernels
def test_the_pull_has_the_slope_of_the_cost():
    """Along a shift of everything: the sums' forces are half the cost's slope, for keypoints that are right, exchanged and far off."""
    poses = actor.walk(actor.body().skeleton, 6)
    sights = seen(poses[0])
    mixed = np.where(sights.cameras == 1, MARKS.mirrored[sights.landmarks], sights.landmarks)
    sights = sights._replace(landmarks=mixed)
    pose, step = poses[3], 1e-5
    cost, sums, _ = sums_of(pose, sights, 2.0)
    assert cost == pytest.approx(2 * surprises(places(pose), sights, MARKS)[0])
    for axis in range(3):
        moved = places(pose) + step * np.eye(3)[axis] * np.array([[[-1.0]], [[1.0]]])
        low, high = surprises(moved, sights, MARKS)
        assert -2 * sums[:, 24 + axis].sum() == pytest.approx(2 * (high - low) / (2 * step), rel=1e-3, abs=1e-3)


@pytest.mark.kernels
def test_without_keypoints_nothing_is_added():
    cost, sums, _ = sums_of(actor.walk(actor.body().skeleton, 1)[0], NO_SIGHTS)
    assert cost == 0
    assert not sums.any()


def plain_sums(points: Array, sights: Sights, weight: float) -> Array:
    """What is added to the joints' normal equations, by definition: rows across each ray, weighted by the slope of -log p and the side."""
    sums = np.zeros((len(actor.body().skeleton.joints), 27))
    told = exchanges(points, sights, MARKS)
    for m, said in enumerate(sights.landmarks):
        exchanged = told[sights.cameras[m], MARKS.limbs[said]]
        for k, share in ((said, 1 - exchanged), (MARKS.mirrored[said], exchanged)):
            away, square, outlying = sights.origins[m] - points[k], sights.squares[m], sights.outlying[m]
            r2 = away @ away - (away @ sights.rays[m]) ** 2
            near = (1 - outlying) * (1 + r2 / (NU * square)) ** (-NU / 2 - 1) / (2 * np.pi * square)
            pull = weight * share * near / (near + outlying / BOX) * (NU / 2 + 1) / (NU * square + r2)
            for n in sights.across[m]:
                row = np.concatenate([np.cross(points[k], n), n])
                sums[MARKS.joints[k], :21] += pull * np.outer(row, row)[np.triu_indices(6)]
                sums[MARKS.joints[k], 21:] += pull * row * (away @ n)
    return sums


@pytest.mark.kernels
def test_the_normal_equations_are_those_of_the_plain_version():
    poses = actor.walk(actor.body().skeleton, 6)
    sights = seen(poses[0], USUAL, 4)
    sights = sights._replace(landmarks=np.where(sights.cameras == 1, MARKS.mirrored[sights.landmarks], sights.landmarks))
    _, sums, _ = sums_of(poses[3], sights, 2.0)
    expected = plain_sums(places(poses[3])[0], sights, 2.0)
    np.testing.assert_allclose(sums, expected, rtol=1e-7, atol=1e-9 * np.abs(expected).max())
