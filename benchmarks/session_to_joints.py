"""From films alone to joints: a made session of board films and a made recording whose last camera was nudged since and whose films do not
begin together, by three commands, `calibrate`, `check --fix` and `track`; beside it, tracked with the true cameras and films in step.

    python benchmarks/session_to_joints.py FOLDER [--cameras 4] [--size 640 480] [--seconds 6] [--no-boards]

What is in FOLDER is taken. Prints what `check --fix` left, errors of the cameras, and the errors of the joints of both runs.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from calibration_session import errors, make_session
from smallest import parse

from shadowpuppet.calibration.boards.board import board_from
from shadowpuppet.camera.camera import Camera
from shadowpuppet.cli.app import run
from shadowpuppet.evaluation.evaluation import Comparison, measure_run
from shadowpuppet.geometry import rigid, rotation_from_vector, unit
from shadowpuppet.io.calibration.calibration_files import read_calibration, write_calibration
from shadowpuppet.synthetic import Gesture, Mannequin, Ring, Scene, Spec, synthesize
from shadowpuppet.video import open_frames, write_frames

HEIGHT, RATE = 1.75, 25.0
LENS = (-0.11, 0.04, 0.0006, -0.0004)
NUDGE = (1.0, 0.05)
"""Degrees and metres by which the last camera was turned and moved after the session: 5 to 8 pixels of a picture 480 wide. Where a turn
and a move cancel, `check` finds nothing."""
LATE = 5
"""Frames by which the second camera's film begins before the others': what happens comes later in it."""


def nudged(camera: Camera, rng: np.random.Generator) -> Camera:
    """The camera as it stood before it was nudged."""
    R = rotation_from_vector(np.radians(NUDGE[0]) * unit(rng.normal(size=3))) @ camera.T_camera_world[:3, :3]
    return replace(camera, T_camera_world=rigid(R, -R @ (camera.centre + NUDGE[1] * unit(rng.normal(size=3)))))


def film(folder: Path, count: int, size: tuple[int, int], seconds: float) -> None:
    """Make FOLDER/true, a recording with its true calibration and films in step, and FOLDER/lab, the same without."""
    walk = Gesture(motion="walk", seconds=seconds, path="circle", size=1.4)
    spec = Spec(name="true", body=Mannequin(stature=HEIGHT), motion=(Gesture(motion="stand", seconds=2), walk), rate=RATE, training=(),
                scene=Scene(empty_seconds=2), ring=Ring(count=count, radius=3.6, fov_deg=62, size=size, distortion=LENS))
    synthesize(spec, folder / "made", np.random.default_rng(5))
    for name in ("true", "lab"):
        shutil.copytree(folder / "made", folder / name, ignore=shutil.ignore_patterns("masks*"))
        for path in sorted((folder / "made" / "video").iterdir()):
            cut = 0 if name == "lab" and path.stem == "cam2" else LATE
            with write_frames(folder / name / "video" / path.name, RATE, size=size) as kept:
                for n, (_, image) in enumerate(open_frames(path)):
                    if n >= cut:
                        kept.write(image)
    (folder / "lab" / "calibration.toml").unlink()


def command(words: list[str]) -> None:
    """Run a command; it may end with advice (1), but not with an error."""
    print("shadowpuppet", *words, flush=True)
    if (code := run(words)) > 1:
        sys.exit(code)


def joint_errors(folder: Path, recording: str, options: Sequence[str]) -> tuple[float, float]:
    """Track a recording in the folder; mean and root mean square of its joints' errors, mm."""
    target = folder / f"run-{recording}"
    shutil.rmtree(target, ignore_errors=True)
    command(["track", str(folder / recording), "-o", str(target), "--height", str(HEIGHT), *options])
    found = measure_run(target, folder / "made" / "truth.csv", Comparison(offset=-LATE / RATE)).measured["errors"]
    return found["mean_mm"], found["rmse_mm"]


def main() -> None:
    """Film, calibrate, check, track, compare."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--cameras", type=int, default=4)
    parser.add_argument("--size", type=int, nargs=2, default=(640, 480))
    parser.add_argument("--seconds", type=float, default=6.0, help="of walking; the board is carried for five times as long")
    parser.add_argument("--rate", type=float, default=15.0, help="frames/s of the board's films")
    parser.add_argument("--square", type=float, default=0.16, help="metres: 16 pixels for pictures 640 wide, as the manual asks for")
    parser.add_argument("--every", type=int, default=1, help="track every so many frames")
    parser.add_argument("--no-boards", action="store_true", help="take the true cameras, as they stood in the session, for calibrated ones")
    args = parse(parser, lambda folder: [folder, "--cameras", 3, "--size", 160, 120, "--seconds", 2, "--every", 5, "--no-boards"])
    folder, size = args.folder, tuple(args.size)
    if not (folder / "lab").exists():
        film(folder, args.cameras, size, args.seconds)
    true = list(read_calibration(folder / "true" / "calibration.toml"))
    then = [*true[:-1], nudged(true[-1], np.random.default_rng(0))]
    if not args.no_boards and not (folder / "session" / "extrinsics" / f"{true[-1].name}.mp4").exists():
        make_session(folder / "session", board_from("charuco 7x5", args.square), then, 5 * args.seconds, args.rate,
                     [0.0, 2.4 / args.rate, *[0.0] * args.cameras][: args.cameras], 3)
    clock = time.process_time()
    if args.no_boards:
        write_calibration(folder / "lab" / "calibration.toml", then)
    else:
        command(["calibrate", str(folder / "session"), "-o", str(folder / "lab" / "calibration.toml")])
    print("camera  focal, %  principal, px  picture, px  place, mm  direction, deg  within the rig, mm: as it stood in the session")
    for row in errors(then, list(read_calibration(folder / "lab" / "calibration.toml"))):
        print("  ".join(row))
    command(["check", str(folder / "lab"), "--fix"])
    print("the same after check --fix, as it stands now")
    for row in errors(true, list(read_calibration(folder / "lab" / "calibration.toml"))):
        print("  ".join(row))
    found, best = (joint_errors(folder, name, ["--quiet", "--every", str(args.every)]) for name in ("lab", "true"))
    print(f"{time.process_time() - clock:.0f} s of processor time")
    ratio = found[0] / best[0]
    print(f"joints: mean {found[0]:.1f} mm, rms {found[1]:.1f}; with the true calibration {best[0]:.1f} and {best[1]:.1f}: "
          f"{ratio:.2f} times")
    (folder / "result.json").write_text(json.dumps({"mean": found[0], "true": best[0], "ratio": ratio}) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
