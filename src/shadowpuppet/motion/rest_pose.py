"""Another rest pose for an animated skeleton: arms aside (T), half down (A), or hanging."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from shadowpuppet.errors import SettingsError, choices
from shadowpuppet.geometry import Array, shortest_rotation
from shadowpuppet.motion.animation import Animation
from shadowpuppet.motion.mesh import Mesh

RAISED = {"t": 90.0, "a": 45.0, "hang": 0.0}
"""Angle of the arms above hanging, degrees, by name of the rest pose."""
ARM = ("shoulder", "elbow", "wrist", "hand")


def with_rest(animation: Animation, mesh: Mesh, rest: str) -> tuple[Animation, Mesh]:
    """The same motion with another rest pose, and the mesh in it. Arms are straight in it; the joints' axes at rest stay those of the
    world, so that the motion's rotations are relative to the new pose.

    Raises `SettingsError` if `rest` is not one of `RAISED`.
    """
    if rest not in RAISED:
        raise SettingsError(f"rest: found {rest!r}, expected one of {choices(RAISED)}")
    turns = rest_turns(animation, np.radians(RAISED[rest]))
    above = np.array([turns[max(parent, 0)] for parent in animation.parents])
    above[0] = np.eye(3)  # the root's rotations and positions are the world's
    moved = replace(
        animation, offsets=(above @ animation.offsets[..., None])[..., 0],
        ends={n: tuple((turns[n] @ end).tolist()) for n, end in animation.ends.items()},
        rotations=above @ animation.rotations @ np.swapaxes(turns, 1, 2), shifts=(above @ animation.shifts[..., None])[..., 0],
    )  # fmt: skip
    own = turns[mesh.joints]
    points = moved.rest[mesh.joints] + (own @ (mesh.points - animation.rest[mesh.joints])[..., None])[..., 0]
    return moved, mesh._replace(points=points, normals=(own @ mesh.normals[..., None])[..., 0])


def rest_turns(animation: Animation, raised: float) -> Array:
    """Rotations (J, 3, 3) of the joints from an animation's rest pose to one with straight arms `raised` radians above hanging."""
    turns = np.tile(np.eye(3), (len(animation.names), 1, 1))
    for j, (name, parent) in enumerate(zip(animation.names, animation.parents)):
        side, _, part = name.partition("_")
        if side not in ("left", "right") or part not in ARM:
            continue
        outward = 1.0 if side == "left" else -1.0
        along = _bone(animation, j)
        wanted = np.array([outward * np.sin(raised), -np.cos(raised), 0.0])
        turns[j] = turns[parent] if along is None else shortest_rotation(along, wanted, 1e-9)
    return turns


def _bone(animation: Animation, joint: int) -> Array | None:
    """Unit vector (3,) from a joint to its child, or to its end, at rest; None without either."""
    child = next((n for n, parent in enumerate(animation.parents) if parent == joint), None)
    along = np.array(animation.ends.get(joint, np.zeros(3))) if child is None else animation.offsets[child]
    length = float(np.linalg.norm(along))
    return along / length if length > 1e-6 else None
