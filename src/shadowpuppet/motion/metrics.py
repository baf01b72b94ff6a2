"""Quality of a motion: errors against a truth, and figures that need no truth. Metres; summaries are in millimetres."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shadowpuppet.body.skeleton import BONES
from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import ShadowPuppetError, choices
from shadowpuppet.geometry import Array
from shadowpuppet.motion.motion import JointTable, Motion
from shadowpuppet.motion.synchronization import at_common_times, match

UPPER_JOINTS = ("left_shoulder", "left_elbow", "left_hand", "right_shoulder", "right_elbow", "right_hand")
"""Joints compared for a run without legs."""
LIMB_JOINTS = tuple(f"{side}_{joint}" for joint in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle") for side in ("left", "right"))
"""Joints compared for a run with legs."""
GROUPS = {"upper": UPPER_JOINTS, "limbs": LIMB_JOINTS}
"""Named groups of joints."""
LOST_ERROR, FAR_ERROR = 0.5, 0.3
"""Error (m) counted for a missing joint, so that leaving out bad frames never helps; and error (m) from which a joint counts as far
off."""
LEVEL_CAMERA = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""World to camera of a level camera looking along the world's y."""


@dataclass(frozen=True, eq=False)
class JointErrors:
    """Distances between joints and their truth. Joints that the run lacks count as `LOST_ERROR` in every distance."""

    names: tuple[str, ...]
    """Joints compared, J of them."""
    known: NDArray[np.bool_]
    """Whether there is a truth, of shape (T, J)."""
    lost: NDArray[np.bool_]
    """Whether there is a truth but no estimate, of shape (T, J)."""
    distance: Array
    """In space, of shape (T, J), metres."""
    plane: Array
    """Across the camera's optical axis."""
    depth: Array
    """Along the camera's optical axis."""
    aligned: Array
    """In space, after removing each frame's mean offset over the joints."""
    delta: Array
    """Estimate minus truth, of shape (T, J, 3), metres; not a number where either is unknown."""

    def summary(self, across: bool = True) -> dict[str, Any]:
        """Figures in millimetres over all joints and for each: mean, RMSE, percentiles, share far off; with `across` also along and
        across the camera's axis."""
        kinds = ("distance", *(("plane", "depth") if across else ()), "aligned")
        joints = {name: _summary(self._values(kinds, k)) for k, name in enumerate(self.names) if self.known[:, k].any()}
        return {"frames": len(self.known), "lost": int(self.lost.any(1).sum()), **_summary(self._values(kinds)), "joints": joints}

    def _values(self, kinds: Sequence[str], joint: int | None = None) -> dict[str, Array]:
        """Distances of each kind, of one joint or all, in frames with a truth."""
        these = np.arange(len(self.names)) if joint is None else np.array([joint])
        return {kind: getattr(self, kind)[:, these][self.known[:, these]] for kind in kinds}


def joint_errors(run: JointTable, truth: JointTable, joints: Sequence[str] | None = None, *, camera: Camera | None = None,
                 start: int = 0) -> JointErrors:
    """Compare joints with a truth, frame by frame of the truth from `start` on.

    Args:
        joints: names of the joints compared; default: `default_joints`.
        camera: defines plane and depth; default: a level one that looks along the world's y.

    Frames are matched by the nearest time, within half a step of the truth. Raises `ShadowPuppetError` if joints are missing or nothing
    can be compared.
    """
    names = default_joints(run, truth) if joints is None else tuple(joints)
    _check_joints(names, run, truth)
    index, matched = match(run.times, truth.times[start:])
    reference = truth.select(names).positions[start:]
    found = run.select(names).positions[index]
    found[~matched] = np.nan
    known = np.asarray(np.isfinite(reference).all(2))
    if not known.any():
        raise ShadowPuppetError("the truth has no position of any of the joints compared, so there is nothing to compare")
    lost = known & ~np.asarray(np.isfinite(found).all(2))
    delta = found - reference
    across = delta @ (LEVEL_CAMERA if camera is None else camera.T_camera_world[:3, :3]).T
    distances = (np.linalg.norm(delta, axis=2), np.linalg.norm(across[..., :2], axis=2), np.abs(across[..., 2]),
                 np.linalg.norm(delta - _offsets(delta), axis=2))
    return JointErrors(names, known, lost, *(np.where(lost, LOST_ERROR, d) for d in distances), delta=delta)


def default_joints(run: JointTable, truth: JointTable) -> tuple[str, ...]:
    """`LIMB_JOINTS` for a run with legs, else `UPPER_JOINTS`; only joints that both tables have."""
    group = LIMB_JOINTS if any(name.endswith(("_hip", "_knee", "_ankle")) for name in run.names) else UPPER_JOINTS
    return tuple(name for name in group if name in run.names and name in truth.names)


def overlap(model: NDArray[np.bool_], silhouette: NDArray[np.bool_], ignore: NDArray[np.bool_] | None = None) -> float:
    """Intersection over union of two masks (H, W), without the pixels of `ignore`; not a number if both are empty."""
    if ignore is not None:
        model, silhouette = model & ~ignore, silhouette & ~ignore
    union = np.count_nonzero(model | silhouette)
    return np.count_nonzero(model & silhouette) / union if union else np.nan


def statistics(values: ArrayLike) -> dict[str, float]:
    """Count, mean, standard deviation, percentiles and extremes of the finite `values`; only the count if there are none."""
    values = np.asarray(values, float)
    values = values[np.isfinite(values)]
    if not values.size:
        return {"count": 0}
    p5, p50, p95 = np.percentile(values, [5, 50, 95]).tolist()
    return {"count": values.size, "mean": float(values.mean()), "sd": float(values.std()), "min": float(values.min()), "p5": p5,
            "p50": p50, "p95": p95, "max": float(values.max())}


def accelerations(table: JointTable) -> Array:
    """Accelerations (T - 2, J, 3), m/s^2, by second differences: exact for constant ones whatever the time steps."""
    step = np.diff(table.times)[:, None, None]
    speed = np.diff(table.positions, axis=0) / step
    return np.diff(speed, axis=0) / (0.5 * (step[1:] + step[:-1]))


def jitter(table: JointTable) -> float:
    """Root mean square acceleration of joints, m/s^2; not a number without three consecutive known frames. It includes the motion's own
    acceleration and grows with the frame rate: compare it with the truth's, or with another run's of the film."""
    squares = (accelerations(table) ** 2).sum(2)
    squares = squares[np.isfinite(squares)]
    return float(np.sqrt(squares.mean())) if squares.size else np.nan


def bone_lengths(table: JointTable) -> dict[str, dict[str, float]]:
    """`statistics` of the length (m) of every limb bone in the table, by `<joint>-<joint>`. A skeleton's are constant, measured ones are
    not."""
    bones = [(a, b) for a, b in BONES if a.split("_")[0] == b.split("_")[0] and a in table.names and b in table.names]
    ends = {name: table.positions[:, i] for i, name in enumerate(table.names)}
    return {f"{a}-{b}": statistics(np.linalg.norm(ends[a] - ends[b], axis=1)) for a, b in bones}


def evaluate(motion: Motion, truth: JointTable | None = None, joints: Sequence[str] | None = None, *,
             camera: Camera | None = None, start: int = 0, cameras: int = 1) -> dict[str, Any]:
    """All metrics of a motion, for metrics.json; see `joint_errors` for the arguments. Run and truth are compared at common times
    (`synchronization.at_common_times`), whatever their rates. With several `cameras` costs are m^2, and no errors along or across one
    camera's axis are given."""
    run = motion.table
    if truth is not None and len(motion):
        run, truth = at_common_times(run, JointTable(truth.times[start:], truth.names, truth.positions[start:]))
    errors = None if truth is None else joint_errors(run, truth, joints, camera=camera)
    names = errors.names if errors else joints or default_joints(run, run)
    figures: dict[str, Any] = {"cameras": cameras, "frames": len(motion), "status": motion.status_counts,
                            "limb_status": motion.limb_status_counts, "overlap": statistics(motion.overlap),
                            "cost_px" if cameras == 1 else "cost_m2": statistics(motion.cost),
                            "jitter_m_s2": jitter(run.select(names)), "bones_m": bone_lengths(motion.table)}
    if truth is not None and errors is not None:
        figures |= {"truth_jitter_m_s2": jitter(truth.select(names)), "errors": errors.summary(across=cameras == 1)}
    return figures


def _check_joints(names: tuple[str, ...], run: JointTable, truth: JointTable) -> None:
    for what, table in (("run", run), ("truth", truth)):
        missing = [name for name in names if name not in table.names]
        if missing or not names:
            found = missing[0] if missing else "none to compare"
            raise ShadowPuppetError(f"joints: found {found!r}, which the {what} lacks; the run has {choices(run.names)}; "
                                    f"the truth has {choices(truth.names)}")
    if not len(run.times):
        raise ShadowPuppetError("the run has no frames, so there is nothing to compare")


def _offsets(delta: Array) -> Array:
    """Each frame's mean difference (T, 1, 3) over the known joints."""
    known = np.isfinite(delta).all(2, keepdims=True)
    return np.where(known, delta, 0).sum(1, keepdims=True) / np.maximum(known.sum(1, keepdims=True), 1)


def _summary(values: dict[str, Array]) -> dict[str, float]:
    """Figures of distances (metres) in millimetres."""
    d = values["distance"] * 1000
    p50, p90, p95 = np.percentile(d, [50, 90, 95]).tolist()
    return {"mean_mm": float(d.mean()), "rmse_mm": float(np.sqrt((d**2).mean())), "p50_mm": p50, "p90_mm": p90, "p95_mm": p95,
            "max_mm": float(d.max()), "far": float((d > 1000 * FAR_ERROR).mean()),
            **{f"{key}_mm": float(values[kind].mean() * 1000)
               for key, kind in (("plane", "plane"), ("depth", "depth"), ("aligned_mean", "aligned")) if kind in values}}
