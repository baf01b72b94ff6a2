"""Changes of light: gains are found beside a person who covers much of the picture, and silhouettes stay what they are."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from shadowpuppet.silhouette import learn_background
from shadowpuppet.silhouette.correction.light import NEGLIGIBLE, Light

SIZE = (96, 128)


def scene_of(seed: int = 0) -> np.ndarray:
    """A textured empty scene, (H, W, 3)."""
    rng = np.random.default_rng(seed)
    rough = rng.uniform(50, 170, (8, 10, 3)).repeat(12, 0).repeat(13, 1)[: SIZE[0], : SIZE[1]]
    return (rough + rng.normal(0, 4, rough.shape)).clip(0, 255).astype(np.uint8)


def filmed(scene: np.ndarray, gains, share: float = 0.0, noise: float = 2.0, seed: int = 1) -> np.ndarray:
    """A frame of the scene under gains, `share` of its width covered by a person in dark clothes."""
    rng = np.random.default_rng(seed)
    image = scene.astype(float)
    image[10:, 20 : 20 + round(share * SIZE[1])] = (90, 60, 45)
    return np.rint(image * gains + rng.normal(0, noise, image.shape)).clip(0, 255).astype(np.uint8)


@settings(max_examples=30, deadline=None)
@given(gains=st.tuples(*[st.floats(0.6, 1.4)] * 3), share=st.floats(0, 0.45), noise=st.floats(0, 6))
def test_gains_are_found_whatever_the_person_covers(gains, share, noise):
    scene = scene_of()
    found = Light(scene).gains(filmed(scene, gains, share, noise))
    np.testing.assert_allclose(found, gains, rtol=0.03)


def test_a_constant_light_leaves_the_picture_as_it_is():
    scene = scene_of()
    image = filmed(scene, 1 + NEGLIGIBLE / 4, 0.3)
    assert Light(scene).normalised(image)[0] is image


def test_a_picture_too_dark_to_tell_is_left_as_it_is():
    scene = scene_of()
    black = np.zeros_like(scene)
    assert Light(scene).normalised(black)[0] is black


def test_a_channel_that_shows_no_gain_has_that_of_the_others():
    scene = scene_of()
    scene[..., 2] = 5  # a blue room: red is noise
    found = Light(scene).gains(filmed(scene, (1.2, 1.3, 1.3)))
    np.testing.assert_allclose(found, (1.2, 1.3, np.sqrt(1.2 * 1.3)), rtol=0.02)


def test_clipped_pixels_of_a_bright_scene_are_not_taken_for_a_person():
    scene = scene_of()
    scene[:20] = 225
    image = filmed(scene, 1.3, noise=1)
    assert (image[:20] == 255).all()
    assert np.abs(Light(scene).normalised(image)[0][:20].astype(int) - 225).max() <= 2


def check_silhouettes(gain, grey: bool) -> None:
    """Check that the silhouettes of a film are the same before and after its light changes by `gain`, a number or (H, W, 1)."""
    scene = scene_of()
    empty = [filmed(scene, 1, seed=k) for k in range(6)]
    film = [filmed(scene, g, 0.25, seed=10 + k) for k, g in enumerate([1, 1, 1, gain, gain, gain])]
    if grey:
        empty, film = [image[..., 1].copy() for image in empty], [image[..., 1].copy() for image in film]
    segmenter = learn_background(empty, film=film)
    before, after = segmenter(film[0]), segmenter(film[-1])
    assert 0.15 < before.mean() < 0.3
    assert (before & after).sum() > 0.95 * (before | after).sum()


@pytest.mark.parametrize("grey", [False, True])
@pytest.mark.parametrize("gain", [0.7, 1.3])
def test_silhouettes_are_the_same_under_another_exposure(gain, grey):
    check_silhouettes(gain, grey)


def uneven(kind: str) -> np.ndarray:
    """Gains (H, W, 1) over the picture."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]] / np.array([[[SIZE[0] - 1]], [[SIZE[1] - 1]]]) * 2 - 1
    shapes = {"vignetting": 1 - 0.3 * (x**2 + y**2) / 2, "lamp": 1 - 0.4 * np.exp(-1.5 * (x + 1)), "window": 1 + 0.25 * y}
    return shapes[kind][..., None]


@pytest.mark.parametrize("kind", ["vignetting", "lamp", "window"])
@pytest.mark.parametrize("grey", [False, True])
def test_silhouettes_are_the_same_under_an_uneven_light(kind, grey):
    check_silhouettes(uneven(kind), grey)


@settings(max_examples=20, deadline=None)
@given(gain=st.floats(0.6, 1.4), share=st.floats(0, 0.3), noise=st.floats(0, 10), seed=st.integers(0, 99))
def test_an_even_light_has_no_surface(gain, share, noise, seed):
    scene = scene_of()
    image, light = filmed(scene, gain, share, noise, seed), Light(scene)
    assert light.surface(image) is None


def test_a_noisy_film_keeps_its_silhouettes():
    scene = scene_of()
    exact = np.zeros(SIZE, bool)
    exact[10:, 20 : 20 + round(0.25 * SIZE[1])] = True
    film = [filmed(scene, 1, 0.25, 20, seed=k) for k in range(4)]
    masks = list(map(learn_background([filmed(scene, 1, seed=k) for k in range(6)], film=film), film))
    assert np.mean([(mask & exact).sum() / (mask | exact).sum() for mask in masks]) > 0.93


@given(seed=st.integers(0, 100), gain=st.floats(0.4, 2.5), noise=st.floats(0, 20))
@settings(max_examples=25, deadline=None)
def test_modes_are_those_of_the_plain_computation(seed, gain, noise):
    rng = np.random.default_rng(seed)
    scene = rng.integers(0, 256, (60, 80, 3)).astype(np.uint8)
    frame = np.clip(gain * scene + rng.normal(0, noise, scene.shape), 0, 255).astype(np.uint8)
    plain = [_plain_mode(before, after) for before, after in zip(scene.reshape(-1, 3).T, frame.reshape(-1, 3).T)]
    assert Light(scene).gains(frame) == pytest.approx(np.exp(plain), rel=1e-12)


def _plain_mode(before, after):
    use = (before > 40) & (before < 245) & (after > 20) & (after < 245)
    assume(use.mean() >= 0.25)
    logs = np.log(np.maximum(np.arange(256), 1)).astype(np.float32)
    bins = np.clip(np.rint((logs[after[use]] - logs[before[use]]) / np.float32(0.008)).astype(int) + 256, 0, 511)
    middle = int(np.argmax(np.convolve(np.bincount(bins, minlength=512), np.ones(11), "valid"))) + 5
    for _ in range(5):
        near = (bins >= round(middle) - 15) & (bins <= round(middle) + 15)
        middle = bins[near].mean()
    return (middle - 256) * 0.008
