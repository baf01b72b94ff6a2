"""Time of eq. 2 for one particle: this project's bits, OpenCV's polygons, plain NumPy; all in one run, one after another, again and again.

    python benchmarks/kernels.py [--size 320x240] [--particles 200] [--rounds 21] [--json FILE]

OpenCV and NumPy get the polygons ready-made, OpenCV at whole pixels, and buffers; the bits' time holds kinematics, projection and drawing.
Arm stages draw one arm over a fixed mask, which OpenCV copies first. One thread throughout.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Mapping
from itertools import product
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from shadowpuppet.anthropometry import sizes_from_height
from shadowpuppet.body import BODIES
from shadowpuppet.camera import Camera
from shadowpuppet.geometry import Array
from shadowpuppet.likelihood import Observation, PartialCost
from shadowpuppet.rasterize import Picture, place, unpack

NUMPY_PARTICLES = 5
"""As many are timed with NumPy: it is slow."""


def scene(body: str, size: tuple[int, int]) -> tuple[Picture, Array]:
    """A person of 1.75 m, 2.5 m away, with the arms out and one of them bent."""
    camera = Camera.from_fov(size, np.radians(60))
    picture = Picture(BODIES[body](sizes_from_height(1.75)), camera, place(camera, 2.5, -0.1))
    pose = picture.body.skeleton.pose(left_shoulder_abduction=1.2, left_elbow_flexion=1.0, right_shoulder_abduction=0.9)
    return picture, pose


def opencv_costs(polygons: list[list[Array]], fixed: Array, mask: Array) -> Array:
    """Eq. 2 (N,) of polygons (K, 2), whole pixels, drawn over the mask `fixed` (H, W): what one would write with OpenCV."""
    out, drawn, differs = np.empty(len(polygons)), np.empty_like(fixed), np.empty_like(fixed)
    for n, shapes in enumerate(polygons):
        np.copyto(drawn, fixed)
        for shape in shapes:
            cv2.fillConvexPoly(drawn, shape, 1)
        cv2.bitwise_xor(drawn, mask, differs)
        out[n] = cv2.countNonZero(differs)
    return out


def numpy_costs(polygons: list[list[Array]], fixed: Array, mask: Array) -> Array:
    """The same in NumPy: a polygon is the pixels that lie on one side of all its edges."""
    out = np.empty(len(polygons))
    y, x = np.mgrid[: mask.shape[0], : mask.shape[1]]
    for n, shapes in enumerate(polygons):
        drawn = fixed.astype(bool)
        for shape in shapes:
            ahead = [(b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]) >= 0 for a, b in zip(shape, np.roll(shape, -1, 0))]
            drawn |= np.logical_and.reduce(ahead) | ~np.logical_or.reduce(ahead)
        out[n] = np.count_nonzero(drawn != mask)
    return out


def stage_dofs(picture: Picture, stage: str) -> NDArray[np.int64]:
    return np.flatnonzero([stage == "full" or name.startswith("left_") for name in picture.body.skeleton.dof_names])


def moving(body: str, stage: str, size: tuple[int, int]) -> NDArray[np.int64]:
    """Shapes that a stage draws for every particle."""
    picture = scene(body, size)[0]
    return PartialCost(picture, stage_dofs(picture, stage)).moving


def contenders(body: str, stage: str, size: tuple[int, int], particles: int) -> dict[str, tuple[Callable[[], object], int]]:
    """What is timed, by name, with how many particles it works off."""
    picture, pose = scene(body, size)
    dofs, rng = stage_dofs(picture, stage), np.random.default_rng(0)
    poses = np.repeat(pose[None], particles, axis=0)
    poses[:, dofs] += 0.1 * rng.standard_normal((particles, len(dofs)))
    partial = PartialCost(picture, dofs)
    costs = partial.costs(Observation.of(picture.mask(pose)), pose)
    corners, counts = picture.polygons(picture.transforms(poses), partial.moving)
    exact = [[c[:m] for c, m in zip(*pair)] for pair in zip(corners, counts)]
    whole = [[np.rint(shape).astype(np.int32) for shape in shapes] for shapes in exact]
    mask = picture.mask(pose).astype(np.uint8)
    fixed = unpack(picture.draw(pose, partial.still), size[0]).astype(np.uint8)
    return {
        "bits": (lambda: costs(poses), particles),
        "OpenCV": (lambda: opencv_costs(whole, fixed, mask), particles),
        "NumPy": (lambda: numpy_costs(exact[:NUMPY_PARTICLES], fixed, mask), NUMPY_PARTICLES),
    }


def medians(runs: Mapping[str, tuple[Callable[[], object], int]], rounds: int) -> dict[str, float]:
    """Median time of each, microseconds a particle, measured in turns so that a busy machine slows all alike."""
    times: dict[str, list[float]] = {name: [] for name in runs}
    for turn in range(rounds + 1):  # the first compiles
        for name, (run, particles) in runs.items():
            start = time.perf_counter()
            run()
            if turn:
                times[name].append((time.perf_counter() - start) / particles * 1e6)
    return {name: float(np.median(spent)) for name, spent in times.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", default="320x240")
    parser.add_argument("--particles", type=int, default=200)
    parser.add_argument("--rounds", type=int, default=21)
    parser.add_argument("--json", type=Path)
    args = parser.parse_args()
    cv2.setNumThreads(1)
    width, height = (int(n) for n in args.size.split("x"))
    columns = ("body", "stage", "shapes", "bits", "OpenCV", "NumPy", "OpenCV / bits", "NumPy / bits")
    table = Table(*columns, title=f"Microseconds a particle, {args.size}")
    rows = []
    for body, stage in product(BODIES, ("full", "arm")):
        spent = medians(contenders(body, stage, (width, height), args.particles), args.rounds)
        shapes = len(moving(body, stage, (width, height)))
        rows.append({"body": body, "stage": stage, "shapes": shapes, "size": args.size, "particles": args.particles, "microseconds": spent})
        ratios = (f"{spent['OpenCV'] / spent['bits']:.1f}", f"{spent['NumPy'] / spent['bits']:.0f}")
        table.add_row(body, stage, str(shapes), *(f"{spent[name]:.1f}" for name in ("bits", "OpenCV", "NumPy")), *ratios)
    Console(width=100).print(table)
    if args.json:
        args.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
