"""A walk shows that the world's Z is not up: the person lies, or stands on the head."""

from __future__ import annotations

from dataclasses import replace

import made_rig
import numpy as np
import pytest
import rendered

from shadowpuppet.geometry import rigid, rotation_from_vector
from shadowpuppet.pipeline.findings.scale import moments_of
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


@pytest.mark.parametrize(("vector", "up"), [([np.pi / 2, 0, 0], "y or -y"), ([0, np.pi / 2, 0], "x or -x")])
def test_who_lies_in_all_of_a_walk_tells_the_axis(vector, up):
    found = said(vector)
    assert found is not None
    assert "lies in all frames of a walk" in found
    assert f'up = "{up}"' in found


def test_who_walks_on_the_head_is_named():
    found = said([np.pi, 0, 0])
    assert found is not None
    assert "stands on the head" in found


@pytest.mark.whole
def test_a_look_says_that_z_is_not_up(tmp_path):
    cameras, masks = rendered.person(1.7, "standing", "walk", 12)
    lab = made_rig.write(tmp_path / "lab", turned(cameras, [np.pi / 2, 0, 0]), masks)
    assert any("Z is not up" in doubt.short for doubt in look_at(lab, Options(masks=True)).findings)
