"""Places cameras by a walking person (`calibrate --from-person`) from rough places, and compares them with the true ones.

    python benchmarks/placing.py [--recordings FOLDER ...] [--masks] [--seeds 2] [--height 1.8] [--markdown docs/calibration.md]

Without recordings, three are made in build/placing: a person of 1.75 m who walks about before three, four and six cameras. Each camera is
turned and moved in a random direction by as much as a row says. Errors: of places and directions within the rig (after the best motion
and scale of the whole), and of places in the world, where height and floor decide.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import smallest
from faults import into_page

from shadowpuppet.calibration.silhouettes import aligned_sets
from shadowpuppet.calibration.solve.tangency_bundle import ROUGH_FOCAL
from shadowpuppet.camera.camera import Camera
from shadowpuppet.geometry import Array, align, rigid, rotation_from_vector, unit, vector_from_rotation
from shadowpuppet.pipeline.options import Options, make_options
from shadowpuppet.pipeline.progress import Listener
from shadowpuppet.pipeline.repair.check import SilhouetteSets, gather_silhouettes
from shadowpuppet.pipeline.repair.placing import DOUBT_FACTOR, SETS, grounded, placed_in_step
from shadowpuppet.pipeline.rig import open_rig
from shadowpuppet.synthetic import Gesture, Mannequin, Ring, Scene, Spec, synthesize

BUILD = Path(__file__).resolve().parent.parent / "build" / "placing"
ROUGH = ((0.0, 0.0, 0.0, 0), (1.0, 0.05, 0.0, 0), (5.0, 0.3, 0.0, 0), (10.0, 0.5, 0.0, 0), (10.0, 0.5, 3.0, 0), (5.0, 0.3, 3.0, 8))
"""Degrees and metres by which each camera is off; the standard deviation of its focal length, per cent, which is solved then; frames by
which its film is late or early at most, which is found then."""
COUNTS, SIZE, HEIGHT = (3, 4, 6), (480, 360), 1.75
HEADER = ("| recording | cameras | off by | tangents apart, px | within the rig: mm | degrees | stated, mm | in the world: mm |\n"
          "|---|---:|---|---:|---:|---:|---:|---:|")  # fmt: skip


def made(folder: Path = BUILD, counts: Sequence[int] = COUNTS, size: tuple[int, int] = SIZE, seconds: float = 6.0) -> list[Path]:
    """The made recordings; those that are there are taken."""
    paths = []
    for count in counts:
        path = folder / f"walk_{count}"
        if not (path / "calibration.toml").exists():
            walk = Gesture(motion="walk", seconds=seconds, path="circle", size=1.6)
            spec = Spec(name=path.name, body=Mannequin(stature=HEIGHT), motion=(walk,), rate=20, scene=Scene(empty_seconds=2),
                        ring=Ring(count=count, radius=4.0, fov_deg=55, size=size))
            synthesize(spec, path, np.random.default_rng(count))
        paths.append(path)
    return paths


def off(camera: Camera, rng: np.random.Generator, degrees: float, metres: float, lens: float) -> Camera:
    """A camera turned and moved in a random direction, with another focal length."""
    turn, move = np.radians(degrees) * unit(rng.normal(size=3)), metres * unit(rng.normal(size=3))
    R = rotation_from_vector(turn) @ camera.T_camera_world[:3, :3]
    factor = np.exp(lens / 100 * rng.normal())
    return replace(camera, T_camera_world=rigid(R, -R @ (camera.centre + move)), matrix=camera.matrix * [factor, factor, 1])


def errors(found: Sequence[Camera], true: Sequence[Camera]) -> tuple[float, float, float]:
    """Means over cameras: of places, m, and directions, rad, within the rig; of places in the world, m."""
    here, there = (np.array([camera.centre for camera in cameras]) for cameras in (found, true))
    moved = align(here, there, scaled=True)
    turns = [vector_from_rotation(a.T_camera_world[:3, :3] @ moved.rotation.T @ b.T_camera_world[:3, :3].T) for a, b in zip(found, true)]
    return (float(np.linalg.norm(moved.apply(here) - there, axis=1).mean()), float(np.linalg.norm(turns, axis=1).mean()),
            float(np.linalg.norm(here - there, axis=1).mean()))


def shifted(sets: SilhouetteSets, steps: Sequence[int]) -> SilhouetteSets:
    """The sets of films that begin later or earlier, by `steps` sets each."""
    count = len(sets.rows)
    return sets._replace(rows=[[row[k] if 0 <= f - step < count and (row := sets.rows[f - step]) else None for k, step in enumerate(steps)]
                               for f in range(count)])


def rows(path: Path, options: Options, height: float | None, seeds: int, rough: Sequence[tuple[float, ...]]) -> Iterator[str]:
    """A row of the table for each roughness, means over seeds."""
    rig = open_rig(path, options)
    in_step = gather_silhouettes(rig, options, Listener(), whole=True)
    for degrees, metres, lens, late in rough:
        figures = list[Array]()
        for seed in range(seeds if degrees else 1):
            rng = np.random.default_rng([seed, len(rig.cameras)])
            cameras = [off(camera, rng, degrees, metres, lens) for camera in rig.cameras]
            sets = shifted(in_step, rng.integers(-late, late + 1, len(cameras)).tolist()) if late else in_step
            fit, steps = placed_in_step(cameras, sets, ROUGH_FOCAL if lens else 0.0)
            within, turned, world = errors(grounded(fit, aligned_sets(sets.rows, steps, SETS), height).cameras, rig.cameras)
            figures.append(np.array([np.nanmean(fit.before), np.nanmean(fit.after), 1000 * within, np.degrees(turned),
                                     1000 * DOUBT_FACTOR * fit.place_sd.mean(), 1000 * world]))
        before, after, within, turned, stated, world = np.mean(figures, axis=0)
        rough_by = f"{degrees:g}°, {100 * metres:g} cm" + (f", lens {lens:g} %" if lens else "")
        rough_by += f", {late:g} frames" if late else ""
        yield (f"| `{path.name}` | {len(rig.cameras)} | {rough_by} | {before:.1f} → {after:.2f} | {within:.0f} | {turned:.2f} | "
               f"{stated:.0f} | {world:.0f} |")


def _smallest(folder: Path) -> list[object]:
    return ["--recordings", *made(folder, (3,), (160, 120), 3.0), "--seeds", 1, "--masks", "--rough", "2,0.1,2,1",
            "--markdown", smallest.copy(Path(__file__).resolve().parent.parent / "docs" / "calibration.md", folder)]


def main() -> None:
    """Parse, place, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--recordings", type=Path, nargs="*", help="folders with a true calibration; made ones without")
    parser.add_argument("--masks", action="store_true", help="the recordings' exact silhouettes in place of those of the films")
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--height", type=float, help=f"of the person, metres; {HEIGHT} for made recordings")
    parser.add_argument("--rough", nargs="*", default=[",".join(map(str, each)) for each in ROUGH], help="degrees,metres,per cent,frames")
    parser.add_argument("--markdown", type=Path, help="page for the table, at its place")
    args = smallest.parse(parser, _smallest)
    lines, rough = [HEADER], [tuple(map(float, each.split(","))) for each in args.rough]
    print(HEADER)
    height = args.height or (None if args.recordings else HEIGHT)
    for path in args.recordings or made():
        for line in rows(path, make_options({"masks": args.masks}), height, args.seeds, rough):
            print(line, flush=True)
            lines.append(line)
    if args.markdown:
        into_page(args.markdown, "placing", "\n".join(lines))


if __name__ == "__main__":
    main()
