"""MediaPipe Pose beside this program on the same films, for the tables of docs/comparison.md.

    python benchmarks/peers/compare.py [--only "upper_body;crf 40"] [--again] [--tables]

Shared recordings, made ones of several cameras and made ones with faults (both made in build/ where they are missing). MediaPipe runs in
the environment of `shadowpuppet masks --with mediapipe`, which is made where it is missing; its landmarks of several cameras are
triangulated and smoothed (`triangulation.py`). This program runs with its defaults and the seed 0: as the recording lies, once more
without reference pictures and training motion, and so with MediaPipe's keypoints beside the silhouettes and, before several cameras,
alone. Landmarks and measures are kept in build/peers and not made again, unless `--again`; the tables show all that is there
(`--tables`: only print them). An hour on one core.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))  # the other benchmarks

import fault_rows  # noqa: E402
import faults  # noqa: E402
import multiview  # noqa: E402
import smallest  # noqa: E402
from keypoints import found_by  # noqa: E402
from speed.chain import ONE_THREAD_EACH  # noqa: E402
from triangulation import LANDMARKS, SEEN, one_camera, several_cameras  # noqa: E402

from shadowpuppet.external.environment import command_for, variables  # noqa: E402
from shadowpuppet.external.script import read_script  # noqa: E402
from shadowpuppet.geometry import Array, align  # noqa: E402
from shadowpuppet.io.files.npz import read_arrays  # noqa: E402
from shadowpuppet.io.motion.motion_files import read_truth  # noqa: E402
from shadowpuppet.io.recording import read_recording  # noqa: E402
from shadowpuppet.motion.limbs import limb_of  # noqa: E402
from shadowpuppet.motion.metrics import FAR_ERROR, LIMB_JOINTS, LOST_ERROR, joint_errors  # noqa: E402
from shadowpuppet.motion.motion import JointTable  # noqa: E402
from shadowpuppet.pipeline.options import make_options  # noqa: E402
from shadowpuppet.pipeline.track import track_recording  # noqa: E402

SCRIPT, PAGE = HERE / "mediapipe_landmarks.py", HERE.parents[1] / "docs" / "comparison.md"
ARMS = LIMB_JOINTS[:6]
"""Joints compared with one camera: shoulders, elbows, wrists."""
RINGS = ("rings_walk", "rings_box", "rings_squat", "rings_reach", "rings_turn")
ONE_SHARED, SEVERAL_SHARED, RING, ONE_SPOILED, FOUR_SPOILED = "one camera", "several cameras", "made rings", "one spoiled", "four spoiled"
SPOILED = {
    ONE_SPOILED: ("clean", "gain 1.3 from the middle on", "gain from 0.7 slowly to 1.3", "a patch of sun, 1.5, wanders", "noise of 10",
                  "noise of 15", "crf 28", "crf 40", "blur over 5 frames", "nudged by 20 pixels", "a pillar comes and stays",
                  "a second person 1 m aside"),
    FOUR_SPOILED: ("clean", "all: gain 1.3 from the middle on", "all: crf 32", "one: crf 40", "all: noise of 15",
                   "all: blur over 2 frames", "one black for good", "a pillar comes and stays", "a second person 1 m aside"),
}
"""Faults of `fault_rows`."""


class Case(NamedTuple):
    """A recording, and where it belongs."""

    table: str
    row: str
    path: Path
    begin: float = 0.0
    """Second from which frames count: a fault's."""
    bare: bool = False
    """Whether it is tracked once more without reference pictures and training motion."""
    make: Callable[[], object] | None = None
    """Makes it where it is missing."""
    known: bool = False
    """Whether it is tracked with keypoints, too."""

    @property
    def place(self) -> Path:
        """Of its files in a folder."""
        return Path(multiview.slug(self.table), self.path.name)


def cases(shared: Path, rings: Path, spoiled: Path) -> Iterator[Case]:
    """All recordings, in the order of the tables."""
    for name in ("upper_body", "reaching"):
        yield Case(ONE_SHARED, name, shared / "recordings" / name, bare=True, known=True)
    for name in multiview.MEASURED:
        yield Case(SEVERAL_SHARED, name, shared / "recordings" / name, bare=True, known=True)
    yield Case(SEVERAL_SHARED, "balancing", shared / "real" / "balancing", known=True)
    for name in RINGS:
        yield Case(RING, name, rings / name, bare=True, make=partial(multiview.made, rings, [name]), known=True)
    for table, films, rows in ((ONE_SPOILED, fault_rows.films_of_one(), fault_rows.ONE),
                               (FOUR_SPOILED, fault_rows.films_of_several(), fault_rows.SEVERAL)):
        for row in rows:
            for film in films if row.name in SPOILED[table] else ():
                make = partial(faults.made, film, row, spoiled, False)
                yield Case(table, row.name, faults.place_of(film, row, spoiled), row.begin, make=make)


# Runs -----------------------------------------------------------------------------------------------------------------


def landmarks(case: Case, folder: Path, again: bool) -> dict[str, Array]:
    """What `mediapipe_landmarks.py` finds in the films, by `<camera>.<field>`; from its file where that is there."""
    file = folder / "landmarks" / case.place.with_suffix(".npz")
    if again or not file.exists():
        file.parent.mkdir(parents=True, exist_ok=True)
        films = [f"{view.camera.name}={Path(str(view.video)).resolve()}" for view in read_recording(case.path).views]
        command = command_for(read_script(SCRIPT, SCRIPT.name), partial(print, flush=True))
        subprocess.run([*command, str(file), *films], env=variables(), check=True, stderr=subprocess.DEVNULL)
    return read_arrays(file)


def theirs(case: Case, found: dict[str, Array]) -> tuple[JointTable, Array, float]:
    """MediaPipe's joints, which of them it vouches for (T, J), and processor time, s. Several cameras' joints are vouched for if they are
    there: two cameras saw them."""
    cameras = [view.camera for view in read_recording(case.path).views]
    count = min(len(found[f"{camera.name}.pixels"]) for camera in cameras)
    pixels, visibility = (np.stack([found[f"{camera.name}.{key}"][:count] for camera in cameras]) for key in ("pixels", "visibility"))
    times = np.arange(count) / float(found[f"{cameras[0].name}.rate"])
    spent = sum(float(found[f"{camera.name}.seconds"][0]) for camera in cameras)
    if len(cameras) == 1:
        table = one_camera(cameras[0], times, found[f"{cameras[0].name}.world"])
        return table, visibility[0][:, 11:17] >= SEEN, spent
    start = time.process_time()
    table = several_cameras(cameras, times, pixels, visibility)
    return table, np.isfinite(table.positions[..., 0]), spent + time.process_time() - start


def ours(case: Case, folder: Path, bare: bool, evidence: str = "silhouettes") -> tuple[JointTable, Array, float]:
    """The joints of a run, which of them it vouches for (T, J), and processor time, s, from films and keypoints to joints; of several
    people those of the one who is nearest to the truth."""
    run = folder / "runs" / case.place
    shutil.rmtree(run, ignore_errors=True)
    recording = read_recording(case.path)
    source = multiview.given(recording, multiview.Row(training=False), folder / "inputs" / case.place) if bare else case.path
    if evidence != "silhouettes":
        source = found_by("mediapipe", source, folder / "known" / case.place)
    start = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        summary = track_recording(source, run, make_options({"seed": 0, "evidence": evidence}))
    spent = time.process_time() - start
    motion, _ = faults.nearest_person(run, summary, read_truth(case.path / "truth.csv"))
    names = ARMS if len(recording.views) == 1 else LIMB_JOINTS
    vouched = motion.limb_status[:, [motion.limbs.index(limb_of(name)) for name in names]] == "tracked"
    return motion.table.select(names), vouched, spent


def measures(found: tuple[JointTable, Array, float], truth: JointTable, names: Sequence[str]) -> dict[str, float]:
    """Errors in millimetres, and shares of the joints in per cent: `far` off, and `silent`, those of them that are vouched for. With one
    camera (`ARMS`) each frame's mean offset is removed from all of them; `turned` is the mean error after the turn and scale of the whole
    film that fit the truth best. A missing joint counts 500 mm, and is neither far nor silent."""
    table, vouched, seconds = found
    errors = joint_errors(table, truth, names)
    distance = (errors.aligned if names == ARMS else errors.distance)
    far = (distance > FAR_ERROR) & errors.known & ~errors.lost
    index = np.abs(table.times[None] - truth.times[:, None]).argmin(1)
    of = 100 / errors.known.sum()
    values = distance[errors.known] * 1000
    out = {"mean": values.mean(), "rmse": np.sqrt((values**2).mean()), "far": of * far.sum(), "silent": of * (far & vouched[index]).sum(),
           "lost": of * errors.lost.sum(), "ms": 1000 * seconds / len(table.times)}
    return {key: float(value) for key, value in (out | {"turned": _turned(table.select(names).positions[index], truth, names)}).items()}


def _turned(found: Array, truth: JointTable, names: Sequence[str]) -> float:
    """Mean error, mm, of joints (T, J, 3) after removing each frame's mean offset, and then one turn and one scale of the whole film."""
    there = truth.select(names).positions
    whole = np.isfinite(found).all((1, 2)) & np.isfinite(there).all((1, 2))
    if not whole.any():
        return 1000 * LOST_ERROR
    own, true = (each[whole] - each[whole].mean(1, keepdims=True) for each in (found, there))
    moved = align(own.reshape(-1, 3), true.reshape(-1, 3), scaled=True).apply(own.reshape(-1, 3))
    error = np.linalg.norm(moved - true.reshape(-1, 3), axis=1).mean()
    return 1000 * float(whole.mean() * error + (1 - whole.mean()) * LOST_ERROR)


def programs(case: Case, folder: Path, again: bool) -> dict[str, Callable[[], tuple[JointTable, Array, float]]]:
    """What is compared on a recording, by its name in the measures: functions that make it, as `theirs` and `ours` return it."""
    made = {"mediapipe": lambda: theirs(case, landmarks(case, folder, again)), "ours": lambda: ours(case, folder, False)}
    if case.bare:
        made["bare"] = lambda: ours(case, folder, True)
    if case.known:
        made["both"] = lambda: ours(case, folder, case.bare, "silhouettes,keypoints")
        if case.table != ONE_SHARED:
            made["keypoints"] = lambda: ours(case, folder, case.bare, "keypoints")
    return made


def compared(case: Case, folder: Path, again: bool) -> None:
    """Measures of the programs on a recording, as a JSON file; those that it has already are kept."""
    file = folder / "results" / case.place.with_suffix(".json")
    out = json.loads(file.read_text("utf-8")) if file.exists() and not again else {"table": case.table, "row": case.row}
    missing = {name: make for name, make in programs(case, folder, again).items() if name not in out}
    if not missing:
        return
    if case.make:
        case.make()
    counted = read_truth(case.path / "truth.csv").between(case.begin, np.inf)
    names = ARMS if len(read_recording(case.path).views) == 1 else LIMB_JOINTS
    for name, make in missing.items():
        out[name] = measures(make(), counted, names)
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(json.dumps(out, indent=1) + "\n", encoding="utf-8")
    print(f"{case.table}, {case.path.name}: " + ", ".join(f"{name} {out[name]['mean']:.0f} mm" for name in missing), flush=True)


def warm_up() -> None:
    """Load the compiled kernels, so that no run is charged with it."""
    import tempfile

    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for name, spec in (("one", smallest.ONE), ("ring", smallest.RING)):
            track_recording(smallest.make(Path(folder, name), spec), Path(folder, name, "run"), make_options({}))


# Tables ---------------------------------------------------------------------------------------------------------------

Found = list[dict[str, Any]]


def results(wanted: Sequence[Case], folder: Path) -> Found:
    """All measures that are there, in the order of the cases."""
    files = [folder / "results" / case.place.with_suffix(".json") for case in wanted]
    return [json.loads(file.read_text("utf-8")) for file in files if file.exists()]


def table(head: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    """As Markdown, columns but the first to the right."""
    rows = [head, ["---", *["---:"] * (len(head) - 1)], *lines]
    return "\n".join("| " + " | ".join(row) + " |" for row in rows)


def by_recording(found: Found, columns: Sequence[tuple[str, str, str]]) -> str:
    """A line for each recording. columns: title, program, measure (millimetres)."""
    lines = [[one["row"], *[f"{one[program][key]:.0f}" if program in one else "" for _, program, key in columns]] for one in found]
    return table(["mm", *[title for title, _, _ in columns]], lines)


def by_fault(found: Found, key: str) -> str:
    """A line for each fault, the mean of its films; then the mean of all, and the difference with its standard error in pairs of films."""
    rows = dict.fromkeys(one["row"] for one in found)
    programs, lines = ("mediapipe", "ours"), []
    for row in [*rows, "**all**"]:
        these = [one for one in found if row in (one["row"], "**all**")]
        cells = [np.mean([one[program][what] for one in these]) for program in programs for what in (key, "far", "silent")]
        lines.append([row, *[f"{cell:.{digits}f}" for cell, digits in zip(cells, (0, 1, 1) * 2)]])
    text = table(["", "MediaPipe, mm", "far %", "silent %", "shadowpuppet, mm", "far %", "silent %"], lines)
    apart = np.array([one["ours"][key] - one["mediapipe"][key] for one in found])
    if len(apart) < 2:
        return text
    error = apart.std(ddof=1) / np.sqrt(len(apart))
    return (f"{text}\n\nshadowpuppet less MediaPipe: {np.mean(apart):+.0f} mm, standard error {error:.0f} mm over {len(apart)} films; "
            f"shadowpuppet is nearer in {(apart < 0).sum()} of them.")


def by_time(found: Found) -> str:
    """Processor time a frame, and how many times as long MediaPipe takes."""
    lines = []
    for one in found:
        mine, other = one["ours"]["ms"], one["mediapipe"]["ms"]
        lines.append([one["row"], f"{other:.1f}", f"{mine:.1f}", f"{other / mine:.1f}"])
    return table(["processor time, ms a frame", "MediaPipe", "shadowpuppet", "ratio"], lines)


def tables(found: Found) -> dict[str, str]:
    """Every table of which there are measures, by its name on the page."""
    parts = {name: [one for one in found if one["table"] == name] for name in (ONE_SHARED, SEVERAL_SHARED, RING, ONE_SPOILED, FOUR_SPOILED)}
    one = (("MediaPipe", "mediapipe", "mean"), ("turned and scaled to fit", "mediapipe", "turned"), ("shadowpuppet", "ours", "mean"),
           ("turned and scaled to fit", "ours", "turned"), ("without pictures", "bare", "mean"), ("so, with keypoints", "both", "mean"))
    several = (("MediaPipe", "mediapipe", "rmse"), ("shadowpuppet", "ours", "rmse"), ("without training", "bare", "rmse"),
               ("so, with keypoints", "both", "rmse"), ("keypoints alone", "keypoints", "rmse"))
    made = {ONE_SHARED: by_recording(parts[ONE_SHARED], one), SEVERAL_SHARED: by_recording(parts[SEVERAL_SHARED], several),
            RING: by_recording(parts[RING], several), ONE_SPOILED: by_fault(parts[ONE_SPOILED], "mean") if parts[ONE_SPOILED] else "",
            FOUR_SPOILED: by_fault(parts[FOUR_SPOILED], "rmse") if parts[FOUR_SPOILED] else "",
            "time": by_time(parts[ONE_SHARED] + parts[SEVERAL_SHARED])}
    return {name: text for name, text in made.items() if parts.get(name, parts[ONE_SHARED] + parts[SEVERAL_SHARED])}


# Command line ---------------------------------------------------------------------------------------------------------


def _smallest(folder: Path) -> list[object]:
    """Two tiny recordings with landmarks that are the truth and some noise: MediaPipe is not installed for this."""
    rng, out, chosen = np.random.default_rng(1), folder / "out", list(LANDMARKS.values())
    ring = replace(smallest.RING, rate=6)
    for table_, name, spec in ((ONE_SHARED, "upper_body", smallest.ONE), (SEVERAL_SHARED, "walking", ring)):
        path = smallest.make(folder / "recordings" / name, spec)
        truth, found = read_truth(path / "truth.csv").select(LIMB_JOINTS), dict[str, Array]()
        for camera in (view.camera for view in read_recording(path).views):
            pixels, world = (np.zeros((len(truth.times), 33, size)) for size in (2, 3))
            pixels[:, chosen] = camera.project(truth.positions) + rng.normal(0, 1, (len(truth.times), 12, 2))
            world[:, chosen] = truth.positions @ camera.T_camera_world[:3, :3].T + rng.normal(0, 0.02, truth.positions.shape)
            values = {"pixels": pixels, "world": world, "visibility": np.ones(pixels.shape[:2]), "seconds": np.ones(2), "rate": spec.rate}
            found |= {f"{camera.name}.{key}": np.asarray(value) for key, value in values.items()}
        file = out / "landmarks" / Case(table_, name, path).place.with_suffix(".npz")
        file.parent.mkdir(parents=True)
        np.savez(file, **found)  # pyright: ignore[reportArgumentType]
    return ["--only", "upper_body;walking", "--quick", "--shared", folder, "--folder", out, "--page", smallest.copy(PAGE, folder)]


def main() -> None:
    """Parse, run, write."""
    build = multiview.BUILD
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default="", help="names of recordings, tables or faults, with ; between them; all without")
    parser.add_argument("--again", action="store_true", help="also what is there already")
    parser.add_argument("--tables", action="store_true", help="only write the tables of what is there")
    parser.add_argument("--quick", action="store_true", help="one run each, kernels not loaded before: first times are too long")
    parser.add_argument("--shared", type=Path, default=multiview.SHARED, help="the shared recordings")
    parser.add_argument("--rings", type=Path, default=build / "rings", help="where the made rings are, or are made")
    parser.add_argument("--faults", type=Path, default=build / "faults", help="where the films with faults are, or are made")
    parser.add_argument("--folder", type=Path, default=build / "peers", help="where landmarks, runs and measures are kept")
    parser.add_argument("--page", type=Path, default=PAGE, help="where the tables are written")
    args = smallest.parse(parser, _smallest)
    os.environ |= ONE_THREAD_EACH
    wanted = list(cases(args.shared, args.rings, args.faults))
    names = {name.strip() for name in args.only.split(";") if name.strip()}
    chosen = [case for case in wanted if not names or names & {case.table, case.row, case.path.name}]
    chosen = [case._replace(bare=case.bare and not args.quick, known=case.known and not args.quick) for case in chosen]
    failed = 0
    if not args.tables:
        with ProcessPoolExecutor(1, get_context("spawn"), initializer=None if args.quick else warm_up) as pool:
            for case in chosen:
                try:
                    pool.submit(compared, case, args.folder, args.again).result()
                except Exception as error:  # one that fails is told, and the others go on
                    failed += 1
                    print(f"{case.table}, {case.path.name}: {type(error).__name__}: {error}", flush=True)
    for name, text in tables(results(wanted, args.folder)).items():
        print(f"\n{name}\n\n{text}")
        faults.into_page(args.page, name, text)
    if failed:
        sys.exit(f"{failed} of {len(chosen)} recordings failed")


if __name__ == "__main__":
    main()
