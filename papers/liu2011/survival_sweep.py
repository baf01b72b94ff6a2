"""The survival rate e from 0 to 1, which the paper argues about without showing it, on slow and on fast motion."""

from __future__ import annotations

from papers.common.claims import Verdict, all_of, difference
from papers.common.experiment import Experiment, Outcome, Request, Table
from papers.common.plotting import COLOURS, new_figure
from papers.liu2011.material import Case, cases
from papers.liu2011.repeats import repeat, with_method
from papers.liu2011.shown import stem, told
from papers.liu2011.sweeps import COLUMNS, Measured, cells, finish, measured, plot

RATES, FEW = (0.0, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0), (0.0, 0.4, 1.0)
"""Of torso and arms alike."""
SPEEDS = (1, 3)
"""Every so manieth frame is seen: motion is faster by so much, from frame to frame."""
TABLE_I = "Table I"
SHOWN = ("error", "cost", "far")

Sweep = dict[tuple[int, float | str], Measured]
"""By speed, and rate or `TABLE_I`."""


def make(request: Request) -> Outcome:
    """The sweep for each recording."""
    outcome = Outcome()
    rates = FEW if request.short else RATES
    for case in cases(request):
        found = sweep(request, case, rates, SPEEDS)
        name = stem("survival_sweep", request, case)
        outcome.pictures[name] = draw(found, rates, SPEEDS)
        outcome.tables[name] = Table(("speed", "e", *COLUMNS), [[speed, e, *cells(each)] for (speed, e), each in found.items()])
        outcome.verdicts += verdicts(found, rates, SPEEDS, f"{name}.png")
        outcome.settings |= told(case)
    outcome.said.append(f"Faster motion is the same film with frames left out. {TABLE_I}: 0.2 for the torso, 0.4 for the arms (dashed).")
    return outcome


def sweep(request: Request, case: Case, rates: tuple[float, ...], speeds: tuple[int, ...]) -> Sweep:
    """Every rate at every speed."""
    found: Sweep = {}
    for speed in speeds:
        for e in (*rates, TABLE_I):
            settings = case.tracker if e == TABLE_I else with_method(case.tracker, "DRS", survival=e)
            found[speed, e] = measured(repeat(request, case, settings, speed))
    return found


def draw(found: Sweep, rates: tuple[float, ...], speeds: tuple[int, ...]) -> object:
    """A panel a measure, a line a speed."""
    figure, panels = new_figure(1, len(SHOWN), 11, 3.2)
    for axes, what in zip(panels[0], SHOWN):
        for n, speed in enumerate(speeds):
            plot(axes, rates, [found[speed, e] for e in rates], what, n, label=f"{speed} x as fast" if speed > 1 else "as filmed")
            axes.axhline(getattr(found[speed, TABLE_I], what).mean(), color=COLOURS[n], linestyle="--", linewidth=0.7)
    finish(panels[0], SHOWN, "survival rate e", f"DRS, {len(found[1, TABLE_I].error)} runs each")
    return figure


def verdicts(found: Sweep, rates: tuple[float, ...], speeds: tuple[int, ...], shown: str) -> list[Verdict]:
    """The paper's V: two extremes, and a compromise."""
    fast = speeds[-1]
    none, some, every = found[fast, 0.0], found[fast, TABLE_I], found[1, 1.0]
    slow = found[1, TABLE_I]
    between = [found[1, e].error.mean() for e in rates if e < 1]
    ends = [difference(none.error, some.error).greater, difference(every.error, slow.error).greater]
    return [
        Verdict("With e near 0 fast motion is lost", "V",
                f"{fast} x as fast, joints over 30 cm off: {none.far.mean():.1f} % with e = 0, {some.far.mean():.1f} % with {TABLE_I}'s "
                f"(as filmed {found[1, 0.0].far.mean():.1f} and {slow.far.mean():.1f} %)", difference(none.far, some.far).greater, shown),
        Verdict("With e = 1 particles are scattered and do not converge", "V",
                f"2D error {every.cost.mean():.0f} px with e = 1, {slow.cost.mean():.0f} px with {TABLE_I}'s; 3D error "
                f"{every.error.mean():.0f} and {slow.error.mean():.0f} mm", difference(every.cost, slow.cost).greater, shown),
        Verdict("A good e is a compromise between both ends", "V, Table I",
                f"3D error as filmed: {TABLE_I} {slow.error.mean():.0f} mm, any e under 1 {min(between):.0f} to {max(between):.0f} mm; "
                f"{fast} x as fast: {TABLE_I} {some.error.mean():.0f} mm, e = 0 {none.error.mean():.0f} mm", all_of(ends), shown),
    ]  # fmt: skip


EXPERIMENT = Experiment("survival_sweep", "V: survival rate e from 0 to 1 on slow and fast motion", "a minute", make, runs=10,
                        short_runs=2)
