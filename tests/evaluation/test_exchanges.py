"""Limbs taken for those of the other side: counted by pair, with the longest time."""

from __future__ import annotations

import numpy as np

from shadowpuppet.evaluation.error_metrics import exchanges
from shadowpuppet.evaluation.summary_text import exchanges_text
from shadowpuppet.motion.motion import JointTable

NAMES = tuple(f"{side}_{joint}" for joint in ("elbow", "wrist", "hand", "knee", "ankle") for side in ("left", "right"))


def table(rng, frames: int = 40, names=NAMES) -> JointTable:
    sides = np.array([0.3 if name.startswith("left") else -0.3 for name in names])
    places = rng.normal(0, 0.02, (frames, len(names), 3))
    places[..., 1] += sides
    return JointTable(np.arange(frames) / 20, names, places)


def exchanged(given: JointTable, frames: slice, *joints: str) -> JointTable:
    places = given.positions.copy()
    for joint in joints:
        left, right = (given.names.index(f"{side}_{joint}") for side in ("left", "right"))
        places[frames, left], places[frames, right] = given.positions[frames, right], given.positions[frames, left]
    return JointTable(given.times, given.names, places)


def test_exchanged_limbs_are_counted_by_pair(rng):
    truth = table(rng)
    run = exchanged(exchanged(truth, slice(10, 16), "elbow", "wrist", "hand"), slice(0, 2), "knee", "ankle")
    found = exchanges(run, truth)
    assert found == {"arms": {"frames": 6, "share": 0.15, "longest_s": 0.3}, "legs": {"frames": 2, "share": 0.05, "longest_s": 0.1}}
    assert exchanges_text(found) == "arms in 15 % of the frames, for 0.30 s at most; legs in 5 % of the frames, for 0.10 s at most"


def test_a_hand_stands_for_a_missing_wrist_and_limbs_may_be_missing(rng):
    truth = table(rng)
    few = ("left_elbow", "right_elbow", "left_hand", "right_hand")
    run = exchanged(truth, slice(0, 4), "elbow", "hand").select(few)
    assert exchanges(run, truth) == {"arms": {"frames": 4, "share": 0.1, "longest_s": 0.2}}
    assert exchanges(truth.select(("left_elbow",)), truth) is None
    assert exchanges_text(None) is None
    assert exchanges_text(exchanges(truth, truth)) == "never"


def test_unknown_frames_do_not_count(rng):
    truth = table(rng)
    run = exchanged(truth, slice(0, 40), "elbow", "wrist")
    run.positions[20:] = np.nan
    assert exchanges(run, truth)["arms"] == {"frames": 20, "share": 1.0, "longest_s": 1.0}


def test_limbs_as_near_to_one_side_as_to_the_other_are_not_exchanged(rng):
    truth = table(rng)
    turned = exchanged(truth, slice(0, 40), "elbow", "wrist", "knee", "ankle")
    middle = JointTable(truth.times, NAMES, (truth.positions + turned.positions) / 2)
    assert exchanges_text(exchanges(middle, truth)) == "never"
