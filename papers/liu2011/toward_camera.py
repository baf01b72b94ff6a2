"""Motions toward the camera, which the paper says are well tracked: a bow, and arms; and beside them fists before the trunk."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from papers.common.claims import Verdict, all_of
from papers.common.experiment import Experiment, Outcome, Request, Table
from papers.common.plotting import COLOURS, label, new_figure
from papers.liu2011.material import Case, cases
from papers.liu2011.repeats import FAR, METHODS, Runs, both
from papers.liu2011.shown import STYLES, mark_parts, told
from shadowpuppet.geometry import Array

MEASURES = {"neck": ("neck", None), "left hand": ("left_hand", "left_shoulder"), "right hand": ("right_hand", "right_shoulder")}
"""What comes toward the camera: a joint, by itself or before another one."""
LEAST = {"neck": 0.15, "left hand": 0.3, "right hand": 0.3}
"""Metres by which each must come toward the camera to be judged (its 5th to its 95th percentile)."""
FOLLOWED, AGREES = (0.5, 1.5), 0.7
"""What share of the motion is followed, and how it must correlate with the truth's, to be called tracked."""


class Followed(NamedTuple):
    """How a measure is followed, in the mean over the runs."""

    reach: float
    """How far it truly comes toward the camera, metres."""
    share: float
    """Slope of the estimate over the truth."""
    correlation: float
    error: float
    """Mean distance between both, metres."""

    @property
    def tracked(self) -> bool:
        """Whether it is."""
        return FOLLOWED[0] <= self.share <= FOLLOWED[1] and self.correlation >= AGREES


def make(request: Request) -> Outcome:
    """All that comes toward the camera in the recordings: with made ones the paper's three motions, and one of reaches and boxing."""
    outcome = Outcome()
    made = [] if request.recordings else cases(request, "toward_camera")
    for case in (*cases(request), *made):
        runs, name = both(request, case), f"toward_camera_{case.name}"
        outcome.pictures[name], outcome.tables[name] = draw(case, runs), over_time(case, runs)
        outcome.tables[f"{name}_parts"] = parts(case, runs["DRS"])
        outcome.verdicts += verdicts(case, runs["DRS"], f"{name}.png")
        outcome.settings |= told(case)
    return outcome


def depths(case: Case, places: Array) -> Array:
    """How far before its origin each of `MEASURES` is, toward the camera, metres: (..., 3), of the joints of `joints_of` (..., J, 3)."""
    toward = -case.camera.T_camera_world[2, :3]
    far = places @ toward
    joints = joints_of()
    return np.stack([far[..., joints.index(joint)] - (far[..., joints.index(origin)] if origin else 0.0)
                     for joint, origin in MEASURES.values()], -1)


def joints_of() -> tuple[str, ...]:
    """All joints that are needed."""
    return tuple(dict.fromkeys(name for pair in MEASURES.values() for name in pair if name))


def draw(case: Case, runs: dict[str, Runs]) -> object:
    """A panel a measure: the truth, and both methods' mean, with the spread of DRS."""
    figure, panels = new_figure(3, 1, 9, 2.2, sharex=True)
    true = depths(case, case.true_places(joints_of()))
    for n, (axes, what) in enumerate(zip(panels[:, 0], MEASURES)):
        rest = np.nanmedian(true[:, n])
        axes.plot(case.times, 100 * (true[:, n] - rest), color="black", linewidth=1.3, label="truth")
        for (method, each), colour in zip(runs.items(), COLOURS):
            found = 100 * (depths(case, each.places(joints_of()))[..., n] - rest)
            mean, sd = found.mean(0), found.std(0)
            axes.plot(case.times, mean, STYLES[method], color=colour, linewidth=1, label=f"{method}, mean of {len(found)} runs")
            if method == "DRS":
                axes.fill_between(case.times, mean - sd, mean + sd, color=colour, alpha=0.2, linewidth=0, label="DRS, ± SD")
        label(axes, "seconds" if n == 2 else "", f"{what} (cm)", "How far toward the camera" if n == 0 else "", legend=False)
        mark_parts(axes, case, by_frame=False, named=n == 0)
    panels[0, 0].legend(frameon=False, fontsize=7, loc="upper left", bbox_to_anchor=(1, 1))
    return figure


def over_time(case: Case, runs: dict[str, Runs]) -> Table:
    """A row a frame."""
    found = [depths(case, each.places(joints_of())).mean(0) for each in runs.values()]
    values = np.stack([depths(case, case.true_places(joints_of())), *found], 2).reshape(len(case.times), -1)
    columns = [f"{what.replace(' ', '_')}_{who}_m" for what in MEASURES for who in ("truth", *METHODS)]
    return Table(("seconds", *columns), np.column_stack([case.times, values]).tolist())


def parts(case: Case, runs: Runs) -> Table:
    """A row a motion: the errors of DRS, and how much is far off."""
    names = tuple(f"{side}_{joint}" for joint in ("shoulder", "elbow", "hand") for side in ("left", "right"))
    errors, rows = runs.errors(names), []
    for part in case.parts:
        during = errors[:, (case.times >= part.start) & (case.times <= part.end)]
        each = [round(1000 * float(np.nanmean(during[..., 2 * k : 2 * k + 2]))) for k in range(3)]
        rows.append([part.name, *each, round(100 * float((during > FAR).mean()), 1)])
    return Table(("motion", "shoulder, mm", "elbow, mm", "hand, mm", "over 30 cm off, %"), rows, shown=True)


def followed(case: Case, runs: Runs) -> dict[str, Followed]:
    """Of each measure that comes far enough toward the camera."""
    true, found = depths(case, case.true_places(joints_of())), depths(case, runs.places(joints_of()))
    out = {}
    for n, what in enumerate(MEASURES):
        known = np.isfinite(true[:, n])
        x = true[known, n] - true[known, n].mean()
        reach = float(np.subtract(*np.percentile(x, [95, 5])))
        if reach >= LEAST[what]:
            y = found[:, known, n] - found[:, known, n].mean(1, keepdims=True)
            share, spread = (y @ x) / (x @ x), np.sqrt((y**2).sum(1) * (x @ x))
            error = np.abs(found[:, known, n] - true[known, n]).mean()
            out[what] = Followed(reach, float(share.mean()), float(((y @ x) / np.maximum(spread, 1e-12)).mean()), float(error))
    return out


def verdicts(case: Case, runs: Runs, shown: str) -> list[Verdict]:
    """The paper's abstract, I and VI, whose evidence is the bow; of the arms it says nothing in particular."""
    found = followed(case, runs)
    out = []
    for what, claim, where in (("neck", "A bow toward the camera is well tracked", "abstract, VI"),
                               ("hand", "Arms' motion toward the camera is well tracked, too", "ours")):
        those = {name: each for name, each in found.items() if name.endswith(what)}
        if those:
            got = "; ".join(f"{name}: {100 * each.share:.0f} % of {100 * each.reach:.0f} cm is followed (correlation "
                            f"{each.correlation:.2f}, mean error {100 * each.error:.0f} cm)" for name, each in those.items())
            out.append(Verdict(claim, where, f"{case.name}, DRS: {got}; tracked means {100 * FOLLOWED[0]:.0f} to "
                               f"{100 * FOLLOWED[1]:.0f} % with a correlation of {AGREES} or more",
                               all_of([each.tracked for each in those.values()]), shown, own=where == "ours"))
    return out


EXPERIMENT = Experiment("toward_camera", "VI: a bow and arms toward the camera, and arms in front of the trunk", "a minute", make, runs=20,
                        short_runs=2)
