"""Skeletons of the whole person: the 25 DOF of Ni 2008 (II), or 32 with a joint in the chest and ankles.

A person at zero stands upright in the world's frame and looks along +X, arms and legs straight down; left is +Y, up is +Z. Elbows and
knees bend by positive angles.
"""

from __future__ import annotations

import numpy as np

from shadowpuppet.body.skeleton import Dof, Joint, Skeleton
from shadowpuppet.body.whole_sizes import AnatomicalSizes, BoneSizes, CylinderSizes

SIDES = ("left", "right")
Bounds = tuple[float, float]
Three = tuple[float, float, float]
FREE = (-np.inf, np.inf)
GLOBAL = ("root_x", "root_y", "root_z", "root_heading")
"""Degrees of freedom that say where a person is and whither they look, which no prior of articulation models."""
SWING = {"left": ("-y", "x", "z"), "right": ("-y", "-x", "-z")}
"""Axes about which a hanging limb swings forward, swings outward, and twists outward."""


def _dof(name: str, joint: str, axis: str, limits: Bounds, rest: float = 0.0, spread: Bounds = FREE, kind: str = "rotation") -> Dof:
    """A degree of freedom; angles in degrees."""
    below, above = np.abs(np.radians(spread)).tolist()
    return Dof(name, joint, axis, *np.radians(limits).tolist(), kind=kind,  # pyright: ignore[reportArgumentType]
               rest=float(np.radians(rest)), spread=(below, above))  # fmt: skip


def _ball(joint: str, limits: tuple[Bounds, Bounds, Bounds], rest: Three,
          spread: tuple[float | Bounds, float | Bounds, float | Bounds]) -> list[Dof]:
    """The rotation vector of a ball joint, degrees; a spread may differ below and above the rest."""
    return [_dof(f"{joint}_{axis}", joint, axis, within, usual, wide if isinstance(wide, tuple) else (-wide, wide), "vector")
            for axis, within, usual, wide in zip("xyz", limits, rest, spread)]


def _sided(side: str, limits: tuple[Bounds, Bounds, Bounds], rest: Three, spread: Three) -> tuple:
    """What `_ball` wants, for a side, from what the left one has: about x and z the right one's is its mirror's."""
    (x, y, z), (a, b, c) = limits, rest
    return (limits, rest, spread) if side == "left" else (((-x[1], -x[0]), y, (-z[1], -z[0])), (-a, b, -c), spread)


def _angles(joint: str, axes: tuple[str, str, str], names: tuple[str, str, str], limits: tuple[Bounds, Bounds, Bounds],
            rest: Three, spread: Three) -> list[Dof]:
    """Three turns one after another, degrees: about Y, then X, then Z."""
    return [_dof(f"{joint}_{name}", joint, axis, within, usual, (-wide, wide))
            for axis, name, within, usual, wide in zip(axes, names, limits, rest, spread)]


def _root() -> list[Dof]:
    """The pelvis in the world: place; heading, then bow (positive forward), then tilt (positive to the right)."""
    places = [_dof(f"root_{axis}", "pelvis", axis, FREE, kind="translation") for axis in "xyz"]
    return [*places, _dof("root_heading", "pelvis", "z", FREE), _dof("root_bow", "pelvis", "y", (-100, 130), spread=(5, 10)),
            _dof("root_tilt", "pelvis", "x", (-80, 80), spread=(8, 8))]  # fmt: skip


def _places(side: str, s: BoneSizes) -> tuple[Three, Three]:
    """Where a side's shoulder lies from the base of the neck, and its hip from the pelvis."""
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
    """The 25 DOF of Ni 2008 (II): the torso 6; head, upper arms and upper legs 3 each, as angles about Y, X, Z; lower arms and legs 1 each.

    Where a limb is level to the side (abduction 90 degrees) flexion and twist are one and the same; angles stay unwrapped.
    """
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
