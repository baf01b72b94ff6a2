"""`python -m papers.liu2011 NAME...`"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from papers.common.runner import main
from papers.liu2011 import figure_6_7, figure_8, figure_9, figure_10_12
from papers.liu2011.material import SILHOUETTES

ABOUT = "Z. Liu, D. Lee, W. Sepp (IROS 2011): every figure and table, on a made recording, or on --recording."
EXPERIMENTS = tuple(module.EXPERIMENT for module in (figure_6_7, figure_8, figure_9, figure_10_12))


def add(parser: argparse.ArgumentParser) -> None:
    """The paper's own options."""
    parser.add_argument("--silhouettes", choices=tuple(SILHOUETTES), default="practical",
                        help="as `track` makes them, by the averaging rule of eq. 1 alone, or the recording's ready ones")


def run(argv: Sequence[str] | None = None) -> int:
    """The command; its exit code."""
    return main("liu2011", ABOUT, EXPERIMENTS, argv, add)


if __name__ == "__main__":
    sys.exit(run())
