"""Usual postures of legs, and the floor: what they cost, and that standing people and upper bodies are left as they were."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from legs import HEIGHT, bent, over_floor
from people import picture, random_poses

from shadowpuppet.body.models import WHOLE, average_sizes, make_body
from shadowpuppet.body.segments import dofs_of
from shadowpuppet.body.skeleton import Skeleton
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.monocular import leg_postures
from shadowpuppet.tracking.monocular.extended_stage import make_stage
from shadowpuppet.tracking.monocular.leg_postures import contact_cost, floor_below, floor_cost, posture_penalty
from shadowpuppet.tracking.monocular.settings import make_settings
from shadowpuppet.tracking.silhouette_cost import Observation


def naive_penalty(skeleton: Skeleton, pose: Array) -> float:
    """Leg by leg and posture by posture."""
    rest, below, above = skeleton.rest_and_spread
    squared = [((value - r) / (b if value < r else a)) ** 2 for value, r, b, a in zip(pose, rest, below, above, strict=True)]
    cost = [each / (1 + each / 9) for each in squared]
    legs = {side: dofs_of(skeleton, f"{side}_leg") for side in ("left", "right")}
    total = sum(cost) - sum(cost[d] for dofs in legs.values() for d in dofs)
    for side, dofs in legs.items():
        usual, spread = leg_postures._usual(skeleton, f"{side}_leg")
        ways = [sum(cost[d] for d in dofs)]
        for values, rarer in zip(usual, leg_postures.RARER, strict=True):
            off = [((pose[d] - value) / s) ** 2 for d, value, s in zip(dofs, values, spread, strict=True)]
            ways.append(rarer + sum(each / (1 + each / 9) for each in off))
        total += min(ways)
    return total


@pytest.mark.parametrize("name", WHOLE)
def test_a_leg_costs_what_the_nearest_usual_posture_says(name, rng):
    skeleton = make_body(name, average_sizes(name, HEIGHT)).skeleton
    usual = [bent(skeleton, *flexed) for flexed in ((0, 0), (88, 90), (110, 120), (0, 90))]
    poses = np.concatenate([random_poses(rng, skeleton, 30), usual])
    np.testing.assert_allclose(posture_penalty(skeleton, poses), [naive_penalty(skeleton, pose) for pose in poses])


@pytest.mark.parametrize("name", WHOLE)
def test_who_sits_squats_or_kneels_is_usual_and_who_stands_is_as_before(name, rng):
    skeleton = make_body(name, average_sizes(name, HEIGHT)).skeleton
    poses = np.array([bent(skeleton, *flexed) for flexed in ((88, 90), (110, 120), (50, 70), (0, 90, 55))])
    assert (posture_penalty(skeleton, poses) < 0.6 * skeleton.posture_penalty(poses)).all()
    standing = skeleton.pose()[None] + 0.05 * rng.standard_normal((20, len(skeleton.dofs)))
    np.testing.assert_allclose(posture_penalty(skeleton, standing), skeleton.posture_penalty(standing))


@pytest.mark.parametrize("name", ["cardbox", "rounded"])
def test_upper_bodies_are_as_before(name, rng):
    view = picture(name)
    poses = random_poses(rng, view.body.skeleton, 20)
    np.testing.assert_array_equal(posture_penalty(view.body.skeleton, poses), view.body.skeleton.posture_penalty(poses))
    assert floor_below(view) is None


@pytest.mark.parametrize("name", WHOLE)
def test_a_floor_is_the_person_s_if_the_camera_s_place_is_known_and_their_legs_reach_it(name):
    view = over_floor(name)
    assert floor_below(view) == view.floor
    low = over_floor(name, hips=0.4)
    assert floor_below(low) == low.floor  # of whoever sits, the feet are in front of the hips
    assert floor_below(over_floor(name, hips=1.4)) is None
    assert floor_below(over_floor(name, hips=0.0)) is None
    assert floor_below(replace(view, floor=None)) is None


@pytest.mark.parametrize("name", WHOLE)
def test_feet_below_the_floor_cost_and_the_lowest_point_off_it_where_contact_is_sought(name):
    view = over_floor(name, hips=2.0)
    pose = view.body.skeleton.pose()[None]
    heights = view.body.points(pose, names=leg_postures._lowest(view))[0, :, 2]
    low = heights.min()
    assert floor_cost(view, low - 0.01, 100.0)(pose)[0] == 0
    above = low + 0.1
    assert floor_cost(view, above, 100.0)(pose)[0] == pytest.approx(100 * (np.minimum(heights - above, 0) ** 2).sum())
    for off in (0.1, -0.1):
        far = leg_postures.REACH**2
        assert contact_cost(view, low - off, 100.0)(pose)[0] == pytest.approx(200 * far * (np.sqrt(1 + 0.1**2 / far) - 1), rel=1e-3)
    assert contact_cost(view, low, 100.0)(pose)[0] == pytest.approx(0)
    assert contact_cost(view, low - 5.0, 100.0)(pose)[0] < 200 * leg_postures.REACH * 5  # who jumps is held less than by the square


@pytest.mark.parametrize("name", WHOLE)
def test_stages_of_legs_know_the_floor_and_those_of_arms_do_not(name):
    view = over_floor(name, hips=0.4)  # straight legs are below the floor
    settings = make_settings(overrides={"body": name, "motion_weight": 0.0})
    standing = view.body.skeleton.pose()[None]
    observation = Observation.of(view.mask(standing[0]))
    for part, number in (("left_leg", 3), ("left_arm", 1)):
        costs = make_stage(view, settings, part, floor=view.floor).extra_costs(observation, standing[0])
        assert len(costs) == number
        assert (sum(cost(standing)[0] for cost in costs) > 1000) == (number == 3)
    assert len(make_stage(view, settings, "left_leg").extra_costs(observation, standing[0])) == 1
