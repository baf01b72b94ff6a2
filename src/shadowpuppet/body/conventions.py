"""What the degrees of freedom of a body mean, found by moving the body: its zero, its positive sense, its order among its joint's."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from shadowpuppet.body.shapes import Body
from shadowpuppet.body.skeleton import AXES, SIDES, Dof, Skeleton
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array

MOVES = (("forward", "backward"), ("to the left", "to the right"), ("up", "down"))
LIES = (("before", "behind"), ("left of", "right of"), ("above", "below"))
"""Words for the positive and negative direction of the body's axes x, y and z: where a point moves, and where it lies."""
STEP = 1e-4
"""Step of finite differences, rad or m."""
ARM = 0.01
"""Distance (m) of a point from an axis from which on it shows a turn about it."""
BEND = 60.0
"""Degrees by which a hinge farther out is bent where a straight limb does not show a twist."""
ISB = {"hip_flexion": ("hip flexion", 1), "hip_abduction": ("hip adduction", -1), "hip_twist": ("hip internal rotation", -1),
       "knee_flexion": ("knee flexion", 1), "ankle_flexion": ("ankle dorsiflexion", -1), "ankle_inversion": ("ankle inversion", 1),
       "elbow_flexion": ("elbow flexion", 1)}  # fmt: skip
"""By name without the side: the angle of the International Society of Biomechanics (Wu et al. 2002, 2005) and our sign of it. Its shoulder
turns in another order, and its spine and pelvis have no rotation vectors."""


class Convention(NamedTuple):
    """Meaning of a degree of freedom."""

    dof: Dof
    parent: str
    """Joint against which its joint moves; empty for the root, which moves in the body's frame."""
    order: int
    """Place among the angles of its joint, from 1 on; each turns about its axis as those before have turned it. Components of a rotation
    vector share one place."""
    axis: Array
    """About which it turns right-handed, or along which it moves, of shape (3,), in the body's frame when all angles are zero."""
    landmark: str
    """The point that moves most, of those in the middle of the body if these move."""
    bent: str
    """The degree of freedom that is at `BEND` meanwhile; empty for none."""
    lies: str
    """Direction of that point from the joint at zero, such as `below`, across the axis; empty for a translation."""
    moves: str
    """Direction of its movement as the value grows, such as `forward`."""
    isb: tuple[str, int]
    """Name of the angle in ISB's recommendations, and our sign of it; empty and 0 if there is none."""

    @property
    def zero(self) -> str:
        """Zero in words."""
        return f"{self.landmark} {self.lies} {self.dof.joint}{self._meanwhile}" if self.lies else f"{self.dof.joint} at the origin"

    @property
    def positive(self) -> str:
        """Positive sense in words."""
        return f"{self.landmark} moves {self.moves}{self._meanwhile}"

    @property
    def _meanwhile(self) -> str:
        return f", with {self.bent} at {BEND:.0f} degrees" if self.bent else ""


def conventions(body: Body) -> list[Convention]:
    """The conventions of all degrees of freedom of a body."""
    return [_convention(body, d) for d in range(len(body.skeleton.dofs))]


def _convention(body: Body, d: int) -> Convention:
    skeleton, dof = body.skeleton, body.skeleton.dofs[d]
    joint = skeleton.joints[skeleton.joint_index(dof.joint)]
    axis, along = np.zeros(3), AXES[dof.axis]
    axis[along[0]] = along[1]
    isb = ISB.get(dof.name.partition("_")[2] if dof.name.startswith(SIDES) else dof.name, ("", 0))
    shown = Convention(dof, joint.parent or "", _order(skeleton, d), axis, dof.joint, "", "", _word(axis, MOVES), isb)
    if dof.kind == "translation":
        return shown
    names = _carried(body, dof.joint)
    middle = [name for name in names if not name.startswith(SIDES)]
    for bent, chosen in (*(("", each) for each in (middle, names) if each), *((hinge, names) for hinge in _hinges(skeleton, dof))):
        pose = skeleton.pose(**{bent: np.radians(BEND)} if bent else {})
        way = _way(body, pose, d, chosen)
        n = int(np.linalg.norm(way, axis=1).argmax())
        if np.linalg.norm(way[n]) > ARM:
            start = skeleton.forward(pose[None])[0, skeleton.joint_index(joint.name), :, 3]
            place = body.points(pose[None], names=[chosen[n]])[0, 0] - start
            lies = _word(np.where(axis == 0, place, 0), LIES)
            return shown._replace(landmark=chosen[n], bent=bent, lies=lies, moves=_word(way[n], MOVES))
    raise ShadowPuppetError(f"{dof.name}: found no landmark that it moves")


def _way(body: Body, pose: Array, d: int, names: list[str]) -> Array:
    """Velocities (L, 3) of landmarks as the d-th degree of freedom of a pose (D,) grows."""
    poses = np.stack([pose, pose])
    poses[1, d] += STEP
    before, after = body.points(poses, names=names)
    return (after - before) / STEP


def _carried(body: Body, joint: str) -> list[str]:
    """Landmarks that move with a joint and stand in files."""
    below = {joint}
    for each in body.skeleton.joints:
        if each.parent in below:
            below.add(each.name)
    return [name for name, (owner, _) in body.landmarks.items() if owner in below and not name.endswith("_fist")]


def _hinges(skeleton: Skeleton, dof: Dof) -> Iterator[str]:
    """Flexions of a degree of freedom's own joint, and of those next below it, that can be bent by `BEND`."""
    near = {each.name for each in skeleton.joints if dof.joint in (each.name, each.parent)}
    for each in skeleton.dofs:
        if each.joint in near and each.name.endswith("_flexion") and each.high > np.radians(BEND) and each != dof:
            yield each.name


def _order(skeleton: Skeleton, d: int) -> int:
    """Place of a degree of freedom among the angles of its joint; 1 for a translation."""
    dof = skeleton.dofs[d]
    own = [each for each in skeleton.dofs[:d] if each.joint == dof.joint and each.kind != "translation"]
    return 1 if dof.kind != "rotation" else len(own) + 1


def _word(vector: Array, words: tuple[tuple[str, str], ...]) -> str:
    """The word for the axis that a vector is nearest to."""
    k = int(np.abs(vector).argmax())
    return words[k][0 if vector[k] > 0 else 1]
