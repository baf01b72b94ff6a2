"""Sentences of the summary: which limbs are doubtful."""

from __future__ import annotations

import pytest

from shadowpuppet.evaluation.summary_text import doubt_text

SURE = {"tracked": 990, "absent": 10}


@pytest.mark.parametrize(("limbs", "said"), [
    ({"trunk": SURE, "left_arm": SURE}, "no limb doubtful"),
    ({"trunk": SURE, "left_arm": {"tracked": 871, "uncertain": 100, "predicted": 19, "absent": 10}}, "left arm doubtful in 12 %"),
    ({"left_arm": {"tracked": 871, "uncertain": 119, "absent": 10}, "right_arm": {"tracked": 851, "predicted": 139, "lost": 10},
      "left_leg": {"tracked": 995, "uncertain": 5}}, "left arm doubtful in 12 %, right arm in 14 %, left leg in under 1 %"),
    ({"left_arm": {"absent": 1000}}, "no limb doubtful"),
])
def test_the_summary_names_doubtful_limbs_and_their_share_of_the_frames_with_a_place(limbs, said):
    metrics = {"frames": 1000, "status": {"tracked": 981, "uncertain": 9, "absent": 10}, "limb_status": limbs}
    assert doubt_text(metrics) == said


def test_nothing_is_said_of_a_run_without_frames_or_statuses():
    assert doubt_text({"frames": 0, "status": {}, "limb_status": {"trunk": {}}}) is None
    assert doubt_text({"frames": 3, "status": {"tracked": 3}}) is None
