"""Figures of the several-camera tracker: seven cameras of 640 x 480, 40 particles, 2,000 surface points."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

from shadowpuppet.geometry import Array
from shadowpuppet.tracking.multiview.settings import ForceSettings, make_multiview_settings

from . import naive_multi
from .chain import chain_figures, measure_chain
from .extent import Extent
from .multi_cases import MultiCase, MultiFollower
from .timing import Contender, Figures, Times, in_turns

FORCE_ITERATIONS, SOLVE_ITERATIONS = 20, 5
"""Iterations in a timed call."""
CORES = 2
"""Cores for the whole chain: films are decoded while the tracker works."""
FIGURES = Figures(
    times={"multi.hull_ms": (1e3, "hull"), "multi.force_us": (1e6, "forces"), "multi.gauss_newton_us": (1e6, "gauss_newton"),
           "multi.naive_force_us": (1e6, "naive_forces"), "multi.naive_gauss_newton_us": (1e6, "naive_gauss_newton")},
    rates={"multi.forces_fps": "forces_frame", "multi.fps": "default_frame"},
    ratios={"multi.ratio_naive": ("naive_forces", "forces"), "multi.ratio_naive_gauss_newton": ("naive_gauss_newton", "gauss_newton")},
)  # fmt: skip


def run_multi(extent: Extent) -> tuple[dict[str, Any], dict[str, Times]]:
    """All `multi.*` figures by flat keys, and the times they come from. Raises `ShadowPuppetError` if a part of it fails."""
    print("... several cameras, in turns", file=sys.stderr)
    case = extent.case
    raw = in_turns(contenders(case), extent.rounds_multi)
    out: dict[str, Any] = FIGURES.of(raw) | {"multi.points": len(case.run_hull().points)}
    print("... several films", file=sys.stderr)
    return out | chain_figures("multi", measure_chain(extent.walking, extent.frames_multi, CORES), "cores"), raw


def contenders(case: MultiCase) -> dict[str, Contender]:
    """The functions that are timed in turns; a unit is a frame, or one iteration of one particle."""
    paper, default = (MultiFollower(case, make_multiview_settings(preset)) for preset in ("ni2008", "default"))
    return {
        "hull": Contender(case.run_hull),
        "forces": Contender(lambda: case.run_forces(FORCE_ITERATIONS), case.particles * FORCE_ITERATIONS),
        "gauss_newton": Contender(lambda: case.run_gauss_newton(SOLVE_ITERATIONS), case.particles * SOLVE_ITERATIONS),
        "naive_forces": Contender(_naive(case, naive_multi.move_by_forces, ForceSettings())),
        "naive_gauss_newton": Contender(_naive(case, naive_multi.move_by_gauss_newton)),
        "forces_frame": Contender(paper.run, 5),
        "default_frame": Contender(default.run, 5),
    }


def _naive(case: MultiCase, move: Callable[..., Array], *more: object) -> Callable[[], Array]:
    """One iteration of the naive version on one particle, with the same points."""
    surface = case.surface
    return lambda: move(case.body, case.poses[0], surface.points, surface.normals, surface.weights, case.refiner.settings, *more)
