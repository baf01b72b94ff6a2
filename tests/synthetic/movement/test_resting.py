"""Seated, kneeling and lying people, and sitting down: on the chair and on the floor, with nothing of the body below it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shadowpuppet.synthetic import Gesture, Mannequin, Spec
from shadowpuppet.synthetic.movement.resting import LYING_GESTURES, seat_height
from shadowpuppet.synthetic.person.clothes import Clothes
from shadowpuppet.synthetic.person.kinematics import SEGMENTS, PosedBody
from shadowpuppet.synthetic.person.mannequin import JOINTS
from shadowpuppet.synthetic.recording import feet_of, perform
from shadowpuppet.synthetic.scene_renderer import dressed

bodies = st.builds(lambda seed, kind: Mannequin.draw(np.random.default_rng(seed), kind), st.integers(0, 500),
                   st.sampled_from(["woman", "man", "child"]))  # fmt: skip


def lowest(body: Mannequin, figure: PosedBody) -> dict[str, float]:
    """The lowest height of each segment's surface over all times, metres."""
    s, around = dressed(body, Clothes.draw(np.random.default_rng(3))), np.linspace(0, 2 * np.pi, 16)
    found = dict.fromkeys(SEGMENTS, 9.0)
    for p, segment in enumerate(s.segment):
        wide, deep, x, y = s.table[p].T
        ring = np.stack([x[:, None] + wide[:, None] * np.cos(around), y[:, None] + deep[:, None] * np.sin(around),
                         np.linspace(0, s.length[p], len(x))[:, None] + 0 * around], -1).reshape(-1, 3)
        points = ring @ s.frame[p].T + s.start[p]
        high = (figure.rotation[:, segment, 2] @ points.T) + figure.origin[:, segment, 2:]
        found[SEGMENTS[segment]] = min(found[SEGMENTS[segment]], float(high.min()))
    return found


def resting(body: Mannequin, posture, motion: str = "stand", turn: float = 0.0) -> PosedBody:
    return perform(Spec(body=body, posture=posture, motion=(Gesture(motion=motion, seconds=3),), rate=5, turn_deg=turn),
                   np.random.default_rng(1))[1]


@given(body=bodies, posture=st.sampled_from(["seated", "kneeling", "lying"]), motion=st.sampled_from(LYING_GESTURES),
       turn=st.floats(-180, 180))
@settings(max_examples=25, deadline=None)
def test_nothing_of_a_resting_person_is_below_the_floor(body, posture, motion, turn):
    figure = resting(body, posture, motion, turn)
    low = lowest(body, figure)
    assert min(low.values()) > -0.025
    touching = {"seated": ("left_foot", "right_foot"), "kneeling": ("left_shank", "right_shank", "left_foot", "right_foot"),
                "lying": ("pelvis", "thorax", "left_foot", "right_foot")}[posture]
    assert max(low[name] for name in touching) < 0.04
    np.testing.assert_allclose(figure.joints[:, JOINTS.index("pelvis"), :2], 0, atol=1e-9)
    length = np.linalg.norm(figure.joints[:, JOINTS.index("left_knee")] - figure.joints[:, JOINTS.index("left_hip")], axis=1)
    np.testing.assert_allclose(length, body.length("thigh"), atol=1e-9)
    shank = np.linalg.norm(figure.joints[:, JOINTS.index("left_ankle")] - figure.joints[:, JOINTS.index("left_knee")], axis=1)
    np.testing.assert_allclose(shank, body.length("shank"), atol=1e-9)


@given(body=bodies)
@settings(max_examples=15, deadline=None)
def test_a_seated_person_touches_the_seat_with_bent_knees_over_the_feet(body):
    figure = resting(body, "seated")
    low, joint = lowest(body, figure), {name: figure.joints[0, n] for n, name in enumerate(JOINTS)}
    assert abs(low["pelvis"] - seat_height(body)) < 0.05
    thigh, shank = joint["left_hip"] - joint["left_knee"], joint["left_ankle"] - joint["left_knee"]
    bend = np.degrees(np.arccos(thigh @ shank / np.linalg.norm(thigh) / np.linalg.norm(shank)))
    assert 75 < bend < 115
    assert seat_height(body) <= 0.47


def test_a_lying_person_lies_on_the_back_with_the_feet_where_they_looked():
    joint = {name: resting(Mannequin(), "lying").joints[0, n] for n, name in enumerate(JOINTS)}
    assert joint["head"][1] > 0.4 > -0.6 > joint["left_ankle"][1]
    assert joint["left_shoulder"][0] > 0.1 > -0.1 > joint["right_shoulder"][0]
    assert max(p[2] for p in joint.values()) < 0.3


def test_hands_lie_on_the_thighs_and_leave_them_to_wave():
    still, waving = resting(Mannequin(), "seated"), resting(Mannequin(), "seated", "wave_hands")
    hand, knee, hip = (still.joints[0, JOINTS.index(f"left_{name}")] for name in ("hand", "knee", "hip"))
    along = np.clip((hand - hip) @ (knee - hip) / ((knee - hip) @ (knee - hip)), 0, 1)
    assert along > 0.4
    assert np.linalg.norm(hand - hip - along * (knee - hip)) < 0.16
    up = perform(Spec(motion=(Gesture(motion="wave_hands", seconds=3),), rate=5), np.random.default_rng(1))[1]
    mid = len(up.joints) // 2
    arm = [fig.joints[mid, JOINTS.index("left_wrist")] - fig.joints[mid, JOINTS.index("left_elbow")] for fig in (waving, up)]
    assert np.linalg.norm(arm[0] - arm[1]) < 0.06  # the same wave as in standing


@pytest.mark.parametrize("kind", ["woman", "child"])
def test_kneeling_down_ends_on_the_knees_with_the_tips_of_the_toes_in_place(kind):
    spec = Spec(body=Mannequin.draw(np.random.default_rng(8), kind), motion=(Gesture(motion="kneel", seconds=5),), rate=10)
    times, figure = perform(spec, np.random.default_rng(1))
    low = lowest(spec.body, figure)
    assert min(low.values()) > -0.02
    assert low["left_shank"] < 0.02
    feet = feet_of(spec, times, figure, np.random.default_rng(1))
    kneels = figure.joints[:, 0, 2].argmin()
    assert feet.contact[0].all()
    assert not feet.contact[kneels, [0, 2]].any()
    assert np.ptp(feet.points[:, [1, 3], :2], axis=0).max() < 0.06
    assert figure.joints[-1, 0, 2] > figure.joints[kneels, 0, 2] + 0.25


@pytest.mark.parametrize("kind", ["man", "child"])
def test_sitting_down_ends_on_the_seat_with_the_feet_in_place(kind):
    body = Mannequin.draw(np.random.default_rng(8), kind)
    figure = perform(Spec(body=body, motion=(Gesture(motion="sit_down", seconds=5),), rate=10), np.random.default_rng(1))[1]
    low = lowest(body, figure)
    assert abs(low["pelvis"] - seat_height(body)) < 0.05
    assert min(low.values()) > -0.01
    ankles = figure.joints[:, [JOINTS.index("left_ankle"), JOINTS.index("right_ankle")]]
    assert np.ptp(ankles, axis=0).max() < 0.002
    assert figure.joints[-1, 0, 2] > figure.joints[:, 0, 2].min() + 0.2
