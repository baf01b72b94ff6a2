"""Colours of clothes: what is looked at, what is not, and how differences are measured."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import wasserstein_distance
from solids import ring

from shadowpuppet.body.models import WHOLE, average_sizes, make_body
from shadowpuppet.tracking.multiview.refinement.free_space import spheres_in
from shadowpuppet.tracking.people import appearance as module
from shadowpuppet.tracking.people.appearance import (
    BINS,
    HIGHEST,
    LOWEST,
    USUAL,
    apart_from,
    colours_of_body,
    colours_of_figure,
    difference,
    dressed_parts,
    nothing,
)

SIZE = (160, 120)
CAMERAS = ring(4, radius=3.0, height=0.0, size=SIZE, focal=130.0)  # the world's floor at the bottom of a person of 1.8 m, see `person`
FREE = [np.ones((SIZE[1] // 2, SIZE[0] // 2), bool) for _ in CAMERAS]
SHIRT, TROUSERS, SKIN = (40, 40, 180), (120, 60, 40), (120, 150, 200)  # blue green red


def person(arms: float = 0.25) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Spheres of trunk, arms and legs, and of a head, which is no part: centres, radii, parts."""
    trunk, legs = ([(0.0, 0.0, z) for z in np.arange(*span, 0.07)] for span in ((0.0, 0.5), (-0.8, -0.1)))
    sleeves = [(0.0, side * arms, z) for side in (-1, 1) for z in np.arange(0.0, 0.5, 0.07)]
    centres = [*trunk, *sleeves, *legs, (0.0, 0.0, 0.75)]
    parts = [0] * len(trunk) + [1] * len(sleeves) + [2] * len(legs) + [-1]
    return np.array(centres), np.where(np.array(parts) == 0, 0.1, 0.05), np.array(parts)


def pictures(shirt=SHIRT, trousers=TROUSERS, head=SKIN, gain: float = 1.0, noise: float = 3.0, seed: int = 0) -> list[np.ndarray]:
    """What each camera sees of an upright person, at half size: bands of colours."""
    rng, found = np.random.default_rng(seed), []
    for camera in CAMERAS:
        rows = camera.project(np.array([[0.0, 0, 0.6], [0, 0, -0.05]]))[:, 1].round().astype(int)
        image = np.zeros((SIZE[1], SIZE[0], 3))
        image[: rows[0]], image[rows[0] : rows[1]], image[rows[1] :] = head, shirt, trousers
        found.append((image * gain + rng.normal(0, noise, image.shape)).clip(0, 255).astype(np.uint8)[::2, ::2])
    return found


def worn(images, free=FREE, **more):
    return colours_of_body(CAMERAS, *person(**more), free, images)


def test_the_same_clothes_are_alike_and_others_are_not():
    known = worn(pictures())
    assert difference(known, worn(pictures(seed=1))) < 0.3
    assert difference(known, worn(pictures(gain=0.8, seed=1))) < 1.0
    assert difference(known, worn(pictures(shirt=(160, 90, 40)))) > 3
    assert difference(known, worn(pictures(trousers=(40, 110, 90)))) > 2


def test_heads_are_not_looked_at():
    np.testing.assert_array_equal(worn(pictures()), worn(pictures(head=(10, 250, 10))))


def test_pixels_that_another_explains_count_not():
    left = [mask.copy() for mask in FREE]
    for mask in left:
        mask[: SIZE[1] // 4 + 3] = False
    seen = worn(pictures(), left)
    assert not seen[:, :2].any()
    assert seen[:, 2].any()
    masks = [np.ones((SIZE[1], SIZE[0]), bool), None]
    other = np.zeros((SIZE[1] // 2, SIZE[0] // 2), bool)
    other[:, :20] = True
    found, none = apart_from(masks, [[other, other]])
    assert none is None
    assert found is not None
    np.testing.assert_array_equal(found, ~other)


def test_limbs_behind_others_are_not_seen():
    beside, behind = (worn(pictures(), arms=arms)[:, 1].sum((1, 2)) for arms in (0.4, 0.4))
    np.testing.assert_array_equal(beside, behind)
    counts = worn(pictures())[:, 1, 0].sum(-1)  # two cameras look along the line from arm to arm: the trunk hides the farther one
    assert sorted((counts / counts.max()).round(2).tolist())[:2] == [0.5, 0.5]


def test_differences_are_those_of_the_earth_mover():
    one, other = worn(pictures()), worn(pictures(shirt=(90, 90, 120), gain=0.9))
    expected = []
    centres = LOWEST[:, None] + np.arange(BINS) / (BINS - 1) * (HIGHEST - LOWEST)[:, None]
    for part in range(3):
        weights, moved = [], []
        for a, b in zip(one[:, part], other[:, part]):
            weights.append(min(a[0].sum(), b[0].sum()))
            moved.append([wasserstein_distance(centres[c], centres[c], a[c], b[c]) / USUAL[c] for c in range(3)])
        expected.append(np.sqrt((np.average(moved, axis=0, weights=weights) ** 2).mean()))
    assert difference(one, other) == pytest.approx(np.mean(expected), rel=1e-4)


def test_what_was_never_seen_is_not_known():
    known = worn(pictures())
    assert np.isnan(difference(known, nothing(4)))
    assert np.isnan(difference(known, worn([None] * 4)))
    one = worn([pictures()[0], None, None, None])
    assert np.isnan(difference(one, worn([None, *pictures()[1:]])))  # cameras are not compared with each other
    assert difference(one, known) < 0.3


def test_an_upright_figure_is_seen_like_a_body():
    figure = colours_of_figure(CAMERAS, np.zeros(2), 1.6, -0.85, FREE, pictures())
    assert not figure[:, 1].any()
    assert difference(figure, worn(pictures(seed=1))) < 0.7
    assert difference(figure, worn(pictures(trousers=(40, 110, 90)))) > 2


def test_grey_pictures_have_lightness_alone():
    grey = [image.mean(2).astype(np.uint8) for image in pictures()]
    light = [(image * 1.6).clip(0, 255).astype(np.uint8) for image in grey]
    assert difference(worn(grey), worn(grey)) == 0
    assert 0.5 < difference(worn(grey), worn(light)) < 2


@pytest.mark.parametrize("name", WHOLE)
def test_every_body_has_all_parts(name):
    limbs = make_body(name, average_sizes(name, 1.75)).limbs
    assert limbs is not None
    parts = dressed_parts(limbs)
    assert len(parts) == len(spheres_in(limbs).joints)
    assert set(parts.tolist()) == {-1, 0, 1, 2}
    heads = [limbs.parts[n] for n in np.unique(spheres_in(limbs).limbs[parts == -1])]
    assert "head" in heads
    assert len(module.PARTS) == 3
