"""Masks as bits against the masks themselves: what they hold, growing, bounding boxes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from shadowpuppet.camera.bits import count, grown_bits, is_set, pack, unpack
from shadowpuppet.camera.mask import grown
from shadowpuppet.jit import kernel

masks = arrays(bool, array_shapes(min_dims=2, max_dims=2, max_side=140))
sparse = arrays(bool, array_shapes(min_dims=2, max_dims=2, max_side=200), elements=st.just(False), fill=st.just(False))


@st.composite
def specks(draw):
    """A mask with a few set pixels."""
    mask = draw(sparse).copy()
    for _ in range(draw(st.integers(0, 4))):
        mask[draw(st.integers(0, mask.shape[0] - 1)), draw(st.integers(0, mask.shape[1] - 1))] = True
    return mask


@kernel
def all_pixels(bits, out):
    for y in range(out.shape[0]):
        for x in range(out.shape[1]):
            out[y, x] = is_set(bits, x, y)



@given(arrays(bool, array_shapes(min_dims=2, max_dims=2, max_side=140)))
def test_bits_hold_a_mask_and_nothing_else(mask):
    bits = pack(mask)
    assert bits.shape == (-(-mask.shape[1] // 64), mask.shape[0])
    assert bits.flags.c_contiguous
    np.testing.assert_array_equal(unpack(bits, mask.shape[1]), mask)
    assert count(bits) == mask.sum()  # what pads the last word is empty


def test_a_pixel_is_a_bit_of_its_word_column():
    mask = np.zeros((3, 130), bool)
    mask[1, 65] = True
    bits = pack(mask)
    assert bits[1, 1] == 2
    assert count(bits) == 1


@pytest.mark.kernels
@given(masks)
@settings(deadline=None)
def test_a_pixel_is_set_as_in_the_mask(mask):
    found = np.zeros_like(mask)
    all_pixels(pack(mask), found)
    np.testing.assert_array_equal(found, mask)


@pytest.mark.kernels
@given(specks(), st.integers(1, 150))
@settings(max_examples=300, deadline=None)
def test_bits_grow_like_the_mask(mask, by):
    before = pack(mask)
    found = grown_bits(before, by, mask.shape[1])
    np.testing.assert_array_equal(unpack(found, mask.shape[1]), grown(mask, by))
    assert count(found) == grown(mask, by).sum()  # nothing beside the picture
    np.testing.assert_array_equal(before, pack(mask))
