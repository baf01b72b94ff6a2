"""Who is who after people of one height have left, or have been close: with the colours of clothes and without.

    python benchmarks/identities.py FOLDER [--films back stranger close] [--number 3] [--seconds 6] [--size 256x192]

`back`: two people of one height leave, and come back one after the other. `stranger`: one leaves, and another of that height comes.
`close`: two people walk past each other 0.3 m apart. Recordings are made in FOLDER unless they are there. A frame of somebody is wrong if
the number that they have in it was another one's first.
"""

from __future__ import annotations

import argparse
import itertools
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import smallest
from rich.console import Console
from rich.table import Table

from shadowpuppet.evaluation.people import REACH, known_truths
from shadowpuppet.io.motion.motion_files import read_truth
from shadowpuppet.io.people import read_places
from shadowpuppet.motion.synchronization import at_times
from shadowpuppet.pipeline.options import make_options
from shadowpuppet.pipeline.track import track_recording
from shadowpuppet.synthetic import Scene, Spec, synthesize
from shadowpuppet.synthetic.scene_renderer import bystander_body
from shadowpuppet.synthetic.spec import Bystander
from shadowpuppet.synthetic.spec_changes import SpecChanges, apply_changes

FILMS = ("back", "stranger", "close")
ALIKE = 0.01
"""Greatest difference (m) in height of the two people."""
COLUMNS = ("film", "seed", "clothes", "people tracked", "frames wrong, %", "wrong and vouched for, %", "uncertain, %", "sets/s")


def pairs(first: int) -> Iterator[tuple[int, int]]:
    """Seeds of people of one height, from a first one on."""
    heights, free = dict[int, float](), list[int]()
    for seed in itertools.count(first):
        heights[seed] = bystander_body(Bystander(seed=seed)).stature
        other = next((other for other in free if abs(heights[other] - heights[seed]) <= ALIKE), None)
        if other is None:
            free.append(seed)
        else:
            free.remove(other)
            yield other, seed


def spec_of(film: str, n: int, pair: tuple[int, int], seconds: float, size: str, rate: float) -> Spec:
    """The film's recording; `pair`: seeds of two people of one height."""
    changes = SpecChanges(people=2 if film == "close" else 3, cameras=4, together="past" if film == "close" else "round", seconds=seconds,
                          size=size, rate=rate)  # fmt: skip
    spec = apply_changes(changes, replace(Spec(scene=Scene(empty_seconds=1)), seed=900 + n))
    others = [replace(other, seed=seed) for other, seed in zip(spec.scene.bystanders, pair)]
    times = np.array([0.35, 0.65, 0.9]) * seconds
    if film == "back":
        away = ((times[0], times[1]), (times[0], times[2]))
        others = [replace(other, away=tuple(map(float, when))) for other, when in zip(others, away[:: 1 if n % 2 else -1])]
    elif film == "stranger":
        others = [replace(others[0], away=(float(times[0]), 3600.0)), replace(others[1], away=(0.0, float(times[1])))]
    else:
        others = [replace(others[0], ahead=-0.3)]
    return replace(spec, scene=replace(spec.scene, bystanders=tuple(others)))


def measured(folder: Path) -> tuple[int, float, float, float]:
    """Number of people of a run, shares of frames that are wrong, that are so and vouched for, and that are uncertain."""
    people = read_places(folder)
    tables = [read_truth(path) for path in known_truths(folder)]
    times = tables[0].times
    truths = np.stack([at_times(table, times).positions[:, table.names.index("pelvis"), :2] for table in tables], 1)
    owner, wrong, vouched, seen, doubted = dict[int, int](), 0, 0, 0, 0
    for t, time in enumerate(times):
        for number, (stamps, status, places) in people.items():
            k = int(np.abs(stamps - time).argmin())
            away = np.linalg.norm(truths[t] - places[k], axis=1)
            if abs(stamps[k] - time) > 1e-3 or not np.nanmin(away, initial=np.inf) < REACH:
                continue
            who = int(np.nanargmin(away))
            seen, doubted = seen + 1, doubted + (status[k] == "uncertain")
            if owner.setdefault(number, who) != who:
                wrong, vouched = wrong + 1, vouched + (status[k] == "tracked")
    return len(people), *(each / max(seen, 1) for each in (wrong, vouched, doubted))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--films", nargs="+", default=FILMS, choices=FILMS)
    parser.add_argument("--number", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=6.0)
    parser.add_argument("--size", default="256x192")
    parser.add_argument("--rate", type=float, default=12.0)
    args = smallest.parse(parser, lambda folder: (folder, "--films", "close", "--number", 1, "--seconds", 2, "--size", "96x72", "--rate",
                                                  4))  # fmt: skip
    table = Table(*COLUMNS, box=None)
    for film, (n, pair) in itertools.product(args.films, enumerate(itertools.islice(pairs(200), args.number))):
        recording = args.folder / f"{film}_{n}"
        if not (recording / "made").exists():
            synthesize(spec_of(film, n, pair, args.seconds, args.size, args.rate), recording)
            (recording / "made").touch()
        for appearance in (True, False):
            run = args.folder / f"{film}_{n}_run_{'with' if appearance else 'without'}"
            summary = track_recording(recording, run, make_options({"appearance": appearance}))
            row = (film, str(n), "yes" if appearance else "no")
            if "people" not in summary.metrics:
                table.add_row(*row, "one counted")
                continue
            number, *shares = measured(run)
            table.add_row(*row, str(number), *(f"{100 * share:.0f}" for share in shares), f"{summary.metrics['frames_per_s']:.1f}")
            print(*row, number, *(f"{100 * share:.0f}" for share in shares), flush=True)
    Console().print(table)


if __name__ == "__main__":
    main()
