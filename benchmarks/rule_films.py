"""The films on which rules are counted and switched off, and what a run of one is worth: for `rules.py`.

As a program, `rule_films.py FOLDER OUT SHARED SEEDS FILM... [--lines] [--silhouettes]` tracks films one after another and appends a JSON
line to OUT for each run that OUT lacks. With `--lines` each line also has the lines of the package that ran, by file. With `--silhouettes`
nothing is tracked: the error is that of the silhouettes of `SHOWN` frames of each camera, thousandths of the area of both.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from counted_lines import lines_that_ran

from shadowpuppet.errors import ShadowPuppetError

LOST_MM = 500.0
"""Error of a missing joint, mm."""
FAR_MM, NEAR_MM = 300.0, 100.0
"""Errors (mm) above which a joint is far off, and below which it is near the truth."""
SHOWN = 10
"""Number of frames, spread over the film, whose silhouettes are compared with exact ones."""
GROUPS = ("ground", "rings", "faults", "postures", "people", "whole", "pairs", "made", "real")


class Film(NamedTuple):
    """A film, and how it is tracked."""

    group: str
    name: str
    make: Callable[[Path], Path]
    """Makes the recording in a folder unless it is there, and returns the recording's."""
    options: Mapping[str, Any] = {}

    @property
    def label(self) -> str:
        """Group and name, without blanks."""
        return f"{self.group}/{self.name}".replace(" ", "_").replace(",", "")


def _made(spec: Any, empty: bool, folder: Path) -> Path:
    """The recording of a spec. `empty`: with its empty scene."""
    from shadowpuppet.synthetic import synthesize

    if not (folder / "made").exists():
        shutil.rmtree(folder, ignore_errors=True)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            synthesize(spec, folder)
        if not empty:
            shutil.rmtree(folder / "background")
        (folder / "made").touch()
    return folder


def _alone(n: int) -> Any:
    """A film of the n-th of five made people whose empty scene is unknown."""
    import numpy as np

    from shadowpuppet.synthetic import Mannequin, Ring, Scene, Spec, Viewpoint
    from shadowpuppet.synthetic.spec_changes import parse_gestures

    body = Mannequin.draw(np.random.default_rng(120 + n), ("man", "woman", "child", "man", "woman")[n], age=9 if n == 2 else None)
    look = Scene(clothing=120 + n, room=120 + n, empty_seconds=1, background="textured" if n % 2 else "plain")
    if n < 3:
        return Spec(name=f"alone_{n}", body=body, motion=parse_gestures(("wave_hands 3, bend_aside 3", "reach 5", "random 6")[n]),
                    cameras=(Viewpoint(height=0.9 * body.stature, distance=2.2),), scene=look, rate=10, seed=(48, n))  # fmt: skip
    return Spec(name=f"alone_{n}", body=body, motion=parse_gestures(("walk 3", "reach 3")[n - 3]), training=(), scene=look, rate=10,
                ring=Ring(count=3 + n % 2, radius=3.8, fov_deg=44, seed=n), seed=(48, n))  # fmt: skip


def _kept(source: Path, background: str, folder: Path) -> Path:
    """A real recording, with links to what it has: nothing is written beside the originals. `background`: a picture of the empty scene."""
    folder.mkdir(parents=True, exist_ok=True)
    for path in source.iterdir():
        if not (link := folder / ("cam.mp4" if path.name == "film.mp4" else path.name)).exists():
            link.symlink_to(path.resolve())
    return folder / "cam.mp4" if background else folder


def films(shared: Path | None = None) -> Iterator[Film]:
    """All films. `shared`: the folder with real recordings; without them if there is none."""
    import fault_rows
    import people
    import postures
    import whole_people

    from shadowpuppet.synthetic import proving_ground, proving_rings

    yield from (Film("ground", spec.name, partial(_made, spec, True)) for spec in proving_ground())
    yield from (Film("rings", spec.name, partial(_made, spec, True), {"every": 3}) for spec in proving_rings())
    one, two = fault_rows.films_of_one()
    yield from (Film("faults", f"one, {row.name.replace(':', '')}", partial(_made, row.of((one, two)[n % 2]), True))
                for n, row in enumerate(fault_rows.ONE))  # fmt: skip
    yield from (Film("faults", f"several, {row.name.replace(':', '')}", partial(_made, row.of(fault_rows.films_of_several()[0]), True))
                for row in fault_rows.SEVERAL)  # fmt: skip
    for film in postures.films():
        yield Film("postures", film.name, partial(_made, film.spec, True), {"body": film.body} if film.body else {})
    yield from (Film("people", film.name, partial(_made, film.spec, True)) for film in people.FILMS)
    yield from (Film("whole", film.name, partial(_made, film.spec, True)) for film in whole_people.films())
    yield from (Film("pairs", film.name, partial(_made, film.spec, True)) for film in whole_people.pairs())
    yield from (Film("made", f"alone {n}", partial(_made, _alone(n), n == 2)) for n in range(5))
    if shared is None or not (shared / "real").is_dir():
        return
    real = shared / "real"
    yield Film("real", "balancing", partial(_kept, real / "balancing", ""), {"every": 3})
    yield Film("real", "dancer", partial(_kept, real / "dancer", ""), {"end": "8"})
    yield Film("real", "sitting", partial(_kept, real / "sitting", ""), {"camera": "cam1,cam2,cam4", "end": "2"})
    yield Film("real", "office", partial(_kept, real / "office", ""), {"every": 2, "fov": 43.6})
    yield Film("real", "multiperson", partial(_kept, real / "multiperson", ""), {"end": "1"})
    yield Film("real", "walking", partial(_kept, shared / "recordings" / "walking", ""), {"every": 4, "camera": "cam1,cam3,cam5,cam7"})
    yield Film("real", "reaching", partial(_kept, shared / "recordings" / "reaching", ""))
    yield Film("real", "upper_body", partial(_kept, shared / "recordings" / "upper_body", ""), {"end": "12"})


def judged(run: Any, folder: Path, recording: Path) -> dict[str, float]:
    """What a run is worth: its mean error (mm), per cent of the joints that are far off and vouched for, of those near the truth that are
    doubted, of frames that are tracked, the overlap of body and silhouettes, and the time a frame (ms)."""
    import numpy as np

    from shadowpuppet.io.motion.motion_files import read_truth
    from shadowpuppet.io.people import person_folders
    from shadowpuppet.io.run import read_run
    from shadowpuppet.motion.limbs import limb_of
    from shadowpuppet.motion.metrics import joint_errors
    from shadowpuppet.motion.motion import JointTable
    from shadowpuppet.pipeline.options import make_options
    from shadowpuppet.pipeline.rig import open_rig

    motions = [read_run(each).motion for each in person_folders(folder).values()] or [run.motion]
    truths = [read_truth(path) for path in sorted(recording.glob("truth*.csv"))] if recording.is_dir() else []
    truths = truths[1:] if len(truths) > 1 and (recording / "truth.csv").exists() else truths
    rig = open_rig(recording, make_options({})) if truths else None
    errors, far, silent, near, doubted, joints = list[float](), 0, 0, 0, 0, 0
    for truth in truths:
        best = None
        for motion in motions:
            nearest = np.abs(truth.times[None] - motion.times[:, None]).argmin(1)
            there = JointTable(motion.times, truth.names, truth.positions[nearest])
            found = joint_errors(motion.table, there, camera=None if rig is None or rig.is_multiview else rig.cameras[0])
            away = 1000 * np.where(found.known, found.distance, np.nan)
            away[found.known & ~np.isfinite(away)] = LOST_MM
            if best is None or np.nanmean(away) < np.nanmean(best[0]):
                sure = motion.limb_status[:, [motion.limbs.index(limb_of(name)) for name in found.names]] == "tracked"
                best = away, sure, found.known & ~found.lost
        assert best is not None
        away, sure, given = best
        errors.append(float(np.nanmean(away)))
        joints += int(given.sum())
        far += int((given & (away > FAR_MM)).sum())
        silent += int((given & sure & (away > FAR_MM)).sum())
        near += int((given & (away < NEAR_MM)).sum())
        doubted += int((given & ~sure & (away < NEAR_MM)).sum())
    status = np.concatenate([motion.status for motion in motions])
    overlaps = np.concatenate([motion.overlap for motion in motions])
    return {"error": float(np.mean(errors)) if errors else float("nan"), "far": 100 * far / max(joints, 1),
            "silent": 100 * silent / max(joints, 1), "false": 100 * doubted / max(near, 1),
            "tracked": 100 * float((status == "tracked").mean()), "people": len(motions),
            "overlap": float(np.nanmean(overlaps)) if np.isfinite(overlaps).any() else float("nan"),
            "ms": sum(run.metrics.get("ms_per_frame", {}).values())}  # fmt: skip


def silhouettes(film: Film, folder: Path) -> dict[str, Any]:
    """How far a film's silhouettes are from its exact ones, thousandths, and the time a frame (ms); empty without exact ones."""
    import numpy as np

    from shadowpuppet.geometry import evenly_spread
    from shadowpuppet.motion.metrics import overlap
    from shadowpuppet.pipeline.footage import take_sample
    from shadowpuppet.pipeline.options import make_options
    from shadowpuppet.pipeline.rig import open_rig
    from shadowpuppet.pipeline.silhouettes import learn_silhouettes
    from shadowpuppet.silhouette import ready_mask

    options = make_options({**film.options, "masks": False})
    errors, spent, number = list[float](), 0.0, 0
    for footage in open_rig(film.make(folder / film.label), options).footage:
        if footage.view.masks is None:
            continue
        found, frames = learn_silhouettes(footage, take_sample(footage), options), list(footage.frames(ready=True))
        for frame in (frames[n] for n in evenly_spread(len(frames), SHOWN)):
            start = time.process_time()
            mask = found(frame)
            spent, number = spent + time.process_time() - start, number + 1
            if frame.ready is not None and (exact := ready_mask(frame.ready)).any():
                errors.append(1000 * (1 - overlap(mask, exact)))
    return {"error": float(np.mean(errors)), "ms": 1000 * spent / number} if errors else {}


def run_film(film: Film, folder: Path, seed: int) -> dict[str, Any]:
    """Track a film and judge it."""
    from shadowpuppet.pipeline.options import make_options
    from shadowpuppet.pipeline.track import track_recording

    recording, out = film.make(folder / film.label), folder / "runs" / str(seed)
    shutil.rmtree(out, ignore_errors=True)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            run = track_recording(recording, out, make_options({**film.options, "seed": seed}))
            return judged(run, out, recording)
        except ShadowPuppetError as error:
            return {"refused": str(error)}


def tracked_films(arguments: argparse.Namespace) -> Iterator[dict[str, Any]]:
    """The runs that are missing, each when it is done."""
    done = set()
    if arguments.out.exists():
        done = {(each["film"], each["seed"]) for each in map(json.loads, arguments.out.read_text("utf-8").splitlines())}
    chosen = {film.label: film for film in films(arguments.shared)} | {"tiny": _tiny()}
    for label in arguments.films:
        for seed in range(arguments.seeds):
            if (label, seed) not in done:
                yield {"film": label, "seed": seed} | _measured(chosen[label], seed, arguments)


def _tiny() -> Film:
    from smallest import ONE

    return Film("tiny", "", partial(_made, ONE, True), {"masks": True})


def _measured(film: Film, seed: int, arguments: argparse.Namespace) -> dict[str, Any]:
    """A run, and with `lines` which lines of the package ran, by file."""
    folder: Path = arguments.folder
    if arguments.silhouettes:
        return silhouettes(film, folder)
    if not arguments.lines:
        return run_film(film, folder, seed)
    film.make(folder / film.label)
    lines_that_ran("shadowpuppet")  # those of making the film
    return run_film(film, folder, seed) | {"lines": lines_that_ran("shadowpuppet")}


def run() -> None:
    """Parse, track, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("shared", type=Path)
    parser.add_argument("seeds", type=int)
    parser.add_argument("films", nargs="+")
    parser.add_argument("--lines", action="store_true")
    parser.add_argument("--silhouettes", action="store_true")
    arguments = parser.parse_args()
    if arguments.lines:  # the lines of another process would not be counted
        import shadowpuppet.pipeline.frame_process as frame_process

        frame_process.WORTHWHILE = sys.maxsize
    for found in tracked_films(arguments):
        with arguments.out.open("a", encoding="utf-8") as file:
            file.write(json.dumps(found) + "\n")
        told = found.get("refused") or f"error {found.get('error', float('nan')):.1f}, {found.get('ms', 0):.0f} ms"
        print(found["film"], found["seed"], told, flush=True)


if __name__ == "__main__":
    run()
