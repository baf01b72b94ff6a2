"""What smoothing does: error, acceleration, peak speed and coverage as tracked and as smoothed, and limbs taken for the other side's.

    python benchmarks/smoothness.py [RECORDING ...] [--runs FOLDER] [--markdown FILE]

Without recordings, those of both proving grounds and of `TURNS`, in which people turn round or are first seen from behind; they are made
where they are missing, in build. Every recording is tracked once with the default settings, into --runs; a run folder that is there is
used as it is. Its raw.csv has what was tracked, joints.csv what was smoothed.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import smallest
from multiview import BUILD as RINGS
from multiview import made as made_rings
from proving_ground import HERE as GROUND
from proving_ground import made as made_ground

from shadowpuppet.evaluation.error_metrics import exchanges
from shadowpuppet.io.intervals import HALF_WIDTH
from shadowpuppet.io.motion.motion_files import read_truth
from shadowpuppet.io.motion.table import read_raw
from shadowpuppet.io.run import read_run
from shadowpuppet.motion.metrics import default_joints, jitter
from shadowpuppet.motion.motion import JointTable, Motion
from shadowpuppet.motion.synchronization import at_times
from shadowpuppet.pipeline.options import make_options
from shadowpuppet.pipeline.track import track_recording
from shadowpuppet.synthetic import Mannequin, Ring, Scene, Spec, Viewpoint, synthesize
from shadowpuppet.synthetic.spec_changes import parse_gestures
from shadowpuppet.tracking.smoothing.butterworth import filtered

BUILD = GROUND.parent / "turns"
FILTER = 10.0
"""Cut-off (Hz) of a filter of the truth, as motion capture has noise of its own."""
FASTEST = 0.02
"""Share of all joints' steps, the quickest, in which speeds are compared."""
TURNS = (
    # name, kind and seed of the body, gestures, cameras, whether the person is first seen from behind
    ("one_turns", "man", 31, "turn_around 3, turn_around 3", 1, False),
    ("one_wave_turn", "woman", 32, "wave_hands 3, turn_around 2.5, wave_hands 3, turn_around 2.5", 1, False),
    ("one_behind", "man", 33, "wave_hands 3, reach 4", 1, True),
    ("one_behind_turn", "woman", 34, "wave_hands 3, turn_around 3, reach 3", 1, True),
    ("four_turns", "man", 41, "walk 3, turn_around 3, wave_hands 2, turn_around 3", 4, False),
    ("three_behind", "woman", 42, "wave_hands 3, turn_around 3, random 3", 3, True),
    ("five_turns", "man", 43, "turn_around 2, turn_around 2, turn_around 2, turn_around 2", 5, False),
    ("four_behind_walk", "woman", 44, "walk 6", 4, True),
    ("held_a", "man", 61, "turn_around 2.5, wave_hands 2, turn_around 2.5", 1, False),
    ("held_b", "woman", 62, "turn_around 3.5, reach 2, turn_around 3", 1, False),
    ("held_c", "child", 63, "turn_around 3, turn_around 2.5", 1, False),
    ("held_d", "woman", 64, "reach 2, turn_around 3, turn_around 3", 1, True),
    ("held_e", "man", 65, "random 2, turn_around 2.5, turn_around 3.5", 1, False),
    ("fresh_a", "woman", 71, "turn_around 2.5, wave_hands 2, turn_around 3", 1, False),
    ("fresh_b", "man", 72, "wave_hands 2, turn_around 3, reach 2", 1, False),
    ("fresh_c", "man", 73, "turn_around 3.5, turn_around 2.5", 1, False),
    ("later_a", "man", 301, "turn_around 2.5, turn_around 2.5", 1, False),
    ("later_b", "woman", 302, "turn_around 2.5, reach 2, turn_around 2.5", 1, False),
    ("later_c", "child", 303, "wave_hands 2, turn_around 2.5", 1, False),
    ("later_d", "man", 304, "turn_around 2.4, turn_around 4", 1, False),
    ("two_turns", "man", 45, "turn_around 3, reach 3, turn_around 3", 2, False),
    ("three_walk", "man", 46, "walk 7", 3, False),
)


class Row(NamedTuple):
    """Figures of a recording; pairs are as tracked and as smoothed."""

    name: str
    cameras: int
    error: tuple[float, float]
    """Mean distance from the truth, millimetres."""
    acceleration: tuple[float, float, float]
    """Root mean square over the truth's; and smoothed over the truth's after `FILTER`."""
    speed: tuple[float, float]
    """Speed along the truth's in its quickest frames, over the truth's."""
    cover: tuple[float, float]
    """Share of the truth within the 90 % intervals."""
    swapped: tuple[float, float, float]
    """Share of frames in which limbs are exchanged, the greater of arms and legs; and the longest time when smoothed, seconds."""


def made_turns(folder: Path) -> Iterator[Path]:
    """Folders of the recordings of `TURNS`, made where they are missing."""
    for name, kind, seed, gestures, count, behind in TURNS:
        body = Mannequin.draw(np.random.default_rng(seed), kind)  # pyright: ignore[reportArgumentType]
        motion, scene, turn = parse_gestures(gestures), Scene(clothing=seed, room=seed), 180.0 * behind
        seen: dict[str, Any] = {"cameras": (Viewpoint(fov_deg=60, height=0.9 * body.stature, distance=2.2),), "seed": (7, seed)}
        if count > 1:
            ring = Ring(count=count, radius=4.2, jitter=0.4, seed=seed, size=(320, 240), fov_deg=55)
            seen = {"ring": ring, "rate": 30, "seed": (8, seed)}
        spec = Spec(name=name, body=body, motion=motion, scene=scene, turn_deg=turn, **seen)
        if not (folder / name / "made").exists():
            synthesize(spec, folder / name)
            (folder / name / "made").touch()
        yield folder / name


def measured(recording: Path, run: Path) -> Row:
    """Figures of a recording, tracked into a run folder unless it is there."""
    if not (run / "raw.csv").exists():
        behind = any(name == recording.name and seen for name, *_, seen in TURNS)
        track_recording(recording, run, make_options({"facing": "away" if behind else "camera", "seed": 1}))
    smooth = read_run(run).motion
    raw = read_raw(run / "raw.csv", smooth.body_name)
    truth = at_times(read_truth(recording / "truth.csv"), raw.times)
    names = default_joints(raw.table, truth)
    both, wanted = [each.table.select(names) for each in (raw, smooth)], truth.select(names)
    wanted = JointTable(wanted.times, names, np.where(np.isfinite(both[0].positions), wanted.positions, np.nan))
    shaken, steady = jitter(wanted), jitter(_filtered(wanted))
    swapped = [exchanges(each.table, truth) or {} for each in (raw, smooth)]
    longest = max((pair["longest_s"] for pair in swapped[1].values()), default=0.0)
    return Row(recording.name, len(list((recording / "video").iterdir())),
               _pair([float(1000 * np.nanmean(np.linalg.norm(each.positions - wanted.positions, axis=2))) for each in both]),
               (*_pair([jitter(each) / shaken for each in both]), jitter(both[1]) / steady),
               _pair([_speed(each, wanted) for each in both]), _pair([_cover(each, truth) for each in (raw, smooth)]),
               (*_pair([max((pair["share"] for pair in each.values()), default=0.0) for each in swapped]), longest))


def _pair(values: Sequence[float]) -> tuple[float, float]:
    return values[0], values[1]


def _filtered(table: JointTable) -> JointTable:
    """The table without frequencies that the rate allows above `FILTER`."""
    cutoff = min(FILTER, 0.45 / float(np.median(np.diff(table.times))))
    return JointTable(table.times, table.names, filtered(table.times, table.positions, cutoff))


def _speed(run: JointTable, truth: JointTable) -> float:
    ours, theirs = (np.diff(each.positions, axis=0) for each in (run, truth))
    length = np.linalg.norm(theirs, axis=2)
    quick = (length >= np.nanquantile(length, 1 - FASTEST)) & (length > 0)
    return float(np.nanmean((ours * theirs).sum(2)[quick] / length[quick]) / np.nanmean(length[quick]))


def _cover(motion: Motion, truth: JointTable) -> float:
    names = [name for name in motion.joint_names if name in truth.names]
    off = motion.joints[:, [motion.joint_names.index(name) for name in names]] - truth.select(names).positions
    sd = motion.joint_sd[:, [motion.joint_names.index(name) for name in names]]
    known = np.isfinite(off) & np.isfinite(sd)
    return float((np.abs(off[known]) <= HALF_WIDTH * sd[known]).mean())


def markdown(rows: Sequence[Row]) -> str:
    """The table."""
    head = ["recording", "cameras", "error, mm", "acceleration / truth's", "after 10 Hz", "peak speed / truth's", "within 90 %",
            "exchanged"]
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    for row in rows:
        first, second = (f"{100 * share:.1f}" for share in row.swapped[:2])
        swaps = "0" if row.swapped[:2] == (0, 0) else f"{first} → {second} %, {row.swapped[2]:.1f} s at most"
        cells = [row.name.replace("_", " "), str(row.cameras), f"{row.error[0]:.1f} → {row.error[1]:.1f}",
                 f"{row.acceleration[0]:.1f} → {row.acceleration[1]:.2f}", f"{row.acceleration[2]:.2f}",
                 f"{row.speed[0]:.2f} → {row.speed[1]:.2f}", f"{100 * row.cover[0]:.0f} → {100 * row.cover[1]:.0f} %", swaps]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def arguments(about: str) -> argparse.Namespace:
    """What a script on recordings and their runs was given: `recordings`, `runs` and `markdown`; `about`: the script's docstring."""
    parser = argparse.ArgumentParser(description=about.splitlines()[0])
    parser.add_argument("recordings", nargs="*", type=Path)
    parser.add_argument("--runs", type=Path, default=GROUND.parent / "smoothness")
    parser.add_argument("--markdown", type=Path)
    return smallest.parse(parser, _smallest)


def _smallest(folder: Path) -> list[object]:
    recording = smallest.make(folder / "one")
    return [recording, "--runs", folder / "runs", "--markdown", folder / "table.md"]


def main() -> None:
    """Measure, print and write the table."""
    given = arguments(__doc__ or "")
    recordings = given.recordings or [*made_ground(GROUND), *made_rings(RINGS), *made_turns(BUILD)]
    rows = []
    for recording in recordings:
        rows.append(measured(recording, given.runs / recording.name))
        print(markdown(rows[-1:]).splitlines()[-1], flush=True)
    if given.markdown:
        given.markdown.write_text(markdown(rows), "utf-8")


if __name__ == "__main__":
    main()
