"""The factors of doubt (`tracking.doubt`), chosen on made recordings, clean and spoiled, and how well they hold on recordings left out.

    python benchmarks/calibrate_doubt.py [--kind KIND,...] [--write] [--markdown docs/doubt.md] [--test RECORDING ...]

Every recording of the proving grounds (`synthetic.proving_ground`, `proving_rings`; made in build where they are missing) is tracked clean
and with each fault of `FAULTS` in its silhouettes; components of doubt and errors are kept in build/doubt. The factors of a group of joints
along an axis minimise the mean interval score of 90 % intervals (Gneiting and Raftery 2007), over all runs. Tables and pictures are of
recordings left out: a third at a time is tested with the factors of the others, and on these deviations limits are chosen. `--test` tests
other recordings, as they are, with the factors of all made ones. `--write` writes src/shadowpuppet/tracking/doubt/factors.toml;
`--markdown` the tables to their places in a page, and the pictures to assets beside it.
"""

from __future__ import annotations

import argparse
import itertools
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from itertools import product
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple

import numpy as np
import smallest
from doubt_runs import BUILD, MADE, Tracked, collect, read_runs
from doubt_tables import WIDTH, alarm_table, dof_table, fit_dofs, fit_modes, mode_table
from faults import into_page

from shadowpuppet.body.skeleton import SIDES
from shadowpuppet.evaluation.interval_coverage import rank_histogram
from shadowpuppet.geometry import Array
from shadowpuppet.motion.limbs import limb_of
from shadowpuppet.motion.metrics import FAR_ERROR
from shadowpuppet.tracking.doubt.limbs import GROUPS, group_of

TABLE = Path(__file__).resolve().parent.parent / "src" / "shadowpuppet" / "tracking" / "doubt" / "factors.toml"


@dataclass(frozen=True, eq=False)
class Errors:
    """Errors of one joint along one axis in one run."""

    recording: str
    fault: str
    joint: str
    axis: int
    names: tuple[str, ...]
    """Of the F components."""
    lengths: Array
    """Components (n, F), metres."""
    errors: Array
    """Of shape (n,), metres."""


def errors_of(runs: Iterable[Tracked]) -> list[Errors]:
    """Errors of all joints and axes where they are known."""
    found = list[Errors]()
    for run in runs:
        lengths, known = np.stack(list(run.components.values()), 3), np.isfinite(run.errors)
        for j, joint in enumerate(run.joints):
            for axis, which in enumerate(known[:, j].T):
                if which.any():
                    own = lengths[which, j, axis], run.errors[which, j, axis]
                    found.append(Errors(run.recording, run.fault, joint, axis, tuple(run.components), *own))
    return found


def fit(lengths: Array, errors: Array, least: Array) -> Array:
    """Factors (F,) of components (n, F) for errors (n,): those of least mean interval score, and not below `least`
    (F,); 1 of components that do not occur."""
    from scipy.optimize import minimize

    step = max(1, len(errors) // MOST)  # neighbouring frames tell the same
    squares, size = lengths[::step] ** 2, np.abs(errors[::step])

    def score(logs: Array) -> tuple[float, Array]:
        variances = np.exp(logs)
        sd = np.sqrt(squares @ variances) + 1e-6
        beyond = np.maximum(size - WIDTH * sd, 0)
        slope = (2 * WIDTH - 20 * WIDTH * (beyond > 0)) / (2 * sd)
        return float((2 * WIDTH * sd + 20 * beyond).mean()) * SCALE, (slope[:, None] * squares * variances).mean(0) * SCALE

    lowest = np.maximum(2 * np.log(np.maximum(least, 1e-6)), -9)
    start = np.maximum(lowest, np.log(0.05))
    found = np.exp(minimize(score, start, jac=True, method="L-BFGS-B", bounds=[(low, 9) for low in lowest]).x / 2)
    return np.where(squares.any(0), found, 1.0)


MOST = 15000
"""Greatest number of errors, about, that factors are fitted to."""
SCALE = 100.0
"""Factor on scores (m), for the optimiser's tolerances."""
LEAST = {"constant": 0.7, "distance": 1.0}
LEAST_SEVERAL = {"constant": 0.4}
"""Least factors with one camera and with several: made recordings know neither the doubt in where a joint is in a body, nor that in the
distance. Several cameras fit the body to the person's surface, and so show most of the first."""
SILENT, MOST_SILENT, OFTEN = 0.005, 0.01, 0.01
"""Share of a kind of limb's joints that may be over `FAR_ERROR` off in a limb that is vouched for; share of all joints of a run from which
on it counts as silent; and how many runs may be."""
LIMITS = (0.24, 0.22, 0.20, 0.185, 0.17, 0.155)
"""Limits (m) of arms in that table."""
NEAR = 0.1
"""Error (m) below which a doubtful joint is a false alarm."""
RANKS = 20
"""Number of bars of the picture of ranks."""
PARTS = 3
"""Number of parts of the recordings; each is tested with the factors of the others."""
NEGLIGIBLE = 0.02
"""Factor below which a component is left out."""


def interval_score(sd: Array, errors: Array) -> float:
    """Mean interval score (m) of +-1.645 sd (n,) for errors (n,): width, and twenty times what lies beyond."""
    return float((2 * WIDTH * sd + 20 * np.maximum(np.abs(errors) - WIDTH * sd, 0)).mean())


Factors = dict[str, dict[int, Array]]
"""Factors (F,) by group and axis."""


def fit_all(runs: Sequence[Errors]) -> Factors:
    """Factors of all groups that occur; the world's two level axes share theirs, those of the silhouettes' only camera do not."""
    along_view = "spread_depth" in runs[0].names
    least = np.array([(LEAST if "distance" in runs[0].names else LEAST_SEVERAL).get(name, 0.0) for name in runs[0].names])
    axes, out = [(0,), (1,), (2,)] if along_view else [(0, 1), (2,)], dict[str, dict[int, Array]]()
    for group, tied in product(GROUPS, axes):
        own = [run for run in runs if group_of(run.joint) == group and run.axis in tied]
        if own:
            lengths, errors = (np.concatenate([getattr(run, name) for run in own]) for name in ("lengths", "errors"))
            out.setdefault(group, {}).update(dict.fromkeys(tied, fit(lengths, errors, least)))
    return out


def deviations(factors: Factors, run: Errors) -> Array:
    """Standard deviations (n,), metres."""
    return np.sqrt(run.lengths**2 @ factors[group_of(run.joint)][run.axis] ** 2)


class Tested(NamedTuple):
    """A run, judged by factors and limits of other recordings."""

    run: Errors
    sd: Array
    """Standard deviations (n,), metres."""
    constant: float
    """The best constant deviation (m) of the joint along the axis."""


def folds(runs: Sequence[Tracked]) -> Iterator[tuple[list[Tracked], list[Tracked]]]:
    """A third of the recordings at a time, and the others; a recording alone is its own other."""
    names = sorted({run.recording for run in runs})
    for part in range(min(PARTS, len(names))):
        tested = set(names[part::PARTS])
        yield [run for run in runs if run.recording in tested], [run for run in runs if run.recording not in tested] or list(runs)


def judged(own: Sequence[Tracked], others: Sequence[Tracked]) -> tuple[list[Tested], list[LimbJoint]]:
    """Joints and limbs of some runs, judged by factors of others."""
    known, by_joint = errors_of(others), dict[tuple[str, int], list[Array]]()
    factors = fit_all(known)
    for run in known:
        by_joint.setdefault((run.joint, run.axis), []).append(np.abs(run.errors))
    best = {key: float(np.quantile(np.concatenate(sizes), 0.9)) / WIDTH for key, sizes in by_joint.items()}
    tested = [Tested(run, deviations(factors, run), best[run.joint, run.axis]) for run in errors_of(own)]
    return tested, limb_joints(own, factors)


def left_out(runs: Sequence[Tracked]) -> tuple[list[Tested], list[LimbJoint]]:
    """Joints and limbs of all runs, judged by factors of other recordings."""
    joints, limbs = zip(*itertools.starmap(judged, folds(runs)))
    return list(itertools.chain(*joints)), list(itertools.chain(*limbs))


class LimbJoint(NamedTuple):
    """Errors of one joint in one run, and the deviation of its limb."""

    run: Tracked
    kind: str
    """Of the limb: trunk, arm or leg."""
    errors: Array
    """Distances (n,), metres."""
    radius: Array
    """Greatest deviation (n,), all axes together, of the limb's joints, metres."""
    limit: float = np.inf
    """Deviation (m) above which the limb is doubtful."""


def limb_joints(runs: Sequence[Tracked], factors: Factors) -> list[LimbJoint]:
    """All joints with the deviations of their limbs."""
    found = []
    for run in runs:
        lengths = np.stack(list(run.components.values()), 3)
        rows = np.array([[factors[group_of(joint)][axis] for axis in range(3)] for joint in run.joints])
        radius, errors = np.sqrt(((lengths * rows) ** 2).sum((2, 3))), np.sqrt((run.errors**2).sum(2))
        for j, joint in enumerate(run.joints):
            own = [n for n, name in enumerate(run.joints) if limb_of(name) == limb_of(joint)]
            known = np.isfinite(errors[:, j])
            found.append(LimbJoint(run, limb_of(joint).rpartition("_")[2], errors[known, j], radius[known][:, own].max(1)))
    return found


def with_limits(joints: Sequence[LimbJoint], limits: Mapping[str, float]) -> list[LimbJoint]:
    """Limbs judged by limits (m) of their kinds."""
    return [each._replace(limit=limits[each.kind]) for each in joints]


def by_run(joints: Iterable[LimbJoint]) -> dict[Tracked, list[LimbJoint]]:
    """The joints of each run."""
    found = dict[Tracked, list[LimbJoint]]()
    for each in joints:
        found.setdefault(each.run, []).append(each)
    return found


def fit_limits(joints: Sequence[LimbJoint]) -> dict[str, float]:
    """Of each kind of limb the greatest limit (m), up to `FAR_ERROR`, with at most `SILENT` of its joints far off and vouched for, and at
    most `OFTEN` of the runs in which these are over `MOST_SILENT` of all joints: silence has priority over false alarms. With two cameras,
    `MOST_SILENT` of all runs' alone: a front is wrong in a whole run or in none, so that one run in a hundred would decide."""
    kinds = {kind: [each for each in joints if each.kind == kind] for kind in dict.fromkeys(each.kind for each in joints)}
    if "turned" in joints[0].run.components:
        return {kind: min(FAR_ERROR, _limit(own, MOST_SILENT * sum(len(each.errors) for each in own))) for kind, own in kinds.items()}
    number = {run: sum(len(each.errors) for each in own) for run, own in by_run(joints).items()}
    limits = {}
    for kind, own in kinds.items():
        of_runs = sorted(_limit(part, MOST_SILENT * number[run]) for run, part in by_run(own).items())
        limits[kind] = min(FAR_ERROR, _limit(own, SILENT * sum(len(each.errors) for each in own)), of_runs[int(OFTEN * len(of_runs))])
    return limits


def _limit(joints: Sequence[LimbJoint], silent: float) -> float:
    """The greatest limit (m) at which at most a number `silent` of joints are far off and vouched for."""
    errors, radius = (np.concatenate([getattr(each, name) for each in joints]) for name in ("errors", "radius"))
    order = np.argsort(radius)
    vouched = np.searchsorted(np.cumsum(errors[order] > FAR_ERROR), silent, "right")
    return float(np.r_[0.0, radius[order[:-1]], np.inf][vouched])


def joint_table(tested: Sequence[Tested]) -> str:
    """Coverage, rank correlation and score by group of joints, as Markdown."""
    lines = ["| joints | covered by 90 % | sd, mm | error, mm | rank correlation | score / best constant |", "|---|" + "---:|" * 5]
    for group in [*GROUPS, "all"]:
        own = [each for each in tested if group in ("all", group_of(each.run.joint))]
        if not own:
            continue
        sd, errors = np.concatenate([each.sd for each in own]), np.concatenate([each.run.errors for each in own])
        constant = np.concatenate([np.full(len(each.sd), each.constant) for each in own])
        covered, ratio = float((np.abs(errors) <= WIDTH * sd).mean()), interval_score(sd, errors) / interval_score(constant, errors)
        lines.append(f"| {group} | {100 * covered:.1f} | {1000 * sd.mean():.0f} | {1000 * np.abs(errors).mean():.0f} | "
                     f"{_rank_correlation(sd, np.abs(errors)):.2f} | {ratio:.2f} |")
    return "\n".join(lines)


def limb_table(tested: Sequence[LimbJoint]) -> str:
    """Silence and false alarms by kind of limb, as Markdown."""
    lines = ["| limb | limit, mm | over 300 mm | over 300 mm and vouched for | the same, worst run | under 100 mm, called doubtful |",
             "|---|" + "---:|" * 5]
    number = {run: sum(len(each.errors) for each in own) for run, own in by_run(tested).items()}
    for kind in dict.fromkeys(each.kind for each in tested):
        own = [each for each in tested if each.kind == kind]
        errors, doubtful = np.concatenate([each.errors for each in own]), np.concatenate([each.radius > each.limit for each in own])
        far, near = errors > FAR_ERROR, errors < NEAR
        worst = max(sum(((each.errors > FAR_ERROR) & (each.radius <= each.limit)).sum() for each in part) / number[run]
                    for run, part in by_run(own).items())
        lines.append(f"| {kind} | {1000 * np.mean([each.limit for each in own]):.0f} | {100 * far.mean():.1f} % | "
                     f"{100 * (far & ~doubtful).mean():.2f} % | {100 * worst:.1f} % | "
                     f"{100 * (near & doubtful).sum() / max(near.sum(), 1):.0f} % |")
    return "\n".join(lines)


def price_table(tested: Sequence[LimbJoint]) -> str:
    """What less silence of arms costs in false alarms, by their limit, as Markdown. Shares of silence are of all joints of the runs."""
    lines = ["| limit of arms, mm | over 300 mm and vouched for | runs with over 1 % of these | under 100 mm, called doubtful |",
             "|---|" + "---:|" * 3]
    number = {run: sum(len(each.errors) for each in own) for run, own in by_run(tested).items()}
    arms = [each for each in tested if each.kind == "arm"]
    for limit in LIMITS:
        silent = {run: sum(((each.errors > FAR_ERROR) & (each.radius <= limit)).sum() for each in own) for run, own in by_run(arms).items()}
        near, doubted = (sum(((each.errors < NEAR) & (each.radius > least)).sum() for each in arms) for least in (-1, limit))
        often = sum(silent[run] > MOST_SILENT * number[run] for run in silent)
        lines.append(f"| {1000 * limit:.0f} | {100 * sum(silent.values()) / sum(number.values()):.2f} % | {often} of {len(silent)} | "
                     f"{100 * doubted / max(near, 1):.0f} % |")
    return "\n".join(lines)


def arm_alarms(runs: Sequence[Tracked], factors: Factors) -> str:
    """`doubt_tables.alarm_table` of the arms in some runs, with factors of the same runs."""
    variances, errors = dict[str, list[Array]](), list[Array]()
    for run, side in product(runs, SIDES):
        off = np.sqrt((run.errors**2).sum(2))
        own = [j for j, name in enumerate(run.joints) if limb_of(name) == f"{side}_arm" and np.isfinite(off[:, j]).any()]
        known = np.isfinite(off[:, own]).all(1)
        errors.append(off[known][:, own])
        rows = np.array([[factors[group_of(run.joints[j])][axis] for axis in range(3)] for j in own])
        for n, (name, lengths) in enumerate(run.components.items()):
            variances.setdefault(name, []).append(((lengths[known][:, own] * rows[..., n]) ** 2).sum(2))
    return alarm_table({name: np.concatenate(parts) for name, parts in variances.items()}, np.concatenate(errors), SILENT, NEAR, FAR_ERROR)


def draw(path: Path, joints: Sequence[Tested], limbs: Sequence[LimbJoint]) -> None:
    """Calibration curve, ranks of the truth in the stated distributions and, by kind of limb, false alarms over silence (PNG)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from scipy.stats import norm

    figure = Figure(figsize=(13, 4.2), layout="constrained")
    FigureCanvasAgg(figure)
    left, middle, right = figure.subplots(1, 3)
    stated, share = np.linspace(0.05, 0.99, 40), np.concatenate([np.abs(each.run.errors) / each.sd for each in joints])
    left.plot([0, 100], [0, 100], color="0.7", linewidth=1)
    left.plot(100 * stated, [100 * (share <= norm.ppf(0.5 + part / 2)).mean() for part in stated])
    left.set(xlabel="stated interval, %", ylabel="true positions in it, %", title="Calibration")
    ranks = rank_histogram(np.concatenate([each.run.errors for each in joints]), np.concatenate([each.sd for each in joints]), RANKS)
    middle.bar(100 * (np.arange(RANKS) + 0.5) / RANKS, 100 * ranks, width=95 / RANKS)
    middle.axhline(100 / RANKS, color="0.7", linewidth=1)
    middle.set(xlabel="place of the truth in the stated distribution, %", ylabel="true positions, %", title="Ranks")
    for kind in dict.fromkeys(each.kind for each in limbs):
        own = [each for each in limbs if each.kind == kind]
        errors, radius = (np.concatenate([getattr(each, name) for each in own]) for name in ("errors", "radius"))
        limits = np.quantile(radius, np.linspace(0, 1, 200))
        silent = [100 * ((errors > FAR_ERROR) & (radius <= limit)).mean() for limit in limits]
        doubted = [100 * (radius[errors < NEAR] > limit).mean() for limit in limits]
        (line,) = right.plot(silent, doubted, label=kind)
        limit = float(np.mean([each.limit for each in own]))
        right.plot(np.interp(limit, limits, silent), np.interp(limit, limits, doubted), "o", color=line.get_color())
    right.set(xlabel="over 300 mm off and vouched for, % of the joints", ylabel="under 100 mm off, called doubtful, %", title="Limbs",
              xlim=(-0.1, 5))
    right.legend()
    figure.savefig(path, dpi=110)


def _rank_correlation(one: Array, other: Array) -> float:
    from scipy.stats import spearmanr

    return float(spearmanr(one, other).statistic)  # pyright: ignore[reportAttributeAccessIssue]


def factors_text(kind: str, runs: Sequence[Tracked], factors: Factors, limits: dict[str, float]) -> str:
    """The table of a kind in factors.toml."""
    lines = [f"[{kind}]", "components = [" + ", ".join(f'"{name}"' for name in runs[0].components) + "]"]
    lines.append("limits = { " + ", ".join(f"{limb} = {limit:.3f}" for limb, limit in limits.items()) + " }")
    if any(len(run.modes) for run in runs):
        modes = fit_modes(runs)
        lines.append(f"modes = {{ temperature = {modes.temperature:.0f}, odds = {modes.odds:.3f}, growth = {modes.growth:.3f} }}")
        lines.append("dofs = { " + ", ".join(f"{name} = {factor:.2f}" for name, factor in fit_dofs(runs).items()) + " }")
    for group, axes in factors.items():
        rows = {axis: ", ".join(f"{value:.3f}" if value >= NEGLIGIBLE else "0" for value in axes[n]) for n, axis in enumerate("xyz")}
        lines.append(f"{group} = {{ " + ", ".join(f"{axis} = [{row}]" for axis, row in rows.items()) + " }")
    return "\n".join(lines) + "\n"


HEAD = "# Factors of the components of doubt, by group of joints and axis. Written by benchmarks/calibrate_doubt.py; do not edit.\n"


def _smallest(folder: Path) -> list[object]:
    page = smallest.copy(Path(__file__).resolve().parent.parent / "docs" / "doubt.md", folder)
    (folder / "assets").mkdir(exist_ok=True)
    return ["--kind", "monocular", "--folder", folder, "--markdown", page, "--recordings", smallest.make(folder / "tiny")]


def main() -> None:
    """Parse, run, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kind", default="monocular,multiview,keypoints,keypoints_one,both", help="models, separated by commas")
    parser.add_argument("--recordings", type=Path, nargs="*", help="folders; the proving grounds without")
    parser.add_argument("--test", type=Path, nargs="*", default=[], help="recordings with truth that nothing is fitted to")
    parser.add_argument("--folder", type=Path, default=BUILD, help="where components and errors are kept")
    parser.add_argument("--write", action="store_true", help="write the factors into the package")
    parser.add_argument("--markdown", type=Path, help="page for the tables, at their places; pictures go to assets beside it")
    parser.add_argument("--again", action="store_true", help="track again what has been tracked")
    parser.add_argument("--workers", type=int, default=2)
    args, texts = smallest.parse(parser, _smallest), dict[str, str]()
    for kind in args.kind.split(","):
        paths = args.recordings or MADE[kind]()
        with ProcessPoolExecutor(args.workers, get_context("spawn")) as pool:
            files = [file for found in pool.map(partial(collect, kind, build=args.folder, again=args.again), paths) for file in found]
        runs = read_runs(files)
        joints, limbs = left_out(runs)
        limits = fit_limits(limbs)  # by factors that know nothing of the recording, as a user's
        limbs, clean = with_limits(limbs, limits), left_out([run for run in runs if run.fault == "clean"])
        for title, tested, own in (("clean", clean[0], with_limits(clean[1], limits)), ("clean and spoiled", joints, limbs)):
            text = f"{joint_table(tested)}\n\n{limb_table(own)}"
            print(f"\n{kind}, {title}\n\n{text}", flush=True)
            if args.markdown:
                into_page(args.markdown, f"{kind}, {title}", text)
        for path in args.test:
            tested, own = judged(read_runs(collect(kind, path, args.folder, args.again, clean=True)), runs)
            own = with_limits(own, limits)
            print(f"\n{kind}, {path.name}\n\n{joint_table(tested)}\n\n{limb_table(own)}\n\n{price_table(own)}", flush=True)
        factors = fit_all(errors_of(runs))
        if any(len(run.modes) for run in runs):
            parts = list(folds(runs))
            tables = {"modes": mode_table(parts), "degrees of freedom": dof_table(parts), "rules": arm_alarms(runs, factors),
                      "price": price_table(limbs)}
            for title, text in tables.items():
                print(f"\n{kind}, {title}\n\n{text}", flush=True)
                if args.markdown:
                    into_page(args.markdown, f"{kind}, {title}", text)
        if args.markdown:
            draw(args.markdown.parent / "assets" / f"doubt_{kind}.png", joints, limbs)
        texts[kind] = factors_text(kind, runs, factors, limits)
        print("\n" + texts[kind])
    if args.write:
        kept = re.split(r"(?m)^(?=\[)", TABLE.read_text("utf-8"))[1:] if TABLE.exists() else []
        texts = {text[1 : text.index("]")]: text.strip() + "\n" for text in kept} | texts
        TABLE.write_text(HEAD + "\n" + "\n".join(texts.values()), encoding="utf-8")


if __name__ == "__main__":
    main()
