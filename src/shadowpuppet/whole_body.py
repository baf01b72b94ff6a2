"""Bodies of the whole person, made from named sizes: `anatomical`, whose limbs taper and lie off the bone as real ones do, and
`cylinders`, the ten parts of Ni 2008 (II).

Both have limbs, to which points are compared, and draw the same limbs as silhouettes. The body's frame is X forward, Y to the person's
left, Z up.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from shadowpuppet.body import Body, Hulls
from shadowpuppet.limbs import Limbs
from shadowpuppet.skeleton import Skeleton
from shadowpuppet.whole_sizes import AnatomicalSizes, BoneSizes, CylinderSizes
from shadowpuppet.whole_skeleton import SIDES, anatomical_skeleton, cylinder_skeleton

ALONG = {"down": ("x", "-y", "-z"), "up": ("x", "y", "z"), "forward": ("y", "z", "x"), "left": ("z", "x", "y")}
"""Axes of a limb's own frame, x, y, z, in its joint's."""
FLAT = 0.02
"""A flat end is drawn as an ellipsoid of so little height, as a share of its radii."""
Pair = tuple[float, float]


class _Limb(NamedTuple):
    """A limb, metres; places along it are from the joint on in its direction, `off` and `radii` along its own x and y."""

    part: str
    joint: str
    along: str
    reach: Pair
    """Where it begins and ends."""
    radii: tuple[Pair, Pair]
    """At the start and the end."""
    off: tuple[Pair, Pair] = ((0.0, 0.0), (0.0, 0.0))
    """How far the middle of its cross-sections lies off the joint's axis, at the start and the end."""
    caps: Pair = (0.0, 0.0)


def _axes(along: str) -> np.ndarray:
    """A limb's frame in its joint's, (3, 3)."""
    return np.stack([(-1.0 if name[0] == "-" else 1.0) * np.eye(3)["xyz".index(name[-1])] for name in ALONG[along]], 1)


def _limbs(skeleton: Skeleton, parts: Sequence[_Limb]) -> Limbs:
    frames = np.stack([_axes(part.along) for part in parts])
    starts = np.array([[*part.off[0], part.reach[0]] for part in parts])
    ends = np.array([[*part.off[1], part.reach[1]] for part in parts])
    return Limbs(np.array([skeleton.joint_index(part.joint) for part in parts], np.int64), frames, (frames @ starts[:, :, None])[..., 0],
                 (ends - starts)[:, 2], (ends - starts)[:, :2], np.array([part.radii for part in parts], float),
                 np.array([part.caps for part in parts], float), tuple(part.part for part in parts))  # fmt: skip


def _drawn(limbs: Limbs) -> Hulls:
    """Limbs as hulls of two ellipsoids, one at either end."""
    flat = FLAT * limbs.radii.mean(2)
    radii = np.concatenate([limbs.radii, np.maximum(limbs.caps, flat)[..., None]], 2)
    in_joint = (np.abs(limbs.rotations)[:, None] @ radii[..., None])[..., 0]
    return Hulls(np.stack([limbs.joints, limbs.joints], 1), np.stack([limbs.starts, limbs.ends], 1), in_joint)


def _body(name: str, skeleton: Skeleton, sizes: BoneSizes, parts: Sequence[_Limb], neck: tuple[str, float]) -> Body:
    limbs, s = _limbs(skeleton, parts), sizes
    places = {"pelvis": ("pelvis", (0.0, 0.0, 0.0)), "neck": (neck[0], (0.0, 0.0, neck[1])), "head": ("head", (s.head_forward, 0.0, s.neck_length))}
    for side in SIDES:
        elbow = f"{side}_elbow"
        places |= {f"{side}_shoulder": (f"{side}_shoulder", (0.0, 0.0, 0.0)), elbow: (elbow, (0.0, 0.0, 0.0)),
                   f"{side}_wrist": (elbow, (0.0, 0.0, -s.forearm_length)), f"{side}_hand": (elbow, (0.0, 0.0, -s.forearm_length - s.hand_point))}
    for side in SIDES:
        places |= {f"{side}_{name}": (f"{side}_{name}", (0.0, 0.0, 0.0)) for name in ("hip", "knee")}
        places[f"{side}_ankle"] = (f"{side}_knee", (0.0, 0.0, -s.shank_length))
    return Body(name, skeleton, _drawn(limbs), limbs.parts, places, None, limbs)


def _round(width: float, x: float = 1.0, y: float = 1.0) -> Pair:
    """Radii of a section of a mean width; x and y are shares."""
    return x * width / 2, y * width / 2


def _arm(side: str, s: AnatomicalSizes) -> list[_Limb]:
    """Forward of the bone at the elbow, behind it at the shoulder; the hand's palm faces the thigh."""
    shoulder, elbow, grip = f"{side}_shoulder", f"{side}_elbow", s.forearm_length + s.hand_length - 0.2 * s.hand_width
    return [
        _Limb(f"{side}_upper_arm", shoulder, "down", (0.0, s.upper_arm_length), (_round(s.upper_arm_width, 0.98, 1.02), _round(s.elbow_width, 1.16, 0.84)),
              ((-0.075 * s.upper_arm_width, 0.0), (0.05 * s.elbow_width, 0.0)), (0.5 * s.upper_arm_width, 0.25 * s.elbow_width)),
        _Limb(f"{side}_forearm", elbow, "down", (0.0, s.forearm_length), (_round(s.forearm_width, 0.9, 1.1), _round(s.wrist_width, 1.16, 0.84)),
              caps=(0.25 * s.elbow_width, 0.1 * s.wrist_width)),
        _Limb(f"{side}_hand", elbow, "down", (s.forearm_length, grip), (_round(s.wrist_width, 1.16, 0.84), _round(s.hand_width, 0.9, 0.42)),
              caps=(0.1 * s.wrist_width, 0.2 * s.hand_width)),
    ]  # fmt: skip


def _leg(side: str, s: AnatomicalSizes) -> list[_Limb]:
    """The thigh lies before the bone, the calf behind it; the sole is flat on the floor."""
    hip, knee, ankle = f"{side}_hip", f"{side}_knee", f"{side}_ankle"
    heel, toes = 0.45 * s.ankle_height, 0.22 * s.ankle_height
    return [
        _Limb(f"{side}_thigh", hip, "down", (0.0, s.thigh_length), (_round(s.thigh_width, 1.09, 0.91), _round(s.knee_width, 1.03, 0.97)),
              ((0.107 * s.thigh_width, 0.0), (0.126 * s.knee_width, 0.0)), (0.4 * s.thigh_width, 0.4 * s.knee_width)),
        _Limb(f"{side}_shank", knee, "down", (0.0, s.shank_length), (_round(s.calf_width, 1.04, 0.96), _round(s.ankle_width, 1.12, 0.88)),
              ((-0.132 * s.calf_width, 0.0), (-0.182 * s.ankle_width, 0.0)), (0.3 * s.calf_width, 0.4 * s.ankle_width)),
        _Limb(f"{side}_foot", ankle, "forward", (-0.14 * s.foot_length, 0.68 * s.foot_length), ((0.38 * s.foot_width, heel), (0.48 * s.foot_width, toes)),
              ((0.0, heel - s.ankle_height), (0.0, toes - s.ankle_height)), (0.09 * s.foot_length, 0.09 * s.foot_length)),
    ]  # fmt: skip


def _trunk(s: AnatomicalSizes) -> list[_Limb]:
    waist, chest, high = (s.waist_depth / 2, s.waist_width / 2), (s.chest_depth / 2, s.chest_width / 2), s.thorax_height - s.shoulder_drop
    armpit, yoke, level = 0.65 * high, _round(s.upper_arm_width, 0.9, 1.0), (high, s.shoulder_forward)
    jaw, skull = s.neck_length - 0.15 * s.head_height, s.neck_length + 0.45 * s.head_height
    return [
        _Limb("pelvis", "pelvis", "up", (-s.hip_drop, s.lumbar_height), ((s.pelvis_depth / 2, s.pelvis_width / 2), waist),
              caps=(0.4 * s.pelvis_depth, 0.2 * s.waist_depth)),
        _Limb("chest", "chest", "up", (0.0, armpit), (waist, chest), caps=(0.2 * s.waist_depth, s.thorax_height - armpit)),
        _Limb("shoulders", "chest", "left", (-0.5 * s.shoulder_distance, 0.5 * s.shoulder_distance), (yoke, yoke), (level, level),
              (0.3 * s.upper_arm_width, 0.3 * s.upper_arm_width)),
        _Limb("neck", "head", "up", (-0.1 * s.neck_length, s.neck_length), (_round(s.neck_width), _round(s.neck_width)),
              ((0.0, 0.0), (s.head_forward, 0.0)), (0.2 * s.neck_width, 0.2 * s.neck_width)),
        _Limb("head", "head", "up", (jaw, skull), ((0.36 * s.head_depth, 0.40 * s.head_width), (0.5 * s.head_depth, 0.5 * s.head_width)),
              ((s.head_forward + 0.16 * s.head_depth, 0.0), (s.head_forward + 0.03 * s.head_depth, 0.0)), (0.35 * s.head_height, 0.55 * s.head_height)),
    ]  # fmt: skip


def anatomical(sizes: AnatomicalSizes) -> Body:
    """32 DOF, 16 tapered elliptic limbs.

    Tapers and offsets from the bone are shares of the widths, found on a mesh of a person; the rest of the shape is our own.
    """
    parts = [*_trunk(sizes), *(limb for side in SIDES for limb in _arm(side, sizes)), *(limb for side in SIDES for limb in _leg(side, sizes))]
    return _body("anatomical", anatomical_skeleton(sizes), sizes, parts, ("chest", sizes.thorax_height))


def cylinders(sizes: CylinderSizes) -> Body:
    """25 DOF, ten cylinders with flat ends: the torso's elliptic, the others circular (Ni 2008, II)."""
    s = sizes
    trunk = (s.trunk_depth / 2, s.trunk_width / 2)
    parts = [_Limb("torso", "pelvis", "up", (-s.hip_drop - 0.3 * s.trunk_depth, s.trunk_height - 0.3 * s.shoulder_drop), (trunk, trunk)),
             _Limb("head", "head", "up", (0.0, s.neck_length + s.head_height), (_round(s.head_width), _round(s.head_width)))]
    for side in SIDES:
        for part, joint, reach, width in (
            ("upper_arm", "shoulder", (-0.3 * s.upper_arm_width, s.upper_arm_length), s.upper_arm_width),
            ("lower_arm", "elbow", (0.0, s.forearm_length + s.hand_length), s.forearm_width),
        ):
            parts.append(_Limb(f"{side}_{part}", f"{side}_{joint}", "down", reach, (_round(width), _round(width))))
    for side in SIDES:
        for part, joint, reach, width in (
            ("upper_leg", "hip", (0.0, s.thigh_length), s.thigh_width),
            ("lower_leg", "knee", (0.0, s.shank_length + s.ankle_height), s.shank_width),
        ):
            parts.append(_Limb(f"{side}_{part}", f"{side}_{joint}", "down", reach, (_round(width), _round(width))))
    return _body("cylinders", cylinder_skeleton(sizes), sizes, parts, ("pelvis", sizes.trunk_height))
