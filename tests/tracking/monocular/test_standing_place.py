"""Where a whole person is by the first and last row of a silhouette: bodies drawn at known places, found again, and followed on a walk."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from legs import HIPS, bent, over_floor, wide

from shadowpuppet.body.models import WHOLE, average_sizes, make_body
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.tracking.monocular.leg_postures import CUT_OFF, SOLES_REACH, soles_cost
from shadowpuppet.tracking.monocular.settings import make_settings, pixel_scale
from shadowpuppet.tracking.monocular.size_search import Ground, PersonEstimate
from shadowpuppet.tracking.monocular.stages import FilterStage
from shadowpuppet.tracking.monocular.standing_place import lowest, soles_row, standing_place
from shadowpuppet.tracking.monocular.tracker import MonocularTracker
from shadowpuppet.tracking.monocular.whole_body import AGREE, _on_ground
from shadowpuppet.tracking.silhouette_cost import Soles

FAR = 2.5
"""Distance (m) of the body from the camera before it moves."""


def raised_to(view: Picture) -> float:
    """How far (m) the upright body is to be raised so that its soles are on the floor."""
    assert view.floor is not None
    return view.floor - lowest(view)


def moved(view: Picture, x: float, y: float, turn: float = 0.0) -> np.ndarray:
    return view.body.skeleton.pose(root_x=x, root_y=y, root_heading=turn)


@pytest.mark.parametrize("known", [True, False], ids=["floor", "stature"])
@pytest.mark.parametrize("name", WHOLE)
def test_who_stands_is_found_where_they_were_drawn(name, known, rng):
    view = wide(over_floor(name))
    for _ in range(8):
        x, y, turn = rng.uniform([-2.5, -0.6, -3], [0.6, 0.6, 3])
        pose = moved(view, x, y, turn)
        pose[view.body.skeleton.dof_indices(["root_z"])] = raised_to(view)
        mask = view.mask(pose)
        assert soles_row(mask) is not None
        found = standing_place(view, mask, view.floor if known else None, moved(view, 0.3, -0.2, turn))
        assert found is not None
        seen = view.points_world(np.stack([pose, found]), ["left_hip", "right_hip"]).mean(1)
        row = (FAR - x) ** 2 / (view.camera.matrix[1, 1] * 1.2)  # metres along the floor that a row of pixels shows
        assert np.linalg.norm(seen[0] - seen[1]) < 1.5 * max(row, (FAR - x) / 100)
        np.testing.assert_array_equal(found[3:], pose[3:])


def test_on_a_floor_who_is_lower_is_not_farther_away():
    view = wide(over_floor("anatomical"))
    skeleton = view.body.skeleton
    low = bent(skeleton, 45, 90)  # the shanks lie behind, the thighs before
    low[skeleton.dof_indices(["root_z"])] = -0.25
    found, stature = (standing_place(view, view.mask(low), floor, np.zeros(len(low))) for floor in (view.floor, None))
    assert found is not None
    assert stature is not None
    x, z = skeleton.dof_indices(["root_x", "root_z"])
    assert abs(found[x]) < 0.35
    assert -0.5 < found[z] < -0.1
    assert stature[x] < -0.2  # without a floor they may as well stand farther away


def test_no_place_where_the_silhouette_shows_none():
    view = wide(over_floor("anatomical"))
    upright, empty = np.zeros(32), np.zeros((240, 200), bool)
    mask = view.mask(upright)
    assert standing_place(view, empty, view.floor, upright) is None
    assert soles_row(empty) is None
    cut = mask.copy()
    cut[-1, 100] = True
    assert standing_place(view, cut, view.floor, upright) is None
    topped = mask.copy()
    topped[0, 100] = True
    assert standing_place(view, topped, None, upright) is None
    on_floor = standing_place(view, topped, view.floor, upright)  # whose head is cut off stands
    assert on_floor is not None
    assert on_floor[2] == pytest.approx(raised_to(view))
    assert standing_place(view, mask, 0.5, upright) is None  # a floor above the camera
    raised = np.zeros_like(mask)
    raised[:110] = mask[-110:]
    raised[:3] = False
    assert standing_place(view, raised, view.floor, upright) is None  # soles above the horizon
    rounded = Picture(make_body("rounded", average_sizes("rounded", 1.7)), view.camera, view.T_camera_base)
    assert standing_place(rounded, mask, view.floor, np.zeros(12)) is None


@pytest.mark.parametrize("name", WHOLE)
def test_soles_off_the_silhouettes_last_row_cost_their_square_and_far_off_no_more(name):
    view = wide(over_floor(name))
    if "left_toe" not in view.body.landmark_names:
        assert not MonocularTracker(view, make_settings(overrides={"body": name})).stages[0].moves_feet
        return
    pose, names = np.zeros((1, len(view.body.skeleton.dofs))), ["left_heel", "left_toe", "right_heel", "right_toe"]
    low, scale = view.camera.project(view.points_world(pose, names))[0, :, 1].max(), pixel_scale(view.camera.size)
    cost = [float(soles_cost(view, Soles(low - off, cut=False), 2.0)(pose)[0]) for off in (0.0, 0.2, -0.2, 200.0)]
    assert cost[0] == pytest.approx(0)
    assert cost[1] == cost[2] == pytest.approx(2.0 * 0.2**2, rel=0.01)
    assert cost[3] == pytest.approx(2.0 * SOLES_REACH**2 * scale, rel=0.01)
    below, above = (float(soles_cost(view, Soles(low - off, cut=True), 2.0)(pose)[0]) for off in (0.2, -0.2))
    assert below == pytest.approx(cost[1] / CUT_OFF**2, rel=0.01)  # what is cut off is a little lower
    assert above == cost[2]


def test_who_walks_toward_the_camera_is_followed_until_the_picture_cuts_off_the_feet_and_further():
    view = wide(over_floor("anatomical"))
    tracker = MonocularTracker(view, make_settings(overrides={"body": "anatomical"}))
    poses = [moved(view, x, 0.0) for x in np.linspace(-1.2, 1.5, 21)]
    cut = [bool(view.mask(pose)[-2:].any()) for pose in poses]
    assert 2 <= sum(cut) <= 6
    rng, x = np.random.default_rng(1), view.body.skeleton.dof_names.index("root_x")
    state = tracker.start(rng, view.mask(poses[0]))
    assert abs(state.pose[x] + 1.2) < 0.2
    for pose in poses[1:]:
        state = tracker.step(rng, state, view.mask(pose))
        assert abs(state.pose[x] - pose[x]) < 0.2


def test_the_papers_presets_keep_the_distance(rng):
    view = over_floor("anatomical")
    settings = make_settings("liu2011", {"body": "anatomical"})
    tracker = MonocularTracker(view, settings)
    assert not tracker.free
    assert type(tracker.stages[0]) is FilterStage
    x = view.body.skeleton.dof_names.index("root_x")
    assert all(x not in stage.dofs for stage in tracker.stages)
    state = tracker.start(rng, view.mask(np.zeros(32)))
    assert tracker.step(rng, state, view.mask(moved(view, 0.3, 0.0))).pose[x] == 0


def test_the_distance_is_the_floor_s_where_the_upper_body_is_about_there():
    view = wide(over_floor("anatomical"))
    mask, sizes = view.mask(np.zeros(32)), average_sizes("anatomical", 1.7)
    ground = Ground(np.array([0.0, -1, 0]), 1.2)
    for told, agrees in ((0.85, True), (1.2, True), (0.9 * np.exp(-AGREE), False)):
        found = _on_ground(view.camera, [mask], PersonEstimate(sizes, 1.7, told * FAR, 0.0, ground), "anatomical")
        assert (found is not None) == agrees
        if found is not None:
            assert found.distance == pytest.approx(FAR, rel=0.03)
            there = found.picture(view.camera, "anatomical")
            assert raised_to(there) == pytest.approx(0, abs=1e-9)
            assert there.floor == pytest.approx(-HIPS, abs=0.1)
    blind = replace(view.camera, oriented=False)
    assert _on_ground(blind, [mask], PersonEstimate(sizes, 1.7, FAR, 0.0), "anatomical") is None  # one moment shows no floor
