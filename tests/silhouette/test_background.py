"""Noise of a film about its empty scene."""

import numpy as np
import pytest

from shadowpuppet.silhouette.background import Background, FilmNoise, film_noise, smoothed, to_planes
from shadowpuppet.silhouette.learning import assumed_sigma


@pytest.mark.parametrize("black", [1, 6])
def test_black_frames_are_no_noise(black):
    rng = np.random.default_rng(1)
    scene = np.full((48, 64, 3), 120, np.uint8)
    film = [np.clip(scene + rng.normal(0, 4, scene.shape), 0, 255).astype(np.uint8) for _ in range(8)]
    mean = smoothed(to_planes(scene).astype(np.float32))
    assert film_noise([*film, *[np.zeros_like(scene)] * black], mean) == pytest.approx(film_noise(film, mean))


def test_all_frames_alike_in_another_light_are_its_noise():
    scene = np.full((48, 64, 3), 60, np.uint8)
    mean = smoothed(to_planes(scene).astype(np.float32))
    assert film_noise([scene + 40] * 4, mean)[0] == pytest.approx(40, abs=1)


def test_the_assumed_noise_is_the_greatest_of_what_was_learnt_what_the_film_has_and_the_floor():
    flat, learnt = np.full((8, 8, 3), 100, np.float32), np.zeros((8, 8, 3), np.float32)
    learnt[4:] = 20.0
    background = Background(9, True, flat[..., 0].astype(float), learnt[..., 0].astype(float), flat, learnt)
    found = assumed_sigma(background, FilmNoise(3.0, np.array([5.0, 0.1, 0.1]), np.array([0.6, 0.25, 0.5]), np.full(3, 9.0)), 2.0, flat)
    assert found[5, 4] == pytest.approx([12.0, 5.0, 10.0])  # smoothing that calms the film calms what was learnt as well
    assert found[2, 4] == pytest.approx([1.8 * 5, 0.75 * 2, 0.75 * 2])
