"""All figures and tables of Ni 2008: `python -m papers.ni2008` lists them."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from papers.common.experiment import Experiment, Request
from papers.common.fingerprint import FRAMES, Fingerprint, sums, sums_of_spec
from papers.common.runner import main as run_main
from papers.ni2008 import choices, figure_4, figure_5, figure_6, figure_7, figure_8, inputs, models, particles, table_1, table_2, tracks

ABOUT = ("Ni, Kassim and Winkler 2008: walking, jogging and boxing before seven cameras. Without --recording, recordings like HumanEva's "
         "are made first, some five minutes each on a core, once; --drawn does without films.")
EXPERIMENTS = (
    Experiment("figure_1", "Fig. 1: the human model, ten cylinders and 25 degrees of freedom", "1 s", models.figure_1),
    Experiment("figure_2", "Fig. 2: the force and the moment of one scene point", "1 s", models.figure_2),
    Experiment("figure_3", "Fig. 3: the tree of the model's parts", "1 s", models.figure_3),
    Experiment("table_1", "Table I: training and testing sizes", "a minute to read the films, once", table_1.make),
    Experiment("figure_4", "Fig. 4: reconstruction error against the number of regions", "10 s", figure_4.make, runs=5),
    Experiment("figure_5", "Fig. 5: estimated pose over the true one", "a minute", figure_5.make),
    Experiment("figure_6", "Fig. 6: joint angles beside the true ones", "3 minutes", figure_6.make, runs=3),
    Experiment("figure_7", "Fig. 7: RMSE of joint angles and positions", "2 minutes", figure_7.make, runs=3),
    Experiment("figure_8", "Fig. 8: RMSE against the number of regions", "10 minutes", figure_8.make, runs=2),
    Experiment("table_2", "Table II and Fig. 9: hybrid, image force and particle filter", "25 minutes", table_2.make, runs=10),
    Experiment("choices", "What the paper leaves open: bounds of the forces, noise of the particle filters", "8 minutes", choices.make),
    Experiment("particles", "VII: how many particles a plain filter needs", "20 minutes", particles.make, runs=2),
)


def add(parser: argparse.ArgumentParser) -> None:
    """What only this paper's experiments can be asked."""
    parser.add_argument("--drawn", action="store_true", help="drawn silhouettes of the made motions in place of films: that is quick")
    parser.add_argument("--masks", action="store_true", help="the recordings' exact silhouettes in place of those of the films")
    parser.add_argument("--made", type=Path, metavar="FOLDER", help="where the made recordings are, or are made (default: in the output)")
    parser.add_argument("--humaneva", type=Path, metavar="FOLDER", help="HumanEva-I, for those who have it: the paper's own recordings")
    parser.add_argument("--subject", default="S2", help="of HumanEva; the paper's is S2")


def fingerprint(request: Request) -> Fingerprint:
    """Of each made recording: its spec; truth and surface points of its short version, and its first poses by each method. Empty where
    HumanEva's recordings are given."""
    if request.more.get("humaneva") is not None:
        return {}
    found, short = Fingerprint(), replace(request, short=True, recordings=(), more={})
    ways = (tracks.HYBRID, tracks.IMAGE_FORCES[-1], tracks.particle_filter(200))
    for source in inputs.sources(short):
        case = inputs.load(short, source)
        assert source.spec is not None
        found[f"{source.name}: spec"] = sums_of_spec(replace(source.spec, frames=None, training_frames=None))
        found[f"{source.name}: truth"], found[f"{source.name}: points"] = sums(case.truth.positions), sums(case.arrays["points"].mean(0))
        found |= {f"{source.name}: {way.name}": sums(tracks.follow(case, way, 0).poses[:FRAMES]) for way in ways}
    return found


def main(argv: Sequence[str] | None = None) -> int:
    """Run what is asked for."""
    return run_main("ni2008", ABOUT, EXPERIMENTS, argv, add, fingerprint)


if __name__ == "__main__":
    sys.exit(main())
