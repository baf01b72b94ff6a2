"""Whose pixel and whose surface point: what others explain is no evidence, and points belong to the nearest body."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from shadowpuppet.camera.bits import pack, unpack
from shadowpuppet.tracking.multiview.observation import Halves
from shadowpuppet.tracking.multiview.surface.visual_hull import SurfacePoints
from shadowpuppet.tracking.people.evidence import FAR, Division, Drawn, PersonObservation, ignored_pixels, own_masks
from shadowpuppet.tracking.people.tracker import explained, touching
from shadowpuppet.tracking.silhouette_cost import Observation

SIZE = (60, 80)
"""Rows and columns of a silhouette; bodies are drawn at half of it."""


def block(*columns: tuple[int, int], rows: tuple[int, int] = (10, 50), size: tuple[int, int] = SIZE) -> np.ndarray:
    """A mask with the columns from ... to."""
    mask = np.zeros(size, bool)
    for left, right in columns:
        mask[rows[0] : rows[1], left:right] = True
    return mask


def drawn(left: int, right: int, x: float = 0.0) -> Drawn:
    """A person drawn in one camera's columns (of the whole size), who stands at x."""
    centres = np.column_stack([np.full(5, x), np.zeros(5), np.linspace(0.2, 1.6, 5)])
    return Drawn((pack(block((left, right))[::2, ::2]),), (SIZE[1] // 2,), centres, np.full(5, 0.15))


def ignored_by(one: Drawn, others: list[Drawn], mask: np.ndarray) -> np.ndarray:
    """The pixels of the one camera that say nothing of a person, as a mask."""
    (ignored,) = ignored_pixels(one, others, [mask])
    assert ignored is not None
    return unpack(ignored, SIZE[1] // 2)


def test_a_pixel_of_another_says_nothing():
    one, other = drawn(10, 22), drawn(40, 52)
    ignored = ignored_by(one, [other], block((10, 22), (40, 52)))
    assert ignored[10:20, 20:26].all()
    assert not ignored[10:20, 5:11].any()


def test_where_people_overlap_it_is_one_of_them():
    one, other = drawn(20, 40), drawn(30, 50)
    mask = block((20, 50))
    for person, rest in ((one, other), (other, one)):
        ignored = ignored_by(person, [rest], mask)
        assert ignored[10:20, 15:20].all()  # the shared columns
        (own,) = own_masks(person, [mask], [pack(ignored)])
        assert own is not None
        assert np.count_nonzero(own & block((30, 40))) == np.count_nonzero(block((30, 40)))


def test_silhouette_far_from_a_person_is_not_theirs():
    far = block((2, 14), (70, 78))
    ignored = ignored_by(drawn(2, 14), [], far)
    assert ignored[10:20, 36:39].all()
    assert not ignored[10:20, 1:7].any()


def test_an_empty_pixel_beside_others_still_counts():
    ignored = ignored_by(drawn(10, 22), [drawn(60, 70)], block((10, 22), (60, 70)))
    assert not ignored[0:4].any()


def test_no_mask_no_evidence():
    assert ignored_pixels(drawn(1, 9), [], [None]) == [None]
    assert own_masks(drawn(1, 9), [None], [None]) == [None]


def test_points_belong_to_the_nearest_body():
    one, other = drawn(0, 1, -0.4), drawn(0, 1, 0.4)
    points = np.array([[-0.5, 0, 1.0], [-0.1, 0, 1.0], [0.1, 0, 1.0], [0.5, 0, 1.0], [3.0, 0, 1.0]])
    surface = SurfacePoints(points, points, np.ones(5), np.arange(5))
    divided = Division({1: one, 2: other}, set(), surface, [None], Halves.of([None]))
    assert [divided.points_of(n).cameras.tolist() for n in (1, 2)] == [[0, 1], [2, 3]]
    alone = Division({1: one, 2: other}, {2}, surface, [None], Halves.of([None]))  # a lost person's body explains nothing
    assert alone.points_of(1).cameras.tolist() == [0, 1, 2]


def test_evidence_is_divided_again_among_other_bodies():
    points = np.array([[-0.4, 0, 1.0], [0.4, 0, 1.0]])
    mask = block((10, 22), (40, 52))
    surface = SurfacePoints(points, points, np.ones(2), np.arange(2))
    divided = Division({1: drawn(10, 22, -0.4), 2: drawn(40, 52, 0.4)}, set(), surface, [mask], Halves.of([mask]))
    moved = divided.with_bodies({2: drawn(40, 52, 3.0)})
    assert moved.points_of(1).cameras.tolist() == [0]
    assert moved.points_of(2).cameras.tolist() == []
    assert moved.distances[1] is divided.distances[1]  # computed once
    own, (ignored,) = divided.of(1)
    assert own.cameras.tolist() == [0]
    assert ignored is not None
    assert unpack(ignored, SIZE[1] // 2)[10:20, 20:26].all()
    _, (seen,), (same,) = divided.share(1)
    assert seen is not None
    np.testing.assert_array_equal(same, ignored)
    assert not (seen & block((40, 52))).any()


def test_distances_are_those_of_the_nearest_sphere(rng):
    body = Drawn((), (), rng.normal(size=(20, 3)), rng.uniform(0.05, 0.2, 20))
    points = rng.normal(scale=2, size=(200, 3))
    naive = (np.linalg.norm(points[:, None] - body.centres, axis=-1) - body.radii).min(1)
    found = body.distances(points)
    near = np.isfinite(found)
    assert 50 < near.sum() < 200
    np.testing.assert_allclose(found[near], naive[near], atol=1e-12)
    assert (naive[~near] > FAR).all()
    assert body.distances(np.zeros((0, 3))).shape == (0,)


@pytest.mark.parametrize(("apart", "numbers"), [(0.4, [1, 2]), (2.0, [])])
def test_who_touches(apart, numbers):
    assert touching({1: drawn(0, 1, 0.0), 2: drawn(0, 1, apart)}) == numbers


def test_what_is_explained():
    assert explained({}) == []
    (found,) = explained({1: drawn(0, 12), 2: drawn(40, 52)})
    assert found.shape == (30, 40)
    assert found[6:24, 0:6].all()
    assert not found[:, 12:15].any()


def test_views_that_hide_a_person_do_not_count_in_the_overlap():
    body, mask = block((10, 22)), block((10, 22), (40, 52))
    picture = SimpleNamespace(draw=lambda pose: pack(body))
    seen = PersonObservation.__new__(PersonObservation)
    seen.__dict__["silhouettes"] = ((picture, Observation.of(mask, block((40, 52)))), (picture, Observation.of(mask, block((8, 24)))))
    assert seen.overlap(np.zeros(1)) == 1.0
    seen.__dict__["silhouettes"] = seen.__dict__["silhouettes"][1:]
    assert np.isnan(seen.overlap(np.zeros(1)))
