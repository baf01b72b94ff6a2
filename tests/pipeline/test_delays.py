"""Films that do not begin together are named before a run, where the delay is certain and over a frame."""

from __future__ import annotations

import re

import made_rig
import pytest

from shadowpuppet.errors import HARMFUL
from shadowpuppet.pipeline.look import FirstSeconds
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.rig import open_rig
from shadowpuppet.pipeline.silhouettes import Silhouettes
from shadowpuppet.pipeline.survey.delays import delay_cautions

MASKS = Options(masks=True)


@pytest.fixture(scope="module")
def seen(cameras):
    return made_rig.masks(cameras, 60)


def said(rig, first=()):
    return delay_cautions(rig, [Silhouettes("made", None)] * len(rig.cameras), FirstSeconds([], first), ready=True)


def names(cautions):
    return [re.search(r"begin together \((.*?)\): `shadowpuppet check --fix`", str(each))[1] for each in cautions]


@pytest.mark.parametrize(("late", "found"), [((0, 0, 0, 0), []), ((0, 0, 2, 0), ["cam3 2.0 frames late"])])
def test_a_late_film_is_named_from_the_middle_of_the_films(tmp_path, cameras, seen, late, found):
    """At first the person stands still: these sets tell nothing."""
    rig = open_rig(made_rig.write(tmp_path / "r", cameras, made_rig.shifted(seen, late)), MASKS)
    cautions = said(rig, [tuple(seen[0])] * 30)
    assert names(cautions) == found
    assert all(each.weight == HARMFUL for each in cautions)


def test_a_late_film_is_named_from_the_first_seconds(rig_recording, seen):
    first = [tuple(seen[5 + n - 2 * (k == 1)][k] for k in range(4)) for n in range(45)]
    assert names(said(open_rig(rig_recording, MASKS), first)) == ["cam2 2.0 frames late"]


@pytest.mark.parametrize(("late", "found"), [(1, []), (2, ["cam2 2.0 frames late"])])
def test_a_delay_of_one_frame_is_borne(rig_recording, seen, late, found):
    first = [tuple(seen[5 + n - late * (k == 1)][k] for k in range(4)) for n in range(45)]
    assert names(said(open_rig(rig_recording, MASKS), first)) == found
