"""Overlap of silhouettes with the exact ones, with the film of the empty scene and with the scene recovered from the film alone.

    python benchmarks/no_empty_scene.py RECORDING... [--cameras cam1,cam4] [--every 8] [--sheets FOLDER] [--joints FOLDER]

A recording is a folder with video/<camera>.*, background/<camera>.* and masks/<camera>.*; its background is used for the comparison only.
`--joints` also tracks each recording both ways, all cameras together, into a folder, and prints the errors of its joints.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path

import cv2
import numpy as np
import smallest
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.pipeline.footage import CameraFrame, Footage, camera_footage, chosen_views, open_recording, take_sample
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.prepare import MONOCULAR, MULTIVIEW
from shadowpuppet.pipeline.progress import Listener
from shadowpuppet.pipeline.rig import open_rig
from shadowpuppet.pipeline.silhouettes import Silhouettes, learn_silhouettes
from shadowpuppet.pipeline.track import run
from shadowpuppet.silhouette import ready_mask

Mask = NDArray[np.bool_]
COLUMNS = ("recording", "camera", "with", "least", "without", "least", "lost, median", "lost, worst", "never seen %", "s")
SHOWN = 8
"""Number of frames on a contact sheet."""


def overlap(mask: Mask, exact: Mask) -> float:
    """Intersection over union; 1 where both are empty."""
    union = np.count_nonzero(mask | exact)
    return np.count_nonzero(mask & exact) / union if union else 1.0


def both(footage: Footage) -> tuple[Silhouettes, Silhouettes, float]:
    """Silhouettes with the empty scene and without it, and the seconds that recovering it takes."""
    sample, alone = take_sample(footage), replace(footage, view=replace(footage.view, background=None))
    learn_silhouettes(alone, sample, Options())  # compiles
    start = time.perf_counter()
    without = learn_silhouettes(alone, sample, Options())
    spent = time.perf_counter() - start
    return learn_silhouettes(footage, sample, Options()), without, spent


def measure(footage: Footage, every: int, sheet: Path | None) -> list[str]:
    known, recovered, spent = both(footage)
    scene = recovered.recovered
    assert scene is not None
    if scene.doubt:
        return ["", "", scene.doubt.split(":")[0], *[""] * 4, f"{spent:.1f}"]
    frames = list(islice(footage.frames(ready=True), 0, None, every))
    exact = [ready_mask(frame.ready) for frame in frames if frame.ready is not None]
    masks = [recovered(frame) for frame in frames]
    one, other = (np.array([overlap(mask, right) for mask, right in zip(each, exact)]) for each in (map(known, frames), masks))
    if sheet is not None:
        draw(sheet, frames, masks, exact)
    values = np.median(one), one.min(), np.median(other), other.min(), np.median(one) - np.median(other), (one - other).max()
    return [*(f"{value:.3f}" for value in values), f"{100 * scene.covered.mean():.1f}", f"{spent:.1f}"]


def draw(path: Path, frames: list[CameraFrame], masks: list[Mask], exact: list[Mask]) -> None:
    """A contact sheet: what is wrongly seen in red, what is missed in blue."""
    shown = []
    for n in np.linspace(0, len(exact) - 1, SHOWN).astype(int):
        picture = frames[n].image.copy()
        picture[masks[n] & ~exact[n]], picture[~masks[n] & exact[n]] = (0, 0, 255), (255, 0, 0)
        shown.append(picture)
    cv2.imwrite(str(path), np.vstack([np.hstack(shown[: SHOWN // 2]), np.hstack(shown[SHOWN // 2 :])]))


def rows(path: Path, arguments: argparse.Namespace) -> Iterator[list[str]]:
    options = Options()
    recording = open_recording(path, options)
    for view in chosen_views(recording, arguments.cameras):
        if view.background is None or view.masks is None:
            raise ShadowPuppetError(f"{path}: camera {view.camera.name!r} has no background/ or no masks/ to compare with")
        sheet = None if arguments.sheets is None else Path(arguments.sheets) / f"{path.name}_{view.camera.name}.png"
        yield [path.name, view.camera.name, *measure(camera_footage(recording, view, options), arguments.every, sheet)]


def joint_row(path: Path, folder: Path) -> list[str]:
    """Mean joint errors, mm, of a recording tracked with its empty scene and without, and their ratio."""
    options, found = Options(overlay=False), list[float]()
    for name in ("with", "without"):
        rig = open_rig(path, options)
        if name == "without":
            rig = replace(rig, footage=tuple(replace(each, view=replace(each.view, background=None)) for each in rig.footage))
        done = run(rig, MULTIVIEW if rig.is_multiview else MONOCULAR, folder / f"{path.name}_{name}", options, Listener())
        found.append(done.metrics["errors"]["mean_mm"])
    return [path.name, *(f"{error:.1f}" for error in found), f"{found[1] / found[0]:.2f}"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recordings", nargs="+", type=Path, metavar="RECORDING")
    parser.add_argument("--cameras", help="their names, with commas between; all by default")
    parser.add_argument("--every", type=int, default=8, help="measure every Nth frame")
    parser.add_argument("--sheets", metavar="FOLDER", help="draw contact sheets of the silhouettes there")
    parser.add_argument("--joints", metavar="FOLDER", type=Path, help="track each recording with its empty scene and without, into there")
    arguments = smallest.parse(parser, lambda folder: [smallest.make(folder / "recording"), "--every", 4, "--joints", folder / "runs"])
    table, console = Table(*COLUMNS, box=None), Console(width=140)
    lost = []
    for recording in arguments.recordings:
        for row in rows(recording, arguments):
            table.add_row(*row)
            lost += [float(row[6])] if row[6] else []
    console.print(table)
    if lost:
        console.print(f"lost by the median frame: median {np.median(lost):.3f}, greatest {max(lost):.3f} of {len(lost)} films")
    if arguments.joints is not None:
        joints = Table("recording", "mm with", "without", "ratio", box=None)
        for recording in arguments.recordings:
            joints.add_row(*joint_row(recording, arguments.joints))
        console.print(joints)


if __name__ == "__main__":
    main()
