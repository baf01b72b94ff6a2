"""The distance of whoever sits, by whole poses on a known floor, and the parabola that finds it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from legs import HEIGHT, bent, over_floor

from shadowpuppet.body.models import average_sizes
from shadowpuppet.camera.rasterize import place
from shadowpuppet.tracking.monocular import whole_distance
from shadowpuppet.tracking.monocular.size_search import PersonEstimate

FAR, HIPS = 2.5, 0.5


@pytest.fixture
def seated():
    """A view of a body over the floor, and the masks (H, W) of someone who sits there and moves an arm."""
    view = over_floor("anatomical", hips=HIPS)
    pose = bent(view.body.skeleton, 85, 88)
    lift = np.zeros_like(pose)
    lift[view.body.skeleton.dof_names.index("left_shoulder_x")] = 1.0
    return view, [view.mask(pose + share * lift) for share in (0.2, 0.6, 1.0)]


@pytest.mark.parametrize("ratio", [0.9, 1.15])
def test_who_sits_is_found_where_the_legs_reach_the_floor(seated, ratio):
    """The upper body is taken to be at `ratio` times its distance, on the same line of sight."""
    view, masks = seated
    up = float((np.linalg.inv(place(view.camera, FAR, 0.0)) @ view.T_camera_base)[2, 3])

    def at(factor: float) -> PersonEstimate:
        return PersonEstimate(average_sizes("anatomical", HEIGHT), HEIGHT, FAR * ratio * factor, up * ratio * factor)

    np.testing.assert_allclose(at(1 / ratio).picture(view.camera, "anatomical").T_camera_base, view.T_camera_base, atol=1e-9)
    found = whole_distance.whole_distance(view.camera, masks, "anatomical", at) * whole_distance.DRESSED
    assert found * ratio == pytest.approx(1, abs=0.05)
    assert abs(found * ratio - 1) < abs(ratio - 1)


def test_a_parabola_of_costs_has_its_vertex_where_it_is_and_noise_far_off_does_not_matter():
    factors = whole_distance.STEP ** np.arange(-4, 5.0)
    costs = 10 + 300 * np.log(factors / 1.06) ** 2
    assert whole_distance._vertex(factors, costs) == pytest.approx(1.06)
    far = costs > whole_distance.NEAR_BEST * costs.min()
    assert far.any()
    assert whole_distance._vertex(factors, np.where(far, np.inf, costs)) == pytest.approx(1.06)
    assert whole_distance._vertex(factors, np.where(far, 5 * costs, costs)) == pytest.approx(1.06)


def test_costs_without_a_vertex_give_the_least_one():
    factors = np.array([0.9, 1.0, 1.1])
    assert whole_distance._vertex(factors, np.array([np.inf, 2.0, np.inf])) == 1.0
    assert whole_distance._vertex(factors, np.array([1.0, 1.2, 1.3])) == 0.9


def test_a_place_without_a_person_in_view_is_not_chosen(seated):
    view, masks = seated
    at = PersonEstimate(average_sizes("anatomical", HEIGHT), HEIGHT, FAR, 0.0)
    assert np.isinf(whole_distance._cost(view.camera, [np.zeros_like(masks[0])], "anatomical", at, 1.0))
    assert whole_distance.whole_poses(view.camera, masks[:2], "anatomical", replace(at)).shape == (2, len(view.body.skeleton.dofs))
