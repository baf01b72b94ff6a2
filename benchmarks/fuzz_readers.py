"""Every reader of files against damaged ones: does each end with a result, or with our own error, soon and in little memory?

    python benchmarks/fuzz_readers.py [--inputs 1000000 | --seconds 20] [--only NAME ...] [--seed 1] [--keep FOLDER]

Files that the package and the tests' writers make are changed at random, in their bytes and in their structure (numbers, words, lines,
members of archives), and read in another process. A finding is any exception but a `ShadowPuppetError`; a message of more than
one line, or too long; a warning that is not ours; more than 10 s of computing, or ten times that of waiting; more than 500 MB; the end
of the process. Each is printed with its reader, number and cause, and its input is kept in FOLDER. An input is made from the seed, the
reader's name and its number alone. Ends with code 1 if there is a finding. Needs Linux.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import warnings
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import fuzz_seeds
import numpy as np
import smallest
from fuzz_mutations import mutated

from shadowpuppet.errors import LONGEST, ShadowPuppetError, ShadowPuppetWarning
from shadowpuppet.threads import child_environment

SECONDS, MEMORY = 10, 500_000_000
"""Computing time and memory that one input may take."""
WAITING = 10 * SECONDS
"""Time by the clock that one input may take: on a crowded machine a reader waits for its turn."""
AT_ONCE, FEW = 200, 25
"""Most inputs of a reader before it is the next one's turn; in a short run."""
IN_MEMORY = Path("/dev/shm")
"""Files written here are on no disk, on which writing an input takes longer than reading it."""
AT = "number"
"""File with the number of the input that is being read."""


class Report(NamedTuple):
    """What reading one input came to."""

    number: int
    cause: str
    """Empty if it was as it should be."""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--inputs", type=int, default=10**9, help="number of inputs in all")
    parser.add_argument("--seconds", type=float, default=1e9)
    parser.add_argument("--only", nargs="+", metavar="NAME", help=f"of {', '.join(fuzz_seeds.READERS)}")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=Path, help="folder for the inputs of findings")
    parser.add_argument("--read", action="store_true", help=argparse.SUPPRESS)
    args = smallest.parse(parser, lambda folder: ["--seconds", 8, "--keep", folder])
    if args.read:
        read_many(args.keep, args.seed)
        return 0
    with tempfile.TemporaryDirectory(prefix="shadowpuppet-fuzz-", dir=IN_MEMORY if IN_MEMORY.is_dir() else None) as folder:
        tried, findings = fuzz(args, Path(folder))
    print(f"{sum(tried.values())} inputs to {len(tried)} readers, {findings} findings")
    return 1 if findings else 0


# The process that asks


def fuzz(args: argparse.Namespace, folder: Path) -> tuple[dict[str, int], int]:
    """Numbers of inputs by reader, and of findings."""
    names = args.only or list(fuzz_seeds.READERS)
    fuzz_seeds.write(folder / "seeds")
    tried, findings, child = dict.fromkeys(names, 0), 0, start(folder, args.seed)
    end = time.monotonic() + args.seconds
    at_once = min(AT_ONCE if args.seconds > 60 else FEW, -(-args.inputs // len(names)))
    while sum(tried.values()) < args.inputs and time.monotonic() < end:
        for name in names:
            for report in ask(child, name, folder, tried[name], at_once):
                tried[name] = report.number + 1
                if report.cause:
                    findings += 1
                    tell(name, report, folder, args)
            if child.poll() is not None:
                child = start(folder, args.seed)
            if time.monotonic() > end:
                break
    assert child.stdin is not None
    child.stdin.close()
    child.wait()
    return tried, findings


def start(folder: Path, seed: int) -> subprocess.Popen[str]:
    """A process that reads inputs."""
    command = [sys.executable, "-P", __file__, "--read", "--keep", str(folder), "--seed", str(seed)]
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
                            env=child_environment({"NUMBA_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}))


def ask(child: subprocess.Popen[str], name: str, folder: Path, first: int, number: int) -> list[Report]:
    """Have a process read a number of inputs; their reports, the last of which says how the process ended if it did."""
    assert child.stdin is not None
    assert child.stdout is not None
    with contextlib.suppress(BrokenPipeError):
        child.stdin.write(f"{name} {first} {number}\n")
        child.stdin.flush()
    if line := child.stdout.readline():
        return [Report(*each) for each in json.loads(line)]
    code, at = child.wait(), int((folder / AT).read_text())
    cause = f"more than {SECONDS} s" if code in (-signal.SIGPROF, -signal.SIGALRM) else f"the process ended with code {code}"
    return [*(Report(n, "") for n in range(first, at)), Report(at, cause)]


def tell(name: str, report: Report, folder: Path, args: argparse.Namespace) -> None:
    """Print a finding, and keep its input."""
    print(f"{name} {report.number}: {report.cause}", flush=True)
    if args.keep is not None:
        args.keep.mkdir(parents=True, exist_ok=True)
        seeds = fuzz_seeds.of(name, folder / "seeds")
        path, content = make_input(name, seeds, args.seed, report.number)
        (args.keep / f"{name}-{report.number}{path.suffix}").write_bytes(content)


# The process that reads


def make_input(name: str, seeds: list[Path], seed: int, number: int) -> tuple[Path, bytes]:
    """The file of which an input is a changed version, and the input."""
    rng = np.random.default_rng([seed, zlib.crc32(name.encode()), number])
    path = seeds[rng.integers(len(seeds))]
    return path, mutated(rng, path.read_bytes(), seeds[rng.integers(len(seeds))].read_bytes())


def read_many(folder: Path, seed: int) -> None:
    """For each line of standard input, a reader, the first number and how many, read inputs and report on them in a line."""
    ready = set[str]()
    with (folder / AT).open("w") as at:
        for line in sys.stdin:
            name, first, number = line.split()
            seeds, place, read = fuzz_seeds.of(name, folder / "seeds"), folder / f"place-{name}", fuzz_seeds.READERS[name]
            if name not in ready:
                ready.add(name)
                prepare(folder / "seeds" / name, place, [path.name for path in seeds], read)
            resource.setrlimit(resource.RLIMIT_AS, (memory("VmSize") + 2 * MEMORY, resource.RLIM_INFINITY))
            reports, whole = list[Report](), {path.name: path.read_bytes() for path in seeds}
            for n in range(int(first), int(first) + int(number)):
                at.seek(0)
                at.write(f"{n:12}")
                at.flush()
                path, content = make_input(name, seeds, seed, n)
                (place / path.name).write_bytes(content)
                reports.append(Report(n, cause_of(read, place / path.name)))
                (place / path.name).write_bytes(whole[path.name])
            print(json.dumps(reports), flush=True)


def prepare(seeds: Path, place: Path, names: list[str], read: Callable[[Path], object]) -> None:
    """Copy the files of a reader to where they are changed, and read each, so that imports and kernels are loaded."""
    shutil.copytree(seeds, place, dirs_exist_ok=True)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for name in names:
            with contextlib.suppress(ShadowPuppetError):
                read(place / name)


def cause_of(read: Callable[[Path], object], file: Path) -> str:
    """What is wrong about reading a file; empty for nothing."""
    before, began = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.process_time()
    signal.setitimer(signal.ITIMER_PROF, SECONDS + 1)
    signal.alarm(WAITING)
    cause = ""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        try:
            read(file)
        except ShadowPuppetError as error:
            text = str(error)
            if not text.isprintable() or len(text) > 2 * LONGEST:
                cause = f"a message of {len(text)} characters: {text[:80]!r}"
        except Exception as error:
            cause = f"{type(error).__name__}: {str(error)[:200]}"
    signal.setitimer(signal.ITIMER_PROF, 0)
    signal.alarm(0)
    others = [each for each in said if not issubclass(each.category, ShadowPuppetWarning)]
    if others:
        cause = cause or f"{others[0].category.__name__}: {others[0].message} ({others[0].filename}:{others[0].lineno})"
    if time.process_time() - began > SECONDS:
        cause = cause or f"{time.process_time() - began:.1f} s"
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024
    return cause or (f"{grown / 1e6:.0f} MB" if grown > MEMORY else "")


def memory(key: str) -> int:
    """A figure of this process's memory, bytes."""
    return next(int(line.split()[1]) * 1024 for line in Path("/proc/self/status").read_text().splitlines() if line.startswith(key))


if __name__ == "__main__":
    sys.exit(main())
