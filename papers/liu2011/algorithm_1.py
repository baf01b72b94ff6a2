"""Algorithm 1 as printed, and what each of our changes does: sizes found from the three reference pictures, against the true ones.

Reference pictures are drawn by the cardbox of made people, so that all 18 sizes are known; the distance is given. Four of our changes come
one by one: the best hypothesis of all rounds is kept, noise shrinks from round to round, sizes are pulled to published proportions, and a
hypothesis changes some sizes only, in three passes.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from papers.common.experiment import Experiment, Outcome, Request, Table
from papers.common.plotting import COLOURS, label, new_figure
from shadowpuppet.body.anthropometry import sizes_from_height
from shadowpuppet.body.sizes import SUBSETS, CardboxSizes
from shadowpuppet.camera.camera import Camera
from shadowpuppet.settings import plain_values
from shadowpuppet.tracking.monocular.initialization import POSTURES, PersonEstimate, SizeFit, fit_references
from shadowpuppet.tracking.monocular.settings import InitializationSettings, make_initialization, pixel_scale

CAMERA = Camera.from_fov((320, 240), np.radians(46), "cam")
HEIGHTS, DISTANCE, ELEVATION = (1.55, 1.95), 2.8, 0.1
"""Range of statures, distance of the body and height of the torso's lower edge over the camera, metres."""
SPREAD = 0.08
"""Standard deviation of a person's sizes over the average of the stature."""
PRINTED = make_initialization("liu2011_printed")
WAYS: dict[str, InitializationSettings] = {
    "as printed": PRINTED,
    "and memory": replace(PRINTED, memory=True),
    "and less noise by rounds": replace(PRINTED, memory=True, shrink=0.9),
    "and a prior": replace(PRINTED, memory=True, shrink=0.9, prior_weight=15.0),
    "and some sizes, three passes (default)": InitializationSettings(),
}
"""From Algorithm 1 to ours, one change after another."""
SHOWN = ("as printed", "and memory", "and some sizes, three passes (default)")
"""Whose costs are drawn."""


class Found(NamedTuple):
    """A search of one person's sizes."""

    errors: np.ndarray
    """Found less true sizes, (18,), metres."""
    fit: SizeFit

    @property
    def mean(self) -> float:
        """Mean absolute error, millimetres."""
        return float(1000 * np.abs(self.errors).mean())

    @property
    def rounds(self) -> int:
        """Rounds of all searches."""
        return sum(len(curve) for curves in self.fit.curves.values() for curve in curves)


def make(request: Request) -> Outcome:
    """Every way for every person, who has the run's seed."""
    found = {name: [search(seed, _quick(settings) if request.short else settings) for seed in request.seeds]
             for name, settings in WAYS.items()}
    rows = [[name, *(cell(runs, names) for names in (CardboxSizes.names(), *SUBSETS.values())), round(float(np.mean(overlaps(runs))), 3),
             round(float(np.mean([run.rounds for run in runs])))] for name, runs in found.items()]
    columns = ("search", "all 18, mm", "O1 (front), mm", "O2 (side), mm", "O3 (arms), mm", "overlap", "rounds")
    average = 1000 * np.mean([average_error(seed) for seed in request.seeds])
    said = [f"{len(request.seeds)} people; mean absolute errors of the sizes, and the standard deviation of the people's means. Average "
            f"sizes for the stature are off by {average:.0f} mm."]
    settings: dict[str, Any] = {name: plain_values(each) for name, each in WAYS.items()}
    return Outcome(settings, {"algorithm_1": draw(found)}, {"algorithm_1": Table(columns, rows, shown=True)}, said=said)


def person(seed: int) -> tuple[CardboxSizes, float]:
    """Sizes of a made person, and the stature, metres."""
    rng = np.random.default_rng([seed, 11])
    height = float(rng.uniform(*HEIGHTS))
    average = sizes_from_height(height)
    return CardboxSizes.from_array(average.to_array() * (1 + SPREAD * rng.standard_normal(len(CardboxSizes.names())))), height


def average_error(seed: int) -> float:
    """Mean absolute error of average sizes, metres."""
    sizes, height = person(seed)
    return float(np.abs(sizes.to_array() - sizes_from_height(height).to_array()).mean())


def search(seed: int, settings: InitializationSettings) -> Found:
    """A person's sizes from the three reference pictures."""
    sizes, height = person(seed)
    picture = PersonEstimate(sizes, height, DISTANCE, ELEVATION).picture(CAMERA, "cardbox")
    masks = {name: picture.mask(picture.body.skeleton.pose(**angles)) for name, angles in POSTURES.items()}
    fit = fit_references(np.random.default_rng([seed, 12]), CAMERA, masks, height=height, distance=DISTANCE, body="cardbox",
                         settings=settings)
    assert isinstance(fit.guess.sizes, CardboxSizes)
    return Found(fit.guess.sizes.to_array() - sizes.to_array(), fit)


def overlaps(runs: list[Found]) -> list[float]:
    """Mean overlap of each run's three pictures."""
    return [float(np.mean([*run.fit.overlaps.values()])) for run in runs]


def cell(runs: list[Found], names: tuple[str, ...]) -> str:
    """Mean error of some sizes, and its standard deviation over the people, millimetres."""
    chosen = [CardboxSizes.names().index(name) for name in names]
    means = [1000 * np.abs(run.errors[chosen]).mean() for run in runs]
    return f"{np.mean(means):.1f} ± {np.std(means):.1f}"


def draw(found: dict[str, list[Found]]) -> object:
    """Left the error of every person; right the least cost so far by round, of the first person's three subsets."""
    figure, panels = new_figure(1, 2, 11, 3.4, gridspec_kw={"width_ratios": [1.2, 1]})
    left, right = panels[0]
    for n, runs in enumerate(found.values()):
        errors = [run.mean for run in runs]
        left.plot(errors, np.full(len(errors), n) + np.linspace(-0.2, 0.2, len(errors)), "o", color=COLOURS[n % len(COLOURS)], ms=3)
        left.plot([np.mean(errors)] * 2, [n - 0.35, n + 0.35], color="0.3", linewidth=1.2)
    left.set_yticks(range(len(found)), list(found), fontsize=7)
    left.invert_yaxis()
    label(left, "mean error of the 18 sizes, mm", "", "a dot a person", legend=False)
    for n, name in enumerate(SHOWN):
        curves = [curve for searches in found[name][0].fit.curves.values() for curve in searches[:1]]
        for k, curve in enumerate(curves):
            right.plot(np.arange(1, len(curve) + 1), np.array(curve) / pixel_scale(CAMERA.size), color=COLOURS[n],
                       label=name if not k else None)
    right.set_yscale("log")
    label(right, "round", "least cost so far, pixels", "O1, O2, O3 of one person, first pass")
    return figure


def _quick(settings: InitializationSettings) -> InitializationSettings:
    return replace(settings, hypotheses=40, rounds=6, patience=3)


EXPERIMENT = Experiment("algorithm_1", "Algorithm 1: sizes from reference pictures, as printed and with our changes", "1 minute", make,
                        runs=20, short_runs=2)
