"""Which way a person in profile faces, from the head's place above the neck."""

from __future__ import annotations

import numpy as np
import pytest

from shadowpuppet.tracking.smoothing.head_lean import head_lean


def profile(ahead: float = 3.0, neck: int = 5, size=(100, 80)) -> np.ndarray:
    """A round head, `ahead` pixels to the right of a narrow neck upon a trunk."""
    rows, columns = np.indices(size)
    head = (rows - 20) ** 2 + (columns - 40 - ahead) ** 2 < 9**2
    below = (rows >= 25) & (np.abs(columns - 40) <= np.where(rows < 36, neck, 24) / 2)
    return head | below


@pytest.mark.parametrize(("ahead", "expected"), [(3, 1), (-3, -1), (0, 0)])
def test_the_head_lies_before_the_neck(ahead, expected):
    found = head_lean(profile(ahead))
    assert abs(found) < 0.02 if expected == 0 else 0.05 < found * expected < 0.3


def test_mirrored_pictures_and_specks(rng):
    mask = profile()
    assert head_lean(mask[:, ::-1]) == pytest.approx(-head_lean(mask), abs=1e-9)
    speckled = mask.copy()
    speckled[2, 5] = speckled[90, 3] = True
    assert head_lean(speckled) == head_lean(mask)


@pytest.mark.parametrize("mask", [np.zeros((100, 80), bool), np.ones((100, 80), bool), profile(neck=20), profile()[::12, ::12],
                                  np.eye(3, dtype=bool)])  # fmt: skip
def test_without_a_neck_nothing_is_said(mask):
    assert np.isnan(head_lean(mask))
