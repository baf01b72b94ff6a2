"""V: where tracking fails, does the search miss the pose of least cost, or has the true pose not the least? Eq. 2 of the body put at the
true joints, beside that of the filter's estimates, with each shape of the body."""

from __future__ import annotations

import numpy as np

from papers.common.claims import Verdict
from papers.common.experiment import Experiment, Outcome, Request, Table
from papers.common.plotting import COLOURS, label, new_figure
from papers.liu2011.material import Case, cases
from papers.liu2011.repeats import FAR, Runs, repeat
from papers.liu2011.shown import mark_parts, stem, told
from shadowpuppet.geometry import Array
from shadowpuppet.motion.metrics import UPPER_JOINTS
from shadowpuppet.tracking.silhouette_cost import Observation

BODIES = {"cardbox": "cards", "boxes": "closed boxes", "rounded": "hulls of ellipsoids"}
WITHIN = {"translation": 1.0, "rotation": np.pi}
"""Where a degree of freedom without limits is searched, metres or rad."""


def make(request: Request) -> Outcome:
    """A curve and a table a recording."""
    outcome = Outcome()
    for those in zip(*(cases(request, body=body) for body in BODIES)):
        runs = [repeat(request, case, case.tracker) for case in those]
        true = [costs_at(case, fitted(case)) for case in those]
        name = stem("true_poses", request, those[0])
        outcome.pictures[name] = draw(those[0], runs[0], true[0])
        outcome.tables[name] = Table(("motion", "body", "2D error at the true pose, px", "of the estimates, px",
                                      "frames in which the true pose costs more, %", "over 30 cm off, %"),
                                     [row for case, each, costs, body in zip(those, runs, true, BODIES.values())
                                      for row in rows(case, each, costs, body)], shown=True)
        outcome.verdicts.append(verdict(those[0], runs[0], true[0], f"{name}.png"))
        outcome.settings |= told(those[0])
    return outcome


def fitted(case: Case) -> Array:
    """Poses (T, D) of the body, within its limits, whose neck and arms are nearest to the truth's (least squares); not a number in frames
    without truth. Each begins at the one before, and at rest, and the nearer counts."""
    from scipy.optimize import least_squares

    picture, names = case.picture, ("neck", *UPPER_JOINTS)
    skeleton = picture.body.skeleton
    where = [picture.body.landmark_names.index(name) for name in names]
    bounds = np.array([(dof.low, dof.high) if np.isfinite(dof.low) else (-WITHIN[dof.kind], WITHIN[dof.kind]) for dof in skeleton.dofs]).T
    inside = bounds + 1e-6 * np.subtract(bounds[1], bounds[0]) * [[1], [-1]]  # an optimum's start may not lie on a bound
    rest = np.clip(skeleton.rest_and_spread[0], *inside)
    true, poses = case.true_places(names), np.full((len(case.times), len(skeleton.dofs)), np.nan)
    last = rest
    for n in np.flatnonzero(np.isfinite(true).all((1, 2))):
        def off(pose: Array, places: Array = true[n]) -> Array:
            return (picture.points_world(pose[None])[0, where] - places).ravel()

        tries = [least_squares(off, np.clip(start, *inside), bounds=tuple(bounds), xtol=1e-6, ftol=1e-6) for start in (last, rest)]
        last = poses[n] = min(tries, key=lambda found: found.cost).x
    return poses


def costs_at(case: Case, poses: Array) -> Array:
    """Eq. 2 of poses (T, D), one a frame, in pixels (T,), without legs as the filter has it."""
    costs = np.full(len(poses), np.nan)
    for n in np.flatnonzero(np.isfinite(poses).all(1)):
        seen = Observation.without_legs(case.masks[n], case.picture, poses[n])
        costs[n] = seen.cost_and_overlap(case.picture.draw(poses[n]))[0]
    return costs


def rows(case: Case, runs: Runs, true: Array, body: str) -> list[list]:
    """A row a motion."""
    errors, out = runs.errors(UPPER_JOINTS), []
    for part in case.parts:
        during = (case.times >= part.start) & (case.times <= part.end) & np.isfinite(true)
        out.append([part.name, body, f"{true[during].mean():.0f}", f"{runs.costs[:, during].mean():.0f}",
                    f"{100 * (true[during] > runs.costs[:, during]).mean():.0f}", f"{100 * (errors[:, during] > FAR).mean():.1f}"])
    return out


def draw(case: Case, runs: Runs, true: Array) -> object:
    """Both costs over the film, and the share of the joints that are far off."""
    figure, panels = new_figure(2, 1, 8, 2.4, sharex=True)
    panels[0, 0].plot(case.times, true, color="black", linewidth=1, label="the body at the true joints")
    panels[0, 0].plot(case.times, runs.costs.mean(0), color=COLOURS[0], linewidth=1,
                      label=f"estimates of DRS, mean of {len(runs.costs)} runs")
    panels[1, 0].plot(case.times, 100 * (runs.errors(UPPER_JOINTS) > FAR).mean((0, 2)), color=COLOURS[0], linewidth=1)
    label(panels[0, 0], "", "2D error (pixels)", "Does the true pose cost more than the estimate?")
    label(panels[1, 0], "seconds", "joints over 30 cm off (%)", legend=False)
    for n, axes in enumerate(panels[:, 0]):
        axes.set_ylim(bottom=0)
        mark_parts(axes, case, by_frame=False, named=n == 0)
    return figure


def verdict(case: Case, runs: Runs, true: Array, shown: str) -> Verdict:
    """Of the frames with a joint far off, in how many the filter missed a cheaper true pose."""
    far = (runs.errors(UPPER_JOINTS) > FAR).any(2) & np.isfinite(true)
    missed = float((true < runs.costs)[far].mean()) if far.any() else float("nan")
    return Verdict("Where a joint is far off, the filter has missed a true pose that costs less", "ours",
                   f"{case.name}, cards: of {int(far.sum())} such frames of all runs the true pose costs less in {100 * missed:.0f} %, "
                   "else more: there the body's shape is to blame, not the search", missed > 0.5 if far.any() else None, shown, own=True)


EXPERIMENT = Experiment("true_poses", "V: eq. 2 of the true poses and of the found ones", "two minutes", make, runs=10, short_runs=2)
