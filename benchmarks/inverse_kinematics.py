"""How near the whole bodies' skeletons come to measured joints, and how long that takes: the table in docs/method.md.

    python benchmarks/inverse_kinematics.py SHARED

SHARED: a folder with recordings/*/truth.csv and mocap/*.amc.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
import smallest

from shadowpuppet import JointTable, fit_poses, read_joints
from shadowpuppet.io.motion.amc import read_mocap

LIMBS = [f"{side}_{name}" for side in ("left", "right") for name in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")]
RATES = {"02_04": 120.0, "02_10": 120.0, "03_01": 60.0}
"""Frame rates of the motion capture: its files do not tell them."""


def tables(shared: Path) -> dict[str, JointTable]:
    found = {path.parent.name: read_joints(path) for path in sorted(shared.glob("recordings/*/truth.csv"))}
    return found | {path.stem: read_mocap(path).joints(RATES.get(path.stem, 120.0)) for path in sorted(shared.glob("mocap/*.amc"))}


def _smallest(folder: Path) -> list[object]:
    smallest.make(folder / "recordings" / "ring", smallest.RING)
    return [folder]


def main() -> None:
    """Parse, fit, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("shared", type=Path)
    every = tables(smallest.parse(parser, _smallest).shared)
    fit_poses(next(iter(every.values())))  # compiles
    print("| joints of | body | limbs, RMSE mm | largest of a frame | ms a frame |\n|---|---|---|---|---|")
    for name, table in every.items():
        for body in ("anatomical", "cylinders"):
            start = time.perf_counter()
            fitted = fit_poses(table, body, source=name)
            took = time.perf_counter() - start
            limbs = np.sqrt(np.mean([fitted.by_joint[joint] ** 2 for joint in LIMBS]))
            worst, frame = 1000 * np.nanmax(fitted.by_frame), 1000 * took / len(table.times)
            print(f"| {name} | {body} | {1000 * limbs:.1f} | {worst:.0f} | {frame:.1f} |")


if __name__ == "__main__":
    main()
