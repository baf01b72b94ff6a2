"""The several-camera tracker in figures: seven cameras of 640 x 480, 40 particles, 2,000 surface points."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from shadowpuppet.evaluation.bench import naive_multi
from shadowpuppet.evaluation.bench.chain import apart
from shadowpuppet.evaluation.bench.multi_cases import Around, RingFollower
from shadowpuppet.evaluation.bench.multi_film import ring_recording
from shadowpuppet.evaluation.bench.timing import Contender, Times, in_turns
from shadowpuppet.geometry import Array
from shadowpuppet.pipeline.track import Listener
from shadowpuppet.tracking.multiview.settings import ForceSettings, make_multiview_settings

ROUNDS, FEW = 21, 3
"""How often each thing is timed, and how often with `quick`."""
FORCE_ITERATIONS, SOLVE_ITERATIONS = 20, 5
"""Iterations of a call that is timed."""
FRAMES, SOME = 300, 60
"""Frames of the films that are tracked, and with `quick`."""
CORES = 2
"""For the whole chain: films are decoded beside the tracking."""
PARTICLES = (5, 10, 20, 40, 80, 160)
POINTS = (250, 500, 1000, 2000, 4000, 8000)
CAMERAS = (2, 3, 4, 5, 6, 7, 8)


def run_multi(quick: bool = False, listener: Listener | None = None) -> dict[str, Any]:
    """All `multi.*` figures by flat keys, with `raw` (median, least and rounds of all that was timed, seconds a unit) and `curves`."""
    listener = listener or Listener()
    listener.begin("several cameras, in turns")
    case = Around()
    raw = in_turns(contenders(case), FEW if quick else ROUNDS)
    out = figures(raw) | {"multi.points": len(case.run_hull().points)}
    listener.begin("cost against particles, points and cameras")
    drawn = curves(1 if quick else 5, quick)
    listener.begin("seven films")
    with tempfile.TemporaryDirectory() as folder:
        recording = ring_recording(Path(folder) / "recording", SOME if quick else FRAMES)
        out |= _chain_figures(apart(recording, Path(folder) / "run", CORES))
    return {**out, "raw": {name: times._asdict() for name, times in raw.items()}, "curves": drawn}


def contenders(case: Around) -> dict[str, Contender]:
    """What is timed in turns; a unit is a frame, or a particle and iteration."""
    paper, default = (RingFollower(case, make_multiview_settings(preset)) for preset in ("ni2008", "default"))
    forces, solved = case.particles * FORCE_ITERATIONS, case.particles * SOLVE_ITERATIONS
    return {
        "hull": Contender(case.run_hull),
        "forces": Contender(lambda: case.run_forces(FORCE_ITERATIONS), forces),
        "gauss_newton": Contender(lambda: case.run_gauss_newton(SOLVE_ITERATIONS), solved),
        "naive_forces": Contender(_plain(case, naive_multi.move_by_forces)),
        "naive_gauss_newton": Contender(_plain(case, naive_multi.move_by_gauss_newton)),
        "forces_frame": Contender(paper.run, 5),
        "default_frame": Contender(default.run, 5),
    }


def _plain(case: Around, move: Callable[..., Array]) -> Callable[[], Array]:
    """One particle and iteration of the plain version, on the same points."""
    surface, known = case.refiner.settings, case.surface
    told = (ForceSettings(),) if move is naive_multi.move_by_forces else ()
    return lambda: move(case.body, case.poses[0], known.points, known.normals, known.weights, surface, *told)


def figures(raw: dict[str, Times]) -> dict[str, float]:
    """The `multi.*` figures of what was timed: medians; ratios are those of the least times, as other work on the machine hardly changes
    these."""
    t, least = ({name: getattr(times, which) for name, times in raw.items()} for which in ("median", "least"))
    return {
        "multi.hull_ms": 1e3 * t["hull"],
        "multi.force_us": 1e6 * t["forces"],
        "multi.gauss_newton_us": 1e6 * t["gauss_newton"],
        "multi.naive_force_us": 1e6 * t["naive_forces"],
        "multi.naive_gauss_newton_us": 1e6 * t["naive_gauss_newton"],
        "multi.forces_fps": 1 / t["forces_frame"],
        "multi.fps": 1 / t["default_frame"],
        "multi.ratio_naive": least["naive_forces"] / least["forces"],
        "multi.ratio_naive_gauss_newton": least["naive_gauss_newton"] / least["gauss_newton"],
    }


def _chain_figures(chain: dict[str, Any]) -> dict[str, Any]:
    ms = {f"multi.{stage}_ms": spent for stage, spent in chain["ms"].items()}
    return {"multi.chain_fps": chain["fps"], **ms, "multi.chain_frames": chain["frames"], "multi.peak_mb": chain["peak_mb"],
            "multi.growth_mb": chain["growth_mb"], "multi.cores": chain["cores"]}


def curves(rounds: int, quick: bool = False) -> dict[str, Any]:
    """Least times, milliseconds: of ten iterations of all particles, against particles and points; of the hull, against cameras."""
    step = 3 if quick else 1
    particles, points, cameras = PARTICLES[::step], POINTS[::step], CAMERAS[::step]
    rings = {n: Around(cameras=n) for n in cameras}
    runs = {f"cameras {n}": Contender(ring.run_hull) for n, ring in rings.items()}
    for kind in ("forces", "gauss_newton"):
        runs |= {f"{kind} particles {n}": Contender(_ten(Around(particles=n), kind)) for n in particles}
        runs |= {f"{kind} points {n}": Contender(_ten(Around(points=n), kind)) for n in points}
    took = {name: 1e3 * times.least for name, times in in_turns(runs, rounds).items()}
    kinds = ("forces", "gauss_newton")
    return {
        "particles": {"values": particles, **{kind: [took[f"{kind} particles {n}"] for n in particles] for kind in kinds}},
        "points": {"values": points, **{kind: [took[f"{kind} points {n}"] for n in points] for kind in kinds}},
        "cameras": {"values": cameras, "hull": [took[f"cameras {n}"] for n in cameras],
                    "points": [len(rings[n].run_hull().points) for n in cameras]},
    }  # fmt: skip


def _ten(case: Around, kind: str) -> Callable[[], Array]:
    return lambda: (case.run_forces if kind == "forces" else case.run_gauss_newton)(10)


def linearity(values: Any, times: Any) -> float:
    """The exponent of a power law of times over values: 1 is linear."""
    return float(np.polyfit(np.log(values), np.log(times), 1)[0])
