"""Fig. 8: the 2D error (the cost of eq. 2) of the estimate over time, mean of 100 runs, with DRS and with SRS."""

from __future__ import annotations

import numpy as np

from papers.common.claims import Verdict, difference
from papers.common.experiment import Experiment, Outcome, Request, Table
from papers.common.plotting import COLOURS, label, new_figure
from papers.liu2011.material import Case, cases
from papers.liu2011.repeats import METHODS, Runs, both
from papers.liu2011.shown import mark_parts, stem, told


def make(request: Request) -> Outcome:
    """The figure for each recording."""
    outcome = Outcome()
    for case in cases(request):
        runs, name = both(request, case), stem("figure_8", request, case)
        outcome.pictures[name] = draw(case, runs)
        rows = np.column_stack([case.times, *(each.costs.mean(0) for each in runs.values())]).tolist()
        columns = ("frame", "seconds", *(f"{method}_px" for method in METHODS))
        outcome.tables[name] = Table(columns, [[n, *row] for n, row in enumerate(rows)])
        outcome.verdicts.append(verdict(runs, f"{name}.png"))
        outcome.settings |= told(case)
    return outcome


def draw(case: Case, runs: dict[str, Runs]) -> object:
    """A line a method."""
    figure, panels = new_figure(1, 1, 8, 3.2)
    axes = panels[0, 0]
    for (method, each), colour in zip(runs.items(), COLOURS):
        axes.plot(each.costs.mean(0), color=colour, linewidth=1, label=method)
    axes.set_ylim(bottom=0)
    mark_parts(axes, case)
    label(axes, "frame", "mean cost (pixels)", f"Fig. 8: mean 2D error over {len(runs['DRS'].costs)} runs")
    return figure


def verdict(runs: dict[str, Runs], shown: str) -> Verdict:
    """The paper's V-B-1."""
    of = {method: each.costs.mean(1) for method, each in runs.items()}
    lower = float((runs["DRS"].costs.mean(0) < runs["SRS"].costs.mean(0)).mean())
    got = f"DRS {of['DRS'].mean():.0f} px, SRS {of['SRS'].mean():.0f} px; DRS is lower in {100 * lower:.0f} % of the frames"
    same = difference(of["SRS"], of["DRS"]).greater
    return Verdict("DRS has the lower 2D error, with as many particles", "V-B-1, Fig. 8", got, same, shown)


EXPERIMENT = Experiment("figure_8", "Fig. 8: mean 2D error over 100 runs, DRS and SRS", "about a minute", make, runs=100, short_runs=4)
