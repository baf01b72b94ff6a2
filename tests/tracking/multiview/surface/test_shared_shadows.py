"""Limbs that one camera takes for shadow: what the others' silhouettes give back, and what stays shadow."""

from __future__ import annotations

import functools

import actor
import cv2
import numpy as np
import pytest

from shadowpuppet.silhouette.segmenter import Segmented
from shadowpuppet.tracking.multiview.surface.shared_shadows import SharedShadows, shaded_limbs


@functools.cache
def standing() -> tuple[list[np.ndarray], np.ndarray]:
    """A person's masks before all cameras, and the legs below the knees (H, W) of the first."""
    body = actor.body()
    pose = actor.stance(body.skeleton)
    masks = actor.masks(body, pose)
    knee = [body.landmark_names.index(f"{side}_knee") for side in ("left", "right")]
    knees = actor.cameras()[0].project(body.points(pose[None])[0, knee])
    legs = masks[0].copy()
    legs[: int(knees[:, 1].max())] = False
    return masks, legs


def unknown(number: int) -> list[None]:
    return [None] * number


def on_the_floor(camera, about=(0.0, 0.0), reach=1.2) -> np.ndarray:
    """The floor within `reach` (m) of a place beside the feet, as a camera sees it (H, W)."""
    angles = np.linspace(0, 2 * np.pi, 60)
    circle = np.stack([about[0] + reach * np.cos(angles), about[1] + reach * np.sin(angles), np.zeros_like(angles)], 1)
    out = np.zeros(camera.size[::-1], np.uint8)
    cv2.fillPoly(out, [np.round(camera.project(circle)).astype(np.int32)], 1)
    return out.view(bool)


def test_legs_that_one_camera_takes_for_shadow_are_given_back_and_the_floor_is_not():
    masks, legs = standing()
    shadow = on_the_floor(actor.cameras()[0]) & ~masks[0] | legs
    found = shaded_limbs(actor.hull(), [masks[0] & ~legs, *masks[1:]], [shadow, *unknown(4)])
    assert list(found) == [0]
    assert np.count_nonzero(found[0] & legs) > 0.9 * np.count_nonzero(legs)
    assert not (found[0] & ~cv2.dilate(legs.view(np.uint8), np.ones((5, 5), np.uint8)).view(bool)).any()
    assert not (found[0] & ~shadow).any()


@pytest.mark.parametrize("alike", [1, 2, 3])
def test_what_another_camera_does_not_see_either_stays_shadow(alike):
    masks, legs = standing()
    less = [mask.copy() for mask in masks]
    less[0] &= ~legs
    knee = np.flatnonzero(legs.any(1))[0]
    less[alike][knee - 20 :] = False  # another camera's picture of the lower half is lost, too
    assert 0 not in shaded_limbs(actor.hull(), less, [legs, *unknown(4)])


def test_two_cameras_cannot_tell():
    masks, legs = standing()
    assert shaded_limbs(actor.hull(), [masks[0] & ~legs, masks[1], *unknown(3)], [legs, *unknown(4)]) == {}


def test_masks_are_made_again_where_limbs_are_found_and_only_there():
    masks, legs = standing()

    def given_back(limbs):
        return (masks[0] & ~legs) | limbs

    nothing = np.zeros_like(legs)
    share = SharedShadows(actor.cameras())
    found = [Segmented(masks[0] & ~legs, legs, given_back), Segmented(masks[1], nothing, lambda limbs: ~masks[1]),
             Segmented(masks[2]), None, Segmented(masks[4])]
    made = share(found)
    assert np.count_nonzero(made[0] & legs) > 0.9 * np.count_nonzero(legs)
    assert made[1] is masks[1]
    assert made[2] is masks[2]
    assert made[3] is None


def test_without_people_nothing_is_shared():
    empty = [np.zeros_like(mask) for mask in standing()[0]]
    assert shaded_limbs(actor.hull(), empty, [~mask for mask in empty]) == {}
    assert SharedShadows(actor.cameras())([None] * 5) == (None,) * 5


def test_a_shadow_beside_a_foot_stays_shadow():
    """Beside legs that are seen the others leave only short parts of rays."""
    masks = standing()[0]
    shadow = on_the_floor(actor.cameras()[0]) & ~masks[0]
    assert shadow.any()
    assert 0 not in shaded_limbs(actor.hull(), masks, [shadow, *unknown(4)])
