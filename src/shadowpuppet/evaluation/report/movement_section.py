"""The section about the movement itself: steps and strides, angles over the gait cycle, or ranges of angles."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from shadowpuppet.body.skeleton import SIDES
from shadowpuppet.evaluation.movement.gait_figures import GaitParameter, Spread
from shadowpuppet.evaluation.movement.movement import Movement, left_out_text
from shadowpuppet.evaluation.report import angle_charts
from shadowpuppet.evaluation.report.html import figure, plain, rows, table
from shadowpuppet.motion.contact.steps import Gait

HIDDEN = "neck"
"""Angles that the chart leaves out: silhouettes hardly show how a head is turned. They are in movement.csv."""
NORMAL = (" Grey: 24 young adults at a comfortable speed, one standard deviation to each side (Fukuchi, Fukuchi and Duarte 2018, CC BY "
          "4.0; of the pelvis two bands, as it leans the other way in the other foot's cycle). Their zeros come from markers and differ by "
          "some degrees: compare shapes and ranges; other speeds and ages walk otherwise. This is no diagnosis.")


def movement_section(movement: Movement) -> str:
    """The section; empty for a run without anything to say."""
    parts = "".join(_gait(movement) if movement.figures else _ranges(movement))
    return f"<h2>Movement</h2>{parts}" if parts else ""


def _gait(movement: Movement) -> Iterator[str]:
    gait = movement.gait
    assert gait is not None
    turn = np.degrees(np.mean([abs(step.turn) for step in gait.counted]))
    on_a_bend = f" The way bends, by {turn:.0f} degrees a step." if turn > 10 else ""
    strides = "one full stride" if len(gait.strides) == 1 else f"{len(gait.strides)} full strides"
    yield f"<p class=said>{strides}; {plain(left_out_text(gait))}.{on_a_bend}</p>"
    head = ["", "left", "right", "both", "90 %", "left to right, %", "steps or strides"]
    yield table(head, rows(_cells(each) for each in movement.figures))
    yield ("<p class=said>Mean and standard deviation over the steps or strides. 90 %: half the interval by the run's own statement, which "
           "more steps do not make narrower; the error of times is not stated. Left to right: left less right over their mean.</p>")
    if shown := [each for each in movement.cycles if not each.name.startswith(HIDDEN)]:
        chart = angle_charts.gait_cycle(shown, movement.normal, _stance(gait))
        yield f"<h3>Angles over the gait cycle, degrees</h3>{figure(chart, _note(movement))}"


def _note(movement: Movement) -> str:
    return ("From a strike of the foot, 0 %, to its next; dotted where it leaves the floor. Green is the left foot's cycle, pink the "
            "right's. The line is the mean over the strides, the dark band their standard deviation, the pale one 90 % by the run's own "
            "statement. Positive: pelvis tilted forward, down on the right, turned to the left; hip and arm forward, inward, turned "
            "inward; knee and elbow bent; ankle up; sole inward; trunk backward, to the right, turned to the left. Of the pelvis' "
            "rotation each cycle's mean and drift are removed." + (NORMAL if any(map(movement.normal, movement.cycles)) else ""))


def _stance(gait: Gait) -> dict[str, float]:
    shares = {side: [100 * stride.stance for stride in gait.strides if stride.side == side] for side in SIDES}
    return {side: float(np.mean(own)) for side, own in shares.items() if own}


def _cells(each: GaitParameter) -> list[str]:
    decimals = 1 if each.unit in ("%", "steps/min") else 3
    symmetry = "" if np.isnan(each.symmetry) or each.name == "step width" else f"{each.symmetry:+.1f}"
    stated = "" if np.isnan(each.both.stated) else f"± {each.both.stated:.{decimals}f}"
    return [f"{each.name}, {each.unit}", *(_spread(own, decimals) for own in (each.left, each.right, each.both)), stated, symmetry,
            str(each.both.number)]


def _spread(own: Spread, decimals: int) -> str:
    if not own.number:
        return ""
    return f"{own.mean:.{decimals}f}" + ("" if np.isnan(own.sd) else f" ± {own.sd:.{decimals}f}")


def _ranges(movement: Movement) -> Iterator[str]:
    if not movement.ranges:
        return
    why = movement.no_gait[0].upper() + movement.no_gait[1:]
    yield f"<p class=said>{plain(why)}. So here is how far and how fast each angle moves.</p>"
    head = ["degrees", "", "from", "to", "range", "peak speed, degrees/s", "90 %", "frames", "left out"]
    yield table(head, rows((each.name, each.side, f"{each.low:.1f}", f"{each.high:.1f}", f"{each.high - each.low:.1f}", f"{each.speed:.0f}",
                            "" if np.isnan(each.stated) else f"± {each.stated:.1f}", str(each.frames), str(each.left_out))
                           for each in movement.ranges))
    yield ("<p class=said>Over the frames in which the limb is vouched for; the others are left out. 90 %: half the interval of the angle "
           "by the run's own statement, in the mean.</p>")
