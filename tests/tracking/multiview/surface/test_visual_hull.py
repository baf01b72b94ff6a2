"""The visual hull on solids that cameras see exactly: where its points lie, which way they look, and what bad silhouettes do to it."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import pairwise

import cv2
import naive_hull
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from solids import Box, Ellipsoid, looking, masks_of, ring

from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import CalibrationError, SettingsError, TrackingError
from shadowpuppet.geometry import inverse, rigid, rotation_from_vector, transform
from shadowpuppet.io.calibration.calibration_files import read_calibration
from shadowpuppet.tracking.multiview.settings import HullSettings
from shadowpuppet.tracking.multiview.surface.visual_hull import SurfacePoints, VisualHull, _silhouette
from shadowpuppet.video import open_frames

BALL = Ellipsoid((0.05, -0.1, 0.02), (0.3, 0.3, 0.3))
LIMB = Ellipsoid((0.05, -0.1, 0.02), (0.06, 0.06, 0.5))
TRUNK = Ellipsoid((0.0, 0.05, 0.0), (0.22, 0.15, 0.4))
PIXEL = 2.5 / 280
"""What a pixel of `ring`'s cameras is at the origin, m."""
SHARP = HullSettings(tolerated=0)


def hull(cameras, *solids, settings=SHARP) -> SurfacePoints:
    return VisualHull(cameras, settings).points(masks_of(cameras, *solids))


def outside(cameras, masks, points) -> np.ndarray:
    """How far (pixels) each point lies outside any silhouette; the picture's outermost pixels say nothing, whose corners are cut."""
    farthest = np.zeros(len(points))
    for camera, mask in zip(cameras, masks):
        distance = cv2.distanceTransform(1 - mask.astype(np.uint8), cv2.DIST_L2, 5)
        x, y = np.rint(camera.project(points)).astype(int).T
        within = (x > 0) & (y > 0) & (x < camera.size[0] - 1) & (y < camera.size[1] - 1)
        farthest[within] = np.maximum(farthest[within], distance[y[within], x[within]])
    return farthest


def same(a: SurfacePoints, b: SurfacePoints, tolerance: float = 0.0) -> None:
    assert len(a.points) == len(b.points) > 0
    for one, other in zip(a, b):
        np.testing.assert_allclose(one, other, atol=tolerance, rtol=0)


# Where points lie -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("count", [2, 3, 4, 5, 6, 7, 8])
@pytest.mark.parametrize("solid", [BALL, LIMB, TRUNK])
def test_points_lie_on_the_surface_and_look_outward(count, solid):
    cameras = ring(count)
    found = hull(cameras, solid)
    assert len(found.points) > 25
    off, turned = solid.distance(found.points), (found.normals * solid.normals(found.points)).sum(1)
    assert off.min() > -PIXEL  # the hull holds the solid
    np.testing.assert_allclose(np.linalg.norm(found.normals, axis=1), 1)
    # A viewing plane touches a convex solid: the support function says by how far it misses.
    reach = np.linalg.norm(found.normals * solid.radii, axis=1) + found.normals @ solid.centre
    blunt = found.weights > 0.5  # what comes from short edges is not at the limb's ends
    assert np.median(np.abs((found.points * found.normals).sum(1) - reach)) < 0.5 * PIXEL
    if count > 4:
        assert np.median(np.abs(off)) < 0.3 * PIXEL
        assert np.percentile(np.abs(off[blunt]), 95) < 1.5 * PIXEL
        assert np.degrees(np.arccos(np.clip(np.median(turned), -1, 1))) < 9
        assert (turned > 0.6).all()


@pytest.mark.parametrize("more", [
    {"distortion": (-0.25, 0.08, 0.002, -0.001)}, {"distortion": (0.3, -0.1, 0.0, 0.0, 0.02, 0.1, 0.05, 0.0)},
    {"distortion": (0.02, -0.01, 0.003, 0.0), "fisheye": True, "focal": 220.0}, {"size": (640, 480), "focal": 560.0},
    {"size": (131, 97), "focal": 110.0},
])  # fmt: skip
def test_lenses_and_sizes_of_pictures(more):
    pixel = 2.5 / more.get("focal", 280)
    found = hull(ring(6, **more), BALL)
    off = BALL.distance(found.points)
    assert np.median(np.abs(off)) < 0.3 * pixel
    assert off.min() > -pixel
    assert len(found.points) > 250


def test_a_lens_forgotten_is_seen_in_the_points():
    cameras = ring(6, distortion=(-0.25, 0.08, 0.0, 0.0), turn=0.1)
    ball = replace(BALL, centre=(0.5, 0.3, 0.5))
    masks = masks_of(cameras, ball)
    straight = [replace(camera, distortion=np.zeros(4)) for camera in cameras]
    errors = [np.median(np.abs(ball.distance(VisualHull(c, SHARP).points(masks).points))) for c in (cameras, straight)]
    assert errors[0] < 0.3 * PIXEL
    assert errors[1] > 2 * errors[0]


def test_cameras_of_different_sizes_and_kinds_together():
    kinds = ({}, {"size": (640, 480), "focal": 560.0}, {"size": (100, 200), "focal": 150.0}, {"distortion": (-0.2, 0.05, 0, 0)},
             {"fisheye": True, "focal": 200.0, "distortion": (0.01, 0, 0, 0)})
    cameras = [looking(camera.centre, name=camera.name, **kind) for camera, kind in zip(ring(5), kinds)]
    found = hull(cameras, BALL)
    assert set(found.cameras) == {0, 1, 2, 3, 4}
    assert np.median(np.abs(BALL.distance(found.points))) < 0.5 * PIXEL
    # Rays are spread by angle: equally far cameras take about as many, as far as their pixels go.
    taken = np.bincount(found.cameras)
    assert taken[1] < 2.5 * taken[0]


@pytest.mark.parametrize("count", [3, 5, 8])
def test_no_point_lies_outside_a_silhouette(count):
    cameras = ring(count)
    masks = masks_of(cameras, LIMB, replace(BALL, centre=(0.3, 0.2, -0.1), radii=(0.1, 0.1, 0.1)), Box((-0.2, 0.1, 0.1), (0.05, 0.1, 0.2)))
    found = VisualHull(cameras, SHARP).points(masks)
    assert len(found.points) > 200
    assert outside(cameras, masks, found.points).max() < 1.5


def test_the_hull_holds_the_person(rng):
    cameras = ring(6)
    for solid in (Box((0, 0, 0), (0.2, 0.1, 0.35)), TRUNK):
        found = hull(cameras, solid)
        inner = solid.samples(rng, 3000)
        beyond = np.einsum("psk,pk->ps", inner[None] - found.points[:, None], found.normals)
        assert np.percentile(beyond.max(1), 80) < 1.5 * PIXEL  # convex: no plane cuts it, but those at a silhouette's corners
        assert solid.distance(found.points).min() > -PIXEL


def test_edges_are_kept_and_weighed_by_their_length():
    cameras = ring(4)
    found = hull(cameras, BALL)
    lengths = 0.1 * np.sqrt(1 / found.weights - 1)
    assert lengths.max() <= 0.25 + 1e-9
    short = hull(cameras, BALL, settings=HullSettings(tolerated=0, longest=0.1))
    assert len(short.points) == (lengths <= 0.1).sum()
    heavy = hull(cameras, BALL, settings=HullSettings(tolerated=0, falloff=0.2))
    np.testing.assert_allclose(heavy.weights, 1 / (1 + (lengths / 0.2) ** 2), atol=1e-9)


def test_points_along_an_edge():
    cameras = ring(4)
    one, many = (hull(cameras, BALL, settings=HullSettings(tolerated=0, pitch=pitch)) for pitch in (0.25, 0.04))
    lengths = 0.1 * np.sqrt(1 / one.weights - 1)
    assert len(many.points) == np.ceil(lengths / 0.04).sum()
    along = np.linalg.norm(np.diff(many.points, axis=0), axis=1)[np.abs(np.diff(many.weights)) < 1e-12]
    assert along.max() <= 0.04 + 1e-9


def test_rays_are_as_many_as_asked_for_whatever_the_pictures():
    for size, focal in (((640, 480), 560.0), ((1280, 960), 1120.0)):
        found = hull(ring(7, size=size, focal=focal), TRUNK, settings=HullSettings(rays=700))
        assert 600 < len(found.points) < 760
        assert np.bincount(found.cameras).max() < 1.6 * np.bincount(found.cameras).min()


# What silhouettes do not say ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("tolerated", [0, 1])
def test_a_view_that_is_missing_empty_or_whole_says_nothing(tolerated):
    cameras = ring(6)
    masks, made = masks_of(cameras, TRUNK), VisualHull(cameras, HullSettings(tolerated=tolerated))
    without = VisualHull(cameras[:2] + cameras[3:], HullSettings(tolerated=tolerated)).points(masks[:2] + masks[3:])
    for blank in (None, np.zeros_like(masks[2]), np.ones_like(masks[2])):
        found = made.points([*masks[:2], blank, *masks[3:]])
        assert 2 not in found.cameras
        same(found._replace(cameras=found.cameras - (found.cameras > 2)), without)


def test_one_silhouette_is_not_enough():
    cameras = ring(3)
    masks, made = masks_of(cameras, BALL), VisualHull(cameras)
    for given_ in ([masks[0], None, None], [None] * 3, [np.zeros_like(m) for m in masks]):
        found = made.points(given_)
        assert [a.shape for a in found] == [(0, 3), (0, 3), (0,), (0,)]
    apart = [masks[0], masks_of(cameras, replace(BALL, centre=(0.05, -0.1, 0.7), radii=(0.1, 0.1, 0.1)))[1], None]
    assert len(made.points(apart).points) == 0  # silhouettes of nothing in common


@pytest.mark.parametrize("tolerated", [0, 1])
def test_a_person_cut_by_the_border_is_neither_carved_nor_contoured_there(tolerated):
    cameras = ring(6)
    near = looking(0.5 * cameras[0].centre, at=(0, 0, -0.35), name="cam1")  # sees the lower half
    masks = masks_of([near, *cameras[1:]], LIMB)
    assert masks[0][0].any()
    assert not masks[0][:, [0, -1]].any()
    settings_ = HullSettings(tolerated=tolerated)
    found = VisualHull([near, *cameras[1:]], settings_).points(masks)
    without = VisualHull(cameras[1:], settings_).points(masks[1:])
    top = [s.points[:, 2] > 0.3 for s in (found, without)]
    assert top[0].sum() > 0.7 * top[1].sum()
    cut = found.cameras == 0
    assert cut.any()
    assert near.project(found.points[cut])[:, 1].min() > 3
    turned = (found.normals * LIMB.normals(found.points)).sum(1)
    assert (turned[cut] > 0.8).all()  # none looks up from where the picture ends
    assert LIMB.distance(found.points).min() > -PIXEL


def test_what_no_second_camera_sees_is_no_surface():
    cameras = [looking((2.5, 0, 0), name="a"), looking((0, 2.5, 0), name="b")]
    far = Ellipsoid((0.0, 0.0, 2.5), (0.2, 0.2, 0.2))
    aside = looking((0, 2.5, 0), at=(0, 0, 2.5), name="c")
    masks = masks_of([*cameras, aside], BALL, far)
    found = VisualHull([*cameras, aside], SHARP).points(masks)
    assert len(found.points) > 0
    assert np.abs(BALL.distance(found.points)).max() < 0.1  # of the far ball, which one camera sees, there is nothing


def test_a_lens_beyond_its_formula_says_nothing_there():
    # Strong barrel distortion turns back inside the picture: pixels farther out belong to no ray.
    cameras = ring(5, size=(640, 480), focal=280.0, distortion=(-0.32, 0.0, 0.0, 0.0))
    assert cameras[0].reach < 320 / 280
    found = hull(cameras, BALL)
    assert np.median(np.abs(BALL.distance(found.points))) < 0.3 * PIXEL
    assert np.isfinite(found.points).all()


def test_two_cameras_at_one_place_do_not_disturb_each_other():
    cameras = ring(4)
    twin = looking(cameras[0].centre, at=(0.2, 0.1, 0.0), name="twin")
    found = hull([*cameras, twin], BALL)
    assert np.median(np.abs(BALL.distance(found.points))) < 0.3 * PIXEL
    assert {0, 4} <= set(found.cameras)


def test_cameras_that_see_each_other():
    cameras = [looking((1.5, 0, 0.2), name="a"), looking((-1.5, 0, 0.1), name="b"), looking((0.2, 1.5, 0), name="c")]
    small = Ellipsoid((0.0, 0.2, 0.1), (0.1, 0.1, 0.1))
    found = hull(cameras, small)  # the epipoles are in the pictures
    assert len(found.points) > 100
    assert small.distance(found.points).min() > -PIXEL
    assert outside(cameras, masks_of(cameras, small), found.points).max() < 1.5


# Silhouettes that disagree --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("count", [5, 6, 7, 8])
def test_a_limb_is_kept_where_one_mask_has_a_gap(count):
    cameras = ring(count)
    masks = masks_of(cameras, LIMB)
    rows = np.arange(240)[:, None] - cameras[0].project(LIMB.centre)[1]
    holed = [masks[0] & (np.abs(rows) > 15), *masks[1:]]
    strict, kept = (VisualHull(cameras, HullSettings(tolerated=t)).points(holed) for t in (0, 1))
    gap = [np.abs(s.points[:, 2] - LIMB.centre[2]) < 0.1 for s in (strict, kept)]
    assert gap[0].sum() == 0  # the gap deletes the limb
    assert gap[1].sum() > 40
    assert np.abs(LIMB.distance(kept.points[gap[1]])).max() < PIXEL
    assert ((kept.normals * LIMB.normals(kept.points)).sum(1)[gap[1]] > 0.8).all()


def test_long_edges_elsewhere_do_not_count():
    """Where people stand around, rays leave most pictures within the silhouette of one who is near a camera."""
    cameras = ring(6)
    places = [(*(0.76 * camera.centre[:2] + (0.2, 0.25)), 0.3) for camera in cameras[1::2]]
    around = [Ellipsoid(place, (0.2, 0.2, 0.8)) for place in places]
    masks, rows = masks_of(cameras, LIMB, *around), np.arange(240)[:, None] - cameras[0].project(LIMB.centre)[1]
    (without,) = masks_of(cameras[:1], *around)
    masks[0] = without | (masks[0] & (np.abs(rows) > 15))
    points = [VisualHull(cameras, HullSettings(tolerated=t), company=True).points(masks).points for t in (0, 1)]
    gap = [(np.linalg.norm(p - LIMB.centre, axis=1) < 0.15) & (np.abs(p[:, 2] - LIMB.centre[2]) < 0.1) for p in points]
    assert gap[0].sum() == 0
    assert gap[1].sum() > 45


def test_as_many_may_be_wrong_as_are_tolerated():
    cameras = ring(9)
    masks = masks_of(cameras, LIMB)
    for n in (0, 4):
        rows = np.arange(240)[:, None] - cameras[n].project(LIMB.centre)[1]
        masks[n] = masks[n] & (np.abs(rows) > 15)
    found = [VisualHull(cameras, HullSettings(tolerated=t)).points(masks).points for t in (0, 1, 2)]
    counts = [(np.abs(points[:, 2] - LIMB.centre[2]) < 0.1).sum() for points in found]
    assert counts[0] == counts[1] == 0
    assert counts[2] > 40


@pytest.mark.parametrize("count", [2, 3, 4])
def test_few_cameras_tolerate_nothing(count):
    cameras = ring(count)
    same(hull(cameras, LIMB, settings=HullSettings(tolerated=3)), hull(cameras, LIMB))


@pytest.mark.parametrize("count", [5, 7, 8])
@pytest.mark.parametrize("solid", [BALL, LIMB])
def test_tolerance_takes_nothing_away_and_adds_only_surface(count, solid):
    cameras = ring(count)
    strict, tolerant = (hull(cameras, solid, settings=HullSettings(tolerated=t)) for t in (0, 1))
    new = ~np.isin(tolerant.points, strict.points).all(1)
    assert len(tolerant.points) - new.sum() == len(strict.points)
    off = solid.distance(tolerant.points[new])
    assert off.min() > -PIXEL
    assert np.percentile(off, 90) < PIXEL


# Laws -----------------------------------------------------------------------------------------------------------------


@given(st.tuples(*[st.floats(-3, 3)] * 3), st.tuples(*[st.floats(-20, 20)] * 3))
@settings(max_examples=15, deadline=None)
def test_moving_the_world_moves_the_points(turn, shift):
    cameras = ring(4, size=(160, 120), focal=140.0)
    masks, move = masks_of(cameras, TRUNK), rigid(rotation_from_vector(turn), shift)
    moved = [replace(c, T_camera_world=c.T_camera_world @ inverse(move)) for c in cameras]
    a, b = VisualHull(cameras, SHARP).points(masks), VisualHull(moved, SHARP).points(masks)
    same(a._replace(points=transform(move, a.points), normals=a.normals @ move[:3, :3].T), b, 1e-6)


@given(st.permutations(range(5)), st.integers(0, 2))
@settings(max_examples=15, deadline=None)
def test_the_order_of_the_cameras_does_not_matter(order, tolerated):
    cameras = ring(5, size=(160, 120), focal=140.0)
    masks, settings_ = masks_of(cameras, TRUNK, LIMB), HullSettings(tolerated=tolerated)
    a = VisualHull(cameras, settings_).points(masks)
    b = VisualHull([cameras[k] for k in order], settings_).points([masks[k] for k in order])
    b = b._replace(cameras=np.array(order)[b.cameras])
    order_ = np.argsort(b.cameras, kind="stable")
    same(a, SurfacePoints(*(array[order_] for array in b)), 1e-7)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=15, deadline=None)
def test_any_masks_give_points_inside_the_others(seed):
    rng = np.random.default_rng(seed)
    cameras = ring(3, size=(40, 30), focal=35.0)
    masks = [cv2.blur(rng.random((30, 40)), (5, 5)) > 0.5 for _ in cameras]
    found = VisualHull(cameras, SHARP).points(masks)
    assert np.isfinite(found.points).all()
    assert ((found.weights > 0) & (found.weights <= 1)).all()
    assert outside(cameras, masks, found.points).max(initial=0) < 1.5


def test_rays_may_be_cut_into_many_edges():
    cameras = ring(3, size=(320, 240))
    masks = [np.ones((240, 320), bool) for _ in cameras]
    for mask in masks:
        mask[:, ::6] = mask[:, 1::6] = False  # a fence
    found = VisualHull(cameras, HullSettings(tolerated=0, rays=300)).points(masks)
    assert len(found.points) > 300 * 15  # more than there was room for at first
    assert outside(cameras, masks, found.points).max() < 1.5


def test_the_same_masks_give_the_same_points_in_any_thread():
    cameras = ring(5)
    made, frames = VisualHull(cameras), [masks_of(cameras, replace(TRUNK, centre=(0.02 * k, 0, 0))) for k in range(4)]
    alone = [made.points(masks) for masks in frames]
    with ThreadPoolExecutor(4) as pool:
        for a, b in zip(alone, pool.map(made.points, frames)):
            same(a, b)


# Against the plain twin -----------------------------------------------------------------------------------------------


@pytest.mark.kernels
@pytest.mark.parametrize("company", [False, True])
@pytest.mark.parametrize("tolerated", [0, pytest.param(1, marks=pytest.mark.whole), 2])
@pytest.mark.parametrize("scene", ["bodies", "noise", "border"])
def test_viewing_edges_are_the_plain_ones(scene, tolerated, company, rng):
    lens = {"distortion": (-0.2, 0.05, 0.001, 0.0)} if scene == "bodies" else {}
    cameras = ring(6, size=(48, 40), focal=40.0 if scene != "border" else 110.0, **lens)
    masks = masks_of(cameras, TRUNK, replace(LIMB, centre=(0.3, 0.3, 0.1)), replace(BALL, centre=(-0.4, 0.2, 0.1), radii=(0.1, 0.1, 0.1)))
    if scene == "noise":
        masks = [mask ^ (cv2.blur(rng.random(mask.shape), (3, 3)) > 0.68) for mask in masks]
    made = VisualHull(cameras, HullSettings(tolerated=tolerated, rays=30 if scene == "noise" else 60), company)
    silhouettes = [_silhouette(mask, made._views[n]) for n, mask in enumerate(masks)]
    which, rays, _, depths = made._edges(silhouettes, np.arange(6))
    found = {}
    for n, ray, pair in zip(which, rays, depths):
        found.setdefault((n, *ray), []).append(pair)
    polygons = [[s.lines[a : b - 1] for a, b in pairwise(s.ends)] for s in silhouettes]
    assert len(found) > 10
    for (n, *ray), pairs in found.items():
        expected = naive_hull.viewing_edges(np.array(ray), n, cameras, polygons, tolerated, made.settings.longest if company else np.inf)
        np.testing.assert_allclose(np.array(pairs), expected, atol=1e-7)


# Errors ---------------------------------------------------------------------------------------------------------------


def test_what_cannot_be_a_hull_is_said():
    cameras = ring(3)
    with pytest.raises(CalibrationError, match="found 1 cameras, expected two or more"):
        VisualHull(cameras[:1])
    with pytest.raises(CalibrationError, match="camera 'plain': found only a field of view"):
        VisualHull([*cameras, Camera.from_fov((64, 48), 1.0, "plain")])
    masks = masks_of(cameras, BALL)
    with pytest.raises(TrackingError, match="found 2, expected 3, one a camera"):
        VisualHull(cameras).points(masks[:2])
    with pytest.raises(TrackingError, match=r"camera 'cam2': mask: found shape \(320, 240\), expected \(240, 320\)"):
        VisualHull(cameras).points([masks[0], masks[1].T, masks[2]])
    with pytest.raises(SettingsError, match="tolerated"):
        HullSettings(tolerated=-1)


# Recordings -----------------------------------------------------------------------------------------------------------


def test_a_walking_person(shared):
    folder = shared / "recordings" / "walking"
    cameras = read_calibration(folder / "calibration.toml")
    masks = [next(iter(open_frames(folder / "masks" / f"{c.name}.mkv", grey=True))).image > 127 for c in cameras]
    made = VisualHull(cameras)
    found = made.points(masks)
    assert 2000 <= len(found.points) <= 3000
    assert (outside(cameras, masks, found.points) > 3).mean() < 0.02
    assert len(np.unique(found.cameras)) == 7
    same(made.points([m.astype(np.uint8) for m in masks]), found)
