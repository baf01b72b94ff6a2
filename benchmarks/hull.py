"""What the visual hull costs: milliseconds for 2 to 8 cameras and for few and many rays, against plain NumPy in the same run.

    python benchmarks/hull.py [--recording FOLDER] [--rounds 30]

Without a recording, of which calibration and masks are used, silhouettes are those of ellipsoids. Times are the least of all rounds, in
which the cases take turns.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import smallest

from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask
from shadowpuppet.geometry import Array, inverse, rigid
from shadowpuppet.io.calibration.calibration_files import read_calibration
from shadowpuppet.tracking.multiview.settings import HullSettings
from shadowpuppet.tracking.multiview.surface.visual_hull import VisualHull, _silhouette
from shadowpuppet.video import open_frames

PERSON = [((0, 0, 0.15), (0.2, 0.13, 0.35)), ((0, 0, 0.65), (0.1, 0.1, 0.14)), ((0, 0.12, -0.5), (0.08, 0.08, 0.45)),
          ((0, -0.12, -0.5), (0.08, 0.08, 0.45)), ((0.1, 0.35, 0.2), (0.05, 0.05, 0.35)), ((-0.1, -0.35, 0.2), (0.05, 0.05, 0.35))]
"""Centres and radii of the ellipsoids, m."""


def made(count: int, size: tuple[int, int] = (640, 480)) -> tuple[list[Camera], list[Mask]]:
    """Cameras in a ring, 4.5 m away, and what they see of `PERSON`."""
    cameras, masks = [], []
    y, x = np.mgrid[: size[1], : size[0]]
    for k in range(count):
        angle = 0.3 + 2 * np.pi * k / count
        z = -np.array([np.cos(angle), np.sin(angle), 0.1])
        z /= np.linalg.norm(z)
        x_axis = np.cross(z, (0, 0, 1)) / np.linalg.norm(np.cross(z, (0, 0, 1)))
        R = np.stack([x_axis, np.cross(z, x_axis), z])
        matrix = np.array([[560.0, 0, size[0] / 2], [0, 560.0, size[1] / 2], [0, 0, 1]])
        camera = Camera(f"cam{k}", size, matrix, np.array([-0.09, 0.05, 0, 0]), rigid(R, R @ (4.5 * z)))
        rays, place = camera.rays(np.stack([x, y], -1)) @ R, camera.centre
        seen = np.zeros(x.shape, bool)
        for centre, radii in PERSON:
            o, d = (place - centre) / radii, rays / radii
            seen |= (d @ o) ** 2 > (d * d).sum(-1) * (o @ o - 1)
        cameras.append(camera)
        masks.append(seen)
    return cameras, masks


def recorded(folder: Path) -> tuple[list[Camera], list[Mask]]:
    """Cameras and the first masks of a recording."""
    cameras = list(read_calibration(folder / "calibration.toml"))
    return cameras, [next(iter(open_frames(folder / "masks" / f"{c.name}.mkv", grey=True))).image > 127 for c in cameras]


def plain(hull: VisualHull, masks: Sequence[Mask]) -> int:
    """Viewing edges in NumPy: each ray with all sides of each other view at once; the number of edges. Contours are given."""
    silhouettes = [_silhouette(mask, view) for mask, view in zip(masks, hull._views)]
    T = hull._T
    taken, found = hull.settings.rays / sum(s.outward.any(1).sum() for s in silhouettes), 0
    for i, silhouette in enumerate(silhouettes):
        known = silhouette.lines[silhouette.outward.any(1)]
        for ray in known[np.unique((np.arange(int(len(known) * taken)) / taken).astype(int))]:
            kept = [(0.05, 100.0)]
            for j, other in enumerate(silhouettes):
                if j != i and kept:
                    kept = _without(kept, _denied(np.append(ray, 1), T[j] @ inverse(T[i]), other.lines, other.ends))
            found += len(kept)
    return found


def _denied(ray: Array, T: Array, lines: Array, ends: Array) -> list[tuple[float, float]]:
    a, b = T[:3, 3], T[:3, :3] @ ray
    line = np.cross(a, b)
    side = lines @ line[:2] + line[2] >= 0
    crossed = np.flatnonzero(side[1:] != side[:-1])
    crossed = crossed[~np.isin(crossed + 1, ends)]
    p, q = lines[crossed], lines[crossed + 1]
    s, t = p @ line[:2] + line[2], q @ line[:2] + line[2]
    x = np.append(p + (s / (s - t))[:, None] * (q - p), np.ones((len(p), 1)), 1)
    z = np.sort(-(np.cross(x, a) @ line) / (np.cross(x, b) @ line))
    return [(z[k], z[k + 1]) for k in range(0, len(z) - 1, 2)]


def _without(kept: list[tuple[float, float]], denied: list[tuple[float, float]]) -> list[tuple[float, float]]:
    for low, high in denied:
        kept = [(a, b) for lo, hi in kept for a, b in ((lo, min(hi, low)), (max(lo, high), hi)) if a < b]
    return kept


def timed(cases: dict[str, Callable[[], object]], rounds: int) -> dict[str, float]:
    """Least milliseconds of each case, which take turns."""
    best = dict.fromkeys(cases, np.inf)
    for n in range(rounds + 1):
        for name, case in cases.items():
            start = time.perf_counter()
            case()
            if n:  # the first compiles
                best[name] = min(best[name], 1e3 * (time.perf_counter() - start))
    return best


def _smallest(folder: Path) -> list[object]:
    return ["--recording", smallest.make(folder / "ring", smallest.RING), "--rounds", 1]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--recording", type=Path)
    parser.add_argument("--rounds", type=int, default=30)
    told = smallest.parse(parser, _smallest)
    cases = {f"{n} cameras": made(n) for n in (2, 4, 6, 8)}
    cases["7 cameras"] = recorded(told.recording) if told.recording else made(7)
    hulls = {f"{name}, {rays} rays": (VisualHull(cameras, HullSettings(rays=rays)), masks) for name, (cameras, masks) in cases.items()
             for rays in ((500, 1000, 2000) if name == "7 cameras" else (2000,))}
    times = timed({name: lambda hull=hull, masks=masks: hull.points(masks) for name, (hull, masks) in hulls.items()}, told.rounds)
    print("| case | points | ms |\n|---|---|---|")
    for name, (hull, masks) in hulls.items():
        print(f"| {name} | {len(hull.points(masks).points)} | {times[name]:.2f} |")
    hull, masks = hulls["7 cameras, 2000 rays"]
    slow = timed({"plain": lambda: plain(hull, masks)}, 1)["plain"]
    print(f"\nplain NumPy, 7 cameras, 2000 rays: {slow:.0f} ms, {slow / times['7 cameras, 2000 rays']:.0f} times as long")


if __name__ == "__main__":
    main()
