"""The local search: what it varies, what it keeps, and that it ends nearer."""

from __future__ import annotations

import actor
import numpy as np
import pytest

from shadowpuppet.tracking.multiview.local_search import LocalSearch
from shadowpuppet.tracking.particle_filter import better_of, evaluate

SKELETON = actor.body().skeleton
POSE = actor.stance(SKELETON)
SIGMA = np.full(len(POSE), 0.05)
ELBOW = SKELETON.dof_indices(["left_elbow_flexion"])[0]


def weigh(poses: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The cost of a pose is the square of the distance from the stance."""
    costs = ((poses - POSE) ** 2).sum(1)
    return costs, -costs


def off(number: int = 6):
    """Particles whose left elbow is bent too far, the last the least."""
    poses = np.tile(POSE, (number, 1))
    poses[:, ELBOW] += 0.4 + 0.1 * np.arange(number)[::-1]
    return evaluate(poses, weigh)


def test_a_variant_turns_one_joint():
    seen = []

    def watched(poses):
        seen.append(poses.copy())
        return weigh(poses)

    LocalSearch(SKELETON, SIGMA, 1)(np.random.default_rng(0), off(80), watched, 80)
    best = off(80).best
    assert len(seen) == 1
    assert len(seen[0]) == 40
    moved = [{SKELETON.dofs[d].joint for d in np.flatnonzero(pose != best)} for pose in seen[0]]
    assert max(map(len, moved)) == 1
    assert len(set.union(*moved)) > 8
    assert np.all(SKELETON.clamp(seen[0]) == seen[0])


def test_rounds_end_nearer_with_as_many_particles_best_first(rng):
    before = off()
    after = LocalSearch(SKELETON, SIGMA, 200)(rng, before, weigh, len(before.poses))
    assert after.poses.shape == before.poses.shape
    assert after.costs.max() < 0.2 * before.costs.min()
    assert np.all(np.diff(after.costs) >= 0)
    np.testing.assert_array_equal(after.costs, weigh(after.poses)[0])
    np.testing.assert_array_equal(after.log_weights, weigh(after.poses)[1])


@pytest.mark.parametrize("rounds", [0, 1, 3])
def test_nothing_gets_worse(rounds, rng):
    before = off()
    after = LocalSearch(SKELETON, SIGMA, rounds)(rng, before, weigh, len(before.poses))
    assert np.all(np.sort(after.costs) <= np.sort(before.costs))


def test_of_each_pair_the_cheaper_is_kept_and_of_equals_the_first():
    first, second = (evaluate(POSE + np.array(steps)[:, None] * SIGMA, weigh) for steps in ([1.0, 3.0, -2.0], [2.0, 1.0, 2.0]))
    kept = better_of(first, second)
    np.testing.assert_array_equal(kept.poses, [first.poses[0], second.poses[1], first.poses[2]])
    np.testing.assert_array_equal(kept.costs, weigh(kept.poses)[0])
    np.testing.assert_array_equal(kept.log_weights, weigh(kept.poses)[1])
