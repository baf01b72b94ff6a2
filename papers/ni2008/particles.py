"""What VII says without showing it: that a plain particle filter would want some 10,000 particles for good results."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from papers.common.claims import Verdict, all_of, difference
from papers.common.experiment import Outcome, Request, Table
from papers.common.plotting import COLOURS, label, new_figure
from papers.ni2008.inputs import cases
from papers.ni2008.measures import Errors, of_runs
from papers.ni2008.tracks import Way, hybrid, of, particle_filter, tracks

PLAIN, HYBRID, FEW = (250, 1000, 10_000), (5, 10, 20, 40), 1000
"""Particles, and those of Table II."""
ENOUGH = 1.25
"""A result is good whose error is under this multiple of that of the hybrid with 40 particles."""
Curve = Mapping[tuple[str, int], list[Errors]]
"""Errors by method and number of particles."""


def make(request: Request) -> Outcome:
    """Both methods with few and many particles."""
    plain, some = ((50, 200), (5, 40)) if request.short else (PLAIN, HYBRID)
    ways: dict[tuple[str, int], Way] = {("particle filter", N): particle_filter(N) for N in plain}
    ways |= {("hybrid", N): hybrid(particles=N) for N in some}
    curves, rows = {}, []
    for case in cases(request):
        found = tracks(request, [case], list(ways.values()))
        curves[case.motion] = {key: of_runs(case, of(found, case, way)) for key, way in ways.items()}
        rows += [(case.motion, name, N, seed, track.pace, one.rmse, one.off) for (name, N), way in ways.items()
                 for seed, track, one in zip(request.seeds, of(found, case, way), curves[case.motion][name, N])]
    table = Table(("recording", "method", "particles", "seed", "seconds_a_frame", "rmse_mm", "lost_share"), rows)
    return Outcome({"particles": {"particle filter": list(plain), "hybrid": list(some)}}, {"particles": picture(curves)},
                   {"particles": table}, verdicts(curves, max(plain)))


def picture(curves: Mapping[str, Curve]):
    """A panel for each recording."""
    figure, panels = new_figure(1, len(curves), width=3.4 * len(curves) + 0.4, height=3.0)
    for axes, (motion, each) in zip(panels[0], curves.items()):
        for colour, name in zip(COLOURS, ("hybrid", "particle filter")):
            N = sorted(n for way, n in each if way == name)
            values = np.array([[one.rmse for one in each[name, n]] for n in N])
            axes.errorbar(N, values.mean(1), values.std(1), color=colour, marker="o", markersize=3, capsize=2, linewidth=1, label=name)
        axes.set_xscale("log")
        axes.set_yscale("log")
        label(axes, "particles", "RMSE of joint positions (mm)", motion)
    return figure


def verdicts(curves: Mapping[str, Curve], most: int) -> list[Verdict]:
    """1000 are too few; many more would do."""
    best = {motion: mean(each["hybrid", 40]) for motion, each in curves.items()}
    few = {motion: mean(each["particle filter", FEW]) for motion, each in curves.items() if ("particle filter", FEW) in each}
    many = {motion: mean(each["particle filter", most]) for motion, each in curves.items()}
    rule = f" (good: under {ENOUGH:g} times the hybrid's)"
    return [
        Verdict("1000 particles are not adequate for the plain filter", "VII", "; ".join(
            f"{motion} {value:.1f} mm, the hybrid {best[motion]:.1f}" for motion, value in few.items()) + rule,
            all_of([good(each, FEW, False) for each in curves.values() if ("particle filter", FEW) in each]) if few else None,
            "particles.png"),
        Verdict("With many more particles, perhaps 10,000, the plain filter gives good results", "VII", "; ".join(
            f"{motion} {value:.1f} mm with {most}" for motion, value in many.items()) + rule,
            all_of([good(each, most, True) for each in curves.values()]) if most >= 10 * FEW else None, "particles.png"),
    ]  # fmt: skip


def good(each: Curve, particles: int, wanted: bool) -> bool | None:
    """Whether the plain filter with this number of particles is good, or not good, as `wanted` says, by the runs."""
    plain, limit = [one.rmse for one in each["particle filter", particles]], ENOUGH * np.array([one.rmse for one in each["hybrid", 40]])
    return (difference(limit, plain) if wanted else difference(plain, limit)).greater


def mean(errors: list[Errors]) -> float:
    """RMSE, the mean over the runs, mm."""
    return float(np.mean([one.rmse for one in errors]))
