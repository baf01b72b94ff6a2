"""Fig. 4: what a pose loses by being told in a region and three numbers, against the number of regions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from papers.common.claims import Verdict
from papers.common.experiment import Outcome, Request, Table
from papers.common.plotting import COLOURS, label, new_figure
from papers.ni2008.inputs import Case, cases
from papers.ni2008.tracks import DIMENSIONS, REGIONS, learn, most_regions
from shadowpuppet.geometry import Array
from shadowpuppet.motion.prior.vqpca import reconstruction_error

TRIED = (5, 10, 15, 20, 30, 40, 60, 80)
"""M of Figs. 4 and 8."""
LOW, FLAT = 0.1, 0.1
"""An error is quite low that is less than this share of how much the poses vary; a curve is flat that falls less than this share as steeply
as it did before."""


class Curve(NamedTuple):
    """Errors of one case, degrees."""

    regions: list[int]
    """M, K of them."""
    training: Array
    """Of the poses that were learnt from, of shape (R, K)."""
    unseen: Array
    """Of those of the recording."""
    varies: float
    """Root mean square deviation of the training poses from their mean."""


def make(request: Request) -> Outcome:
    """Learn, encode, reconstruct."""
    curves = {case.motion: curve(case, request.seeds, tried(request)) for case in cases(request)}
    rows = [(motion, M, seed, each.training[n, k], each.unseen[n, k]) for motion, each in curves.items()
            for n, seed in enumerate(request.seeds) for k, M in enumerate(each.regions)]
    table = Table(("recording", "regions", "seed", "training_deg", "unseen_deg"), rows)
    settings = {"dimensions": DIMENSIONS, "regions": list(tried(request))}
    return Outcome(settings, {"figure_4": picture(curves)}, {"figure_4": table}, verdicts(curves), [said(*each) for each in curves.items()])


def tried(request: Request) -> Sequence[int]:
    """Numbers of regions."""
    return (5, 20, 40) if request.short else TRIED


def curve(case: Case, seeds: Sequence[int], regions: Sequence[int]) -> Curve:
    """Errors by seed and number of regions."""
    possible = [M for M in regions if most_regions(case) >= M]
    columns = case.body.skeleton.dof_indices(learn(case, possible[0], seeds[0]).prior.names)
    poses, film = case.training[:, columns], case.true_poses[:, columns]
    film = film[np.isfinite(film).all(1)]
    errors = np.array([[[reconstruction_error(learn(case, M, seed).prior, [each]) for M in possible] for seed in seeds]
                       for each in (poses, film)])
    training, unseen = np.degrees(errors)
    return Curve(possible, training, unseen, float(np.degrees(poses.std(0).mean())))


def picture(curves: dict[str, Curve]):
    """As in the paper, and beside it the same of poses that were not learnt from."""
    figure, panels = new_figure(1, 2, width=9)
    for colour, (motion, each) in zip(COLOURS, curves.items()):
        for axes, errors in zip(panels[0], (each.training, each.unseen)):
            axes.errorbar(each.regions, errors.mean(0), errors.std(0), color=colour, marker="o", markersize=3, capsize=2, linewidth=1,
                          label=motion)
    for axes, title in zip(panels[0], ("training poses, as in Fig. 4", "poses of the recording, which it has not learnt")):
        axes.axvline(REGIONS, color="0.7", linestyle=":", linewidth=1)
        axes.set_ylim(bottom=0)
        label(axes, "number of Voronoi regions M", "average reconstruction error (degrees)", title)
    return figure


def verdicts(curves: dict[str, Curve]) -> list[Verdict]:
    """What the paper says of the curves."""
    low = {motion: float(at(each, each.training, REGIONS)) for motion, each in curves.items()}
    steep = {motion: steepness(each, each.training) for motion, each in curves.items()}
    unseen = "; ".join(f"{motion} {10 * before:.2f}° and {10 * after:.2f}°" for motion, (before, after) in
                       ((motion, steepness(each, each.unseen)) for motion, each in curves.items()))  # fmt: skip
    return [
        Verdict(f"At M = {REGIONS} the average reconstruction error is already quite low", "VI, Fig. 4",
                "; ".join(f"{motion} {low[motion]:.2f}° of poses that vary by {each.varies:.1f}°" for motion, each in curves.items())
                + f" (low: under {LOW:.0%} of it)",
                all(low[motion] < LOW * each.varies for motion, each in curves.items()), "figure_4.png"),
        Verdict(f"The reconstruction error is flat from M = {REGIONS} on", "VI, Fig. 4",
                f"decrease for every ten regions, before M = {REGIONS} and after: " + "; ".join(
                    f"{motion} {10 * before:.3f}° and {10 * after:.3f}°" for motion, (before, after) in steep.items())
                + f" (flat: under {FLAT:.0%} of it); for other than training poses: {unseen}",
                all(after < FLAT * before for before, after in steep.values()), "figure_4.png"),
    ]  # fmt: skip


def steepness(each: Curve, errors: Array) -> tuple[float, float]:
    """How much the mean error falls by each region, up to `REGIONS` and beyond, degrees."""
    means, M = errors.mean(0), each.regions
    middle = at(each, errors, REGIONS)
    return float((means[0] - middle) / max(REGIONS - M[0], 1)), float((middle - means[-1]) / max(M[-1] - REGIONS, 1))


def at(each: Curve, errors: Array, regions: int) -> float:
    """Mean error with so many regions, or the most below."""
    return float(errors.mean(0)[max(k for k, M in enumerate(each.regions) if regions >= M)])


def said(motion: str, each: Curve) -> str:
    """What the training error does not tell."""
    learnt, unseen, M = each.training.mean(0), each.unseen.mean(0), each.regions
    return (f"{motion}: with {M[-1]} regions the error of the training poses is {learnt[-1]:.2f}°, of the recording's {unseen[-1]:.1f}°; "
            f"the latter is least with M = {M[int(unseen.argmin())]} ({unseen.min():.1f}°).")
