from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from pydantic import ValidationError

from shadowpuppet.errors import SettingsError, SilhouetteError
from shadowpuppet.silhouette import SilhouetteSettings, background_from_film, learn_background, ready_mask
from shadowpuppet.silhouette._kernels import classify, contrast, far_from_samples
from shadowpuppet.silhouette.background import Spread, film_noise, learn_statistics, smoothed, to_planes
from shadowpuppet.silhouette.cleanup import clean, person, without_holes
from shadowpuppet.silhouette.keys import wardrobe_share
from shadowpuppet.silhouette.outlines import SHARP, Outline, at_half_contrast, outline_width
from shadowpuppet.silhouette.rules import KeyRule, PlainRule

CLEANED = ("auto", "brightness", "colour", "both", "mog2", "knn")
METHODS = (*CLEANED, "averaging")


# ---------------------------------------------------------------- a made scene

SIZE = (120, 160)
WALL, SHIRT, SKIN = (150, 130, 110), (120, 45, 40), (110, 140, 190)  # blue green red


def figure() -> np.ndarray:
    """An upper body (H, W), with a hand on the hip, so that there is a gap, and a finger of two pixels."""
    mask = np.zeros(SIZE, np.uint8)
    cv2.ellipse(mask, (80, 25), (9, 12), 0, 0, 360, 1, -1)
    cv2.rectangle(mask, (76, 35), (84, 45), 1, -1)
    cv2.rectangle(mask, (64, 42), (96, 119), 1, -1)
    cv2.line(mask, (66, 47), (40, 70), 1, 7)
    cv2.line(mask, (40, 70), (66, 95), 1, 7)
    cv2.line(mask, (94, 47), (135, 40), 1, 7)
    cv2.rectangle(mask, (135, 39), (148, 40), 1, -1)
    return mask > 0


def scene(rng: np.random.Generator, colour=WALL) -> np.ndarray:
    """A softly textured wall (H, W, 3), without noise."""
    texture = cv2.GaussianBlur(rng.normal(0, 40, SIZE), (0, 0), 6)
    return np.clip(np.array(colour, float) + texture[..., None], 0, 255)


def shot(rng: np.random.Generator, picture: np.ndarray, noise=1.5) -> np.ndarray:
    """A picture as a camera with noise takes it."""
    return np.clip(np.rint(picture + rng.normal(0, noise, picture.shape)), 0, 255).astype(np.uint8)


def empty_shots(rng: np.random.Generator, wall: np.ndarray, count=12) -> list[np.ndarray]:
    return [shot(rng, wall) for _ in range(count)]


def dressed(wall: np.ndarray, mask: np.ndarray, shirt=SHIRT, skin=SKIN) -> np.ndarray:
    """The person before the wall: shirt below, skin above and at the arms' ends."""
    picture = wall.copy()
    picture[mask] = shirt
    bare = mask.copy()
    bare[40:, :125] = False
    picture[bare] = skin
    return picture


def overlap(a: np.ndarray, b: np.ndarray) -> float:
    return np.count_nonzero(a & b) / max(np.count_nonzero(a | b), 1)


def grey(image: np.ndarray) -> np.ndarray:
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), np.uint8)


# ---------------------------------------------------------------- eq. 1


@given(arrays(float, (1, 6), elements=st.floats(0, 255)), arrays(float, (1, 6), elements=st.floats(0, 200)),
       st.floats(0.01, 10))
@settings(max_examples=200, deadline=None)
def test_bounds_are_the_formula_for_every_value(mean, sigma, factor):
    check_bounds(mean, sigma, factor)


@given(arrays(int, (1, 6), elements=st.integers(0, 510)), arrays(int, (1, 6), elements=st.integers(0, 40)),
       st.sampled_from([0.5, 1, 2]))
@settings(max_examples=100, deadline=None)
def test_bounds_are_the_formula_where_it_holds_with_equality(mean, sigma, factor):
    check_bounds(mean / 2, sigma / 4, factor)


def check_bounds(mean, sigma, factor):
    rule = PlainRule.of(mean, sigma, factor)
    for value in range(256):
        expected = np.abs(mean - value) >= factor * sigma
        np.testing.assert_array_equal(rule(np.full(mean.shape, value, np.uint8)) > 0, expected, err_msg=str(value))


def test_averaging_is_eq_1_and_nothing_else(rng):
    images = [rng.integers(90, 110, SIZE, dtype=np.uint8) for _ in range(7)]
    segmenter = learn_background(images, SilhouetteSettings(method="averaging", factor=1.5))
    mean, sigma = np.mean(images, axis=0), np.std(images, axis=0)
    for _ in range(3):
        image = rng.integers(60, 140, SIZE, dtype=np.uint8)
        clear = np.abs(np.abs(mean - image) - 1.5 * sigma) > 1e-9  # rounding decides the others
        expected = np.abs(mean - image) >= 1.5 * sigma
        np.testing.assert_array_equal(segmenter(image)[clear], expected[clear])
        np.testing.assert_array_equal(segmenter.raw(image), segmenter(image))


def test_raw_is_eq_1_whatever_the_method(rng):
    wall = scene(rng)
    images, image = empty_shots(rng, wall), shot(rng, dressed(wall, figure()))
    plain = learn_background(images, SilhouetteSettings(method="averaging"))(image)
    for method in CLEANED:
        np.testing.assert_array_equal(learn_background(images, SilhouetteSettings(method=method)).raw(image), plain)


def test_a_single_picture_has_no_sigma(rng):
    picture = shot(rng, scene(rng))
    with pytest.raises(SilhouetteError, match=r"single picture.*eq\. 1"):
        learn_background([picture], SilhouetteSettings(method="averaging"))
    segmenter = learn_background([picture])
    with pytest.raises(SilhouetteError, match="single picture"):
        segmenter.raw(picture)


# ---------------------------------------------------------------- kernels and their naive twins


def naive_labels(planes, mean, inverse_sigma, keyed, shadowed, darkest, weak, strong):
    centre = np.array([0, 128, 128])
    i, b = (planes - centre) * inverse_sigma, (mean - centre) * inverse_sigma
    squared = ((i - b) ** 2 * keyed).sum(-1)
    if darkest < 1:
        light = (i * b * shadowed).sum(-1) / np.maximum((b * b * shadowed).sum(-1), 1e-6)
        light = np.clip(light, darkest, 1)[..., None]
        squared = np.minimum(squared, ((i - light * b) ** 2 * shadowed).sum(-1))
    return squared, np.uint8(squared >= weak**2) + np.uint8(squared >= strong**2)


@given(st.integers(0, 2**32 - 1), st.sampled_from([(1, 0, 0), (0, 1, 1), (1, 1, 1)]), st.sampled_from([0.3, 0.5, 1.0]))
@settings(max_examples=20, deadline=None)
def test_classify_is_its_naive_twin(seed, keyed, darkest):
    rng = np.random.default_rng(seed)
    planes = rng.integers(0, 256, (9, 7, 3), dtype=np.uint8)
    mean = np.clip(planes * rng.uniform(0.5, 1.5, (9, 7, 1)) + rng.normal(0, 4, planes.shape), 0, 255).astype(np.float32)
    inverse_sigma = (1 / rng.uniform(1, 4, planes.shape)).astype(np.float32)
    keyed, label = np.array(keyed, np.float32), np.empty((9, 7), np.uint8)
    classify(planes, mean, inverse_sigma, keyed, np.ones(3, np.float32), np.float32(darkest), np.float32(2), np.float32(4), label)
    squared, expected = naive_labels(planes, mean, inverse_sigma, keyed, np.ones(3), darkest, 2, 4)
    clear = (np.abs(squared - 4) > 1e-2) & (np.abs(squared - 16) > 1e-2)
    np.testing.assert_array_equal(label[clear], expected[clear])


def test_contrast_and_neighbours_are_their_naive_twins(rng):
    planes, mean = rng.integers(0, 256, (9, 7, 3), dtype=np.uint8), rng.uniform(0, 255, (9, 7, 3)).astype(np.float32)
    out, seen = np.empty((9, 7), np.float32), np.array([1, 0.5, 0], np.float32)
    contrast(planes, mean, seen, out)
    np.testing.assert_allclose(out, np.sqrt(((planes - mean) ** 2 * seen).sum(-1)), rtol=1e-5)
    samples, far = rng.integers(0, 40, (5, 9, 7, 3), dtype=np.uint8), np.empty((9, 7), np.uint8)
    far_from_samples(planes // 6, samples, 400, 2, far)
    near = (((planes // 6).astype(int) - samples.astype(int)) ** 2).sum(-1) <= 400
    np.testing.assert_array_equal(far, near.sum(0) < 2)
    assert 0 < far.mean() < 1


# ---------------------------------------------------------------- statistics


def test_statistics_are_means_and_deviations(rng):
    images = [rng.integers(0, 256, (8, 9, 3), dtype=np.uint8) for _ in range(5)]
    background = learn_statistics(iter(images))
    brightness = [grey(i) for i in images]
    np.testing.assert_allclose(background.brightness, np.mean(brightness, axis=0), atol=1e-9)
    np.testing.assert_allclose(background.sigma, np.std(brightness, axis=0), atol=1e-9)
    np.testing.assert_allclose(background.mean, np.mean([to_planes(i) for i in images], axis=0), atol=1e-4)
    np.testing.assert_allclose(background.smooth_sigma, np.std([smoothed(to_planes(i)) for i in images], axis=0), atol=1e-4)


def test_a_still_pixel_has_no_deviation_at_all():
    assert (learn_statistics([np.full((4, 4), 137, np.uint8)] * 7).sigma == 0).all()


@given(st.integers(1, 40), st.integers(0, 400))
def test_spread_keeps_few_and_evenly(count, number):
    kept = Spread(count)
    for n in range(number):
        kept.add(np.array([[n % 256, n // 256]], np.uint8))
    places = [int(image[0, 0]) + 256 * int(image[0, 1]) for image in kept.kept]
    assert min(number, count) <= len(places) <= max(2 * count - 1, 1) if count > 1 else len(places) == min(number, 1)
    assert len(set(np.diff(places))) <= 1
    if places:
        assert places[0] == 0
        assert number - places[-1] <= max(np.diff(places), default=number)


def test_spread_copies(rng):
    image, kept = np.zeros((2, 2), np.uint8), Spread(3)
    kept.add(image)
    image[:] = 9
    assert kept.kept[0].max() == 0


def passing(rng: np.random.Generator, wall: np.ndarray, count=30) -> Iterator[np.ndarray]:
    """A film in which a dark block crosses the picture."""
    for n in range(count):
        picture = wall.copy()
        picture[30:110, 5 * n : 5 * n + 30] = (30, 30, 30)
        yield shot(rng, picture)


def test_background_from_film_sees_behind_who_passes(rng):
    wall = scene(rng)
    background = background_from_film(passing(rng, wall))
    assert background.shape == wall.shape
    assert background.dtype == np.uint8
    assert np.abs(background - wall).max() < 6
    assert background_from_film([grey(i) for i in passing(rng, wall)]).shape == SIZE


def test_background_from_film_needs_a_film(rng):
    with pytest.raises(SilhouetteError, match="2 frames, expected at least 3"):
        background_from_film(empty_shots(rng, scene(rng), 2))
    with pytest.raises(SilhouetteError, match="80 x 60 colour, expected 160 x 120 colour"):
        background_from_film([*empty_shots(rng, scene(rng), 3), np.zeros((60, 80, 3), np.uint8)])


@given(st.floats(0.5, 4))
@settings(max_examples=10, deadline=None)
def test_film_noise_is_the_films_and_not_the_persons(noise):
    rng = np.random.default_rng(1)
    wall = np.full((*SIZE, 3), 128.0)
    quiet = dressed(wall, figure())
    frames = [shot(rng, quiet, noise) for _ in range(6)]
    measured = film_noise(frames, to_planes(wall.astype(np.uint8)).astype(np.float32))[0]
    smooth = np.std([smoothed(to_planes(shot(rng, wall, noise)).astype(np.float32))[..., 0] for _ in range(4)])
    assert smooth < measured < 1.7 * smooth


# ---------------------------------------------------------------- silhouettes


@pytest.mark.parametrize("method", CLEANED)
def test_the_person_is_found(rng, method):
    wall, mask = scene(rng), figure()
    segmenter = learn_background(empty_shots(rng, wall), SilhouetteSettings(method=method))
    found = segmenter(shot(rng, dressed(wall, mask)))
    assert found.shape == SIZE
    assert found.dtype == bool
    assert overlap(found, mask) > 0.97
    assert found[39, 136:147].mean() > 0.8  # the finger
    assert not found[66:74, 53:60].any()  # between arm and body


def test_it_works_from_a_single_picture_and_from_the_film_itself(rng):
    wall, mask = scene(rng), figure()
    away = empty_shots(rng, wall, 8)
    frames = [*away[:4], *(shot(rng, dressed(wall, np.roll(mask, s, 1))) for s in range(-30, 30, 10)), *away[4:]]
    for background in (shot(rng, wall), background_from_film(frames)):
        segmenter = learn_background([background], film=frames)
        assert overlap(segmenter(shot(rng, dressed(wall, mask))), mask) > 0.97


@pytest.mark.parametrize("method", METHODS)
def test_a_mask_depends_on_no_other_frame(rng, method):
    wall = scene(rng)
    segmenter = learn_background(empty_shots(rng, wall), SilhouetteSettings(method=method))
    image, other = shot(rng, dressed(wall, figure())), shot(rng, 255 - wall)
    first = segmenter(image)
    for _ in range(30):
        segmenter(other)
    np.testing.assert_array_equal(segmenter(image), first)
    assert image.flags.writeable


@pytest.mark.parametrize("method", METHODS)
def test_pictures_are_left_as_they_are(rng, method):
    wall = scene(rng)
    images = empty_shots(rng, wall, 4)
    kept = [i.copy() for i in images]
    learn_background(images, SilhouetteSettings(method=method), film=images)(images[0])
    for image, copy in zip(images, kept):
        np.testing.assert_array_equal(image, copy)


def test_nobody_and_everything_are_no_errors(rng):
    wall = scene(rng)
    segmenter = learn_background(empty_shots(rng, wall))
    assert not segmenter(shot(rng, wall)).any()
    assert segmenter(np.zeros((*SIZE, 3), np.uint8)).mean() > 0.95


@pytest.mark.parametrize("method", ["brightness", "colour", "both", "mog2", "knn"])
def test_shadow_is_background_and_dark_clothes_are_not(rng, method):
    wall, mask = scene(rng, (190, 140, 90)), figure()
    picture = dressed(wall, mask, shirt=(25, 25, 25))
    shade = np.zeros(SIZE, bool)
    shade[90:118, 97:150] = True
    picture[shade & ~mask] *= 0.7
    images = empty_shots(rng, wall)
    found = {s: learn_background(images, SilhouetteSettings(method=method, shadow=s))(shot(rng, picture)) for s in (True, False)}
    assert overlap(found[True], mask) > 0.95
    assert found[True][shade].mean() < 0.05
    assert found[False][shade].mean() > 0.9


def test_specks_go_and_a_hand_that_nearly_touches_stays():
    mask = np.zeros((60, 60), np.uint8)
    mask[10:40, 10:40] = 1
    mask[20:26, 41:50] = 1  # a hand
    mask[50:53, 50:53] = 1  # a speck
    mask[1:9, 52:60] = 1  # something as large as a hand, far away
    kept = person(mask, mask > 0)
    assert kept[10:40, 10:50].sum() == mask[10:40, 10:50].sum()
    assert kept.sum() == kept[10:40, 10:50].sum()
    assert not person(mask, np.zeros(mask.shape, bool)).any()


def test_small_holes_are_filled_and_gaps_and_notches_are_not():
    mask = np.zeros((80, 80), np.uint8)
    mask[10:80, 10:70] = 1
    mask[20:22, 20:22] = 0
    mask[40:50, 30:40] = 0
    mask[78:80, 50:52] = 0
    filled = without_holes(mask)
    assert filled[20:22, 20:22].all()
    assert not filled[40:50, 30:40].any()
    assert not filled[78:80, 50:52].any()


def test_what_hangs_on_by_a_thread_goes_and_pinholes_are_filled():
    label, contrast = np.zeros((80, 120), np.uint8), np.zeros((80, 120), np.float32)
    label[10:70, 10:70] = 2
    label[40:43, 70:100] = 1  # noise that joins
    label[35:48, 100:110] = 2  # something else
    contrast[label == 2] = 60
    contrast[label == 1] = 4
    label[30:33, 30:33] = contrast[30:33, 30:33] = 0
    found = clean(label, lambda window: np.ascontiguousarray(contrast[window]), Outline(SHARP, 6))
    assert overlap(found > 0, np.pad(np.ones((60, 60), bool), ((10, 10), (10, 50)))) > 0.99
    assert found[30:33, 30:33].all()
    assert not found[:, 75:].any()


def test_the_films_noise_counts_where_the_background_is_one_clean_picture(rng):
    wall = scene(rng)
    film = [shot(rng, wall, 9) for _ in range(6)]
    plate = wall.astype(np.uint8)
    assert learn_background([plate])(film[0]).any()
    assert not any(learn_background([plate], film=film)(image).any() for image in film)


def test_a_trembling_camera_makes_no_silhouette_of_edges(rng):
    wall = np.where(np.arange(SIZE[1])[:, None] // 20 % 2, (200, 190, 180), (60, 70, 80)) + np.zeros((*SIZE, 3))
    segmenter = learn_background(empty_shots(rng, wall))
    shifted = cv2.warpAffine(wall, np.array([[1, 0, 0.12], [0, 1, 0]]), SIZE[::-1], borderMode=cv2.BORDER_REPLICATE)
    assert not (segmenter.rule(shot(rng, shifted)) == 2).any()


def test_one_neighbour_is_not_enough(rng):
    wall = scene(rng)
    images = empty_shots(rng, wall, 7)
    images[3][50:80, 50:80] = 20  # somebody was in the way once
    image = shot(rng, wall)
    image[50:80, 50:80] = 20
    segmenter = learn_background(images, SilhouetteSettings(method="knn", shadow=False))
    assert segmenter(image)[52:78, 52:78].all()


# ---------------------------------------------------------------- outlines


def blurred_disc(radius: float, blur: float, strength: float) -> tuple[np.ndarray, np.ndarray]:
    """A disc, and its contrast as a blurring camera sees it (by supersampling)."""
    y, x = np.mgrid[:400, :400] / 4 - 49.5 + 1 / 8 - 0.25
    exact = (np.hypot(x, y) < radius).astype(np.float32)
    small = cv2.resize(cv2.GaussianBlur(exact, (0, 0), 4 * blur) if blur else exact, (100, 100), interpolation=cv2.INTER_AREA)
    return small > 0.5, (strength * small).astype(np.float32)


@pytest.mark.parametrize("blur", [0, 1.0, 2.0])
@pytest.mark.parametrize("strength", [30, 200])
@pytest.mark.parametrize("grown", [0, 1, 2])
def test_the_outline_lies_at_half_contrast_however_far_the_first_mask_reaches(blur, strength, grown):
    exact, seen = blurred_disc(25, blur, strength)
    first = cv2.dilate(exact.astype(np.uint8), np.ones((2 * grown + 1, 2 * grown + 1), np.uint8))
    width = max(SHARP, round(2 * blur)) + grown
    found = at_half_contrast(first, seen, Outline(width, 6)) > 0
    offset = (np.count_nonzero(found & ~exact) - np.count_nonzero(exact & ~found)) / (2 * np.pi * 25)
    assert abs(offset) < 0.15


def test_blurred_films_have_wide_outlines():
    widths = []
    for blur in (0, 1.5, 3):
        _, seen = blurred_disc(25, blur, 150)
        widths.append(outline_width([((seen > 8).astype(np.uint8), seen)] * 2))
    assert widths[0] == SHARP
    assert widths[0] < widths[1] < widths[2]
    assert outline_width([]) == SHARP


def test_a_blurred_film_is_known_by_a_person_whom_the_border_cuts():
    _, seen = blurred_disc(35, 2.5, 150)
    half = np.ascontiguousarray(seen[:50])
    whole = outline_width([((seen > 8).astype(np.uint8), seen)])
    assert outline_width([((half > 8).astype(np.uint8), half)]) == whole > SHARP


def test_fingertips_stay_and_bled_gaps_open():
    mask = np.zeros((60, 60), np.uint8)
    mask[10:50, 10:40] = mask[30, 40:50] = 1
    contrast = 100 * mask.astype(np.float32)
    contrast[12:48, 24:27] = 10  # a gap, with the colour that the codec bled into it
    found = at_half_contrast(mask, contrast, Outline(SHARP, 6)) > 0
    assert found[30, 40:50].all()
    assert not found[14:46, 24:27].any()
    assert found[12:48, 12:22].all()


def test_where_the_border_cuts_a_person_nothing_is_taken_off():
    mask = np.zeros((40, 40), np.uint8)
    mask[10:, 10:30] = 1
    contrast = 100 * mask.astype(np.float32)
    contrast[-1, 10:30] = 40
    assert at_half_contrast(mask, contrast, Outline(SHARP, 6))[-1, 12:28].all()


def test_the_border_of_the_picture_is_no_outline(rng):
    wall, mask = scene(rng), figure()
    found = learn_background(empty_shots(rng, wall))(shot(rng, dressed(wall, mask)))
    assert found[-1, 66:95].all()


# ---------------------------------------------------------------- the key


def test_black_clothes_before_dark_blue_are_keyed_by_colour(rng):
    wall, mask = scene(rng, (185, 20, 5)), figure()
    picture = dressed(wall, mask, shirt=(8, 2, 2))
    segmenter = learn_background([shot(rng, wall)])
    assert segmenter.key == "colour"
    assert "% of ordinary clothes and skin" in segmenter.reason
    assert overlap(segmenter(shot(rng, picture)), mask) > 0.95


def test_a_grey_wall_needs_both(rng):
    segmenter = learn_background(empty_shots(rng, scene(rng, (128, 135, 130))))
    assert segmenter.key == "both"
    assert segmenter.reason.startswith("both: ")


@pytest.mark.parametrize("channels", [1, 3])
def test_films_without_colour_are_keyed_by_brightness(rng, channels):
    wall, mask = scene(rng), figure()

    def filmed(picture):
        return grey(shot(rng, picture)) if channels == 1 else np.repeat(grey(shot(rng, picture))[..., None], 3, 2)

    images, image = [filmed(wall) for _ in range(8)], filmed(dressed(wall, mask, skin=(60, 60, 60)))
    segmenter = learn_background(images)
    assert segmenter.key == "brightness"
    assert "no colour" in segmenter.reason
    assert overlap(segmenter(image), mask) > 0.95
    for method in ("colour", "both"):
        with pytest.raises(SettingsError, match=f"found {method} for a film without colour, expected one of auto, averaging"):
            learn_background(images, SilhouetteSettings(method=method))


def test_colour_that_is_mere_noise_is_left_alone(rng):
    noisy = []
    for image in empty_shots(rng, scene(rng, (70, 70, 70))):
        planes = to_planes(image)
        planes[..., 1:] = np.clip(128 + rng.normal(0, 60, (*SIZE, 2)), 0, 255)
        noisy.append(np.asarray(cv2.cvtColor(planes, cv2.COLOR_YCrCb2BGR), np.uint8))
    segmenter = learn_background(noisy)
    assert segmenter.key == "brightness"
    assert "adds nothing" in segmenter.reason


def test_the_wardrobe_is_of_true_colours(rng):
    skin = learn_background(empty_shots(rng, scene(rng, (155, 180, 225)))).rule
    other = learn_background(empty_shots(rng, scene(rng, (225, 180, 155)))).rule
    assert isinstance(skin, KeyRule)
    assert isinstance(other, KeyRule)
    assert wardrobe_share(skin) < wardrobe_share(other) - 0.03


@pytest.mark.parametrize("method", METHODS[1:])
def test_a_method_that_is_set_is_kept(rng, method):
    segmenter = learn_background(empty_shots(rng, scene(rng)), SilhouetteSettings(method=method))
    assert segmenter.key == method
    assert segmenter.reason == f"{method}: as set"


# ---------------------------------------------------------------- bad input


def test_pictures_that_do_not_fit_are_refused(rng):
    images = empty_shots(rng, scene(rng), 3)
    segmenter = learn_background(images)
    for call in (segmenter, segmenter.raw):
        with pytest.raises(SilhouetteError, match="frame: found 80 x 60 colour, expected 160 x 120 colour"):
            call(np.zeros((60, 80, 3), np.uint8))
        with pytest.raises(SilhouetteError, match="found 160 x 120 grey, expected 160 x 120 colour"):
            call(np.zeros(SIZE, np.uint8))
        with pytest.raises(SilhouetteError, match="type float64, expected 8 bits"):
            call(np.full((*SIZE, 3), np.nan))
        with pytest.raises(SilhouetteError, match=r"shape \(120, 160, 4\)"):
            call(np.zeros((*SIZE, 4), np.uint8))
    with pytest.raises(SilhouetteError, match="film frame 0: found 80 x 60"):
        learn_background(images, film=[np.zeros((60, 80, 3), np.uint8)])
    with pytest.raises(SilhouetteError, match="background frame 1: found 80 x 60"):
        learn_background([images[0], np.zeros((60, 80, 3), np.uint8)])
    with pytest.raises(SilhouetteError, match="background frame 0: found list"):
        learn_background([[1, 2]])  # pyright: ignore[reportArgumentType]


def test_no_background_is_told(rng):
    with pytest.raises(SilhouetteError, match=r"found no frame.*film itself"):
        learn_background([])


@pytest.mark.parametrize("values", [{"method": "magic"}, {"factor": 0}, {"factor": float("nan")}, {"noise_floor": -1}, {"k": 1}])
def test_settings_are_checked(values):
    with pytest.raises(ValidationError):
        SilhouetteSettings(**values)


# ---------------------------------------------------------------- ready masks


def test_ready_masks_are_read(rng):
    mask = figure()
    picture = (255 * mask).astype(np.uint8)
    np.testing.assert_array_equal(ready_mask(picture), mask)
    np.testing.assert_array_equal(ready_mask(np.repeat(picture[..., None], 3, 2)), mask)
    np.testing.assert_array_equal(ready_mask(mask), mask)
    lossy = np.clip(picture + rng.normal(0, 8, SIZE), 0, 255).astype(np.uint8)
    np.testing.assert_array_equal(ready_mask(lossy), mask)
    for value in (127, 128):
        assert ready_mask(np.where(np.arange(200) < 5, value, 0).astype(np.uint8)[None]).sum() == 5 * (value == 128)
    assert not ready_mask(np.zeros(SIZE, np.uint8)).any()


def test_what_is_no_mask_is_refused(rng):
    photo = shot(rng, scene(rng))
    with pytest.raises(SilhouetteError, match=r"in colour.*under video"):
        ready_mask(photo)
    with pytest.raises(SilhouetteError, match="neither dark nor bright"):
        ready_mask(grey(photo))
    with pytest.raises(SilhouetteError, match="values 0 and 1"):
        ready_mask(figure().astype(np.uint8))
    with pytest.raises(SilhouetteError, match="type float64"):
        ready_mask(figure().astype(float))
    with pytest.raises(SilhouetteError, match=r"shape \(3,\)"):
        ready_mask(np.zeros(3, np.uint8))


def test_importing_it_is_cheap():
    code = "import sys, shadowpuppet.silhouette; print([m for m in ('cv2', 'numba', 'av') if m in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip() == "[]"


# ---------------------------------------------------------------- recordings


def read(path: Path, every: int) -> Iterator[np.ndarray]:
    from shadowpuppet.video import open_frames

    return (frame.image for frame in islice(open_frames(path), 0, None, every))


@pytest.mark.shared
@pytest.mark.parametrize("name", ["upper_body", "reaching"])
def test_recordings_are_segmented(shared, name):
    folder = shared / "recordings" / name
    images, exact = list(read(folder / "video/cam.mp4", 12)), [ready_mask(m) for m in read(folder / "masks/cam.mkv", 12)]
    segmenter = learn_background(read(folder / "background/cam.mp4", 1), film=images)
    assert segmenter.key == "both"
    found = [segmenter(i) for i in images]
    assert np.mean([overlap(a, b) for a, b in zip(found, exact)]) > 0.98
    surplus = np.mean([np.count_nonzero(a) - np.count_nonzero(b) for a, b in zip(found, exact)])
    assert abs(surplus) < 0.01 * np.mean([np.count_nonzero(m) for m in exact])
    assert 0.55 < np.mean([overlap(segmenter.raw(a), b) for a, b in zip(images, exact)]) < 0.7


@pytest.mark.shared
def test_the_dancer_is_keyed_by_colour(shared):
    folder = shared / "real" / "dancer"
    if not folder.is_dir():
        pytest.skip("the dancer is not here")
    images = list(read(folder / "video/cam.mp4", 50))
    segmenter = learn_background(read(folder / "background/cam.png", 1), film=images)
    assert segmenter.key == "colour"
    # The wall is blue, so what is hardly blue is the dancer.
    blue = [i[..., 0].astype(int) - i[..., 1:].max(axis=2) for i in images]
    assert np.mean([overlap(segmenter(i), b < 85) for i, b in zip(images, blue)]) > 0.93
