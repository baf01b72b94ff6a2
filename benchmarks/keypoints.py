"""What a detector's keypoints bring: joint errors by silhouettes, by keypoints, by both, and of the same keypoints triangulated alone.

    python benchmarks/keypoints.py [FILM...] [--detector made] [--seeds 1] [-o build/keypoints]

The films are made: walks toward two cameras, two cameras far apart, a chair that is not in the empty scene before four cameras, and those
of `--rings`, three to eight cameras without training motion. `--one`: upper and whole bodies before one camera, by silhouettes and by both
(`proving_ground.py`, `whole_people.py`, with these columns). `--detector made`: numbers with errors as a detector makes them
(`detector.py`); `mediapipe`: what `shadowpuppet keypoints` finds in the films. Errors are means over shoulders, elbows, wrists, hips, knees
and ankles, mm, a lost joint counting 500; triangulated points are smoothed at 6 Hz. `ms`: time a frame set of tracking and hull.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import smallest
import whole_people
from detector import DETECTORS, detected, detected_together
from proving_ground import made
from whole_people import Figures

from shadowpuppet.geometry import Array
from shadowpuppet.io.keypoints.film_keypoints import film_keypoints, write_keypoints
from shadowpuppet.io.motion.motion_files import read_truth
from shadowpuppet.io.motion.table import read_joints
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.pipeline.options import make_options
from shadowpuppet.pipeline.rig import Rig, open_rig
from shadowpuppet.pipeline.track import track_recording
from shadowpuppet.synthetic import Gesture, Mannequin, Scene, Spec, Viewpoint, named_specs, proving_ground, proving_rings, synthesize
from shadowpuppet.tracking.keypoints.triangulation import triangulated
from shadowpuppet.tracking.smoothing.butterworth import filtered

ROOT = Path(__file__).resolve().parent.parent
JOINTS = tuple(f"{side}_{name}" for name in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle") for side in ("left", "right"))
LOST_MM, CUTOFF = 500.0, 6.0
ROWS = {"triangulated": None, "silhouettes": "silhouettes", "keypoints": "keypoints", "both": "silhouettes,keypoints"}
"""The evidence of each row's runs; None: none is tracked."""


def films(rings: bool = False) -> Iterator[Spec]:
    """Specs of the films."""
    if rings:
        yield from (replace(spec, training=(), tells="nothing") for spec in proving_rings())
        return
    walk = Gesture(motion="walk", seconds=5, path="line", size=2.0)
    for n, (name, apart, motion) in enumerate((("toward_75", (-35, 40), (walk,)), ("toward_60", (-20, 40), (walk,)),
                                               ("apart_115", (-20, 95), (Gesture(motion="reach", seconds=3),
                                                                         Gesture(motion="wave_hands", seconds=3))))):  # fmt: skip
        cameras = tuple(Viewpoint(name=f"cam{k}", azimuth_deg=azimuth, distance=4.2, height=1.6, fov_deg=50, pitch_deg=10, size=(480, 360))
                        for k, azimuth in enumerate(apart, 1))  # fmt: skip
        body = Mannequin.draw(np.random.default_rng(81 + n), "man" if n == 0 else "woman")
        yield Spec(name=name, body=body, motion=motion, cameras=cameras, turn_deg=10 * n, tells="nothing", seed=(51, n),
                   scene=Scene(clothing=81 + n, room=81 + n, empty_seconds=2.0))  # fmt: skip
    yield replace(named_specs()["rings_sits_on_new"], name="new_chair", tells="nothing")


def found_by(detector: str, recording: Path, copy: Path) -> Path:
    """A copy of a recording with the keypoints that `shadowpuppet keypoints` finds in it; made where it is missing."""
    if not (copy / "keypoints").is_dir():
        command = [sys.executable, "-m", "shadowpuppet", "keypoints", recording, "-o", copy, "--with", detector, "--quiet"]
        subprocess.run(list(map(str, command)), check=True)
    return copy


def with_keypoints(recording: Path, detector: str, seed: int = 0) -> Path:
    """A copy of a recording beside it, with keypoints: of one of `detector.DETECTORS`, or those that `shadowpuppet keypoints` finds."""
    found = recording.with_name(f"{recording.name}-{detector}{seed or ''}")
    if detector not in DETECTORS:
        return found_by(detector, recording, found)
    if (found / "keypoints").is_dir():
        return found
    shutil.copytree(recording, found, dirs_exist_ok=True, ignore=shutil.ignore_patterns("keypoints"))
    rig = open_rig(recording, make_options({"evidence": "silhouettes"}))
    truths = [read_joints(path) for path in rig.recording.truths or (recording / "truth.csv",)]
    people = [truth.positions[:, [truth.names.index(name) for name in JOINTS]] for truth in truths]
    cameras = [footage.view.camera for footage in rig.footage]
    given = np.random.default_rng([51, seed]), cameras, truths[0].times, JOINTS
    made = (detected(*given, people[0], DETECTORS[detector]) if len(people) == 1
            else detected_together(*given, people, DETECTORS[detector]))  # fmt: skip
    (found / "keypoints").mkdir()
    for n, footage in enumerate(rig.footage):
        frames = np.repeat(np.arange(len(made)), [len(of[n].person) for of in made])
        xy, sure = (np.concatenate([getattr(of[n], what) for of in made]) for what in ("xy", "confidence"))
        film = film_keypoints(JOINTS, frames, 0 * frames, xy, sure, detector, footage.view.camera.size)
        write_keypoints(found / "keypoints" / f"{footage.view.camera.name}.npz", film)
    return found


def by_triangulation(rig: Rig, times: Array) -> JointTable:
    """The keypoints' joints at some times, triangulated and smoothed."""
    shape = len(rig.footage), len(times), len(JOINTS)
    xy, sure = np.full((*shape, 2), np.nan), np.zeros(shape)
    for n, footage in enumerate(rig.footage):
        assert footage.keypoints is not None
        for t, time in enumerate(times):
            seen = footage.keypoints.at(round((time + footage.view.start) * footage.film.rate))
            for k, name in enumerate(JOINTS):
                if name in seen.names and len(seen.person):
                    best = int(seen.confidence.sum(1).argmax())
                    xy[n, t, k], sure[n, t, k] = seen.xy[best, seen.names.index(name)], seen.confidence[best, seen.names.index(name)]
    points = triangulated([footage.view.camera for footage in rig.footage], xy, np.where(np.isfinite(xy[..., 0]), sure, 0))
    rate = (len(times) - 1) / (times[-1] - times[0])
    return JointTable(times, JOINTS, filtered(times, points, min(CUTOFF, 0.4 * rate)))


def error(found: JointTable, truth: JointTable) -> float:
    """Mean error (mm) of `JOINTS`; one without a place counts `LOST_MM`."""
    nearest = np.abs(truth.times[None] - found.times[:, None]).argmin(1)
    ours, theirs = (table.positions[:, [table.names.index(name) for name in JOINTS]] for table in (found, truth))
    away = 1000 * np.linalg.norm(ours - theirs[nearest], axis=2)
    return float(np.where(np.isfinite(away), away, LOST_MM).mean())


def measured(recording: Path, out: Path, seeds: int, detector: str) -> dict[str, tuple[float, float]]:
    """Mean error (mm) and time a frame set (ms) of each row, means over seeds."""
    values: dict[str, list[tuple[float, float]]] = {row: [] for row in ROWS}
    truth = read_joints(recording / "truth.csv")
    for seed in range(seeds):
        known = with_keypoints(recording, detector, seed)
        for row, evidence in ROWS.items():
            if evidence is None:
                continue
            run = track_recording(known, out / f"{recording.name}-{row}-{seed}", make_options({"seed": seed, "evidence": evidence}))
            spent = run.metrics["ms_per_frame"]
            values[row].append((error(run.motion.table, truth), spent["track"] + spent["hull"]))
        rig = open_rig(known, make_options({}))
        values["triangulated"].append((error(by_triangulation(rig, np.arange(rig.count or 0) / rig.rate), truth), np.nan))
    return {row: tuple(np.mean(some, axis=0).tolist()) for row, some in values.items()}


def one_camera(names: Sequence[str], out: Path, detector: str) -> Iterator[str]:
    """Lines of the table of one camera, for films of some names, all without, or folders of recordings: the run's figures by silhouettes
    and by both."""
    whole = {film.spec.name: film for film in whole_people.films()}
    upper = [spec.name for spec in proving_ground()]
    found = dict[tuple[str, str], list[Figures]]()
    yield whole_people.HEAD.replace("| film |", "| film, evidence |")
    for name in names or [*upper, *whole]:
        path, kind = (whole_people.made(whole[name], out), "whole bodies") if name in whole else (Path(name), "upper bodies")
        if name in upper:
            (path,) = made(out, [name])
        known, truth = with_keypoints(path, detector), read_truth(path / "truth.csv")
        for row in ("silhouettes", "both"):
            options = make_options({"evidence": ROWS[row]} | ({"body": whole[name].body} if name in whole else {}))
            figures = whole_people.figures_of(track_recording(known, out / "runs" / f"{path.name}-{row}", options).motion, truth)
            found.setdefault((kind, row), []).append(figures)
            yield figures.line(f"{path.name}, {row}")
    for (kind, row), figures in found.items():
        yield whole_people.mean_of(figures).line(f"mean of {len(figures)} {kind}, {row}")


def _smallest(folder: Path) -> Sequence[object]:
    recording = smallest.make(folder / "ring", smallest.RING)
    return [recording, "-o", folder]


def main() -> None:
    """Parse, make, track, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("films", nargs="*", help="names of made films, or folders of recordings with truth.csv; all made ones without")
    parser.add_argument("--rings", action="store_true", help="the rings of the proving ground")
    parser.add_argument("--one", action="store_true", help="before one camera")
    parser.add_argument("--detector", default="made", choices=("made", "mediapipe"))
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("-o", "--out", type=Path, default=ROOT / "build" / "keypoints")
    args = smallest.parse(parser, _smallest)
    if args.one:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            for line in one_camera(args.films, args.out, args.detector):
                print(line, flush=True)
        return
    specs = {spec.name: spec for spec in films(args.rings)}
    head = ["film", *ROWS, *(f"ms, {row}" for row, evidence in ROWS.items() if evidence)]
    print("| " + " | ".join(head) + " |\n" + "|---" * len(head) + "|")
    for name in args.films or specs:
        recording = args.out / name if name in specs else Path(name)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            if name in specs and not (recording / "truth.csv").exists():
                shutil.rmtree(recording, ignore_errors=True)
                synthesize(specs[name], recording)
            rows = measured(recording, args.out / "runs", args.seeds, args.detector)
        cells = [f"{rows[row][0]:.1f}" for row in ROWS] + [f"{rows[row][1]:.0f}" for row, evidence in ROWS.items() if evidence]
        print(f"| {recording.name} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
