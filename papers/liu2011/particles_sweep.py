"""The number of particles N of each stage, from 25 to 3,200, with DRS and with SRS."""

from __future__ import annotations

from papers.common.claims import Verdict, difference
from papers.common.experiment import Experiment, Outcome, Request, Table
from papers.common.plotting import new_figure
from papers.liu2011.material import Case, cases
from papers.liu2011.repeats import METHODS, repeat, with_method
from papers.liu2011.shown import stem, told
from papers.liu2011.sweeps import COLUMNS, Measured, cells, finish, measured, plot

NUMBERS, FEW = (25, 50, 100, 200, 400, 800, 1600, 3200), (25, 200)
PAPER = 200
SMALL_GAIN = 0.2
"""Share of the 3D error that the most particles save at most, where the paper's number is called enough."""
SHOWN = ("error", "cost", "far")

Sweep = dict[tuple[str, int], Measured]
"""By method and number."""


def make(request: Request) -> Outcome:
    """The sweep for each recording."""
    outcome, numbers = Outcome(), FEW if request.short else NUMBERS
    for case in cases(request):
        found = sweep(request, case, numbers)
        name = stem("particles_sweep", request, case)
        outcome.pictures[name] = draw(found, numbers)
        outcome.tables[name] = Table(("method", "N", *COLUMNS), [[*key, *cells(each)] for key, each in found.items()])
        outcome.verdicts += verdicts(found, numbers, f"{name}.png")
        outcome.settings |= told(case)
    return outcome


def sweep(request: Request, case: Case, numbers: tuple[int, ...]) -> Sweep:
    """Every number with either method."""
    return {(method, n): measured(repeat(request, case, with_method(case.tracker, method, particles=n)))
            for method in METHODS for n in numbers}


def draw(found: Sweep, numbers: tuple[int, ...]) -> object:
    """A panel a measure, a line a method."""
    figure, panels = new_figure(1, len(SHOWN), 11, 3.2)
    for axes, what in zip(panels[0], SHOWN):
        for n, method in enumerate(METHODS):
            plot(axes, numbers, [found[method, number] for number in numbers], what, n, label=method)
        axes.set_xscale("log")
        axes.minorticks_off()
        axes.set_xticks(numbers, [str(number) for number in numbers], fontsize=7)
        axes.axvline(PAPER, color="0.6", linestyle="--", linewidth=0.7)
    finish(panels[0], SHOWN, "particles of each stage, N", f"{len(found['DRS', PAPER].error)} runs each; dashed: the paper's {PAPER}")
    return figure


def verdicts(found: Sweep, numbers: tuple[int, ...], shown: str) -> list[Verdict]:
    """The paper's V-B-2: few particles are enough for DRS."""
    paper, most = found["DRS", PAPER], found["DRS", numbers[-1]]
    gain = 1 - most.error.mean() / paper.error.mean()
    as_good = [n for n in numbers if difference(found["SRS", n].cost, paper.cost).greater is not True]
    reached = f"SRS has that 2D error from N = {as_good[0]} on" if as_good else f"SRS has a greater 2D error with N = {numbers[-1]}, too"
    return [
        Verdict("DRS tracks reliably with few particles (200 a stage)", "V-B-2",
                f"3D error {paper.error.mean():.0f} mm with N = {PAPER}, {most.error.mean():.0f} mm with N = {numbers[-1]}: "
                f"{100 * gain:.0f} % less; under {100 * SMALL_GAIN:.0f} % counts as enough", bool(gain < SMALL_GAIN), shown),
        Verdict("With as many particles DRS is better than SRS", "VI",
                f"2D error with N = {PAPER}: DRS {paper.cost.mean():.0f} px, SRS {found['SRS', PAPER].cost.mean():.0f} px; {reached}",
                difference(found["SRS", PAPER].cost, paper.cost).greater, shown),
    ]  # fmt: skip


EXPERIMENT = Experiment("particles_sweep", "N from 25 to 3,200 particles a stage, DRS and SRS", "2 minutes", make, runs=10, short_runs=2)
