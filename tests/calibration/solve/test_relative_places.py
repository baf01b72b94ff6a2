"""Where cameras stand to each other, from made poses of a board: votes, other sides of the board, chains of pairs."""

from __future__ import annotations

import numpy as np
import pytest

from shadowpuppet.calibration.solve.board_pose import Pose
from shadowpuppet.calibration.solve.relative_places import FLIPS, MAX_SHIFT, Pair, linked, pairs_of
from shadowpuppet.geometry import inverse, rigid, rotation_about, rotation_from_vector


def place(n: int) -> np.ndarray:
    """World to camera of the n-th camera."""
    return rigid(rotation_about([0, 1, 0], 0.4 * n), [0.3 * n, -0.1 * n, 0.2])


def board(moment: int) -> np.ndarray:
    """Board to world, two metres and more before the cameras."""
    rng = np.random.default_rng(moment)
    return rigid(rotation_from_vector(rng.uniform(-0.5, 0.5, 3)), [*rng.uniform(-0.5, 0.5, 2), rng.uniform(2, 3)])


def seen(moment: int, camera: int, flip=None) -> list[Pose]:
    return [Pose(place(camera) @ board(moment) @ (np.eye(4) if flip is None else flip), 0.1)]


def between(first: int, second: int) -> np.ndarray:
    return place(second) @ inverse(place(first))


def test_pairs_are_those_that_see_the_board_at_the_same_time():
    poses = [{0: seen(m, 0), 1: seen(m, 1)} for m in range(4)] + [{1: seen(9, 1), 3: seen(9, 3)}, {2: seen(8, 2)}]
    pairs = pairs_of(4, poses)
    assert [pair._replace(T=None) for pair in pairs] == [Pair(0, 1, 4, 4, None, False), Pair(1, 3, 1, 1, None, False)]
    for pair in pairs:
        np.testing.assert_allclose(pair.T, between(pair.first, pair.second), atol=1e-12)


def test_most_moments_decide():
    """Of poses that a view cannot tell apart the one that other moments agree with; wrong moments are outvoted."""
    mirrored = rigid(rotation_about([1, 0, 0], 0.5), [0, 0, 0])
    poses = [{0: [*seen(m, 0, mirrored), *seen(m, 0)], 1: [*seen(m, 1), *seen(m, 1, mirrored @ mirrored)]} for m in range(5)]
    poses += [{0: seen(m, 0), 1: seen(m + 50, 1)} for m in range(2)]
    (pair,) = pairs_of(2, poses)
    assert (pair.seen, pair.agreed) == (7, 5)
    np.testing.assert_allclose(pair.T, between(0, 1), atol=1e-9)


@pytest.mark.parametrize(("degrees", "shift", "agree"), [(4.9, 0.0, 3), (5.1, 0.0, 2), (0.0, 0.9, 3), (0.0, 1.1, 2)])
def test_estimates_agree_within_an_angle_and_a_share_of_the_distance(degrees, shift, agree):
    away = max(np.max([(place(n) @ board(2))[2, 3] for n in range(2)]), np.max([(place(n) @ board(0))[2, 3] for n in range(2)]))
    off = rigid(rotation_about([0, 0, 1], np.radians(degrees)), [shift * MAX_SHIFT * away, 0, 0])
    same = [{n: seen(0, n) for n in range(2)}] * 2
    other = {0: seen(2, 0), 1: [Pose(off @ between(0, 1) @ seen(2, 0)[0].T, 0.1)]}
    (pair,) = pairs_of(2, [*same, other])
    assert pair.agreed == agree


@pytest.mark.parametrize("flip", FLIPS)
def test_a_board_seen_from_both_sides_is_said(flip):
    poses = [{0: seen(m, 0), 1: seen(m, 1, flip)} for m in range(6)]
    (pair,) = pairs_of(2, poses)
    assert pair.two_sided
    assert pair.agreed < 0.6 * 6
    assert not pairs_of(2, poses[:2])[0].two_sided  # too few to tell
    mixed = [*poses[:2], *({0: seen(m, 0), 1: seen(m, 1)} for m in range(4))]
    assert not pairs_of(2, mixed)[0].two_sided


def pair(first: int, second: int, agreed: int = 5, count: int = 5) -> Pair:
    return Pair(first, second, count, agreed, between(first, second), False)


@pytest.mark.parametrize(("count", "agreed", "good"), [
    (3, 3, True), (3, 2, False), (2, 2, True), (10, 3, True), (11, 3, False), (20, 6, True), (1, 1, True), (0, 0, False), (1, 0, False),
])  # fmt: skip
def test_a_pair_counts(count, agreed, good):
    assert pair(0, 1, agreed, count).good == good


def test_cameras_are_linked_by_their_pairs():
    pairs = [pair(0, 1), pair(3, 1, 9, 9), pair(2, 4, 7, 7), pair(0, 3, 1, 8)]
    places, groups = linked(5, pairs)
    assert groups == [[0, 1, 3], [2, 4]]
    assert places[2] is None
    assert places[4] is None
    for n in (0, 1, 3):
        found = places[n]
        assert found is not None
        np.testing.assert_allclose(found, place(n) @ inverse(place(1)), atol=1e-9)  # the world is the camera with most moments
    longer, groups = linked(5, [*pairs, pair(4, 3, 3, 3)])
    assert groups == [[0, 1, 2, 3, 4]]
    np.testing.assert_allclose([each for each in longer if each is not None], [place(n) @ inverse(place(1)) for n in range(5)], atol=1e-9)


def test_the_pairs_of_most_moments_link():
    wrong = Pair(0, 2, 4, 4, np.diag([-1.0, -1, 1, 1]), False)
    places, _ = linked(3, [wrong, pair(0, 1, 9, 9), pair(1, 2, 8, 8)])
    np.testing.assert_allclose([each for each in places if each is not None], [place(n) @ inverse(place(1)) for n in range(3)], atol=1e-9)
    places, groups = linked(3, [])
    assert groups == [[0], [1], [2]]
    assert [each is None for each in places] == [False, True, True]
