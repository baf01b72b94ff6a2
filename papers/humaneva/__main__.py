"""Make a recording of a trial of HumanEva: `python -m papers.humaneva FOLDER --subject S2 --action Walking -o walking`."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np

from papers.humaneva.trials import HumanEva, read_humaneva, write_humaneva
from shadowpuppet.cli.tables import pairs, show
from shadowpuppet.errors import MISTAKE, ShadowPuppetError
from shadowpuppet.motion.motion import JointTable


def main(tokens: list[str] | None = None) -> int:
    """Read the trial, write the recording, show what it holds; returns the exit code."""
    given = _parser().parse_args(tokens)
    try:
        found = read_humaneva(given.data, given.subject, given.action, given.trial, given.part, given.training_frames)
        folder = given.output or Path(found.recording.name)
        write_humaneva(found, folder)
    except ShadowPuppetError as error:
        print(f"error: {error}", file=sys.stderr)
        return MISTAKE
    show(_table(found, folder))
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m papers.humaneva", description=__doc__)
    parser.add_argument("data", type=Path, help="folder of HumanEva-I or II, with S1, S2, ...")
    parser.add_argument("-o", "--output", type=Path, help="folder of the recording (default: the trial's name)")
    parser.add_argument("--subject", default="S2", help="S1 to S4")
    parser.add_argument("--action", default="Walking", help="Walking, Jog, Box, Gestures, ThrowCatch or Combo")
    parser.add_argument("--trial", type=int, default=1)
    parser.add_argument("--part", choices=("validation", "training", "all"), default="validation",
                        help="frames of HumanEva's own partition, or all; Ni 2008 tracks the validation part of S2")
    parser.add_argument("--training-frames", type=int, default=100, help="frames of the training part for training.csv; 0 for all")
    return parser


def _table(found: HumanEva, folder: Path) -> Any:
    views, duration = found.recording.views, found.recording.duration
    names = ", ".join(view.camera.name for view in views)
    return pairs([
        ("recording", str(folder)), ("films", f"{len(views)} cameras: {names}, {duration:.2f} s"),
        ("truth", _known(found.truth)), ("training", _known(found.training)),
    ])  # fmt: skip


def _known(joints: JointTable | None) -> str:
    if not joints:
        return "none there"
    known = 100 * float(np.isfinite(joints.positions).all(2).mean())
    return f"{len(joints.times)} frames of {len(joints.names)} joints, {known:.0f} % known"


if __name__ == "__main__":
    sys.exit(main())
