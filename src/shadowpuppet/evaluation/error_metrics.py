"""Error metrics other than joint distance: by axis, after alignment, of hinges, accelerations and bones; and frames without a pose."""

from __future__ import annotations

from typing import Any

import numpy as np

from shadowpuppet.body.skeleton import SIDES
from shadowpuppet.geometry import Alignment, Array, align, vector_from_rotation
from shadowpuppet.motion.interpolation import true_runs
from shadowpuppet.motion.metrics import LOST_ERROR, JointErrors, accelerations, bone_lengths
from shadowpuppet.motion.motion import BLANK, JointTable, Motion

ROOT_JOINTS = (("pelvis",), ("left_hip", "right_hip"), ("neck",), ("left_shoulder", "right_shoulder"))
"""Roots for root-relative errors, a joint or the middle of two; the first in both run and truth is used. Runs without legs have no observed
pelvis."""
HINGES = {f"{side}_{joint}": tuple(f"{side}_{name}" for name in chain) for side in ("left", "right")
         for joint, chain in {"elbow": ("shoulder", "elbow", "wrist"), "knee": ("hip", "knee", "ankle")}.items()}
"""The three joints that define the angle of each hinge."""
MISALIGNED_ERROR, MISALIGNED_SHARE = 0.1, 0.4
"""Run and truth seem to be in two worlds above this mean error, metres, if one rigid motion leaves less than this share of it."""


def axis_errors(errors: JointErrors) -> dict[str, Any]:
    """Mean, standard deviation and root mean square of run minus truth along the world's axes, mm, of all joints and each; without lost
    joints."""
    def along(delta: Array) -> dict[str, dict[str, float]]:
        known = delta[np.isfinite(delta).all(-1)]
        axes = {axis: 1000 * known[:, k] for k, axis in enumerate("xyz")}
        return {axis: {"mean": float(d.mean()), "sd": float(d.std()), "rmse": float(np.sqrt((d**2).mean()))} for axis, d in axes.items()}

    known = np.asarray(np.isfinite(errors.delta).all(2))
    joints = {name: along(errors.delta[:, j]) for j, name in enumerate(errors.names) if known[:, j].any()}
    return {**along(errors.delta), "joints": joints} if joints else {}


def aligned_distances(errors: JointErrors, run: JointTable, truth: JointTable) -> dict[str, Array]:
    """Joint errors (T, J), metres, after several alignments of the run to the truth; `metrics.LOST_ERROR` for lost joints.

    `none`: as they are. `whole`: after one rigid motion of the whole run. `frame_offset`: without each frame's mean offset. `root`:
    relative to the root (`root_joints`), if there is one. `rigid`, `similar`: after the best rigid motion of each frame, and with a scale
    (PA-MPJPE in the literature); frames of fewer than three joints keep their errors.
    """
    ours, theirs = (table.select(errors.names).positions for table in (run, truth))
    found = {"none": errors.distance, "whole": _distance(whole_alignment(run, truth, errors).apply(ours) - theirs),
             "frame_offset": errors.aligned}
    root = root_joints(run, truth)
    if root:
        off = np.mean([run.select([name]).positions - truth.select([name]).positions for name in root], axis=0)
        found["root"] = _distance(errors.delta - off)
    for name, scaled in (("rigid", False), ("similar", True)):
        moved = _distance(align(ours, theirs, scaled).apply(ours) - theirs)
        found[name] = np.where(np.isfinite(moved), moved, errors.distance)
    return {name: np.where(errors.lost | ~np.isfinite(d) & errors.known, LOST_ERROR, d) for name, d in found.items()}


def aligned_errors(errors: JointErrors, run: JointTable, truth: JointTable) -> dict[str, Any]:
    """Means of `aligned_distances`, mm, and the name of the root."""
    means = {name: float(1000 * d[errors.known].mean()) for name, d in aligned_distances(errors, run, truth).items()}
    return means | {"root_joint": " and ".join(root_joints(run, truth))}


def root_joints(run: JointTable, truth: JointTable) -> tuple[str, ...]:
    """The joints whose middle is the root: the first of `ROOT_JOINTS` that is in both tables, else none."""
    roots = ROOT_JOINTS if "left_knee" in run.names else ROOT_JOINTS[2:]
    return next((names for names in roots if {*names} <= {*run.names} & {*truth.names}), ())


def whole_alignment(run: JointTable, truth: JointTable, errors: JointErrors) -> Alignment:
    """The one rigid motion of all frames that brings the run's joints closest to the truth's."""
    ours, theirs = (table.select(errors.names).positions.reshape(-1, 3) for table in (run, truth))
    return align(ours, theirs)


def world_difference(errors: JointErrors, run: JointTable, truth: JointTable) -> dict[str, Any]:
    """Mean error (mm) before and after one rigid motion of the whole run, its rotation about `axis`, and the shift of the middle.

    `apart`: whether it removes most of a large error. Empty if fewer than three joints are known in both.
    """
    known = np.isfinite(errors.delta).all(2)
    if known.sum() < 3:
        return {}
    ours, theirs = (table.select(errors.names).positions for table in (run, truth))
    motion = whole_alignment(run, truth, errors)
    before = np.linalg.norm(errors.delta[known], axis=1).mean()
    after = np.linalg.norm((motion.apply(ours) - theirs)[known], axis=1).mean()
    vector = vector_from_rotation(motion.rotation)
    angle = float(np.linalg.norm(vector))
    moved = (motion.apply(ours) - ours)[known].mean(0)
    return {"mean_mm": float(1000 * before), "aligned_mm": float(1000 * after), "rotation_deg": float(np.degrees(angle)),
            "axis": (vector / angle if angle > 0 else vector).tolist(), "moved_mm": (1000 * moved).tolist(),
            "apart": bool(before > MISALIGNED_ERROR and after < MISALIGNED_SHARE * before)}


def hinge_errors(run: JointTable, truth: JointTable) -> dict[str, dict[str, float]]:
    """Errors of the angles of elbows and knees, degrees: mean, mean absolute value and root mean square;
    `aligned`: that without the mean."""
    return {name: angle_errors(ours - theirs) for name, (ours, theirs) in hinge_angles(run, truth).items()}


def angle_errors(off: Array) -> dict[str, float]:
    """Errors (N,) of an angle: mean, mean absolute value, root mean square, and that without the mean."""
    return {"bias": float(off.mean()), "mean": float(np.abs(off).mean()), "rmse": float(np.sqrt((off**2).mean())),
            "aligned": float(off.std())}


def hinge_angles(run: JointTable, truth: JointTable) -> dict[str, Array]:
    """Bends of elbows and knees in run and truth, degrees, each (2, N), in the frames in which both are known."""
    found = {}
    for name, chain in HINGES.items():
        if {*chain} <= {*run.names} & {*truth.names}:
            both = np.degrees([_bend(table.select(chain)) for table in (run, truth)])
            known = np.isfinite(both).all(0)
            if known.any():
                found[name] = both[:, known]
    return found


def acceleration_errors(run: JointTable, truth: JointTable) -> dict[str, float]:
    """Root mean square accelerations of run and truth, and the mean length of their difference, m/s^2, where both are known."""
    ours, theirs = accelerations(run), accelerations(truth.select(run.names))
    both = np.isfinite(ours).all(2) & np.isfinite(theirs).all(2)
    if not both.any():
        return {}
    size = {name: float(np.sqrt((a[both] ** 2).sum(1).mean())) for name, a in (("run_m_s2", ours), ("truth_m_s2", theirs))}
    return size | {"difference_m_s2": float(np.linalg.norm((ours - theirs)[both], axis=1).mean())}


def bone_errors(run: JointTable, truth: JointTable) -> dict[str, dict[str, float]]:
    """Lengths of bones in run and truth, mm: means, standard deviations, and difference of the means."""
    lengths = {what: bone_lengths(table) for what, table in (("run", run), ("truth", truth))}
    found = {}
    for bone, ours in lengths["run"].items():
        theirs = lengths["truth"].get(bone, {"count": 0})
        if ours["count"] and theirs["count"]:
            found[bone] = {"run_mm": 1000 * ours["mean"], "run_sd_mm": 1000 * ours["sd"], "truth_mm": 1000 * theirs["mean"],
                           "truth_sd_mm": 1000 * theirs["sd"], "longer_mm": 1000 * (ours["mean"] - theirs["mean"])}
    return found


def pose_losses(motion: Motion) -> dict[str, Any]:
    """Frames without a pose, lost or absent: their number and share, the number of gaps, and the longest gap, measured from the frame
    before it to the one after."""
    blank = np.isin(motion.status, BLANK)
    gaps = true_runs(blank)
    found: dict[str, Any] = {"frames": int(blank.sum()), "share": float(blank.mean()) if len(motion) else 0.0, "gaps": len(gaps)}
    if gaps:
        seconds = [float(motion.times[min(end, len(motion) - 1)] - motion.times[max(first - 1, 0)]) for first, end in gaps]
        longest = int(np.argmax(seconds))
        found |= {"longest_frames": gaps[longest][1] - gaps[longest][0], "longest_s": seconds[longest],
                 "longest_from_s": float(motion.times[gaps[longest][0]])}
    return found


def _bend(table: JointTable) -> Array:
    """Angle (T,), radians, at the middle of three joints; 0 if they are in line."""
    a, b, c = np.moveaxis(table.positions, 1, 0)
    upper, lower = b - a, c - b
    return np.arctan2(np.linalg.norm(np.cross(upper, lower), axis=1), (upper * lower).sum(1))


def _distance(delta: Array) -> Array:
    return np.linalg.norm(delta, axis=2)


PAIRS = {"arms": ("elbow", "wrist", "hand"), "legs": ("knee", "ankle")}
"""Joints of each pair of limbs; of three known ones the first two are compared."""


def exchanges(run: JointTable, truth: JointTable) -> dict[str, Any] | None:
    """For arms and legs, from tables at the same times (T,): number and share of the frames in which a limb's joints are, in sum, nearer to
    the other side's truth, and the longest time (s) that this lasts. None if no pair of limbs is known."""
    found = {}
    for pair, joints in PAIRS.items():
        both = [joint for joint in joints if {f"{side}_{joint}" for side in SIDES} <= {*run.names} & {*truth.names}][:2]
        if not both:
            continue
        own, other = (sum(_sides_distance(run, truth, name, turned) for name in both) for turned in (False, True))
        known = np.isfinite(own) & np.isfinite(other)
        if known.any():
            wrong = known & (np.asarray(other) < np.asarray(own))
            step = float(np.median(np.diff(run.times))) if len(run.times) > 1 else 0.0
            longest = max((end - begin for begin, end in true_runs(wrong)), default=0)
            found[pair] = {"frames": int(wrong.sum()), "share": float(wrong[known].mean()), "longest_s": round(longest * step, 3)}
    return found or None


def _sides_distance(run: JointTable, truth: JointTable, joint: str, turned: bool) -> Array:
    """Sum (T,) of the distances of both sides' joints from the truth's, or from those of the other side."""
    ours = run.select([f"{side}_{joint}" for side in SIDES]).positions
    theirs = truth.select([f"{side}_{joint}" for side in (SIDES[::-1] if turned else SIDES)]).positions
    return np.linalg.norm(ours - theirs, axis=2).sum(1)
