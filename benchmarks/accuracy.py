"""The accuracy table: joint errors of the one-camera tracker on recordings with known truth, over many seeds.

    python benchmarks/accuracy.py RECORDING... [--seeds 20] [--rows default,liu2011] [--markdown FILE]

Every row is a choice of settings, the same for all recordings. Sizes come from the reference pictures and what recording.toml says;
no truth and, but for the rows that say so, no exact masks are used. For each seed the person is fitted anew (with plain masks, which
show no posture, on the default ones). Errors are means over both
shoulders, elbows and hands (`metrics.UPPER`), in millimetres; `aligned` is over shoulders, elbows and wrists.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from shadowpuppet.body import HAND_SHARE
from shadowpuppet.fitting import find
from shadowpuppet.footage import silhouettes, take_sample
from shadowpuppet.io.joints import read_joints
from shadowpuppet.look import prepare
from shadowpuppet.metrics import UPPER, joint_errors
from shadowpuppet.motion import JointTable
from shadowpuppet.options import Options, make_options
from shadowpuppet.sizes import CardboxSizes
from shadowpuppet.tracking import MonocularTracker

ALIGNED = [name.replace("hand", "wrist") for name in UPPER]
ROWS: dict[str, dict[str, Any]] = {
    "default": {},
    "default, exact masks": {"masks": True},
    "default, exact masks, true arms": {"masks": True, "true_arms": True},
    "default, cardbox": {"tracker": {"body": "cardbox"}},
    "default, plain masks (eq. 1)": {"silhouette": {"method": "averaging"}},
    "default, no references": {"references": False},
    "liu2011, DRS": {"preset": "liu2011"},
    "liu2011, SRS": {"preset": "liu2011", "tracker": {"resampling": "stratified"}},
    "liu2011, DRS, exact masks": {"preset": "liu2011", "masks": True},
    "liu2011, SRS, exact masks": {"preset": "liu2011", "tracker": {"resampling": "stratified"}, "masks": True},
    "liu2011, DRS, plain masks (eq. 1)": {"preset": "liu2011", "silhouette": {"method": "averaging"}},
    "liu2011, SRS, plain masks (eq. 1)": {"preset": "liu2011", "tracker": {"resampling": "stratified"},
                                          "silhouette": {"method": "averaging"}},
}
COLUMNS = ("mean", "sd", "plane", "depth", "far", "aligned", "shoulder", "elbow", "hand", "cost", "jitter", "ms")


class Case:
    """A recording under some settings, read and segmented once."""

    def __init__(self, path: Path, row: dict[str, Any]) -> None:
        values = dict(row)
        self.references, self.true_arms = values.pop("references", True), values.pop("true_arms", False)
        plain = make_options({"silhouette": values.pop("silhouette", {})})
        self.options: Options = make_options(values)
        prepared = prepare(str(path), self.options, np.random.default_rng(0))
        self.footage, self.seen = prepared.footage, prepared.silhouettes
        if not self.references:
            self.footage = _without_references(self.footage)
        self.sample = take_sample(self.footage)
        seen = self.seen if plain.silhouette == self.options.silhouette else silhouettes(self.footage, self.sample, plain)
        shots = list(self.footage.shots(self.options.masks))
        self.times, self.masks = np.array([shot.time for shot in shots]), [seen(shot) for shot in shots]
        if self.footage.recording.truth is None:
            raise SystemExit(f"{path}: no truth")
        self.truth = read_joints(self.footage.recording.truth)

    def run(self, seed: int) -> dict[str, float]:
        """Errors of one seed: the fit of the person and the tracking."""
        for_fit, for_track = np.random.default_rng(seed).spawn(2)
        guess = find(self.footage, self.sample, self.seen, self.options, for_fit).fit.guess
        if self.true_arms:
            guess = replace(guess, sizes=_with_true_arms(guess.sizes, self.truth))
        picture = guess.picture(self.footage.camera, self.options.tracker.body)
        tracker = MonocularTracker(picture, self.options.tracker)
        states = [tracker.start(for_track, self.masks[0])]
        start = time.perf_counter()
        for mask in self.masks[1:]:
            states.append(tracker.step(for_track, states[-1], mask))
        spent = time.perf_counter() - start
        joints = picture.points_world(np.array([state.pose for state in states]))
        table = JointTable(self.times, picture.body.landmark_names, joints)
        errors = joint_errors(table, self.truth, UPPER, camera=self.footage.camera).summary()
        aligned = joint_errors(table, self.truth, ALIGNED, camera=self.footage.camera).summary()
        per = {part: float(np.mean([errors["joints"][f"{side}_{part}"]["mean_mm"] for side in ("left", "right")]))
               for part in ("shoulder", "elbow", "hand")}
        hands = joints[:, [picture.body.landmark_names.index(f"{side}_hand") for side in ("left", "right")]]
        pace = float(np.median(np.diff(self.times)))
        jitter = float(np.sqrt((np.linalg.norm(np.diff(hands, 2, axis=0), axis=2) ** 2).mean()) / pace**2)
        return per | {"mean": errors["mean_mm"], "plane": errors["plane_mm"], "depth": errors["depth_mm"], "far": 100 * errors["far"],
                      "aligned": aligned["aligned_mean_mm"], "cost": float(np.mean([state.cost for state in states])),
                      "jitter": jitter, "ms": 1000 * spent / len(states)}


def _with_true_arms(sizes: CardboxSizes, truth: JointTable) -> CardboxSizes:
    """The sizes with the truth's shoulder distance, upper arm and forearm: what a perfect fit of the arms would be worth."""
    def apart(one: str, other: str) -> float:
        places = truth.select([one, other]).positions
        return float(np.nanmedian(np.linalg.norm(places[:, 0] - places[:, 1], axis=1)))

    half = apart("left_shoulder", "right_shoulder") / 2
    return sizes.with_values(shoulder_inset=sizes.shoulder_width / 2 - half, upper_arm_length=apart("left_shoulder", "left_elbow"),
                             forearm_length=apart("left_elbow", "left_hand") / HAND_SHARE)


def _without_references(footage: Any) -> Any:
    return replace(footage, recording=replace(footage.recording, references=()))


def table(recordings: Sequence[Path], rows: Sequence[str], seeds: int) -> list[tuple[str, str, dict[str, float]]]:
    """Means over seeds for each recording and row; `sd` is the standard deviation of the mean error over seeds."""
    out = []
    for name in rows:
        for path in recordings:
            case = Case(path, ROWS[name])
            runs = [case.run(seed) for seed in range(seeds)]
            means = {key: float(np.mean([run[key] for run in runs])) for key in runs[0]}
            out.append((path.name, name, means | {"sd": float(np.std([run["mean"] for run in runs]))}))
            print(markdown(out[-1:]).splitlines()[-1], flush=True)
    return out


def markdown(results: Sequence[tuple[str, str, dict[str, float]]]) -> str:
    """The results as a table."""
    lines = ["| recording | settings | " + " | ".join(COLUMNS) + " |", "|---" * (len(COLUMNS) + 2) + "|"]
    lines += [f"| {path} | {name} | " + " | ".join(f"{values[column]:.1f}" for column in COLUMNS) + " |" for path, name, values in results]
    return "\n".join(lines)


def main() -> None:
    """Parse, run, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("recordings", type=Path, nargs="+")
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--rows", default=";".join(ROWS), help="names, with ; between them: " + "; ".join(ROWS))
    parser.add_argument("--markdown", type=Path, help="write the table there too")
    args = parser.parse_args()
    unknown = [row for row in args.rows.split(";") if row not in ROWS]
    if unknown:
        parser.error(f"unknown row {unknown[0]!r}; there are: {'; '.join(ROWS)}")
    results = table(args.recordings, args.rows.split(";"), args.seeds)
    if args.markdown:
        args.markdown.write_text(markdown(results) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
