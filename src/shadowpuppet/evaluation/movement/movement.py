"""The movement in a run: its gait if it has one, else the range of each angle."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.skeleton import SIDES
from shadowpuppet.evaluation.movement.angles import PERCENT, Cycle, Range, cycles, joint_angles, ranges
from shadowpuppet.evaluation.movement.gait_figures import GaitParameter, gait_figures
from shadowpuppet.evaluation.movement.normal_walking import Normal, normal_walking
from shadowpuppet.io.files.table import cells, csv_line
from shadowpuppet.io.files.text import write_whole
from shadowpuppet.io.run import Run
from shadowpuppet.motion.contact.contact import SOLES, contacts_of
from shadowpuppet.motion.contact.steps import Gait, find_gait
from shadowpuppet.motion.motion import Motion

COLUMNS = ("name", "side", "unit", "percent", "count", "mean", "sd", "half_width_90", "normal_mean", "normal_sd")
"""Of movement.csv."""
SHORTEST = 3
"""Frames that a movement has at least."""


@dataclass(frozen=True, eq=False)
class Movement:
    """Gait, angles and ranges of the movement in a run."""

    gait: Gait | None
    """None if the run has no contacts of feet."""
    no_gait: str
    """Why there are no figures of a gait; empty if there are."""
    figures: Sequence[GaitParameter]
    cycles: Sequence[Cycle]
    """Angles over the gait cycle; none without a full stride."""
    ranges: Sequence[Range]
    """Ranges of angles of a motion without a full stride."""

    def normal(self, cycle: Cycle) -> Normal | None:
        """The angle of a cycle in normal walking; None for one that is not known, and in a run: there each foot is on the floor for less
        than half of the stride."""
        walks = any(each.name == "stance" and each.both.mean > 50 for each in self.figures)
        return normal_walking(cycle.name, cycle.side) if walks else None


def gait_of(run: Run) -> tuple[Gait | None, str]:
    """A run's gait, and why there are no figures of it, if there are none."""
    motion = run.motion
    contacts = contacts_of(motion.table) if len(motion) else None
    if contacts is None:
        soles = [name for name in motion.joint_names if name in SOLES]
        return None, ("no foot ever stands" if soles else f"the body {motion.body_name!r} has no feet; the body 'anatomical' has, with "
                      "several cameras")
    gait = find_gait(motion.times, contacts, motion.joint_names, motion.joints, motion.joint_sd, _sure(motion))
    return gait, "" if gait.strides else f"no full stride: {_strikes_text(gait)}"


def _strikes_text(gait: Gait) -> str:
    """Number of foot strikes, and of the steps between them that count, in words."""
    if not any(gait.strikes.values()):
        return "no foot strikes the floor"
    return " and ".join(f"{gait.strikes[side]} of the {side} foot" for side in SIDES) + f" strike the floor; {left_out_text(gait)}"


def movement_of(run: Run) -> Movement:
    """The movement in a run."""
    gait, no_gait = gait_of(run)
    motion, figures = run.motion, gait_figures(gait) if gait else []
    angles = joint_angles(run) if len(motion) >= SHORTEST else []
    over = cycles(motion.times, angles, gait) if gait and figures else []
    return Movement(gait, no_gait, figures, over, [] if figures else ranges(motion.times, angles))


def left_out_text(gait: Gait) -> str:
    """Number of steps that count, and reasons for leaving out the others."""
    reasons = ", ".join(f"{count} {reason}" for reason, count in gait.left_out.items())
    return f"{len(gait.counted)} of {len(gait.steps)} steps count" + (f"; left out: {reasons}" if reasons else "")


def gait_summary(run: Run) -> dict[str, Any]:
    """Figures of a run's gait for its metrics; empty if the run has no contacts of feet."""
    gait, why = gait_of(run)
    if gait is None:
        return {}
    figures = {each.name: {"unit": each.unit, "symmetry_percent": each.symmetry}
               | {name: value._asdict() for name, value in zip((*SIDES, "both"), (each.left, each.right, each.both))}
               for each in gait_figures(gait)}
    return {"strikes": gait.strikes, "strides": len(gait.strides), "steps": len(gait.counted), "left_out": gait.left_out,
            "no_gait": why, "figures": figures}


def write_movement(path: str | Path, movement: Movement) -> None:
    """Write movement.csv: a row a figure and side; with `percent`, a row a point of an angle's cycle. Raises `ShadowPuppetError` if that
    fails."""
    write_whole(Path(path), "".join(map(csv_line, [COLUMNS, *_lines(movement)])))


def _lines(movement: Movement) -> Iterator[list[str]]:
    for each in movement.figures:
        for side, own in zip((*SIDES, "both"), (each.left, each.right, each.both)):
            yield [each.name, side, each.unit, "", str(own.number), *cells([own.mean, own.sd, own.stated], 4), "", ""]
        yield [f"{each.name}: symmetry", "", "%", "", "", *cells([each.symmetry, np.nan, np.nan], 2), "", ""]
    for each in movement.cycles:
        unknown = np.full(len(PERCENT), np.nan)
        for percent, *values in zip(PERCENT, each.mean, each.sd, each.stated, *(movement.normal(each) or (unknown, unknown))):
            yield [each.name, each.side, "deg", f"{percent:.0f}", str(each.number), *cells(values, 3)]
    for each in movement.ranges:
        for name, unit, value, stated in (("minimum", "deg", each.low, each.stated), ("maximum", "deg", each.high, each.stated),
                                          ("range", "deg", each.high - each.low, np.nan), ("peak speed", "deg/s", each.speed, np.nan)):
            yield [f"{each.name}: {name}", each.side, unit, "", str(each.frames), *cells([value, np.nan, stated], 3), "", ""]


def _sure(motion: Motion) -> NDArray[np.bool_]:
    """Whether both legs are vouched for, of shape (T,)."""
    legs = [motion.limbs.index(f"{side}_leg") for side in SIDES if f"{side}_leg" in motion.limbs]
    return (motion.limb_status[:, legs] == "tracked").all(1)
