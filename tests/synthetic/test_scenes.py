"""What made recordings can show: rings of cameras, lenses, things, other people, light; and that old specs give what they gave."""

from __future__ import annotations

import itertools
from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import ShadowPuppetWarning
from shadowpuppet.io.motion.table import read_joints
from shadowpuppet.synthetic import Bystander, Gesture, Mannequin, Obstacle, Ring, Scene, Spec, Viewpoint, synthesize
from shadowpuppet.synthetic.compositing import FAR, Layer, composite, composite_people, visible
from shadowpuppet.synthetic.furniture import SHAPES, Furniture
from shadowpuppet.synthetic.movement import gestures
from shadowpuppet.synthetic.person.clothes import Clothes
from shadowpuppet.synthetic.person.kinematics import SEGMENTS, PosedBody, pose
from shadowpuppet.synthetic.person.mannequin import JOINTS
from shadowpuppet.synthetic.person.surface import Surface, ellipsoid
from shadowpuppet.synthetic.person_renderer import PersonRenderer, _covering
from shadowpuppet.synthetic.recording import perform
from shadowpuppet.synthetic.room import lamp_brightness
from shadowpuppet.synthetic.scene_renderer import SceneRenderer, bystander_body, dressed
from shadowpuppet.synthetic.viewpoint import BODY_CENTRE, RING_JITTER, RING_SCALE_JITTER
from shadowpuppet.video import open_frames

VIEW = Viewpoint(size=(64, 48))
SMALL = Spec(motion=(Gesture(motion="wave_hands", seconds=2),), cameras=(VIEW,), rate=2, scene=Scene(empty_seconds=0.5, noise=0))
LIGHTS = np.array([[0, -0.6, 0.8, 0.5], [0.6, -0.8, 0, 0.2], [0, 0, 0, 0.5]])


def shot(spec: Spec, figure: PosedBody, index: int = 0, others: tuple[PosedBody, ...] = (), view: Viewpoint | None = None):
    """One picture of the film with everything in it."""
    studio = SceneRenderer(spec, (view or spec.views()[0]).camera(), np.random.default_rng(0), others)
    one = figure._replace(joints=figure.joints[index : index + 1], rotation=figure.rotation[index : index + 1],
                          origin=figure.origin[index : index + 1], curl=figure.curl[index : index + 1])
    return next(studio.film(one))


def standing(body: Mannequin | None = None, left: float = 0.0, ahead: float = 0.0, **posture: float) -> PosedBody:
    figure = pose(body or Mannequin(), gestures.posture(**(posture or gestures.LEVEL)))
    place = np.array([left, -ahead, 0])
    return figure._replace(joints=figure.joints + place, origin=figure.origin + place)


def with_scene(spec: Spec = SMALL, **changes) -> Spec:
    return replace(spec, scene=replace(spec.scene, **changes))


def nobody(camera: Camera) -> PersonRenderer:
    """A renderer with hardly anything to draw, for its rays."""
    return PersonRenderer(camera, Surface.of([ellipsoid("pelvis", np.zeros(3), np.zeros(3), (0.1,) * 3, blend=0.01)]), Clothes(), LIGHTS)


def grown(mask: np.ndarray, pixels: int = 1) -> np.ndarray:
    return cv2.dilate(mask.astype(np.uint8), np.ones((2 * pixels + 1,) * 2)) > 0


# What was


def test_old_specs_give_what_they_gave(tmp_path):
    """Settings are chosen on such recordings: what was added since must not change them."""
    spec = Spec(motion=(Gesture(motion="wave_hands", seconds=2), Gesture(motion="random", seconds=3)), cameras=(Viewpoint(size=(80, 60)),),
                rate=2, turn_deg=5, scene=Scene(clothing=3, room=4, shadow=0.3))  # fmt: skip
    for_motion, for_noise = np.random.default_rng(11).spawn(2)
    _, figure = perform(spec, for_motion)
    film = list(SceneRenderer(spec, spec.cameras[0].camera(), for_noise.spawn(1)[0]).film(figure))
    np.testing.assert_allclose(figure.joints[[4, 9], JOINTS.index("left_hand")], HANDS, atol=2e-6)
    area = [int((picture.mask > 0).sum()) for picture in film]
    np.testing.assert_allclose(area, AREAS, atol=2)  # the arithmetic of processors may differ by a grazing ray
    folder = synthesize(spec, tmp_path, np.random.default_rng(11))
    np.testing.assert_allclose(read_joints(folder / "truth.csv").select(["left_hand"]).positions[[4, 9], 0], HANDS, atol=2e-5)
    masks = [int((frame.image > 0).sum()) for frame in open_frames(folder / "masks" / "cam.mkv", grey=True)]
    np.testing.assert_allclose(masks, AREAS, atol=2)
    means = [picture.image.mean((0, 1)) for picture in film[::4]]
    np.testing.assert_allclose(means, MEANS, atol=0.05)
    spread = [picture.image.std() for picture in film[::4]]
    np.testing.assert_allclose(spread, SPREADS, atol=0.05)


HANDS = [[0.45207, -0.005313, 1.715959], [0.359599, -0.513603, 1.704239]]
AREAS = [519, 520, 552, 555, 556, 558, 568, 515, 557, 564, 567, 563, 569, 519]
MEANS = [[135.677, 139.311, 122.818], [134.674, 138.514, 122.901], [133.472, 137.619, 121.802], [134.149, 138.02, 122.814]]
SPREADS = [44.46, 44.566, 45.244, 44.658]


# Cameras


@given(count=st.integers(2, 12), radius=st.floats(1.5, 8), height=st.floats(0.2, 4), start=st.floats(-180, 180), stature=st.floats(1, 2))
@settings(max_examples=40, deadline=None)
def test_a_perfect_ring_is_evenly_spread_and_looks_at_the_middle(count, radius, height, start, stature):
    views = Ring(count=count, radius=radius, height=height, start_deg=start, jitter=0).views(stature)
    cameras = [view.camera() for view in views]
    centres = np.array([camera.centre for camera in cameras])
    np.testing.assert_allclose(np.hypot(*centres[:, :2].T), radius)
    np.testing.assert_allclose(centres[:, 2], height)
    along = np.arctan2(centres[:, 1], centres[:, 0])
    np.testing.assert_allclose(np.mod(np.diff(along), 2 * np.pi), 2 * np.pi / count, atol=1e-9)
    middle = np.array([0, 0, BODY_CENTRE * stature])
    if abs(np.degrees(np.arctan2(height - middle[2], radius))) < 60:
        for camera in cameras:
            np.testing.assert_allclose(camera.project(middle), (np.array(camera.size) - 1) / 2, atol=1e-6)


@given(ahead=st.floats(-2, 2), left=st.floats(-2, 2), start=st.floats(-180, 180))
@settings(max_examples=30, deadline=None)
def test_a_ring_may_be_about_another_place_than_the_persons(ahead, left, start):
    ring = Ring(count=5, radius=4.5, start_deg=start, jitter=0)
    views = replace(ring, ahead=ahead, left=left).views(1.75)
    middle = np.array([left, -ahead, BODY_CENTRE * 1.75])
    for view, about_person in zip(views, ring.views(1.75)):
        camera = view.camera()
        np.testing.assert_allclose(camera.centre[:2] - middle[:2], about_person.camera().centre[:2], atol=1e-9)
        assert np.linalg.norm(camera.project(middle) - 0.5 * np.array(view.size)) < 0.03 * view.size[0]  # pitch and yaw are not of one axis


@given(jitter=st.floats(0.05, 1), seed=st.integers(0, 1000))
@settings(max_examples=30, deadline=None)
def test_a_rings_cameras_stray_as_far_as_asked_and_no_farther(jitter, seed):
    ring = Ring(count=6, jitter=jitter, seed=seed)
    views, perfect = ring.views(1.75), replace(ring, jitter=0).views(1.75)
    for view, wanted in zip(views, perfect):
        off = (view.azimuth_deg - wanted.azimuth_deg + 180) % 360 - 180
        assert abs(off) <= jitter * RING_JITTER["azimuth_deg"] + 1e-9
        assert abs(view.height - wanted.height) <= jitter * RING_JITTER["height"] + 1e-9
        assert abs(view.distance / wanted.distance - 1) <= jitter * RING_SCALE_JITTER + 1e-9
        assert 0 < abs(view.roll_deg) <= jitter * RING_JITTER["roll_deg"]
        pixel = view.camera().project([0, 0, BODY_CENTRE * 1.75])
        assert np.linalg.norm(pixel - 0.5 * np.array(view.size)) < 0.2 * view.size[0]
    assert views == ring.views(1.75)
    assert views != replace(ring, seed=seed + 1).views(1.75)


def test_roll_turns_the_picture_and_yaw_moves_it():
    points = np.random.default_rng(0).normal([0, 0, 1.4], 0.3, (20, 3))
    upright = VIEW.camera()
    middle = (np.array(VIEW.size) - 1) / 2
    seen = upright.project(points) - middle
    quarter = replace(VIEW, roll_deg=90).camera().project(points) - middle  # the camera turns clockwise, the picture against it
    np.testing.assert_allclose(quarter, np.stack([seen[:, 1], -seen[:, 0]], 1), atol=1e-9)
    aside = replace(VIEW, yaw_deg=10).camera()
    ahead = aside.project([0, 0, 1.6])
    np.testing.assert_allclose(ahead - middle, [-upright.matrix[0, 0] * np.tan(np.radians(10)), 0], atol=1e-9)
    np.testing.assert_allclose(aside.centre, upright.centre, atol=1e-12)


@given(fov=st.floats(20, 110), k=st.tuples(*[st.floats(-0.004, 0.004)] * 4))
@settings(max_examples=30, deadline=None)
def test_a_fisheyes_picture_is_as_wide_as_asked_and_its_rays_lead_back(fov, k):
    view = Viewpoint(size=(64, 48), fov_deg=fov, fisheye=True)
    camera = view.camera()
    edge = camera.rays([(view.size[0] - 1) / 2 + view.size[0] / 2, (view.size[1] - 1) / 2])
    assert np.degrees(np.arctan(edge[0])) == pytest.approx(fov / 2, abs=1e-3)
    bent = replace(view, distortion=k).camera()
    pixels = np.random.default_rng(1).uniform(0, view.size, (50, 2))
    rays = bent.rays(pixels)
    np.testing.assert_allclose(bent.project(bent.centre + rays @ bent.T_camera_world[:3, :3]), pixels, atol=0.02)


@pytest.mark.parametrize("view", [
    Viewpoint(size=(96, 72), fisheye=True, fov_deg=125, distance=1.6),
    Viewpoint(size=(96, 72), fisheye=True, fov_deg=100, distance=1.8, distortion=(0.03, -0.01, 0, 0), roll_deg=30),
    Viewpoint(size=(60, 90), distortion=(-0.25, 0.08, 0.001, 0), roll_deg=-70, yaw_deg=8, distance=3),
])  # fmt: skip
def test_a_ball_and_all_joints_are_where_the_camera_projects_them(view):
    radius, centre = 0.25, np.array([0.25, 0.1, 1.4])
    camera, origin = view.camera(), standing().origin[0, SEGMENTS.index("pelvis")]
    one = Surface.of([ellipsoid("pelvis", origin, centre, (radius,) * 3, blend=0.01)])
    seen = PersonRenderer(camera, one, Clothes(), LIGHTS).draw(standing(), 0)
    pixels = np.stack(np.meshgrid(*map(np.arange, view.size)), -1)
    rays = camera.rays(pixels) @ camera.T_camera_world[:3, :3]
    along = ((centre - camera.centre) * rays).sum(-1) / np.linalg.norm(rays, axis=-1)
    miss = np.sqrt(((centre - camera.centre) ** 2).sum() - along**2) - radius
    sure = np.abs(miss) > 0.003
    np.testing.assert_array_equal(seen.mask[sure], (miss[sure] < 0) & (along[sure] > 0))

    picture = shot(SMALL, standing(), view=view)
    joints = np.rint(camera.project(standing().joints[0])).astype(int)
    inside = ((joints >= 0) & (joints < view.size)).all(1)
    assert inside.sum() >= 8
    assert grown(picture.mask)[joints[inside, 1], joints[inside, 0]].all()


def test_all_cameras_of_a_ring_see_all_joints():
    spec = replace(SMALL, cameras=(Viewpoint(),), ring=Ring(count=5, size=(96, 72), jitter=1, seed=3))
    figure = standing(spec.body)
    for view in spec.views():
        mask = shot(spec, figure, view=view).mask
        joints = np.rint(view.camera().project(figure.joints[0])).astype(int)
        assert ((joints >= 0) & (joints < view.size)).all()
        assert grown(mask)[joints[:, 1], joints[:, 0]].all()


# Things


def naive_depth(camera: Camera, things: Furniture, step: float = 0.008) -> np.ndarray:
    """Where rays first enter a box or post, by walking along them; the plain twin of `Furniture.met`."""
    width, height = camera.size
    rays = camera.rays(np.stack(np.meshgrid(np.arange(width), np.arange(height)), -1)) @ camera.T_camera_world[:3, :3]
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    depth = np.full((height, width), FAR)
    for t in np.arange(1.2, 4.5, step):
        points = camera.centre + t * rays
        for thing in things.things:
            turn = np.radians(thing.turn_deg)
            x, y = points[..., 0] - thing.left, points[..., 1] + thing.ahead
            local = np.stack([np.cos(turn) * x + np.sin(turn) * y, np.cos(turn) * y - np.sin(turn) * x, points[..., 2]], -1)
            for block in SHAPES[thing.kind]:
                within = ((local >= block.low) & (local <= block.high)).all(-1)
                if block.round:
                    middle, half = np.add(block.low, block.high)[:2] / 2, np.subtract(block.high, block.low)[:2] / 2
                    within &= (((local[..., :2] - middle) / half) ** 2).sum(-1) <= 1
                depth = np.where(within & (depth == FAR), t, depth)
    return depth


@pytest.mark.parametrize("kind", list(SHAPES))
def test_things_are_where_a_walk_along_the_rays_meets_them(kind):
    view = replace(VIEW, distance=2.6, height=1.3, pitch_deg=10)
    things = Furniture([Obstacle(kind=kind, ahead=0.7, left=0.2, turn_deg=35), Obstacle(kind=kind, ahead=-0.8, left=-0.5, turn_deg=-120)])
    camera = view.camera()
    renderer = nobody(camera)
    layer, wanted = things.layer(camera.centre, renderer.rays, renderer.fine_rays(), LIGHTS), naive_depth(camera, things)
    met = layer.depth < FAR
    assert 0.01 < met.mean() < 0.6
    assert (met != (wanted < FAR)).mean() < 0.015  # a walk steps over a grazed corner
    both = met & (wanted < FAR)
    close = np.abs(layer.depth - wanted) < 0.016
    assert close[both].mean() > 0.99
    assert ((layer.alpha > 0.5) != met).mean() < 0.05
    assert (layer.alpha[met] > 0).all()
    assert np.isfinite(layer.picture).all()
    assert layer.picture[met].min() > 0.01


@pytest.mark.parametrize("kind", list(SHAPES))
def test_an_obstacle_takes_exactly_its_pixels_from_the_mask(kind):
    spec = replace(SMALL, cameras=(replace(VIEW, distance=3.0, height=1.2),))
    obstacle = Obstacle(kind=kind, ahead=0.8, left=0.15, turn_deg=20)
    plain, hidden = shot(spec, standing()), shot(with_scene(spec, obstacles=(obstacle,)), standing())
    thing = Furniture([obstacle]).intersect(spec.cameras[0].camera().centre, nobody(spec.cameras[0].camera()).rays)[0] < FAR
    lost = (plain.mask > 0) & (hidden.mask == 0)
    np.testing.assert_array_equal(hidden.mask > 0, (plain.mask > 0) & ~thing)
    assert hidden.hidden == lost.sum() > 5
    assert plain.hidden == 0
    # What shows through is the thing itself, and what it does not touch is as it was.
    unshaded = with_scene(spec, obstacles=(obstacle,), shadow=0)
    bare = SceneRenderer(unshaded, spec.cameras[0].camera(), np.random.default_rng(0)).empty().astype(int)
    inner = ~grown(~lost)
    dark = shot(with_scene(spec, obstacles=(obstacle,), shadow=0), standing()).image.astype(int)
    assert np.abs(dark - bare)[inner].max(initial=0) <= 4  # the lens blurs a little
    clear = shot(with_scene(spec, shadow=0), standing()).image.astype(int)
    assert np.abs(dark - clear)[~grown(thing, 2)].max() <= 1


def test_an_obstacle_behind_the_person_takes_nothing():
    spec = with_scene(obstacles=(Obstacle(kind="pillar", ahead=-0.8),))
    picture = shot(spec, standing())
    np.testing.assert_array_equal(picture.mask, shot(SMALL, standing()).mask)
    assert picture.hidden == 0


def test_the_empty_scene_shows_the_thing_and_its_shadow():
    view = replace(VIEW, distance=3.5)
    things = (Obstacle(kind="table", ahead=0.5),)
    spec = replace(SMALL, cameras=(view,))
    empty = [SceneRenderer(with_scene(spec, obstacles=o, shadow=shadow), view.camera(), np.random.default_rng(0)).empty()
             for o, shadow in (((), 0.6), (things, 0.0), (things, 0.6))]  # fmt: skip
    bare, alone, shaded = (image.astype(int) for image in empty)
    assert (np.abs(alone - bare).max(-1) > 15).mean() > 0.03
    assert (shaded <= alone + 1).all()
    room = SceneRenderer(with_scene(spec, obstacles=things), view.camera(), np.random.default_rng(0)).room
    points = room._points(np.stack(np.meshgrid(*map(np.arange, view.size)), -1))[0]
    lit = Furniture(things).layer(view.camera().centre, nobody(view.camera()).rays, nobody(view.camera()).fine_rays(), LIGHTS)
    shadow = Furniture(things).shades(points, room.lights[0, :3]) & ~lit.mask
    dark = (shaded < 0.8 * alone).all(-1)
    assert shadow.sum() > 40
    assert dark[shadow].mean() > 0.9
    assert not (dark & ~grown(shadow, 2)).any()


def test_an_obstacle_is_there_from_its_entry_until_it_leaves(tmp_path):
    view, still = replace(VIEW, distance=3.5), Gesture(motion="stand", seconds=2)
    brought = Obstacle(kind="cabinet", ahead=0.6, left=0.3, enters=0.5, leaves=2.5)
    spec = replace(with_scene(obstacles=(brought,), crf=0), cameras=(view,), motion=(still,), still=0.0)
    with_it, without = (synthesize(one, tmp_path / name) for name, one in (("with", spec), ("without", with_scene(spec, obstacles=()))))
    films = [np.stack([f.image for f in open_frames(folder / kind / "cam.mp4")]).astype(int)
             for kind in ("video", "background") for folder in (with_it, without)]
    there = (np.abs(films[0] - films[1]).max(-1) > 20).mean((1, 2)) > 0.02
    np.testing.assert_array_equal(there, [0, 1, 1, 1, 1, 0, 0, 0])  # at 0, 0.5, 1, ... s
    np.testing.assert_array_equal(films[2], films[3])
    seen = [[int((f.image > 0).sum()) for f in open_frames(folder / "masks" / "cam.mkv", grey=True)] for folder in (with_it, without)]
    np.testing.assert_array_equal(np.less(*seen), there)


def test_which_obstacles_are_there():
    always, late, new = Obstacle(kind="table"), Obstacle(kind="chair", enters=2.0, leaves=3.0), Obstacle(kind="pillar", enters=0)
    taken = Obstacle(kind="cabinet", leaves=1.0)
    things = Furniture([always, late, new, taken])
    assert things.at(None).things == (always, taken)
    assert things.at(0.0).things == (always, new, taken)
    assert things.at(1.0).things == things.at(3.0).things == (always, new)
    assert things.at(2.0).things == (always, late, new)
    assert [len(now.things) for now in things.arrangements()] == [2, 3, 3, 2]
    assert [now.things for now in Furniture([always]).arrangements()] == [(always,)]


def test_a_scaled_obstacle_is_as_large_as_asked():
    down, high = np.array([0.0, 0.0, -1.0]), np.array([0.0, -0.8, 3.0])
    for scale in (0.5, 1.0, 1.5):
        away = Furniture([Obstacle(kind="table", ahead=0.8, scale=scale)]).intersect(high, down[None])[0][0]
        assert 3.0 - away == pytest.approx(0.74 * scale)


def test_the_chair_under_a_seated_person_is_where_they_sit(tmp_path):
    spec = replace(SMALL, scene=Scene(obstacles=(Obstacle(kind="chair", seat=True, enters=0),), empty_seconds=0), posture="seated",
                   turn_deg=70, motion=(Gesture(motion="stand", seconds=2),))
    chair = spec.furniture().things[0]
    assert chair.turn_deg == 70
    assert np.hypot(chair.left, chair.ahead) < 0.1
    folder = synthesize(spec, tmp_path / "made")
    assert not (folder / "background").exists()
    assert not (folder / "references").exists()
    pelvis = read_joints(folder / "truth.csv").select(["pelvis"]).positions[:, 0]
    np.testing.assert_allclose(pelvis[:, :2], 0, atol=1e-4)
    assert 0.5 < pelvis[0, 2] < 0.6
    standing_up = replace(spec, posture="standing", motion=(Gesture(motion="sit_down", seconds=4),))
    behind = standing_up.furniture().things[0]
    _, figure = perform(standing_up, np.random.default_rng(0))
    lowest = figure.joints[figure.joints[:, 0, 2].argmin(), 0]
    middle = np.array([behind.left, -behind.ahead])
    assert np.linalg.norm(lowest[:2] - middle) < 0.1
    assert lowest[2] == pytest.approx(pelvis[0, 2], abs=0.01)


# Other people


def test_a_person_behind_takes_nothing_and_is_in_the_mask_of_all():
    someone = Bystander(kind="man", ahead=-0.9, left=0.6)
    other = standing(bystander_body(someone), someone.left, someone.ahead, **gestures.HANGING_ARMS)
    spec = with_scene(bystanders=(someone,), shadow=0)
    alone, both = shot(with_scene(shadow=0), standing()), shot(spec, standing(), others=(other,))
    np.testing.assert_array_equal(both.mask, alone.mask)
    assert (both.people >= both.mask).all()
    camera = VIEW.camera()
    pixels = np.rint(camera.project(other.joints[0])).astype(int)
    inside = ((pixels >= 0) & (pixels < VIEW.size)).all(1)
    assert inside.sum() >= 4
    assert grown(both.people)[pixels[inside, 1], pixels[inside, 0]].all()
    added = (both.people > 0) & (both.mask == 0)
    assert added.sum() > 100
    differs = np.abs(both.image.astype(int) - alone.image).max(-1) > 3
    assert not (differs & ~grown(added, 2)).any()
    assert differs[added].mean() > 0.7


def test_a_person_in_front_hides_the_person():
    someone = Bystander(kind="woman", ahead=0.8, left=0.3)
    other = standing(bystander_body(someone), someone.left, someone.ahead)
    alone, both = shot(SMALL, standing()), shot(with_scene(bystanders=(someone,)), standing(), others=(other,))
    assert not ((both.mask > 0) & (alone.mask == 0)).any()
    lost = (alone.mask > 0) & (both.mask == 0)
    assert lost.sum() == both.hidden > 30
    assert (both.people[lost] == 255).all()


def test_a_bystander_keeps_to_their_place_and_casts_a_shadow(tmp_path):
    spec = with_scene(bystanders=(Bystander(ahead=0.2, left=0.9, motion=Gesture(motion="random")),), shadow=0.6)
    figures = []
    from shadowpuppet.synthetic import recording

    made = recording._bystander(spec, spec.scene.bystanders[0], 9, np.random.default_rng(1))
    figures.append(made)
    assert len(made.joints) == len(made.rotation) == 9
    ankles = made.joints[:, [JOINTS.index("left_ankle"), JOINTS.index("right_ankle")]].mean((0, 1))
    np.testing.assert_allclose(ankles[:2], [0.9, -0.2], atol=0.02)
    assert np.ptp(made.joints[:, JOINTS.index("left_hand")], axis=0).max() > 0.1
    folder = synthesize(spec, tmp_path / "two", np.random.default_rng(0))
    masks, people = ([f.image for f in open_frames(folder / kind / "cam.mkv", grey=True)] for kind in ("masks", "people"))
    assert len(masks) == len(people) == 8
    assert all((b >= a).all() and (b > a).any() for a, b in zip(masks, people))
    room = SceneRenderer(spec, VIEW.camera(), np.random.default_rng(0), figures).room
    person, bare = standing(), room.pictures[0]
    assert (room.shaded(bare, person, 0, standing(left=0.9)) <= room.shaded(bare, person, 0) + 1e-12).all()


# Light and picture quality


def test_brightness_wobbles_and_drifts():
    calm, lively = Scene(), Scene(flicker=0.1, flicker_hz=2.0, drift=-0.3)
    assert all(lamp_brightness(calm, t, 10) == 1 for t in (-3, 0, 4.2))
    assert lamp_brightness(lively, 0, 10) == 1
    assert lamp_brightness(lively, 0.125, 10) == pytest.approx(1.1, abs=1e-3)
    assert lamp_brightness(lively, -0.125, 10) == pytest.approx(0.9, abs=1e-3)  # the empty scene's lamps are the same
    assert lamp_brightness(lively, 10, 10) == pytest.approx(0.7)
    assert lamp_brightness(replace(lively, flicker=0.0), 5, 10) == pytest.approx(0.85)


def test_the_films_show_what_the_light_does():
    spec = with_scene(replace(SMALL, rate=4), flicker=0.2, flicker_hz=1.0, drift=0.3, background="plain", shadow=0)
    _, figure = perform(spec, np.random.default_rng(0))
    studio, still = (SceneRenderer(one, VIEW.camera(), np.random.default_rng(0))
                     for one in (spec, with_scene(spec, flicker=0.0, drift=0.0)))
    lit, calm = list(studio.film(figure)), list(still.film(figure))
    seconds = np.arange(len(lit)) / 4
    wanted = np.array([lamp_brightness(spec.scene, t, seconds[-1]) for t in seconds])
    corner = np.array([a.image[:8, :8].mean() / b.image[:8, :8].mean() for a, b in zip(lit, calm)])
    np.testing.assert_allclose(corner, wanted, atol=0.01)
    assert np.ptp(wanted) > 0.3
    assert all((a.mask == b.mask).all() for a, b in zip(lit, calm))
    empty = [studio.empty(n, 4)[:8, :8].mean() for n in range(4)]
    assert np.ptp(empty) > 0.2 * np.mean(empty)


def test_pictures_are_the_same_whatever_the_number_of_threads_with_everything_in_them():
    someone = Bystander(kind="child", ahead=0.5, left=-0.5)
    spec = with_scene(replace(SMALL, rate=3), obstacles=(Obstacle(kind="chair"),), bystanders=(someone,), flicker=0.1, noise=5)
    _, figure = perform(spec, np.random.default_rng(0))
    other = pose(bystander_body(someone), np.repeat(gestures.posture(), len(figure.joints), 0))
    films = [list(SceneRenderer(spec, VIEW.camera(), np.random.default_rng(1), [other]).film(figure, workers)) for workers in (1, 3)]
    for a, b in zip(*films):
        assert all(np.array_equal(x, y) for x, y in zip(a, b))


def test_backgrounds_differ_as_asked():
    def roughness(kind):
        studio = SceneRenderer(with_scene(background=kind, room=5), replace(VIEW, size=(160, 120)).camera(), np.random.default_rng(0))
        grey = studio.room.pictures[0].mean(-1)
        return float(np.abs(np.diff(grey, axis=1)).mean())

    rough = {kind: roughness(kind) for kind in ("plain", "room", "textured", "cluttered")}
    assert rough["plain"] < 0.5 * rough["room"] < 0.5 * rough["cluttered"]
    assert rough["textured"] > 2 * rough["plain"]


@pytest.mark.parametrize("kind", ["room", "plain", "cluttered", "textured"])
def test_two_cameras_at_one_place_see_the_same_room(kind):
    wide, narrow = replace(VIEW, fov_deg=60, size=(120, 90)), replace(VIEW, fov_deg=60, size=(60, 45))
    rooms = [SceneRenderer(with_scene(background=kind), view.camera(), np.random.default_rng(0)).room for view in (wide, narrow)]
    halved = rooms[0].pictures[0].reshape(45, 2, 60, 2, 3).mean((1, 3))
    assert np.abs(halved - rooms[1].pictures[0]).mean() < 0.03


def test_camouflage_dyes_the_clothes():
    studios = [SceneRenderer(with_scene(camouflage=share), VIEW.camera(), np.random.default_rng(0)) for share in (0.0, 0.5, 1.0)]
    off = [np.linalg.norm(s.renderer.colours[1] - s.room.wall_colour) for s in studios]
    assert off[1] == pytest.approx(off[0] / 2)
    assert off[2] == pytest.approx(0, abs=1e-12)


def test_compression_makes_films_smaller_and_worse(tmp_path):
    spec = replace(SMALL, cameras=(replace(VIEW, size=(128, 96)),))
    sizes, errors, exact = [], [], None
    for crf in (0, 18, 42):
        folder = synthesize(with_scene(spec, crf=crf, noise=3), tmp_path / str(crf), np.random.default_rng(0))
        film = np.stack([frame.image for frame in open_frames(folder / "video" / "cam.mp4")]).astype(int)
        exact = film if exact is None else exact
        sizes.append((folder / "video" / "cam.mp4").stat().st_size)
        errors.append(np.abs(film - exact).mean())
    assert sizes[0] > 1.5 * sizes[1] > 3 * sizes[2]
    assert errors[0] == 0 < errors[1] < errors[2]


# Layers


def layer(light: float, alpha: float, depth: float) -> Layer:
    return Layer(np.full((2, 3, 3), light * alpha), np.full((2, 3), alpha), np.full((2, 3), depth))


@given(values=st.lists(st.tuples(st.floats(0, 1), st.floats(0, 1), st.floats(0.5, 9)), min_size=1, max_size=4, unique_by=lambda v: v[2]))
def test_layers_go_over_one_another_by_depth_whatever_their_order(values):
    room = np.full((2, 3, 3), 0.3)
    layers = [layer(*value) for value in values]
    wanted = 0.3
    for light, alpha, _ in sorted(values, key=lambda value: -value[2]):
        wanted = light * alpha + (1 - alpha) * wanted
    for order in itertools.islice(itertools.permutations(layers), 6):
        np.testing.assert_allclose(composite(room, order), wanted)
    nearest = min(range(len(values)), key=lambda n: values[n][2])
    for n, one in enumerate(layers):
        assert visible(one, layers[:n] + layers[n + 1 :]).all() == (n == nearest)


@given(seed=st.integers(0, 999), people=st.integers(1, 2), things=st.integers(0, 2))
@settings(max_examples=30, deadline=None)
def test_people_are_sorted_in_where_they_are_as_everywhere(seed, people, things):
    rng = np.random.default_rng(seed)
    layers = []
    for _ in range(people + things):
        inside = np.zeros((9, 11), bool)
        top, left = rng.integers(0, 9), rng.integers(0, 11)
        inside[top : top + rng.integers(0, 5), left : left + rng.integers(0, 5)] = True
        alpha = np.where(inside, rng.choice([0.3, 1.0], inside.shape), 0.0)
        depth = np.where(alpha > 0.5, rng.uniform(1, 3, alpha.shape), FAR)
        layers.append(Layer(rng.uniform(size=(9, 11, 3)) * alpha[..., None], alpha, depth))
    room = rng.uniform(size=(9, 11, 3))
    np.testing.assert_allclose(composite_people(room, layers[:people], layers[people:]), composite(room, layers), atol=1e-12)


def test_a_half_covered_pixel_counts_at_its_neighbours_depth():
    depth, alpha = np.full((3, 5), FAR), np.zeros((3, 5))
    depth[:, :2], alpha[:, :2], alpha[:, 2] = 2.0, 1.0, 0.4
    reach = Layer(np.zeros((3, 5, 3)), alpha, depth).reach
    np.testing.assert_array_equal(reach[0], [2, 2, 2, FAR, FAR])


def test_a_camera_that_sees_nobody_is_reported(tmp_path):
    aside = replace(VIEW, fov_deg=30.0, yaw_deg=60.0)
    with pytest.warns(ShadowPuppetWarning, match="camera 'cam': sees nothing of the person in any picture"):
        synthesize(replace(SMALL, rate=1, cameras=(aside,)), tmp_path, np.random.default_rng(0))


def test_obstacles_that_hide_nothing_are_reported(tmp_path):
    spec = with_scene(replace(SMALL, rate=1), obstacles=(Obstacle(kind="table", ahead=-2.0, left=2.0),))
    with pytest.warns(ShadowPuppetWarning, match="obstacles: nothing of the person is hidden"):
        synthesize(spec, tmp_path, np.random.default_rng(0))


def test_the_spheres_by_which_parts_are_culled_cover_them(rng):
    """What a sphere misses would be missing in the pictures."""
    surface = dressed(Mannequin(), Clothes())
    number = len(surface.length)
    axes, origin = np.broadcast_to(np.eye(3), (number, 3, 3)), rng.standard_normal((number, 3))
    spheres = _covering(origin, axes, surface)
    along = np.linspace(-surface.caps[:, 0], surface.length + surface.caps[:, 1], 25)
    rim = np.stack([surface.radius + 0 * along, 0 * along, along], -1)
    far = np.linalg.norm((origin + rim)[:, :, None] - spheres[..., :3], axis=-1)
    assert (far <= spheres[..., 3]).any(-1).all()
