"""Errors of a run: joints in millimetres, angles in degrees, and whether the person was lost."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from papers.ni2008.inputs import Case
from papers.ni2008.tracks import Track
from shadowpuppet.body.skeleton import SIDES
from shadowpuppet.geometry import Array
from shadowpuppet.motion.metrics import LIMB_JOINTS, joint_errors
from shadowpuppet.motion.motion import JointTable

FAR, OFTEN = 0.2, 0.1
"""The person is lost in a frame whose joints are this far off on average (m); a sequence is lost with such a share of its frames."""
ANGLES = tuple(f"{side}_{name}" for name in ("shoulder_flexion", "shoulder_abduction", "shoulder_twist", "elbow_flexion", "hip_flexion",
               "hip_abduction", "hip_twist", "knee_flexion") for side in ("left", "right"))  # fmt: skip
"""Joint angles that are compared: all of arms and legs."""


class Errors(NamedTuple):
    """Of one run."""

    rmse: float
    """Of both shoulders, elbows, wrists, hips, knees and ankles over all frames, mm."""
    by_frame: Array
    """The same in each frame, of shape (T,), mm; not a number where the truth is not known."""
    angles: float
    """Root mean square difference of the angles of arms and legs, degrees."""
    firm: float
    """The same without the turn of upper arms and thighs about themselves, which the places of joints tell badly."""
    off: float
    """Share of the frames in which the person is lost."""
    exchanged: float = 0.0
    """Share of the frames in which the legs are nearer to each other's places than to their own."""

    @property
    def lost(self) -> bool:
        """Whether the sequence is."""
        return self.off > OFTEN


def errors(case: Case, track: Track) -> Errors:
    """A run beside the truth."""
    joints = track.joints(case)
    distance = joint_errors(joints, case.truth, LIMB_JOINTS).distance
    known = np.isfinite(distance).all(1)
    by_frame = np.where(known, np.sqrt((distance**2).mean(1)), np.nan)
    angles = angle_differences(case, track)
    firm = [n for n, name in enumerate(ANGLES) if not name.endswith("twist")]
    return Errors(1000 * _rms(distance), 1000 * by_frame, np.degrees(_rms(angles)), np.degrees(_rms(angles[:, firm])),
                  float((distance[known].mean(1) > FAR).mean()), exchanged(joints, case.truth))  # fmt: skip


def exchanged(found: JointTable, truth: JointTable) -> float:
    """Share of the frames in which knees and ankles are nearer to where those of the other side truly are."""
    ours, own, other = (table.select([f"{side}_{joint}" for side in sides for joint in ("knee", "ankle")]).positions
                        for table, sides in ((found, SIDES), (truth, SIDES), (truth, SIDES[::-1])))  # fmt: skip
    known = np.isfinite(own).all((1, 2))
    return float((_apart(ours, other) < _apart(ours, own))[known].mean())


def _apart(ours: Array, theirs: Array) -> Array:
    return np.linalg.norm(ours - theirs, axis=2).sum(1)


def angle_differences(case: Case, track: Track) -> Array:
    """Of `ANGLES`, estimate less truth, within half a turn, of shape (T, A), rad."""
    columns = case.body.skeleton.dof_indices(ANGLES)
    return (track.poses[:, columns] - case.true_poses[:, columns] + np.pi) % (2 * np.pi) - np.pi


def of_runs(case: Case, tracks: Sequence[Track]) -> list[Errors]:
    """Errors of several runs."""
    return [errors(case, track) for track in tracks]


def mean_sd(values: Sequence[float]) -> tuple[float, float | None]:
    """Mean and standard deviation; None of a single value."""
    return float(np.mean(values)), float(np.std(values, ddof=1)) if len(values) > 1 else None


def told(values: Sequence[float], form: str = ".1f") -> str:
    """Mean ± standard deviation."""
    mean, sd = mean_sd(values)
    return f"{mean:{form}}" + ("" if sd is None else f" ± {sd:{form}}")


def _rms(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.sqrt((known**2).mean())) if len(known) else float("nan")
