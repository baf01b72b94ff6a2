"""Several people before several cameras: the count, who is who, the error of each against the same person alone, and the speed.

    python benchmarks/people.py FOLDER [--people 2 3] [--cameras 4 5] [--together round past] [--seconds 6] [--size 640x480] [--film]

Recordings are made in FOLDER unless they are there. With `--film` silhouettes are made from the films, else they are the exact ones.
"""

from __future__ import annotations

import argparse
import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import smallest
from rich.console import Console
from rich.table import Table

from shadowpuppet.evaluation.people import measure_people
from shadowpuppet.pipeline.options import Options, make_options
from shadowpuppet.pipeline.track import track_recording
from shadowpuppet.synthetic import Scene, Spec, synthesize
from shadowpuppet.synthetic.spec_changes import SpecChanges, apply_changes

COLUMNS = ("together", "people", "cameras", "count right %", "swaps", "MOTA", "IDF1", "error, mm", "first one", "alone", "sets/s")


def made(folder: Path, spec: Spec) -> Path:
    """The recording of a spec in a folder, made unless it is there."""
    if not (folder / "made").exists():
        synthesize(spec, folder)
        (folder / "made").touch()
    return folder


def measure(folder: Path, changes: SpecChanges, seed: int, options: Options) -> list[str]:
    """A row of the table."""
    spec = apply_changes(changes, replace(Spec(scene=Scene(empty_seconds=1)), seed=seed))
    name = f"{changes.together}_{changes.people}_{changes.cameras}"
    alone = replace(spec, scene=replace(spec.scene, bystanders=()))
    both, single = made(folder / name, spec), made(folder / f"{name}_alone", alone)
    summary = track_recording(both, folder / f"{name}_run", options)
    errors = track_recording(single, folder / f"{name}_alone_run", replace(options, height=None)).metrics["errors"]
    row = [str(changes.together), str(changes.people), str(changes.cameras)]
    if "people" not in summary.metrics:
        return [*row, "one person counted", *[""] * 5, f"{errors['mean_mm']:.1f}", ""]
    found = measure_people(summary.folder)
    who, first = found["identities"], next((each for each in found["person"].values() if each.get("truth", "").endswith("_1.csv")), {})
    own = f"{first['errors']['mean_mm']:.1f}" if first else ""
    return [*row, f"{100 * who['count_right']:.1f}", str(who["swaps"]), f"{who['mota']:.3f}", f"{who['idf1']:.3f}",
            f"{found['mean_mm']:.1f}" if found["mean_mm"] is not None else "", own, f"{errors['mean_mm']:.1f}",
            f"{summary.metrics['frames_per_s']:.1f}"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--people", type=int, nargs="+", default=[2, 3])
    parser.add_argument("--cameras", type=int, nargs="+", default=[4, 5])
    parser.add_argument("--together", nargs="+", default=["round", "past"])
    parser.add_argument("--seconds", type=float, default=6.0)
    parser.add_argument("--size", default="640x480")
    parser.add_argument("--rate", type=float, default=25.0)
    parser.add_argument("--film", action="store_true")
    args = smallest.parse(parser, lambda folder: (folder, "--people", 2, "--cameras", 3, "--together", "dance", "--seconds", 2,
                                                  "--size", "96x72", "--rate", 2))  # fmt: skip
    table = Table(*COLUMNS, box=None)
    options = make_options({"masks": not args.film})
    for together, people, cameras in itertools.product(args.together, args.people, args.cameras):
        changes = SpecChanges(people=people, cameras=cameras, together=together, seconds=args.seconds, size=args.size, rate=args.rate)
        table.add_row(*measure(args.folder, changes, int(np.sum([people, cameras])), options))
    Console().print(table)


if __name__ == "__main__":
    main()
