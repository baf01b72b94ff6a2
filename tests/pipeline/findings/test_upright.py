"""A walk shows that the world's Z is not up: the person lies, or stands on the head."""

from __future__ import annotations

from dataclasses import replace

import made_rig
import numpy as np
import pytest
import rendered

from shadowpuppet.geometry import rigid, rotation_from_vector
from shadowpuppet.pipeline.findings.scale import Moment, moments_of
from shadowpuppet.pipeline.findings.upright import up_caution
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.prepare import look_at
from shadowpuppet.tracking.multiview.settings import MultiviewSettings

WALK = (1.7, "standing", "walk", 4)


def said(turn, person=WALK):
    cameras, masks = rendered.person(*person)
    world = turned(cameras, turn)
    return up_caution(world, moments_of(world, masks, MultiviewSettings()), MultiviewSettings())


def turned(cameras, vector):
    return [replace(camera, T_camera_world=camera.T_camera_world @ rigid(rotation_from_vector(vector), np.zeros(3))) for camera in cameras]


def test_an_upright_walk_is_left_alone():
    assert said([0, 0, 0]) is None


def test_who_does_not_walk_may_lie():
    assert said([np.pi / 2, 0, 0], (1.75, "standing", "stand", 2)) is None


@pytest.mark.parametrize(("vector", "up"), [([np.pi / 2, 0, 0], "y"), ([-np.pi / 2, 0, 0], "-y"), ([0, np.pi / 2, 0], "-x"),
                                            ([0, -np.pi / 2, 0], "x")])  # fmt: skip
def test_who_lies_in_all_of_a_walk_tells_the_axis_and_a_body_its_sign(vector, up):
    found = said(vector)
    assert found is not None
    assert "lies in all frames of a walk" in found
    assert f'up = "{up}"' in found
    assert found.evidence["up"] == up
    assert found.evidence["off"] == pytest.approx(90, abs=10)
    assert found.evidence["way"] == pytest.approx(0.41, abs=0.1)


@pytest.mark.parametrize(("steps", "named"), [(3, True), (4, False)])
def test_a_wide_step_at_times_does_not_hide_the_walk(steps, named):
    cameras, masks = rendered.person(*WALK)
    world = turned(cameras, [np.pi, 0, 0])
    wide = Moment(masks[0], np.random.default_rng(0).normal(size=(400, 3)))
    moments = moments_of(world, masks, MultiviewSettings())
    assert (up_caution(world, [*moments, *[wide] * steps], MultiviewSettings()) is not None) is named


def test_who_walks_on_the_head_is_named():
    found = said([np.pi, 0, 0])
    assert found is not None
    assert "stands on the head" in found


@pytest.mark.whole
@pytest.mark.parametrize("still", [0, 25])
def test_a_look_says_that_z_is_not_up_whenever_the_walk_begins(tmp_path, still):
    cameras, masks = rendered.person(1.7, "standing", "walk", 12)
    lab = made_rig.write(tmp_path / "lab", turned(cameras, [np.pi / 2, 0, 0]), [masks[0]] * still + masks)
    assert any("Z is not up" in doubt.short for doubt in look_at(lab, Options(masks=True)).findings)
