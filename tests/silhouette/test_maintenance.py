"""The maintained background: lasting changes beside the person become background, the person does not, and a clean film keeps its masks."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shadowpuppet.silhouette import SilhouetteSettings, learn_background
from shadowpuppet.silhouette._kernels import watch
from shadowpuppet.silhouette.maintenance import INTERVAL, LASTING, MaintainedSegmenter

SIZE = (72, 96)
PERSON = (slice(20, 68), slice(40, 54))
BESIDE = (slice(24, 40), slice(70, 84))


def room(grey: bool = False) -> np.ndarray:
    rough = np.random.default_rng(0).uniform(70, 150, (6, 8, 3)).repeat(12, 0).repeat(12, 1)
    return rough[..., 1] if grey else rough


def frame(seed: int, person=PERSON, thing=None, thing_colour=(40, 170, 60), light: float = 1.0, noise: float = 1.5, grey=False):
    """A frame of the room: a person in dark clothes, and a thing, or a patch in which the light is `light` times as strong."""
    image = room().copy()
    if thing is not None:
        image[thing] = image[thing] * light if light != 1 else thing_colour
    if person is not None:
        image[person] = (150, 30, 25)
    image += np.random.default_rng(seed).normal(0, noise, image.shape)
    out = np.rint(image).clip(0, 255).astype(np.uint8)
    return out[..., 1].copy() if grey else out


def learnt(grey: bool = False, **asked):
    empty = [frame(100 + n, None, grey=grey) for n in range(6)]
    return learn_background(empty, SilhouetteSettings(**asked), film=[frame(200 + n, grey=grey) for n in range(4)])


def alike(mask: np.ndarray, *parts) -> float:
    exact = np.zeros(SIZE, bool)
    for part in parts:
        exact[part] = True
    return float((mask & exact).sum() / (mask | exact).sum())


def seconds(upto: float, since: float = 0.0) -> np.ndarray:
    return np.arange(since, upto, INTERVAL / 2)


@pytest.mark.parametrize("grey", [False, True])
def test_a_clean_film_keeps_its_masks(grey):
    segmenter = learnt(grey)
    maintained = MaintainedSegmenter(segmenter)
    for n, time in enumerate(seconds(15)):
        image = frame(n, (PERSON[0], slice(40 + n % 7, 54 + n % 7)), grey=grey)
        assert (maintained(image, time) == segmenter(image)).all()


@pytest.mark.parametrize("light", [1.0, 1.4])
@pytest.mark.parametrize("grey", [False, True])
def test_what_changes_and_stays_beside_the_person_becomes_background(light, grey):
    segmenter = learnt(grey)
    maintained = MaintainedSegmenter(segmenter)
    for n, time in enumerate(seconds(LASTING + 2 * INTERVAL)):
        maintained(frame(n, thing=BESIDE, light=light, grey=grey), time)
    assert maintained.followed >= 0.9 * 16 * 14
    before = (BESIDE[0], slice(64, 78))  # half before the thing
    last = frame(999, before, BESIDE, light=light, grey=grey)
    assert alike(maintained(last, 9.0), before) > 0.9
    assert alike(segmenter(last), before) < 0.75


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 100), noise=st.floats(0, 4), arm=st.booleans())
def test_a_person_who_stands_still_stays_whole(seed, noise, arm):
    maintained = MaintainedSegmenter(learnt())
    for n, time in enumerate(seconds(30)):
        mask = maintained(frame(seed + n, noise=noise, thing=BESIDE if arm and time > 3 else None), time)
        assert alike(mask, PERSON) > 0.9


def test_what_the_person_touches_is_held_and_is_followed_after_they_have_left_it():
    maintained = MaintainedSegmenter(learnt())
    touching = (BESIDE[0], slice(54, 68))
    for n, time in enumerate(seconds(20)):
        mask = maintained(frame(n, thing=touching), time)
        assert alike(mask, PERSON, touching) > 0.9
    for n, left in enumerate(range(40, 9, -1)):
        maintained(frame(n, (PERSON[0], slice(left, left + 14)), touching), 20 - 0.01 * (40 - left))
    away = (PERSON[0], slice(10, 24))
    inner, learnt_mean = (slice(27, 37), slice(57, 65)), maintained.segmenter.background.mean
    for n, time in enumerate(seconds(29, 20)):
        maintained(frame(n, away, touching), time)
    assert (maintained.segmenter.background.mean[inner] == learnt_mean[inner]).all()
    for n, time in enumerate(seconds(32, 29)):
        maintained(frame(n, away, touching), time)
    assert (maintained.segmenter.background.mean[inner] != learnt_mean[inner]).any(axis=2).all()


def test_light_that_wanders_behind_the_person_is_followed():
    """A patch of sun comes closer and touches them: it is followed where its surroundings have been."""
    segmenter = learnt()
    maintained, without = MaintainedSegmenter(segmenter), []
    for n, time in enumerate(seconds(40)):
        image = frame(n, thing=(slice(24, 50), slice(max(80 - n // 4, 46), 92)), light=1.3)
        mask = maintained(image, time)
        without.append(alike(segmenter(image), PERSON))
    assert alike(mask, PERSON) > 0.85
    assert without[-1] < 0.7


def test_a_change_nearly_everywhere_is_not_followed():
    """It is the camera, or all of the light."""
    maintained = MaintainedSegmenter(learnt(light=False, stabilise=False))
    image = frame(0, None)
    for y in range(2, 70, 10):
        for x in range(2, 94, 10):
            image[y : y + 8, x : x + 8] = (20, 200, 20)
    for time in seconds(6):
        mask = maintained(image, time)
    assert mask.mean() < 0.1
    assert maintained.followed == 0


def looks(held: int, planes: list[int], shift: int, times: int = 1) -> list[bool]:
    """Whether one pixel of a scene of 100, held or not, is due at each look, with the surroundings changed by `shift`."""
    slow, age, before = np.zeros((1, 1, 3), np.float32), np.zeros((1, 1), np.uint8), np.zeros((1, 1), np.uint8)
    scene, sigma = np.full((1, 1, 3), 100, np.float32), np.full((1, 1, 3), 0.2, np.float32)
    out = []
    for _ in range(times):
        due = np.zeros((1, 1), np.uint8)
        watch(np.ones((1, 1), np.uint8), np.full((1, 1), held, np.uint8), np.array(planes, np.uint8)[None, None], scene,
              np.array([shift, 0, 0], np.float32)[None, None], sigma, np.float32(2), (4, 20), slow, age, before, due)
        out.append(bool(due[0, 0]))
    return out


@pytest.mark.parametrize("held", [0, 1, 2])
def test_a_pixel_that_its_surroundings_explain_is_due_at_the_second_look(held):
    assert looks(held, [140, 100, 100], 40, 2) == [False, True]
    assert looks(held, [120, 100, 100], 40, 2) == [False, True]  # half in the light
    assert looks(held, [102, 100, 100], 40, 2) == [False, True]  # in none, as it was learnt


def test_a_pixel_on_the_person_that_nothing_explains_is_never_due():
    assert not any(looks(2, [140, 100, 100], 0, 100))
    assert not any(looks(2, [140, 130, 100], 40, 100))
    assert not any(looks(1, [60, 100, 100], 40, 100))


def test_the_same_film_has_the_same_masks():
    film = [(frame(n, thing=BESIDE if n > 8 else None), time) for n, time in enumerate(seconds(8))]
    first, second = (MaintainedSegmenter(learnt()) for _ in range(2))
    assert all((first(*each) == second(*each)).all() for each in film)


@pytest.mark.parametrize("method", ["averaging", "mog2", "knn"])
def test_other_methods_keep_their_background(method):
    segmenter = learnt(method=method)
    maintained = MaintainedSegmenter(segmenter)
    for n, time in enumerate(seconds(5)):
        image = frame(n, thing=BESIDE)
        assert (maintained(image, time) == segmenter(image)).all()


def test_a_pixel_is_due_when_it_has_looked_alike_often_enough():
    """Plain twin of the kernel's counting, for one free pixel."""
    rng = np.random.default_rng(3)
    label, levels = rng.random(60) < 0.8, np.where(rng.random(60) < 0.9, 100, 160)
    slow, age, before, due = np.zeros((1, 1, 3), np.float32), *(np.zeros((1, 1), np.uint8) for _ in range(3))
    nothing, sigma = np.zeros((1, 1, 3), np.float32), np.full((1, 1, 3), 0.2, np.float32)
    seen, plain, last, count = [], [], 0.0, 0
    for each, level in zip(label, levels):
        due[:] = 0
        planes = np.full((1, 1, 3), level, np.uint8)
        watch(np.array([[each]], np.uint8), np.zeros((1, 1), np.uint8), planes, nothing, nothing, sigma, np.float32(2), (4, 20), slow, age,
              before, due)
        seen.append(bool(due[0, 0]))
        count = 0 if not each else count + 1 if count and abs(level - last) <= 10 else 1
        last = level if each else last
        plain.append(count == 4)
        count = 0 if count == 4 else count
    assert any(plain)
    assert seen == plain
