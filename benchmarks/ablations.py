"""What each part of the trackers, of the cameras and of the silhouettes is worth: one thing changed at a time, on made recordings.

    python benchmarks/ablations.py [STUDY...] [--seeds 2] [--workers 2] [--one FOLDER] [--rings FOLDER] [-o build/ablations]

Each run is what `shadowpuppet track` does, through `shadowpuppet.pipeline.batch`: a second start does what is missing. Recordings are
those of the proving grounds (`synthetic.proving_ground`, `synthetic.proving_rings`), made where they are missing. The error is that of
joints in millimetres, a frame that is lost counting 500; `se` is the standard error of its difference from the study's first row, in pairs
of recording and seed: differences within two of them are not significant. Tables go into build/ablations.md,
and, once all studies are done, pictures into docs/assets; docs/accuracy.md shows these, and some rows.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from textwrap import fill
from typing import Any, NamedTuple

import numpy as np
import smallest
from distance_cost import by_distance
from multiview import made as made_rings
from proving_ground import made as made_one
from spoiled import SPOILS, spoiled

from shadowpuppet.geometry import Array
from shadowpuppet.io.calibration.calibration_files import read_calibration
from shadowpuppet.io.person import read_person, write_person
from shadowpuppet.pipeline.batch import make_grid, run_batch
from shadowpuppet.pipeline.batch.summary import BatchRun
from shadowpuppet.pipeline.options import make_options
from shadowpuppet.pipeline.prepare import fit_person

ROOT = Path(__file__).resolve().parent.parent
BUILD, PAGE, ASSETS = ROOT / "build", ROOT / "build" / "ablations.md", ROOT / "docs" / "assets"
ONE = ("man_paper", "woman_reach", "woman_random", "child_reach", "man_boxing", "woman_noisy")
RINGS = ("rings_jog", "rings_reach", "rings_squat")
LOST_MM = 500.0
"""What a joint of a lost frame counts."""
FLAT = ["torso+left_arm+right_arm"]

Rows = Mapping[str, tuple[Path, dict[str, Any]]]
"""By the name of a row: the recording, and the settings."""


@dataclass(frozen=True)
class Study:
    """One thing that is changed."""

    name: str
    title: str
    rings: bool
    """Of several cameras."""
    rows: Callable[[Path, Path], Rows]
    """Of a recording, and a folder for what is made of it; the first row is what the others are compared with."""
    axis: str = ""
    """What the numbers are that rows are named after; empty where they are words."""
    track: Mapping[str, Callable[..., Any]] | None = None
    """What tracks in place of `track_recording`, by row."""


class Result(NamedTuple):
    """What came of a row."""

    errors: Array
    """Of recordings and seeds (R, S), mm."""
    lost: float
    """Share of the frames."""
    ms: float
    """Milliseconds a frame that tracking took, the median; of several cameras the hull's too."""


def settings(rows: Mapping[str, dict[str, Any]]) -> Callable[[Path, Path], Rows]:
    """Rows that differ in settings alone."""
    return lambda recording, _: {name: (recording, values) for name, values in rows.items()}


def parts(number: int, **more: Any) -> dict[str, Any]:
    """The one-camera tracker with so many particles a stage."""
    return {"tracker": {"torso": {"particles": number}, "arm": {"particles": number}, **more}}


def several(**values: Any) -> dict[str, Any]:
    """Settings of the tracker of several cameras; exact silhouettes, and half of the sets of fast cameras, to be done sooner."""
    return {"masks": True, "every": 2, "multiview": values}


def noise(base: dict[str, Any]) -> Callable[[Path, Path], Rows]:
    """Exact silhouettes, and those that are spoiled."""
    masks = {**base, "masks": True}
    return lambda recording, work: {"exact": (recording, masks)} | {name: (spoiled(recording, name, work), masks) for name in SPOILS}


def sizes(base: dict[str, Any], factors: Sequence[float]) -> Callable[[Path, Path], Rows]:
    """The person as measured, larger and smaller."""

    def rows(recording: Path, work: Path) -> Rows:
        measured = work / f"{recording.name}.toml"
        if not measured.exists():
            fit_person(recording, measured, make_options(base))
        person, out = read_person(measured), {}
        for factor in factors:
            file = work / f"{recording.name}_{factor:g}.toml"
            write_person(file, replace(person, sizes=type(person.sizes).from_array(factor * person.sizes.to_array())))
            out[f"{factor:g}"] = recording, {**base, "person": str(file)}
        return out

    return rows


def cameras(counts: Sequence[int]) -> Callable[[Path, Path], Rows]:
    """Some of a ring's cameras, as evenly spread as can be."""

    def rows(recording: Path, _: Path) -> Rows:
        names = [camera.name for camera in read_calibration(recording / "calibration.toml")]
        chosen = {n: [names[k] for k in np.unique(np.arange(n) * len(names) // n)] for n in counts if n <= len(names)}
        return {str(n): (recording, {**several(), "camera": ",".join(some)}) for n, some in chosen.items()}

    return rows


LIU = {"preset": "liu2011"}
STUDIES = (
    Study("stages", "Stage by stage, or all at once", False, settings({
        "liu2011, 3 stages of 200": LIU, "liu2011, flat, 600": {**LIU, "tracker": {"stages": FLAT}},
        "default, 3 stages of 500": {}, "default, flat, 1500": {"tracker": {"stages": FLAT}}})),
    Study("cost", "What is counted: pixels that differ (eq. 2), or their distance from the outline", False, settings({
        "liu2011, eq. 2": {**LIU, "masks": True}, "liu2011, distance": {**LIU, "masks": True}}), track={"liu2011, distance": by_distance}),
    Study("particles", "Particles a stage", False, settings({str(n): parts(n, explore=n) for n in (500, 25, 50, 100, 200, 1000, 2000)}),
          "particles a stage"),
    Study("cycles", "One cycle or several (annealing), as many particles in all", False, settings({
        str(k): parts(600 // k, cycles=k, explore=600 // k) for k in (1, 2, 3, 5)}), "cycles a frame"),
    Study("size", "Size of the pictures", False, settings({str(n): {"max_size": n} for n in (320, 80, 120, 160, 240)}), "pixels across"),
    Study("rate", "Pictures a second", False, settings({f"{15 / n:g}": {"every": n} for n in (1, 2, 3, 5)}), "pictures a second"),
    Study("noise", "Silhouettes that are spoiled", False, noise({})),
    Study("sizes", "Sizes of the person that are wrong", False, sizes({}, (1.0, 0.85, 0.9, 0.95, 1.05, 1.1, 1.15)),
          "sizes, over those measured"),
    Study("rings_cameras", "Number of cameras", True, cameras((6, 2, 3, 4, 5)), "cameras"),
    Study("rings_particles", "Particles", True, settings({str(n): several(particles=n) for n in (16, 4, 8, 32, 64)}), "particles"),
    Study("rings_cycles", "One cycle or several (annealing), as many particles in all", True, settings({
        str(k): several(particles=24 // k, cycles=k) for k in (1, 2, 3, 4)}), "cycles a frame"),
    Study("rings_refinement", "How poses are refined, and what is counted", True, settings({
        "default: Gauss-Newton, surface and XOR": several(), "surface alone": several(silhouettes=0.0),
        "simulated forces": several(refinement="forces"), "not at all, 16": several(method="particle_filter"),
        "not at all, 500": several(method="particle_filter", particles=500), "no recovery": several(recover=False)})),
    Study("rings_size", "Size of the pictures", True, settings({str(n): {**several(), "max_size": n} for n in (640, 120, 160, 240, 320)}),
          "pixels across, at most"),
    Study("rings_noise", "Silhouettes that are spoiled", True, noise(several())),
    Study("rings_sizes", "Sizes of the person that are wrong", True, sizes(several(), (1.0, 0.9, 0.95, 1.05, 1.1)),
          "sizes, over those measured"),
)  # fmt: skip


def run(study: Study, recordings: Sequence[Path], out: Path, seeds: int, workers: int) -> dict[str, Result]:
    """Every row on every recording; those that are alike in one batch."""
    work = out / "work"
    work.mkdir(parents=True, exist_ok=True)
    rows = {recording: study.rows(recording, work) for recording in recordings}
    cases: dict[tuple[Path, Any], dict[str, Any]] = {}
    for wanted in rows.values():
        for name, (of, values) in wanted.items():
            cases.setdefault((of, (study.track or {}).get(name)), {})[_plain(name)] = values
    groups: dict[str, list[tuple[Path, Any]]] = {}
    for (of, track), told in cases.items():
        groups.setdefault(json.dumps([told, track is not None], sort_keys=True), []).append((of, track))
    done: dict[tuple[Path, str], list[BatchRun]] = {}
    for key, some in groups.items():
        folder = out / study.name / hashlib.sha256(key.encode()).hexdigest()[:8]
        batch = run_batch([of for of, _ in some], folder, make_grid(cases=cases[some[0]]), range(seeds), workers=workers, track=some[0][1])
        for one in batch.failed:
            print(f"{one.task.label}: {one.message}", flush=True)
        for one in batch.runs:
            done.setdefault((Path(one.task.recording), one.task.case), []).append(one)
    names = dict.fromkeys(name for wanted in rows.values() for name in wanted)
    return {name: _result([done[wanted[name][0].resolve(), _plain(name)] for wanted in rows.values() if name in wanted]) for name in names}


def _plain(name: str) -> str:
    return re.sub(r"[^A-Za-z0-9.]+", "-", name)


def _result(runs: list[list[BatchRun]]) -> Result:
    errors, lost, ms = [], [], []
    for seeds in runs:
        errors.append([])
        for one in seeds:
            told = one.metrics.get("errors", {"frames": 1, "lost": 1, "mean_mm": LOST_MM})
            share = told["lost"] / max(told["frames"], 1)
            lost.append(share)
            errors[-1].append(share * LOST_MM + (1 - share) * told["mean_mm"] if share < 1 else LOST_MM)
            spent = one.metrics.get("ms_per_frame", {})
            ms.append(spent.get("track", np.nan) + spent.get("hull", 0.0))
    return Result(np.array(errors), float(np.mean(lost)), float(np.nanmedian(ms)))


def table(found: Mapping[str, Result], axis: str) -> str:
    """A line a row, as Markdown."""
    first = next(iter(found.values()))
    lines = [f"| {axis} | error, mm | se | lost, % | ms |", "|---|---:|---:|---:|---:|"]
    for name, one in sorted(found.items(), key=lambda row: float(row[0]) if axis else 0):
        cells = ["**" + name + "**" if one is first else name, f"{one.errors.mean():.1f}", "" if one is first else f"{_se(one, first):.1f}",
                 f"{100 * one.lost:.1f}", f"{one.ms:.2f}"]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def said(found: Mapping[str, Result]) -> str:
    """What is told apart from the first row, in a sentence."""
    first, *others = found.items()
    kinds: dict[str, list[str]] = {"better": [], "worse": [], "not significant": []}
    for name, one in others:
        if np.isfinite(se := _se(one, first[1])):
            apart = one.errors.mean() - first[1].errors.mean()
            kinds["not significant" if abs(apart) <= 2 * se else "better" if apart < 0 else "worse"].append(name)
    told = [f"{kind}: {', '.join(names)}" for kind, names in kinds.items() if names]
    return f"Compared with {first[0]}: {'; '.join(told)}." if told else ""


def write_page(results: Mapping[str, Mapping[str, Result]], page: Path = PAGE) -> None:
    """Write the tables, one section a study."""
    sections = [f"## {study.title}\n\n{table(found, study.axis)}\n\n{said(found)}\n" for study in STUDIES
                if (found := results.get(study.name))]  # fmt: skip
    page.parent.mkdir(parents=True, exist_ok=True)
    page.write_text("\n".join(sections), encoding="utf-8")


def draw(results: Mapping[str, Mapping[str, Result]], rings: bool, file: Path) -> None:
    """A panel a study, and error against time over all that change it."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    studies = [study for study in STUDIES if study.rings == rings]
    figure, panels = plt.subplots(3, 3, figsize=(12, 9), layout="constrained")
    for axes, study in zip(panels.flat, studies):
        found = results[study.name]
        first, means, spread = next(iter(found)), [one.errors.mean() for one in found.values()], [_spread(one) for one in found.values()]
        if study.axis:
            order = np.argsort([float(name) for name in found])
            x, y, sd = (np.array(values, float)[order] for values in (list(map(float, found)), means, spread))
            axes.errorbar(x, y, sd, fmt="o-", ms=4, lw=1, capsize=2)
            axes.plot(float(first), means[0], "k*", ms=11)
            if x.max() / x.min() > 8:
                _logarithmic(axes, x)
            axes.set(xlabel=study.axis, ylabel="joint error, mm")
        else:
            axes.barh(list(found)[::-1], means[::-1], xerr=spread[::-1], color=["C0"] * (len(means) - 1) + ["k"], height=0.6, capsize=2)
            axes.set(xlabel="joint error, mm")
            axes.tick_params(axis="y", labelsize=8)
        axes.set_title(fill(study.title, 46), fontsize=9)
        axes.grid(alpha=0.3)
        axes.set_ylim(bottom=0) if study.axis else axes.set_xlim(left=0)
    axes = panels.flat[len(studies)]
    for study in studies:
        if study.name.removeprefix("rings_") in ("particles", "cycles", "stages", "cameras", "refinement", "size"):
            some = sorted(results[study.name].values(), key=lambda one: one.ms)
            axes.plot([one.ms for one in some], [one.errors.mean() for one in some], "o", ms=4, label=study.name.removeprefix("rings_"))
    _logarithmic(axes, [1, 2, 5, 10, 20, 50, 100])
    times = [one.ms for study in studies for one in results[study.name].values()]
    axes.set(xlabel="ms a frame of tracking", ylabel="joint error, mm", xlim=(0.8 * min(times), 1.25 * max(times)), ylim=(0, None))
    axes.set_title("Error against time, all rows of some studies", fontsize=9)
    axes.grid(alpha=0.3)
    axes.legend(fontsize=7)
    for axes in panels.flat[len(studies) + 1 :]:
        axes.axis("off")
    figure.savefig(file, dpi=80)
    plt.close(figure)


def _logarithmic(axes: Any, ticks: Sequence[float]) -> None:
    axes.set_xscale("log")
    axes.minorticks_off()
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])


def _spread(one: Result) -> float:
    """Standard error of the mean over recordings."""
    each = one.errors.mean(1)
    return float(each.std(ddof=1) / np.sqrt(len(each))) if len(each) > 1 else 0.0


def _se(one: Result, first: Result) -> float:
    """Standard error of the difference from the first row, in pairs."""
    apart = (one.errors - first.errors).ravel() if one.errors.shape == first.errors.shape else np.empty(0)
    return float(apart.std(ddof=1) / np.sqrt(len(apart))) if len(apart) > 1 else float("nan")


def _smallest(folder: Path) -> list[object]:
    for name, parent in ((ONE[0], "one"), (RINGS[0], "rings")):
        smallest.make(folder / parent / name, smallest.RING if parent == "rings" else smallest.ONE)
    return ["cost", "noise", "rings_cameras", "--seeds", 1, "--workers", 0, "--recordings", 1, "--one", folder / "one",
            "--rings", folder / "rings", "--output", folder / "out", "--page", folder / "ablations.md"]


def main() -> None:
    """Parse, run, write the page."""
    names = [study.name for study in STUDIES]
    parser = argparse.ArgumentParser(description="What each part of the trackers, of the cameras and of the silhouettes is worth.")
    parser.add_argument("studies", nargs="*", metavar="STUDY", help="some of: " + ", ".join(names))
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--workers", type=int, default=1, help="processes; more than one makes the milliseconds worse")
    parser.add_argument("--one", type=Path, default=BUILD / "proving_ground", help="where recordings of one camera are, or are made")
    parser.add_argument("--rings", type=Path, default=BUILD / "rings", help="where those of several are, or are made")
    parser.add_argument("-o", "--output", type=Path, default=BUILD / "ablations")
    parser.add_argument("--recordings", type=int, default=len(ONE), help="how many of each at most")
    parser.add_argument("--page", type=Path, default=PAGE, help="where the tables are written")
    args = smallest.parse(parser, _smallest)
    if unknown := set(args.studies) - set(names):
        parser.error(f"found {min(unknown)!r}, expected some of {', '.join(names)}")
    results = {}
    for study in STUDIES:
        if args.studies and study.name not in args.studies:
            continue
        recordings = made_rings(args.rings, RINGS[: args.recordings]) if study.rings else made_one(args.one, ONE[: args.recordings])
        results[study.name] = run(study, recordings, args.output, args.seeds, args.workers)
        print(f"{study.title}\n\n{table(results[study.name], study.axis)}\n\n{said(results[study.name])}\n", flush=True)
    write_page(results, args.page)
    for rings, name in ((False, "one"), (True, "rings")):
        if all(study.name in results for study in STUDIES if study.rings == rings):
            draw(results, rings, ASSETS / f"ablations_{name}.png")


if __name__ == "__main__":
    main()
