"""The flag `--smallest` of every script here: its whole way in some seconds, on made data, with few particles. CI runs it
(tests/test_benchmarks.py)."""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from shadowpuppet.synthetic import Gesture, Ring, Scene, Spec, Viewpoint, synthesize
from shadowpuppet.tracking.multiview.settings import MULTIVIEW_PRESETS

ONE = Spec(name="tiny", motion=(Gesture(motion="wave_hands", seconds=2),), cameras=(Viewpoint(size=(160, 120)),), rate=8,
           scene=Scene(empty_seconds=1))  # fmt: skip
RING = Spec(name="tiny_ring", motion=(Gesture(motion="walk", seconds=2.5),), rate=10, scene=Scene(empty_seconds=1),
            ring=Ring(count=4, radius=3.6, fov_deg=42, size=(160, 120)))  # fmt: skip

FEW = {"particles": 4, "cycles": 1, "hull": {"rays": 300}}
if "--smallest" in sys.argv:  # also in the processes that a script starts
    MULTIVIEW_PRESETS["default"].update(FEW)
KEPT = "SMALLEST_KEPT"
"""Environment variable: a folder in which tiny recordings and runs (`keep`) lie, to be copied in place of made."""


def parse(parser: argparse.ArgumentParser, smallest: Callable[[Path], Sequence[object]]) -> argparse.Namespace:
    """The arguments; with `--smallest [FOLDER]` those that `smallest` returns for the folder, a temporary one where none is given.

    `smallest` makes its data in the folder, and its arguments have the script write nowhere else.
    """
    parser.add_argument("--smallest", nargs="?", metavar="FOLDER", help="a short form on made data, in FOLDER or a temporary one")
    if "--smallest" not in (tokens := sys.argv[1:]):
        return parser.parse_args()
    named = tokens[tokens.index("--smallest") + 1 :]
    folder = Path(named[0] if named else tempfile.mkdtemp(prefix="shadowpuppet-smallest-"))
    folder.mkdir(parents=True, exist_ok=True)
    return parser.parse_args([str(argument) for argument in smallest(folder)])


def make(folder: Path, spec: Spec = ONE) -> Path:
    """A tiny recording, or a ring's (`RING`), in `folder`; marked as the proving grounds' are, so that it is taken for one of theirs."""
    if KEPT in os.environ:
        return shutil.copytree(Path(os.environ[KEPT], spec.name), folder)
    synthesize(spec, folder, np.random.default_rng(7))
    (folder / "made").touch()
    return folder


def track(folder: Path, spec: Spec = ONE) -> tuple[Path, Path]:
    """A tiny recording and a run of it, in `folder`."""
    from shadowpuppet.pipeline.options import make_options
    from shadowpuppet.pipeline.track import track_recording

    recording, run = make(folder / spec.name, spec), folder / f"{spec.name}_run"
    if KEPT in os.environ:
        return recording, shutil.copytree(Path(os.environ[KEPT], run.name), run)
    chosen = {"preset": "liu2011"} if spec is ONE else {"multiview": FEW}
    track_recording(recording, run, make_options({"masks": True, **chosen}))
    return recording, run


def keep(folder: Path) -> None:
    """Make what scripts that are given the folder by `KEPT` copy."""
    track(folder, ONE)
    track(folder, RING)


def copy(page: Path, folder: Path) -> Path:
    """A copy of a page of the documentation, for tables to be written into."""
    target = folder / page.name
    target.write_text(page.read_text("utf-8"), encoding="utf-8")
    return target
