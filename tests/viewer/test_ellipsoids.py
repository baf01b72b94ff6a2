"""Ellipsoids of uncertainty as the viewer's page gets them: three axes, and quaternions that begin with the real part."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

pytest.importorskip("viser")

from shadowpuppet.viewer.web.scene_view import SIGMAS, SceneView


def test_they_are_turned_and_scaled_as_the_deviations_are():
    drawn = []

    def add(name, points, faces, turns, places, **how):
        drawn.append((turns, places, how["batched_scales"]))
        return SimpleNamespace(batched_positions=places, batched_scales=None, batched_wxyzs=None, visible=True)

    view = SimpleNamespace(_ellipsoids=None, server=SimpleNamespace(scene=SimpleNamespace(add_batched_meshes_simple=add)))
    rotations = Rotation.random(3, random_state=1)
    ellipsoids = SimpleNamespace(turns=rotations.as_matrix(), points=np.arange(9.0).reshape(3, 3), axes=np.full((3, 3), 0.01))
    SceneView._put_ellipsoids(view, None)
    SceneView._put_ellipsoids(view, ellipsoids)
    (turns, places, scales), = drawn
    w, x, y, z = turns.T
    np.testing.assert_allclose(Rotation.from_quat(np.column_stack([x, y, z, w])).as_matrix(), rotations.as_matrix(), atol=1e-6)
    np.testing.assert_array_equal(places, ellipsoids.points)
    np.testing.assert_allclose(scales, SIGMAS * 0.01, rtol=1e-6)
    ellipsoids.points = ellipsoids.points + 1
    SceneView._put_ellipsoids(view, ellipsoids)
    assert len(drawn) == 1  # moved, not drawn anew
    np.testing.assert_array_equal(view._ellipsoids.batched_positions, ellipsoids.points)
    np.testing.assert_allclose(view._ellipsoids.batched_wxyzs, turns)
    SceneView._put_ellipsoids(view, None)
    assert not view._ellipsoids.visible
    ellipsoids.turns, ellipsoids.points, ellipsoids.axes = ellipsoids.turns[:2], ellipsoids.points[:2], ellipsoids.axes[:2]
    SceneView._put_ellipsoids(view, ellipsoids)
    assert len(drawn) == 2  # another number
