"""Runs that are killed and go on: does `track --resume` give what a run gives that is never broken off?

    python benchmarks/kill_runs.py [--kills 100] [--cameras one|several|both] [--seed 1]

Makes a small recording of each kind, tracks it once, and then again and again with SIGKILL after random frames, at random moments between
two of them; each killed run goes on and may be killed again. Prints a row for each kind of recording: kills, runs, and how many of these
are equal, byte by byte, to the first one. Ends with code 1 if one is not. `tests/pipeline/test_resume.py` is its short form.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import smallest

from shadowpuppet.errors import PERSON_LOST
from shadowpuppet.threads import child_environment

KINDS = {"one": (smallest.ONE, ("--tracker.cycles", "1")), "several": (smallest.RING, ("--multiview.particles", "8"))}
SAME = ("joints.csv", "raw.csv", "angles.csv", "intervals.csv", "run.toml", "look.json", "person.toml", "calibration.toml")
"""Files that must be equal."""
MOST_AT_ONCE = 8
"""Greatest number of frames from one kill to the next."""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=100, help="number of kills of each kind of recording")
    parser.add_argument("--cameras", choices=[*KINDS, "both"], default="both")
    parser.add_argument("--seed", type=int, default=1)
    args = smallest.parse(parser, lambda folder: ["--kills", 1, "--cameras", "one"])
    rng, wrong = np.random.default_rng(args.seed), 0
    for name in KINDS if args.cameras == "both" else [args.cameras]:
        with tempfile.TemporaryDirectory(prefix="shadowpuppet-kills-") as folder:
            kills, equal, runs = try_kind(rng, name, Path(folder), args.kills)
        print(f"{name:8} {kills:4} kills, {runs:3} runs, {equal:3} equal to the run that was not broken off", flush=True)
        wrong += runs - equal
    return 1 if wrong else 0


def try_kind(rng: np.random.Generator, name: str, folder: Path, kills: int) -> tuple[int, int, int]:
    """Numbers of kills, and of runs equal to one that was not killed, and of all runs."""
    spec, flags = KINDS[name]
    recording = smallest.make(folder / "recording", spec)
    track(recording, folder / "run", flags).wait()
    done = equal = runs = 0
    while done < kills:
        shutil.rmtree(folder / "killed", ignore_errors=True)
        shutil.move(folder / "run", folder / "whole")  # both runs are in the same folder, whose name is in none of their files
        done += kill_often(rng, recording, folder / "run", flags, kills - done)
        runs += 1
        equal += is_equal(folder / "run", folder / "whole")
        shutil.move(folder / "run", folder / "killed")
        shutil.move(folder / "whole", folder / "run")
    return done, equal, runs


def kill_often(rng: np.random.Generator, recording: Path, folder: Path, flags: tuple[str, ...], most: int) -> int:
    """Track until the run is complete, and kill it at most so often; the number of kills."""
    kills = 0
    while True:
        child, wanted = track(recording, folder, flags), frames(folder) + int(rng.integers(1, MOST_AT_ONCE))
        while kills < most and child.poll() is None and frames(folder) < wanted:
            time.sleep(0.002)
        if kills < most and child.poll() is None:
            time.sleep(rng.random() * 0.05)
            child.kill()
        code = child.wait()
        if code in (0, PERSON_LOST):
            return kills
        if code > 0:
            raise SystemExit(f"the run ended with code {code}")
        kills += 1


def track(recording: Path, folder: Path, flags: tuple[str, ...]) -> subprocess.Popen[bytes]:
    """A process that tracks, or goes on."""
    command = [sys.executable, "-P", "-m", "shadowpuppet", "track", recording, "-o", folder, "--resume", "--quiet", *flags]
    return subprocess.Popen([str(each) for each in command], env=child_environment({}))


def frames(folder: Path) -> int:
    """Number of rows in a run's joints.csv."""
    path = folder / "joints.csv"
    return max(path.read_bytes().count(b"\n") - 1, 0) if path.exists() else 0


def is_equal(one: Path, other: Path) -> bool:
    """Whether two runs have the same files of `SAME`, and the same arrays in motion.npz."""
    with np.load(one / "motion.npz") as ours, np.load(other / "motion.npz") as theirs:
        arrays = all(ours[name].tobytes() == theirs[name].tobytes() for name in ours.files)
    return arrays and all((one / name).read_bytes() == (other / name).read_bytes() for name in SAME)


if __name__ == "__main__":
    sys.exit(main())
