"""Textures of floors: every style has the brightness that is drawn for it, and its pattern."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest

from shadowpuppet.synthetic.walls import WallStyle, paint_floor, paint_wall

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


@pytest.mark.parametrize(("kind", "wall", "floor"), [("room", 1.921639, -0.404853), ("plain", -0.327714, -0.204841),
                                                     ("cluttered", 11.187978, -0.404853), ("textured", 0.343509, -2.692283)])
def test_the_walls_before_which_settings_were_chosen_stay_as_they_are(kind, wall, floor):
    x, z = np.meshgrid(np.linspace(-3, 3, 60), np.linspace(0, 2.6, 40))
    weights = np.cos(np.arange(40 * 60 * 3)).reshape(40, 60, 3)
    assert (paint_wall(kind, x, z, np.random.default_rng(7)) * weights).sum() == pytest.approx(wall, abs=1e-5)
    assert (paint_floor(kind, *PLACES, np.random.default_rng(7)) * weights).sum() == pytest.approx(floor, abs=1e-5)
