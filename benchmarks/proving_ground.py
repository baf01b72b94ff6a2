"""The proving ground: settings of the one-camera tracker on made recordings, bodies x motions x cameras x noise, to choose them by.

    python benchmarks/proving_ground.py [--rows default,liu2011] [--seeds 2] [--each] [--shift 500] [--markdown FILE] [--picture FILE]

The recordings (`synthetic.proving_ground`) are made where they are missing, some 5 s each, in build/proving_ground. From video, sizes from
the references, as `shadowpuppet track` does it. A row is a choice of settings; the table has its means over recordings and seeds, and
`se`, the standard error of the mean error against the first row's, in pairs of the same recording and seed: differences within
two of them are not significant. `--shift 500`: other people, clothes and rooms, on which no setting was chosen. `--picture` draws error
against time for the rows of `TRADE`.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import smallest
from cases import Case

from shadowpuppet.pipeline.options import make_options
from shadowpuppet.synthetic import proving_ground, synthesize
from shadowpuppet.tracking.monocular.initialization import PersonEstimate

HERE = Path(__file__).resolve().parent.parent / "build" / "proving_ground"
SHOWN = ("mean", "plane", "depth", "far", "aligned", "cost", "jitter", "ms")


def _particles(number: int, cycles: int, explore: int) -> dict[str, Any]:
    return {"tracker": {"torso": {"particles": number}, "arm": {"particles": number}, "cycles": cycles, "explore": explore}}


TRADE: dict[str, dict[str, Any]] = {f"N {n}, {k} cycle{'s' * (k > 1)}": _particles(n, k, n) for n in (25, 50, 100, 200, 400, 800)
                                    for k in (1, 2, 3, 5)}
"""Particles and cycles: what time buys."""
TRUE_ARMS = "true arms"
ROWS: dict[str, dict[str, Any]] = {
    "default": {},
    "liu2011": {"preset": "liu2011"},
    "liu2011, stratified": {"preset": "liu2011", "tracker": {"resampling": "stratified"}},
    "exact masks": {"masks": True},
    "cardbox": {"tracker": {"body": "cardbox"}},
    "no colours of arms": {"tracker": {"arm_colours": False}},
    TRUE_ARMS: {},
    "forward only": {"tracker": {"both_ways": False}},
    "no exploring": {"tracker": {"explore": 0}},
    "explore 2000": {"tracker": {"explore": 2000}},
    "best particle": {"tracker": {"estimate": "best"}},
    "no motion pull": {"tracker": {"motion_weight": 0}},
    "motion pull x 2": {"tracker": {"motion_weight": 400}},
    "no posture prior": {"tracker": {"posture_weight": 0}},
    "posture prior x 2": {"tracker": {"posture_weight": 40}},
    "arms drawn with the torso": {"tracker": {"torso_arms": "last"}},
    "ranked anew": {"tracker": {"rank_by": "new"}},
    "stratified": {"tracker": {"resampling": "stratified"}},
    "flat": {"tracker": {"stages": ["torso+left_arm+right_arm"]}},
    **TRADE,
}
"""Each a default with something changed; `TRUE_ARMS` tracks with the truth's lengths of the arms, which no option does."""


def made(folder: Path, names: Iterable[str] = (), shift: int = 0) -> list[Path]:
    """Folders of the recordings, or of those named; made where they are missing. `shift`: see `proving_ground`."""
    wanted, out = set(names), []
    for n, spec in enumerate(proving_ground(shift)):
        if wanted and spec.name not in wanted:
            continue
        out.append(folder / spec.name)
        if not (done := out[-1] / "made").exists():
            synthesize(spec, out[-1], np.random.default_rng([shift, n]))
            done.touch()
    return out


@cache
def _case(path: Path, masks: bool) -> Case:
    return Case.read(path, masks=masks)


@cache
def _person(path: Path, masks: bool, body: str, seed: int) -> PersonEstimate:
    return _case(path, masks).person(make_options({"masks": masks, "tracker": {"body": body}}), np.random.default_rng([seed, 0]))


def run(path: Path, rows: Mapping[str, Mapping[str, Any]], seeds: int) -> dict[str, list[dict[str, float]]]:
    """Measures of one recording: row to seeds."""
    out = {}
    for name, values in rows.items():
        options = make_options(dict(values))
        case, persons = _case(path, options.masks), [_person(path, options.masks, options.tracker.body, seed) for seed in range(seeds)]
        if name == TRUE_ARMS:
            persons = [case.with_true_arms(person) for person in persons]
        out[name] = [case.track(person, options.tracker, np.random.default_rng([seed, 1])) for seed, person in enumerate(persons)]
    return out


def prove(paths: Sequence[Path], rows: Mapping[str, Mapping[str, Any]], seeds: int, workers: int = 1,
          ) -> dict[str, dict[str, list[dict[str, float]]]]:
    """Measures by recording, row and seed; each recording in one process."""
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        return {path.name: found for path, found in zip(paths, pool.map(run, paths, [rows] * len(paths), [seeds] * len(paths)))}


def table(found: Mapping[str, Mapping[str, list[dict[str, float]]]]) -> str:
    """One line a row of settings, as Markdown."""
    rows = list(next(iter(found.values())))
    errors = {row: np.array([[run["mean"] for run in runs[row]] for runs in found.values()]) for row in rows}
    lines = ["| settings | " + " | ".join([*SHOWN[:1], "se", *SHOWN[1:]]) + " |", "|---" * (len(SHOWN) + 2) + "|"]
    for row in rows:
        means = {key: float(np.mean([run[key] for runs in found.values() for run in runs[row]])) for key in SHOWN}
        apart = (errors[row] - errors[rows[0]]).mean(1)
        se = apart.std(ddof=1) / np.sqrt(len(apart)) if len(apart) > 1 else float("nan")
        cells = [means["mean"], se, *(means[key] for key in SHOWN[1:])]
        lines.append(f"| {row} | " + " | ".join(f"{cell:.1f}" for cell in cells) + " |")
    return "\n".join(lines)


def each(found: Mapping[str, Mapping[str, list[dict[str, float]]]]) -> str:
    """Mean error of every recording under every row, as Markdown."""
    rows = list(next(iter(found.values())))
    lines = ["| recording | " + " | ".join(rows) + " |", "|---" * (len(rows) + 1) + "|"]
    lines += [f"| {name} | " + " | ".join(f"{np.mean([run['mean'] for run in runs[row]]):.0f}" for row in rows) + " |"
              for name, runs in found.items()]
    return "\n".join(lines)


def draw(found: Mapping[str, Mapping[str, list[dict[str, float]]]], file: Path) -> None:
    """Error against milliseconds a frame: a line for each number of cycles, a dot for each number of particles."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    def mean(row: str, key: str) -> float:
        return float(np.mean([run[key] for runs in found.values() for run in runs[row]]))

    figure, axes = plt.subplots(figsize=(7, 4.2), layout="constrained")
    for cycles in (1, 2, 3, 5):
        rows = [row for row in TRADE if f", {cycles} cycle" in row]
        label = f"{cycles} cycle{'s' * (cycles > 1)}"
        axes.plot([mean(row, "ms") for row in rows], [mean(row, "mean") for row in rows], "o-", ms=4, label=label)
        for row in rows if cycles == 3 else ():
            axes.annotate(row.split(",")[0], (mean(row, "ms"), mean(row, "mean")), textcoords="offset points", xytext=(4, 5), fontsize=8)
    for row, mark in (("default", "k*"), ("liu2011", "r^")):
        if row in next(iter(found.values())):
            axes.plot(mean(row, "ms"), mean(row, "mean"), mark, ms=11, label=row)
    ticks = (0.5, 1, 2, 5, 10, 20)
    axes.set(xscale="log", xlabel="milliseconds a frame, filter only, one core", ylabel="mean joint error, mm")
    axes.set_xticks(ticks, labels=[f"{tick:g}" for tick in ticks])
    axes.grid(alpha=0.3, which="both")
    axes.legend()
    figure.savefig(file, dpi=150)


def _smallest(folder: Path) -> list[object]:
    smallest.make(folder / "man_paper")
    return ["--rows", "liu2011;no exploring;true arms", "--recordings", "man_paper", "--seeds", 1, "--folder", folder, "--each",
            "--markdown", folder / "table.md", "--json", folder / "measures.json"]


def main() -> None:
    """Parse, run, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rows", default="default;liu2011", help="names, with ; between them: " + "; ".join(ROWS))
    parser.add_argument("--recordings", default="", help="names, with ; between them; all without")
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--shift", type=int, default=0, help="other people, clothes and rooms, which no setting was chosen on")
    parser.add_argument("--folder", type=Path, help="where the recordings are, or are made")
    parser.add_argument("--each", action="store_true", help="print every recording's error, too")
    parser.add_argument("--markdown", type=Path, help="write the tables there too")
    parser.add_argument("--json", type=Path, help="write all measures there")
    parser.add_argument("--picture", type=Path, help="draw the trade of error against time")
    parser.add_argument("--workers", type=int, default=1, help="processes; more than one makes the milliseconds worse")
    args = smallest.parse(parser, _smallest)
    chosen = [*args.rows.split(";"), *(TRADE if args.picture else ())]
    unknown = [row for row in chosen if row not in ROWS]
    if unknown:
        parser.error(f"unknown row {unknown[0]!r}; there are: {'; '.join(ROWS)}")
    folder = args.folder or (HERE / str(args.shift) if args.shift else HERE)
    paths = made(folder, filter(None, args.recordings.split(";")), args.shift)
    found = prove(paths, {row: ROWS[row] for row in dict.fromkeys(chosen)}, args.seeds, args.workers)
    text = "\n\n".join([table(found), *([each(found)] if args.each else [])])
    print(text)
    if args.markdown:
        args.markdown.write_text(text + "\n", encoding="utf-8")
    if args.json:
        args.json.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    if args.picture:
        draw(found, args.picture)


if __name__ == "__main__":
    main()
