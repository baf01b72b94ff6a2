"""Names of our joints as the bones of characters in animation programs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from shadowpuppet.errors import SettingsError, choices
from shadowpuppet.motion.animation import Animation

CENTRAL = ("pelvis", "chest", "neck", "head")
SIDED = ("shoulder_base", "shoulder", "elbow", "wrist", "hand", "hip", "knee", "ankle", "heel", "toe")
"""Our joints: a bone begins at its joint, as there. `shoulder_base` is a collar bone; `toe` is the tip of the foot, not its ball."""
MIXAMO = ("LeftShoulder", "LeftArm", "LeftForeArm", "LeftHand", "LeftHandMiddle1", "LeftUpLeg", "LeftLeg", "LeftFoot", "LeftHeel",
          "LeftToe_End")
OF_PROGRAMS: dict[str, tuple[tuple[str, ...], tuple[str, ...], Callable[[str], str]]] = {
    "mixamo": (("mixamorig:Hips", "mixamorig:Spine", "mixamorig:Neck", "mixamorig:Head"), tuple(f"mixamorig:{name}" for name in MIXAMO),
               lambda name: name.replace("Left", "Right")),
    "humanik": (("Hips", "Spine", "Neck", "Head"), MIXAMO, lambda name: name.replace("Left", "Right")),
    "unreal": (("pelvis", "spine_01", "neck_01", "head"),
               ("clavicle_l", "upperarm_l", "lowerarm_l", "hand_l", "middle_01_l", "thigh_l", "calf_l", "foot_l", "heel_l", "toe_l"),
               lambda name: f"{name[:-1]}r"),
    "vrm": (("hips", "spine", "neck", "head"),
            ("leftShoulder", "leftUpperArm", "leftLowerArm", "leftHand", "leftMiddleProximal", "leftUpperLeg", "leftLowerLeg", "leftFoot",
             "leftHeel", "leftToesEnd"), lambda name: name.replace("left", "right")),
}  # fmt: skip
"""By program: names of `CENTRAL` and of the left `SIDED`, and how a right one is made of the left."""


def bone_names(program: str) -> dict[str, str]:
    """A program's names by ours. Raises `SettingsError` if it is not one of `OF_PROGRAMS`."""
    if program not in OF_PROGRAMS:
        raise SettingsError(f"names: found {program!r}, expected one of {choices(OF_PROGRAMS)}")
    central, left, right = OF_PROGRAMS[program]
    found = dict(zip(CENTRAL, central)) | {"torso": central[CENTRAL.index("chest")]}
    found |= {f"left_{ours}": name for ours, name in zip(SIDED, left)}
    return found | {f"right_{ours}": right(name) for ours, name in zip(SIDED, left)}


def with_bone_names(animation: Animation, program: str | None) -> Animation:
    """An animation whose joints have a program's names; None: ours. Other joints keep theirs."""
    if program is None:
        return animation
    names = bone_names(program)
    return replace(animation, names=tuple(names.get(name, name) for name in animation.names))
