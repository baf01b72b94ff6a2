"""Textures of floors: every style has the brightness that is drawn for it, and its pattern."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest

from shadowpuppet.synthetic.walls import WallStyle, paint_floor

PLACES = np.meshgrid(np.linspace(-3, 3, 60), np.linspace(-2, 2, 40))


@pytest.mark.parametrize("kind", get_args(WallStyle))
@pytest.mark.parametrize("seed", range(6))
def test_a_floor_is_as_bright_as_drawn(kind, seed):
    paint = paint_floor(kind, *PLACES, np.random.default_rng(seed))
    drawn = np.random.default_rng(seed).uniform([0.02, 0.1, 0.3], [0.15, 0.5, 0.65])[2]
    assert paint.shape == (40, 60, 3)
    assert paint.mean((0, 1)).max() == pytest.approx(drawn, rel=0.06)
    assert 0.005 < paint[..., 0].std() / drawn < 0.25
    assert (paint_floor(kind, *PLACES, np.random.default_rng(seed)) == paint).all()
