"""What a lag buys: error and acceleration of motion that is smoothed while it is tracked, at some lags, and the time that this takes.

    python benchmarks/fixed_lag.py [RECORDING ...] [--runs FOLDER] [--markdown FILE]

Recordings and runs are those of `smoothness.py`; without any, some made ones. A lag of 0 is the motion as tracked, *all* the pass over the
whole film. Latency is from a frame's capture to its smoothed pose; a lag is of whole frames, at least one.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from proving_ground import HERE as GROUND
from proving_ground import made as made_ground
from smoothness import BUILD, arguments, made_turns, measured

from shadowpuppet.body.models import make_body
from shadowpuppet.io.motion.motion_files import read_truth
from shadowpuppet.io.motion.table import read_raw
from shadowpuppet.io.person import read_person
from shadowpuppet.io.run import read_run
from shadowpuppet.motion.body_animation import base_in_world
from shadowpuppet.motion.metrics import default_joints, jitter
from shadowpuppet.motion.motion import JointTable, Motion
from shadowpuppet.motion.synchronization import at_times
from shadowpuppet.threads import one_blas_thread
from shadowpuppet.tracking.smoothing.fixed_lag import FixedLag
from shadowpuppet.tracking.smoothing.smoothing import MotionSmoother

LAGS = (0.0, 0.1, 0.2, 0.3, 0.5)
"""Seconds."""
CHOSEN = ("child_paper", "man_boxing", "woman_random", "one_wave_turn", "three_behind")
"""Names of the recordings without any given."""


class Row(NamedTuple):
    """Figures of a recording at a lag."""

    name: str
    cameras: int
    lag: str
    late: float
    """Frames that a frame waits."""
    error: float
    """Mean distance from the truth, millimetres."""
    acceleration: float
    """Root mean square over the truth's."""
    cost: float
    """Processor time a frame, milliseconds."""


@one_blas_thread()
def rows(recording: Path, run: Path) -> Iterator[Row]:
    """Figures of a recording that was tracked into a run folder."""
    found = read_run(run).motion
    raw = read_raw(run / "raw.csv", found.body_name)
    raw = raw[raw.known]
    truth, cameras = at_times(read_truth(recording / "truth.csv"), raw.times), len(list((recording / "video").iterdir()))
    smoother = _smoother(run, found)
    for lag in LAGS:
        joints, late, cost = (raw.joints, 0.0, 0.0) if lag == 0 else _followed(raw, smoother, lag)
        yield Row(recording.name, cameras, f"{lag:g} s", late, *_figures(raw, joints, truth), cost)
    begun = time.process_time()
    whole = smoother(raw).motion.joints
    yield Row(recording.name, cameras, "all", np.nan, *_figures(raw, whole, truth), 1000 * (time.process_time() - begun) / len(raw))


def _smoother(run: Path, motion: Motion) -> MotionSmoother:
    body = make_body(motion.body_name, read_person(run / "person.toml", motion.body_name).sizes)
    base, chosen = base_in_world(body, motion)[0], [body.landmark_names.index(name) for name in motion.joint_names]
    return MotionSmoother(body.skeleton, lambda poses: body.points(poses, base)[:, chosen])


def _followed(raw: Motion, smoother: MotionSmoother, lag: float) -> tuple[np.ndarray, float, float]:
    """Smoothed joints (T, J, 3), frames that each waited, and milliseconds a frame."""
    follow, waited, begun, found = FixedLag(smoother, lag), list[int](), time.process_time(), []
    for n, frame in enumerate(raw.frames()):
        found += follow(frame)
        waited.append(n + 1 - len(found))
    found += follow.rest()
    cost = 1000 * (time.process_time() - begun) / len(raw)
    return np.array([frame.joints for frame in found]), float(np.median(waited)), cost


def _figures(raw: Motion, joints: np.ndarray, truth: JointTable) -> tuple[float, float]:
    names = default_joints(raw.table, truth)
    ours, theirs = JointTable(raw.times, raw.joint_names, joints).select(names), truth.select(names)
    return float(1000 * np.nanmean(np.linalg.norm(ours.positions - theirs.positions, axis=2))), jitter(ours) / jitter(theirs)


def markdown(found: Sequence[Row]) -> str:
    """The table."""
    head = ["recording", "cameras", "lag", "frames", "error, mm", "acceleration / truth's", "ms a frame"]
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    for row in found:
        frames = "all" if np.isnan(row.late) else f"{row.late:.0f}"
        figures = (f"{row.error:.1f}", f"{row.acceleration:.2f}", f"{row.cost:.1f}")
        cells = [row.name.replace("_", " "), str(row.cameras), row.lag, frames, *figures]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure, print and write the table."""
    given = arguments(__doc__ or "")
    found = list[Row]()
    for recording in given.recordings or [each for each in (*made_ground(GROUND), *made_turns(BUILD)) if each.name in CHOSEN]:
        if not (given.runs / recording.name / "raw.csv").exists():
            measured(recording, given.runs / recording.name)
        for row in rows(recording, given.runs / recording.name):
            found.append(row)
            print(markdown([row]).splitlines()[-1], flush=True)
    if given.markdown:
        given.markdown.write_text(markdown(found), "utf-8")


if __name__ == "__main__":
    main()
