"""In what ways a run differs from its truth, beside distance: by axis, in posture alone, in how it moves; and what it lost."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.geometry import Alignment, Array, align, vector_from_rotation
from shadowpuppet.motion.metrics import GROUPS, LOST_ERROR, JointErrors, accelerations, bone_lengths, joint_errors
from shadowpuppet.motion.motion import BLANK, JointTable, Motion

ROOTS = (("pelvis",), ("left_hip", "right_hip"), ("neck",), ("left_shoulder", "right_shoulder"))
"""What joints are told from in root-relative errors: the first that run and truth have, or the middle of two. The pelvis of a run without
legs was not seen, and does not count."""
BENDS = {f"{side}_{joint}": tuple(f"{side}_{name}" for name in chain) for side in ("left", "right")
         for joint, chain in {"elbow": ("shoulder", "elbow", "wrist"), "knee": ("hip", "knee", "ankle")}.items()}
"""Hinges, by the three joints that tell how far they are bent."""
APART, TOGETHER = 0.2, 0.4
"""Mean error, metres, from which on two worlds are thought of, and what share of it may be left after one rigid motion of the whole."""


def axis_errors(errors: JointErrors) -> dict[str, Any]:
    """Signed mean (run less truth), its standard deviation and root mean square along the world's axes, mm, of all joints and each; what is
    lost is left out."""
    def along(delta: Array) -> dict[str, dict[str, float]]:
        known = delta[np.isfinite(delta).all(-1)]
        told = {axis: 1000 * known[:, k] for k, axis in enumerate("xyz")}
        return {axis: {"mean": float(d.mean()), "sd": float(d.std()), "rmse": float(np.sqrt((d**2).mean()))} for axis, d in told.items()}

    seen = np.asarray(np.isfinite(errors.delta).all(2))
    joints = {name: along(errors.delta[:, j]) for j, name in enumerate(errors.names) if seen[:, j].any()}
    return {**along(errors.delta), "joints": joints} if joints else {}


def aligned_distances(errors: JointErrors, run: JointTable, truth: JointTable) -> dict[str, Array]:
    """Distances (T, J), metres, of the same joints after less and less is asked of a run; `metrics.LOST_ERROR` in each where one is lost.

    `none`: as they stand. `whole`: after one rigid motion of the whole run. `frame_offset`: less each frame's mean offset. `root`: from
    the root on (`root_of`), where there is one. `rigid`, `similar`: after the best rigid motion of each frame, and with a scale (the
    PA-MPJPE of the literature); frames of fewer than three joints keep their errors.
    """
    ours, theirs = (table.select(errors.names).positions for table in (run, truth))
    found = {"none": errors.distance, "whole": _distance(whole_alignment(run, truth, errors).apply(ours) - theirs),
             "frame_offset": errors.aligned}
    root = root_of(run, truth)
    if root:
        off = np.mean([run.select([name]).positions - truth.select([name]).positions for name in root], axis=0)
        found["root"] = _distance(errors.delta - off)
    for name, scaled in (("rigid", False), ("similar", True)):
        moved = _distance(align(ours, theirs, scaled).apply(ours) - theirs)
        found[name] = np.where(np.isfinite(moved), moved, errors.distance)
    return {name: np.where(errors.lost | ~np.isfinite(d) & errors.known, LOST_ERROR, d) for name, d in found.items()}


def aligned_errors(errors: JointErrors, run: JointTable, truth: JointTable) -> dict[str, Any]:
    """Mean `aligned_distances`, mm, and the name of the root."""
    means = {name: float(1000 * d[errors.known].mean()) for name, d in aligned_distances(errors, run, truth).items()}
    return means | {"root_joint": " and ".join(root_of(run, truth))}


def root_of(run: JointTable, truth: JointTable) -> tuple[str, ...]:
    """The joints whose middle is the root, of `ROOTS`; none where none is in both."""
    roots = ROOTS if "left_knee" in run.names else ROOTS[2:]
    return next((names for names in roots if {*names} <= {*run.names} & {*truth.names}), ())


def whole_alignment(run: JointTable, truth: JointTable, errors: JointErrors) -> Alignment:
    """The one rigid motion of all frames that brings the run's joints nearest to the truth's."""
    ours, theirs = (table.select(errors.names).positions.reshape(-1, 3) for table in (run, truth))
    return align(ours, theirs)


def worlds(errors: JointErrors, run: JointTable, truth: JointTable) -> dict[str, Any]:
    """How far run and truth are apart as a whole: the mean error (mm) as they stand and after one rigid motion of the whole, which turns
    the run by `rotation_deg` about `axis` and moves its middle by `moved_mm`; `apart` where that makes most of a large error good.

    Empty where no joint is known of both.
    """
    seen = np.isfinite(errors.delta).all(2)
    if seen.sum() < 3:
        return {}
    ours, theirs = (table.select(errors.names).positions for table in (run, truth))
    motion = whole_alignment(run, truth, errors)
    before = np.linalg.norm(errors.delta[seen], axis=1).mean()
    after = np.linalg.norm((motion.apply(ours) - theirs)[seen], axis=1).mean()
    vector = vector_from_rotation(motion.rotation)
    angle = float(np.linalg.norm(vector))
    moved = (motion.apply(ours) - ours)[seen].mean(0)
    return {"mean_mm": float(1000 * before), "aligned_mm": float(1000 * after), "rotation_deg": float(np.degrees(angle)),
            "axis": (vector / angle if angle > 0 else vector).tolist(), "moved_mm": (1000 * moved).tolist(),
            "apart": bool(before > APART and after < TOGETHER * before)}


def humaneva_error(run: JointTable, truth: JointTable) -> dict[str, Any]:
    """HumanEva's error: the mean distance over its 15 joints in each frame, then over the frames, mm, with its standard deviation over them
    (Sigal, Balan and Black 2010); or the joints that are `missing`."""
    names = GROUPS["humaneva"]
    missing = {what: [name for name in names if name not in table.names] for what, table in (("run", run), ("truth", truth))}
    if any(missing.values()):
        return {"missing": missing}
    errors = joint_errors(run, truth, names)
    whole = errors.known.all(1)
    if not whole.any():
        return {"missing": {"run": [], "truth": [name for k, name in enumerate(names) if not errors.known[:, k].any()]}}
    frames = 1000 * errors.distance[whole].mean(1)
    return {"mean_mm": float(frames.mean()), "sd_mm": float(frames.std()), "frames": int(whole.sum())}


def bend_errors(run: JointTable, truth: JointTable) -> dict[str, dict[str, float]]:
    """By how many degrees elbows and knees are bent otherwise, from three joints each: signed mean, mean size and root mean square."""
    found = {}
    for name, chain in BENDS.items():
        if {*chain} <= {*run.names} & {*truth.names}:
            off = np.degrees(_bend(run.select(chain)) - _bend(truth.select(chain)))
            off = off[np.isfinite(off)]
            if len(off):
                found[name] = {"bias": float(off.mean()), "mean": float(np.abs(off).mean()), "rmse": float(np.sqrt((off**2).mean()))}
    return found


def motion_errors(run: JointTable, truth: JointTable) -> dict[str, float]:
    """Root mean square accelerations of run and truth, m/s^2, and the mean size of their difference, over what both have."""
    ours, theirs = accelerations(run), accelerations(truth.select(run.names))
    both = np.isfinite(ours).all(2) & np.isfinite(theirs).all(2)
    if not both.any():
        return {}
    size = {name: float(np.sqrt((a[both] ** 2).sum(1).mean())) for name, a in (("run_m_s2", ours), ("truth_m_s2", theirs))}
    return size | {"difference_m_s2": float(np.linalg.norm((ours - theirs)[both], axis=1).mean())}


def bone_errors(run: JointTable, truth: JointTable) -> dict[str, dict[str, float]]:
    """Length of each bone that both have, mm: mean and standard deviation in run and truth, and by how much the run's is longer."""
    lengths = {what: bone_lengths(table) for what, table in (("run", run), ("truth", truth))}
    found = {}
    for bone, ours in lengths["run"].items():
        theirs = lengths["truth"].get(bone, {"count": 0})
        if ours["count"] and theirs["count"]:
            found[bone] = {"run_mm": 1000 * ours["mean"], "run_sd_mm": 1000 * ours["sd"], "truth_mm": 1000 * theirs["mean"],
                           "truth_sd_mm": 1000 * theirs["sd"], "longer_mm": 1000 * (ours["mean"] - theirs["mean"])}
    return found


def losses(motion: Motion) -> dict[str, Any]:
    """Frames without a pose, lost or absent: how many, what share, in how many gaps; and the longest, which lasts from the frame before it
    to the one after."""
    blank = np.isin(motion.status, BLANK)
    gaps = runs_of(blank)
    said: dict[str, Any] = {"frames": int(blank.sum()), "share": float(blank.mean()) if len(motion) else 0.0, "gaps": len(gaps)}
    if gaps:
        seconds = [float(motion.times[min(end, len(motion) - 1)] - motion.times[max(first - 1, 0)]) for first, end in gaps]
        longest = int(np.argmax(seconds))
        said |= {"longest_frames": gaps[longest][1] - gaps[longest][0], "longest_s": seconds[longest],
                 "longest_from_s": float(motion.times[gaps[longest][0]])}
    return said


def runs_of(true: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and one past last index of each stretch of what is true in (T,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], true, [False]]).astype(int)))
    return [(int(first), int(end)) for first, end in edges.reshape(-1, 2)]


def _bend(table: JointTable) -> Array:
    """Angle (T,), radians, by which the middle of three joints is bent; 0 where they are in line."""
    a, b, c = np.moveaxis(table.positions, 1, 0)
    upper, lower = b - a, c - b
    return np.arctan2(np.linalg.norm(np.cross(upper, lower), axis=1), (upper * lower).sum(1))


def _distance(delta: Array) -> Array:
    return np.linalg.norm(delta, axis=2)
