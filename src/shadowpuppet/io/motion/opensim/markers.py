"""Names of joints as in Pose2Sim's marker sets, with which OpenSim's settings for it work."""

from __future__ import annotations

from dataclasses import replace

from shadowpuppet.motion.animation import Y_UP
from shadowpuppet.motion.motion import JointTable

MARKERS = {
    "pelvis": "Hip", "neck": "Neck", "head": "HeadBase", "crown": "Head", "nose": "Nose",
    **{f"{side}_{joint}": f"{side[0].upper()}{name}" for side in ("left", "right") for joint, name in (
        ("shoulder", "Shoulder"), ("elbow", "Elbow"), ("wrist", "Wrist"), ("hand", "Middle1"), ("hip", "Hip"), ("knee", "Knee"),
        ("ankle", "Ankle"), ("heel", "Heel"), ("toe", "BigToe"))},
}  # fmt: skip
"""Marker names of our joints: those of HALPE_26, Pose2Sim's default. `Head` is the crown there, so the base of the skull has another name;
hands have the name of Pose2Sim's COCO_133_WRIST."""


def marker_names(table: JointTable) -> JointTable:
    """The table with names of `MARKERS`, rotated so that Y is up, (x, z, -y); joints without such a name keep theirs."""
    return replace(table, names=tuple(MARKERS.get(name, name) for name in table.names), positions=table.positions @ Y_UP.T)
