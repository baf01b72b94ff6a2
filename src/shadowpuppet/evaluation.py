"""A run measured after it was made."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any
from warnings import warn

from shadowpuppet.camera import Camera
from shadowpuppet.errors import ShadowPuppetError, ShadowPuppetWarning
from shadowpuppet.io.calibration import read_calibration
from shadowpuppet.io.joints import read_joints
from shadowpuppet.io.run import read_run
from shadowpuppet.metrics import GROUPS, evaluate


def evaluate_run(folder: str | Path, truth: str | Path | None = None, joints: Sequence[str] | None = None,
                 start: int = 0) -> dict[str, Any]:
    """`metrics.evaluate` of a run folder, against `truth` or that of its recording, where there is one.

    `joints`: those compared, or names of `metrics.GROUPS`; `start`: the truth's first frame that counts. Plane and depth are those of
    the run's camera.
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
    return {"run": str(folder), "truth": None if table is None else str(table), "complete": run.complete, **measured}


def _known_truth(path: object) -> str | None:
    if isinstance(path, str) and not Path(path).exists():
        warn(f"{path}: the recording's truth is not there any more; give it as TRUTH", ShadowPuppetWarning, stacklevel=3)
        return None
    return path if isinstance(path, str) else None


def _cameras(folder: Path) -> Sequence[Camera]:
    """The run's cameras; none where they are not known, and one is taken for level."""
    path = folder / "calibration.toml"
    return read_calibration(path) if path.exists() else []
