"""Left taken for right: frames in which exchanging two limbs would bring them nearer to the truth."""

from __future__ import annotations

from typing import Any

import numpy as np

from shadowpuppet.body.skeleton import SIDES
from shadowpuppet.geometry import Array
from shadowpuppet.motion.interpolation import true_runs
from shadowpuppet.motion.motion import JointTable

PAIRS = {"arms": ("elbow", "wrist", "hand"), "legs": ("knee", "ankle")}
"""Joints of each pair of limbs; of three known ones the first two are compared."""
COMPARED = 2


def exchanges(run: JointTable, truth: JointTable) -> dict[str, Any] | None:
    """For arms and legs, from tables at the same times (T,): number and share of the frames in which a limb's joints are, in sum, nearer to
    the other side's truth, and the longest time (s) that this lasts. None if no pair of limbs is known."""
    found = {}
    for pair, joints in PAIRS.items():
        both = [joint for joint in joints if {f"{side}_{joint}" for side in SIDES} <= {*run.names} & {*truth.names}][:COMPARED]
        if not both:
            continue
        own, other = (sum(_distance(run, truth, name, turned) for name in both) for turned in (False, True))
        known = np.isfinite(own) & np.isfinite(other)
        if known.any():
            wrong = known & (np.asarray(other) < np.asarray(own))
            step = float(np.median(np.diff(run.times))) if len(run.times) > 1 else 0.0
            longest = max((end - begin for begin, end in true_runs(wrong)), default=0)
            found[pair] = {"frames": int(wrong.sum()), "share": float(wrong[known].mean()), "longest_s": round(longest * step, 3)}
    return found or None


def _distance(run: JointTable, truth: JointTable, joint: str, turned: bool) -> Array:
    """Sum (T,) of the distances of both sides' joints from the truth's, or from those of the other side."""
    ours = run.select([f"{side}_{joint}" for side in SIDES]).positions
    theirs = truth.select([f"{side}_{joint}" for side in (SIDES[::-1] if turned else SIDES)]).positions
    return np.linalg.norm(ours - theirs, axis=2).sum(1)
