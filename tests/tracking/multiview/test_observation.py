"""What several cameras say at one time: points by shares, silhouettes drawn over at half their size."""

from __future__ import annotations

import actor
import numpy as np
import pytest
from solids import looking

from shadowpuppet.camera.bits import pack
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.tracking.multiview.observation import BodyInViews, MultiviewObservation
from shadowpuppet.tracking.multiview.surface.visual_hull import SurfacePoints

NOTHING = SurfacePoints(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros(0, np.int64))


@pytest.fixture(scope="module")
def stage():
    return BodyInViews(actor.body(), actor.cameras())


def seen(stage, frame: int = 0) -> MultiviewObservation:
    return MultiviewObservation(stage, *actor.filmed()[1][frame])


def poses_beside(rng, number: int = 5) -> np.ndarray:
    pose = actor.filmed()[0][0]
    return actor.body().skeleton.clamp(pose + rng.normal(0, 0.1, (number, len(pose))))


def plain(stage, masks, pose) -> tuple[int, int, list[float]]:
    """Pixels that differ and pixels of silhouettes, of every second row and column, and each picture's overlap."""
    drawn = [Picture(actor.body(), camera.thinned(2), camera.T_camera_world).mask(pose) for camera in actor.cameras()]
    pairs = [(d, m[::2, ::2]) for d, m in zip(drawn, masks) if m is not None and m.any()]
    differing, area = sum(int((d ^ m).sum()) for d, m in pairs), sum(int(m.sum()) for _, m in pairs)
    return differing, area, [(d & m).sum() / (d | m).sum() for d, m in pairs]


@pytest.mark.parametrize("size", [(160, 120), (161, 121), (7, 6)])
def test_a_thinned_camera_has_every_second_pixel(size, rng):
    camera = looking((3, 1, 0.5), size=size, focal=200.0, distortion=(-0.1, 0.02, 0.001, 0.0))
    half, points = camera.thinned(2), rng.uniform(-0.5, 0.5, (20, 3)) @ np.eye(3)
    there = points @ camera.T_camera_world[:3, :3].T + camera.T_camera_world[:3, 3]
    assert half.size == np.zeros(size[::-1])[::2, ::2].shape[::-1]
    np.testing.assert_allclose(2 * half.project(there), camera.project(there), atol=1e-6)


@pytest.mark.parametrize("which", [range(5), (0, 2, 3), (1,), ()])
def test_differing_pixels_and_overlap_are_those_counted_one_by_one(stage, which, rng):
    surface, masks = actor.filmed()[1][0]
    given = [mask if n in which else None for n, mask in enumerate(masks)]
    observation = MultiviewObservation(stage, surface, given)
    poses = poses_beside(rng)
    assert len(observation.silhouettes) == len(tuple(which))
    found = observation.mismatch(poses)
    assert found.shape == (len(poses),)
    for pose, share in zip(poses, found):
        differing, area, overlaps = plain(stage, given, pose)
        assert share == pytest.approx(differing / max(area, 1))
        assert observation.overlap(pose) == pytest.approx(np.mean(overlaps) if overlaps else 0.0)
        assert observation.area == area


def test_the_true_pose_differs_least(stage, rng):
    observation, pose = seen(stage), actor.filmed()[0][0]
    assert observation.mismatch(pose[None])[0] < 0.1 < observation.mismatch(poses_beside(rng)).min()
    assert observation.overlap(pose) > 0.9


def test_empty_and_full_masks_say_nothing(stage):
    surface, masks = actor.filmed()[1][0]
    some = [np.zeros_like(masks[0]), np.ones_like(masks[1]), None, masks[3], masks[4]]
    observation, pose = MultiviewObservation(stage, surface, some), actor.filmed()[0][0]
    assert len(observation.silhouettes) == 2
    assert observation.area == sum(int(mask[::2, ::2].sum()) for mask in masks[3:])
    nobody = MultiviewObservation(stage, NOTHING, [None] * 5)
    assert (nobody.area, nobody.overlap(pose)) == (0, 0.0)
    np.testing.assert_array_equal(nobody.mismatch(pose[None]), [0.0])


@pytest.mark.parametrize("share", [1, 2, 3, 7])
def test_a_share_of_the_points_is_every_so_many_th_of_them(stage, share):
    observation = seen(stage)
    surface, cloud = observation.surface, observation.cloud(share)
    assert cloud.total == pytest.approx(surface.weights[::share].sum(), rel=1e-5)
    np.testing.assert_array_equal(cloud.origin, observation.full.origin)
    places = cloud.rows.reshape(len(cloud.rows), 7, -1)[:, :3].transpose(0, 2, 1).reshape(-1, 3)[: len(surface.points[::share])]
    places = places + cloud.origin
    wanted = surface.points[::share]
    np.testing.assert_allclose(places[np.lexsort(places.T)].sum(0), wanted.sum(0), atol=1e-3)
    assert observation.full is observation.full


def test_no_points_make_an_empty_cloud(stage):
    cloud = MultiviewObservation(stage, NOTHING, [None] * 5).full
    assert (len(cloud.rows), cloud.total) == (0, 0.0)
    assert np.isfinite(cloud.origin).all()


def test_limbs_are_outside_that_two_silhouettes_lack(stage):
    """Here of the left forearm; one silhouette alone may have a hole."""
    surface, masks = actor.filmed()[1][0]
    pose, of = actor.filmed()[0][0], actor.body()
    arm = [of.points(pose[None], names=[f"left_{joint}"])[0, 0] for joint in ("elbow", "wrist")]
    cut = []
    for camera, mask in zip(actor.cameras(), masks, strict=True):
        rows, columns = np.indices(mask.shape)
        ends = camera.project(np.array(arm))
        far = np.min([np.hypot(columns - x, rows - y) for x, y in np.linspace(*ends, 9)], 0)
        cut.append(mask & (far > 0.1 * camera.matrix[0, 0] / 3))
    none, one, two = (MultiviewObservation(stage, surface, [*cut[:n], *masks[n:]]).outside(pose) for n in range(3))
    assert none <= one < 0.04  # of errors of pixels
    assert one + 0.02 < two < 0.3
    assert MultiviewObservation(stage, surface, [cut[0], *(None,) * (len(masks) - 1)]).outside(pose) == 0


def test_surface_points_of_pixels_that_say_nothing_are_left_out(stage, rng):
    surface, masks = actor.filmed()[1][0]
    out = [rng.random(half.shape) < 0.02 if n else None for n, half in enumerate(mask[::2, ::2] for mask in masks)]
    found = MultiviewObservation(stage, surface, masks, left_out=[None if pixels is None else pack(pixels) for pixels in out]).surface
    kept = []
    for point, n in zip(surface.points, surface.cameras):
        x, y = np.rint(stage.pictures[n].camera.project(point)).astype(int)
        kept.append(n == 0 or not out[n][max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2].any())
    assert 0.1 < np.mean(kept) < 0.95
    np.testing.assert_array_equal(found.points, surface.points[kept])
