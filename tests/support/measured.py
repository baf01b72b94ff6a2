"""Joint tables of a moving person, and run folders made from them without tracking, for tests of evaluation."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from shadowpuppet.evaluation.evaluation import Comparison, measure_run
from shadowpuppet.evaluation.joint_angles import compared_poses, turn_errors
from shadowpuppet.io.motion.table import write_joints
from shadowpuppet.io.run_writer import RunWriter
from shadowpuppet.motion.metrics import LIMB_JOINTS
from shadowpuppet.motion.motion import JointTable, MotionFrame

NAMES = ("pelvis", "neck", "head", *LIMB_JOINTS, "left_hand", "right_hand")
BODY = {"pelvis": (0, 0, 0.95), "neck": (0, 0, 1.5), "head": (0.02, 0, 1.6)}
for _side, _y in (("left", 1), ("right", -1)):
    BODY |= {f"{_side}_shoulder": (0, 0.18 * _y, 1.45), f"{_side}_elbow": (0, 0.22 * _y, 1.15), f"{_side}_wrist": (0.1, 0.22 * _y, 0.92),
             f"{_side}_hand": (0.13, 0.22 * _y, 0.86), f"{_side}_hip": (0, 0.09 * _y, 0.92), f"{_side}_knee": (0.03, 0.1 * _y, 0.5),
             f"{_side}_ankle": (0, 0.1 * _y, 0.08)}  # fmt: skip


def person(seconds: float = 6.0, rate: float = 30.0, start: float = 0.0, names=NAMES, seed: int = 3) -> JointTable:
    """Joints of a swaying person: each joint moves differently and aperiodically; the same motion at any rate."""
    rng = np.random.default_rng(seed)
    speeds, phases = rng.uniform(1.5, 7, (len(NAMES), 3, 3)), rng.uniform(0, 6, (len(NAMES), 3, 3))
    times = start + np.arange(round(seconds * rate)) / rate
    sway = 0.05 * np.sin(times[:, None, None, None] * speeds + phases).sum(3)
    places = np.array([BODY[name] for name in NAMES]) + sway
    return JointTable(times, NAMES, places).select(names)


def moved(table: JointTable, by=0.0, names=None, times=None) -> JointTable:
    """The table with transformed positions, other names or other times."""
    return JointTable(table.times if times is None else times, table.names if names is None else tuple(names), table.positions + by)


def write_run(folder: Path, table: JointTable, *, sd=None, status=None, truth: Path | None = None, body: str = "anatomical",
              poses=None, dofs=("torso_y",), **info) -> Path:
    """Write a run folder with the joints of a table; frames with NaN are lost."""
    said = info | ({"truth": str(truth)} if truth else {})
    with RunWriter(folder, body, dofs, table.names, {"recording": "nowhere", "method": "made", "settings": {"seed": 4}, **said}) as run:
        for n, (time, places) in enumerate(zip(table.times, table.positions)):
            told = status[n] if status is not None else "tracked" if np.isfinite(places).all() else "lost"
            blank = told in ("lost", "absent")
            run.write(MotionFrame(float(time), told, None if blank else np.zeros(len(dofs)) if poses is None else poses[n],
                                  None if blank else places, joint_sd=None if sd is None else np.broadcast_to(sd, places.shape),
                                  cost=100.0 + n, overlap=0.9 - 0.001 * n))  # fmt: skip
    return folder


TRUTH = person(4, 15)


def run_that_errs(folder: Path, worst=(12, 40), **more) -> Path:
    """A run whose left hand is far off in some frames."""
    places = TRUTH.positions + np.random.default_rng(1).normal(size=TRUTH.positions.shape) * 0.01
    for n, frame in enumerate(worst):
        places[frame, NAMES.index("left_wrist")] += 1.0 + n
    write_joints(folder / "truth.csv", TRUTH)
    return write_run(folder / "run", JointTable(TRUTH.times, TRUTH.names, places), truth=folder / "truth.csv", **more)


def evaluate_run(folder, truth=None, joints=None, **more) -> dict:
    """The figures of `measure_run`; `more`: fields of `Comparison`."""
    return measure_run(folder, truth, Comparison(joints, **more)).measured


def angle_errors(motion, truth, start: int = 0) -> dict[str, float]:
    """Root mean square errors of joint rotations, degrees."""
    return turn_errors(*compared_poses(motion, truth, start))
