"""Three turns one after another: they make the rotation again, go on without jumps, and stay where a joint's limits want them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from shadowpuppet.geometry import ORDERS, clear_order, continuous_angles


def made(order: str, angles) -> np.ndarray:
    return Rotation.from_euler(order, angles).as_matrix()  # capitals: about the axes as turned before


@settings(max_examples=60, deadline=None)
@given(order=st.sampled_from(ORDERS), seed=st.integers(0, 10_000), frames=st.integers(1, 12))
def test_angles_make_the_rotations_again(order, seed, frames):
    R = Rotation.random(frames, random_state=np.random.default_rng(seed)).as_matrix()
    np.testing.assert_allclose(made(order, continuous_angles(R, order)), R, atol=1e-9)


@pytest.mark.parametrize("order", ORDERS)
def test_angles_that_were_continuous_come_back_even_beyond_a_turn_and_a_quarter(order):
    t = np.linspace(0, 1, 200)[:, None]
    angles = t * [9.0, -2.6, 5.0] + [0.2, 0.1, -0.4]  # the second passes -90 degrees between frames, the others go around
    found = continuous_angles(made(order, angles), order)
    np.testing.assert_allclose(np.diff(found, axis=0), np.diff(angles, axis=0), atol=1e-9)
    assert np.abs(np.diff(found, axis=0)).max() < 0.06


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("quarter", [np.pi / 2, -np.pi / 2])
def test_in_the_singular_posture_the_first_angle_stays(order, quarter):
    angles = np.array([[0.5, 0.9 * quarter, 0.3]] + [[0.5, quarter, 0.3 + 0.1 * n] for n in range(4)])
    found = continuous_angles(made(order, angles), order)
    np.testing.assert_allclose(found, angles, atol=1e-6)


def test_limits_choose_between_the_two_triples():
    angles = np.tile([2.8, 0.3, 2.9], (20, 1)) + 0.01 * np.arange(20)[:, None]
    R = made("ZXY", angles)
    wide = np.radians([[90, 270], [-60, 60], [90, 270]])
    np.testing.assert_allclose(continuous_angles(R, "ZXY", wide), angles, atol=1e-9)
    narrow = np.radians([[-90, 90], [-200, 200], [-90, 90]])
    np.testing.assert_allclose(continuous_angles(R, "ZXY", narrow), angles * [1, -1, 1] + [-np.pi, np.pi, -np.pi], atol=1e-9)


def test_the_usual_order_is_kept_where_it_is_clear_and_left_where_it_is_not():
    calm = made("ZXY", np.radians([[10, 20, 30], [170, -40, 90.0]]))
    assert clear_order(calm) == "ZXY"
    raised = made("XYZ", np.radians([[a, 3, 2] for a in range(0, 180, 5)]))  # a limb that swings forward through a quarter about x
    assert clear_order(raised) != "ZXY"
    steps = np.abs(np.diff(continuous_angles(raised, clear_order(raised)), axis=0)).max()
    assert steps < np.radians(6)
