"""Fig. 9: how well results can be reproduced: mean and standard deviation of each degree of freedom over 100 runs, DRS and SRS."""

from __future__ import annotations

import numpy as np

from papers.common.claims import Verdict, by_reading
from papers.common.experiment import Experiment, Outcome, Request, Table
from papers.common.plotting import COLOURS, label, new_figure
from papers.liu2011.material import Case, cases
from papers.liu2011.repeats import METHODS, Runs, both
from papers.liu2011.shown import mark_parts, stem, told
from shadowpuppet.body.skeleton import SIDES
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
    outcome.said.append("The roll of an elbow is undetermined while the arm is straight, so that all is judged in the flexion's two "
                        "components, too: bends forward and aside.")
    return outcome


def names_of(case: Case) -> tuple[str, ...]:
    """The 12 degrees of freedom."""
    return case.picture.body.skeleton.dof_names


def as_bends(names: tuple[str, ...], poses: Array) -> tuple[tuple[str, ...], Array]:
    """Names and values (..., D) of degrees of freedom in which each elbow's roll and flexion are two bends, aside and forward: polar
    coordinates made Cartesian."""
    poses, called = poses.copy(), list(names)
    for side in SIDES:
        roll, flexion = (names.index(f"{side}_elbow_{what}") for what in ("roll", "flexion"))
        turn, bent = poses[..., roll].copy(), poses[..., flexion].copy()
        poses[..., roll], poses[..., flexion] = bent * np.sin(turn), bent * np.cos(turn)
        called[roll], called[flexion] = f"{side}_elbow_aside", f"{side}_elbow_forward"
    return tuple(called), poses


def deviations(names: tuple[str, ...], runs: dict[str, Runs]) -> dict[str, tuple[tuple[str, ...], dict[str, Array]]]:
    """For each choice of the elbows' coordinates, the names of the degrees of freedom and, by method, their standard deviations over the
    runs, (T, D), rad or m."""
    read = {"roll and flexion": {method: (names, each.poses) for method, each in runs.items()},
            "bends": {method: as_bends(names, each.poses) for method, each in runs.items()}}
    return {how: (found["DRS"][0], {method: poses.std(0) for method, (_, poses) in found.items()}) for how, found in read.items()}


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
    """A row a degree of freedom, elbows in both coordinates: mean spread of either method, and in how many frames that of DRS is the
    smaller."""
    rows: dict[str, list] = {}
    units = [(100, "cm") if dof.kind == "translation" else (180 / np.pi, "degrees") for dof in case.picture.body.skeleton.dofs]
    for names, sd in deviations(names_of(case), runs).values():
        less = smaller(sd)
        for d, (name, (scale, unit)) in enumerate(zip(names, units)):
            rows[name] = [name, *(f"{scale * sd[method][:, d].mean():.1f} {unit}" for method in METHODS), f"{100 * less[d]:.0f}"]
    columns = ("degree of freedom", *(f"{method}: mean SD" for method in METHODS), "frames in which DRS's is smaller, %")
    return Table(columns, list(rows.values()), shown=True)


def verdicts(case: Case, runs: dict[str, Runs], shown: str) -> list[Verdict]:
    """The paper's V-B-2, of its left elbow's rotation in any of our coordinates, and of all 12 in both choices of them."""
    read = deviations(names_of(case), runs)
    less = {name: float(share) for names, sd in read.values() for name, share in zip(names, smaller(sd))}
    elbow = {name: less[name] for name in less if name.startswith("left_elbow")}
    average = {how: sd["DRS"].mean(0) < sd["SRS"].mean(0) for how, (_, sd) in read.items()}
    always = {how: smaller(sd) >= THROUGHOUT for how, (_, sd) in read.items()}
    d = names_of(case).index(DRAWN)
    means = {method: np.degrees(each.poses[..., d].mean(0)) for method, each in runs.items()}
    sd = {method: float(np.degrees(each.poses[..., d].std(0).mean())) for method, each in runs.items()}
    apart = float(np.abs(means["DRS"] - means["SRS"]).mean())
    return [
        Verdict("A left elbow's rotation varies less over the runs with DRS, throughout", "V-B-2, Fig. 9",
                f"{DRAWN}: SD {sd['DRS']:.0f} degrees with DRS, {sd['SRS']:.0f} with SRS; smaller in "
                + ", ".join(f"{100 * share:.0f} ({name.removeprefix('left_elbow_')})" for name, share in elbow.items())
                + f" % of the frames; {100 * THROUGHOUT:.0f} % are throughout",
                by_reading({name: share >= THROUGHOUT for name, share in elbow.items()}), shown),
        Verdict("So does each of the 12 degrees of freedom, on average over the film", "V-B-2",
                "; ".join(f"elbows as {how}: {int(average[how].sum())} of {len(names)} vary less with DRS{_those(names, average[how])}"
                          for how, (names, _) in read.items()),
                by_reading({how: bool(each.all()) for how, each in average.items()}), shown),
        Verdict("Each of the 12 varies less throughout the film", "V-B-2",
                "; ".join(f"elbows as {how}: {int(always[how].sum())} of {len(names)} in {100 * THROUGHOUT:.0f} % of the frames or more, "
                          f"least often {min(names, key=less.__getitem__)}, in {100 * min(less[name] for name in names):.0f} %"
                          for how, (names, _) in read.items()),
                by_reading({how: bool(each.all()) for how, each in always.items()}), shown),
        Verdict("The mean over the runs is similar with both", "V-B-2, Fig. 9",
                f"{DRAWN}: the means differ by {apart:.0f} degrees on average; similar is less than SRS's SD, {sd['SRS']:.0f}",
                apart < sd["SRS"], shown),
    ]  # fmt: skip


def _those(names: tuple[str, ...], so: np.ndarray) -> str:
    return "" if so.all() else "; not " + ", ".join(name for name, each in zip(names, so) if not each)


EXPERIMENT = Experiment("figure_9", "Fig. 9: mean and standard deviation of a left elbow angle over 100 runs; a table of all 12 DOF",
                        "about a minute", make, runs=100, short_runs=4)
