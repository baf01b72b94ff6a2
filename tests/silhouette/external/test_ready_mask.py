"""What is a mask of another program, and what is none."""

from __future__ import annotations

import numpy as np
import pytest

from shadowpuppet.errors import SilhouetteError
from shadowpuppet.silhouette.external.ready_mask import ready_mask


def mask(value: int = 255, size=(40, 50)) -> np.ndarray:
    out = np.zeros(size, np.uint8)
    out[10:30, 20:30] = value
    return out


@pytest.mark.parametrize(("value", "inside"), [(255, True), (192, True), (128, True), (127, False), (2, False)])
def test_bright_is_inside(value, inside):
    image = mask(255)
    image[0, :20] = value  # few pixels are neither dark nor bright
    found = ready_mask(image)
    assert found.dtype == bool
    np.testing.assert_array_equal(found[10:30], mask()[10:30] > 0)
    assert (found[0, :20] == inside).all()
    np.testing.assert_array_equal(ready_mask(np.stack([image] * 3, 2)), found)


def test_truth_values_are_a_mask():
    given = mask() > 0
    found = ready_mask(given)
    np.testing.assert_array_equal(found, given)
    assert found is not given


@pytest.mark.parametrize("level", [64, 191])
def test_grey_pictures_are_none(level):
    image = np.zeros((40, 50), np.uint8)
    image[:4] = level
    image[20:] = 255
    assert ready_mask(image)[20:].all()  # a tenth
    image[4] = level
    with pytest.raises(SilhouetteError, match="found 12 % of the pixels neither dark nor bright"):
        ready_mask(image)
    image[:5] = {64: 63, 191: 192}[level]
    assert ready_mask(image)[20:].all()


@pytest.mark.parametrize(("image", "said"), [
    (mask()[None, None], r"found an array of shape \(1, 1, 40, 50\)"), (np.stack([mask()] * 2, 2), r"shape \(40, 50, 2\)"),
    (np.zeros((0, 5), np.uint8), r"shape \(0, 5\)"), ("mask.png", "found str"), (mask().astype(float), "type float64, expected 8 bits"),
    (np.stack([mask(), mask(0), mask(0)], 2), "found a picture in colour"), (mask(1), "found the values 0 and 1"),
    (np.stack([mask() > 0] * 3, 2), "type bool"),
])
def test_what_is_no_mask_is_said(image, said):
    with pytest.raises(SilhouetteError, match=said):
        ready_mask(image)


def test_a_few_ones_are_noise():
    image = np.zeros((100, 100), np.uint8)
    image[0, :20] = 1
    assert not ready_mask(image).any()
    image[0, :21] = 1
    with pytest.raises(SilhouetteError, match="found the values 0 and 1"):
        ready_mask(image)
