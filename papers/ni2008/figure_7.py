"""Fig. 7: RMSE of joint angles and joint positions for each sequence."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from papers.common.claims import Verdict, all_of, difference
from papers.common.experiment import Outcome, Request, Table
from papers.common.plotting import COLOURS, label, new_figure
from papers.ni2008.inputs import cases
from papers.ni2008.measures import Errors, of_runs, told
from papers.ni2008.tracks import HYBRID, of, tracks

BARS = (("angles", "joint angles (degrees)"), ("rmse", "joint positions (mm)"))


def make(request: Request) -> Outcome:
    """Track, and average."""
    some = cases(request)
    found = tracks(request, some, [HYBRID])
    errors = {case.motion: of_runs(case, of(found, case, HYBRID)) for case in some}
    rows = [(motion, seed, one.angles, one.firm, one.rmse) for motion, each in errors.items() for seed, one in zip(request.seeds, each)]
    table = Table(("recording", "seed", "angles_deg", "angles_without_twist_deg", "positions_mm"), rows)
    means = [(motion, told([one.angles for one in each]), told([one.firm for one in each]), told([one.rmse for one in each]))
             for motion, each in errors.items()]
    shown = Table(("recording", "angles, degrees", "without twist, degrees", "positions, mm"), means, shown=True)
    tables = {"figure_7": table, "figure_7_means": shown}
    return Outcome({**HYBRID.plain, "particles": 40}, {"figure_7": picture(errors)}, tables, [harder(errors)])


def picture(errors: Mapping[str, list[Errors]]):
    """Bars, as in the paper."""
    figure, panels = new_figure(1, 2, width=8)
    for axes, (name, title) in zip(panels[0], BARS):
        values = [[getattr(one, name) for one in each] for each in errors.values()]
        axes.bar(list(errors), [np.mean(each) for each in values], 0.5, yerr=[np.std(each) for each in values], capsize=3,
                 color=COLOURS[: len(errors)])
        label(axes, "", f"RMSE of {title}", legend=False)
    return figure


def harder(errors: Mapping[str, list[Errors]]) -> Verdict:
    """Whether jogging and boxing are tracked worse than walking."""
    rmse = {motion: [one.rmse for one in each] for motion, each in errors.items()}
    pairs = [difference(rmse[other], rmse["walking"]) for other in ("jogging", "boxing") if {other, "walking"} <= set(rmse)]
    got = "; ".join(f"{motion} {told(each)} mm" for motion, each in rmse.items())
    return Verdict("Errors are greater in the jogging and boxing sequences than in walking", "VI, Fig. 7", got,
                   all_of([each.greater for each in pairs]) if len(pairs) == 2 else None, "figure_7.png")
