"""Unknown pixels are filled from around."""

from __future__ import annotations

import numpy as np
import pytest

from shadowpuppet.silhouette.recovery.scene import filled


@pytest.mark.parametrize("colours", [None, 3])
@pytest.mark.parametrize("size", [(48, 64), (45, 61)])
def test_known_pixels_stay_and_the_others_continue_them(colours, size, rng):
    y, x = np.mgrid[: size[0], : size[1]].astype(np.float32)
    plane = 50 + x + 0.5 * y
    picture = plane if colours is None else np.stack([plane, 2 * plane, 0 * plane + 7], 2)
    known = np.ones(size, bool)
    known[15:30, 20:40] = False
    spoiled = picture.copy()
    spoiled[~known] = 1e4  # what is not known does not matter
    found = filled(spoiled, known)
    np.testing.assert_array_equal(found[known], picture[known])
    assert np.abs(found - picture)[~known].max() < (12 if colours is None else 24)
    spoiled[~known] = 0
    np.testing.assert_array_equal(found, filled(spoiled, known))


def test_one_known_pixel_gives_all_its_value():
    picture, known = np.zeros((33, 20), np.float32), np.zeros((33, 20), bool)
    picture[30, 2], known[30, 2] = 9.0, True
    np.testing.assert_allclose(filled(picture, known), 9.0, rtol=1e-3)


def test_nothing_to_fill_or_nothing_to_fill_it_from():
    picture = np.arange(12, dtype=np.float32).reshape(3, 4)
    np.testing.assert_array_equal(filled(picture, np.ones((3, 4), bool)), picture)
    np.testing.assert_array_equal(filled(picture, np.zeros((3, 4), bool)), picture)
