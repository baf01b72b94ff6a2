"""How far a run's joints, seen by its camera, lie from landmarks in the picture: for films without a 3D truth.

    python benchmarks/landmarks_2d.py RUN LANDMARKS.csv [left_glove=left_hand ...]

LANDMARKS.csv has the columns time, <name>_u, <name>_v (pixels of the film; empty or nan where not seen). A name that is not a joint's is
mapped to one by NAME=JOINT. Prints the median and the 90th percentile of the distance in pixels.
"""

from __future__ import annotations

import argparse
import csv
from pathlib import Path

import numpy as np
import smallest

from shadowpuppet.io.calibration.calibration_files import read_calibration
from shadowpuppet.io.motion.table import read_joints
from shadowpuppet.io.run import read_run


def distances(run: Path, landmarks: Path, mapping: dict[str, str]) -> dict[str, np.ndarray]:
    """For each landmark that stands for a joint, the distances (pixels) at the times where both are known."""
    motion, (camera, *_) = read_run(run).motion, read_calibration(run / "calibration.toml")
    with landmarks.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    times = np.array([float(row["time"]) for row in rows])
    nearest = np.abs(motion.times[None] - times[:, None]).argmin(1)
    out = {}
    for name in dict.fromkeys(column[:-2] for column in rows[0] if column.endswith("_u")):
        joint = mapping.get(name, name)
        if joint in motion.joint_names:
            seen = np.array([[float(row[f"{name}_{axis}"] or "nan") for axis in "uv"] for row in rows])
            drawn = camera.project(motion.joints[nearest, motion.joint_names.index(joint)])
            out[name] = (far := np.linalg.norm(seen - drawn, axis=1))[np.isfinite(far)]
    return out


def _smallest(folder: Path) -> list[object]:
    recording, run = smallest.track(folder)
    truth, (camera, *_) = read_joints(recording / "truth.csv"), read_calibration(run / "calibration.toml")
    pixels = camera.project(truth.select(["left_hand"]).positions[:, 0])
    rows = [f"{time},{u},{v}" for time, (u, v) in zip(truth.times, pixels)]
    (folder / "landmarks.csv").write_text("\n".join(["time,left_glove_u,left_glove_v", *rows]) + "\n", encoding="utf-8")
    return [run, folder / "landmarks.csv", "left_glove=left_hand"]


def main() -> None:
    """Parse, measure, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("run", type=Path)
    parser.add_argument("landmarks", type=Path)
    parser.add_argument("mapping", nargs="*", help="NAME=JOINT")
    args = smallest.parse(parser, _smallest)
    found = distances(args.run, args.landmarks, dict(pair.split("=", 1) for pair in args.mapping))
    mapped = [pair.split("=", 1)[0] for pair in args.mapping]
    if mapped:
        found["these together"] = np.concatenate([found[name] for name in mapped])
    for name, far in found.items():
        print(f"{name:16s} seen {len(far):5d}   median {np.median(far):6.1f} px   90 % within {np.percentile(far, 90):6.1f} px")


if __name__ == "__main__":
    main()
