"""Evaluation of a finished run, against a truth or alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import ShadowPuppetError, typed, warn
from shadowpuppet.evaluation.error_metrics import (
    acceleration_errors,
    aligned_errors,
    axis_errors,
    bone_errors,
    exchanges,
    hinge_errors,
    pose_losses,
    whole_alignment,
    world_difference,
)
from shadowpuppet.evaluation.interval_coverage import coverage
from shadowpuppet.evaluation.joint_angles import compared_poses, dof_errors, turn_errors
from shadowpuppet.evaluation.movement.movement import gait_summary
from shadowpuppet.evaluation.standing import standing_figures
from shadowpuppet.io.calibration.calibration_files import read_calibration
from shadowpuppet.io.contacts import read_contacts
from shadowpuppet.io.files.plain import json_text
from shadowpuppet.io.files.text import write_whole
from shadowpuppet.io.motion.motion_files import check_unit, names_in, read_truth, up_axis
from shadowpuppet.io.run import Run, read_run, resuming
from shadowpuppet.io.run_writer import FILES, write_metrics
from shadowpuppet.motion.metrics import GROUPS, JointErrors, evaluate, joint_errors
from shadowpuppet.motion.motion import ROUNDING, JointTable
from shadowpuppet.motion.synchronization import at_common_times, at_times, find_offset, step_of
from shadowpuppet.video.moments import read_moment

BRIEF = 0.5
"""Span (s) below which one that was given by whole numbers, which are frames, may have been meant in seconds."""


@dataclass(frozen=True)
class Comparison:
    """Options of a comparison of a run with its truth."""

    joints: Sequence[str] | None = None
    """Joints to compare, or names of `metrics.GROUPS`; None: `metrics.default_joints`."""
    start: int | str = 0
    """First frame of the truth to compare: its number, `120f`, or its time, `3.5s` (a whole number is a frame, any other a time)."""
    end: int | str | None = None
    """Last frame of the truth to compare, likewise; None: its last."""
    offset: float = 0.0
    """Seconds added to the truth's times."""
    sync: bool = False
    """Whether to find that offset by the joints' speeds."""
    align: bool = False
    """Whether to move the whole truth into the run's world by one rigid motion first."""
    angles: bool = False
    """Whether to compare joint angles of a whole body too."""


@dataclass(frozen=True, eq=False)
class Evaluation:
    """A run and its truth at the same times and in one world, and the figures of their comparison."""

    run: Run
    measured: dict[str, Any]
    """All figures, as `write_evaluation` writes them."""
    cameras: Sequence[Camera]
    """Cameras of the run; empty if unknown."""
    table: JointTable | None = None
    """The run's joints at the times compared (T,); None without a truth."""
    truth: JointTable | None = None
    """The truth at the same times, in the run's world if `Comparison.align`."""
    errors: JointErrors | None = None


def measure_run(folder: str | Path, truth: str | Path | None = None, how: Comparison | None = None) -> Evaluation:
    """Evaluate a run folder against `truth`, by default its recording's: `metrics.evaluate` and all of `error_metrics`.

    Plane and depth are those of the run's camera. Warns if run and truth seem to be in two worlds. Raises `FormatError` or
    `ShadowPuppetError` for files that cannot be used.
    """
    how, run = how or Comparison(), read_run(folder)
    if not run.complete:
        warn(f"{folder}: the run was broken off after {len(run.motion)} frames, which are measured as tracked, not smoothed; "
             f"{resuming(run)}")
    table = truth if truth is not None else _known_truth(run.info.get("truth"))
    if table is None and (how.angles or how.sync or how.align):
        asked = next(name for name in ("angles", "sync", "align") if getattr(how, name))
        raise ShadowPuppetError(f"{folder}: {asked}: found no truth to compare with, expected one as TRUTH")
    cameras = _cameras(run.folder)
    info: dict[str, Any] = {"run": str(folder), "truth": None if table is None else str(table), "complete": run.complete}
    lost = {"losses": pose_losses(run.motion), "gait": gait_summary(run)}
    if table is None:
        measured = evaluate(run.motion, joints=_joint_names(how.joints), camera=_single_camera(cameras), cameras=max(len(cameras), 1))
        return Evaluation(run, info | measured | lost | {"feet": standing_figures(run.motion.table)}, cameras)
    read = _cut(_within(run, read_truth(table, run.motion.joint_names), how), how, table)
    reference, clock = _on_our_clock(run, read, how, table)
    try:
        check_unit(run.motion.table, reference, table)
        reference, world = _in_our_world(run, reference, how, table)
        measured = evaluate(run.motion, reference, _joint_names(how.joints), camera=_single_camera(cameras), cameras=max(len(cameras), 1))
    except ShadowPuppetError as error:
        names = names_in(table)
        raise ShadowPuppetError(f"{error}" + (f" ({table} calls them {names})" if "which the truth lacks" in str(error) and names else "")
                                ) from None
    ours, theirs = at_common_times(run.motion.table, reference)
    errors = joint_errors(ours, theirs, list(measured["errors"]["joints"]))
    measured |= lost | {"clock": clock | {"frames_compared": len(theirs.times)}, "world": world} | _error_metrics(run, ours, theirs, errors)
    flags = read_contacts(table)
    flags = None if flags is None else flags._replace(times=flags.times + clock["offset_s"])
    measured["feet"] = standing_figures(run.motion.table, reference, flags)
    if how.angles:
        poses = compared_poses(run.motion, theirs)
        measured |= {"angles_deg": turn_errors(*poses), "angles_aligned_deg": turn_errors(*poses, aligned=True),
                     "dofs_deg": dof_errors(*poses)}
    return Evaluation(run, info | measured, cameras, ours, theirs, errors)


def write_evaluation(path: str | Path, measured: Mapping[str, Any], folder: str | Path) -> None:
    """Write figures as JSON. Raises `ShadowPuppetError` if that fails, or the path is one of the run's own files."""
    check_output(path, folder, ".json")
    write_whole(Path(path), json_text(measured, "evaluation") + "\n")


def check_output(path: str | Path, folder: str | Path, ending: str) -> None:
    """Raise `ShadowPuppetError` if an output file has another ending, is in a folder that does not exist, or is one of the run's own."""
    path = Path(path)
    if not path.parent.is_dir():
        raise ShadowPuppetError(f"{path}: cannot be written (there is no folder {path.parent})")
    if path.suffix.lower() != ending:
        raise ShadowPuppetError(f"{path}: found the ending {path.suffix!r}, expected {ending}")
    if path.resolve().parent == Path(folder).resolve() and path.name in (*FILES, "run.toml", "look.json"):
        raise ShadowPuppetError(f"{path}: found the run's own file, which is kept as `track` wrote it; choose another name"
                                + (", or give --update to put the figures in it" if path.name == "metrics.json" else ""))


def update_metrics(evaluation: Evaluation) -> Path:
    """Merge the figures into the run's own metrics.json; returns its path."""
    write_metrics(evaluation.run.folder, evaluation.run.metrics | evaluation.measured)
    return evaluation.run.folder / "metrics.json"


def _error_metrics(run: Run, ours: JointTable, theirs: JointTable, errors: JointErrors) -> dict[str, Any]:
    """All of `error_metrics`, of tables at the same times."""
    sd = at_times(replace(run.motion.table, positions=run.motion.joint_sd), ours.times).select(errors.names).positions
    return {"aligned_mm": aligned_errors(errors, ours, theirs), "axes_mm": axis_errors(errors),
            "bends_deg": hinge_errors(ours, theirs), "acceleration": acceleration_errors(ours.select(errors.names), theirs),
            "bone_errors": bone_errors(ours, theirs),
            "coverage": coverage(errors.delta, sd, errors.names), "exchanges": exchanges(ours, theirs)}


def _within(run: Run, truth: JointTable, how: Comparison) -> JointTable:
    """The truth in the span that the run was asked to track, up to where it was broken off; all of it if it has another clock."""
    begin, end = (run.info.get(key) for key in ("begin", "end"))
    if not run.complete and len(run.motion):
        end = float(run.motion.times[-1]) + 2 * ROUNDING  # its last frame counts
    if how.sync or how.offset or (begin is None and end is None):
        return truth
    return truth.between(begin or 0.0, np.inf if end is None else end)


def _cut(truth: JointTable, how: Comparison, path: str | Path) -> JointTable:
    last = len(truth.times) - 1
    start = _frame("start", how.start, truth, path)
    end = last if how.end is None else _frame("end", how.end, truth, path)
    if not 0 <= start <= last:
        raise ShadowPuppetError(f"start: found {how.start}, expected 0 to {last}, a frame of {path}")
    if not start <= end <= last:
        raise ShadowPuppetError(f"end: found {how.end}, expected {start} to {last}, a frame of {path}")
    bare = [each for each in (how.start, how.end) if isinstance(each, str) and each.isdigit()]
    if len(bare) == 2 and truth.times[end] - truth.times[start] < BRIEF:
        warn(f"start {start} and end {end} are frames of {path}, {end - start + 1} in all; seconds are written {start}.0 and {end}.0")
    frames = slice(start, end + 1)
    return JointTable(truth.times[frames], truth.names, truth.positions[frames])


def _frame(name: str, moment: int | str, truth: JointTable, path: str | Path) -> int:
    """Number of the truth's frame at a moment. Raises `ShadowPuppetError` if it lies outside of the truth."""
    try:
        number = int(moment)
    except ValueError:
        pass
    else:
        return number
    try:
        found = read_moment(moment)
    except ValueError as error:
        raise ShadowPuppetError(f"{name}: found {moment!r}; {error}") from None
    if found.in_frames:
        return int(found.number)
    times = truth.times
    if not len(times) or not times[0] - ROUNDING <= found.number <= times[-1] + ROUNDING:
        raise ShadowPuppetError(f"{name}: found {moment} s, expected {times[0]:.3f} to {times[-1]:.3f} s, the times of {path}")
    return int(np.abs(times - found.number).argmin())


def _on_our_clock(run: Run, truth: JointTable, how: Comparison, path: str | Path) -> tuple[JointTable, dict[str, Any]]:
    """The truth in the run's time, and facts about the clocks."""
    if how.sync and how.offset:
        raise ShadowPuppetError(f"offset: found {how.offset:g} s and --sync, which finds it; expected one of them")
    if not np.isfinite(how.offset):
        raise ShadowPuppetError(f"offset: found {how.offset}, expected seconds")
    motion, found = run.motion.table, None
    if how.sync:
        found = find_offset(motion, truth)
        if found.rival is not None:
            warn(f"{path}: an offset of {found.rival:.3f} s fits nearly as well as {found.seconds:.3f} s: the motion repeats itself")
    offset = found.seconds if found else how.offset
    moved = replace(truth, times=truth.times + offset)
    if len(motion.times) and (motion.times[-1] < moved.times[0] or motion.times[0] > moved.times[-1]):
        raise ShadowPuppetError(f"{path}: found times from {moved.times[0]:.2f} to {moved.times[-1]:.2f} s, but the run has "
                                f"{motion.times[0]:.2f} to {motion.times[-1]:.2f} s: give --sync or --offset")
    rates = {name: float(1 / step_of(table.times)) for name, table in (("run_hz", motion), ("truth_hz", truth))}
    return moved, rates | {"offset_s": offset} | (
        {"speed_error_m_s": found.error, "speed_error_before_m_s": found.before, "rival_s": found.rival} if found else {})


def _in_our_world(run: Run, truth: JointTable, how: Comparison, path: str | Path) -> tuple[JointTable, dict[str, Any]]:
    """The truth, moved into the run's world if `how.align`, and `world_difference`; warns if it seems to be in another world."""
    if not len(run.motion):
        return truth, {}
    ours, theirs = at_common_times(run.motion.table, truth)
    errors = joint_errors(ours, theirs, _joint_names(how.joints))
    world = world_difference(errors, ours, theirs)
    if how.align and not world:
        raise ShadowPuppetError("align: found fewer than three joints known in both run and truth, expected more")
    if how.align:
        back = whole_alignment(theirs, ours, errors)
        return replace(truth, positions=back.apply(truth.positions)), world | {"moved": True}
    if world.get("apart"):
        warn(f"the run's joints are {world['mean_mm']:.0f} mm from the truth's, but {world['aligned_mm']:.0f} mm once the run is turned by "
             f"{world['rotation_deg']:.0f} degrees and moved by {np.linalg.norm(world['moved_mm']):.0f} mm as a whole: are they in two "
             "worlds, or is the distance wrong? --align compares after that" + _turned_up(ours, theirs, path))
    return truth, world | ({"moved": False} if world else {})


def _turned_up(run: JointTable, truth: JointTable, path: str | Path) -> str:
    """Advice for a truth with another up axis than the run's; empty if both have the same."""
    axis = up_axis(truth)
    if axis == "+z" or up_axis(run) != "+z":
        return ""
    return f"; {axis.upper()} points up in {path}: `{typed('convert', path, 'truth.csv')}` turns it"


def _joint_names(joints: Sequence[str] | None) -> list[str] | None:
    """Names of joints, with groups replaced by the names of their joints, each once."""
    return None if joints is None else list(dict.fromkeys(name for joint in joints for name in GROUPS.get(joint, (joint,))))


def _single_camera(cameras: Sequence[Camera]) -> Camera | None:
    return cameras[0] if len(cameras) == 1 else None


def _known_truth(path: object) -> str | None:
    if isinstance(path, str) and not Path(path).exists():
        warn(f"{path}: the recording's truth is not there any more; give it as TRUTH")
        return None
    return path if isinstance(path, str) else None


def _cameras(folder: Path) -> Sequence[Camera]:
    """The run's cameras; none if unknown."""
    path = folder / "calibration.toml"
    return read_calibration(path) if path.exists() else []
