"""A run measured after it was made."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any
from warnings import warn

import numpy as np

from shadowpuppet.camera import Camera
from shadowpuppet.errors import ShadowPuppetError, ShadowPuppetWarning
from shadowpuppet.geometry import Array
from shadowpuppet.inverse_kinematics import fit_poses
from shadowpuppet.io.calibration import read_calibration
from shadowpuppet.io.joints import read_joints
from shadowpuppet.io.run import read_run
from shadowpuppet.metrics import GROUPS, evaluate, match
from shadowpuppet.motion import JointTable, Motion
from shadowpuppet.skeleton import Skeleton


def evaluate_run(folder: str | Path, truth: str | Path | None = None, joints: Sequence[str] | None = None,
                 start: int = 0, angles: bool = False) -> dict[str, Any]:
    """`metrics.evaluate` of a run folder, against `truth` or that of its recording, where there is one.

    `joints`: those compared, or names of `metrics.GROUPS`; `start`: the truth's first frame that counts. Plane and depth are those of
    the run's camera. `angles`: compare the angles of a whole body's joints, too (`angle_errors`).
    Raises `FormatError` or `ShadowPuppetError` for files that cannot be used.
    """
    run = read_run(folder)
    table = truth if truth is not None else _known_truth(run.info.get("truth"))
    reference = None if table is None else read_joints(table)
    if reference is not None and not 0 <= start < len(reference.times):
        raise ShadowPuppetError(f"start: found {start}, expected 0 to {len(reference.times) - 1}, a frame of {table}")
    chosen = None if joints is None else [name for joint in joints for name in GROUPS.get(joint, (joint,))]
    cameras = _cameras(run.folder)
    measured = evaluate(run.motion, reference, chosen, camera=cameras[0] if len(cameras) == 1 else None, start=start,
                        cameras=max(len(cameras), 1))  # fmt: skip
    if angles:
        if reference is None:
            raise ShadowPuppetError(f"{folder}: angles: found no truth to compare with, expected one as TRUTH")
        measured["angles_deg"] = angle_errors(run.motion, reference, start)
    return {"run": str(folder), "truth": None if table is None else str(table), "complete": run.complete, **measured}


def angle_errors(motion: Motion, truth: JointTable, start: int = 0) -> dict[str, float]:
    """By what angle each joint of a whole body is turned otherwise than in the poses that fit the truth best: root mean square, degrees,
    by joint, and of `all`.

    One angle a joint, of the whole turn between the two (Ni 2008, Fig. 7, has one an axis); how a straight limb is turned about itself,
    which joints do not show, is in it. Heads and ankles are left out, of whose turns the places of joints tell little or nothing; so are
    frames without a pose. Raises `ShadowPuppetError` for another body, or joints that are no whole person's.
    """
    fitted = fit_poses(truth, motion.body_name, source="truth")
    index, matched = match(motion.times, truth.times[start:])
    ours, theirs = motion.poses[index], fitted.poses[start:]
    known = matched & np.isfinite(ours).all(1) & np.isfinite(theirs).all(1)
    if not known.any():
        raise ShadowPuppetError("angles: found no frame in which both the run and the truth have all joints")
    skeleton = fitted.body.skeleton
    turns = [_own_turns(skeleton, poses[known]) for poses in (ours, theirs)]
    told = [j for j, joint in enumerate(skeleton.joints) if not joint.name.endswith(("head", "_ankle"))]
    cosine = (np.einsum("njab,njab->nj", *turns)[:, told] - 1) / 2
    squares = np.degrees(np.arccos(np.clip(cosine, -1, 1))) ** 2
    by_joint = dict(zip((skeleton.joints[j].name for j in told), np.sqrt(squares.mean(0)).tolist(), strict=True))
    return by_joint | {"all": float(np.sqrt(squares.mean()))}


def _own_turns(skeleton: Skeleton, poses: Array) -> Array:
    """Rotations (N, J, 3, 3) of joints against those that they hang on."""
    world = skeleton.forward(poses)[..., :3]
    above = [skeleton.joint_index(joint.parent) if joint.parent else None for joint in skeleton.joints]
    return np.stack([world[:, j] if k is None else world[:, k].swapaxes(1, 2) @ world[:, j] for j, k in enumerate(above)], axis=1)


def _known_truth(path: object) -> str | None:
    if isinstance(path, str) and not Path(path).exists():
        warn(f"{path}: the recording's truth is not there any more; give it as TRUTH", ShadowPuppetWarning, stacklevel=3)
        return None
    return path if isinstance(path, str) else None


def _cameras(folder: Path) -> Sequence[Camera]:
    """The run's cameras; none where they are not known, and one is taken for level."""
    path = folder / "calibration.toml"
    return read_calibration(path) if path.exists() else []
