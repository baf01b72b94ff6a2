"""Which of a recording's truths is whose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from shadowpuppet.errors import ShadowPuppetError, warn
from shadowpuppet.io.motion.motion_files import read_truth
from shadowpuppet.motion.motion import JointTable, Motion
from shadowpuppet.motion.synchronization import at_common_times

SAME_PERSON = 0.5
"""Greatest median distance (m) of a tracked person from a truth that is theirs."""


def matched_truths(motions: Mapping[int, Motion], truths: Sequence[Path]) -> dict[int, Path]:
    """For each person's motion the truth of a recording that is nearest in the mean, each truth for one person at most."""
    from scipy.optimize import linear_sum_assignment

    tables = [table for path in truths if (table := _read(path)) is not None]
    if not tables or not motions:
        return {}
    away = np.array([[_apart(motion, table) for _, table in tables] for motion in motions.values()])
    rows, figures = linear_sum_assignment(np.where(np.isfinite(away), away, 1e6))
    return {list(motions)[row]: tables[figure][0] for row, figure in zip(rows, figures) if away[row, figure] < SAME_PERSON}


def _read(path: Path) -> tuple[Path, JointTable] | None:
    try:
        return path, read_truth(path)
    except ShadowPuppetError as error:
        warn(f"{path}: no errors are computed: {error}")
        return None


def _apart(motion: Motion, truth: JointTable) -> float:
    """Median distance (m) of a motion's pelvis from a truth's."""
    if "pelvis" not in truth.names or not len(motion):
        return np.inf
    ours, theirs = at_common_times(motion.table, truth)
    delta = ours.positions[:, ours.names.index("pelvis")] - theirs.positions[:, theirs.names.index("pelvis")]
    away = np.linalg.norm(delta, axis=1)
    return float(np.nanmedian(away)) if np.isfinite(away).any() else np.inf
