"""The condition of a film: noise, compression, light and movement are distinguished, and a good film is not accused."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import cv2
import numpy as np
import pytest

from shadowpuppet.errors import HARMFUL, RUINOUS
from shadowpuppet.silhouette import learn_background
from shadowpuppet.silhouette.correction.condition import FilmCondition, film_condition

Image = np.ndarray


def scene() -> Image:
    rng = np.random.default_rng(3)
    out = cv2.resize(rng.uniform(60, 170, (12, 16, 3)), (160, 120), interpolation=cv2.INTER_CUBIC)
    for k in range(12):
        cv2.rectangle(out, (13 * k, 9 * k), (13 * k + 12, 9 * k + 14), rng.uniform(40, 190, 3).tolist(), -1)
    return out


def condition(spoil: Callable[[int, Image], Image], noise: float = 1.5) -> FilmCondition:
    """Of five runs of four frames, a second apart."""
    rng, empty = np.random.default_rng(0), scene()

    def frame(n: int) -> Image:
        return np.rint(spoil(n, empty) + rng.normal(0, noise, empty.shape)).clip(0, 255).astype(np.uint8)

    runs = [[(run + n / 25, frame(4 * run + n)) for n in range(4)] for run in range(5)]
    background = [np.rint(empty + rng.normal(0, 1.5, empty.shape)).clip(0, 255).astype(np.uint8) for _ in range(8)]
    return film_condition(learn_background(background, film=[image for run in runs for _, image in run]), runs)


def shifted(empty: Image, x: float, y: float) -> Image:
    return cv2.warpAffine(empty, np.array([[1, 0, x], [0, 1, y]], float), (160, 120), borderMode=cv2.BORDER_REFLECT)


def test_a_good_film_is_not_accused():
    found = condition(lambda n, empty: empty)
    assert found.warnings() == ()
    assert (found.moved, found.moved_since, found.unmatched) == (0, None, 0)
    assert max(found.gain) - min(found.gain) < 0.02


@pytest.mark.parametrize(("spoil", "noise", "said"), [
    (lambda n, empty: shifted(empty, 6, 3) if n >= 12 else empty, 1.5, "from where it saw the empty scene, from about 3.0 s on"),
    (lambda n, empty: shifted(empty, 5, 3), 1.5, "from where it saw the empty scene, throughout"),
    (lambda n, empty: shifted(empty, 4 * (n % 3 - 1), 0) if n < 19 else empty, 1.5, "the camera moves by up to"),
    (lambda n, empty: 255 - empty if n < 11 else empty, 1.5, "55 % of the frames do not show the empty scene"),
    (lambda n, empty: 255 - empty if n < 4 else empty, 1.5, "covered, black or moved"),
    (lambda n, empty: 0.5 * empty, 1.5, "the film's light is 0.50 to"),
    (lambda n, empty: empty, 30, "the film is noisy"),
], ids=["nudged", "away", "shaking", "another place", "covered", "dark", "noisy"])
def test_what_is_too_much_is_named(spoil, noise, said):
    warnings = condition(spoil, noise).warnings()
    assert len(warnings) == 1
    assert said in warnings[0]


@pytest.mark.parametrize(("frames", "weight"), [(4, HARMFUL), (15, RUINOUS)])
def test_a_camera_that_is_covered_for_a_time_does_not_ruin_a_film(frames, weight):
    assert condition(lambda n, empty: 0 * empty if n < frames else empty).warnings()[0].severity == weight


@pytest.mark.parametrize("spoil", [
    lambda n, empty: 255 - empty if n < 15 else empty,
    lambda n, empty: empty + cv2.resize(np.random.default_rng(1).normal(0, 14, (24, 32, 3)), (160, 120)),
], ids=["another place", "light"])
def test_nobody_is_told_to_film_again_what_was_never_filmed(spoil):
    found = condition(spoil)
    assert "again" in found.warnings()[0].short
    for words in (found.warnings(recovered=True)[0], found.warnings(recovered=True)[0].short):
        assert "film" in words
        assert "again" not in words


@pytest.mark.parametrize(("first", "since"), [(0, 0.0), (1, 1 / 25), (12, 3.0)])
def test_a_camera_is_moved_since_the_frame_after_the_last_unmoved_one(first, since):
    assert condition(lambda n, empty: shifted(empty, 6, 3) if n >= first else empty).moved_since == pytest.approx(since)


def test_compression_stays_from_frame_to_frame():
    still = np.random.default_rng(1).normal(0, 14, (120, 160, 3))
    found = condition(lambda n, empty: empty + still, noise=0)
    assert found.copied == 1
    assert "compressed too much" in found.warnings()[0]


def test_light_that_nothing_explains_is_no_compression():
    spots = cv2.resize(np.random.default_rng(1).normal(0, 14, (24, 32, 3)), (160, 120))
    found = condition(lambda n, empty: empty + spots)
    assert "in light that no smooth change explains" in found.warnings()[0]


def test_motion_blur_is_named_only_if_strong():
    good = condition(lambda n, empty: empty)
    assert (good.blur, good.blurred) == (None, False)
    assert not replace(good, blur=0.2).blurred
    assert replace(good, blur=0.4).blurred
    assert replace(good, blur=0.4).warnings() == ()
    assert "moving limbs are blurred (90 %" in replace(good, blur=0.9).warnings()[0]
