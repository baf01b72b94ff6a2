"""What the paper leaves open and we chose: bounds and number of the forces' iterations, and the noise of the plain particle filters.

Chosen on other made people than those that the rest tracks, by exact silhouettes: walking, jogging and boxing learnt from another
performance of the same, and boxing learnt from other movements. The rule: of the candidates whose geometric mean of the RMSE over these
recordings and seeds is within `ALIKE` of the least, those with the fewest iterations, and of these the best.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from papers.common.experiment import Outcome, Request, Table
from papers.ni2008.inputs import SHORT, Case, Source, load
from papers.ni2008.measures import of_runs
from papers.ni2008.recordings import humaneva
from papers.ni2008.tracks import FORCES_FROM_TRUTH, Track, Way, annealed, of, particle_filter, tracks
from shadowpuppet.synthetic import Mannequin
from shadowpuppet.synthetic.spec_changes import parse_gestures
from shadowpuppet.tracking.multiview.settings import make_multiview_settings

ALIKE = 0.03
"""Candidates within this share of the least mean are alike."""
FRAMES, PEOPLE = 60, (("walking", "woman"), ("jogging", "man"), ("boxing", "woman"))
OTHER = "random_body 6"
"""The movements that a second boxing learns from."""
BOUNDS = ((0.06, 0.06, 20), (0.1, 0.03, 40), (0.06, 0.03, 80), (0.1, 0.03, 80), (0.1, 0.1, 80), (0.1, 0.03, 160))
"""Coarse and fine bound (m) of the forces, largest number of iterations."""
NOISE, FIRST_NOISE = (0.02, 0.035, 0.05, 0.1), (0.05, 0.1, 0.2)
"""Of the plain filter, and of the annealed one's first cycle (rad)."""


class Choice(NamedTuple):
    """One thing to choose."""

    what: str
    candidates: Mapping[str, Way]
    taken: str
    """The candidate that the other experiments have."""

    @property
    def few(self) -> Choice:
        """Of the first candidate and the one that is taken."""
        first = next(iter(self.candidates))
        return self._replace(candidates={name: self.candidates[name] for name in dict.fromkeys((first, self.taken))})


class Row(NamedTuple):
    """A candidate over all recordings."""

    mean: float
    """Geometric mean of the RMSE, mm."""
    iterations: int
    """Of the forces, at most; 0 without forces."""
    seconds: float
    """A frame."""
    each: Sequence[float]
    """Geometric means by recording."""


def make(request: Request) -> Outcome:
    """Run all candidates."""
    some = [load(request, source) for source in people(request)]
    wanted = [each.few if request.short else each for each in choices()]
    done = tracks(request, some, [way for choice in wanted for way in choice.candidates.values()] + [FORCES_FROM_TRUTH])
    rows, said, shown, settings = [], list[str](), list[tuple](), {}
    for choice in wanted:
        found = {name: over(done, some, way) for name, way in choice.candidates.items()}
        best = chosen(found)
        said.append(f"{choice.what}: by the rule {best}; the experiments have {choice.taken}.")
        settings[choice.what] = {"by the rule": best, "taken": choice.taken}
        shown += [(choice.what, name, *(f"{value:.1f}" for value in (row.mean, *row.each)), f"{row.seconds:.3f}", "yes" * (name == best))
                  for name, row in found.items()]
        rows += [(choice.what, name, case.name, value) for name, row in found.items() for case, value in zip(some, row.each)]
    floor = over(done, some, FORCES_FROM_TRUTH)
    said.append("The forces of the preset leave true poses, mm off: " + ", ".join(
        f"{case.name.removeprefix('choice_').replace('_', ' ')} {value:.1f}" for case, value in zip(some, floor.each)) + ".")
    names = [case.name.removeprefix("choice_").replace("_", " ") for case in some]
    tables = {"choices": Table(("what", "candidate", "mean, mm", *names, "seconds a frame", "chosen"), shown, shown=True),
              "choices_runs": Table(("what", "candidate", "recording", "rmse_mm"), rows)}
    return Outcome(settings | {"alike": ALIKE}, {}, tables, [], said)


def choices() -> list[Choice]:
    """What is chosen, among what."""
    preset = make_multiview_settings("ni2008").forces
    forces = {_told(*each): Way("hybrid", {"forces": dict(zip(("coarse_tau", "fine_tau", "iterations"), each))}) for each in BOUNDS}
    found = [Choice("bounds of the forces", forces, _told(preset.coarse_tau, preset.fine_tau, preset.iterations))]
    for what, make_way, noise in (("noise of the particle filter", particle_filter, NOISE),
                                  ("first noise of the annealed particle filter", annealed, FIRST_NOISE)):
        found.append(Choice(what, {f"{sigma:g} rad": make_way(sigma=sigma) for sigma in noise},
                            f"{make_way().settings['sigma_rotation']:g} rad"))
    return found


def _told(coarse: float, fine: float, iterations: int) -> str:
    return f"{coarse:g} and {fine:g} m, at most {iterations} iterations"


def people(request: Request) -> list[Source]:
    """The made people, drawn as silhouettes."""
    found = []
    for n, (spec, (motion, kind)) in enumerate(zip(humaneva(), PEOPLE, strict=True)):
        body = Mannequin.draw(np.random.default_rng([5, n]), kind)  # pyright: ignore[reportArgumentType]
        assert spec.ring is not None
        one = replace(spec, name=f"choice_{motion}", body=body, frames=SHORT["frames"] if request.short else FRAMES, seed=(5, n),
                      ring=replace(spec.ring, seed=50 + n))
        found.append(one if not request.short else replace(one, training_frames=SHORT["training"]))
    found.append(replace(found[-1], name="choice_boxing_of_other_movements", training=parse_gestures(OTHER)))
    if request.short:
        return [Source(spec.name, None, spec, factor=SHORT["factor"]) for spec in found[-1:]]
    return [Source(spec.name, None, spec) for spec in found]


def over(found: Mapping[tuple[str, str], list[Track]], some: Sequence[Case], way: Way) -> Row:
    """A candidate's errors."""
    each = [_middle([one.rmse for one in of_runs(case, of(found, case, way))]) for case in some]
    paces = [track.pace for case in some for track in of(found, case, way)]
    return Row(_middle(each), way.settings.get("forces", {}).get("iterations", 0), float(np.mean(paces)), each)


def _middle(values: Sequence[float]) -> float:
    """The geometric mean."""
    return float(np.exp(np.mean(np.log(values))))


def chosen(found: Mapping[str, Row]) -> str:
    """By the rule."""
    least = min(row.mean for row in found.values())
    alike = {name: row for name, row in found.items() if row.mean <= (1 + ALIKE) * least}
    return min(alike, key=lambda name: (alike[name].iterations, alike[name].mean))
