"""Fig. 9: how well results can be reproduced: mean and standard deviation of each degree of freedom over 100 runs, DRS and SRS."""

from __future__ import annotations

import numpy as np

from papers.common.claims import Verdict
from papers.common.experiment import Experiment, Outcome, Request, Table
from papers.common.plotting import COLOURS, label, new_figure
from papers.liu2011.material import Case, cases
from papers.liu2011.repeats import METHODS, Runs, both
from papers.liu2011.shown import mark_parts, stem, told
from shadowpuppet.geometry import Array

DRAWN = "left_elbow_flexion"
"""The paper shows "one rotational DOF of left elbow"."""
THROUGHOUT = 0.95
"""Share of the frames from which on something is so throughout: with 100 runs a standard deviation is known to 7 %."""


def make(request: Request) -> Outcome:
    """The figure, and a table of all degrees of freedom, for each recording."""
    outcome = Outcome()
    for case in cases(request):
        runs, name = both(request, case), stem("figure_9", request, case)
        outcome.pictures[name] = draw(case, runs)
        outcome.tables[name] = over_time(case, runs)
        outcome.tables[f"{name}_dof"] = spreads(case, runs)
        outcome.verdicts += verdicts(case, runs, f"{name}.png")
        outcome.settings |= told(case)
    outcome.said.append("The elbow roll is the rotation of the bent forearm about the upper arm: while the arm is straight, "
                        "it is undetermined.")
    return outcome


def names_of(case: Case) -> tuple[str, ...]:
    """The 12 degrees of freedom."""
    return case.picture.body.skeleton.dof_names


def deviations(runs: dict[str, Runs]) -> dict[str, Array]:
    """Standard deviations over the runs, (T, D), rad or m."""
    return {method: each.poses.std(0) for method, each in runs.items()}


def smaller(sd: dict[str, Array]) -> Array:
    """Share of the frames in which DRS varies less, (D,), of those in which they differ: nothing varies while a start is not bettered."""
    differ = (sd["DRS"] != sd["SRS"]).sum(0)
    return np.where(differ > 0, (sd["DRS"] < sd["SRS"]).sum(0) / np.maximum(differ, 1), 1.0)


def draw(case: Case, runs: dict[str, Runs]) -> object:
    """Above the mean and the mean plus and minus a standard deviation, below the deviation."""
    figure, panels = new_figure(2, 1, 8, 2.8, sharex=True)
    d = names_of(case).index(DRAWN)
    for (method, each), colour in zip(runs.items(), COLOURS):
        mean, sd = np.degrees(each.poses[..., d].mean(0)), np.degrees(each.poses[..., d].std(0))
        panels[0, 0].plot(mean, color=colour, linewidth=1, label=f"{method}, mean")
        for sign in (-1, 1):
            panels[0, 0].plot(mean + sign * sd, "--", color=colour, linewidth=0.6, label=f"{method}, mean ± SD" if sign > 0 else None)
        panels[1, 0].plot(sd, "--", color=colour, linewidth=1, label=f"{method}, SD")
    said = DRAWN.replace("_", " ")
    label(panels[0, 0], "", f"{said} (degrees)", f"Fig. 9: mean and standard deviation over {len(runs['DRS'].poses)} runs")
    label(panels[1, 0], "frame", "standard deviation (degrees)")
    panels[1, 0].set_ylim(bottom=0)
    for n, axes in enumerate(panels[:, 0]):
        mark_parts(axes, case, named=n == 0)
    return figure


def over_time(case: Case, runs: dict[str, Runs]) -> Table:
    """A row a frame: mean and standard deviation of every degree of freedom with each method."""
    columns = [f"{name}_{method}_{what}" for name in names_of(case) for method in METHODS for what in ("mean", "sd")]
    values = np.stack([np.stack([each.poses.mean(0), each.poses.std(0)], -1) for each in runs.values()], 2)  # (T, D, methods, 2)
    return Table(("frame", "seconds", *columns),
                 [[n, float(time), *values[n].ravel().tolist()] for n, time in enumerate(case.times)])


def spreads(case: Case, runs: dict[str, Runs]) -> Table:
    """A row a degree of freedom: mean spread of either method, and in how many frames that of DRS is the smaller."""
    sd = deviations(runs)
    less = smaller(sd)
    units = [(100, "cm") if dof.kind == "translation" else (180 / np.pi, "degrees") for dof in case.picture.body.skeleton.dofs]
    rows = [[name, *(f"{scale * sd[method][:, d].mean():.1f} {unit}" for method in METHODS),
             f"{100 * less[d]:.0f}"]
            for d, (name, (scale, unit)) in enumerate(zip(names_of(case), units))]
    columns = ("degree of freedom", *(f"{method}: mean SD" for method in METHODS), "frames in which DRS's is smaller, %")
    return Table(columns, rows, shown=True)


def verdicts(case: Case, runs: dict[str, Runs], shown: str) -> list[Verdict]:
    """The paper's V-B-2."""
    sd, names = deviations(runs), names_of(case)
    less, average = smaller(sd), sd["DRS"].mean(0) < sd["SRS"].mean(0)
    d, worst = names.index(DRAWN), int(less.argmin())
    means = {method: np.degrees(each.poses[..., d].mean(0)) for method, each in runs.items()}
    apart, spread = float(np.abs(means["DRS"] - means["SRS"]).mean()), float(np.degrees(sd["SRS"][:, d].mean()))
    return [
        Verdict("A left elbow's rotation varies less over the runs with DRS, throughout", "V-B-2, Fig. 9",
                f"{DRAWN}: SD {np.degrees(sd['DRS'][:, d].mean()):.0f} degrees with DRS, {spread:.0f} with SRS; smaller in "
                f"{100 * less[d]:.0f} % of the frames", bool(less[d] >= THROUGHOUT), shown),
        Verdict("So does each of the 12 degrees of freedom, on average over the film", "V-B-2",
                f"{int(average.sum())} of {len(names)} vary less with DRS" + _those(names, average), bool(average.all()), shown),
        Verdict("Each of the 12 varies less throughout the film", "V-B-2",
                f"{int((less >= THROUGHOUT).sum())} of {len(names)} in {100 * THROUGHOUT:.0f} % of the frames or more; least often "
                f"{names[worst]}, in {100 * less[worst]:.0f} %", bool((less >= THROUGHOUT).all()), shown),
        Verdict("The mean over the runs is similar with both", "V-B-2, Fig. 9",
                f"{DRAWN}: the means differ by {apart:.0f} degrees on average; similar is less than SRS's SD, {spread:.0f}",
                apart < spread, shown),
    ]  # fmt: skip


def _those(names: tuple[str, ...], so: np.ndarray) -> str:
    return "" if so.all() else "; not " + ", ".join(name for name, each in zip(names, so) if not each)


EXPERIMENT = Experiment("figure_9", "Fig. 9: mean and standard deviation of a left elbow angle over 100 runs; a table of all 12 DOF",
                        "about a minute", make, runs=100, short_runs=4)
