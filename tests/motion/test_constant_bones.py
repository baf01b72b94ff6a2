"""Skeletons with bones of constant length: joints that move are carried by a joint before them."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from shadowpuppet.geometry import rotation_from_vector
from shadowpuppet.motion.animation import Animation
from shadowpuppet.motion.constant_bones import constant_bones


def arm(places: np.ndarray, rng: np.random.Generator) -> Animation:
    """A root and a moving shoulder at places (T, 3) with an elbow below, all turning."""
    T = len(places)
    offsets = np.array([[0, 0, 0], places.mean(0), [0, -0.3, 0]])
    turns = np.array([[rotation_from_vector(rng.normal(0, 0.5, 3)) for _ in range(3)] for _ in range(T)])
    shifts = np.tile(offsets, (T, 1, 1))
    shifts[:, 0], shifts[:, 1] = rng.normal(size=(T, 3)), places
    return Animation(("root", "shoulder", "elbow"), (-1, 0, 1), offsets, {2: (0, -0.2, 0)}, np.arange(T) / 30, turns, shifts)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 999), radius=st.floats(0.1, 0.4))
def test_a_joint_on_a_sphere_stays_where_it_was(seed, radius):
    rng = np.random.default_rng(seed)
    pivot, out = rng.normal(0, 0.2, 3), np.array([1.0, 0.2, 0.1])
    places = pivot + radius * np.array([rotation_from_vector(rng.normal(0, 0.3, 3)) @ out / np.linalg.norm(out) for _ in range(25)])
    before = arm(places, rng)
    made = constant_bones(before)
    if "shoulder_base" in made.animation.names and made.off < 1e-6:
        assert made.animation.names == ("root", "shoulder_base", "shoulder", "elbow")
        assert made.animation.ends == {3: (0, -0.2, 0)}
        assert made.animation.moving == ()
    after = made.animation.table.select(before.names).positions
    assert np.linalg.norm(after - before.table.positions, axis=2).max() <= made.off + 1e-9
    np.testing.assert_allclose(made.animation.world()[1][:, -1], before.world()[1][:, -1], atol=1e-9)


def test_any_other_movement_is_followed_as_far_as_the_bone_reaches(rng):
    for places in (np.outer(np.linspace(0.1, 0.3, 9), [1, 0, 0]), np.outer(np.linspace(-0.1, 0.1, 9), [0, 1, 0])):
        made = constant_bones(arm(places, rng))
        assert np.isfinite(made.animation.rotations).all()
        np.testing.assert_allclose(np.linalg.det(made.animation.rotations), 1)
        assert made.off < 0.25


def test_a_skeleton_that_does_not_move_inside_is_left_alone(rng):
    still = arm(np.tile([0.1, 0.2, 0.0], (5, 1)), rng)
    for offset in (0.2, 0.5):  # of the file at rest
        still.offsets[1, 1] = offset
        made = constant_bones(still)
        assert (made.animation.names, made.off < 1e-12) == (still.names, True)
        np.testing.assert_array_equal(made.animation.rotations, still.rotations)
        np.testing.assert_allclose(made.animation.table.positions, still.table.positions)
