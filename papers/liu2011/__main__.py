"""`python -m papers.liu2011 NAME...`"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace

from papers.common.experiment import Request
from papers.common.fingerprint import FRAMES, Fingerprint, sums, sums_of_spec
from papers.common.runner import main
from papers.liu2011 import (
    algorithm_1,
    cardbox_cost,
    elbows,
    figure_1_2,
    figure_3_4,
    figure_5,
    figure_6_7,
    figure_8,
    figure_9,
    figure_10_12,
    frame_rate,
    material,
    particles_sweep,
    repeats,
    selectivity,
    survival_sweep,
    table_1,
    toward_camera,
    true_poses,
)
from papers.liu2011.material import SILHOUETTES

ABOUT = "Z. Liu, D. Lee, W. Sepp (IROS 2011): every figure and table, on a made recording, or on --recording."
MODULES = (figure_1_2, figure_3_4, figure_5, algorithm_1, table_1, figure_6_7, figure_8, figure_9, figure_10_12, toward_camera,
           survival_sweep, particles_sweep, selectivity, frame_rate, cardbox_cost, elbows, true_poses)  # fmt: skip
EXPERIMENTS = tuple(module.EXPERIMENT for module in MODULES)

JOINTS = ("left_shoulder", "left_elbow", "left_hand", "right_shoulder", "right_elbow", "right_hand")
"""Those of the fingerprint."""


def add(parser: argparse.ArgumentParser) -> None:
    """The paper's own options."""
    parser.add_argument("--silhouettes", choices=tuple(SILHOUETTES), default="practical",
                        help="as `track` makes them, by the averaging rule of eq. 1 alone, or the recording's ready ones")


def fingerprint(request: Request) -> Fingerprint:
    """Of each made recording: its spec; truth, masks and first tracked poses of its short version."""
    found, short = Fingerprint(), replace(request, short=True, recordings=(), more={})
    for name in material.MADE:
        case = material.case(short, material.made_recording(short, name))
        first = replace(case, masks=case.masks[10 : 10 + FRAMES])  # the arms are moving by then
        poses = {method: repeats.estimates(first, repeats.with_method(case.tracker, method), 0)["poses"] for method in repeats.METHODS}
        found[f"{name}: spec"] = sums_of_spec(material.spec_of(name, False))
        found[f"{name}: truth"], found[f"{name}: masks"] = sums(case.true_places(JOINTS)), sums(case.masks.mean((1, 2)))
        found |= {f"{name}: {method}": sums(each) for method, each in poses.items()}
    return found


def run(argv: Sequence[str] | None = None) -> int:
    """The command; its exit code."""
    return main("liu2011", ABOUT, EXPERIMENTS, argv, add, fingerprint)


if __name__ == "__main__":
    sys.exit(run())
