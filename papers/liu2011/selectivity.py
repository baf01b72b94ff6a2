"""Why SRS falls behind: how much its weights tell at Table I's sigma_gamma, other sigma_gamma, and other readings of the paper."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from papers.common.claims import Verdict, all_of, difference
from papers.common.experiment import Experiment, Outcome, Request, Table
from papers.common.plotting import COLOURS, new_figure
from papers.liu2011.material import Case, cases
from papers.liu2011.repeats import METHODS, repeat, with_method
from papers.liu2011.shown import stem, told
from papers.liu2011.sweeps import COLUMNS, Measured, cells, finish, measured, plot
from shadowpuppet.tracking.monocular.settings import MonocularSettings
from shadowpuppet.tracking.monocular.tracker import MonocularTracker
from shadowpuppet.tracking.resampling import normalise

SHARES, FEW = (1.0, 0.5, 0.25, 0.125, 0.0625, 0.03125), (1.0, 0.0625)
"""Of Table I's sigma_gamma, 8000 and 4000 pixels."""
READINGS = {"as in the preset": {}, "arms drawn with the torso": {"torso_arms": "last"},
            "ranked in the new picture (eq. 8)": {"rank_by": "new"}, "no joint limits": {"limits": False}}  # fmt: skip
"""What the paper leaves open, or can be read otherwise."""
SELECTIVE = 0.5
"""Share of the particles that count (the effective number) from which on weights hardly select."""
SHOWN = ("error", "cost", "far")

Sweep = dict[float | str, Measured]
"""By the share of Table I's sigma_gamma; `DRS`."""
Readings = dict[tuple[str, str], Measured]
"""By reading and method."""


def make(request: Request) -> Outcome:
    """Both for each recording."""
    outcome, shares = Outcome(), FEW if request.short else SHARES
    for case in cases(request):
        name = stem("selectivity", request, case)
        found = sweep(request, case, shares)
        readings = {(reading, method): measured(repeat(request, case, with_reading(case, reading, method)))
                    for reading in READINGS for method in METHODS}
        outcome.pictures[name] = draw(found, shares)
        outcome.tables[name] = Table(("sigma_gamma_share", *COLUMNS), [[share, *cells(each)] for share, each in found.items()])
        outcome.tables[f"{name}_readings"] = table(readings)
        outcome.verdicts += verdicts(found, readings, shares, effective(case), f"{name}.png")
        outcome.settings |= told(case)
    return outcome


def with_share(settings: MonocularSettings, share: float) -> MonocularSettings:
    """SRS, with a share of Table I's sigma_gamma."""
    torso, arm = (replace(part, sigma_cost=share * part.sigma_cost) for part in (settings.torso, settings.arm))
    return replace(with_method(settings, "SRS"), torso=torso, arm=arm)


def with_reading(case: Case, reading: str, method: str) -> MonocularSettings:
    """Another reading of the paper, with either method."""
    return replace(with_method(case.tracker, method), **READINGS[reading])


def sweep(request: Request, case: Case, shares: tuple[float, ...]) -> Sweep:
    """SRS with every share, and DRS, which has no sigma_gamma."""
    found: Sweep = {share: measured(repeat(request, case, with_share(case.tracker, share))) for share in shares}
    return found | {"DRS": measured(repeat(request, case, case.tracker))}


def effective(case: Case) -> float:
    """Share of an arm's particles that count in SRS at Table I, 1 / (N sum w^2), median over frames: 1 where all weigh the same."""
    tracker, rng = MonocularTracker(case.picture, with_method(case.tracker, "SRS")), np.random.default_rng(0)
    state, shares = tracker.start(rng, case.masks[0]), []
    for mask in case.masks[1:]:
        state = tracker.cycle(rng, state, mask)
        for particles in state.particles[1:]:
            weights = normalise(particles.log_weights)
            shares.append(1 / (len(weights) * (weights**2).sum()))
    return float(np.median(shares))


def draw(found: Sweep, shares: tuple[float, ...]) -> object:
    """SRS against sigma_gamma, with DRS's level."""
    figure, panels = new_figure(1, len(SHOWN), 11, 3.2)
    for axes, what in zip(panels[0], SHOWN):
        plot(axes, [8000 * share for share in shares], [found[share] for share in shares], what, 1, label="SRS")
        axes.axhline(getattr(found["DRS"], what).mean(), color=COLOURS[0], linewidth=1, label="DRS (has no sigma)")
        axes.set_xscale("log")
        axes.minorticks_off()
        axes.set_xticks([8000 * share for share in shares], [f"{8000 * share:g}" for share in shares], fontsize=7)
    title = f"{len(found['DRS'].error)} runs each; arms have half the sigma; Table I: 8000"
    finish(panels[0], SHOWN, "sigma_gamma of the torso (pixels)", title)
    return figure


def table(readings: Readings) -> Table:
    """A row a reading."""
    columns = ["reading", *(f"{method}: {what}" for what in ("3D error, mm", "2D error, px") for method in METHODS)]
    return Table(columns, [[reading, *(f"{getattr(readings[reading, method], what).mean():.0f}" for what in ("error", "cost")
                                       for method in METHODS)] for reading in READINGS], shown=True)


def verdicts(found: Sweep, readings: Readings, shares: tuple[float, ...], kept: float, shown: str) -> list[Verdict]:
    """The paper's IV-C-2 and VI."""
    best = min(shares, key=lambda share: found[share].error.mean())
    drs, srs, tuned = found["DRS"], found[1.0], found[best]
    answers = [difference(readings[reading, "SRS"].error, readings[reading, "DRS"].error).greater for reading in READINGS]
    return [
        Verdict("A Gaussian of the cost selects badly, because no model fits a person well", "IV-C-2",
                f"at Table I's sigma_gamma {100 * kept:.0f} % of an arm's particles are effective (median); over "
                f"{100 * SELECTIVE:.0f} % means hardly selective", kept > SELECTIVE, shown),
        Verdict("DRS is better than SRS, whichever way the paper is read", "VI",
                f"lower 3D error in {answers.count(True)} of {len(answers)} readings", all_of(answers), shown),
        Verdict("DRS is better than SRS with the best of several sigma_gamma", "ours",
                f"3D error: DRS {drs.error.mean():.0f} mm, SRS {srs.error.mean():.0f} mm with Table I's sigma_gamma, "
                f"{tuned.error.mean():.0f} mm with {best:g} of it", difference(tuned.error, drs.error).greater, shown, own=True),
    ]  # fmt: skip


EXPERIMENT = Experiment("selectivity", "IV-C: selectivity of SRS's weights, other sigma_gamma, other readings of the paper", "a minute",
                        make, runs=10, short_runs=2)
