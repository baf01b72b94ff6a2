"""Evaluation of a run of several people: identities, misses, false positives, swaps, and the joint errors of each person."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from shadowpuppet.errors import FormatError, ShadowPuppetError
from shadowpuppet.geometry import Array
from shadowpuppet.io.files.text import read_toml
from shadowpuppet.io.motion.motion_files import read_truth
from shadowpuppet.io.people import person_folders
from shadowpuppet.io.run import Run, read_run
from shadowpuppet.motion.metrics import evaluate
from shadowpuppet.motion.motion import BLANK, JointTable
from shadowpuppet.motion.synchronization import at_times

REACH = 0.5
"""Distance (m) of the pelvis from a truth's up to which a person may be that one (as in multiple object tracking, CLEAR MOT)."""


class Identities(NamedTuple):
    """Identities of P tracked people among G truths in T frames."""

    mota: float
    """1 less the share of misses, false positives and swaps in the people who are there (Bernardin & Stiefelhagen 2008)."""
    idf1: float
    """Share of the people's frames in which each is the person that they are most of the time (Ristani et al. 2016)."""
    misses: int
    false_positives: int
    swaps: int
    count_right: float
    """Share of the frames in which as many people are tracked as are there."""
    of: dict[int, int]
    """For each truth, counted from 0, the tracked person that it is most of the time, counted from 0."""


def identities(truth: Array, found: Array) -> Identities:
    """Identities from the places of truths (T, G, 2 or 3) and of tracked people (T, P, 2 or 3), metres; NaN where one is not there."""
    from scipy.optimize import linear_sum_assignment

    away = np.linalg.norm(truth[:, :, None] - found[:, None], axis=-1)
    near = np.nan_to_num(away, nan=np.inf) < REACH
    there, tracked = np.asarray(np.isfinite(truth).all(-1)), np.asarray(np.isfinite(found).all(-1))
    last, misses, swaps, matched = dict[int, int](), 0, 0, 0
    for t in range(len(truth)):
        now = {g: p for g, p in last.items() if near[t, g, p]}
        g_free = [g for g in np.flatnonzero(there[t]) if g not in now]
        p_free = [p for p in np.flatnonzero(tracked[t]) if p not in now.values()]
        cost = np.where(near[t][np.ix_(g_free, p_free)], away[t][np.ix_(g_free, p_free)], 1e6)
        for i, j in zip(*linear_sum_assignment(cost)):
            if cost[i, j] < REACH:
                g, p = int(g_free[i]), int(p_free[j])
                swaps += g in last and last[g] != p
                now[g] = p
        last |= now
        matched += len(now)
        misses += int(there[t].sum()) - len(now)
    false_positives = int(tracked.sum()) - matched
    both = near.sum(0)
    rows, columns = linear_sum_assignment(-both)
    of = {int(g): int(p) for g, p in zip(rows, columns) if both[g, p]}
    total = max(int(there.sum()), 1)
    idf1 = 2 * sum(int(both[g, p]) for g, p in of.items()) / max(int(there.sum() + tracked.sum()), 1)
    right = float((there.sum(1) == tracked.sum(1)).mean()) if len(truth) else np.nan
    return Identities(1 - (misses + false_positives + swaps) / total, idf1, misses, false_positives, swaps, right, of)


def measure_people(folder: str | Path, truths: Sequence[Path] = ()) -> dict[str, Any]:
    """Figures of a run of several people against truths, by default truth_1.csv, truth_2.csv, ... of its recording: `identities`, and the
    joint errors of each matched person. Raises a `ShadowPuppetError` for files that cannot be used."""
    folders = person_folders(folder)
    if not folders:
        raise FormatError(f"{folder}: found no people.csv and person-1, expected the run of several people")
    runs = {number: read_run(path) for number, path in folders.items()}
    paths = list(truths) or known_truths(folder)
    alone = {str(n): evaluate(run.motion, cameras=2) for n, run in runs.items()}
    measured: dict[str, Any] = {"run": str(folder), "people": len(runs), "person": alone}
    if not paths:
        return measured
    tables = [read_truth(path) for path in paths]
    times = tables[0].times
    begin, end = (next(iter(runs.values())).info.get(key) for key in ("begin", "end"))
    times = times[(times >= (begin or 0.0) - 1e-6) & (times < (np.inf if end is None else end) - 1e-6)]
    who = identities(np.stack([_places(table, times) for table in tables], 1),
                     np.stack([_tracked(run, times) for run in runs.values()], 1))  # fmt: skip
    numbers = list(runs)
    for g, p in who.of.items():
        truth = tables[g].between(begin or 0.0, np.inf if end is None else end)
        alone[str(numbers[p])] = evaluate(runs[numbers[p]].motion, truth, cameras=2) | {"truth": str(paths[g])}
    errors = [each["errors"]["mean_mm"] for each in alone.values() if "errors" in each]
    figures = {"mota": who.mota, "idf1": who.idf1, "misses": who.misses, "false_positives": who.false_positives, "swaps": who.swaps,
               "count_right": who.count_right, "frames": len(times)}
    return measured | {"identities": figures, "mean_mm": float(np.mean(errors)) if errors else None}


def known_truths(folder: str | Path) -> list[Path]:
    """truth_1.csv, truth_2.csv, ... of the recording that a run was made of; none if it is not there any more."""
    recording = read_toml(Path(folder) / "run.toml", ShadowPuppetError).get("recording")
    if not isinstance(recording, str) or not Path(recording).is_dir():
        return []
    found = sorted(Path(recording).glob("truth_[1-9]*.csv"), key=lambda path: (len(path.name), path.name))
    return [path for path in found if path.stem.removeprefix("truth_").isdigit()]


def _places(table: JointTable, times: Array) -> Array:
    """Places (T, 3) of the pelvis at times (T,)."""
    if "pelvis" not in table.names:
        raise ShadowPuppetError(f"truth: found no pelvis among {', '.join(table.names)}, expected one: by it people are matched")
    return at_times(table, times).positions[:, table.names.index("pelvis")]


def _tracked(run: Run, times: Array) -> Array:
    """Places (T, 3) of a person's pelvis at times (T,); NaN where they are lost or absent."""
    table = run.motion.table
    places = np.where(np.isin(run.motion.status, BLANK)[:, None], np.nan, table.positions[:, table.names.index("pelvis")])
    return at_times(JointTable(table.times, ("pelvis",), places[:, None]), times).positions[:, 0]
