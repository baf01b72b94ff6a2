"""A tracked person as the bones of an avatar in Unity's frame, as VRM and the VMC protocol define them.

Unity's frame is left-handed: X right, Y up, Z forward. An avatar without rotations stands in a T-pose: it looks along Z, its arms to the
sides, palms down. The zero pose of our bodies has hanging arms; `HANG` is the difference.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from shadowpuppet.geometry import Array, inverse, rotation_about
from shadowpuppet.live.stream.outlet import StreamFrame, StreamSubject

TO_UNITY = np.array([[0.0, -1, 0], [0, 0, 1.0], [1.0, 0, 0]])
"""From axes forward, left, up to Unity's right, up, forward: a reflection, as handedness changes."""
HANG = {"left": rotation_about([1, 0, 0], -np.pi / 2), "right": rotation_about([1, 0, 0], np.pi / 2)}
"""Rotation of an arm from the T-pose to hanging, about the forward axis."""
TRUNK = (("Hips", "pelvis", ""), ("Spine", "chest", "Hips"), ("Spine", "torso", "Hips"), ("Neck", "neck", "Spine"),
         ("Head", "head", "Neck"))  # fmt: skip
LIMBS = (("UpperArm", "shoulder", "Spine"), ("LowerArm", "elbow", "UpperArm"), ("Hand", "wrist", "LowerArm"),
         ("UpperLeg", "hip", "Hips"), ("LowerLeg", "knee", "UpperLeg"), ("Foot", "ankle", "LowerLeg"))


class Link(NamedTuple):
    """A bone of the avatar, named as in Unity's `HumanBodyBones`."""

    name: str
    joint: str
    """The joint at which it begins."""
    parent: str
    """Name of the parent bone; empty for none."""
    arm: str = ""
    """The side, for bones of an arm; else empty."""


def _links() -> tuple[Link, ...]:
    links = [Link(*row) for row in TRUNK]
    for side in ("left", "right"):
        for name, joint, parent in LIMBS:
            own = parent if parent in ("Spine", "Hips") else side.title() + parent
            links.append(Link(side.title() + name, f"{side}_{joint}", own, side if name.endswith(("Arm", "Hand")) else ""))
    return tuple(links)


LINKS = _links()
"""Bones of all our bodies, parents before children."""


class VmcBone(NamedTuple):
    """A bone relative to its parent, in Unity's frame."""

    name: str
    position: tuple[float, float, float]
    """Metres."""
    rotation: tuple[float, float, float, float]
    """Quaternion x, y, z, w."""


class Avatar:
    """The bones of `LINKS` that a subject's body has. If a bone's parent is missing, its parent is the hips."""

    def __init__(self, subject: StreamSubject) -> None:
        """Place the avatar: the floor is Y = 0; in the zero pose it stands upright at the origin, looking along Z."""
        self.links = [link for link in LINKS if link.joint in subject.names]
        self._nodes = [subject.names.index(link.joint) for link in self.links]
        at = {link.name: n for n, link in enumerate(self.links)}
        self._parents = np.array([-1 if not link.parent else at.get(link.parent, 0) for link in self.links])
        self._hang = np.array([HANG[link.arm] if link.arm else np.eye(3) for link in self.links])
        self._upper = [(at[f"{side}UpperArm"], at[f"{side}LowerArm"]) for side in ("Left", "Right")]
        base = np.eye(4) if subject.floor is not None else subject.T_world_base
        self._to_unity = TO_UNITY @ inverse(base)[:3, :3]
        rise = subject.pelvis_height if subject.floor is None else -subject.floor
        self._shift = np.array([0.0, rise, 0.0]) - self._to_unity @ base[:3, 3]

    def bones(self, frame: StreamFrame) -> list[VmcBone]:
        """All bones, parents before children; none if the frame has no pose."""
        if frame.positions is None or frame.rotations is None:
            return []
        rotations = frame.rotations[self._nodes].copy()
        for upper, lower in self._upper:
            rotations[upper] = rotations[upper] @ _twist(rotations[upper].T @ rotations[lower])
        positions = frame.positions[self._nodes] @ self._to_unity.T + self._shift
        rotations = self._to_unity @ rotations @ self._hang @ TO_UNITY.T
        is_root = self._parents < 0
        to_parent = np.where(is_root[:, None, None], np.eye(3), np.swapaxes(rotations[self._parents], 1, 2))
        start = np.where(is_root[:, None], 0.0, positions[self._parents])
        local = (to_parent @ (positions - start)[:, :, None])[..., 0].tolist()
        quaternions = Rotation.from_matrix(to_parent @ rotations).as_quat(canonical=True).tolist()
        return [VmcBone(link.name, tuple(position), tuple(rotation)) for link, position, rotation in zip(self.links, local, quaternions)]


def _twist(elbow: Array) -> Array:
    """The part (3, 3) of an elbow's rotation about the upper arm (z), before the bend about y.

    In an avatar this belongs to the upper arm; its elbow only bends.
    """
    c, s = elbow[1, 1], -elbow[0, 1]
    length = float(np.hypot(c, s))
    return np.eye(3) if length == 0 else np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, length]]) / length
