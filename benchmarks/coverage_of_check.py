"""Whether the intervals that `shadowpuppet check` states hold what is true: delays of films and rotations of cameras are made in recordings
of people who walk, box and only stand, and counted.

    python benchmarks/coverage_of_check.py [--trials 7] [--recordings FOLDER ...] [--masks] [--markdown docs/calibration.md]

Without recordings, some are made in build/coverage, other people for each seed: before four cameras, at 30 frames/s, silhouettes from
the films. The intervals' constants were chosen with seed 0. A trial takes
120 to 180 sets in a row of one of them, every second picture from an even or an odd frame of each film, so that delays are multiples
of half a set, and a camera turned about a random axis. `off 0.3°`: all other cameras are turned by that, too, as in a calibration
that is old.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import smallest
from faults import into_page

from shadowpuppet.camera.camera import Camera
from shadowpuppet.geometry import Array, inverse, rigid, rotation_from_vector, unit, vector_from_rotation
from shadowpuppet.pipeline.options import Options, make_options
from shadowpuppet.pipeline.progress import Listener
from shadowpuppet.pipeline.repair import check
from shadowpuppet.pipeline.repair.check import CalibrationCheck, SilhouetteSets, gather_silhouettes, judge_calibration
from shadowpuppet.pipeline.rig import Rig, open_rig
from shadowpuppet.synthetic import Gesture, Ring, Scene, Spec, synthesize

BUILD = Path(__file__).resolve().parent.parent / "build" / "coverage"
MOTIONS = {"walks, four cameras": ("walk", 4), "boxes, four": ("box", 4), "stands, four": ("stand", 4)}
"""Motion and number of cameras of each made recording."""
SECONDS, SIZE = 11.0, (320, 240)
OFF = (0.0, 0.3)
"""Degrees by which all cameras of a calibration are off."""
MOST_LATE, TURNS = 12, (0.5, 4.0)
"""Greatest delay, frames, and the least and greatest rotation of the camera that was turned, degrees."""
HEADER = ("| recording | calibration | delays stated | within their 90 % interval | half-width, sets | called late | wrongly | rotations "
          "stated | within | half-width, ° |\n|---|---|---:|---:|---:|---:|---:|---:|---:|---:|")


class Counts(NamedTuple):
    """Of one trial."""

    asked: int
    """Films."""
    delays: list[bool]
    """Whether each delay that was stated is within its interval."""
    widths: list[float]
    late: int
    """Films called late."""
    wrongly: int
    """Those that are less than a quarter of a set late, or late to the other side."""
    turns: list[bool]
    """Whether each component of a rotation that was stated is within its interval."""
    turn_widths: list[float]


def made(seed: int = 0, folder: Path = BUILD, motions: Sequence[str] = tuple(MOTIONS), seconds: float = SECONDS,
         size: tuple[int, int] = SIZE) -> dict[str, Path]:
    """The recordings made from a seed; those that are there are taken."""
    paths, folder = {}, folder / f"seed_{seed}"
    for n, name in enumerate(motions):
        motion, count = MOTIONS[name]
        path = paths[name] = folder / name.replace(", ", "_").replace(" ", "_")
        if not (path / "calibration.toml").exists():
            way = {"path": "circle", "size": 1.5} if motion == "walk" else {}
            spec = Spec(name=path.name, motion=(Gesture(motion=motion, seconds=seconds, **way),), rate=30, scene=Scene(empty_seconds=2),
                        ring=Ring(count=count, radius=3.8, fov_deg=50, size=size), training=())
            synthesize(spec, path, np.random.default_rng([seed, n]) if seed else np.random.default_rng(40 + n))
    return paths


def trial(rig: Rig, frames: SilhouetteSets, rng: np.random.Generator, off: float) -> Counts:
    """Make faults, check, and count. frames: silhouettes of all frames."""
    C, F = len(rig.cameras), len(frames.rows)
    most = min(MOST_LATE, F // 6)
    late = rng.integers(-most, most + 1, C) * (rng.uniform(size=C) < 0.5)
    sets = int(min(rng.integers(120, 181), (F - 2 * most) // 2))
    begin = int(rng.integers(most, max(F - 2 * sets - most, most) + 1))
    rows = [[frames.rows[min(max(begin + 2 * f - late[k], 0), F - 1)][k] for k in range(C)] for f in range(sets)]
    turned = int(rng.integers(C)) if rng.uniform() < 0.7 else None
    angles = [rng.uniform(*TURNS) if n == turned else off for n in range(C)]
    cameras = [_turned(camera, np.radians(angle) * unit(rng.normal(size=3))) for camera, angle in zip(rig.cameras, angles)]
    wrong = Rig(rig.recording, tuple(replace(each, camera=camera) for each, camera in zip(rig.footage, cameras)))
    return counted(judge_calibration(wrong, SilhouetteSets(rows, 2)), late, rig.cameras, cameras)


def _turned(camera: Camera, vector: Array) -> Camera:
    return replace(camera, T_camera_world=rigid(rotation_from_vector(vector), np.zeros(3)) @ camera.T_camera_world)


def counted(found: CalibrationCheck, late: Array, true: Sequence[Camera], given: Sequence[Camera]) -> Counts:
    """What a check says beside the truth: frames by which films are late, and the cameras."""
    delays, widths, wrongly = list[bool](), list[float](), 0
    frames = found.lateness.frames if found.lateness is not None else (None,) * len(late)
    known = [n for n, value in enumerate(frames) if value is not None]
    if known:
        zero = next(n for n in known if frames[n] == 0)  # what others are late against
        for n in known:
            error, width = (frames[n] or 0.0) - (late[n] - late[zero]), (found.lateness.spread[n] or 0.0) if found.lateness else 0.0
            if n != zero:
                delays.append(abs(error) <= width)
                widths.append(width / 2)
            own = late[n] - late[zero]
            wrongly += found.agreement.names[n] in found.late and (abs(own) < 0.5 or own * (frames[n] or 0.0) < 0)
    turns, turn_widths = list[bool](), list[float]()
    for n, camera in enumerate(true):
        if camera.name in found.turns:
            error = found.turns[camera.name].turn
            x, y, z = np.degrees(vector_from_rotation(camera.T_camera_world[:3, :3] @ inverse(given[n].T_camera_world)[:3, :3]))
            told = (error.right, error.down, error.clockwise)
            turns += [abs(a - b) <= width for a, b, width in zip(told, (-y, x, -z), error.spread)]
            turn_widths += error.spread
    return Counts(len(late), delays, widths, len(found.late), wrongly, turns, turn_widths)


def row(name: str, off: float, counts: Sequence[Counts]) -> str:
    """Of the table."""
    delays, turns = [sum((list(each[k]) for each in counts), []) for k in (1, 5)]  # pyright: ignore[reportArgumentType]
    widths, turn_widths = [sum((list(each[k]) for each in counts), []) for k in (2, 6)]  # pyright: ignore[reportArgumentType]
    asked = sum(each.asked - 1 for each in counts)

    def share(held: Sequence[bool]) -> str:
        return f"{100 * np.mean(held):.0f} %" if held else ""

    return (f"| {name} | {f'off {off:g}°' if off else 'true'} | {len(delays)} of {asked} | {share(delays)} | "
            f"{f'{np.median(widths):.2f}' if widths else ''} | {sum(each.late for each in counts)} | "
            f"{sum(each.wrongly for each in counts)} | "
            f"{len(turns)} | {share(turns)} | {f'{np.median(turn_widths):.2f}' if turn_widths else ''} |")


def table(recordings: dict[str, Path], options: Options, trials: int, seed: int) -> Iterator[str]:
    """Lines of the table, one by one."""
    check.SETS = 2 * 200  # pyright: ignore[reportAttributeAccessIssue]  # all frames of a made film
    for name, path in recordings.items():
        rig = open_rig(path, options)
        frames = gather_silhouettes(rig, options, Listener())
        for off in OFF:
            rng = np.random.default_rng([seed, len(name), int(10 * off)])
            yield row(name, off, [trial(rig, frames, rng, off) for _ in range(trials)])


def _smallest(folder: Path) -> list[object]:
    return ["--recordings", smallest.make(folder / "ring", smallest.RING), "--masks", "--trials", 1,
            "--markdown", smallest.copy(Path(__file__).resolve().parent.parent / "docs" / "calibration.md", folder)]


def main() -> None:
    """Parse, check, count."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--recordings", type=Path, nargs="*", help="folders with a true calibration; made ones without")
    parser.add_argument("--masks", action="store_true", help="the recordings' exact silhouettes in place of those of the films")
    parser.add_argument("--trials", type=int, default=7, help="for each recording and calibration")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--markdown", type=Path, help="page for the table, at its place")
    args = smallest.parse(parser, _smallest)
    recordings = {path.name: path for path in args.recordings} if args.recordings else made(args.seed)
    lines = [HEADER]
    print(HEADER)
    for line in table(recordings, make_options({"masks": args.masks}), args.trials, args.seed):
        print(line, flush=True)
        lines.append(line)
    if args.markdown:
        into_page(args.markdown, "coverage", "\n".join(lines))


if __name__ == "__main__":
    main()
