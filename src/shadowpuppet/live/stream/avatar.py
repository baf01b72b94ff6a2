"""A tracked person as the bones of an avatar in Unity's frame, as VRM and VMC's protocol have them.

Unity's frame is left-handed: X to the right, Y up, Z forward. An avatar without any rotation stands in a T: it looks along Z, and its arms
point to its sides, palms down. Ours stands with hanging arms, which is what the arms' bones have beside.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from shadowpuppet.geometry import Array, inverse, rotation_about
from shadowpuppet.live.stream.outlet import Subject, Told

TO_UNITY = np.array([[0.0, -1, 0], [0, 0, 1.0], [1.0, 0, 0]])
"""From axes forward, left, up to Unity's right, up, forward: a mirror, for hands change."""
HANG = {"left": rotation_about([1, 0, 0], -np.pi / 2), "right": rotation_about([1, 0, 0], np.pi / 2)}
"""From an arm that points to the side to one that hangs: about the axis forward."""
TRUNK = (("Hips", "pelvis", ""), ("Spine", "chest", "Hips"), ("Spine", "torso", "Hips"), ("Neck", "neck", "Spine"),
         ("Head", "head", "Neck"))  # fmt: skip
LIMBS = (("UpperArm", "shoulder", "Spine"), ("LowerArm", "elbow", "UpperArm"), ("Hand", "wrist", "LowerArm"),
         ("UpperLeg", "hip", "Hips"), ("LowerLeg", "knee", "UpperLeg"), ("Foot", "ankle", "LowerLeg"))


class Link(NamedTuple):
    """A bone of the avatar, by its name in Unity's `HumanBodyBones`."""

    name: str
    joint: str
    """Where it begins."""
    above: str
    """The bone that it hangs on; empty: none."""
    arm: str = ""
    """The side, of an arm's bone."""


def _links() -> tuple[Link, ...]:
    links = [Link(*row) for row in TRUNK]
    for side in ("left", "right"):
        for name, joint, above in LIMBS:
            own = above if above in ("Spine", "Hips") else side.title() + above
            links.append(Link(side.title() + name, f"{side}_{joint}", own, side if name.endswith(("Arm", "Hand")) else ""))
    return tuple(links)


LINKS = _links()
"""All bones that any body of ours has, parents before children."""


class Bone(NamedTuple):
    """A bone against the one above it, in Unity's frame."""

    name: str
    place: tuple[float, float, float]
    """Metres."""
    turn: tuple[float, float, float, float]
    """Quaternion x, y, z, w."""


class Avatar:
    """The bones of a subject: those of `LINKS` that its body has. A bone whose parent is not there hangs on the next above."""

    def __init__(self, subject: Subject) -> None:
        """Where it stands: with the floor at Y = 0, upright at zero before Z = 0 and looking along Z."""
        self.links = [link for link in LINKS if link.joint in subject.names]
        self._nodes = [subject.names.index(link.joint) for link in self.links]
        at = {link.name: n for n, link in enumerate(self.links)}
        self._above = [-1 if not link.above else at.get(link.above, 0) for link in self.links]
        self._hang = np.array([HANG[link.arm] if link.arm else np.eye(3) for link in self.links])
        self._upper = [(at[f"{side}UpperArm"], at[f"{side}LowerArm"]) for side in ("Left", "Right")]
        base = np.eye(4) if subject.floor is not None else subject.T_world_base
        self._turn = TO_UNITY @ inverse(base)[:3, :3]
        rise = subject.pelvis_height if subject.floor is None else -subject.floor
        self._shift = np.array([0.0, rise, 0.0]) - self._turn @ base[:3, 3]

    def bones(self, frame: Told) -> list[Bone]:
        """Every bone, parents before children; none where the frame has no pose."""
        if frame.places is None or frame.turns is None:
            return []
        turns = frame.turns[self._nodes].copy()
        for upper, lower in self._upper:
            turns[upper] = turns[upper] @ _twist(turns[upper].T @ turns[lower])
        places = frame.places[self._nodes] @ self._turn.T + self._shift
        turns = self._turn @ turns @ self._hang @ TO_UNITY.T
        above = np.array(self._above)
        back = np.where((above < 0)[:, None, None], np.eye(3), np.swapaxes(turns[above], 1, 2))
        start = np.where((above < 0)[:, None], 0.0, places[above])
        local = (back @ (places - start)[:, :, None])[..., 0].tolist()
        quaternions = Rotation.from_matrix(back @ turns).as_quat(canonical=True).tolist()
        return [Bone(link.name, tuple(place), tuple(turn)) for link, place, turn in zip(self.links, local, quaternions)]


def _twist(elbow: Array) -> Array:
    """The part (3, 3) of an elbow's rotation that turns about the upper arm, along z, before it bends about y.

    In an avatar that is the upper arm's, whose elbow only bends.
    """
    c, s = elbow[1, 1], -elbow[0, 1]
    length = float(np.hypot(c, s))
    return np.eye(3) if length == 0 else np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, length]]) / length
