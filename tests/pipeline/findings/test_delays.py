"""Films that do not begin together are named before a run, where the delay is certain and over a frame."""

from __future__ import annotations

import re
from dataclasses import replace

import made_rig
import pytest
from solids import seen_by

from shadowpuppet.errors import HARMFUL
from shadowpuppet.pipeline.findings import delays
from shadowpuppet.pipeline.findings.delays import delay_cautions
from shadowpuppet.pipeline.findings.look import FirstSeconds
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.prepare import look_at
from shadowpuppet.pipeline.rig import open_rig
from shadowpuppet.pipeline.silhouettes import Silhouettes

MASKS = Options(masks=True)


@pytest.fixture(scope="module")
def seen(cameras):
    return made_rig.masks(cameras, 60)


def said(rig, first=()):
    return delay_cautions(rig, [Silhouettes("made", None)] * len(rig.cameras), FirstSeconds([], first), ready=True)


def names(cautions):
    return [re.search(r"begin together \((.*?)\): `shadowpuppet check --fix`", str(each))[1] for each in cautions]


@pytest.mark.parametrize(("late", "found"), [((0, 0, 0, 0), []), ((0, 0, 2, 0), ["cam3 2.0 frames late"]), ((0, 1, 0, 0), [])])
def test_a_film_that_is_late_by_over_a_frame_is_named(tmp_path, cameras, seen, late, found):
    cautions = said(open_rig(made_rig.write(tmp_path / "r", cameras, made_rig.shifted(seen, late)), MASKS))
    assert names(cautions) == found
    assert all(each.severity == HARMFUL for each in cautions)


@pytest.mark.parametrize(("turned", "found"), [(0.0, ["cam3 2.0 frames late"]), (4.0, [])])
def test_a_delay_is_named_only_if_the_cameras_agree_without_it(tmp_path, cameras, seen, turned, found):
    wrong = [*cameras[:3], made_rig.moved(cameras[3], right=turned)]
    assert names(said(open_rig(made_rig.write(tmp_path / "r", wrong, made_rig.shifted(seen, (0, 0, 2, 0))), MASKS))) == found


def test_films_of_under_three_seconds_tell_delays(tmp_path, cameras, seen):
    rig = open_rig(made_rig.write(tmp_path / "r", cameras, made_rig.shifted(seen, (0, 0, 2, 0), frames=28)), MASKS)
    assert (rig.count or 0) < delays.SECONDS * rig.rate
    assert names(said(rig)) == ["cam3 2.0 frames late"]


def test_films_whose_first_seconds_are_all_of_them_are_not_read_again(tmp_path, cameras, seen, monkeypatch):
    masks = made_rig.shifted(seen, (0, 0, 2, 0), frames=28)
    monkeypatch.setattr(delays, "OPENING", 2.8)
    monkeypatch.setattr(delays, "_middle", None)
    assert names(said(open_rig(made_rig.write(tmp_path / "r", cameras, masks), MASKS), masks)) == ["cam3 2.0 frames late"]


def test_a_long_film_is_read_near_its_beginning(rig_recording, monkeypatch):
    rig, spans = open_rig(rig_recording, MASKS), []

    def sets(part, *_, **__):
        spans.append((part.recording.begin, part.recording.duration))
        return []

    monkeypatch.setattr(delays, "synchronized_frames", sets)
    monkeypatch.setattr(type(rig), "count", 36_000)
    said(rig)
    assert spans == [(6.5, 9.5)]


@pytest.mark.whole
def test_a_look_names_the_delay_of_several_people_in_place_of_a_camera_that_disagrees(tmp_path, cameras):
    def company(n):
        other = [replace(each, centre=(each.centre[0] + 1.1, *each.centre[1:])) for each in made_rig.person(n + 7)]
        return [seen_by(camera, made_rig.person(n) + other) for camera in cameras]

    masks = made_rig.shifted([company(n) for n in range(60)], (0, 0, 3, 0))
    look = look_at(made_rig.write(tmp_path / "r", cameras, masks), Options(masks=True, people=2))
    assert any("2 people" in each.short for each in look.findings)
    assert names(each for each in look.findings if "begin together" in each) == ["cam3 3.0 frames late"]
    assert not any("disagree" in each.short for each in look.findings)


def test_films_of_too_few_frames_tell_nothing(rig_recording, monkeypatch):
    monkeypatch.setattr(delays, "_middle", None)
    assert said(open_rig(rig_recording, MASKS)) == []
