"""Noise of a film about its empty scene."""

import numpy as np
import pytest

from shadowpuppet.silhouette.background import film_noise, smoothed, to_planes


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
