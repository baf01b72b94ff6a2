"""Fig. 8: how well the hybrid tracks, against the number of regions of its motion prior."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from papers.common.claims import Verdict, all_of, difference
from papers.common.experiment import Outcome, Request, Table
from papers.common.plotting import COLOURS, label, new_figure
from papers.ni2008.inputs import Case, cases
from papers.ni2008.measures import Errors, of_runs
from papers.ni2008.tracks import REGIONS, hybrid, most_regions, of, tracks

TRIED = (5, 10, 20, 40, 80)
"""M."""
LEVEL, GOOD, RANGE = 0.1, 0.05, (10, 20)
"""A curve is flat whose mean changes by less than this share; a choice is good that is within that share of the least; the choice."""
Curves = Mapping[str, dict[int, list[Errors]]]
"""Errors of the runs by motion and M."""


def make(request: Request) -> Outcome:
    """Track with every number of regions."""
    some = cases(request)
    curves = {case.motion: runs(request, case) for case in some}
    rows = [(motion, M, seed, one.rmse, one.angles, one.off) for motion, each in curves.items() for M, errors in each.items()
            for seed, one in zip(request.seeds, errors)]
    table = Table(("recording", "regions", "seed", "rmse_mm", "angles_deg", "lost_share"), rows)
    return Outcome({"regions": sorted({M for each in curves.values() for M in each}), "particles": 40}, {"figure_8": picture(curves)},
                   {"figure_8": table}, verdicts(curves))


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
    mean = {motion: {M: float(np.mean([one.rmse for one in errors])) for M, errors in each.items()} for motion, each in curves.items()}
    ends = "; ".join(f"{motion} " + ", ".join(f"{each[M]:.1f}" for M in sorted({min(each), REGIONS, max(each)} & set(each)))
                     for motion, each in mean.items())
    beyond = {motion: max((each[M] / each[REGIONS] - 1 for M in each if M > REGIONS), key=abs) for motion, each in mean.items()
              if REGIONS in each and max(each) > REGIONS}  # fmt: skip
    flat = [answer for each in curves.values() if REGIONS in each for M in each if M > REGIONS for answer in level(each[M], each[REGIONS])]
    good = [answer for each in curves.values() for answer in near_best(each)]
    worst = {motion: max(chosen) / min(each.values()) - 1 for motion, each in mean.items()
             if (chosen := [value for M, value in each.items() if RANGE[0] <= M <= RANGE[1]])}
    return [
        Verdict("The tracking error falls with M, by much while M is small", "VI, Fig. 8",
                f"mm with the least M, {REGIONS} and the greatest: {ends}", all_of([falls(each) for each in curves.values()]),
                "figure_8.png"),
        Verdict(f"Beyond M = {REGIONS} the tracking error is flat", "VI, Fig. 8", "with more it changes, at most, by "
                + ", ".join(f"{motion} {share:+.0%}" for motion, share in beyond.items()) + f" (flat: under {LEVEL:.0%})",
                all_of(flat) if flat else None, "figure_8.png"),
        Verdict("A good choice of M is 10 to 20", "VI, Fig. 8", "largest excess over the least error of any M: "
                + ", ".join(f"{share:+.0%}" for share in worst.values()) + f" (good: under {GOOD:.0%})",
                all_of(good) if good else None, "figure_8.png"),
    ]  # fmt: skip


def level(many: list[Errors], few: list[Errors]) -> list[bool | None]:
    """Whether the error with `many` regions is neither more nor less than with `few`, by the runs."""
    (first, second), limit = ([one.rmse for one in each] for each in (many, few)), LEVEL * float(np.mean([one.rmse for one in few]))
    return [difference(first, second).under(limit), difference(second, first).under(limit)]


def near_best(each: dict[int, list[Errors]]) -> list[bool | None]:
    """Whether the error of each choice in `RANGE` is near the least, by the runs."""
    rmse = {M: [one.rmse for one in errors] for M, errors in each.items()}
    least = min(rmse, key=lambda M: float(np.mean(rmse[M])))
    return [True if least == M else difference(rmse[M], rmse[least]).under(GOOD * float(np.mean(rmse[least])))
            for M in rmse if RANGE[0] <= M <= RANGE[1]]  # fmt: skip


def falls(each: dict[int, list[Errors]]) -> bool | None:
    """Whether the error is less with `REGIONS` than with the fewest."""
    least = min(each)
    if least >= REGIONS or REGIONS not in each:
        return None
    few, many = ([one.rmse for one in each[M]] for M in (least, REGIONS))
    return difference(few, many).greater
