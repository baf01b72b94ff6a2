"""Figures of the several-camera tracker: seven cameras of 640 x 480, 40 particles, 2,000 surface points."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from shadowpuppet.evaluation.bench import naive_multi
from shadowpuppet.evaluation.bench.chain import chain_figures, measure_chain, walking
from shadowpuppet.evaluation.bench.multi_cases import MultiCase, MultiFollower
from shadowpuppet.evaluation.bench.timing import Contender, Figures, Times, in_turns
from shadowpuppet.geometry import Array
from shadowpuppet.pipeline.track import Listener
from shadowpuppet.tracking.multiview.settings import ForceSettings, make_multiview_settings

ROUNDS, QUICK_ROUNDS = 21, 3
FORCE_ITERATIONS, SOLVE_ITERATIONS = 20, 5
"""Iterations in a timed call."""
FRAMES, QUICK_FRAMES = 300, 60
"""Frames of the films that are tracked."""
CORES = 2
"""Cores for the whole chain: films are decoded while the tracker works."""
FIGURES = Figures(
    times={"multi.hull_ms": (1e3, "hull"), "multi.force_us": (1e6, "forces"), "multi.gauss_newton_us": (1e6, "gauss_newton"),
           "multi.naive_force_us": (1e6, "naive_forces"), "multi.naive_gauss_newton_us": (1e6, "naive_gauss_newton")},
    rates={"multi.forces_fps": "forces_frame", "multi.fps": "default_frame"},
    ratios={"multi.ratio_naive": ("naive_forces", "forces"), "multi.ratio_naive_gauss_newton": ("naive_gauss_newton", "gauss_newton")},
)  # fmt: skip


def run_multi(quick: bool, listener: Listener) -> tuple[dict[str, Any], dict[str, Times]]:
    """All `multi.*` figures by flat keys, and the times they come from. Raises `ShadowPuppetError` if a part of it fails."""
    listener.begin("several cameras, in turns")
    case = MultiCase()
    raw = in_turns(contenders(case), QUICK_ROUNDS if quick else ROUNDS)
    out: dict[str, Any] = FIGURES.of(raw) | {"multi.points": len(case.run_hull().points)}
    listener.begin("seven films")
    return out | chain_figures("multi", measure_chain(walking(), QUICK_FRAMES if quick else FRAMES, CORES), "cores"), raw


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
