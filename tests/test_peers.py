"""The comparison with MediaPipe: landmarks become joints of the right names and places; what is wrong or unseen does not count."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from shadowpuppet.camera.camera import Camera
from shadowpuppet.geometry import inverse, rigid, unit
from shadowpuppet.motion.metrics import LIMB_JOINTS

ROOT = Path(__file__).resolve().parents[1]
WAVE = 0.1 * np.sin(np.arange(60) / 20)
"""Metres by which all joints sway, of shape (T,)."""


@pytest.fixture(scope="module")
def peers():
    spec = importlib.util.spec_from_file_location("peers_triangulation", ROOT / "benchmarks" / "peers" / "triangulation.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def camera_at(x, y):
    """A camera 1.5 m high that looks at the middle of a person."""
    ahead = unit(np.array([-x, -y, -0.5]))
    right = unit(np.cross(ahead, [0.0, 0.0, 1.0]))
    R = np.stack([right, np.cross(ahead, right), ahead])
    place = np.array([x, y, 1.5])
    return Camera(f"{x} {y}", (640, 480), np.array([[500.0, 0, 320], [0, 500.0, 240], [0, 0, 1]]), T_camera_world=rigid(R, -R @ place))


RIG = [camera_at(3, 0), camera_at(0, 3), camera_at(-3, 0.5), camera_at(1, -3)]


def scene(rng):
    """Joints (T, 12, 3) that sway, and their landmarks in every camera: pixels (C, T, 33, 2), visibility (C, T, 33)."""
    joints = rng.uniform([-0.5, -0.5, 0.1], [0.5, 0.5, 1.8], (12, 3)) + WAVE[:, None, None]
    pixels = np.full((len(RIG), len(WAVE), 33, 2), np.nan)
    pixels[:, :, [11, 12, 13, 14, 15, 16, 23, 24, 25, 26, 27, 28]] = [camera.project(joints) for camera in RIG]
    return joints, pixels, np.ones(pixels.shape[:3])


def off(found, joints):
    return np.linalg.norm(found - joints, axis=-1)


def test_exact_landmarks_give_the_joints(peers):
    joints, pixels, visibility = scene(np.random.default_rng(1))
    found = peers.several_cameras(RIG, np.arange(60) / 60, pixels, visibility)
    assert found.names == LIMB_JOINTS
    assert off(found.positions, joints).max() < 1e-3


def test_one_wrong_camera_is_outvoted(peers):
    joints, pixels, visibility = scene(np.random.default_rng(2))
    pixels[1] += 120
    assert off(peers.several_cameras(RIG, np.arange(60) / 60, pixels, visibility).positions, joints).max() < 0.02


def test_what_fewer_than_two_cameras_see_is_unknown_and_a_short_gap_is_filled(peers):
    joints, pixels, visibility = scene(np.random.default_rng(3))
    visibility[1:, 20:, 11] = 0.4  # the left shoulder, for 0.67 s
    visibility[1:, 20:40, 12] = 0.4  # the right one, for 0.33 s
    found = peers.several_cameras(RIG, np.arange(60) / 60, pixels, visibility).positions
    assert np.isnan(found[20:, 0]).all()
    assert np.isfinite(found[:20, 0]).all()
    assert off(found[:, 1], joints[:, 1]).max() < 0.03


def test_one_cameras_metres_are_turned_into_the_world(peers):
    camera, world = RIG[1], np.zeros((2, 33, 3))
    world[:, 15] = 0, -1, 0.5  # the left wrist: up, and half a metre away from the camera
    found = peers.one_camera(camera, np.arange(2), world).select(["left_wrist", "right_wrist"]).positions[0]
    centre = inverse(camera.T_camera_world)[:3, :3] @ [0, -1, 0.5]
    np.testing.assert_allclose(found, [centre, [0, 0, 0]], atol=1e-12)
    assert found[0, 2] > 0.8
    assert found[0, 1] < 0
