"""Cameras that are out of step: late and early ones are named, set aside and taken back; others are left alone."""

from __future__ import annotations

import numpy as np
import pytest

from shadowpuppet.camera.bits import pack
from shadowpuppet.tracking.frozen import LEAST
from shadowpuppet.tracking.multiview.watch.out_of_step import AHEAD, ENOUGH, LAGS, LATE, MEMORY, MISFIT, MOST, OTHERS, PACE, StepWatch

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


@pytest.mark.parametrize(("short", "out"),
                         [((), set()), ((False, True, False, False), {(1, "early")}), ((False, False, False, True), set())])
def test_where_the_body_follows_a_camera_that_loses_frames_its_shorter_film_says_which_of_two_it_is(short, out):
    watch = StepWatch(4, short)
    for n in range(FRAMES):
        lost = n // 8
        watch(n / RATE, [person(walk(at), 1 + 4 * n + c) for c, at in enumerate((n, n + lost, n, n))])
        between = n + lost // 2  # as the opposite cameras 1 and 3 see it
        watch.tracked([pack(person(walk(at))[::2, ::2]) for at in (n, between, n, between)])
    assert {(each.camera, each.why) for each in watch.aside.intervals} == out
    assert not out or watch.aside.present == {1: "early"}


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


# What a silhouette shows ----------------------------------------------------------------------------------------------


def noted(seed: int, frames: int = 30, cameras: int = 2) -> tuple[StepWatch, np.ndarray]:
    """A watch after frames of random silhouettes and bodies, and the three sums by plain loops (3, cameras, 2 x LAGS)."""
    rng = np.random.default_rng(seed)
    watch, sums, past = StepWatch(cameras), np.zeros((3, cameras, 2 * len(LAGS))), []
    for n in range(frames):
        seconds = n / 30 + rng.uniform(-0.002, 0.002)
        bodies = [np.roll(person(40), round(20 * np.sin(n / 4)) + 3 * c, 1)[::2, ::2] for c in range(cameras)]
        masks = [np.roll(np.repeat(np.repeat(body, 2, 0), 2, 1), rng.integers(-6, 6), 1) for body in bodies]
        watch(seconds, masks)
        watch.tracked([pack(body) for body in bodies])
        if past:
            sums *= np.exp((past[-1][0] - seconds) / MEMORY)
        for c in range(cameras):
            found, mask = np.zeros((3, 2, len(LAGS))), masks[c][::2, ::2]
            for k, lag in enumerate(LAGS):
                then = min(past, key=lambda each: abs(each[0] - (seconds - lag)), default=None)
                if then is None or abs(then[0] - (seconds - lag)) >= 0.035:
                    continue
                own, drawn, other = then[1][c], bodies[c], then[2][c]
                change = (drawn ^ other).sum() / mask.sum()
                for way, (present, earlier) in enumerate((((mask ^ drawn), (mask ^ other)), ((own ^ other), (own ^ drawn)))):
                    left = earlier.sum() / mask.sum()
                    found[:, way, k] = present.sum() / mask.sum() - left, change, left * change
            found = found.reshape(3, -1)
            kept = np.clip((MOST - found[1]) / np.maximum(sums[1, c], 1e-9), 0, 1)
            sums[:, c] = kept * sums[:, c] + found
        past.append((seconds, [mask[::2, ::2] for mask in masks], bodies))
    return watch, sums


@pytest.mark.parametrize("seed", range(3))
def test_evidence_is_that_of_plain_loops(seed):
    watch, sums = noted(seed)
    np.testing.assert_allclose([watch._gain, watch._change, watch._misfit], sums, atol=1e-9)
    assert watch._seen[0].seconds >= watch._seen[-1].seconds - LAGS[-1] - PACE


def test_frames_that_come_faster_than_the_pace_are_left_out():
    watch = StepWatch(2)
    for n in range(50, 58):
        watch(n / 60, [person(n)] * 2)
        watch.tracked((pack(person(n)[::2, ::2]),) * 2)
    assert [round(60 * seen.seconds) for seen in watch._seen] == [50, 52, 54, 56]


def verdict(gain, cameras: int = 4, change=1.0, misfit=0.0, out=()) -> tuple[str, ...]:
    """Of made sums; `gain`: by (camera, lag). A body of the other moment's opposite explains nothing."""
    watch = StepWatch(cameras)
    watch._change[:], watch._misfit[:], watch._gain[:] = change, misfit, -0.5
    for place, value in gain.items():
        watch._gain[place] = value
    watch._out = [out[n] if n < len(out) else "" for n in range(cameras)]
    return watch._verdict()


def test_verdicts():
    early, fits = len(LAGS), LATE + 0.01
    assert verdict({(1, 2): fits}) == ("", "late", "", "")
    assert verdict({(1, early + 2): fits}) == ("", "early", "", "")
    assert verdict({(1, 0): LATE}) == ("",) * 4
    assert verdict({(1, 2): fits}, change=ENOUGH - 0.01) == ("",) * 4
    assert verdict({(1, 2): ENOUGH * fits}, change=ENOUGH)[1] == "late"
    assert verdict({(1, 2): fits, (2, 0): OTHERS * fits}) == ("",) * 4  # the body is wrong, not the camera
    assert verdict({(1, 2): fits, (2, 0): OTHERS * fits - 0.01})[1] == "late"
    assert verdict({(1, 2): fits, (1, early + 2): 0.0}) == ("",) * 4  # a body that jitters
    assert verdict({(1, 2): fits, (1, early + 2): -0.01, (1, early + 1): 0.1})[1] == "late"
    assert verdict({(1, 2): fits}, misfit=MISFIT)[1] == "late"
    assert verdict({(1, 2): fits}, misfit=MISFIT + 0.01) == ("",) * 4
    assert verdict({(1, 2): fits}, cameras=3)[1] == "late"
    assert verdict({(1, 2): fits}, cameras=2) == ("", "")


def test_those_out_of_step_stay_so_until_the_present_explains_them():
    fits = LATE + 0.01
    assert verdict({(1, 2): 0.01}, out=("", "late")) == ("", "late", "", "")
    assert verdict({(1, 2): -0.01}, out=("", "early")) == ("",) * 4
    assert verdict({(1, 2): 0.3, (2, 1): fits}, cameras=5, out=("", "late"))[2] == "late"  # those out of step are no witnesses
    assert verdict({(1, 2): 0.3, (2, 1): fits}, cameras=4, out=("", "late"))[2] == ""  # most cameras decide what the time is
