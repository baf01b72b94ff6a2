"""The one-camera tracker in figures."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from shadowpuppet.evaluation.bench import naive_mono
from shadowpuppet.evaluation.bench.chain import measure_chain
from shadowpuppet.evaluation.bench.curves import curves
from shadowpuppet.evaluation.bench.mono_cases import Case, Follower
from shadowpuppet.evaluation.bench.opencv import OpenCV, one_thread
from shadowpuppet.evaluation.bench.startup import start_times
from shadowpuppet.evaluation.bench.timing import Contender, Times, in_turns
from shadowpuppet.pipeline.track import Listener
from shadowpuppet.tracking.monocular.settings import make_settings

ROUNDS, FEW = 41, 7
"""How often each thing is timed, and how often with `quick`."""
FRAMES, SOME = 3000, 120
"""Frames of the film that is tracked."""
NAIVE_PARTICLES = 2
"""As many of a stage's particles does the naive filter get; its time is scaled up to all, which it is proportional to."""


def run_mono(quick: bool = False, listener: Listener | None = None, frames: int | None = None) -> dict[str, Any]:
    """All `mono.*` figures by flat keys, with `raw` (median, least and rounds of all that was timed, seconds a unit) and `curves`.

    `quick`: fewer rounds, a shorter film, nothing compiled anew. Raises `ShadowPuppetError` where a part of it fails.
    """
    listener = listener or Listener()
    listener.begin("particles and frames, in turns")
    with one_thread():
        raw = in_turns(contenders(), FEW if quick else ROUNDS)
        listener.begin("cost against particles, size and cards")
        drawn = curves(3 if quick else 9, quick)
    out = figures(raw)
    listener.begin("a long film")
    with tempfile.TemporaryDirectory() as folder:
        out |= _chain_figures(measure_chain(Path(folder), frames or (SOME if quick else FRAMES)))
    if not quick:
        listener.begin("compiling anew")
        out["mono.compile_s"], out["mono.start_s"] = start_times()
    return {**out, "raw": {name: times._asdict() for name, times in raw.items()}, "curves": drawn}


def contenders() -> dict[str, Contender]:
    """What is timed in turns; a unit is a particle or a frame."""
    full, arm, boxes = Case(), Case(stage="arm"), Case("boxes")
    settings = make_settings("liu2011")
    rng, share = np.random.default_rng(0), NAIVE_PARTICLES / settings.arm.particles
    paper, default = Follower("liu2011"), Follower("default")
    return {
        "particle": Contender(full.run, full.particles),
        "arm": Contender(arm.run, arm.particles),
        "boxes": Contender(boxes.run, boxes.particles),
        "opencv": Contender(OpenCV(full).run, full.particles),
        "opencv_arm": Contender(OpenCV(arm).run, arm.particles),
        "step": Contender(paper.run, 10),
        "default": Contender(default.run, 10),
        "naive_frame": Contender(lambda: naive_mono.frame(rng, full.picture, settings, full.pose, full.mask, NAIVE_PARTICLES), share),
    }


def figures(raw: dict[str, Times]) -> dict[str, float]:
    """The `mono.*` figures of what was timed: medians; ratios are those of the least times, which other work on the machine hardly
    changes."""
    t, least = ({name: getattr(times, which) for name, times in raw.items()} for which in ("median", "least"))
    return {
        "mono.particle_us": 1e6 * t["particle"],
        "mono.arm_us": 1e6 * t["arm"],
        "mono.opencv_particle_us": 1e6 * t["opencv"],
        "mono.opencv_arm_us": 1e6 * t["opencv_arm"],
        "mono.boxes_particle_us": 1e6 * t["boxes"],
        "mono.naive_frame_ms": 1e3 * t["naive_frame"],
        "mono.ratio_opencv_full": least["opencv"] / least["particle"],
        "mono.ratio_opencv_arm": least["opencv_arm"] / least["arm"],
        "mono.ratio_naive_frame": least["naive_frame"] / least["step"],
        "mono.ratio_boxes": least["boxes"] / least["particle"],
        "mono.step_fps": 1 / t["step"],
        "mono.default_fps": 1 / t["default"],
    }


def _chain_figures(chain: dict[str, Any]) -> dict[str, Any]:
    ms = {f"mono.{stage}_ms": chain["ms"][stage] for stage in chain["ms"]}
    return {"mono.chain_fps": chain["fps"], **ms, "mono.chain_frames": chain["frames"], "mono.peak_mb": chain["peak_mb"],
            "mono.growth_mb": chain["growth_mb"], "mono.one_core": chain["cores"]}
