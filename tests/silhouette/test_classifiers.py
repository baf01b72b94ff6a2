from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.ndimage import distance_transform_edt
from silhouette_scenes import CLEANED, SIZE, dressed, empty_shots, figure, grey, scene, shot

from shadowpuppet.errors import SilhouetteError
from shadowpuppet.silhouette import SilhouetteSettings, learn_background
from shadowpuppet.silhouette._kernels import classify, contrast
from shadowpuppet.silhouette.background import FrameSampler, film_noise, learn_statistics, smoothed, to_planes
from shadowpuppet.silhouette.boundary import LIMB_WIDTH_SHARE, SHARP_WIDTH, EdgeProfile, at_half_contrast, outline_width
from shadowpuppet.silhouette.classifiers import CELL, AveragingClassifier, ChannelClassifier

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
    rule = AveragingClassifier.of(mean, sigma, factor)
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
    squared = plain = ((i - b) ** 2 * keyed).sum(-1)
    if darkest < 1:
        light = (i * b * shadowed).sum(-1) / np.maximum((b * b * shadowed).sum(-1), 1e-6)
        light = np.clip(light, darkest, 1)[..., None]
        squared = np.minimum(squared, ((i - light * b) ** 2 * shadowed).sum(-1))
    return squared, plain, np.uint8(squared >= weak**2) + np.uint8(squared >= strong**2)


@pytest.mark.kernels
@given(st.integers(0, 2**32 - 1), st.sampled_from([(1, 0, 0), (0, 1, 1), (1, 1, 1)]), st.sampled_from([0.3, 0.5, 1.0]),
       st.sampled_from([0.0, 0.8]))
@settings(max_examples=20, deadline=None)
def test_classify_is_its_naive_twin(seed, keyed, darkest, asked):
    rng = np.random.default_rng(seed)
    planes = rng.integers(0, 256, (9, 7, 3), dtype=np.uint8)
    mean = np.clip(planes * rng.uniform(0.5, 1.5, (9, 7, 1)) + rng.normal(0, 4, planes.shape), 0, 255).astype(np.float32)
    inverse_sigma = (1 / rng.uniform(1, 4, planes.shape)).astype(np.float32)
    keyed, label = np.array(keyed, np.float32), np.empty((9, 7), np.uint8)
    within = rng.random((9, 7)) < 0.3
    classify(planes, within, mean, inverse_sigma, keyed, np.ones(3, np.float32), *map(np.float32, (darkest, asked, 2, 4)), label)
    squared, plain, expected = naive_labels(planes, mean, inverse_sigma, keyed, np.ones(3), darkest, 2, 4)
    expected[(squared < 4) & (plain >= 4) & (planes[..., 0] < asked * mean[..., 0]) & (darkest < 1)] = 3
    expected[within] = 0
    clear = (np.abs(squared - 4) > 1e-2) & (np.abs(squared - 16) > 1e-2) & (np.abs(plain - 4) > 1e-2)
    np.testing.assert_array_equal(label[clear], expected[clear])


@pytest.mark.kernels
def test_contrast_is_its_naive_twin(rng):
    planes, mean = rng.integers(0, 256, (9, 7, 3), dtype=np.uint8), rng.uniform(0, 255, (9, 7, 3)).astype(np.float32)
    out, seen, where = np.empty((9, 7), np.float32), np.array([1, 0.5, 0], np.float32), rng.integers(0, 2, (9, 7), dtype=np.uint8)
    contrast(planes, mean, seen, where, out)
    np.testing.assert_allclose(out, np.sqrt(((planes - mean) ** 2 * seen).sum(-1)) * where, rtol=1e-5)


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
    kept = FrameSampler(count)
    for n in range(number):
        kept.add(np.array([[n % 256, n // 256]], np.uint8))
    places = [int(image[0, 0]) + 256 * int(image[0, 1]) for image in kept.kept]
    assert min(number, count) <= len(places) <= max(2 * count - 1, 1) if count > 1 else len(places) == min(number, 1)
    assert len(set(np.diff(places))) <= 1
    if places:
        assert places[0] == 0
        assert number - places[-1] <= max(np.diff(places), default=number)


def test_spread_copies(rng):
    image, kept = np.zeros((2, 2), np.uint8), FrameSampler(3)
    kept.add(image)
    image[:] = 9
    assert kept.kept[0].max() == 0


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
    width = max(SHARP_WIDTH, round(2 * blur)) + grown
    found = at_half_contrast(first, lambda where: seen, EdgeProfile(width, 6)) > 0
    offset = (np.count_nonzero(found & ~exact) - np.count_nonzero(exact & ~found)) / (2 * np.pi * 25)
    assert abs(offset) < 0.15


@pytest.fixture
def thick(monkeypatch):
    """Whoever is blurred has no thin limbs."""
    monkeypatch.setattr("shadowpuppet.silhouette.boundary.LIMB_WIDTH_SHARE", 1.0)


def test_blurred_films_have_wide_outlines(thick):
    widths = []
    for blur in (0, 1.5, 3):
        _, seen = blurred_disc(25, blur, 150)
        widths.append(outline_width([((seen > 8).astype(np.uint8), seen)] * 2))
    assert widths[0] == SHARP_WIDTH
    assert widths[0] < widths[1] < widths[2]
    assert outline_width([]) == SHARP_WIDTH


def test_stripes_of_clothes_are_not_taken_for_blur_wider_than_half_an_arm(rng):
    """Dull sleeves and a bright, striped trunk in a small picture: the contrast climbs inward for eight pixels."""
    mask = np.zeros((60, 80), np.uint8)
    mask[20:60, 30:50] = mask[22:26, 8:72] = 1
    depth = distance_transform_edt(mask)
    contrast = np.float32(mask * (20 + 12 * np.minimum(depth, 8)))
    width = outline_width([(mask, contrast)])
    assert SHARP_WIDTH <= width <= np.ceil(LIMB_WIDTH_SHARE * np.sqrt(mask.sum()))
    arm = at_half_contrast(mask, lambda where: contrast, EdgeProfile(width, 6))[22:26, 10:28]
    assert arm.all()
    assert not at_half_contrast(mask, lambda where: contrast, EdgeProfile(6, 6))[22:26, 10:28].all()  # what it would be without


def test_a_blurred_film_is_known_by_a_person_whom_the_border_cuts(thick):
    _, seen = blurred_disc(35, 2.5, 150)
    half = np.ascontiguousarray(seen[:50])
    whole = outline_width([((seen > 8).astype(np.uint8), seen)])
    assert outline_width([((half > 8).astype(np.uint8), half)]) == whole > SHARP_WIDTH


def test_fingertips_stay_and_bled_gaps_open():
    mask = np.zeros((60, 60), np.uint8)
    mask[10:50, 10:40] = mask[30, 40:50] = 1
    contrast = 100 * mask.astype(np.float32)
    contrast[12:48, 24:27] = 10  # a gap, with the colour that the codec bled into it
    found = at_half_contrast(mask, lambda where: contrast, EdgeProfile(SHARP_WIDTH, 6)) > 0
    assert found[30, 40:50].all()
    assert not found[14:46, 24:27].any()
    assert found[12:48, 12:22].all()


def test_where_the_border_cuts_a_person_nothing_is_taken_off():
    mask = np.zeros((40, 40), np.uint8)
    mask[10:, 10:30] = 1
    contrast = 100 * mask.astype(np.float32)
    contrast[-1, 10:30] = 40
    assert at_half_contrast(mask, lambda where: contrast, EdgeProfile(SHARP_WIDTH, 6))[-1, 12:28].all()


def test_the_border_of_the_picture_is_no_outline(rng):
    wall, mask = scene(rng), figure()
    found = learn_background(empty_shots(rng, wall))(shot(rng, dressed(wall, mask)))
    assert found[-1, 66:95].all()


# ---------------------------------------------------------------- the window of a frame that differs


@pytest.mark.parametrize("place", [(20, 30), (0, 0), (60, 100)])
def test_only_the_window_that_differs_is_classified_and_nothing_changes(rng, place, monkeypatch):
    wall, (top, left), person = scene(rng), place, np.zeros(SIZE, bool)
    person[top : top + 40, left : left + 16] = True
    person[top + 10 : top + 13, left : left + 40] = True  # an arm that is narrower than a cell
    segmenter, image = learn_background(empty_shots(rng, wall), SilhouetteSettings()), shot(rng, dressed(wall, person))
    assert isinstance(segmenter.classifier, ChannelClassifier)
    window = segmenter.classifier.different(image)
    assert person[window].sum() == person.sum()
    assert person[window].size < person.size / 2
    small = segmenter(image)
    monkeypatch.setattr(ChannelClassifier, "different", lambda self, image: (slice(None), slice(None)))
    np.testing.assert_array_equal(small, segmenter(image))
    assert small.any()


@pytest.mark.parametrize("size", [(3, 50), (50, 2), (5, 7)])
def test_pictures_of_less_than_a_cell_are_classified_whole(rng, size):
    wall = scene(rng)[: size[0], : size[1]]
    found = learn_background(empty_shots(rng, wall), SilhouetteSettings(method="brightness"))
    assert isinstance(found.classifier, ChannelClassifier)
    assert found(shot(rng, wall)).shape == size
    if min(size) < CELL:
        assert found.classifier.different(shot(rng, wall)) == (slice(None), slice(None))
