"""The height that silhouettes ask for: right for people who sit or stand, proportional to the world's scale."""

from __future__ import annotations

import numpy as np
import pytest
import rendered

from shadowpuppet.tracking.multiview.height_estimation import extents
from shadowpuppet.tracking.multiview.seen_stature import scaled, seen_stature
from shadowpuppet.tracking.multiview.settings import MultiviewSettings


def height(cameras, masks):
    found = seen_stature(np.random.default_rng(0), cameras, masks, MultiviewSettings())
    assert found is not None
    return found.height


@pytest.mark.whole
@pytest.mark.parametrize(("stature", "posture"), [(1.2, "seated"), (2.05, "seated"), (2.05, "standing")])
def test_people_who_sit_or_stand_are_as_tall_as_they_are(stature, posture):
    cameras, (masks,) = rendered.person(stature, posture)
    assert height(cameras, masks) == pytest.approx(stature, rel=0.06)


@pytest.mark.parametrize("factor", [0.3, 1.4])
def test_the_height_grows_with_the_world_and_nothing_else_does(factor):
    cameras, (masks,) = rendered.person(1.7, "seated")
    grown = [scaled(camera, factor) for camera in cameras]
    assert height(grown, masks) == pytest.approx(factor * height(cameras, masks), rel=1e-6)


def test_without_a_person_there_is_no_height():
    cameras, (masks,) = rendered.person(1.7, "seated")
    empty = [np.zeros_like(mask) for mask in masks]
    assert seen_stature(np.random.default_rng(0), cameras, empty, MultiviewSettings()) is None


def test_extents_go_by_the_principal_axes():
    rng = np.random.default_rng(1)
    box = rng.uniform(-0.5, 0.5, (4000, 3)) * [0.4, 1.8, 0.6]
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    assert extents(box @ turn.T) == pytest.approx([1.8, 0.6, 0.4], rel=0.1)
    assert not extents(box[:20]).any()
