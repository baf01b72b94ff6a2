"""The plain filter of the speed benchmark has the kernels' costs, so that both time the same thing."""

from __future__ import annotations

import numpy as np
import pytest
from people import random_poses

from benchmarks.speed import naive_mono
from benchmarks.speed.mono_cases import MonoCase
from shadowpuppet.tracking.monocular.settings import make_settings
from shadowpuppet.tracking.monocular.stages import FilterStage
from shadowpuppet.tracking.silhouette_cost import Observation, silhouette_costs


@pytest.mark.parametrize("body", ["cardbox", "boxes"])
def test_the_naive_filter_has_the_kernels_costs(body, rng):
    case = MonoCase(body)
    poses = random_poses(rng, case.picture.body.skeleton, 8) * 0.5
    every = np.arange(len(case.picture.body.parts))
    found = [naive_mono.cost(case.picture, pose, every, case.mask) for pose in poses]
    np.testing.assert_array_equal(found, silhouette_costs(case.picture, Observation.of(case.mask), poses))


@pytest.mark.parametrize("name", ["torso", "left_arm"])
def test_the_naive_filter_draws_what_a_stage_draws(name, rng):
    case, settings = MonoCase(), make_settings("liu2011")
    stage = FilterStage(case.picture, settings, name)
    poses = np.repeat(case.pose[None], 5, axis=0)
    poses[:, stage.dofs] += 0.2 * rng.standard_normal((5, 4))
    shapes = np.concatenate([stage.partial.moving, stage.partial.still])
    found = [naive_mono.cost(case.picture, pose, shapes, case.mask) for pose in poses]
    np.testing.assert_array_equal(found, stage.partial.costs(Observation.of(case.mask), case.pose)(poses))
