"""How far a camera was turned since it was calibrated, from silhouettes."""

from __future__ import annotations

from dataclasses import replace

import made_rig
import numpy as np
import pytest

from shadowpuppet.calibration.rotation_error import estimate_place_error, estimate_rotation_error
from shadowpuppet.calibration.silhouettes import silhouettes_of
from shadowpuppet.geometry import vector_from_rotation


@pytest.fixture(scope="module")
def rows(cameras):
    """Silhouettes of every sixth set."""
    return [silhouettes_of(made_rig.masks(cameras, 1, n)[0]) for n in range(0, 70, 6)]


@pytest.mark.parametrize("turn", [{"right": 3.0}, {"down": -2.0}, {"clockwise": 4.0}, {"right": -6.0, "down": 3.0}])
def test_how_a_camera_was_turned(cameras, rows, turn):
    wrong = [*cameras[:2], made_rig.moved(cameras[2], **turn), cameras[3]]
    found = estimate_rotation_error(wrong, rows, 2)
    assert found is not None
    told = {"right": found.right, "down": found.down, "clockwise": found.clockwise}
    assert told == pytest.approx({"right": 0, "down": 0, "clockwise": 0} | turn, abs=0.4)
    assert found.degrees == pytest.approx(np.linalg.norm(list(turn.values())), abs=0.4)
    assert found.after < 0.3 * found.before
    np.testing.assert_allclose(found.of(wrong[2]).T_camera_world, cameras[2].T_camera_world, atol=0.03)


def test_how_a_tripod_was_pushed():
    cameras = made_rig.cameras(4, size=(320, 240))
    rows = [silhouettes_of(row) for row in made_rig.masks(cameras, 24)]
    turned = made_rig.moved(cameras[2], right=2.0, down=-1.0)
    T, push = turned.T_camera_world.copy(), np.array([0.06, -0.04, 0.02])
    T[:3, 3] -= T[:3, :3] @ push
    wrong = [*cameras[:2], replace(turned, T_camera_world=T), cameras[3]]
    found, rotation = estimate_place_error(wrong, rows, 2), estimate_rotation_error(wrong, rows, 2)
    assert found is not None
    assert rotation is not None
    back = found.of(wrong[2])
    assert np.linalg.norm(back.centre - cameras[2].centre) < 0.025
    assert np.degrees(np.linalg.norm(vector_from_rotation(back.T_camera_world[:3, :3] @ cameras[2].T_camera_world[:3, :3].T))) < 0.6
    assert found.distance == pytest.approx(np.linalg.norm(push), abs=0.025)
    assert found.after < 0.6 * rotation.after < 0.6 * rotation.before
    assert rotation.distance == 0
    assert estimate_place_error(wrong[:2], [row[:2] for row in rows], 1) is None
    assert estimate_place_error(wrong, [[None] * 4], 2) is None


def test_a_turn_takes_three_cameras(cameras, rows):
    assert estimate_rotation_error(cameras[:2], [row[:2] for row in rows], 1) is None
    assert estimate_rotation_error(cameras, [[None] * 4], 1) is None
