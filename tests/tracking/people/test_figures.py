"""Figures on the floor, and the people in them: count, place, height, ghosts, people who touch, the floor itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from solids import Ellipsoid, ring, seen_by

from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Seen
from shadowpuppet.geometry import rigid
from shadowpuppet.tracking.multiview.surface.visual_hull import VisualHull
from shadowpuppet.tracking.people.figures import EMPTY, NEW, ROWS, Figure, _height, _score, drawn, find_floor, find_people, telling
from shadowpuppet.tracking.people.floor import (
    ASIDE,
    HEIGHTS,
    LEGS,
    MOST_PLACES,
    POINTS,
    SPACING,
    TRUNK,
    Ground,
    figure_points,
    floor_under,
    pixel_index,
)
from shadowpuppet.tracking.people.presence import Followed, certain_number, counted, follow, sightings, sure_number

ROUND = np.array([[-2.0, -2, 0], [2, 2, 1.8], [0, 0, 0], [-1, 1, 1], [1, -1, 1]])


def cameras(count: int = 4):
    """Cameras in a ring wide enough for several people."""
    made = ring(count, radius=5.0, height=1.2, size=(240, 180), focal=165.0)
    T = np.eye(4)
    T[2, 3] = -0.9
    return [replace(camera, T_camera_world=camera.T_camera_world @ T) for camera in made]


def body(x: float, y: float, tall: float = 1.7) -> list[Ellipsoid]:
    """Trunk, head and legs, of a person."""
    return [Ellipsoid((x, y, 0.68 * tall), (0.14, 0.2, 0.2 * tall)), Ellipsoid((x, y, 0.93 * tall), (0.1, 0.1, 0.075 * tall)),
            *(Ellipsoid((x, y + side, 0.27 * tall), (0.09, 0.09, 0.27 * tall)) for side in (-0.09, 0.09))]  # fmt: skip


def seen(made, *people):
    return [np.logical_or.reduce([seen_by(camera, person) for person in people]) if people else np.zeros(camera.size[::-1], bool)
            for camera in made]


def people_in(floor, masks, explained=(), shadows=()):
    return find_people(floor, Seen(tuple(masks), tuple(shadows)), explained)


@pytest.fixture(scope="module")
def rig():
    made = cameras()
    return made, floor_under(made, ROUND, 0.0)


def naive_score(pixels, state) -> float:
    """Evidence for one figure, (C, points), in views."""
    total, trunk, legs = 0.0, 3 * len(TRUNK), len(LEGS) * len(ASIDE)
    for at, pixel in zip(pixels, state):
        what = [int(pixel[each]) if each >= 0 else -1 for each in at]
        value = sum({1: 1 / 3, 0: -EMPTY / 3}.get(each, 0.0) for each in what[:trunk])
        for row in np.array(what[trunk : trunk + legs]).reshape(-1, len(ASIDE)):
            value += 1.0 if 1 in row else -EMPTY if (row == 0).all() else 0.0
        over, under = what[trunk + legs : trunk + legs + 3], what[trunk + legs + 3 :]
        value -= EMPTY * over.count(1) / 3 + (EMPTY if 1 in under else 0.0)
        total += value / (len(TRUNK) + len(LEGS))
    return total


def test_the_kernel_is_its_plain_twin():
    rng = np.random.default_rng(0)
    pixels = rng.integers(-1, 60, (7, len(HEIGHTS), 3, POINTS)).astype(np.int32)
    state = rng.integers(0, 4, (3, 60)).astype(np.uint8)
    scores = np.full((7, len(HEIGHTS)), -np.inf)
    _score(pixels, np.arange(7), state, np.arange(3), ROWS, EMPTY, 2, scores)
    expected = [[naive_score(pixels[n, h], state) for h in range(len(HEIGHTS))] for n in range(7)]
    assert np.allclose(scores, expected)


def test_interpolated_pixels_are_the_projected_ones(rig):
    made, floor = rig
    h, camera = 3, made[0]
    z = np.concatenate([[share * HEIGHTS[h]] * len(aside) for share, aside in TRUNK])
    across = np.concatenate([aside for _, aside in TRUNK])
    exact = pixel_index(camera, figure_points(camera, floor.places, z, across))
    width = (camera.size[0] + 1) // 2
    ours = floor.pixels[:, h, 0, : len(z)]
    both = (ours >= 0) & (exact >= 0)
    assert both.sum() > 0.5 * both.size
    assert (np.abs(ours // width - exact // width)[both] <= 1).all()
    assert (np.abs(ours % width - exact % width)[both] <= 1).all()


def test_two_people_are_counted_placed_and_measured(rig):
    made, floor = rig
    found = people_in(floor, seen(made, body(-1, 0, 1.8), body(1, 0.3, 1.3)))
    assert len(found) == 2
    left, right = sorted(found, key=lambda figure: figure.place[0])
    assert np.allclose(left.place, (-1, 0), atol=0.1)
    assert np.allclose(right.place, (1, 0.3), atol=0.1)
    assert left.height == pytest.approx(1.8, abs=0.08)
    assert right.height == pytest.approx(1.3, abs=0.08)


def test_nobody_and_one(rig):
    made, floor = rig
    assert people_in(floor, seen(made)) == []
    assert len(people_in(floor, seen(made, body(0, 0)))) == 1
    assert people_in(floor, [None] * len(made)) == []


def test_legs_taken_for_shadow_are_no_evidence_against_people(rig):
    """Trousers like the floor, in three of four cameras: without legs there is no person, unless something may be legs."""
    made, floor = rig
    person, (head, trunk) = body(0.5, 0.2), (body(0.5, 0.2)[1], body(0.5, 0.2)[0])
    whole, without = seen(made, person), seen(made, [head, trunk])
    masks = [*without[:3], whole[3]]
    shadows = [(one & ~other)[::2, ::2] for one, other in zip(whole, masks)]
    (sure,), (hardly,) = people_in(floor, masks, shadows=shadows), people_in(floor, masks)
    assert sure.evidence > hardly.evidence + 1
    assert np.allclose(sure.place, (0.5, 0.2), atol=0.1)
    assert sure.height == pytest.approx(1.7, abs=0.08)  # what is taken for shadow above the head is no head
    assert people_in(floor, seen(made), shadows=[mask[::2, ::2] for mask in whole]) == []  # a shadow alone is nobody


def test_a_camera_that_is_all_silhouette_is_no_evidence(rig):
    made, floor = rig
    masks = seen(made, body(-1, 0))
    masks[0] = np.ones_like(masks[0])
    assert telling(masks)[0] is None
    (figure,) = people_in(floor, masks)
    assert np.allclose(figure.place, (-1, 0), atol=0.15)


@pytest.mark.parametrize("count", [2, 3, 4])
def test_a_ghost_is_no_person(count):
    """Two cameras whose rays through two people cross at four places: two of them are ghosts."""
    made = cameras(4)[:count]
    floor = floor_under(made, ROUND, 0.0)
    assert len(people_in(floor, seen(made, body(-1.0, -1.0), body(1.0, 1.0)))) == 2
    three = body(-1.0, -1.0), body(1.0, 1.0), body(1.0, -1.0)
    assert len(people_in(floor, seen(made, *three))) == 3


def test_somebody_cut_by_the_border_has_their_place():
    """A person whom three of five cameras see, one of them only in part, stands where they stand and not on the rays behind."""
    made = cameras(5)
    near = made[0].centre[:2]
    place = near * 0.55
    masks = seen(made, body(*place), body(-0.8, 0.6))
    found = people_in(floor_under(made, ROUND, 0.0), masks)
    assert min(np.linalg.norm(figure.place - place) for figure in found) < 0.15
    assert len(found) == 2


def test_who_is_explained_is_not_found_again(rig):
    made, floor = rig
    known = [mask[::2, ::2] for mask in seen(made, body(-1, 0))]
    (figure,) = people_in(floor, seen(made, body(-1, 0), body(1, 0.3)), known)
    assert figure.place[0] == pytest.approx(1, abs=0.1)


def test_people_who_hold_hands_are_two(rig):
    made, floor = rig
    arm = [Ellipsoid((0.0, 0.15, 1.0), (0.9, 0.05, 0.05))]
    assert len(people_in(floor, seen(made, body(-0.8, 0.15), body(0.8, 0.15), arm))) == 2


def test_a_hole_in_a_silhouette_hides_nobody(rig):
    made, floor = rig
    masks = seen(made, body(-1, 0), body(1, 0.3))
    rows, columns = np.nonzero(masks[1])
    high, middle = np.ptp(rows) // 4, int(np.median(columns[columns < np.median(columns)]))
    masks[1][rows.min() + high : rows.max() - high, middle - 2 : middle + 2] = False
    assert len(people_in(floor, masks)) == 2


def test_a_box_is_no_person(rig):
    made, floor = rig
    assert people_in(floor, seen(made, [Ellipsoid((0, 0, 0.3), (0.25, 0.25, 0.3))])) == []


def test_a_figure_is_drawn_on_its_silhouette(rig):
    made, floor = rig
    masks = seen(made, body(0, 0))
    (figure,) = people_in(floor, masks)
    for view, mask in zip(drawn(floor, figure), masks):
        assert np.count_nonzero(view & mask[::2, ::2]) >= 0.9 * np.count_nonzero(mask[::2, ::2])


def test_the_floor_is_found_though_the_hull_reaches_below_it():
    made = cameras(3)
    masks = seen(made, body(-1, 0.3), body(1, 0))
    points = np.concatenate([VisualHull(made).points(masks).points, [[0.0, 0, -0.8]] * 40])
    assert find_floor(made, points, [Seen(tuple(masks))]).level == pytest.approx(0.0, abs=0.06)


def test_the_floor_is_the_world_s_where_figures_fit_it_nearly_as_well():
    made = cameras(4)
    masks = seen(made, body(-1, 0.3), body(1, 0))
    assert find_floor(made, VisualHull(made).points(masks).points, [Seen(tuple(masks))]).level == 0.0


def test_a_floor_that_is_not_the_world_s_is_found():
    made, drop = cameras(4), np.eye(4)
    drop[2, 3] = 0.5  # the same scene in a world whose origin is half a metre above the floor
    moved = [replace(camera, T_camera_world=camera.T_camera_world @ drop) for camera in made]
    masks = seen(made, body(-1, 0.3), body(1, 0))
    assert find_floor(moved, VisualHull(moved).points(masks).points, [Seen(tuple(masks))]).level == pytest.approx(-0.5, abs=0.06)


def test_each_level_is_tried_once_and_what_floors_share_is_projected_once(monkeypatch):
    made, levels, at = cameras(3), [], Ground.at

    def tried(ground, level):
        levels.append((len(ground.places), level))
        return at(ground, level)

    monkeypatch.setattr(Ground, "at", tried)
    points = VisualHull(made).points(masks := seen(made, body(-1, 0.3))).points
    found = find_floor(made, points, [Seen(tuple(masks))])
    assert len(levels) == len(set(levels)) <= 13
    ground = Ground.under(made, points)
    shared = [at(ground, level).pixels for level in (-0.3, 0.15, found.level)]
    assert (shared[-1] == found.pixels).all()
    assert len(ground.projected) < 2 * len(made) * (HEIGHTS[-1] / SPACING + 1)


def test_a_figure_is_as_tall_as_its_silhouette_whatever_height_was_tried(rig):
    made, floor = rig
    masks = seen(made, body(0, 0, 1.95))
    state = np.array([mask[::2, ::2].ravel() * NEW for mask in masks], np.uint8)
    for about in (1.3, 1.45, 1.75, 1.9):
        assert _height(floor, np.zeros(2), about, state) == pytest.approx(1.95, abs=0.05)


@settings(max_examples=10, deadline=None)
@given(st.floats(-1.2, 1.2), st.floats(-1.2, 1.2))
def test_a_person_is_found_wherever_they_stand(rig, x, y):
    made, floor = rig
    (figure,) = people_in(floor, seen(made, body(x, y)))
    assert np.allclose(figure.place, (x, y), atol=0.12)


def figure(x: float, y: float = 0.0) -> Figure:
    return Figure(np.array([x, y]), 1.7)


def test_figures_are_followed_by_nearness():
    people: list[Followed] = []
    for n in range(5):
        people = follow(people, sightings(0.2 * n, [figure(1 - 0.3 * n, 1.0), figure(-1 + 0.3 * n)], ()))
    assert [len(each.sightings) for each in people] == [5, 5]
    assert people[0].last.figure.place[1] == 1.0
    assert people[0].last.others == (people[1].last.figure,)
    people = follow(people, sightings(1.0, [figure(9.0)], ()))
    assert len(people) == 3


@pytest.mark.parametrize(("numbers", "people"), [([], 0), ([0, 0], 0), ([1], 1), ([1, 1, 2], 1), ([1, 2, 2, 1], 2), ([2] * 11 + [3], 2),
                                                 ([3], 1), ([2] * 8 + [3, 3], 3), ([2] * 10 + [3, 3], 2)])  # fmt: skip
def test_a_number_counts_if_it_is_seen_often(numbers, people):
    assert counted(numbers) == people


@pytest.mark.parametrize(("evidence", "sure", "certain"), [
    ((), 0, 0), ((0.7,), 1, 0), ((3.0, 0.7), 2, 1), ((3.0, 2.0, 0.9), 2, 2), ((3.0, 2.0, 1.1, 0.8), 3, 2), ((0.9, 0.8, 0.7), 2, 0)])
def test_weak_figures_beside_two_people_do_not_count(evidence, sure, certain):
    figures = [Figure(np.array([n, 0.0]), 1.7, each) for n, each in enumerate(evidence)]
    assert sure_number(figures) == sure
    assert certain_number(figures) == certain


def test_a_weak_figure_close_to_another_is_a_part_of_that_person():
    """The legs of one who sits; two who shake hands are certain, both."""
    def pair(evidence: float, away: float) -> list[Figure]:
        return [Figure(np.zeros(2), 1.4, 2.8), Figure(np.array([away, 0.0]), 1.0, evidence)]

    assert sure_number(pair(1.4, 0.5)) == 1
    assert sure_number(pair(1.4, 0.8)) == sure_number(pair(1.6, 0.5)) == 2


def test_a_second_person_who_is_certain_counts_where_there_are_few_frames_of_them():
    assert counted([1] * 22 + [2] * 2) == 1
    assert counted([1] * 22 + [2] * 2, share=0.0) == 2
    assert counted([1] * 23 + [2], share=0.0) == 1


def test_places_beside_a_lens_are_outside_its_picture_without_a_warning():
    """Their pixels are beyond single precision: a lens' formula grows with the seventh power."""
    lens = Camera("cam", (160, 120), [[140, 0, 79.5], [0, 140, 59.5], [0, 0, 1]], [0.1, 0.1, 0, 0, 0.1],
                  T_camera_world=rigid([[0, 1, 0], [0, 0, -1], [-1, 0, 0]], [0.0, 1.0, 3.0]))
    ground = Ground((lens,), np.array([[3.0 - 1e-8, 1.0], [0.0, 0.0]]), 0.1)
    assert np.abs(lens.project(figure_points(lens, ground.places[:1], np.zeros(1), np.zeros(1)))).max() > np.finfo(np.float32).max
    beside, before = ground.at(0.0).pixels[:, 0, 0]
    assert (beside == -1).all()
    assert (before >= 0).any()


def test_the_floor_is_bounded():
    far = np.array([[-40.0, 0, 0], [40, 0, 1.8], [0, 0, 0.9], [0, 1, 0.9]])
    assert len(floor_under(cameras(2), far, 0.0).places) <= MOST_PLACES
