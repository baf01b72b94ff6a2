"""Colour models: shares of colours, smoothed alike in every channel, and their ratio."""

from __future__ import annotations

import numpy as np
import pytest

from shadowpuppet.silhouette.recovery.colours import BINS, LOWEST, SMOOTHING, UNKNOWN, WIDTH, colour_model, known, log_ratio

MIDDLE = (LOWEST + (np.array(BINS) // 2 + 0.5) * WIDTH).astype(np.float32)
"""The middle of a bin far from the ends."""


def model_of(*colours: np.ndarray) -> np.ndarray:
    return colour_model(np.array(colours, np.float32), np.ones(len(colours)))


def test_a_model_is_the_weighted_mean_of_its_colours_models(rng):
    colours = rng.uniform(0, 256, (50, 3)).astype(np.float32)
    weights = rng.uniform(0, 2, 50)
    model = colour_model(colours, weights)
    assert model.shape == BINS
    assert model.min() >= 0
    assert model.sum() == pytest.approx(1)
    np.testing.assert_allclose(model, np.average([model_of(colour) for colour in colours], axis=0, weights=weights), atol=1e-12)
    assert not colour_model(colours[:0], weights[:0]).any()


@pytest.mark.parametrize("channel", range(3))
def test_a_colour_is_known_the_less_the_farther_off_it_is_in_any_channel(channel):
    model, step = model_of(MIDDLE), WIDTH * np.eye(3, dtype=np.float32)[channel]
    beside = known(MIDDLE + np.arange(-3, 4)[:, None] * step, model)
    np.testing.assert_allclose(beside, beside[::-1])
    np.testing.assert_allclose(beside[4:6] / beside[3], np.exp(-np.array([1, 4]) / (2 * SMOOTHING**2)), rtol=0.01)
    within = known(MIDDLE + np.array([-0.45, 0, 0.45])[:, None] * step, model)
    np.testing.assert_array_equal(within, beside[3])
    np.testing.assert_array_equal(known(MIDDLE + np.array([-0.55, 0.55])[:, None] * step, model), beside[[2, 4]])


def test_colours_beyond_the_bins_are_in_the_last_ones():
    ends = [LOWEST + 0.5 * WIDTH, LOWEST + (np.array(BINS) - 0.5) * WIDTH]
    for end, outward in zip(ends, (-WIDTH, WIDTH)):
        np.testing.assert_array_equal(model_of(end), model_of(end + 90 * outward))
        assert known(end - outward, model_of(end)) < known(end, model_of(end)) == known(end + 90 * outward, model_of(end))


def test_the_ratio_is_that_of_the_shares_and_none_where_neither_model_knows_the_colour(rng):
    person, scene = model_of(MIDDLE), model_of(MIDDLE + 2 * WIDTH, MIDDLE - 2 * WIDTH)
    colours = (MIDDLE + rng.uniform(-4, 4, (5, 7, 3)) * WIDTH).astype(np.float32)
    found = log_ratio(colours, person, scene)
    np.testing.assert_allclose(found, np.log((known(colours, person) + UNKNOWN) / (known(colours, scene) + UNKNOWN)))
    np.testing.assert_allclose(found, -log_ratio(colours, scene, person), atol=1e-12)
    assert log_ratio(MIDDLE, person, scene) > 3
    assert log_ratio(LOWEST, person, scene) == 0


def test_shades_of_a_blue_wall_are_colours_of_their_own():
    """Cb of a studio's blue wall is some 210, Y and Cr hardly differ from those of a shadow on it."""
    lit, shadow = np.array([25, 110, 217], np.float32), np.array([22, 112, 204], np.float32)
    assert log_ratio(shadow, model_of(shadow), model_of(lit)) > 2
    assert log_ratio(lit, model_of(shadow), model_of(lit)) < -2
