"""Reads animated skeletons from BVH and ASF/AMC files, with the files' joint names, bones and rotations."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from shadowpuppet.errors import FormatError, choices
from shadowpuppet.geometry import Array
from shadowpuppet.io.files.text import errors_named
from shadowpuppet.io.motion.amc import Z_UP, Capture, read_mocap
from shadowpuppet.io.motion.bvh import END, Bvh, read_bvh, unique_names
from shadowpuppet.io.motion.joint_names import columns_of
from shadowpuppet.io.motion.motion_files import AMC_RATE, named, rotation_to_z_up, unit_of
from shadowpuppet.motion.animation import Y_UP, Animation

ENDINGS = (".amc", ".bvh")
CMU = {"root": "Hips", "lowerback": "LowerBack", "upperback": "Spine", "thorax": "Spine1", "lowerneck": "Neck", "upperneck": "Neck1",
       "head": "Head", **{f"{side[0].lower()}{bone}": f"{side}{name}" for side in ("Left", "Right") for bone, name in (
           ("hipjoint", "HipJoint"), ("femur", "UpLeg"), ("tibia", "Leg"), ("foot", "Foot"), ("toes", "ToeBase"), ("clavicle", "Shoulder"),
           ("humerus", "Arm"), ("radius", "ForeArm"), ("wrist", "ForeArmTwist"), ("hand", "Hand"), ("fingers", "FingerBase"),
           ("thumb", "Thumb"))}}  # fmt: skip
"""Names, as in BVH files, of the joints at which bones of the CMU database begin; wrists and fingers as in `amc.ENDS`."""


def read_animation(path: str | Path, rate: float | None = None, unit: float | None = None,
                   names: Mapping[str, str] | None = None) -> Animation:
    """The animated skeleton of a .bvh file, or of an .amc file with its .asf in the same folder, in metres, Z up.

    `rate`, `unit`, `names` and warnings are as in `read_motion`; joints keep the file's names. Raises `FormatError`.
    """
    path = Path(path)
    if path.suffix.lower() not in ENDINGS:
        raise FormatError(f"{path}: found the ending {path.suffix!r}, expected one of {choices(ENDINGS)}")
    with errors_named(path):
        if path.suffix.lower() == ".amc":
            return _of_capture(read_mocap(path), rate or AMC_RATE)
        return _of_bvh(read_bvh(path), unit, names)


def _of_bvh(bvh: Bvh, unit: float | None, given: Mapping[str, str] | None) -> Animation:
    table = named(bvh.path, bvh.joints(), given)
    scale, up = unit_of(bvh.path, table) if unit is None else unit, rotation_to_z_up(bvh.path, table)
    if not columns_of(table.names) and not _is_z_up(bvh):
        up = Z_UP
    turns, shifts = bvh.local_transforms()
    above = {node.parent for node in bvh.nodes}
    tips = [n for n, node in enumerate(bvh.nodes) if n and n not in above and not node.channels and node.name.endswith(END)]
    kept = [n for n in range(len(bvh.nodes)) if n not in tips]
    place = {n: k for k, n in enumerate(kept)}
    rest = Y_UP @ up  # from the file's axes to those of `Animation` at rest
    offsets = np.array([bvh.nodes[n].offset if n else np.zeros(3) for n in kept]) * scale @ rest.T
    ends = {place[bvh.nodes[n].parent]: _three(rest @ bvh.nodes[n].offset * scale) for n in tips}
    rotations, moved = rest @ turns[:, kept] @ rest.T, shifts[:, kept] * scale @ rest.T
    rotations[:, 0], moved[:, 0] = up @ turns[:, 0] @ rest.T, shifts[:, 0] * scale @ up.T
    names = unique_names([bvh.nodes[n].name for n in kept])
    parents = tuple(place.get(bvh.nodes[n].parent, -1) for n in kept)
    return Animation(names, parents, offsets, ends, table.times, rotations, moved)


def _is_z_up(bvh: Bvh) -> bool:
    """Whether the skeleton is taller along Z than along Y in the zero pose."""
    places = np.array([node.offset for node in bvh.nodes], float)
    for n, node in enumerate(bvh.nodes):
        places[n] = places[node.parent] + node.offset if node.parent >= 0 else np.zeros(3)
    _, y, z = np.ptp(places, axis=0)
    return bool(z > y)


def _of_capture(capture: Capture, rate: float) -> Animation:
    """An animation with a joint at the beginning of each bone, which is its parent's end."""
    bones = capture.skeleton.bones
    along = np.array([bone.direction * bone.length for bone in bones])
    parents = (-1, *(bone.parent + 1 for bone in bones))
    offsets = np.array([np.zeros(3), *(along[bone.parent] if bone.parent >= 0 else np.zeros(3) for bone in bones)])
    T, world = len(capture.root), capture.rotations
    rotations, shifts = np.empty((T, len(parents), 3, 3)), np.tile(offsets, (T, 1, 1))
    rotations[:, 0], shifts[:, 0] = Z_UP @ capture.root_rotation, capture.root @ Z_UP.T
    for n, bone in enumerate(bones):
        above = capture.root_rotation if bone.parent < 0 else world[:, bone.parent]
        rotations[:, n + 1] = np.swapaxes(above, 1, 2) @ world[:, n]
    leaves = set(range(len(bones))) - {bone.parent for bone in bones}
    ends = {n + 1: _three(along[n]) for n in sorted(leaves)}
    names = ("Hips", *(CMU.get(bone.name, bone.name) for bone in bones))
    return Animation(names, parents, offsets, ends, np.arange(T) / rate, rotations, shifts)


def _three(place: Array) -> tuple[float, float, float]:
    x, y, z = place.tolist()
    return x, y, z
