"""The factors of doubt (`tracking.doubt`), chosen on made recordings, clean and spoiled, and how well they hold on recordings left out.

    python benchmarks/calibrate_doubt.py [--kind monocular,multiview] [--write] [--again] [--workers 2]

Every recording of the proving grounds (`synthetic.proving_ground`, `proving_rings`; made in build where they are missing) is tracked clean
and with each fault of `FAULTS` in its silhouettes; components of doubt and errors are kept in build/doubt. The factors of a group of joints
along an axis minimise the mean interval score of 90 % intervals (Gneiting and Raftery 2007), over all runs. The table is of recordings left
out: a third at a time is tested with the factors of the others. `--write` writes src/shadowpuppet/tracking/doubt/factors.toml.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import smallest
from cases import Case
from proving_ground import HERE as GROUND
from proving_ground import made as made_ground
from spoiled import SPOILS

from shadowpuppet.camera.mask import Mask
from shadowpuppet.geometry import Array
from shadowpuppet.io.motion.table import read_joints
from shadowpuppet.motion.synchronization import at_times
from shadowpuppet.motion.motion import BLANK, JointTable
from shadowpuppet.pipeline.options import make_options
from shadowpuppet.pipeline.person_rig import fit_multiview
from shadowpuppet.pipeline.rig import open_rig, synchronized_frames
from shadowpuppet.pipeline.survey import survey_rig
from shadowpuppet.synthetic import proving_rings, synthesize
from shadowpuppet.tracking.doubt.limbs import GROUPS, group_of
from shadowpuppet.tracking.doubt.monocular import MonocularEvidence
from shadowpuppet.tracking.doubt.multiview import MultiviewEvidence
from shadowpuppet.tracking.monocular.tracker import MonocularTracker

RINGS, RING_SECONDS = GROUND.parent / "rings_short", 3.0
BUILD = GROUND.parent / "doubt"
TABLE = GROUND.parent.parent / "src" / "shadowpuppet" / "tracking" / "doubt" / "factors.toml"
WIDTH = 1.6448536269514722
"""Half width of a 90 % interval, in standard deviations."""
SECONDS = 2.0
"""Length of a fault with a beginning and an end."""
Fault = Callable[[np.random.Generator, list[Mask], float], list[Mask]]
"""Masks of a film, one (H, W) a frame, and its rate, to spoiled ones."""


def _all(name: str) -> Fault:
    spoil = SPOILS[name]

    def spoiled(rng: np.random.Generator, masks: list[Mask], rate: float) -> list[Mask]:
        size = float(np.sqrt(np.median([mask.sum() for mask in masks])))
        return [spoil(rng, mask, size) for mask in masks]

    return spoiled


def _during(change: Callable[[Mask, list[Mask], float], Mask]) -> Fault:
    """A fault from the film's third on; `change`: of a mask, all masks and the share of the fault's time that has passed."""

    def spoiled(rng: np.random.Generator, masks: list[Mask], rate: float) -> list[Mask]:
        first, count = len(masks) // 3, max(1, min(round(SECONDS * rate), len(masks) // 3))
        return [change(mask, masks, (n - first) / count) if first <= n < first + count else mask for n, mask in enumerate(masks)]

    return spoiled


def _second(mask: Mask, masks: list[Mask], passed: float) -> Mask:
    """A second person, the first's silhouette at another time, passes from right to left."""
    other, width = masks[round(passed * (len(masks) - 1)) // 2], mask.shape[1]
    shift = round(width * (0.9 - 1.7 * passed))
    moved = np.zeros_like(other)
    if shift >= 0:
        moved[:, shift:] = other[:, : width - shift]
    else:
        moved[:, :shift] = other[:, -shift:]
    return mask | moved


def _obstacle(mask: Mask, masks: list[Mask], passed: float) -> Mask:
    """The left 30 % of the person are hidden."""
    out, columns = mask.copy(), np.flatnonzero(mask.any(0))
    if len(columns):
        out[:, : int(columns[0] + 0.3 * (columns[-1] - columns[0]))] = False
    return out


def _thing(mask: Mask, masks: list[Mask], passed: float) -> Mask:
    """Something beside the person belongs to the silhouette."""
    out, (height, width) = mask.copy(), mask.shape
    out[int(0.3 * height) : int(0.8 * height), int(0.6 * width) : int(0.75 * width)] = True
    return out


FAULTS: dict[str, Fault] = {
    "clean": lambda rng, masks, rate: masks,
    **{name: _all(name) for name in ("grown", "eroded", "holes", "flicker")},
    "frozen": _during(lambda mask, masks, passed: masks[len(masks) // 3]),
    "second person": _during(_second),
    "obstacle": _during(_obstacle),
    "thing": _during(_thing),
}


@dataclass(frozen=True, eq=False)
class Tracked:
    """A run's components of doubt and errors, along the evidence's axes."""

    recording: str
    fault: str
    joints: tuple[str, ...]
    components: dict[str, Array]
    """Of shape (T, L, 3), metres."""
    errors: Array
    """Truth less estimate (T, L, 3), metres; not a number where there is none."""


def track_monocular(path: Path) -> Iterator[Tracked]:
    """A recording of one camera with every fault."""
    case, options = Case.read(path), make_options({})
    picture = case.person(options, np.random.default_rng(0)).picture(case.camera, options.tracker.body)
    names, rate = picture.body.landmark_names, 1 / float(np.median(np.diff(case.times)))
    turn = case.camera.T_camera_world[:3, :3]
    for n, (fault, spoil) in enumerate(FAULTS.items()):
        masks, rng = spoil(np.random.default_rng(n), case.masks, rate), np.random.default_rng(1)
        tracker = MonocularTracker(picture, options.tracker)
        evidence, state, before, rows, poses = MonocularEvidence(tracker), None, None, [], []
        for seconds, mask in zip(case.times.tolist(), masks):
            state = tracker.start(rng, mask) if state is None else tracker.step(rng, state, mask)
            row, before = evidence.components(state, mask, seconds, before)
            rows.append(row)
            poses.append(np.full_like(state.pose, np.nan) if state.status in BLANK else state.pose)
        errors = _errors(case.truth, names, picture.points_world(np.array(poses))) @ turn.T
        yield Tracked(path.name, fault, names, {name: np.array([row[name] for row in rows]) for name in rows[0]}, errors)


ONE_CAMERA = ("frozen", "obstacle", "thing", "late")
"""Faults that, of several cameras, only the first has."""
LATE = 5
"""Frames by which the camera is late."""


def track_multiview(path: Path) -> Iterator[Tracked]:
    """A recording of several cameras with every fault."""
    options = make_options({"overlay": False})
    survey = survey_rig(open_rig(path, options), options)
    subject = fit_multiview(np.random.default_rng(0), survey, options)
    truth, rate = read_joints(path / "truth.csv"), survey.rig.rate
    frames = [(each.time, each.masks) for each in synchronized_frames(survey.rig, survey.silhouettes)]
    films = [[masks[n] if masks[n] is not None else np.zeros(size[::-1], bool) for _, masks in frames]
             for n, size in enumerate(camera.size for camera in subject.hull.cameras)]
    times, names = [time for time, _ in frames], subject.body.landmark_names
    late: Fault = lambda rng, masks, rate: [masks[max(n - LATE, 0)] for n in range(len(masks))]  # noqa: E731
    for n, (fault, spoil) in enumerate((FAULTS | {"late": late}).items()):
        spoiled = [spoil(np.random.default_rng([n, m]), film, rate) if m == 0 or fault not in ONE_CAMERA else film for m, film in enumerate(films)]
        rng, evidence, state, before, rows, poses = np.random.default_rng(1), MultiviewEvidence(subject.tracker), None, None, [], []
        for seconds, masks in zip(times, zip(*spoiled)):
            observation = subject.observe(masks)
            state = subject.next_state(rng, state, observation)
            if state is None:
                poses.append(np.full(len(subject.body.skeleton.dofs), np.nan))
                rows.append(None)
                continue
            row, before = evidence.components(state, observation.points, masks, seconds, before)
            rows.append(row)
            poses.append(np.full_like(state.pose, np.nan) if state.status in BLANK else state.pose)
        errors = _errors(at_times(truth, np.array(times)), names, subject.body.points(np.array(poses)))
        some = next(row for row in rows if row is not None)
        components = {name: np.array([np.zeros((len(names), 3)) if row is None else row[name] for row in rows]) for name in some}
        yield Tracked(path.name, fault, names, components, errors)


def made_rings() -> list[Path]:
    """The proving ground of several cameras, its first `RING_SECONDS`; made where they are missing."""
    out = []
    for n, spec in enumerate(proving_rings(), 1):
        out.append(RINGS / spec.name)
        if not (done := out[-1] / "made").exists():
            synthesize(replace(spec, frames=round(RING_SECONDS * spec.rate)), out[-1], np.random.default_rng([2, n]))
            done.touch()
    return out


def _errors(truth: JointTable, names: Sequence[str], points: Array) -> Array:
    """Truth less estimates (T, L, 3), which start with the truth's first frame."""
    known = [truth.positions[: len(points), truth.names.index(name)] if name in truth.names else np.full((len(points), 3), np.nan)
             for name in names]
    return np.stack(known, 1) - points


def collect(kind: str, path: Path, again: bool) -> list[Path]:
    """Files with the runs of a recording, one a fault."""
    folder = BUILD / kind / path.name
    if again or not (folder / "done").exists():
        folder.mkdir(parents=True, exist_ok=True)
        for run in TRACK[kind](path):
            np.savez_compressed(folder / f"{run.fault.replace(' ', '_')}.npz", joints=run.joints, errors=run.errors, names=list(run.components),
                                components=np.stack(list(run.components.values()), 3).astype(np.float32))
        (folder / "done").touch()
    return sorted(folder.glob("*.npz"))


TRACK = {"monocular": track_monocular, "multiview": track_multiview}
MADE: dict[str, Callable[[], list[Path]]] = {"monocular": lambda: made_ground(GROUND), "multiview": made_rings}


@dataclass(frozen=True, eq=False)
class Errors:
    """Errors of one joint along one axis in one run."""

    recording: str
    fault: str
    joint: str
    axis: int
    lengths: Array
    """Components (n, F), metres."""
    errors: Array
    """Of shape (n,), metres."""


def read_errors(files: Iterable[Path]) -> tuple[list[Errors], list[str]]:
    """Errors of all runs, and the components' names."""
    found, names = [], []
    for file in files:
        data = np.load(file, allow_pickle=False)
        names = data["names"].tolist()
        for j, joint in enumerate(data["joints"].tolist()):
            for axis in range(3):
                errors = data["errors"][:, j, axis]
                known = np.isfinite(errors)
                if known.any():
                    found.append(Errors(file.parent.name, file.stem, joint, axis, data["components"][known, j, axis].astype(float), errors[known]))
    return found, names


def fit(lengths: Array, errors: Array) -> Array:
    """Factors (F,) of components (n, F) for errors (n,): those of least mean interval score."""
    from scipy.optimize import minimize

    squares, size = lengths**2, np.abs(errors)

    def score(logs: Array) -> tuple[float, Array]:
        variances = np.exp(logs)
        sd = np.sqrt(squares @ variances) + 1e-6
        beyond = np.maximum(size - WIDTH * sd, 0)
        slope = (2 * WIDTH - 20 * WIDTH * (beyond > 0)) / (2 * sd)
        return float((2 * WIDTH * sd + 20 * beyond).mean()) * SCALE, (slope[:, None] * squares * variances).mean(0) * SCALE

    start = np.full(lengths.shape[1], np.log(0.05))
    return np.exp(minimize(score, start, jac=True, method="L-BFGS-B", bounds=[(-9, 9)] * len(start)).x / 2)


SCALE = 100.0
"""Factor on scores (m), for the optimiser's tolerances."""
NEGLIGIBLE = 0.02
"""Factor below which a component is left out."""


def interval_score(sd: Array, errors: Array) -> float:
    """Mean interval score (m) of +-1.645 sd (n,) for errors (n,): width, and twenty times what lies beyond."""
    return float((2 * WIDTH * sd + 20 * np.maximum(np.abs(errors) - WIDTH * sd, 0)).mean())


Factors = dict[str, dict[int, Array]]
"""Factors (F,) by group and axis."""


def fit_all(runs: Sequence[Errors]) -> Factors:
    """Factors of all groups that occur."""
    out: Factors = {}
    for group in GROUPS:
        for axis in range(3):
            own = [run for run in runs if group_of(run.joint) == group and run.axis == axis]
            if own:
                out.setdefault(group, {})[axis] = fit(np.concatenate([run.lengths for run in own]), np.concatenate([run.errors for run in own]))
    return out


def deviations(factors: Factors, run: Errors) -> Array:
    """Standard deviations (n,), metres."""
    return np.sqrt(run.lengths**2 @ factors[group_of(run.joint)][run.axis] ** 2)


def left_out(runs: Sequence[Errors], parts: int = 3) -> list[tuple[Errors, Array, float]]:
    """Runs with deviations (n,) by the factors of other recordings, and the best constant one (m) for the joint's axis."""
    names, out = sorted({run.recording for run in runs}), []
    for part in range(parts):
        tested = set(names[part::parts])
        others = [run for run in runs if run.recording not in tested] or list(runs)
        factors = fit_all(others)
        constant = {(joint, axis): float(np.quantile(np.abs(np.concatenate([run.errors for run in others if (run.joint, run.axis) == (joint, axis)])), 0.9)) / WIDTH
                    for joint, axis in {(run.joint, run.axis) for run in others}}
        out += [(run, deviations(factors, run), constant[run.joint, run.axis]) for run in runs if run.recording in tested]
    return out


def table(tested: Sequence[tuple[Errors, Array, float]]) -> str:
    """Coverage, rank correlation and score by group of joints, as Markdown."""
    lines = ["| joints | covered by 90 % | sd, mm | error, mm | rank correlation | score / best constant |", "|---|---:|---:|---:|---:|---:|"]
    for group in [*GROUPS, "all"]:
        own = [each for each in tested if group in ("all", group_of(each[0].joint))]
        if not own:
            continue
        sd, errors = np.concatenate([each[1] for each in own]), np.concatenate([each[0].errors for each in own])
        constant = np.concatenate([np.full(len(each[1]), each[2]) for each in own])
        covered, ratio = float((np.abs(errors) <= WIDTH * sd).mean()), interval_score(sd, errors) / interval_score(constant, errors)
        lines.append(f"| {group} | {100 * covered:.1f} | {1000 * sd.mean():.0f} | {1000 * np.abs(errors).mean():.0f} | "
                     f"{_rank_correlation(sd, np.abs(errors)):.2f} | {ratio:.2f} |")
    return "\n".join(lines)


def _rank_correlation(one: Array, other: Array) -> float:
    from scipy.stats import spearmanr

    return float(spearmanr(one, other).statistic)  # pyright: ignore[reportAttributeAccessIssue]


def factors_text(kind: str, names: Sequence[str], factors: Factors) -> str:
    """The table of a kind in factors.toml."""
    lines = [f"[{kind}]", "components = [" + ", ".join(f'"{name}"' for name in names) + "]"]
    for group, axes in factors.items():
        rows = {axis: ", ".join(f"{value:.3f}" if value >= NEGLIGIBLE else "0" for value in axes[n]) for n, axis in enumerate("xyz")}
        lines.append(f"{group} = {{ " + ", ".join(f"{axis} = [{row}]" for axis, row in rows.items()) + " }")
    return "\n".join(lines) + "\n"


HEAD = "# Factors of the components of doubt, by group of joints and axis. Written by benchmarks/calibrate_doubt.py; do not edit.\n"


def _smallest(folder: Path) -> list[object]:
    return ["--recordings", smallest.make(folder / "tiny")]


def main() -> None:
    """Parse, run, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kind", default="monocular,multiview", help="trackers, separated by commas")
    parser.add_argument("--recordings", type=Path, nargs="*", help="folders; the proving grounds without")
    parser.add_argument("--write", action="store_true", help="write the factors into the package")
    parser.add_argument("--again", action="store_true", help="track again what has been tracked")
    parser.add_argument("--workers", type=int, default=2)
    args, texts = smallest.parse(parser, _smallest), []
    for kind in args.kind.split(","):
        paths = args.recordings or MADE[kind]()
        with ProcessPoolExecutor(args.workers, get_context("spawn")) as pool:
            files = [file for found in pool.map(collect, [kind] * len(paths), paths, [args.again] * len(paths)) for file in found]
        runs, names = read_errors(files)
        for title, own in (("clean", [run for run in runs if run.fault == "clean"]), ("clean and spoiled", runs)):
            print(f"\n{kind}, {title}\n\n{table(left_out(own))}", flush=True)
        texts.append(factors_text(kind, names, fit_all(runs)))
        print("\n" + texts[-1])
    if args.write:
        TABLE.write_text(HEAD + "\n" + "\n".join(texts), encoding="utf-8")


if __name__ == "__main__":
    main()
