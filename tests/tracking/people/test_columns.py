"""The coarse hull over the floor, and the people in it: count, place, ghosts, people who touch."""

from __future__ import annotations

from dataclasses import replace

import made_rig
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from solids import Ellipsoid, ring, seen_by

from shadowpuppet.tracking.multiview.surface.visual_hull import VisualHull
from shadowpuppet.tracking.people.carving import MANY_VIEWS, Room, carve, make_room
from shadowpuppet.tracking.people.columns import Column, find_people, projections, quarter
from shadowpuppet.tracking.people.presence import Followed, counted, follow


def cameras(count: int = 4):
    """Cameras in a ring wide enough for several people."""
    made = ring(count, radius=5.0, height=1.2, size=(160, 120), focal=110.0)
    T = np.eye(4)
    T[2, 3] = -0.9
    return [replace(camera, T_camera_world=camera.T_camera_world @ T) for camera in made]


def body(x: float, y: float, tall: float = 1.7) -> list[Ellipsoid]:
    return [Ellipsoid((x, y, 0.5 * tall), (0.2, 0.2, 0.5 * tall))]


def seen(made, *people):
    return [np.logical_or.reduce([seen_by(camera, person) for person in people]) if people else np.zeros(camera.size[::-1], bool)
            for camera in made]


@pytest.fixture(scope="module")
def rig():
    made = cameras()
    both = seen(made, body(-1, 0), body(1, 0.3))
    return made, make_room(made, VisualHull(made).points(both).points)


def naive_carve(room: Room, masks) -> np.ndarray:
    """Voxels that all cameras which see them see as silhouette, one of five or more excepted."""
    out = np.zeros(room.shape, bool)
    used = [n for n, mask in enumerate(masks) if mask is not None]
    for at in np.ndindex(room.shape):
        hits = [bool(masks[n].ravel()[room.pixels[(n, *at)]]) for n in used if room.pixels[(n, *at)] >= 0]
        tolerated = 1 if len(hits) >= MANY_VIEWS else 0
        out[at] = sum(hits) >= 2 and len(hits) - sum(hits) <= tolerated
    return out


@pytest.mark.parametrize("count", [3, 5, 6])
def test_carving_is_that_of_its_plain_twin(count):
    rng = np.random.default_rng(count)
    pixels = rng.integers(-1, 48, (count, 5, 4, 6)).astype(np.int32)
    room = Room(np.zeros(3), 0.1, pixels)
    masks = [rng.random((6, 8)) < 0.6 for _ in range(count)]
    assert np.array_equal(carve(room, masks), naive_carve(room, masks))
    masks[1] = None
    assert np.array_equal(carve(room, masks), naive_carve(room, masks))


def test_nothing_is_carved_by_a_single_camera():
    room = Room(np.zeros(3), 0.1, np.zeros((2, 2, 2, 2), np.int32))
    assert not carve(room, [np.eye(4, dtype=bool), None]).any()


def test_two_people_are_counted_and_placed(rig):
    made, room = rig
    found = find_people(room, seen(made, body(-1, 0, 1.8), body(1, 0.3, 1.5)))
    assert len(found) == 2
    left, right = sorted(found, key=lambda column: column.place[0])
    assert np.allclose(left.place, (-1, 0), atol=0.12)
    assert np.allclose(right.place, (1, 0.3), atol=0.12)
    assert left.height == pytest.approx(1.8, abs=0.12)
    assert right.height == pytest.approx(1.5, abs=0.12)


def test_nobody_and_one(rig):
    made, room = rig
    assert find_people(room, seen(made)) == []
    assert len(find_people(room, seen(made, body(0, 0)))) == 1
    assert find_people(room, [None] * len(made)) == []


def test_a_ghost_is_no_person():
    """Two cameras whose rays through two people cross at four places: two of them are ghosts."""
    made = [cameras(4)[n] for n in (0, 1)]
    people = body(-1.0, -1.0), body(1.0, 1.0)
    masks = seen(made, *people)
    room = make_room(made, np.array([[-2.0, -2, 0], [2, 2, 1.8], [0, 0, 0], [-1, 1, 1], [1, -1, 1]]))
    assert len(find_people(room, masks)) == 2


def test_who_is_explained_is_not_found_again(rig):
    made, room = rig
    masks = seen(made, body(-1, 0), body(1, 0.3))
    known = [quarter(mask) for mask in seen(made, body(-1, 0))]
    known = [np.asarray(mask) for mask in known]
    found = find_people(room, masks, known)
    assert len(found) == 1
    assert found[0].place[0] == pytest.approx(1, abs=0.12)


def test_people_who_hold_hands_are_two(rig):
    made, room = rig
    arm = [Ellipsoid((0.0, 0.15, 1.0), (0.9, 0.05, 0.05))]
    assert len(find_people(room, seen(made, body(-0.8, 0.15), body(0.8, 0.15), arm))) == 2


def test_a_hole_in_a_silhouette_carves_nobody_away(rig):
    made, room = rig
    masks = seen(made, body(-1, 0), body(1, 0.3))
    rows, columns = np.nonzero(masks[1])
    high, wide = np.ptp(rows) // 4, 2
    middle = int(np.median(columns[columns < np.median(columns)]))
    masks[1][rows.min() + high : rows.max() - high, middle - wide : middle + wide] = False
    assert len(find_people(room, masks)) == 2


def test_a_box_is_no_person(rig):
    made, room = rig
    assert find_people(room, seen(made, [Ellipsoid((0, 0, 0.3), (0.25, 0.25, 0.3))])) == []


def test_a_column_projects_on_its_silhouette(rig):
    made, room = rig
    masks = seen(made, body(0, 0))
    (column,) = find_people(room, masks)
    for view, mask in zip(projections(room, column, masks), masks):
        assert view is not None
        assert np.count_nonzero(view) >= 0.9 * np.count_nonzero(quarter(mask))
    assert projections(room, column, [None] * len(made)) == [None] * len(made)


@settings(max_examples=10, deadline=None)
@given(st.floats(-1.2, 1.2), st.floats(-1.2, 1.2))
def test_a_person_is_found_wherever_they_stand(x, y):
    made = cameras()
    room = make_room(made, np.array([[-1.5, -1.5, 0], [1.5, 1.5, 1.8], [0, 0, 0.9]]))
    (column,) = find_people(room, seen(made, body(x, y)))
    assert np.allclose(column.place, (x, y), atol=0.15)


def column(x: float, y: float = 0.0) -> Column:
    return Column(np.array([x, y]), 1.7, 0.1, np.zeros((0, 3), np.int64))


def test_columns_are_followed_by_nearness():
    people: list[Followed] = []
    for n in range(5):
        people = follow(people, n, 0.2 * n, [column(1 - 0.3 * n, 1.0), column(-1 + 0.3 * n)])
    assert [len(each.sets) for each in people] == [5, 5]
    assert people[0].place[1] == 1.0
    people = follow(people, 5, 1.0, [column(9.0)])
    assert len(people) == 3


@pytest.mark.parametrize(("numbers", "people"), [([], 0), ([0, 0], 0), ([1], 1), ([1, 1, 2], 1), ([1, 2, 2, 1], 2), ([2] * 11 + [3], 2),
                                                 ([3], 1), ([2] * 30 + [3, 3], 2)])  # fmt: skip
def test_a_number_counts_if_it_is_seen_often(numbers, people):
    assert counted(numbers) == people


def test_made_room_is_bounded():
    far = np.array([[-40.0, 0, 0], [40, 0, 1.8], [0, 0, 0.9], [0, 1, 0.9]])
    room = make_room(made_rig.cameras(2), far)
    assert np.prod(room.shape) * room.pitch**3 <= 12 * 12 * 2.6
