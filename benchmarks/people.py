"""Several people before several cameras: are they counted, followed and not exchanged, and how much worse is each than alone?

    python benchmarks/people.py FOLDER [--films N ...] [--shift S] [--masks] [--detector made]

Makes the films of `FILMS` in FOLDER unless they are there, of 2, 3, 4 and 6 people before 4, 5 and 8 cameras, tracks each from the films
(or, with `--masks`, from the exact silhouettes), and prints a line for each and what was asked of all. Films of two and three people who
walk round each other are made once more with each of them alone.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import smallest
from detector import DETECTORS, hidden
from keypoints import with_keypoints
from rich.console import Console
from rich.table import Table

from shadowpuppet.evaluation.people import REACH, measure_people
from shadowpuppet.geometry import Array
from shadowpuppet.io.calibration.calibration_files import read_calibration
from shadowpuppet.io.motion.motion_files import read_truth
from shadowpuppet.io.people import person_folders
from shadowpuppet.io.run import read_run
from shadowpuppet.motion.metrics import evaluate
from shadowpuppet.motion.motion import BLANK
from shadowpuppet.motion.synchronization import at_times
from shadowpuppet.pipeline.options import Options, make_options
from shadowpuppet.pipeline.track import track_recording
from shadowpuppet.synthetic import Scene, Spec, synthesize
from shadowpuppet.synthetic.company import Together
from shadowpuppet.synthetic.spec_changes import SpecChanges, apply_changes

COLUMNS = ("film", "people", "cameras", "count right, %", "longest ghost, s", "longest miss, s", "swaps", "errors, mm", "alone, mm",
           "uncertain, %", "silent, %", "sets/s")  # fmt: skip
ALONE = {2: 1.5, 3: 2.0}
"""Greatest error asked of each of two or three people who walk round each other, over that of the same person alone."""
SEEN = 0.9
"""Share of a person's joints that two cameras must see for a miss to count."""
FAR_OFF = 0.3
"""Error (m) of a joint from which it is silent if it is vouched for."""


@dataclass(frozen=True)
class Film:
    """A made film of several people."""

    together: Together
    people: int
    cameras: int
    seed: int
    seconds: float = 2.0
    size: str = "256x192"
    rate: float = 15.0

    @property
    def name(self) -> str:
        """Of its folder."""
        return f"{self.together}_{self.people}_{self.cameras}_{self.seed}"

    @property
    def spec(self) -> Spec:
        """The spec of the film."""
        changes = SpecChanges(people=self.people, cameras=self.cameras, together=self.together, seconds=self.seconds, size=self.size,
                              rate=self.rate)  # fmt: skip
        return apply_changes(changes, replace(Spec(scene=Scene(empty_seconds=1)), seed=self.seed))

    def alone(self, n: int) -> Spec:
        """The spec of the same film with the n-th of the people alone, counted from 0."""
        others = tuple(one if k == n - 1 else replace(one, away=(0.0, 1e6)) for k, one in enumerate(self.spec.scene.bystanders))
        values = SpecChanges() if n == 0 else SpecChanges(faults="absent @0-1000")
        return apply_changes(values, replace(self.spec, scene=replace(self.spec.scene, bystanders=others)))


FILMS = (Film("round", 2, 4, 401), Film("round", 3, 4, 402), Film("past", 2, 5, 403), Film("past", 4, 5, 404), Film("dance", 3, 5, 405),
         Film("dance", 4, 8, 406), Film("shake_hands", 2, 4, 407), Film("shake_hands", 4, 5, 408), Film("round", 6, 8, 409))  # fmt: skip


def made(folder: Path, spec: Spec) -> Path:
    """The recording of a spec in a folder, made unless it is there."""
    if not (folder / "made").exists():
        synthesize(spec, folder)
        (folder / "made").touch()
    return folder


def seen_by_two(film: Path, joints: list[Array]) -> Array:
    """Whether two cameras see nearly all of each person (T, P), from the people's joints (T, J, 3), world, metres."""
    cameras = read_calibration(film / "calibration.toml")
    found = np.zeros((len(joints[0]), len(joints)), int)
    for camera in cameras:
        for n, own in enumerate(joints):
            pixels = camera.project(own.reshape(-1, 3)).reshape(*own.shape[:2], 2)
            shown = ((pixels >= 0) & (pixels < np.array(camera.size))).all(-1)
            shown &= ~hidden(camera, own, [each for k, each in enumerate(joints) if k != n])
            found[:, n] += shown.mean(-1) >= SEEN
    return found >= 2


def longest(flags: Array, step: float) -> float:
    """The longest time (s) for which any column of flags (T, P) is true without a break."""
    most = 0
    for column in flags.T:
        run = 0
        for flag in column:
            run = run + 1 if flag else 0
            most = max(most, run)
    return most * step


def measure(film: Film, folder: Path, options: Options, detector: str | None = None) -> dict:
    """What a film's run is worth; `detector`: of the keypoints that are made, None for none."""
    path = made(folder / film.name, film.spec)
    path = path if detector is None else with_keypoints(path, detector)
    summary = track_recording(path, folder / f"{path.name}_run", options)
    truths = [read_truth(path / f"truth_{n + 1}.csv") for n in range(film.people)]
    times, pelvis = truths[0].times, truths[0].names.index("pelvis")
    joints = [truth.positions for truth in truths]
    places = np.stack([each[:, pelvis] for each in joints], 1)
    figures: dict = {"film": film, "rate": summary.metrics["frames_per_s"], "people": len(person_folders(summary.folder))}
    if not figures["people"]:
        return figures | {"right": 0.0, "ghost": 0.0, "missed": times[-1], "swaps": 0, "errors": {}, "uncertain": np.nan, "silent": np.nan}
    measured, found, statuses = measure_people(summary.folder), list[Array](), list[Array]()
    for run in map(read_run, person_folders(summary.folder).values()):
        table = run.motion.table
        own = np.where(np.isin(run.motion.status, BLANK)[:, None], np.nan, table.positions[:, table.names.index("pelvis")])
        found.append(at_times(replace(table, names=("pelvis",), positions=own[:, None]), times).positions[:, 0])
        statuses.append(run.motion.status)
    near = np.nan_to_num(np.linalg.norm(places[:, :, None] - np.stack(found, 1)[:, None], axis=-1), nan=np.inf) < REACH
    there = np.isfinite(np.stack(found, 1)).all(-1)
    errors = {Path(each["truth"]).stem: each["errors"] for each in measured["person"].values() if "errors" in each}
    every = np.concatenate(statuses)
    return figures | {
        "right": measured["identities"]["count_right"], "swaps": measured["identities"]["swaps"],
        "ghost": longest(there & ~near.any(1), 1 / film.rate), "missed": longest(~near.any(2) & seen_by_two(path, joints), 1 / film.rate),
        "errors": {name: each["mean_mm"] for name, each in errors.items()}, "uncertain": 100 * float((every == "uncertain").mean()),
        "silent": 100 * silent(path, summary.folder, film.people)}  # fmt: skip


def silent(path: Path, run: Path, people: int) -> float:
    """Share of the joints of frames that are `tracked` which are `FAR_OFF` or more from the truth that is nearest in the mean."""
    off, all_of_them = 0, 0
    for motion in (read_run(folder).motion for folder in person_folders(run).values()):
        best: Array | None = None
        for n in range(people):
            truth = read_truth(path / f"truth_{n + 1}.csv")
            shared = [name for name in motion.joint_names if name in truth.names]
            away = np.linalg.norm(motion.table.select(shared).positions - at_times(truth.select(shared), motion.times).positions, axis=-1)
            best = away if best is None or np.nanmean(away) < np.nanmean(best) else best
        assert best is not None
        vouched = best[motion.status == "tracked"]
        off, all_of_them = off + int((vouched > FAR_OFF).sum()), all_of_them + int(np.isfinite(vouched).sum())
    return off / max(all_of_them, 1)


def errors_alone(film: Film, folder: Path, options: Options) -> dict[str, float]:
    """The error (mm) of each of a film's people alone, by the name of their truth."""
    found = dict[str, float]()
    for n in range(film.people):
        path = made(folder / f"{film.name}_alone_{n + 1}", film.alone(n))
        run = track_recording(path, folder / f"{film.name}_alone_{n + 1}_run", options)
        found[f"truth_{n + 1}"] = evaluate(run.motion, read_truth(path / f"truth_{n + 1}.csv"), cameras=2)["errors"]["mean_mm"]
    return found


def listed(errors: dict[str, float], people: int) -> str:
    """The errors (mm) of a number of people, by the names of their truths, in a line; empty if there are none."""
    names = [f"truth_{n + 1}" for n in range(people)]
    return " ".join(f"{errors[name]:.0f}" if name in errors else "-" for name in names) if errors else ""


def row(found: dict, alone: dict[str, float]) -> list[str]:
    """A line of the table."""
    film = found["film"]
    own, single = (listed(each, film.people) for each in (found["errors"], alone))
    return [film.together, str(film.people), str(film.cameras), f"{100 * found['right']:.1f}", f"{found['ghost']:.1f}",
            f"{found['missed']:.1f}", str(found["swaps"]), own, single, f"{found['uncertain']:.0f}", f"{found['silent']:.1f}",
            f"{found['rate']:.1f}"]  # fmt: skip


def asked(every: list[dict], alone: dict[str, dict[str, float]]) -> list[str]:
    """What was asked, and how far it is reached."""
    frames = [round(each["film"].rate * (each["film"].seconds + 1.6)) for each in every]
    right = np.average([each["right"] for each in every], weights=frames)
    lines = [f"count right in {100 * right:.1f} % of {sum(frames)} frames (asked 99)",
             f"longest ghost {max(each['ghost'] for each in every):.1f} s (asked 0.5)",
             f"longest miss of a person of whom two cameras see 90 %: {max(each['missed'] for each in every):.1f} s (asked 1)"]
    for most in (2, 4):
        some = [(each["swaps"], n) for each, n in zip(every, frames) if each["film"].people == most]
        if some:
            swaps, total, goal = sum(n for n, _ in some), sum(n for _, n in some), "0" if most == 2 else "1 in 1,000"
            lines.append(f"swaps with {most} people: {swaps} in {total} frames (asked {goal})")
    for each in every:
        film, own = each["film"], alone.get(each["film"].name, {})
        if own:
            ratios = [each["errors"].get(name, np.nan) / error for name, error in own.items()]
            times = " ".join(f"{ratio:.2f}" for ratio in ratios)
            lines.append(f"{film.people} people {film.together}: {times} times the error alone (asked {ALONE[film.people]:g})")
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--films", type=int, nargs="+", default=list(range(len(FILMS))), help="some of the films, counted from 0")
    parser.add_argument("--shift", type=int, default=0, help="added to the films' seeds: other people, clothes and rooms")
    parser.add_argument("--masks", action="store_true", help="exact silhouettes instead of the films")
    parser.add_argument("--tiny", action="store_true", help="one film of two people, of a few small pictures")
    parser.add_argument("--detector", choices=DETECTORS, help="keypoints as this detector makes them, beside silhouettes")
    args = smallest.parse(parser, lambda folder: (folder, "--tiny", "--masks"))
    options, console = make_options({"masks": args.masks}), Console(width=150)
    chosen = [replace(film, seed=film.seed + args.shift) for film in (FILMS[n] for n in args.films)]
    films = [Film("dance", 2, 3, 1, 2.0, "96x72", 2.0)] if args.tiny else chosen
    table, every, alone = Table(*COLUMNS, box=None), list[dict](), dict[str, dict[str, float]]()
    for film in films:
        every.append(measure(film, args.folder, options, args.detector))
        if film.together == "round" and film.people in ALONE:
            alone[film.name] = errors_alone(film, args.folder, options)
        table.add_row(*row(every[-1], alone.get(film.name, {})))
        console.print(f"{film.name} done", style="dim")
    console.print(table)
    for line in asked(every, alone):
        console.print(line)


if __name__ == "__main__":
    main()
