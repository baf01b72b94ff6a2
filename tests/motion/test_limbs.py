"""Limbs in words, as captions and reasons have them."""

from __future__ import annotations

import pytest

from shadowpuppet.motion.limbs import LIMBS, limbs_in_words, status_in_words

JOINTS = ("neck", "left_elbow", "right_elbow", "left_knee", "right_knee")


@pytest.mark.parametrize(("limbs", "words"), [
    ((), ""), (("left_arm",), "left arm"), (("right_leg",), "right leg"), (("left_arm", "right_arm"), "both arms"),
    (("trunk", "right_arm", "left_leg", "right_leg"), "trunk, right arm, both legs"), (LIMBS, "trunk, both arms, both legs")])
def test_left_and_right_are_named_together(limbs, words):
    assert limbs_in_words(limbs) == words


def test_a_status_names_doubtful_limbs():
    statuses = ("tracked", "uncertain", "predicted", "tracked", "uncertain")
    assert status_in_words("tracked", JOINTS, statuses) == "tracked, both arms, right leg doubtful"
    assert status_in_words("tracked", JOINTS, ("tracked",) * 5) == status_in_words("tracked", JOINTS, None) == "tracked"
