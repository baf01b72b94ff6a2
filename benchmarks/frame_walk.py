"""The modules that one frame enters on its way from the film to the run folder: python benchmarks/frame_walk.py

Two tiny made recordings are tracked, one of one camera and one of four. Calls are counted with `sys.setprofile` between two frames
that are written, in the thread that tracks and in those that make silhouettes; a process of its own (long films) is not looked into.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import threading
import warnings
from collections import Counter
from pathlib import Path
from types import FrameType
from typing import Any

import smallest

import shadowpuppet
from shadowpuppet.cli.warm_up import FOUR_CAMERAS, ONE_CAMERA
from shadowpuppet.io.run_writer import RunWriter
from shadowpuppet.pipeline.options import make_options
from shadowpuppet.pipeline.track import track_recording
from shadowpuppet.synthetic import Spec, synthesize

PACKAGE = Path(shadowpuppet.__file__).parent
FRAME = 3
"""The frame, by number, whose way is followed: the first ones begin things."""


def modules_entered(spec: Spec, folder: Path) -> Counter[str]:
    """Calls into each module of the package while one frame of a made recording is tracked."""
    found, written, write = Counter[str](), 0, RunWriter.write

    def count(frame: FrameType, event: str, _: Any) -> None:
        if event == "call" and written == FRAME and (path := Path(frame.f_code.co_filename)).is_relative_to(PACKAGE):
            found[path.relative_to(PACKAGE).with_suffix("").as_posix()] += 1

    def writing(writer: RunWriter, *args: Any) -> None:
        nonlocal written
        write(writer, *args)
        written += 1

    synthesize(spec, folder / spec.name)
    RunWriter.write = writing
    threading.setprofile(count)
    sys.setprofile(count)
    try:
        track_recording(folder / spec.name, folder / f"run-{spec.name}", make_options({"anyway": True}))
    finally:
        sys.setprofile(None)
        threading.setprofile(None)
        RunWriter.write = write
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cameras", type=int, choices=(1, 4), nargs="+", default=(1, 4), help="numbers of cameras")
    told = smallest.parse(parser, lambda folder: ["--cameras", 1])
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # such short films are warned of
        for spec in ({1: ONE_CAMERA, 4: FOUR_CAMERAS}[number] for number in told.cameras):
            found = modules_entered(spec, Path(folder))
            print(f"{spec.name}: {len(found)} modules")
            for module, calls in sorted(found.items()):
                print(f"  {calls:6}  {module}")


if __name__ == "__main__":
    main()
