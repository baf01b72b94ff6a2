"""The proving ground of several cameras: settings of the tracker on made recordings, bodies x motions x rings x noise, to choose them by.

    python benchmarks/proving_rings.py [--rows "default;no prior"] [--seeds 1] [--cameras 3] [--masks] [--frames 180]
        [--markdown FILE] [--workers 2]

The recordings (`synthetic.proving_rings`) are made where they are missing, in build/rings; with `--cameras N` the same motions of other
people, with N cameras elsewhere and no training motion, in build/rings_N. Of each, silhouettes and surface points are
taken once and the person is measured once for every body, as `shadowpuppet track` does it; then every row tracks the same frames. A row is
a choice of settings; the table has means and medians of the RMSE over recordings and seeds, and `se`, the standard error of its difference
from the first row's, in pairs of the same recording: differences within two of them are not significant. `ms` are of one core,
hull included.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import smallest
from multiview import BUILD, made, measures
from speed.chain import ONE_THREAD_EACH

from shadowpuppet.body.anthropometry import AVERAGE_HEIGHT
from shadowpuppet.body.models import make_body
from shadowpuppet.body.shapes import Body
from shadowpuppet.body.sizes import Sizes
from shadowpuppet.camera.colour_codes import colour_codes
from shadowpuppet.camera.mask import Seen
from shadowpuppet.geometry import Array
from shadowpuppet.io.motion.table import read_joints
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.pipeline.findings.rig import survey_rig
from shadowpuppet.pipeline.options import make_options
from shadowpuppet.pipeline.person_rig import MultiviewSubject, fit_multiview
from shadowpuppet.pipeline.rig import open_rig, read_frames
from shadowpuppet.pipeline.silhouette_cache import MaskStore
from shadowpuppet.synthetic import Spec, proving_rings
from shadowpuppet.synthetic.person.mannequin import Mannequin, PersonKind
from shadowpuppet.tracking.multiview.surface.visual_hull import SurfacePoints, VisualHull

ROWS: dict[str, dict[str, Any]] = {
    "default": {},
    "no training": {"training": False},
    "no prior": {"defensive": 1.0},
    "prior alone": {"defensive": 0.0},
    "8 particles": {"particles": 8},
    "24 particles": {"particles": 24},
    "32 particles": {"particles": 32},
    "40 particles": {"particles": 40},
    "weighted mean": {"estimate": "mean"},
    "no silhouettes": {"silhouettes": 0.0},
    "silhouettes / 4": {"silhouettes": 0.025},
    "no colours of arms": {"arm_colours": 0.0},
    "colours of arms": {"arm_colours": 0.1},
    "no local search": {"local": 0},
    "no training, height x 1.05": {"training": False, "height": 1.05},
    "no training, sizes x 1.05": {"training": False, "sizes": 1.05},
    "no training, no local search": {"training": False, "local": 0},
    "any arms": {"arms": 0.0},
    "no training, any arms": {"training": False, "arms": 0.0},
    "no training, arms x 2": {"training": False, "arms": 2e-4},
    "any limbs": {"limbs": 0.0},
    "no training, any limbs": {"training": False, "limbs": 0.0},
    "no training, any limbs, arms x 2": {"training": False, "limbs": 0.0, "arms": 2e-4},
    "no training, limbs x 2": {"training": False, "limbs": 2e-4},
    "local search x 2": {"local": 8},
    "noise x 0.5": {"sigma_rotation": 0.075},
    "noise x 2": {"sigma_rotation": 0.3},
    "keep 0": {"keep": 0.0},
    "keep 1": {"keep": 1.0},
    "velocity 1": {"velocity": 1.0},
    "pull x 10": {"gauss_newton": {"pull": 1e-4}},
    "pull x 30": {"gauss_newton": {"pull": 3e-4}},
    "pull x 10, 32 particles": {"gauss_newton": {"pull": 1e-4}, "particles": 32},
    "pull / 10": {"gauss_newton": {"pull": 1e-6}},
    "tau x 1.5": {"gauss_newton": {"coarse_tau": 0.09, "fine_tau": 0.06}},
    "epsilon 0.3": {"surface": {"epsilon": 0.3, "tau": 0.06}},
    "more iterations": {"gauss_newton": {"coarse": 8, "fine": 6}},
    "forces": {"refinement": "forces"},
    "cylinders": {"body": "cylinders"},
    "every camera carves": {"hull": {"tolerated": 0}},
    "half the rays": {"hull": {"rays": 1000}},
    "ni2008": {"preset": "ni2008"},
}
"""Each the default with something changed. `height` is a factor on the height that the recording tells, from which sizes are then measured;
`sizes` one on all sizes measured, which stay so: what measuring is worth to a person of whom a wrong height is known."""
CHILDREN, WOMEN = ("rings_sit", "rings_child"), ("rings_walk", "rings_lift", "rings_reach", "rings_bend")


def scaled(name: str, sizes: Sizes, factor: float) -> Body:
    """A body of sizes that are all larger by a factor."""
    return make_body(name, type(sizes).from_array(factor * sizes.to_array()))


class Case:
    """A recording read once: silhouettes and colours, surface points and measured people by the settings that they depend on."""

    def __init__(self, path: Path, masks: bool, frames: int) -> None:
        """`masks`: the exact ones; `frames`: so many at most."""
        self.rig = open_rig(path, make_options({"masks": masks}))
        self.survey = survey_rig(self.rig, make_options({"masks": masks}))
        truth = read_joints(self.rig.recording.truth)  # pyright: ignore[reportArgumentType]
        self.times, self.store = list[float](), MaskStore(limit=10**12)
        for each in read_frames(self.rig, [each.segmented for each in self.survey.silhouettes], ready=masks):
            self.times.append(each.time)
            self.store.add(each.time, Seen(each.seen.masks, codes=tuple(map(colour_codes, each.corrected))))
            if len(self.times) == frames:
                break
        known = truth.times <= self.times[-1] + 1e-6
        self.truth = JointTable(truth.times[known], truth.names, truth.positions[known])
        self.hulls: dict[str, tuple[list[SurfacePoints], float]] = {}
        self.subjects: dict[str, MultiviewSubject] = {}

    def run(self, values: Mapping[str, Any], seed: int) -> dict[str, Any]:
        """Measures of one row and seed."""
        values = dict(values)
        training, preset = values.pop("training", True), values.pop("preset", "default")
        taller, larger, told = values.pop("height", 1.0), values.pop("sizes", 1.0), self.rig.recording.subject.height
        height = told if taller == 1 else taller * (told or AVERAGE_HEIGHT)
        options = make_options({"preset": preset, "multiview": values, "height": height})
        settings = options.multiview
        key = json.dumps([settings.body, training, seed, taller])
        if key not in self.subjects:
            rig = self.rig if training else replace(self.rig, recording=replace(self.rig.recording, training=None))
            self.subjects[key] = fit_multiview(np.random.default_rng([seed, 0]), replace(self.survey, rig=rig), options)
        known = self.subjects[key].tracker
        body = known.body if larger == 1 else scaled(settings.body, self.subjects[key].person.sizes, larger)
        tracker = replace(known, body=body, settings=settings, prior=known.prior if settings.method == "hybrid" else None)
        sets = list(self.store)
        if (at := repr(settings.hull)) not in self.hulls:
            hull, start = VisualHull(self.rig.cameras, settings.hull), time.process_time()
            self.hulls[at] = [hull.points(each.seen.masks) for each in sets], time.process_time() - start
        points, spent = self.hulls[at]
        rng, state, poses, start = np.random.default_rng([seed, 1]), None, list[Array](), time.process_time()
        for surface, (_, _, seen, *_) in zip(points, sets):
            state = (tracker.start(rng, surface, seen.masks) if state is None
                     else tracker.step(rng, state, surface, seen.masks, codes=seen.codes))  # fmt: skip
            poses.append(np.where(state.status in ("lost", "absent"), np.nan, state.pose))
        spent += time.process_time() - start
        shown = np.array(poses)
        joints = tracker.body.points(np.nan_to_num(shown))
        joints[np.isnan(shown).any(1)] = np.nan
        found = measures(JointTable(np.array(self.times), tracker.body.landmark_names, joints), self.truth)
        return found | {"ms": 1000 * spent / len(poses)}


def with_cameras(spec: Spec, n: int, cameras: int) -> Spec:
    """The motion of the n-th spec by another person in another room, before `cameras` cameras at other places, without training motion."""
    assert spec.ring is not None
    seed = 1000 * cameras + n
    rng, name = np.random.default_rng(seed), spec.name
    kind: PersonKind = "child" if name in CHILDREN else "woman" if name in WOMEN else "man"
    body = Mannequin.draw(np.random.default_rng(seed), kind, age=8 if kind == "child" else None)
    ring = replace(spec.ring, count=cameras, radius=float(rng.uniform(3.4, 4.4)), height=float(rng.uniform(1.3, 2.3)),
                   start_deg=float(rng.uniform(0, 90)), jitter=0.6, fov_deg=50, size=(480, 360), seed=seed)  # fmt: skip
    scene = replace(spec.scene, clothing=seed, room=seed)
    return replace(spec, body=body, ring=ring, scene=scene, training=(), rate=30, seed=(7, seed))


def run(path: Path, rows: Mapping[str, Mapping[str, Any]], seeds: int, masks: bool, frames: int) -> dict[str, list[dict[str, Any]]]:
    """Measures of one recording: row to seeds."""
    case = Case(path, masks, frames)
    out = {}
    for name, values in rows.items():
        out[name] = [case.run(values, seed) for seed in range(seeds)]
        print(f"{path.name}, {name}: {np.mean([one['rmse'] for one in out[name]]):.1f} mm", flush=True)
    return out


def table(found: Mapping[str, Mapping[str, list[dict[str, Any]]]]) -> str:
    """One line a row of settings, as Markdown."""
    rows = list(next(iter(found.values())))
    errors = {row: np.array([np.mean([one["rmse"] for one in runs[row]]) for runs in found.values()]) for row in rows}
    lines = ["| settings | mean | se | median | worst | lost % | ms |", "|---|---:|---:|---:|---:|---:|---:|"]
    for row in rows:
        apart, runs = errors[row] - errors[rows[0]], [one for each in found.values() for one in each[row]]
        se = apart.std(ddof=1) / np.sqrt(len(apart)) if len(apart) > 1 else float("nan")
        lost = 100 * np.mean([one["lost"] / one["frames"] for one in runs])
        cells = [errors[row].mean(), se, np.median(errors[row]), errors[row].max(), lost, np.mean([one["ms"] for one in runs])]
        lines.append(f"| {row} | " + " | ".join(f"{cell:.1f}" for cell in cells) + " |")
    return "\n".join(lines)


def each(found: Mapping[str, Mapping[str, list[dict[str, Any]]]]) -> str:
    """RMSE of every recording under every row, as Markdown."""
    rows = list(next(iter(found.values())))
    lines = ["| recording | " + " | ".join(rows) + " |", "|---|" + "---:|" * len(rows)]
    lines += [f"| {name} | " + " | ".join(f"{np.mean([one['rmse'] for one in runs[row]]):.1f}" for row in rows) + " |"
              for name, runs in found.items()]
    return "\n".join(lines)


def _smallest(folder: Path) -> list[object]:
    smallest.make(folder / "rings_jog", smallest.RING)
    return ["--rows", "default;8 particles", "--recordings", "rings_jog", "--masks", "--workers", 1, "--folder", folder,
            "--markdown", folder / "table.md"]


def main() -> None:
    """Parse, run, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rows", default="", help="names, with ; between them: " + "; ".join(ROWS))
    parser.add_argument("--recordings", default="", help="names, with ; between them; all without")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--cameras", type=int, help="number of cameras of films of other people; default: the rings as they are")
    parser.add_argument("--masks", action="store_true", help="exact silhouettes in place of those of the films")
    parser.add_argument("--frames", type=int, default=10**6, help="so many of each, at most")
    parser.add_argument("--folder", type=Path, help="where the recordings are, or are made")
    parser.add_argument("--markdown", type=Path, help="write the tables there too")
    parser.add_argument("--workers", type=int, default=2)
    args = smallest.parse(parser, _smallest)
    chosen = [row.strip() for row in args.rows.split(";") if row.strip()] or list(ROWS)
    unknown = [row for row in chosen if row not in ROWS]
    if unknown:
        parser.error(f"unknown row {unknown[0]!r}; there are: {'; '.join(ROWS)}")
    specs = proving_rings()
    if args.cameras is not None:
        specs = tuple(with_cameras(spec, n, args.cameras) for n, spec in enumerate(specs))
    folder = args.folder or BUILD / ("rings" if args.cameras is None else f"rings_{args.cameras}")
    paths = made(folder, filter(None, args.recordings.split(";")), specs)
    rows, n = {row: ROWS[row] for row in chosen}, len(paths)
    os.environ |= ONE_THREAD_EACH
    with ProcessPoolExecutor(args.workers, get_context("spawn")) as pool:
        results = pool.map(run, paths, [rows] * n, [args.seeds] * n, [args.masks] * n, [args.frames] * n)
        found = {path.name: one for path, one in zip(paths, results)}
    text = f"{table(found)}\n\n{each(found)}"
    print(text)
    if args.markdown:
        args.markdown.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
