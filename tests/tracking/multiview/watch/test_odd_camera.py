"""One camera that suddenly contradicts the others is left out while it does; cameras that agree are not."""

from __future__ import annotations

from dataclasses import replace

import actor
import numpy as np
import pytest

from shadowpuppet.tracking.multiview.settings import make_multiview_settings
from shadowpuppet.tracking.multiview.tracker import MultiviewTracker
from shadowpuppet.tracking.multiview.watch.odd_camera import adapted, odd_one, suspects

USUAL = np.array([0.9, 0.85, 0.9, 0.8])
JUMP, FRAMES = 6, 9


def test_cameras_are_suspected_when_their_overlap_has_fallen_far():
    assert suspects(USUAL, USUAL - 0.1) == []
    assert suspects(USUAL, USUAL - [0.0, 0.3, 0.0, 0.5]) == [1, 3]
    assert suspects(USUAL, np.array([0.9, 0.3, np.nan, np.nan])) == []  # of two cameras nobody knows which one is wrong
    assert suspects(np.zeros(0), USUAL) == []


def test_the_odd_one_is_that_without_which_the_others_fit():
    now = np.array([0.8, 0.5, 0.85, 0.3])
    good, bad = np.array([0.9, 0.2, 0.9, 0.8]), np.array([0.75, 0.85, 0.85, 0.1])
    assert odd_one(USUAL, now, {1: good, 3: bad}) == 1
    assert odd_one(USUAL, now, {}) is None
    assert odd_one(USUAL, now, {1: np.array([0.9, 0.75, 0.9, 0.8])}) is None  # it fits after all: the body was wrong
    assert odd_one(USUAL, now, {1: np.array([0.82, 0.2, 0.85, 0.3])}) is None  # nothing is gained


def test_what_is_usual_follows_slowly_and_that_of_the_odd_one_more_slowly():
    np.testing.assert_array_equal(adapted(np.zeros(0), USUAL, None), USUAL)
    after = adapted(USUAL, USUAL - 0.5, 2)
    assert (after < USUAL).all()
    assert USUAL[2] - after[2] < 0.5 * (USUAL[1] - after[1])
    np.testing.assert_array_equal(adapted(np.array([np.nan, 0.5]), np.array([0.7, np.nan]), None), [0.7, 0.5])


def tracked(carve: bool, late: int = 0) -> tuple[np.ndarray, list]:
    """Joint errors (T, L) of a walk, metres, in which a camera's pictures are `late` frames late from frame `JUMP` on; and the states."""
    poses, seen = actor.filmed(frames=FRAMES, begin=0.2)
    rows = [list(masks) for _, masks in seen]
    for n in range(JUMP, FRAMES) if late else ():
        rows[n][1] = seen[n - late][1][1]
    of = MultiviewTracker(actor.body(), actor.cameras(), make_multiview_settings("default", {"particles": 8}))
    of = replace(of, carve=actor.hull().points) if carve else of
    rng, states = np.random.default_rng(0), []
    for masks in rows:
        points = actor.hull().points(masks)
        states.append(of.step(rng, states[-1], points, masks) if states else of.start(rng, points, masks))
    return actor.apart(of.body, np.array([state.pose for state in states]), poses), states


def test_a_camera_that_jumps_back_does_not_disturb_the_body():
    clean, with_it, without_it = (tracked(carve, late)[0][JUMP:].mean() for carve, late in ((False, 0), (False, 5), (True, 5)))
    assert without_it < 1.3 * clean + 0.003
    assert without_it < 0.7 * with_it


def test_cameras_that_agree_are_all_used():
    for one, other in zip(tracked(False)[1], tracked(True)[1]):
        np.testing.assert_array_equal(one.pose, other.pose)


@pytest.mark.parametrize(("preset", "used"), [("default", True), ("ni2008", False)])
def test_the_papers_preset_uses_every_camera(preset, used):
    assert make_multiview_settings(preset).odd_camera is used
