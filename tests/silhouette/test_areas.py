"""Colours averaged over areas in noisy films."""

import numpy as np

from shadowpuppet.silhouette import learn_background
from shadowpuppet.silhouette.areas import RADIUS, AreaFilter, with_areas
from shadowpuppet.silhouette.background import FilmNoise, to_planes
from shadowpuppet.silhouette.classifiers import ChannelClassifier

FLOOR, TROUSERS, WALL = (62, 62, 78), (34, 42, 38), (150, 140, 130)  # blue, green, red


def room():
    """A wall above a reddish floor."""
    image = np.full((96, 96, 3), WALL, np.uint8)
    image[40:] = FLOOR
    return image


def person():
    """Someone in a light shirt and dark greenish trousers, before the floor; and where they are."""
    image, mask = room(), np.zeros((96, 96), bool)
    image[15:45, 35:60], image[45:88, 38:57] = (60, 200, 220), TROUSERS
    mask[15:45, 35:60], mask[45:88, 38:57] = True, True
    return image, mask


def noisy(rng, image, sd):
    return np.clip(image + rng.normal(0, sd, image.shape), 0, 255).astype(np.uint8)


def test_colours_are_averaged_but_not_across_edges_of_brightness():
    planes = np.full((40, 40, 3), 128, np.float32)
    planes[..., 0], planes[:, 20:, 0] = 60, 200
    planes[:, 20:, 1] = 160
    rng = np.random.default_rng(1)
    out = AreaFilter(1.5, 2.0)((planes + rng.normal(0, 6, planes.shape)).astype(np.float32))
    inside = np.s_[8:-8, 20 + RADIUS : -8, 1]
    assert out[inside].std() < 1.5
    assert abs(out[inside].mean() - 160) < 1.5
    assert abs(out[8:-8, 16, 1].mean() - 128) < 4


def test_dark_trousers_before_a_dark_floor_are_found_in_noise():
    rng = np.random.default_rng(2)
    image, mask = person()
    frames = [noisy(rng, image, 15) for _ in range(4)]
    segmenter = learn_background([noisy(rng, room(), 1) for _ in range(6)], film=frames)
    found = segmenter(frames[0])
    trousers = np.s_[50:84, 41:54]
    assert segmenter.classifier.areas is not None
    assert found[trousers].mean() > 0.9
    assert (found & mask).sum() / (found | mask).sum() > 0.85


def test_areas_are_only_for_a_sensors_noise():
    rng = np.random.default_rng(3)
    frames = [noisy(rng, person()[0], 1) for _ in range(4)]
    classifier = learn_background([room()], film=frames).classifier
    assert isinstance(classifier, ChannelClassifier)
    assert classifier.areas is None
    assert FilmNoise(1.5, np.full(3, 2.0), np.full(3, 0.5), np.full(3, 4.0)).grainy
    assert not FilmNoise(1.5, np.full(3, 2.0), np.full(3, 0.9), np.full(3, 2.2)).grainy
    assert not FilmNoise(0.7, np.full(3, 2.0), np.full(3, 0.5), np.full(3, 4.0)).grainy


def test_areas_decide_what_may_be_shadow_and_add_only_insides():
    label, area = np.zeros((20, 20), np.uint8), np.zeros((20, 20), np.uint8)
    label[:5] = 3
    area[:3, :10], area[8:19, 5:15] = 1, 2
    label[12, 9] = 1
    out = with_areas(label, area)
    assert (out[:3, :10] == 1).all()
    assert (out[3:5] == 3).all()
    assert (out[:5, 10:] == 3).all()
    assert out[8:19, 5:15].sum() == 2 * 7 * 6 - 1
    assert out[12, 9] == 1
    grey = to_planes(np.full((10, 10), 90, np.uint8))
    assert (AreaFilter(1.5, 1.0)(grey) == grey).all()
