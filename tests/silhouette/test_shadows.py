"""Dark limbs before a background of their own hue, and shadows: what is kept and what is not."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from silhouette_scenes import SIZE, empty_shots, overlap, scene, shot

from shadowpuppet.silhouette import SilhouetteSettings, learn_background
from shadowpuppet.silhouette.classifiers import ChannelClassifier
from shadowpuppet.silhouette.shadows import INWARD_STEP, MAX_SHADE, MAYBE_SHADOW, OUTWARD_STEP, _part_sums, resolve_shadows

SKIN_WALL = (90, 110, 150)
"""A wall of the hue of skin; blue green red."""


def trunk_and_head() -> tuple[np.ndarray, np.ndarray]:
    """A blue trunk's mask (H, W), and that of a head on it."""
    trunk, head = np.zeros(SIZE, np.uint8), np.zeros(SIZE, np.uint8)
    cv2.rectangle(trunk, (60, 50), (100, 119), 1, -1)
    cv2.ellipse(head, (80, 34), (12, 17), 0, 0, 360, 1, -1)
    return trunk > 0, (head > 0) & ~(trunk > 0)


def round_light(mask: np.ndarray, low: float, high: float) -> np.ndarray:
    """Light on something round (H, W): brighter on its left."""
    x = np.mgrid[: SIZE[0], : SIZE[1]][1]
    columns = np.flatnonzero(mask.any(0))
    return np.interp(x, [columns[0], columns[-1]], [high, low])


def seen(rng: np.random.Generator, picture: np.ndarray, wall: np.ndarray) -> np.ndarray:
    return learn_background(empty_shots(rng, wall), SilhouetteSettings(method="both"))(shot(rng, picture))


def test_a_dark_head_before_a_wall_of_its_hue_is_the_persons(rng):
    wall = scene(rng, SKIN_WALL)
    trunk, head = trunk_and_head()
    picture = wall.copy()
    picture[head] = (wall * round_light(head, 0.55, 0.72)[..., None])[head]
    picture[trunk] = (150, 40, 40)
    assert overlap(seen(rng, picture, wall), trunk | head) > 0.95


@pytest.mark.parametrize("light", [0.6, 0.7, 0.8])
def test_an_even_shadow_on_the_wall_beside_a_person_is_not(rng, light):
    """As a lamp throws it, with sharp edges."""
    wall = scene(rng, SKIN_WALL)
    trunk, head = trunk_and_head()
    shadow = np.roll(trunk | head, 14, axis=1) & ~trunk & ~head
    picture = wall.copy()
    picture[shadow] *= light
    picture[head], picture[trunk] = (150, 200, 220), (150, 40, 40)
    assert overlap(seen(rng, picture, wall), trunk | head) > 0.95


def test_what_is_taken_for_shadow_is_known(rng):
    wall = scene(rng, SKIN_WALL)
    trunk, head = trunk_and_head()
    picture = wall.copy()
    picture[head] *= 0.7  # evenly, as a shadow is
    picture[trunk] = (150, 40, 40)
    segmenter = learn_background(empty_shots(rng, wall), SilhouetteSettings(method="both"))
    found = segmenter.segmented(segmenter.labelled(shot(rng, picture)))
    assert overlap(found.mask, trunk) > 0.95
    assert np.count_nonzero(found.shadow & head) > 0.9 * np.count_nonzero(head)
    assert not (found.shadow & found.mask).any()


@pytest.mark.parametrize("method", ["colour", "averaging", "mog2"])
def test_a_method_that_tells_no_shadows_has_none(rng, method):
    segmenter = learn_background(empty_shots(rng, scene(rng, SKIN_WALL)), SilhouetteSettings(method=method))
    found = segmenter.segmented(segmenter.labelled(shot(rng, scene(rng, SKIN_WALL))))
    assert found.shadow is None


def test_a_soft_shadow_that_the_person_stands_in_is_not(rng):
    wall = scene(rng, SKIN_WALL)
    trunk, head = trunk_and_head()
    blot = np.zeros(SIZE, np.float32)
    cv2.ellipse(blot, (110, 100), (34, 14), 0, 0, 360, 1, -1)
    picture = wall * (1 - 0.45 * cv2.GaussianBlur(blot, (0, 0), 7))[..., None]
    picture[head], picture[trunk] = (150, 200, 220), (150, 40, 40)
    assert overlap(seen(rng, picture, wall), trunk | head) > 0.95


# Laws


def random_labels(rng: np.random.Generator, shape: tuple[int, int]) -> tuple[np.ndarray, ...]:
    """Labels in patches, and planes, mean and inverse sigma."""
    label = cv2.resize(rng.integers(0, 4, (shape[0] // 8, shape[1] // 8), np.uint8), shape[::-1], interpolation=cv2.INTER_NEAREST)
    mean = rng.uniform(60, 200, (*shape, 3)).astype(np.float32)
    planes = np.clip(mean * rng.uniform(0.4, 1, (*shape, 1)) + rng.normal(0, 3, mean.shape), 0, 255).astype(np.uint8)
    return label, planes, mean, (1 / rng.uniform(1, 4, mean.shape)).astype(np.float32)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=30, deadline=None)
def test_only_what_was_asked_of_is_decided(seed):
    label, planes, mean, inverse_sigma = random_labels(np.random.default_rng(seed), (40, 52))
    before = label.copy()
    found = resolve_shadows(label, planes, mean, inverse_sigma)
    np.testing.assert_array_equal(label, before)
    np.testing.assert_array_equal(found[before != MAYBE_SHADOW], before[before != MAYBE_SHADOW])
    assert set(np.unique(found[before == MAYBE_SHADOW])) <= {0, 1}


def test_nothing_asked_is_nothing_changed(rng):
    label, *rest = random_labels(rng, (40, 52))
    label[label == MAYBE_SHADOW] = 0
    np.testing.assert_array_equal(resolve_shadows(label, *rest), label)


@given(st.integers(0, 2**32 - 1), st.sampled_from(["brightness", "colour", "both"]), st.sampled_from([0.5, 1.0]))
@settings(max_examples=30, deadline=None)
def test_what_is_reported_at_once_is_what_every_pixel_tells(seed, key, darkest):
    """The box of sure background changes no label, and a pixel that is just the background is in it."""
    rng = np.random.default_rng(seed)
    _, _, mean, inverse_sigma = random_labels(rng, (24, 20))
    planes = np.clip(mean + rng.normal(0, 4, mean.shape), 0, 255).astype(np.uint8)
    planes[0, 0] = mean[0, 0] = 100
    rule = ChannelClassifier(key, mean, inverse_sigma, float(rng.uniform(0.5, 4)), darkest)
    plain = ChannelClassifier(key, mean, inverse_sigma, rule.factor, darkest)
    plain.__dict__["surely_background"] = np.full_like(planes, 255), np.zeros_like(planes)
    assert (cv2.inRange(planes, *rule.surely_background) > 0).any()
    np.testing.assert_array_equal(rule.labels(planes, MAX_SHADE), plain.labels(planes, MAX_SHADE))


# The kernel and its naive twin


def naive_sums(parts, number, label, top, left, planes, mean, inverse_sigma):
    out = np.zeros((number, 11))
    light = planes[..., 0] / np.maximum(mean[..., 0], 1)
    hue = ((planes[..., 1:] - 128.0) - light[..., None] * (mean[..., 1:] - 128.0)) * inverse_sigma[..., 1:]
    whole = np.zeros(label.shape, int)
    whole[top : top + parts.shape[0], left : left + parts.shape[1]] = parts
    for y, x in np.argwhere(whole):
        part, same, k = whole[y, x], 0, whole[y, x]
        out[k, 0] += 1
        for d in np.array([(-1, 0), (1, 0), (0, -1), (0, 1)]):
            at = np.array([y, x]) + d
            if (at < 0).any() or (at >= label.shape).any():
                continue
            if whole[tuple(at)] == part:
                same += 1
                continue
            out[k, 7] += 1
            far, near = np.array([y, x]) + OUTWARD_STEP * d, np.array([y, x]) - INWARD_STEP * d
            if label[tuple(at)]:
                out[k, 8] += 1
            elif min(*far, *near) >= 0 and (np.maximum(far, near) < label.shape).all():
                out[k, 9] += 1
                out[k, 10] += light[tuple(far)] - light[tuple(near)]
        reach = [whole[at] if min(at) >= 0 and (np.array(at) < label.shape).all() else -1 for at in deep(y, x)]
        inside = top + 2 <= y < top + parts.shape[0] - 2 and left + 2 <= x < left + parts.shape[1] - 2
        if same == 4 and inside and set(reach) == {part}:
            out[k, 1:7] += [1, light[y, x], light[y, x] ** 2, *hue[y, x], mean[y, x, 0] * inverse_sigma[y, x, 0]]
    return out


def deep(y: int, x: int) -> list[tuple[int, int]]:
    return [(y - 2, x), (y + 2, x), (y, x - 2), (y, x + 2)]


@pytest.mark.kernels
@given(st.integers(0, 2**32 - 1))
@settings(max_examples=10, deadline=None)
def test_sums_over_parts_are_those_of_the_naive_twin(seed):
    rng = np.random.default_rng(seed)
    label, planes, mean, inverse_sigma = random_labels(rng, (24, 20))
    top, left = (int(n) for n in rng.integers(0, 6, 2))
    window = np.ascontiguousarray((label == MAYBE_SHADOW).astype(np.uint8)[top : top + 16, left : left + 13])
    number, parts = cv2.connectedComponents(window, connectivity=4)
    label[label == MAYBE_SHADOW] = 0
    found = _part_sums(parts, number, label, top, left, planes, mean, inverse_sigma)
    np.testing.assert_allclose(found, naive_sums(parts, number, label, top, left, planes, mean, inverse_sigma), rtol=1e-4, atol=1e-4)
