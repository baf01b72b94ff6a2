"""Fig. 8: how well the hybrid tracks, against the number of regions of its motion prior."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from papers.common.claims import Verdict, all_of, difference
from papers.common.experiment import Outcome, Request, Table
from papers.common.plotting import COLOURS, label, new_figure
from papers.ni2008.fig4 import TRIED
from papers.ni2008.inputs import Case, cases
from papers.ni2008.measures import Errors, of_runs
from papers.ni2008.tracks import REGIONS, hybrid, most_regions, of, tracks

LEVEL, GOOD, RANGE = 0.1, 0.05, (10, 20)
"""A curve is flat whose mean changes by less than this share; a choice is good whose error is within that share of the least; the choice."""
Curves = Mapping[str, dict[int, list[Errors]]]
"""Errors of the runs by motion and M."""


def make(request: Request) -> Outcome:
    """Track with every number of regions."""
    some = cases(request)
    curves = {case.motion: runs(request, case) for case in some}
    rows = [(motion, M, seed, one.rmse, one.angles, one.off) for motion, each in curves.items() for M, errors in each.items()
            for seed, one in zip(request.seeds, errors)]
    table = Table(("recording", "regions", "seed", "rmse_mm", "angles_deg", "lost_share"), rows)
    return Outcome({"regions": sorted({M for each in curves.values() for M in each}), "particles": 40}, {"fig8": picture(curves)},
                   {"fig8": table}, verdicts(curves))


def runs(request: Request, case: Case) -> dict[int, list[Errors]]:
    """Errors by M."""
    ways = {M: hybrid(M) for M in ((5, 20, 40) if request.short else TRIED) if most_regions(case) >= M}
    found = tracks(request, [case], list(ways.values()))
    return {M: of_runs(case, of(found, case, way)) for M, way in ways.items()}


def picture(curves: Curves):
    """Joint positions, as in the paper, and joint angles."""
    figure, panels = new_figure(1, 2, width=9)
    for axes, name, unit in zip(panels[0], ("rmse", "angles"), ("joint positions (mm)", "joint angles (degrees)")):
        for colour, (motion, each) in zip(COLOURS, curves.items()):
            values = np.array([[getattr(one, name) for one in errors] for errors in each.values()])
            axes.errorbar(list(each), values.mean(1), values.std(1), color=colour, marker="o", markersize=3, capsize=2, linewidth=1,
                          label=motion)
        axes.axvspan(*RANGE, color="0.92")
        axes.set_ylim(bottom=0)
        label(axes, "number of Voronoi regions M", f"RMSE of {unit}", "grey: the paper's choice")
    return figure


def verdicts(curves: Curves) -> list[Verdict]:
    """What the paper says of the curve."""
    rmse = {motion: {M: [one.rmse for one in errors] for M, errors in each.items()} for motion, each in curves.items()}
    mean = {motion: {M: float(np.mean(values)) for M, values in each.items()} for motion, each in rmse.items()}
    falls, flat, good = [], [], []
    for motion, each in mean.items():
        least, most = min(each), max(each)
        falls.append(None if least >= REGIONS or REGIONS not in each else difference(rmse[motion][least], rmse[motion][REGIONS]).greater)
        flat.append(None if most <= REGIONS or REGIONS not in each else abs(each[most] / each[REGIONS] - 1) < LEVEL)
        chosen = [value for M, value in each.items() if RANGE[0] <= M <= RANGE[1]]
        good.append(None if not chosen else max(chosen) < (1 + GOOD) * min(each.values()))
    listed = "; ".join(f"{motion} " + ", ".join(f"{value:.1f}" for M, value in each.items() if M in (5, REGIONS, max(each)))
                       for motion, each in mean.items())
    return [
        Verdict("The tracking error falls with M: for small M by much", "VI, Fig. 8",
                f"mm with the least M, {REGIONS}, and the greatest: {listed}", all_of(falls), "fig8.png"),
        Verdict(f"Beyond M = {REGIONS} the tracking error is flat", "VI, Fig. 8",
                f"from {REGIONS} to the greatest M it changes by " + ", ".join(
                    f"{each[max(each)] / each[REGIONS] - 1:+.0%}" for each in mean.values() if REGIONS in each) + f" (flat: under {LEVEL:.0%})",
                all_of(flat), "fig8.png"),
        Verdict("A good choice of M is 10 to 20", "VI, Fig. 8", "over the least error of any M: " + ", ".join(
            f"{max(value for M, value in each.items() if RANGE[0] <= M <= RANGE[1]) / min(each.values()) - 1:+.0%}"
            for each in mean.values() if any(RANGE[0] <= M <= RANGE[1] for M in each)) + f" at worst (good: under {GOOD:.0%})",
            all_of(good), "fig8.png"),
    ]  # fmt: skip
