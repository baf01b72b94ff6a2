"""Exports of a run judged by OpenSim: our model moved by our coordinates, and inverse kinematics of our markers.

    shadowpuppet export RUN --to trc,mot,osim --model own -o OUT
    python benchmarks/judge_in_opensim.py OUT/RUN        # with a Python that has opensim (pip install opensim)

Nothing of this package is used. Printed: how far the model's markers lie off those of the .trc file in poses of the .mot file, and how
far the angles that OpenSim's inverse kinematics finds for the .trc file are off those of the .mot file.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np


def coordinates(path: str) -> tuple[list[str], np.ndarray]:
    """Columns and rows of a .mot file: seconds, then degrees and metres."""
    lines = Path(path).read_text("utf-8").splitlines()
    end = lines.index("endheader")
    return lines[end + 1].split(), np.array([[float(cell) for cell in line.split()] for line in lines[end + 2 :] if line.strip()])


def markers(path: str) -> tuple[list[str], np.ndarray, np.ndarray]:
    """Names, times (T,) and places (T, N, 3), metres, of the markers in a .trc file."""
    lines = Path(path).read_text("utf-8").splitlines()
    names, unit = lines[3].split()[2:], {"mm": 1e-3, "cm": 1e-2, "m": 1.0}[lines[2].split()[4]]
    rows = np.array([[float(cell) for cell in line.split("\t")] for line in lines[5:] if line.strip()])
    return names, rows[:, 1], unit * rows[:, 2 : 2 + 3 * len(names)].reshape(len(rows), -1, 3)


def off_markers(opensim: Any, stem: str) -> dict[str, float]:
    """Greatest distance, metres, of each of the model's markers from the file's."""
    model = opensim.Model(f"{stem}.osim")
    state = model.initSystem()
    columns, rows = coordinates(f"{stem}.mot")
    names, times, places = markers(f"{stem}.trc")
    angles = [not column.startswith("pelvis_t") or column == "pelvis_tilt" for column in columns]
    worst = dict.fromkeys(names, 0.0)
    for row in rows[:: max(1, len(rows) // 50)]:
        for column, value, angle in list(zip(columns, row, angles))[1:]:
            model.getCoordinateSet().get(column).setValue(state, np.radians(value) if angle else value, False)
        model.realizePosition(state)
        frame = int(np.abs(times - row[0]).argmin())
        for n, name in enumerate(names):
            at = model.getMarkerSet().get(name).getLocationInGround(state)
            worst[name] = max(worst[name], float(np.linalg.norm([at.get(axis) for axis in range(3)] - places[frame, n])))
    return worst


def off_angles(opensim: Any, stem: str) -> dict[str, float]:
    """Root mean square differences, degrees, of the angles by inverse kinematics, apart from whole turns."""
    model = opensim.Model(f"{stem}.osim")
    model.initSystem()
    columns, rows = coordinates(f"{stem}.mot")
    with tempfile.TemporaryDirectory() as folder:
        tool = opensim.InverseKinematicsTool()
        tool.setModel(model)
        tool.setMarkerDataFileName(f"{stem}.trc")
        tool.setStartTime(float(rows[0, 0]))
        tool.setEndTime(float(rows[-1, 0]))
        tool.setResultsDir(folder)
        tool.setOutputMotionFileName(f"{folder}/ik.mot")
        tool.run()
        found, solved = coordinates(f"{folder}/ik.mot")
    off = {}
    for column in columns[1:]:
        if column in found and (column == "pelvis_tilt" or not column.startswith("pelvis_t")):
            there = np.interp(solved[:, 0], rows[:, 0], rows[:, columns.index(column)])
            error = (solved[:, found.index(column)] - there + 180) % 360 - 180
            off[column] = float(np.sqrt((error**2).mean()))
    return off


def main(stem: str) -> None:
    """Judge the three files, and print what is off; `--smallest` needs no files and only says whether OpenSim is there."""
    try:
        import opensim
    except ImportError:
        print("skipped: there is no opensim here (pip install opensim)")
        return
    if stem == "--smallest":
        return
    opensim.Logger.setLevelString("error")
    stem = str(Path(stem).resolve())
    worst = off_markers(opensim, stem)
    print(f"{len(worst)} markers: at most {1000 * max(worst.values()):.4f} mm off ({max(worst, key=worst.__getitem__)})")
    for column, off in off_angles(opensim, stem).items():
        print(f"{column}: {off:.2f} degrees (rms)")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "--smallest")
