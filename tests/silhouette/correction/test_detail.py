"""Detail that a codec has lost: found in a film, restored where a frame shows the scene without it, and nowhere else."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from silhouette_scenes import overlap

from shadowpuppet.silhouette import learn_background
from shadowpuppet.silhouette.correction import detail as module
from shadowpuppet.silhouette.correction._kernels import restore_detail
from shadowpuppet.silhouette.correction.detail import COARSE, LostDetail, lost_detail

SIZE = (96, 128)


def bricks(seed: int = 0) -> np.ndarray:
    """An empty scene (H, W, 3) with fine texture."""
    rng = np.random.default_rng(seed)
    rough = rng.uniform(-22, 22, (24, 32, 1)).repeat(4, 0).repeat(4, 1)
    return np.clip(np.array((130, 120, 110)) + rough, 0, 255).astype(np.uint8)


def smeared(scene: np.ndarray, where: tuple[slice, slice]) -> np.ndarray:
    """The scene without its texture in a window."""
    out = scene.copy()
    out[where] = cv2.GaussianBlur(scene, (0, 0), COARSE)[where]
    return out


def noisy(image: np.ndarray, seed: int, noise: float = 1.0) -> np.ndarray:
    return np.clip(np.rint(image + np.random.default_rng(seed).normal(0, noise, image.shape)), 0, 255).astype(np.uint8)


@pytest.mark.kernels
@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 99), channels=st.sampled_from([1, 3]), near=st.floats(1, 30), quiet=st.floats(0, 9))
def test_the_kernel_moves_pixels_along_the_line_as_plain_numpy_does(seed, channels, near, quiet):
    rng = np.random.default_rng(seed)
    shape = (6, 7, channels)
    image, smooth = rng.integers(0, 256, (2, *shape), np.uint8)
    scene = (smooth + rng.normal(0, 8, shape)).astype(np.float32)
    detail = rng.normal(0, 8, shape).astype(np.float32)
    inverse = (1 / (detail**2).sum(2)).astype(np.float32)
    out = np.empty_like(image)
    restore_detail(image, smooth, scene, detail, inverse, np.float32(quiet), np.float32(near), out)
    far = smooth.astype(np.float32) - scene
    lost = np.clip((far * detail).sum(2, keepdims=True) * inverse[..., None], 0, 1)
    rest = np.sqrt(((far - lost * detail) ** 2).mean(2, keepdims=True))
    apart = np.sqrt((far**2).mean(2, keepdims=True))
    expected = np.where((rest <= near) & (apart > quiet), np.clip(image - lost * detail, 0, 255), image)
    sure = (np.abs(rest - near) > 1e-3) & (np.abs(apart - quiet) > 1e-3)
    assert (np.abs(out - expected) <= 0.51)[np.broadcast_to(sure, shape)].all()


@pytest.mark.parametrize("kind", ["colour", "grey"])
def test_texture_that_was_painted_over_is_restored_and_a_person_stays(kind):
    scene = bricks()
    frame = smeared(scene, (slice(20, 80), slice(10, 90)))
    frame[30:60, 40:60] = (40, 40, 200)
    if kind == "grey":
        scene, frame = (np.asarray(cv2.cvtColor(each, cv2.COLOR_BGR2GRAY)) for each in (scene, frame))
    restored = LostDetail.of(scene, 6.0)(frame)
    away = np.ones(SIZE, bool)
    away[16:84, 6:94] = False
    away[26:64, 36:64] = False
    inside = np.zeros(SIZE, bool)
    inside[24:76, 14:30] = True
    before, after = (np.abs(each.astype(int) - scene)[inside].mean() for each in (frame, restored))
    assert after < 0.35 * before
    np.testing.assert_array_equal(restored[33:57, 43:57], frame[33:57, 43:57])
    assert np.abs(restored.astype(int) - frame)[away].max() <= 8


def test_a_film_that_shows_all_detail_is_left_alone_and_so_is_a_plain_wall():
    scene = bricks()
    assert lost_detail(scene, [noisy(scene, k) for k in range(4)]) is None
    assert lost_detail(scene, []) is None
    blurred = [noisy(cv2.GaussianBlur(scene, (0, 0), 2), k) for k in range(4)]
    assert lost_detail(scene, blurred) is not None
    plain = np.full((*SIZE, 3), 120, np.uint8)
    assert lost_detail(plain, [noisy(plain, k) for k in range(4)]) is None


def test_silhouettes_of_a_smeared_film_are_without_the_smears(monkeypatch):
    scene = bricks()
    exact = np.zeros(SIZE, bool)
    exact[20:, 50:80] = True

    def frame(k: int) -> np.ndarray:
        out = smeared(scene, (slice(10, 96), slice(14 + 4 * k % 30, 115)))
        out[exact] = (40, 50, 190)
        return noisy(out, k)

    film, empty = [frame(k) for k in range(8)], [noisy(scene, 100 + k) for k in range(6)]
    found = learn_background(empty, film=film)
    assert found.correction is not None
    assert found.correction.detail is not None
    assert np.mean([overlap(found(each), exact) for each in film]) > 0.95
    monkeypatch.setattr(module, "LOSS", np.inf)
    without = learn_background(empty, film=film)
    assert without.correction is not None
    assert without.correction.detail is None
