"""Deviations of a smoothed motion: what is wrong in a frame is wrong in its neighbours, whose evidence tells more together than alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from shadowpuppet.geometry import Array
from shadowpuppet.motion.interpolation import sums_about
from shadowpuppet.motion.motion import Motion
from shadowpuppet.tracking.doubt.limbs import beyond

REACH = 0.5
"""Time (s) before and after a frame from which its deviation is taken: of 0, 0.25, 0.5, 1 and 2 s the one with the fewest good arms
doubted where equally few that are wrong are vouched for (films of several cameras left out)."""


def moving_deviations(times: Array, sd: Array) -> Array:
    """Root mean squares (T, ...) of the known ones of deviations (T, ...) within `REACH` of each frame at `times` (T,), seconds; what is
    not a number stays so."""
    known = np.isfinite(sd)
    means = sums_about(times, np.where(known, sd, 0.0) ** 2, REACH) / np.maximum(sums_about(times, known, REACH), 1)
    return np.where(known, np.sqrt(np.maximum(means, 0.0)), np.nan)


def restated(motion: Motion, limits: Mapping[str, float]) -> Motion:
    """A motion with `moving_deviations`. In frames that are `tracked` each limb is, too, but `uncertain` if it is `beyond` the `limits`;
    what was `predicted` stays so."""
    joint_sd, pose_sd = (moving_deviations(motion.times, each) for each in (motion.joint_sd, motion.pose_sd))
    judged = np.where(beyond(limits, motion.joint_names, joint_sd), "uncertain", "tracked")
    kept = (motion.status != "tracked")[:, None] | (motion.limb_status == "predicted")
    return replace(motion, joint_sd=joint_sd, pose_sd=pose_sd, limb_status=np.where(kept, motion.limb_status, judged))
