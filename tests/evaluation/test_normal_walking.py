"""Bands of normal walking: signs and sides as in the angles of a walk."""

from __future__ import annotations

import numpy as np
import pytest
from walkers import walking

from shadowpuppet.body.skeleton import SIDES
from shadowpuppet.evaluation.movement.angles import Cycle
from shadowpuppet.evaluation.movement.gait_figures import gait_figures
from shadowpuppet.evaluation.movement.movement import Movement
from shadowpuppet.evaluation.movement.normal_walking import PHASES, SOURCES, normal_walking
from shadowpuppet.motion.contact.contact import contacts_of
from shadowpuppet.motion.contact.steps import find_gait


@pytest.fixture(scope="module")
def walk():
    """The gait of a made walk, and a function that gives a point over the cycles of a foot."""
    _, table = walking(seconds=6.0)
    contacts = contacts_of(table)
    gait = find_gait(table.times, contacts, table.names, table.positions, np.full_like(table.positions, 0.01))

    def over(series, side):
        at = [stride.begin + PHASES * stride.seconds for stride in gait.strides if stride.side == side]
        return np.mean([np.interp(each, table.times, series) for each in at], 0)

    return gait, {name: table.positions[:, n] for n, name in enumerate(table.names)}, over


@pytest.mark.parametrize("side", SIDES)
def test_pelvis_and_knee_turn_as_those_of_a_walk(walk, side):
    _, joint, over = walk
    across = joint["left_hip"] - joint["right_hip"]
    way = np.gradient(joint["pelvis"][:, :2], axis=0)
    left = np.stack([-way[:, 1], way[:, 0]], axis=1) / np.linalg.norm(way, axis=1, keepdims=True)
    forward = way / np.linalg.norm(way, axis=1, keepdims=True)
    thigh, shank = (joint[f"{side}_{a}"] - joint[f"{side}_{b}"] for a, b in (("hip", "knee"), ("knee", "ankle")))
    cosine = (thigh * shank).sum(1) / np.linalg.norm(thigh, axis=1) / np.linalg.norm(shank, axis=1)
    measured = {
        "pelvis list": np.arctan2(across[:, 2], np.linalg.norm(across[:, :2], axis=1)),  # down on the right
        "pelvis rotation": -np.arctan2((across[:, :2] * forward).sum(1), (across[:, :2] * left).sum(1)),  # right hip ahead
        "knee angle": np.arccos(cosine),
    }
    for name, series in measured.items():
        normal = normal_walking(name, side)
        assert normal is not None
        assert np.corrcoef(over(series, side), normal.mean)[0, 1] > 0.9, name


def test_angles_that_the_source_does_not_have_have_no_band():
    assert normal_walking("elbow flex", "left") is None
    for name in SOURCES:
        for side in SIDES:
            mean, sd = normal_walking(name, side)
            assert mean.shape == sd.shape == (101,)
            assert (sd > 1).all()
            assert mean[0] == pytest.approx(mean[-1])


def test_a_run_is_not_compared_with_walking(walk):
    gait, _, _ = walk
    figures = gait_figures(gait)
    cycle = Cycle("knee angle", "left", 3, *np.zeros((3, 101)))
    assert Movement(gait, "", figures, [cycle], []).normal(cycle) is not None
    running = [each._replace(both=each.both._replace(mean=35.0)) if each.name == "stance" else each for each in figures]
    assert Movement(gait, "", running, [cycle], []).normal(cycle) is None
