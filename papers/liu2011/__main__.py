"""`python -m papers.liu2011 NAME...`"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

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
    particles_sweep,
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


def add(parser: argparse.ArgumentParser) -> None:
    """The paper's own options."""
    parser.add_argument("--silhouettes", choices=tuple(SILHOUETTES), default="practical",
                        help="as `track` makes them, by the averaging rule of eq. 1 alone, or the recording's ready ones")


def run(argv: Sequence[str] | None = None) -> int:
    """The command; its exit code."""
    return main("liu2011", ABOUT, EXPERIMENTS, argv, add)


if __name__ == "__main__":
    sys.exit(run())
