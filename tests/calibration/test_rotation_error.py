"""How far a camera was turned since it was calibrated, from silhouettes."""

from __future__ import annotations

import made_rig
import numpy as np
import pytest

from shadowpuppet.calibration.rotation_error import estimate_rotation_error
from shadowpuppet.calibration.silhouettes import silhouettes_of


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


def test_a_turn_takes_three_cameras(cameras, rows):
    assert estimate_rotation_error(cameras[:2], [row[:2] for row in rows], 1) is None
    assert estimate_rotation_error(cameras, [[None] * 4], 1) is None
