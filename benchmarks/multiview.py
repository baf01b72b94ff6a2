"""The accuracy tables of the several-camera tracker: joint errors on recordings with known truth, by row of settings, over some seeds.

    python benchmarks/multiview.py [RECORDING...] [--set measured] [--rows "default;exact masks"] [--seeds 5] [--workers 2] [--again]
    python benchmarks/multiview.py --set proving
    python benchmarks/multiview.py --tables

`--set measured`: walking, jogging and boxing of the shared recordings; `--rows` has rows that say where the error comes from;
`proving` is the proving ground (`synthetic.proving_rings`), made in build/rings where it is missing, a quarter of an hour on one core.
Each run (recording, row, seed) is what `shadowpuppet track` does, from film to joints.csv, and leaves its measures in
build/multiview/results: what is there is not run again, unless `--again`, so that parts can be run alone. The tables are made of all that
is there and written into docs/accuracy.md, each between its markers; `--tables` only does that.

RMSE, mm, over both shoulders, elbows, wrists, hips, knees and ankles; a frame that is lost counts 500 mm for each of them.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import time
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, field
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import smallest
from speed.chain import ONE_THREAD_EACH

from shadowpuppet.io.calibration.calibration_files import write_calibration
from shadowpuppet.io.motion.table import read_joints
from shadowpuppet.io.recording import Recording, read_recording
from shadowpuppet.motion.metrics import LIMB_JOINTS, joint_errors
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.pipeline.learn_prior import prior_from_files
from shadowpuppet.pipeline.options import make_options
from shadowpuppet.pipeline.track import track_recording
from shadowpuppet.synthetic import Spec, proving_rings, synthesize

ROOT = Path(__file__).resolve().parent.parent
BUILD, PAGE = ROOT / "build", ROOT / "docs" / "accuracy.md"
SHARED = Path(os.environ.get("SHADOWPUPPET_SHARED", ROOT.parent / "shared"))
MEASURED = ("walking", "jogging", "boxing")
PLACE = r"(<!-- table: {} -->\n).*?(<!-- end of table -->)"


@dataclass(frozen=True)
class Row:
    """A choice of settings, and of what is given."""

    options: Mapping[str, Any] = field(default_factory=dict)
    cameras: tuple[str, ...] = ()
    """Those that are used; all, if none is named."""
    training: bool = True
    truth: bool = False
    """Bone lengths, and postures that the first may be like, are the truth's; the motion prior is the training's, and girths are found."""


def _with(**values: Any) -> dict[str, Any]:
    return {"multiview": values}


PLAIN = {"modulated": False, "rho": "none", "iterations": 160, "balance": 0.0}
"""Forces as those of Ni 2008's ref. [11], the first baseline of Table II, as `papers/ni2008/tracks.py` reads it: without normals and
bounds, with more iterations for its one particle than forty have each."""
FOUR, THREE = ("cam1", "cam3", "cam5", "cam7"), ("cam1", "cam3", "cam5")
ROWS: dict[str, Row] = {
    "default": Row(),
    "default, no training motion": Row(training=False),
    "default, cameras 1, 3, 5, 7": Row(cameras=FOUR),
    "default, cameras 1, 3, 5, 7, no training motion": Row(cameras=FOUR, training=False),
    "default, cameras 1, 3, 5": Row(cameras=THREE),
    "default, cameras 1, 3, 5, no training motion": Row(cameras=THREE, training=False),
    "default, cameras 1, 3, 5, 7, exact masks": Row({"masks": True}, FOUR),
    "default, cameras 1, 3, 5, exact masks": Row({"masks": True}, THREE),
    "ni2008": Row({"preset": "ni2008"}),
    "ni2008, defensive proposals": Row({"preset": "ni2008", **_with(defensive=0.5)}),
    "ni2008, image_force": Row({"preset": "ni2008", **_with(method="image_force", velocity=0.0, forces=PLAIN)}),
    "ni2008, particle_filter": Row({"preset": "ni2008", **_with(method="particle_filter", particles=1000)}),
    "exact masks": Row({"masks": True}),
    "true bones and first pose": Row(truth=True),
    "exact masks, true bones and first pose": Row({"masks": True}, truth=True),
    "forces": Row(_with(refinement="forces")),
    "cylinders": Row(_with(body="cylinders")),
}
"""What can be run; which of them a set has is in `SETS`."""
SETS: dict[str, tuple[str, ...]] = {
    "measured": tuple(name for name in ROWS if name.startswith(("default", "ni2008"))),
    "proving": ("default", "default, no training motion", "exact masks", "ni2008"),
}


# Inputs ---------------------------------------------------------------------------------------------------------------


def made(folder: Path, names: Iterable[str] = (), specs: Iterable[Spec] | None = None) -> list[Path]:
    """Folders of the proving ground or of other `specs`, or of those recordings named; made where they are missing."""
    wanted, out = set(names), []
    for spec in proving_rings() if specs is None else specs:
        if wanted and spec.name not in wanted:
            continue
        out.append(folder / spec.name)
        if not (done := out[-1] / "made").exists():
            print(f"making {out[-1]}", flush=True)
            synthesize(spec, out[-1])
            done.touch()
    return out


def given(recording: Recording, row: Row, folder: Path) -> Path:
    """The recording as the row sees it: its own folder, or one of links in `folder` that lacks the other cameras, or the training."""
    if not row.cameras and row.training and not row.truth:
        return recording.path
    views = [view for view in recording.views if not row.cameras or view.camera.name in row.cameras]
    if row.cameras and len(views) < len(row.cameras):
        raise SystemExit(f"{recording.path}: it lacks some of the cameras {', '.join(row.cameras)}")
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    write_calibration(folder / "calibration.toml", [view.camera for view in views])
    for view in views:
        for path in (view.video, view.background, view.masks):
            if path is not None:
                (folder / path.parent.name).mkdir(exist_ok=True)
                (folder / path.parent.name / path.name).symlink_to(path.resolve())
    training = recording.truth if row.truth else recording.training if row.training else None
    for name, path in (("truth", recording.truth), ("training", training), ("recording", recording.path / "recording.toml")):
        if path is not None and path.exists():
            (folder / name).with_suffix(path.suffix).symlink_to(path.resolve())
    return folder


def prior_of(recording: Recording, options: Mapping[str, Any], file: Path) -> Path:
    """The motion prior that a run learns from the recording's training motion, as a file."""
    told = make_options(dict(options))
    assert recording.training is not None
    file.parent.mkdir(parents=True, exist_ok=True)
    prior_from_files([recording.training], file, told.training, seed=told.seed, body=told.multiview.body)
    return file


# Runs -----------------------------------------------------------------------------------------------------------------


def slug(name: str) -> str:
    """A row's name as a folder's."""
    return re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")


def run(path: Path, name: str, seed: int, folder: Path) -> dict[str, Any]:
    """Track a recording under the row `name` and measure it; measures stay in `folder`/results, the run in `folder`/runs."""
    row, recording = ROWS[name], read_recording(path)
    place = Path(path.name, slug(name), str(seed))
    options = dict(row.options) | {"seed": seed}
    if row.truth:
        options["prior"] = prior_of(recording, options, folder / "priors" / place.with_suffix(".npz"))
    source, target = given(recording, row, folder / "inputs" / place), folder / "runs" / place
    shutil.rmtree(target, ignore_errors=True)
    start = time.perf_counter()
    summary = track_recording(source, target, make_options(options))
    assert recording.truth is not None
    found = measures(summary.motion.table, read_joints(recording.truth))
    found |= {"recording": path.name, "row": name, "seed": seed, "wall_s": time.perf_counter() - start,
              "frames_per_s": summary.metrics["frames_per_s"], "status": summary.metrics["status"]}
    file = folder / "results" / place.with_suffix(".json")
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    return found


def measures(table: JointTable, truth: JointTable) -> dict[str, Any]:
    """Errors over the limb joints, mm, and how many frames of the truth are lost; `parts`: RMSE of both sides' joints."""
    found = joint_errors(table, truth, LIMB_JOINTS).summary()
    parts = {part: float(np.sqrt(np.mean([found["joints"][f"{side}_{part}"]["rmse_mm"] ** 2 for side in ("left", "right")])))
             for part in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")}
    return {"rmse": found["rmse_mm"], "mean": found["mean_mm"], "p95": found["p95_mm"], "max": found["max_mm"], "far": 100 * found["far"],
            "aligned": found["aligned_mean_mm"], "lost": found["lost"], "frames": found["frames"], "parts": parts}


def run_all(paths: Sequence[Path], rows: Sequence[str], seeds: int, folder: Path, workers: int, again: bool) -> None:
    """All runs that are not there yet; one that fails is told, and the others go on."""
    os.environ |= ONE_THREAD_EACH
    wanted = [(path, row, seed) for row in rows for path in paths for seed in range(seeds)
              if again or not (folder / "results" / path.name / slug(row) / f"{seed}.json").exists()]
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        begun = {pool.submit(run, *task, folder): task for task in wanted}
        for n, done in enumerate(as_completed(begun), 1):
            path, row, seed = begun[done]
            error = done.exception()
            told = f"{type(error).__name__}: {error}" if error else f"{done.result()['rmse']:.1f} mm, {done.result()['lost']} lost"
            print(f"{n}/{len(wanted)}  {path.name}, {row}, seed {seed}: {told}", flush=True)


# Tables ---------------------------------------------------------------------------------------------------------------

Results = dict[tuple[str, str], list[dict[str, Any]]]


def results(folder: Path) -> Results:
    """All measures that are there, by recording and row, in the order of their seeds."""
    found: Results = {}
    for file in sorted((folder / "results").rglob("*.json")):
        one = json.loads(file.read_text("utf-8"))
        found.setdefault((one["recording"], one["row"]), []).append(one)
    return found


def cell(runs: Sequence[Mapping[str, Any]]) -> str:
    """RMSE over seeds: mean, standard deviation, and frames lost in all of them."""
    if not runs:
        return ""
    errors, lost = [run["rmse"] for run in runs], sum(run["lost"] for run in runs)
    spread = f" ± {np.std(errors, ddof=1):.1f}" if len(runs) > 1 else ""
    return f"{np.mean(errors):.1f}{spread}" + (f" ({lost} lost)" if lost else "")


def by_recording(found: Results, names: Sequence[str], rows: Sequence[str]) -> str:
    """RMSE: a line for each row, a column for each recording."""
    lines = ["| | " + " | ".join(names) + " | seeds |", "|---|" + "---:|" * (len(names) + 1)]
    for row in rows:
        runs = [found.get((name, row), []) for name in names]
        if any(runs):
            lines.append(f"| {row} | " + " | ".join(map(cell, runs)) + f" | {max(map(len, runs))} |")
    return "\n".join(lines)


def by_joint(found: Results, names: Sequence[str], row: str = "default") -> str:
    """RMSE of each joint, mean over seeds: a line for each recording; and other measures."""
    parts = ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")
    others = {"mean": ".1f", "p95": ".1f", "max": ".0f", "far": ".2f", "aligned": ".1f", "frames_per_s": ".0f"}
    head = [*parts, "mean", "p95", "max", "far %", "aligned", "frames/s"]
    lines = ["| | " + " | ".join(head) + " |", "|---|" + "---:|" * len(head)]
    for name in names:
        if runs := found.get((name, row)):
            cells = [f"{np.mean([run['parts'][part] for run in runs]):.1f}" for part in parts]
            cells += [f"{np.mean([run[key] for run in runs]):{form}}" for key, form in others.items()]
            lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def proving(found: Results, rows: Sequence[str]) -> str:
    """RMSE on every recording of the proving ground: a column for each row; medians and means below."""
    names = [spec.name for spec in proving_rings()]
    rows = [row for row in rows if any((name, row) in found for name in names)]
    lines = ["| | " + " | ".join(rows) + " |", "|---|" + "---:|" * len(rows)]
    lines += [f"| {name} | " + " | ".join(cell(found.get((name, row), [])) for row in rows) + " |" for name in names]
    for what, of in (("median", np.median), ("mean", np.mean)):  # of those that a row was run on
        all_ = [[np.mean([run["rmse"] for run in found[name, row]]) for name in names if (name, row) in found] for row in rows]
        lines.append(f"| **{what}** | " + " | ".join(f"{of(values):.1f}" for values in all_) + " |")
    return "\n".join(lines)


def write_tables(folder: Path, page: Path) -> None:
    """Put the tables of all measures between their markers in the page; prints them, too."""
    found, text = results(folder), page.read_text("utf-8")
    tables = {"measured": by_recording(found, MEASURED, SETS["measured"]), "joints": by_joint(found, MEASURED),
              "proving": proving(found, SETS["proving"])}
    for name, table in tables.items():
        if not re.search(r"\d\.\d", table):  # nothing of it was run: what stands there stays
            continue
        print(f"\n{name}\n\n{table}")
        text, number = re.subn(PLACE.format(name), lambda match, table=table: f"{match[1]}{table}\n{match[2]}", text, flags=re.DOTALL)
        if number != 1:
            raise SystemExit(f"{page}: found no place for the table {name!r}")
    page.write_text(text, encoding="utf-8")


def _smallest(folder: Path) -> list[object]:
    return [smallest.make(folder / "walking", smallest.RING), "--rows", "default;exact masks, true bones and first pose", "--seeds", 1,
            "--workers", 1, "--folder", folder / "out", "--page", smallest.copy(PAGE, folder)]


def main() -> None:
    """Parse, run, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("recordings", nargs="*", help="folders, or names; those of the set without")
    parser.add_argument("--set", choices=[*SETS], default="measured")
    parser.add_argument("--rows", default="", help="names, with ; between them, in place of the set's: " + "; ".join(ROWS))
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--again", action="store_true", help="also what is there already")
    parser.add_argument("--folder", type=Path, default=BUILD / "multiview", help="where runs and measures are kept")
    parser.add_argument("--made", type=Path, default=BUILD / "rings", help="where the proving ground is, or is made")
    parser.add_argument("--page", type=Path, default=PAGE, help="where the tables are written")
    parser.add_argument("--tables", action="store_true", help="only write the tables of what is there")
    args = smallest.parse(parser, _smallest)
    rows = [row.strip() for row in args.rows.split(";") if row.strip()] or SETS[args.set]
    unknown = [row for row in rows if row not in ROWS]
    if unknown:
        parser.error(f"unknown row {unknown[0]!r}; there are: {'; '.join(ROWS)}")
    if not args.tables:
        if args.set == "proving":
            paths = made(args.made, args.recordings)
        else:
            paths = [path if (path := Path(name)).is_dir() else SHARED / "recordings" / name for name in args.recordings or MEASURED]
        run_all(paths, rows, args.seeds, args.folder, args.workers, args.again)
    write_tables(args.folder, args.page)


if __name__ == "__main__":
    main()
