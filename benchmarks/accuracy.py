"""The accuracy table: joint errors of the one-camera tracker on recordings with known truth, over many seeds.

    python benchmarks/accuracy.py RECORDING... [--seeds 20] [--rows default,liu2011] [--markdown FILE]

Every row is a choice of settings, the same for all recordings. Sizes come from the reference pictures and what recording.toml says;
no truth and, but for the rows that say so, no exact masks are used. For each seed the person is fitted anew. Errors are means over
both shoulders, elbows and hands (`metrics.UPPER_JOINTS`), in millimetres; `aligned` is over shoulders, elbows and wrists.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import smallest
from cases import COLUMNS, Case, means

from shadowpuppet.body.sizes import CardboxSizes
from shadowpuppet.body.upper_body import HAND_SHARE
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.pipeline.options import make_options

ROWS: dict[str, dict[str, Any]] = {
    "default": {},
    "default, exact masks": {"masks": True},
    "default, exact masks, true arms": {"masks": True, "true_arms": True},
    "default, forward only": {"tracker": {"both_ways": False}},
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


class Row:
    """A choice of settings."""

    def __init__(self, name: str) -> None:
        values = dict(ROWS[name])
        self.name = name
        self.references, self.true_arms = values.pop("references", True), values.pop("true_arms", False)
        self.silhouette = values.pop("silhouette", None)
        self.options = make_options(values)

    def case(self, path: Path) -> Case:
        """A recording as this row sees it."""
        return Case.read(path, masks=self.options.masks, references=self.references, silhouette=self.silhouette)

    def run(self, case: Case, seed: int) -> dict[str, float]:
        """Errors of one seed: the fit of the person and the tracking."""
        for_fit, for_track = np.random.default_rng(seed).spawn(2)
        person = case.person(self.options, for_fit)
        if self.true_arms:
            person = replace(person, sizes=_with_true_arms(person.sizes, case.truth))
        return case.track(person, self.options.tracker, for_track)


def _with_true_arms(sizes: CardboxSizes, truth: JointTable) -> CardboxSizes:
    """The sizes with the truth's shoulder distance, upper arm and forearm: what a perfect fit of the arms would be worth."""
    def apart(one: str, other: str) -> float:
        places = truth.select([one, other]).positions
        return float(np.nanmedian(np.linalg.norm(places[:, 0] - places[:, 1], axis=1)))

    half = apart("left_shoulder", "right_shoulder") / 2
    return sizes.with_values(shoulder_inset=sizes.shoulder_width / 2 - half, upper_arm_length=apart("left_shoulder", "left_elbow"),
                             forearm_length=apart("left_elbow", "left_hand") / HAND_SHARE)


def table(recordings: Sequence[Path], rows: Sequence[str], seeds: int) -> list[tuple[str, str, dict[str, float]]]:
    """Means over seeds for each recording and row."""
    out = []
    for row in map(Row, rows):
        for path in recordings:
            case = row.case(path)
            out.append((path.name, row.name, means([row.run(case, seed) for seed in range(seeds)])))
            print(markdown(out[-1:]).splitlines()[-1], flush=True)
    return out


def markdown(results: Sequence[tuple[str, str, dict[str, float]]]) -> str:
    """The results as a table."""
    lines = ["| recording | settings | " + " | ".join(COLUMNS) + " |", "|---" * (len(COLUMNS) + 2) + "|"]
    lines += [f"| {path} | {name} | " + " | ".join(f"{values[column]:.1f}" for column in COLUMNS) + " |" for path, name, values in results]
    return "\n".join(lines)


def _smallest(folder: Path) -> list[object]:
    rows = "default;liu2011, DRS, exact masks;default, exact masks, true arms"
    return [smallest.make(folder / "tiny"), "--seeds", 1, "--rows", rows, "--markdown", folder / "table.md"]


def main() -> None:
    """Parse, run, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("recordings", type=Path, nargs="+")
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--rows", default=";".join(ROWS), help="names, with ; between them: " + "; ".join(ROWS))
    parser.add_argument("--markdown", type=Path, help="write the table there too")
    args = smallest.parse(parser, _smallest)
    unknown = [row for row in args.rows.split(";") if row not in ROWS]
    if unknown:
        parser.error(f"unknown row {unknown[0]!r}; there are: {'; '.join(ROWS)}")
    results = table(args.recordings, args.rows.split(";"), args.seeds)
    if args.markdown:
        args.markdown.write_text(markdown(results) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
