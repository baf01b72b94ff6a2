"""Neck and pelvis of files without them."""

from __future__ import annotations

import numpy as np
import pytest

from shadowpuppet.motion.motion import JointTable
from shadowpuppet.viewer.scene.figures import _with_midpoints

NAMES = ("left_shoulder", "right_shoulder", "left_hip", "right_hip")


def table(names=NAMES) -> JointTable:
    return JointTable(np.arange(3.0), names, np.random.default_rng(0).normal(size=(3, len(names), 3)))


def test_they_lie_between_shoulders_and_between_hips():
    given = table()
    found = _with_midpoints(given)
    assert found.names == (*NAMES, "neck", "pelvis")
    np.testing.assert_array_equal(found.positions[:, :4], given.positions)
    np.testing.assert_allclose(found.select(["neck", "pelvis"]).positions,
                               [[(p[0] + p[1]) / 2, (p[2] + p[3]) / 2] for p in given.positions])  # fmt: skip


@pytest.mark.parametrize("names", [(*NAMES, "neck", "pelvis"), NAMES[1:2] + NAMES[3:], ("head",)])
def test_what_is_there_stays_and_what_cannot_be_known_is_not_made_up(names):
    given = table(names)
    found = _with_midpoints(given)
    assert found.names == names
    np.testing.assert_array_equal(found.positions, given.positions)
