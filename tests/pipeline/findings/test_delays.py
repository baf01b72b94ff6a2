"""Films that do not begin together are named before a run, where the delay is certain and over a frame."""

from __future__ import annotations

import re

import made_rig
import pytest

from shadowpuppet.errors import HARMFUL
from shadowpuppet.pipeline.findings import delays
from shadowpuppet.pipeline.findings.delays import delay_cautions
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.rig import open_rig
from shadowpuppet.pipeline.silhouettes import Silhouettes

MASKS = Options(masks=True)


@pytest.fixture(scope="module")
def seen(cameras):
    return made_rig.masks(cameras, 60)


def said(rig):
    return delay_cautions(rig, [Silhouettes("made", None)] * len(rig.cameras), ready=True)


def names(cautions):
    return [re.search(r"begin together \((.*?)\): `shadowpuppet check --fix`", str(each))[1] for each in cautions]


@pytest.mark.parametrize(("late", "found"), [((0, 0, 0, 0), []), ((0, 0, 2, 0), ["cam3 2.0 frames late"]), ((0, 1, 0, 0), [])])
def test_a_film_that_is_late_by_over_a_frame_is_named(tmp_path, cameras, seen, late, found):
    cautions = said(open_rig(made_rig.write(tmp_path / "r", cameras, made_rig.shifted(seen, late)), MASKS))
    assert names(cautions) == found
    assert all(each.severity == HARMFUL for each in cautions)


def test_films_shorter_than_what_is_read_tell_nothing(rig_recording, monkeypatch):
    monkeypatch.setattr(delays, "_middle", None)
    assert said(open_rig(rig_recording, MASKS)) == []
