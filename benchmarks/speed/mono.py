"""Figures of the one-camera tracker."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

from shadowpuppet.threads import one_opencv_thread
from shadowpuppet.tracking.monocular.settings import make_settings

from . import naive_mono
from .chain import chain_figures, measure_chain, start_times
from .extent import Extent
from .mono_cases import MonoCase, MonoFollower
from .opencv import OpenCV
from .silhouette_cases import SilhouetteCase
from .timing import Contender, Figures, Times, in_turns

NAIVE_PARTICLES = 2
"""Particles a stage of the naive filter; its time is proportional to them, and scaled up to all of Table I."""
FIGURES = Figures(
    times={"mono.particle_us": (1e6, "particle"), "mono.arm_us": (1e6, "arm"), "mono.opencv_particle_us": (1e6, "opencv"),
           "mono.opencv_arm_us": (1e6, "opencv_arm"), "mono.boxes_particle_us": (1e6, "boxes"),
           "mono.naive_frame_ms": (1e3, "naive_frame"), "mono.silhouette_ms": (1e3, "silhouette"), "mono.correction_ms": (1e3, "correct"),
           "mono.correction_moved_ms": (1e3, "correct_moved"), "mono.correction_uneven_ms": (1e3, "correct_uneven")},
    rates={"mono.step_fps": "step", "mono.default_fps": "default"},
    ratios={"mono.ratio_opencv_full": ("opencv", "particle"), "mono.ratio_opencv_arm": ("opencv_arm", "arm"),
            "mono.ratio_naive_frame": ("naive_frame", "step"), "mono.ratio_boxes": ("boxes", "particle"),
            "mono.ratio_correction": ("correct", "silhouette"), "mono.ratio_correction_moved": ("correct_moved", "silhouette"),
            "mono.ratio_correction_uneven": ("correct_uneven", "silhouette"),
            "mono.ratio_naive_correction": ("naive_correct", "correct")},
)  # fmt: skip


def run_mono(extent: Extent) -> tuple[dict[str, Any], dict[str, Times]]:
    """All `mono.*` figures by flat keys, and the times they come from. Raises `ShadowPuppetError` if a part of it fails."""
    print("... one camera: particles and frames, in turns", file=sys.stderr)
    with one_opencv_thread():
        raw = in_turns(contenders(), extent.rounds)
    out: dict[str, Any] = FIGURES.of(raw)
    print("... a long film", file=sys.stderr)
    out |= chain_figures("mono", measure_chain(extent.waving, extent.frames), "one_core")
    if extent.starts:
        print("... compiling again", file=sys.stderr)
        out["mono.compile_s"], out["mono.start_s"] = start_times()
    return out, raw


def contenders() -> dict[str, Contender]:
    """The functions that are timed in turns; a unit is a particle or a frame."""
    full, arm, boxes = MonoCase(), MonoCase(stage="arm"), MonoCase("boxes")
    settings = make_settings("liu2011")
    rng, share = np.random.default_rng(0), NAIVE_PARTICLES / settings.arm.particles
    paper, default, film = MonoFollower("liu2011"), MonoFollower("default"), SilhouetteCase()
    return {
        "particle": Contender(full.run, full.particles),
        "arm": Contender(arm.run, arm.particles),
        "boxes": Contender(boxes.run, boxes.particles),
        "opencv": Contender(OpenCV(full).run, full.particles),
        "opencv_arm": Contender(OpenCV(arm).run, arm.particles),
        "step": Contender(paper.run, 10),
        "default": Contender(default.run, 10),
        "naive_frame": Contender(lambda: naive_mono.frame(rng, full.picture, settings, full.pose, full.mask, NAIVE_PARTICLES), share),
        "silhouette": Contender(film.segment),
        "correct": Contender(lambda: film.correct("clean")),
        "naive_correct": Contender(film.correct_plainly),
        "correct_moved": Contender(lambda: film.correct("moved")),
        "correct_uneven": Contender(lambda: film.correct("uneven")),
    }
