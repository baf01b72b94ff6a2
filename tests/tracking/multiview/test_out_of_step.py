"""Cameras that are out of step: late and early ones are named, set aside and taken back; others are left alone."""

from __future__ import annotations

import numpy as np
import pytest

from shadowpuppet.camera.rasterize import pack
from shadowpuppet.tracking.frozen import LEAST
from shadowpuppet.tracking.multiview.out_of_step import AHEAD, StepWatch

RATE, FRAMES = 20, 80


def walk(n: int) -> int:
    return round(60 + 50 * np.sin(2 * np.pi * n / 50))  # to and fro in 2.5 s


def person(x: int, noise: int = 0) -> np.ndarray:
    mask = np.zeros((100, 160), bool)
    mask[10:90, x : x + 24] = True
    if noise:
        mask ^= np.random.default_rng(noise).random(mask.shape) < 0.01
    return mask


def film(delays, cameras: int = 3, read_ahead: int = 0, bodies=True) -> tuple[StepWatch, np.ndarray]:
    """Which cameras are set aside in each frame. `delays(n)`: frames by which the second camera is late in frame n."""
    watch, aside, waiting = StepWatch(cameras), [], []
    for n in range(FRAMES):
        shown = [n, n - delays(n), *[n] * (cameras - 2)][:cameras]
        masks = [person(walk(at), 1 + cameras * n + c) for c, at in enumerate(shown)]
        aside.append([each is None for each in watch(n / RATE, masks)])
        waiting.append((pack(person(walk(n))[::2, ::2]),) * cameras if bodies else ())
        while len(waiting) > read_ahead:
            watch.tracked(waiting.pop(0))
    return watch, np.array(aside)


def test_cameras_in_step_are_left_alone():
    watch, aside = film(lambda n: 0)
    assert not aside.any()
    assert not watch.aside.intervals


@pytest.mark.parametrize(("delay", "why"), [(4, "late"), (-4, "early")])
def test_a_camera_that_falls_out_of_step_is_set_aside_by_name_within_a_second_and_taken_back(delay, why):
    watch, aside = film(lambda n: delay if 20 <= n < 50 else 0)
    assert not aside[:, [0, 2]].any()
    assert not aside[:20].any()
    assert aside[40:50, 1].all()
    assert not aside[-8:].any()
    assert {(each.camera, each.why) for each in watch.aside.intervals} == {(1, why)}
    assert watch.aside.present == {}


def test_frames_that_are_lost_one_by_one_make_a_camera_early():
    watch, aside = film(lambda n: -(n // 8))
    assert aside[-20:, 1].all()
    assert watch.aside.present == {1: "early"}


def test_it_does_not_matter_how_far_ahead_frames_are_read():
    expected = film(lambda n: 4)[1]
    assert expected.any()
    for ahead in range(1, AHEAD):
        np.testing.assert_array_equal(film(lambda n: 4, read_ahead=ahead)[1], expected)


def test_of_two_cameras_none_is_set_aside_and_without_a_body_nothing_is_known():
    assert LEAST == 2
    assert not film(lambda n: 4, cameras=2)[1].any()
    assert not film(lambda n: 4, bodies=False)[1].any()


def test_a_person_who_stands_still_tells_nothing():
    watch = StepWatch(3)
    for n in range(FRAMES):
        masks = [person(50, 1 + n), person(53, 2 + n), person(50)]
        assert all(mask is not None for mask in watch(n / RATE, masks))
        watch.tracked((pack(person(50)[::2, ::2]),) * 3)
