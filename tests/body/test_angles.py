"""Angles of joints from rotations: those that make them, within the limits where that is possible, without jumps."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from shadowpuppet.body.angles import _excess, angles_over_time, rotation_angles
from shadowpuppet.body.models import average_sizes, make_body
from shadowpuppet.body.skeleton import AXES, Dof

JOINTS = {"anatomical": ("chest", "left_shoulder", "right_hip"), "cylinders": ("head", "left_shoulder", "right_shoulder", "left_hip")}
OF = [(name, joint) for name, joints in JOINTS.items() for joint in joints]
FREE = tuple(Dof(f"d{axis}", "a", axis) for axis in ("-z", "y", "-x"))


def dofs_of(name: str, joint: str) -> tuple[Dof, ...]:
    return tuple(dof for dof in make_body(name, average_sizes(name, 1.7)).skeleton.dofs if dof.joint == joint)


def made(angles: np.ndarray, dofs) -> np.ndarray:
    """Rotations (N, 3, 3) of angles (N, 3), one after another."""
    if dofs[0].kind == "vector":
        return Rotation.from_rotvec(angles).as_matrix()
    out = np.eye(3)[None].repeat(len(angles), 0)
    for k, dof in enumerate(dofs):
        axis, sign = AXES[dof.axis]
        out = out @ Rotation.from_rotvec(sign * angles[:, k, None] * np.eye(3)[axis]).as_matrix()
    return out


@pytest.mark.parametrize(("name", "joint"), OF)
def test_angles_make_the_rotation_and_are_those_within_the_limits(name, joint, rng):
    dofs = dofs_of(name, joint)
    low, high = (np.array([getattr(dof, end) for dof in dofs]) for end in ("low", "high"))
    angles = rng.uniform(low, high, (300, 3))
    if dofs[0].kind == "vector":
        angles = angles[np.linalg.norm(angles, axis=1) < np.pi]
    found = rotation_angles(made(angles, dofs), dofs)
    np.testing.assert_allclose(made(found, dofs), made(angles, dofs), atol=1e-9)
    inside = ((found >= low - 1e-9) & (found <= high + 1e-9)).all(1)
    assert inside.all()


@pytest.mark.parametrize("dofs", [FREE, dofs_of("cylinders", "left_shoulder"), dofs_of("anatomical", "left_shoulder")],
                         ids=["free", "angles", "vector"])
def test_a_path_has_no_jumps(dofs):
    t = np.linspace(0, 1, 200)[:, None]
    path = np.array([0.2, 0.3, -0.4]) + t * np.array([[1.5, 1.0, 2.0]])
    if dofs is FREE:
        path[:, 0] += 10 * t[:, 0]  # more than a turn
    found = angles_over_time(made(path, dofs), dofs)
    np.testing.assert_allclose(made(found, dofs), made(path, dofs), atol=1e-9)
    assert np.abs(np.diff(found, axis=0)).max() < 2 * np.abs(np.diff(path, axis=0)).max()


def test_angles_lie_within_half_a_turn_of_the_middle_of_their_limits(rng):
    limits = (("x", 2.0, 4.0), ("-y", -1.0, 1.0), ("z", -5.0, -3.0))
    dofs = tuple(Dof(f"d{axis}", "a", axis, low, high) for axis, low, high in limits)
    rotations = Rotation.random(100, random_state=3).as_matrix()
    found = rotation_angles(rotations, dofs)
    np.testing.assert_allclose(made(found, dofs), rotations, atol=1e-9)
    assert (np.abs(found - [3.0, 0.0, -4.0]) <= np.pi + 1e-9).all()


def test_what_exceeds_the_limits_counts_squared():
    low, high = np.array([-1.0, -np.inf, 0.0]), np.array([1.0, np.inf, 2.0])
    values = np.array([[[0.5, 9.0, 1.0], [3.0, 9.0, -1.0], [-2.0, 0.0, 5.0]]])
    np.testing.assert_allclose(_excess(values, low, high), [[0, 4 + 1, 1 + 9]], atol=1e-3)
    assert _excess(np.array([[[0.1, 0, 0], [0.2, 0, 0]]]), low, high)[0].argmin() == 0
