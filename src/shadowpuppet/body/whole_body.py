"""Bodies of the whole person: `anatomical`, with tapered limbs offset from the bones, and `cylinders`, the ten parts of Ni 2008 (II).

Each is a skeleton and a table of limbs, which are both compared with surface points and drawn as silhouettes. The body's frame is X
forward, Y to the person's left, Z up.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from shadowpuppet.body.shapes import Body, Hulls, Limbs
from shadowpuppet.body.sizes import AnatomicalSizes, BoneSizes, CylinderSizes
from shadowpuppet.body.skeleton import SIDES, Dof, Joint, Skeleton

Pair = tuple[float, float]
Three = tuple[float, float, float]
FREE = (-np.inf, np.inf)
GLOBAL_DOFS = ("root_x", "root_y", "root_z", "root_heading")
"""Degrees of freedom for position and heading in the world, which no articulation prior models."""


def heading_column(skeleton: Skeleton) -> int:
    """Index of the heading among a whole body's DOF."""
    return int(skeleton.dof_indices(GLOBAL_DOFS[3:])[0])


SWING = {"left": ("-y", "x", "z"), "right": ("-y", "-x", "-z")}
"""Axes about which a hanging limb swings forward, outward, and twists outward."""


def _dof(name: str, joint: str, axis: str, limits: Pair, rest: float = 0.0, spread: Pair = FREE, kind: str = "rotation") -> Dof:
    """A degree of freedom; angles in degrees."""
    below, above = np.abs(np.radians(spread)).tolist()
    return Dof(name, joint, axis, *np.radians(limits).tolist(), kind=kind,  # pyright: ignore[reportArgumentType]
               rest=float(np.radians(rest)), spread=(below, above))  # fmt: skip


def _ball(joint: str, limits: tuple[Pair, Pair, Pair], rest: Three,
          spread: tuple[float | Pair, float | Pair, float | Pair]) -> list[Dof]:
    """The rotation vector of a ball joint, degrees; a spread may differ below and above the rest."""
    return [_dof(f"{joint}_{axis}", joint, axis, within, usual, wide if isinstance(wide, tuple) else (-wide, wide), "vector")
            for axis, within, usual, wide in zip("xyz", limits, rest, spread)]


def _sided(side: str, limits: tuple[Pair, Pair, Pair], rest: Three, spread: Three) -> tuple:
    """Limits, rest and spread for `_ball` on a side, from those of the left side; the right mirrors rotations about x and z."""
    (x, y, z), (a, b, c) = limits, rest
    return (limits, rest, spread) if side == "left" else (((-x[1], -x[0]), y, (-z[1], -z[0])), (-a, b, -c), spread)


def _angles(joint: str, axes: tuple[str, str, str], names: tuple[str, str, str], limits: tuple[Pair, Pair, Pair],
            rest: Three, spread: Three) -> list[Dof]:
    """Three rotations one after another, degrees: about Y, then X, then Z."""
    return [_dof(f"{joint}_{name}", joint, axis, within, usual, (-wide, wide))
            for axis, name, within, usual, wide in zip(axes, names, limits, rest, spread)]


def _root() -> list[Dof]:
    """The pelvis in the world: position; then heading, bow (positive forward) and tilt (positive to the right)."""
    places = [_dof(f"root_{axis}", "pelvis", axis, FREE, kind="translation") for axis in "xyz"]
    return [*places, _dof("root_heading", "pelvis", "z", FREE), _dof("root_bow", "pelvis", "y", (-100, 130), spread=(5, 10)),
            _dof("root_tilt", "pelvis", "x", (-80, 80), spread=(8, 8))]  # fmt: skip


def _places(side: str, s: BoneSizes) -> tuple[Three, Three]:
    """Positions of a side's shoulder from the base of the neck, and of its hip from the pelvis."""
    out = 0.5 if side == "left" else -0.5
    return (s.shoulder_forward, out * s.shoulder_distance, -s.shoulder_drop), (s.hip_forward, out * s.hip_distance, -s.hip_drop)


def anatomical_skeleton(sizes: AnatomicalSizes) -> Skeleton:
    """32 DOF: the pelvis 6; chest, head, shoulders, hips 3 each as rotation vectors; elbows, knees 1 each; ankles 2 each."""
    s = sizes
    joints = [Joint("pelvis", None), Joint("chest", "pelvis", (0.0, 0.0, s.lumbar_height)),
              Joint("head", "chest", (0.0, 0.0, s.thorax_height))]  # fmt: skip
    dofs = [*_root(), *_ball("chest", ((-50, 50), (-30, 80), (-65, 65)), (0, 3, 0), (12, (6, 20), 12)),
            *_ball("head", ((-55, 55), (-70, 75), (-90, 90)), (0, 0, 0), (15, 20, 25))]  # fmt: skip
    for side in SIDES:
        x, y, z = _places(side, s)[0]
        joints += [Joint(f"{side}_shoulder", "chest", (x, y, z + s.thorax_height)),
                   Joint(f"{side}_elbow", f"{side}_shoulder", (0.0, 0.0, -s.upper_arm_length))]
        dofs += _ball(f"{side}_shoulder", *_sided(side, ((-100, 210), (-215, 100), (-150, 150)), (12, -5, 0), (40, 50, 40)))
        dofs += [_dof(f"{side}_elbow_flexion", f"{side}_elbow", "-y", (0, 150), 20, (25, 60))]
    for side in SIDES:
        hip, knee, ankle = f"{side}_hip", f"{side}_knee", f"{side}_ankle"
        joints += [Joint(hip, "pelvis", _places(side, s)[1]), Joint(knee, hip, (0.0, 0.0, -s.thigh_length)),
                   Joint(ankle, knee, (0.0, 0.0, -s.shank_length))]
        dofs += _ball(hip, *_sided(side, ((-60, 95), (-150, 60), (-75, 75)), (4, -5, 0), (15, 25, 12)))
        dofs += [_dof(f"{side}_knee_flexion", knee, "y", (0, 155), 10, (10, 30)),
                 _dof(f"{side}_ankle_flexion", ankle, "y", (-40, 60), 0, (15, 20)),
                 _dof(f"{side}_ankle_inversion", ankle, "-x" if side == "left" else "x", (-30, 40), 0, (10, 10))]
    return Skeleton(tuple(joints), tuple(dofs))


def cylinder_skeleton(sizes: CylinderSizes) -> Skeleton:
    """The 25 DOF of Ni 2008 (II): torso 6; head, upper arms and upper legs 3 each, as angles about Y, X, Z; lower arms and legs 1 each.
    With a limb level to the side (abduction 90 degrees) flexion and twist coincide; angles stay unwrapped."""
    s = sizes
    joints = [Joint("pelvis", None), Joint("head", "pelvis", (0.0, 0.0, s.trunk_height))]
    dofs = [*_root(), *_angles("head", ("y", "x", "z"), ("flexion", "bend", "twist"), ((-70, 75), (-55, 55), (-90, 90)), (0, 0, 0),
                               (20, 15, 25))]  # fmt: skip
    swing = ("flexion", "abduction", "twist")
    for side in SIDES:
        (x, y, z), _ = _places(side, s)
        shoulder, elbow = f"{side}_shoulder", f"{side}_elbow"
        joints += [Joint(shoulder, "pelvis", (x, y, z + s.trunk_height)), Joint(elbow, shoulder, (0.0, 0.0, -s.upper_arm_length))]
        dofs += _angles(shoulder, SWING[side], swing, ((-100, 215), (-60, 200), (-150, 150)), (5, 12, 0), (50, 40, 40))
        dofs += [_dof(f"{elbow}_flexion", elbow, "-y", (0, 135), 20, (25, 60))]
    for side in SIDES:
        hip, knee = f"{side}_hip", f"{side}_knee"
        joints += [Joint(hip, "pelvis", _places(side, s)[1]), Joint(knee, hip, (0.0, 0.0, -s.thigh_length))]
        dofs += _angles(hip, SWING[side], swing, ((-60, 150), (-60, 95), (-75, 75)), (5, 4, 0), (25, 15, 12))
        dofs += [_dof(f"{knee}_flexion", knee, "y", (0, 155), 10, (10, 30))]
    return Skeleton(tuple(joints), tuple(dofs))


LIMB_AXES = {
    "up": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
    "down": [[1, 0, 0], [0, -1, 0], [0, 0, -1]],
    "forward": [[0, 0, 1], [0, -1, 0], [1, 0, 0]],
    "left": [[1, 0, 0], [0, 0, 1], [0, -1, 0]],
}
"""Columns: a limb's own axes x, y, z in its joint's frame. z runs along the limb; x is forward, or up for a foot."""
FLAT_END = 0.02
"""Height of the ellipsoid that a flat end is drawn as, as a share of its radii."""


class _Limb(NamedTuple):
    """A limb, metres. Positions along it are measured from the joint; radii are along its own x and y."""

    part: str
    joint: str
    along: str
    reach: Pair
    """Start and end."""
    radii: tuple[Pair, Pair]
    """At the start and the end."""
    off: Pair = (0.0, 0.0)
    """Offsets of the cross-sections' centres from the joint's axis along x, at the start and the end."""
    caps: Pair = (0.0, 0.0)
    aside: Pair = (0.0, 0.0)
    """The same along y."""


def _limbs(skeleton: Skeleton, parts: Sequence[_Limb]) -> Limbs:
    frames = np.array([LIMB_AXES[part.along] for part in parts], float)
    starts, ends = np.array([[*zip(part.off, part.aside, part.reach)] for part in parts]).swapaxes(0, 1)
    return Limbs(np.array([skeleton.joint_index(part.joint) for part in parts], np.int64), frames, (frames @ starts[:, :, None])[..., 0],
                 (ends - starts)[:, 2], (ends - starts)[:, :2], np.array([part.radii for part in parts], float),
                 np.array([part.caps for part in parts], float), tuple(part.part for part in parts))  # fmt: skip


def _drawn(limbs: Limbs) -> Hulls:
    """Limbs as hulls of two ellipsoids, one at each end."""
    flat = FLAT_END * limbs.radii.mean(2)
    radii = np.concatenate([limbs.radii, np.maximum(limbs.caps, flat)[..., None]], 2)
    in_joint = (np.abs(limbs.rotations)[:, None] @ radii[..., None])[..., 0]
    return Hulls(np.stack([limbs.joints, limbs.joints], 1), np.stack([limbs.starts, limbs.ends], 1), in_joint)


def _landmarks(sizes: BoneSizes, neck: tuple[str, float]) -> dict[str, tuple[str, Three]]:
    """The 17 joints that every motion of a whole body reports. `neck`: the joint that carries the base of the neck, and the height (m) of
    that above it."""
    points = {"pelvis": ("pelvis", (0.0, 0.0, 0.0)), "neck": (neck[0], (0.0, 0.0, neck[1])),
              "head": ("head", (sizes.head_forward, 0.0, sizes.neck_length))}  # fmt: skip
    for side in SIDES:
        down = {"shoulder": ("shoulder", 0.0), "elbow": ("elbow", 0.0), "wrist": ("elbow", sizes.forearm_length),
                "hand": ("elbow", sizes.forearm_length + sizes.hand_point)}  # fmt: skip
        points |= {f"{side}_{name}": (f"{side}_{joint}", (0.0, 0.0, -z)) for name, (joint, z) in down.items()}
    for side in SIDES:
        down = {"hip": ("hip", 0.0), "knee": ("knee", 0.0), "ankle": ("knee", sizes.shank_length)}
        points |= {f"{side}_{name}": (f"{side}_{joint}", (0.0, 0.0, -z)) for name, (joint, z) in down.items()}
    return points


HEEL, TOE = -0.14, 0.72
"""Places along the foot, as shares of its length before the ankle: below the heel bone, over which a foot rolls at contact; and below the
tips of the toes."""
HEEL_END, TOES_END = -0.14, 0.68
"""First and last cross-section of the foot's shape, in the same shares."""


def _soles(sizes: AnatomicalSizes) -> dict[str, tuple[str, Three]]:
    """Heel and toe of both feet, on the sole, along the middle of the foot."""
    points = dict[str, tuple[str, Three]]()
    for side in SIDES:
        (start, end), out = _toe_out(side, sizes), TOES_END - HEEL_END
        for name, share in (("heel", HEEL), ("toe", TOE)):
            aside = start + (end - start) * (share - HEEL_END) / out
            points[f"{side}_{name}"] = (f"{side}_ankle", (share * sizes.foot_length, aside, -sizes.ankle_height))
    return points


def _toe_out(side: str, s: AnatomicalSizes) -> Pair:
    """How far to the left (m) of the ankle the middle of the heel and of the toes lie: the flat foot is turned out about the ankle."""
    out = s.toe_out if side == "left" else -s.toe_out
    return -0.2 * out, out


def _body(name: str, skeleton: Skeleton, parts: Sequence[_Limb], landmarks: dict[str, tuple[str, Three]]) -> Body:
    limbs = _limbs(skeleton, parts)
    return Body(name, skeleton, _drawn(limbs), limbs.parts, landmarks, None, limbs)


def _section(width: float, x: float = 1.0, y: float = 1.0) -> Pair:
    """Radii of a cross-section of a mean width; `x` and `y` are factors."""
    return x * width / 2, y * width / 2


SHOULDER_SLOPE, SHOULDER_START = 0.5, 0.3
"""Rise of the shoulders' tops toward the neck, per metre across; and where the shoulders begin, within the neck, as a share of the distance
of the joint from the middle. Mid-shoulder, half a shoulder's length (some 72 mm) inside the acromion, is some 30 mm above it (Gordon et al.
1989: midshoulder and acromial heights, sitting)."""


def _shoulders(s: AnatomicalSizes) -> list[_Limb]:
    """Both sides from within the neck down to the shoulder joints, moving with the chest."""
    outer, low, yoke = 0.5 * s.shoulder_distance, s.shoulder_drop - s.thorax_height, _section(s.shoulder_thickness)
    inner, forward, cap = SHOULDER_START * outer, s.shoulder_forward, 0.3 * s.shoulder_thickness
    high = low - SHOULDER_SLOPE * (outer - inner)  # along y, which points down
    left, right = ((inner, outer), (high, low)), ((-outer, -inner), (low, high))
    return [_Limb(f"{side}_shoulder", "chest", "left", reach, (yoke, yoke), (forward, forward), (cap, cap), down)
            for side, (reach, down) in zip(SIDES, (left, right))]


def _trunk(s: AnatomicalSizes) -> list[_Limb]:
    """Two parts that meet at the waist, shoulders, neck and head; the neck leans forward."""
    hips, waist, chest = ((depth / 2, width / 2) for depth, width in (
        (s.pelvis_depth, s.pelvis_width), (s.waist_depth, s.waist_width), (s.chest_depth, s.chest_width)))  # fmt: skip
    neck, jaw, skull = _section(s.neck_width), (0.36 * s.head_depth, 0.40 * s.head_width), (0.5 * s.head_depth, 0.5 * s.head_width)
    armpit = 0.65 * (s.thorax_height - s.shoulder_drop)
    return [
        _Limb("pelvis", "pelvis", "up", (-s.hip_drop, s.lumbar_height), (hips, waist), caps=(0.4 * s.pelvis_depth, 0.2 * s.waist_depth)),
        _Limb("chest", "chest", "up", (0.0, armpit), (waist, chest), caps=(0.2 * s.waist_depth, s.thorax_height - armpit)),
        *_shoulders(s),
        _Limb("neck", "head", "up", (-0.1 * s.neck_length, s.neck_length), (neck, neck), (0.0, s.head_forward),
              (0.2 * s.neck_width, 0.2 * s.neck_width)),
        _Limb("head", "head", "up", (s.neck_length - 0.15 * s.head_height, s.neck_length + 0.45 * s.head_height), (jaw, skull),
              (s.head_forward + 0.16 * s.head_depth, s.head_forward + 0.03 * s.head_depth), (0.35 * s.head_height, 0.55 * s.head_height)),
    ]  # fmt: skip


def _arm(side: str, s: AnatomicalSizes) -> list[_Limb]:
    """An arm; the upper arm lies behind the bone at the shoulder, in front of it at the elbow, and the palm faces the thigh."""
    elbow, fist = f"{side}_elbow", s.forearm_length + s.hand_length - 0.2 * s.hand_width
    bend, wrist = _section(s.elbow_width, 1.16, 0.84), _section(s.wrist_width, 1.16, 0.84)
    return [
        _Limb(f"{side}_upper_arm", f"{side}_shoulder", "down", (0.0, s.upper_arm_length), (_section(s.upper_arm_width, 0.98, 1.02), bend),
              (-0.075 * s.upper_arm_width, 0.05 * s.elbow_width), (0.5 * s.shoulder_thickness, 0.25 * s.elbow_width)),
        _Limb(f"{side}_forearm", elbow, "down", (0.0, s.forearm_length), (_section(s.forearm_width, 0.9, 1.1), wrist),
              caps=(0.25 * s.elbow_width, 0.1 * s.wrist_width)),
        _Limb(f"{side}_hand", elbow, "down", (s.forearm_length, fist), (wrist, _section(s.hand_width, 0.9, 0.42)),
              caps=(0.1 * s.wrist_width, 0.2 * s.hand_width)),
    ]  # fmt: skip


OUT_KNEE, OUT_ANKLE = 0.010, 0.017
"""How far outside the line from knee to ankle the middle of the shank's shape lies, at the knee and at the ankle, as shares of the shank's
length: the tibia lies on the inner side of the leg. The centroid of the shank's volume is 0.7 (men) to 3.1 % (women) outside (Dumas, Cheze
and Verriest 2007, from McConville et al. 1980 and Young et al. 1983), and the ankle's centre 2 mm inside the middle of the malleoli. Within
that, chosen on made recordings."""


def _leg(side: str, s: AnatomicalSizes) -> list[_Limb]:
    """A leg; the thigh lies in front of the bone, the calf behind it and outside, and the toes of the flat foot are turned out."""
    heel, toes, (heel_aside, toes_aside) = 0.45 * s.ankle_height, 0.22 * s.ankle_height, _toe_out(side, s)
    outside = -1.0 if side == "left" else 1.0
    return [
        _Limb(f"{side}_thigh", f"{side}_hip", "down", (0.0, s.thigh_length),
              (_section(s.thigh_width, 1.09, 0.91), _section(s.knee_width, 1.03, 0.97)),
              (0.107 * s.thigh_width, 0.126 * s.knee_width), (0.4 * s.thigh_width, 0.4 * s.knee_width)),
        _Limb(f"{side}_shank", f"{side}_knee", "down", (0.0, s.shank_length),
              (_section(s.calf_width, 1.04, 0.96), _section(s.ankle_width, 1.12, 0.88)),
              (-0.132 * s.calf_width, -0.11 * s.ankle_width), (0.3 * s.calf_width, 0.4 * s.ankle_width),
              (outside * OUT_KNEE * s.shank_length, outside * OUT_ANKLE * s.shank_length)),
        _Limb(f"{side}_foot", f"{side}_ankle", "forward", (HEEL_END * s.foot_length, TOES_END * s.foot_length),
              ((heel, 0.38 * s.foot_width), (toes, 0.48 * s.foot_width)),
              (heel - s.ankle_height, toes - s.ankle_height), (0.09 * s.foot_length, 0.09 * s.foot_length), (-heel_aside, -toes_aside)),
    ]  # fmt: skip


def anatomical(sizes: AnatomicalSizes) -> Body:
    """32 DOF, 18 tapered elliptic limbs. Tapers of arms and legs and their offsets from the bone are fractions of the widths, measured
    on a mesh of a person; the rest of the shape is our own."""
    sides = [limb for limbs in (_arm, _leg) for side in SIDES for limb in limbs(side, sizes)]
    return _body("anatomical", anatomical_skeleton(sizes), [*_trunk(sizes), *sides],
                 _landmarks(sizes, ("chest", sizes.thorax_height)) | _soles(sizes))


TORSO_FORWARD, SOLE_SHARE = 0.1, 0.75
"""Of `cylinders`: how far the torso's axis lies before pelvis and neck, as a share of its depth; how far below the ankle a lower leg ends,
which is foot too, as a share of the ankle's height."""
LEANING: dict[str, Pair] = {"head": (0.2, 0.0), "upper_arm": (0.0, 0.2), "lower_arm": (0.2, -0.4), "upper_leg": (-0.15, 0.0),
                            "lower_leg": (0.25, 0.0)}  # fmt: skip
"""How far before and outside the bone the far ends of the other cylinders lie, as shares of their widths: flesh is not centred on bones, a
lower leg has a foot in front, the fingers of a lower arm curl inward. Chosen on made people, so that the forces move true poses little
(`python -m papers.ni2008 choices` tells by how much)."""


def cylinders(sizes: CylinderSizes) -> Body:
    """25 DOF, ten cylinders with flat ends, the torso's elliptic, the others circular (Ni 2008, II). Each begins at its joint and leans
    away from the bone by `LEANING`."""
    s = sizes
    torso, before = (s.trunk_depth / 2, s.trunk_width / 2), TORSO_FORWARD * s.trunk_depth
    parts = [_Limb("torso", "pelvis", "up", (-s.hip_drop - 0.3 * s.trunk_depth, s.trunk_height), (torso, torso), (before, before))]
    parts += [_tube("head", "head", (0.0, s.neck_length + s.head_height), s.head_width)]
    for side in SIDES:
        parts += [_tube(f"{side}_upper_arm", f"{side}_shoulder", (-0.3 * s.upper_arm_width, s.upper_arm_length), s.upper_arm_width),
                  _tube(f"{side}_lower_arm", f"{side}_elbow", (0.0, s.forearm_length + s.hand_length), s.forearm_width)]
    for side in SIDES:
        parts += [_tube(f"{side}_upper_leg", f"{side}_hip", (0.0, s.thigh_length), s.thigh_width),
                  _tube(f"{side}_lower_leg", f"{side}_knee", (0.0, s.shank_length + SOLE_SHARE * s.ankle_height), s.shank_width)]
    return _body("cylinders", cylinder_skeleton(sizes), parts, _landmarks(sizes, ("pelvis", sizes.trunk_height)))


def _tube(part: str, joint: str, reach: Pair, width: float) -> _Limb:
    """A round cylinder; the y axis of a hanging limb points to the right."""
    side, _, kind = part.partition("_")
    forward, outside = LEANING[kind or part]
    right = -outside if side == "left" else outside
    return _Limb(part, joint, "up" if part == "head" else "down", reach, (_section(width), _section(width)), (0.0, forward * width),
                 aside=(0.0, right * width))
