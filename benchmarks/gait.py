"""Figures of a gait, of a run beside those of a truth: python benchmarks/gait.py RUN/joints.csv TRUTH

Of the ankles of both, since a truth seldom has heels; the run's contacts tell which stances there are.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
import smallest

from shadowpuppet.body.skeleton import SIDES
from shadowpuppet.evaluation.movement.gait_figures import GaitParameter, gait_figures
from shadowpuppet.io.motion.motion_files import read_truth
from shadowpuppet.motion.contact.contact import Contacts, contacts_of
from shadowpuppet.motion.contact.steps import find_gait
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.motion.synchronization import at_times


def figures(table: JointTable, contacts: Contacts) -> list[GaitParameter]:
    """Figures of a gait with ankles in place of heels."""
    ankles = [f"{side}_ankle" for side in SIDES]
    positions = table.select(["pelvis", *ankles]).positions
    names = ("pelvis", *ankles, *(f"{side}_heel" for side in SIDES))
    return gait_figures(find_gait(table.times, contacts, names, np.concatenate([positions, positions[:, 1:]], 1)))


def _smallest(folder: Path) -> list[object]:
    truth = smallest.make(folder / "ring", smallest.RING) / "truth.csv"
    return [truth, truth]


def main() -> None:
    """Print the figures side by side."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("run", type=Path)
    parser.add_argument("truth", type=Path)
    args = smallest.parse(parser, _smallest)
    run, truth = read_truth(args.run), read_truth(args.truth)
    contacts = contacts_of(run)
    if contacts is None:
        sys.exit(f"{args.run}: found no contacts of feet")
    print(f"{'':22}{'run: left, right, both':32}truth: left, right, both")
    for ours, theirs in zip(figures(run, contacts), figures(at_times(truth, run.times), contacts)):
        cells = ["".join(f"{each.mean:9.3f}" for each in (of.left, of.right, of.both)) for of in (ours, theirs)]
        print(f"{ours.name + ', ' + ours.unit:18}{cells[0]}     {cells[1]}")


if __name__ == "__main__":
    main()
