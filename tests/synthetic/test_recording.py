"""Made recordings: a body that keeps its lengths, motions in continuous time, exact masks, and the recording layout."""

from __future__ import annotations

import csv
import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from naive_surface import LIGHTS, naive_distance

from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import RecordingError, SettingsError
from shadowpuppet.geometry import rigid
from shadowpuppet.io.calibration.calibration_files import read_calibration
from shadowpuppet.io.recording import read_recording
from shadowpuppet.synthetic import (
    Gesture,
    Mannequin,
    Scene,
    Spec,
    Viewpoint,
    demo_spec,
    proving_ground,
    proving_rings,
    spec_from,
    synthesize,
)
from shadowpuppet.synthetic.movement import gestures
from shadowpuppet.synthetic.movement.sequence import sequence_seconds
from shadowpuppet.synthetic.person.clothes import Clothes
from shadowpuppet.synthetic.person.kinematics import CHANNELS, SEGMENTS, pose
from shadowpuppet.synthetic.person.mannequin import FRACTIONS, JOINTS, MEASURES
from shadowpuppet.synthetic.person.surface import Surface, ellipsoid
from shadowpuppet.synthetic.person_renderer import PersonRenderer
from shadowpuppet.synthetic.recording import perform
from shadowpuppet.synthetic.scene_renderer import EmptyStage, SceneRenderer, dressed
from shadowpuppet.synthetic.truth import SOLES
from shadowpuppet.video import open_frames, read_image

VIEW = Viewpoint(size=(80, 60))
BONES = [("neck", "head"), ("pelvis", "left_hip"),
         ("left_shoulder", "left_elbow"), ("left_elbow", "left_wrist"), ("left_wrist", "left_hand"),
         ("left_hip", "left_knee"), ("left_knee", "left_ankle")]


def at(figure, name):
    return figure.joints[:, JOINTS.index(name)]


def rows_of(path):
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def small(**changes) -> Spec:
    spec = Spec(motion=(Gesture(motion="wave_hands", seconds=2),), cameras=(VIEW,), rate=4, scene=Scene(empty_seconds=0.5))
    return replace(spec, **changes)


# The body


@settings(deadline=None)
@given(seed=st.integers(0, 10_000), kind=st.sampled_from(["woman", "man", "child", None]))
def test_drawn_people_are_plausible_and_measured(seed, kind):
    body = Mannequin.draw(np.random.default_rng(seed), kind)
    low, high = {"woman": (1.45, 1.8), "man": (1.55, 1.95), "child": (1.0, 1.6), None: (1.0, 1.95)}[kind]
    assert low < body.stature < high
    assert all(0 < body.measure(name) < 1.6 for name in MEASURES)
    assert body.measure("head_height") < body.stature / 4.5
    assert sum(body.length(name) for name in ("thigh", "shank", "ankle")) == pytest.approx(0.53 * body.stature)
    assert set(JOINTS) <= set(body.rest())


def test_mean_man_and_woman_have_the_published_measures():
    for column, stature, build in ((0, 1.629, 0.0), (1, 1.756, 1.0)):
        body = Mannequin(stature=stature, build=build)
        assert all(body.measure(name) == pytest.approx(values[column]) for name, values in MEASURES.items())
        assert all(body.length(name) == pytest.approx(values[column] * stature) for name, values in FRACTIONS.items())


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_bones_keep_their_lengths_and_feet_their_places_in_any_posture(seed):
    rng = np.random.default_rng(seed)
    body = Mannequin.draw(rng)
    postures = rng.uniform(-0.5, 0.5, (6, len(CHANNELS)))
    postures[:, [CHANNELS.index("sway_x"), CHANNELS.index("sway_y")]] *= 0.1
    postures[:, CHANNELS.index("turn")] = rng.uniform(-3, 3)
    figure = pose(body, postures)
    for a, b in BONES + [(a.replace("left", "right"), b.replace("left", "right")) for a, b in BONES]:
        rest = body.rest()
        wanted = np.linalg.norm(rest[a] - rest[b])
        tolerance = {"left_ankle": 1e-2, "right_ankle": 1e-2}.get(b, 1e-9)  # the rest's shank leans, its length is the segment's
        np.testing.assert_allclose(np.linalg.norm(at(figure, a) - at(figure, b), axis=1), wanted, rtol=tolerance)
    assert np.ptp(np.linalg.norm(at(figure, "left_knee") - at(figure, "left_ankle"), axis=1)) < 1e-9
    assert np.ptp(at(figure, "left_ankle"), axis=0).max() < 1e-9
    identity = figure.rotation @ figure.rotation.swapaxes(-1, -2)
    np.testing.assert_allclose(identity, np.broadcast_to(np.eye(3), identity.shape), atol=1e-9)
    assert (np.linalg.det(figure.rotation) > 0).all()


@given(seed=st.integers(0, 10_000))
@settings(max_examples=20, deadline=None)
def test_the_mirrored_posture_gives_the_mirrored_figure(seed):
    rng = np.random.default_rng(seed)
    body, posture = Mannequin.draw(rng), rng.uniform(-0.4, 0.4, len(CHANNELS))
    other = posture.copy()
    for column, name in enumerate(CHANNELS):
        if name.startswith(("left_", "right_")):
            swapped = name.replace("left_", "@").replace("right_", "left_").replace("@", "right_")
            other[CHANNELS.index(swapped)] = posture[column]
        elif name in ("turn", "sway_x") or name.endswith(("_side", "_twist", "_tilt", "_turn")):
            other[column] = -posture[column]
    figure, mirror = pose(body, posture[None]), pose(body, other[None])
    for name in JOINTS:
        swapped = name.replace("left_", "@").replace("right_", "left_").replace("@", "right_")
        np.testing.assert_allclose(at(figure, name), at(mirror, swapped) * (-1, 1, 1), atol=1e-9)


def test_conventions_of_the_world():
    figure = pose(Mannequin(), gestures.posture(**(gestures.LEVEL | gestures.left(front=90, side=0))))
    assert (at(figure, "left_hip") > at(figure, "right_hip"))[0, 0]  # left is +X
    assert at(figure, "left_hand")[0, 1] < -0.5  # forward is -Y
    np.testing.assert_allclose(at(figure, "pelvis")[0, :2], 0, atol=1e-9)
    hanging = pose(Mannequin(), gestures.posture())
    np.testing.assert_allclose((at(hanging, "left_hand") - at(hanging, "left_shoulder"))[0, :2], 0, atol=1e-9)
    assert at(hanging, "left_hand")[0, 2] < at(hanging, "left_elbow")[0, 2]
    bent = pose(Mannequin(), gestures.posture(**gestures.left(elbow=90)))
    assert (at(bent, "left_wrist") - at(bent, "left_elbow"))[0, 1] < -0.2  # the forearm swings forward
    bowed = pose(Mannequin(), gestures.posture(**gestures.trunk(spine_bow=40)))
    assert at(bowed, "neck")[0, 1] < at(hanging, "neck")[0, 1] - 0.1
    aside = pose(Mannequin(), gestures.posture(**gestures.trunk(spine_side=30)))
    assert at(aside, "neck")[0, 0] > 0.1


def test_shoulders_rise_with_the_arms_but_the_arms_stay_level():
    level, hanging = pose(Mannequin(), gestures.posture(**gestures.LEVEL)), pose(Mannequin(), gestures.posture())
    assert 0.01 < (at(level, "left_shoulder") - at(hanging, "left_shoulder"))[0, 2] < 0.04
    for side in ("left", "right"):
        height = [at(level, f"{side}_{name}")[0, 2] for name in ("shoulder", "elbow", "wrist", "hand")]
        assert np.ptp(height) < 1e-9


# Motions


@pytest.mark.parametrize("name", sorted(gestures.GESTURES))
def test_gestures_stay_in_their_time_and_are_smooth(name, rng):
    for seconds in (2.0, 7.0):
        times = [when for when, _ in gestures.GESTURES[name](seconds, rng)]
        assert all(b > a for a, b in itertools.pairwise(times))
        assert 0 < times[0] <= times[-1] < seconds
    t = np.arange(0, gestures.duration([(name, 6.0)]), 1 / 60)
    figure = pose(Mannequin(), gestures.gesture_postures([(name, 6.0)], t, rng))
    speed = np.linalg.norm(np.diff(figure.joints, axis=0), axis=-1) * 60
    assert speed.max() < 5.0
    assert (np.abs(np.diff(speed, axis=0)) * 60).max() < 90.0
    if name != "stand":
        assert speed[:, JOINTS.index("right_hand" if name == "shake_hands" else "left_hand")].max() > 0.2


def test_motion_does_not_depend_on_the_frame_rate():
    spec = small(motion=(Gesture(motion="random", seconds=3), Gesture(motion="reach", seconds=3)))
    (t4, slow), (t8, fast) = (perform(replace(spec, rate=rate), np.random.default_rng(3)) for rate in (4.0, 8.0))
    np.testing.assert_array_equal(t4, t8[::2])
    np.testing.assert_allclose(slow.joints, fast.joints[::2], atol=1e-9)


def test_recordings_begin_and_end_standing(rng):
    t = np.array([0.0, gestures.duration([("wave_hands", 4.0)])])
    ends = gestures.gesture_postures([("wave_hands", 4.0)], t, rng, still=0.0)
    wanted = gestures.posture(**gestures.STANDING)
    np.testing.assert_allclose(ends, np.broadcast_to(wanted, ends.shape), atol=0.01)


def gap(postures):
    """How far wrists and hands are from the line between pelvis and neck, metres."""
    figure = pose(Mannequin(), postures)
    low, along = at(figure, "pelvis"), at(figure, "neck") - at(figure, "pelvis")
    points = np.stack([at(figure, f"{side}_{name}") for side in ("left", "right") for name in ("wrist", "hand")])
    share = np.clip(((points - low) * along).sum(-1) / (along**2).sum(-1), 0, 1)[..., None]
    return np.linalg.norm(points - low - share * along, axis=-1).min(0)


@pytest.mark.parametrize("body", [Mannequin(), Mannequin(stature=1.629, build=0.0)])
def test_shoulders_slope_as_people_s_do(body):
    """Mid-shoulder is some 30 mm above the acromion (midshoulder and acromial heights of Gordon et al. 1989)."""
    size, distance, height = (640, 480), 60.0, 0.82 * body.stature
    T = rigid([[1, 0, 0], [0, 0, -1], [0, 1, 0]], np.array([0, height, distance]))
    camera = Camera("front", size, np.array([[1000 * distance, 0, 320], [0, 1000 * distance, 240], [0, 0, 1.0]]), T_camera_world=T)
    clothes = Clothes(hair=0.004)
    standing = pose(body, np.zeros((1, len(CHANNELS))))
    mask = PersonRenderer(camera, dressed(body, clothes), clothes, LIGHTS).mask(standing, 0)
    acromion = body.measure("biacromial_breadth") / 2
    low, high = (np.flatnonzero(mask[:, int(320 + 1000 * x)])[0] for x in (acromion, acromion - 0.072 * body.stature / 1.75))
    assert low - high == pytest.approx(32, abs=4)  # a pixel is a millimetre


def test_arms_are_kept_out_of_the_trunk():
    into_the_chest = gestures.posture(**gestures.both(side=8, front=20, roll=-70, elbow=110))
    level = gestures.posture(**gestures.LEVEL)
    keys = np.concatenate([level, level, level, into_the_chest, level, level, level])
    cleared = gestures.clear_of_trunk(keys)

    assert gap(keys)[3] < 0.17
    assert gap(cleared)[3] > gap(keys)[3] + 0.03
    np.testing.assert_array_equal(cleared[[0, 6]], keys[[0, 6]])
    assert (gestures.clear_of_trunk(level) == level).all()
    assert gap(gestures.gesture_postures([("random", 19.0)], np.arange(0, 20, 0.1), np.random.default_rng(15))).min() > 0.2


def test_distances_from_line_segments_are_those_from_many_places_on_them(rng):
    points, start, end = rng.normal(1, 1, (3, 40, 3))
    share = np.linspace(0, 1, 2001)[:, None, None]
    wanted = np.linalg.norm(points - (start + share * (end - start)), axis=2).min(0)
    np.testing.assert_allclose(gestures._off(points, start, end), wanted, atol=1e-3)


def test_reach_goes_toward_the_camera_one_arm_after_the_other(rng):
    t = np.arange(0, 7.5, 0.1)
    figure = pose(Mannequin(), gestures.gesture_postures([("reach", 6.0)], t, rng))
    ahead = {side: -(at(figure, f"{side}_hand") - at(figure, f"{side}_shoulder"))[:, 1] > 0.4 for side in ("left", "right")}
    assert (ahead["left"] & ~ahead["right"]).any()
    assert (ahead["right"] & ~ahead["left"]).any()
    assert (ahead["left"] & ahead["right"]).any()


# The renderer


def test_distance_kernel_against_plain_numpy(rng, monkeypatch):
    from shadowpuppet.synthetic import _ray_marching

    body, clothes = Mannequin.draw(rng, "woman"), Clothes.draw(rng)
    figure = pose(body, gestures.gesture_postures([("random", 3.0)], np.array([1.5]), rng))
    renderer = PersonRenderer(VIEW.camera(), dressed(body, clothes), clothes, LIGHTS)
    seen = {}
    trace = _ray_marching.find_surface
    monkeypatch.setattr(_ray_marching, "find_surface", lambda *a: (seen.update(a=a), trace(*a)))
    renderer.draw(figure, 0)
    _, _, _, _, _, placed, table, code, joints, _, _ = seen["a"]
    parts = np.arange(-1, len(placed))
    parts[0] = len(placed)
    points = figure.joints[0].repeat(20, 0) + rng.normal(0, 0.08, (20 * len(JOINTS), 3))
    found = np.array([_ray_marching.distance(*p, parts, placed, table, code, joints)[0] for p in points])
    axes, origin = placed[:, :9].reshape(-1, 3, 3).swapaxes(1, 2), placed[:, 9:12]
    wanted = naive_distance(points, renderer.surface, axes, origin, joints)
    close = np.abs(wanted) < 0.05  # where it matters: bounding spheres may skip parts that cannot touch the surface
    assert close.sum() > 50
    np.testing.assert_allclose(found[close], wanted[close], atol=2e-3)
    assert (np.sign(found) == np.sign(wanted))[np.abs(wanted) > 2e-3].all()


def test_leaving_out_parts_that_a_tile_cannot_see_changes_nothing(rng, monkeypatch):
    from shadowpuppet.synthetic import _ray_marching

    def list_all(direction, sine, cosine, eye, spheres, lists, span):
        lists[:, 0], lists[:, 1:] = len(spheres), np.arange(len(spheres))
        span[:] = 0.3, 6.0

    body, clothes = Mannequin.draw(rng), Clothes.draw(rng)
    figure = pose(body, gestures.gesture_postures([("random", 6.0)], np.array([3.0, 5.0]), rng))
    camera = replace(VIEW, size=(160, 120), distortion=(-0.2, 0.05, 0, 0)).camera()
    renderer = PersonRenderer(camera, dressed(body, clothes), clothes, LIGHTS)
    culled = [renderer.draw(figure, index) for index in range(2)]
    monkeypatch.setattr(_ray_marching, "list_parts", list_all)
    for index, shot in enumerate(culled):
        whole = renderer.draw(figure, index)
        assert (whole.mask != shot.mask).sum() <= 1  # where a ray grazes the surface the steps decide
        assert np.abs(whole.alpha - shot.alpha).mean() < 1e-3
        assert np.abs(whole.picture - shot.picture).mean() < 2e-3


@pytest.mark.parametrize("distortion", [(), (-0.25, 0.08, 0.001, -0.002)])
def test_a_ball_has_the_silhouette_of_a_sphere(distortion):
    radius, centre = 0.3, np.array([0.1, 0.0, 1.5])
    figure = pose(Mannequin(), gestures.posture())
    origin = figure.origin[0, SEGMENTS.index("pelvis")]
    one = Surface.of([ellipsoid("pelvis", origin, centre, (radius,) * 3, blend=0.01)])
    camera = Viewpoint(size=(80, 60), distortion=distortion, pitch_deg=7).camera()
    shot = PersonRenderer(camera, one, Clothes(), LIGHTS).draw(figure, 0)
    pixels = np.stack(np.meshgrid(np.arange(80), np.arange(60)), -1)
    rays = camera.rays(pixels) @ camera.T_camera_world[:3, :3]
    to_centre = centre - camera.centre
    along = (rays @ to_centre) / np.linalg.norm(rays, axis=-1)
    miss = np.sqrt(to_centre @ to_centre - along**2) - radius
    sure = np.abs(miss) > 0.002  # a ball's short waist is straight: half a per cent of its radius
    assert sure.mean() > 0.98
    np.testing.assert_array_equal(shot.mask[sure], miss[sure] < 0)
    assert shot.mask.dtype == bool


@pytest.mark.parametrize("changes", [{}, {"pitch_deg": 15, "height": 2.2}, {"azimuth_deg": 70, "distortion": (-0.2, 0.05, 0, 0)},
                                     {"size": (267, 253), "fov_deg": 80}])
def test_all_true_joints_lie_in_the_mask(changes, rng):
    view = Viewpoint(**{"size": (240, 180)} | changes)
    spec = small(body=Mannequin.draw(rng), cameras=(view,), motion=(Gesture(motion="random", seconds=4),))
    _, figure = perform(spec, rng)
    studio, camera = SceneRenderer(spec, view.camera(), rng), view.camera()
    for index in range(0, len(figure.joints), 6):
        _, mask = studio.take(figure, index)
        pixels = np.rint(camera.project(figure.joints[index])).astype(int)
        inside = ((pixels >= 0) & (pixels < camera.size)).all(1)
        assert inside.sum() >= 8
        assert (mask[pixels[inside, 1], pixels[inside, 0]] == 255).all()


def test_the_level_posture_is_symmetric_to_the_last_finger():
    body, clothes = Mannequin(), Clothes.draw(np.random.default_rng(0))
    shot = PersonRenderer(Viewpoint(size=(240, 180)).camera(), dressed(body, clothes), clothes, LIGHTS).draw(
        pose(body, gestures.posture(**gestures.LEVEL)), 0)
    assert (shot.mask != shot.mask[:, ::-1]).sum() <= 2
    assert shot.mask.any(0).sum() > 180


def test_the_room_does_not_shine_through_the_person(rng, monkeypatch):
    spec = small(scene=Scene(noise=0, shadow=0))
    _, figure = perform(spec, rng)
    studio = SceneRenderer(spec, VIEW.camera(), rng)
    solid = studio.renderer.draw(figure, 5).alpha == 1
    solid = solid & np.roll(solid, 1, 0) & np.roll(solid, -1, 0) & np.roll(solid, 1, 1) & np.roll(solid, -1, 1)
    pictures = []
    for light in (0.0, 1.0):
        monkeypatch.setattr(studio, "place", lambda _, bright=light: EmptyStage(np.full((*VIEW.size[::-1], 3), bright), []))
        pictures.append(studio.take(figure, 5)[0][solid].astype(int))
    assert np.abs(np.subtract(*pictures)).max() <= 2  # the lens blurs a little


def test_pictures_show_the_person_where_the_mask_is(rng):
    spec = small(scene=Scene(noise=0, shadow=0, clothing=3, room=4))
    _, figure = perform(spec, rng)
    studio = SceneRenderer(spec, VIEW.camera(), rng)
    shot = studio.renderer.draw(figure, 6)
    mask = shot.mask
    assert ((shot.alpha > 0.5) == mask).mean() > 0.985
    assert (shot.alpha[mask] > 0).all()
    picture, empty = studio.take(figure, 6)[0].astype(int), studio.empty().astype(int)
    differs = np.abs(picture - empty).max(-1) > 12
    grown = np.zeros_like(mask)
    for dy, dx in itertools.product((-2, -1, 0, 1, 2), repeat=2):
        grown |= np.roll(mask, (dy, dx), (0, 1))
    assert not (differs & ~grown).any()
    assert differs[mask].mean() > 0.8


def test_noise_and_shadow_do_what_they_say(rng):
    spec = small(scene=Scene(noise=6, shadow=0.5))
    _, figure = perform(spec, rng)
    studio = SceneRenderer(spec, VIEW.camera(), rng)
    two = np.stack([studio.empty(), studio.empty()]).astype(float)
    assert 5 < np.diff(two, axis=0).std() / np.sqrt(2) < 8
    clear = studio.room.pictures[0]
    dark = studio.room.shaded(clear, figure, 0)
    assert (dark <= clear + 1e-9).all()
    assert (dark >= 0.5 * clear - 1e-9).all()
    assert (dark < 0.95 * clear).any()


def test_pictures_are_the_same_whatever_the_number_of_threads(rng):
    spec = small()
    _, figure = perform(spec, rng)
    films = [list(SceneRenderer(spec, VIEW.camera(), np.random.default_rng(1)).film(figure, workers)) for workers in (1, 3)]
    for a, b in zip(*films):
        np.testing.assert_array_equal(a.image, b.image)
        np.testing.assert_array_equal(a.mask, b.mask)


# Recordings


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    return synthesize(small(), tmp_path_factory.mktemp("made"), np.random.default_rng(7))


def test_layout_is_read_back(made):
    recording = read_recording(made)
    view = recording.views[0]
    assert recording.subject.height == pytest.approx(1.75)
    assert recording.subject.distance == pytest.approx(2.0)
    assert [r.name for r in recording.references] == ["front_t_pose", "side_arms_hanging", "front_arms_t_pose"]
    assert all(r.mask is not None for r in recording.references)
    assert recording.truth == made / "truth.csv"
    assert view.background is not None
    assert view.masks is not None
    camera = read_calibration(made / "calibration.toml")[0]
    np.testing.assert_allclose(camera.T_camera_world, VIEW.camera().T_camera_world, atol=1e-9)
    np.testing.assert_allclose(camera.centre, [0, -2, 1.6], atol=1e-9)


def test_every_picture_has_a_mask_and_a_truth_at_its_time(made):
    film, masks = list(open_frames(made / "video" / "cam.mp4")), list(open_frames(made / "masks" / "cam.mkv", grey=True))
    rows = rows_of(made / "truth.csv")
    seconds = gestures.duration([("wave_hands", 2.0)])
    assert len(film) == len(masks) == len(rows) == int(4 * seconds) + 1
    assert len(list(open_frames(made / "background" / "cam.mp4"))) == 2
    np.testing.assert_allclose([frame.time for frame in film], [float(row["time"]) for row in rows], atol=1e-3)
    assert all(set(np.unique(frame.image)) == {0, 255} for frame in masks)
    assert list(rows[0]) == ["time", *(f"{joint}_{axis}" for joint in (*JOINTS, *SOLES) for axis in "xyz"),
                             *(f"{sole}_contact" for sole in SOLES)]
    assert all(row[f"{sole}_contact"] == "1" for row in rows for sole in SOLES)  # the feet are planted


def test_trc_is_the_csv_in_millimetres(made):
    rows = np.loadtxt(made / "truth.csv", delimiter=",", skiprows=1)
    lines = (made / "truth.trc").read_text(encoding="utf-8").splitlines()
    assert lines[3].split() == ["Frame#", "Time", *JOINTS, *SOLES]
    assert lines[2].split()[2:5] == [str(len(rows)), "21", "mm"]
    trc = np.array([[float(v) for v in line.split()] for line in lines[6:]])
    np.testing.assert_array_equal(trc[:, 0], 1 + np.arange(len(rows)))
    np.testing.assert_allclose(trc[:, 2:], 1000 * rows[:, 1 : 1 + 3 * 21], atol=0.011)


def test_reference_postures_are_right(made):
    for name in ("front_t_pose", "front_arms_t_pose"):
        truth = rows_of(made / "references" / f"{name}.csv")[0]
        for side, sign in (("left", 1), ("right", -1)):
            height = {truth[f"{side}_{joint}_z"] for joint in ("shoulder", "elbow", "wrist", "hand")}
            assert len(height) == 1
            assert sign * float(truth[f"{side}_hand_x"]) > 0.6
    side = rows_of(made / "references" / "side_arms_hanging.csv")[0]
    assert float(side["left_shoulder_y"]) - float(side["right_shoulder_y"]) > 0.3
    assert float(side["left_hand_z"]) < float(side["left_elbow_z"]) < float(side["left_shoulder_z"])
    for name in ("front_t_pose", "side_arms_hanging"):
        mask = read_image(made / "references" / f"{name}_mask.png", grey=True)
        assert mask.shape == (60, 80)
        assert set(np.unique(mask)) == {0, 255}
    assert (read_image(made / "references" / "front_t_pose_mask.png", grey=True).any(0)).sum() > 50  # arms to the sides


def test_same_seed_same_recording_and_another_seed_another(made, tmp_path):
    again = synthesize(small(), tmp_path / "again", np.random.default_rng(7))
    other = synthesize(small(), tmp_path / "other", np.random.default_rng(8))
    assert (made / "truth.csv").read_bytes() == (again / "truth.csv").read_bytes() != (other / "truth.csv").read_bytes()
    for name in ("video/cam.mp4", "masks/cam.mkv", "background/cam.mp4", "references/front_t_pose.png"):
        first, second, third = ([f.image for f in open_frames(folder / name)] for folder in (made, again, other))
        np.testing.assert_array_equal(first, second)
        assert not name.startswith("video") or not np.array_equal(first, third)


def test_several_cameras_see_the_same_motion(tmp_path):
    views = tuple(replace(VIEW, name=f"cam{n}", azimuth_deg=120.0 * n - 120, distance=3.0) for n in range(3))
    told = []
    spec = small(cameras=views, rate=2)
    folder = synthesize(spec, tmp_path, np.random.default_rng(0), tell=lambda done, total: told.append((done, total)))
    recording = read_recording(folder)
    assert [view.camera.name for view in recording.views] == ["cam0", "cam1", "cam2"]
    assert recording.references == ()
    assert recording.subject.distance is None
    assert told[-1] == (len(told), len(told))
    for view in recording.views:
        area = [frame.image.astype(bool).mean() for frame in open_frames(view.masks, grey=True)]
        assert 0.03 < min(area) < max(area) < 0.4


def test_what_is_reported_of_the_subject(tmp_path):
    told = {"height": (1.75, None), "distance": (None, 2.0), "nothing": (None, None)}
    for tells, (height, distance) in told.items():
        spec = small(tells=tells, rate=1, motion=(Gesture(motion="stand", seconds=2),))
        subject = read_recording(synthesize(spec, tmp_path / tells, np.random.default_rng(0))).subject
        assert (subject.height, subject.distance) == (height, distance)


def test_a_folder_that_cannot_be_made_is_reported(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(RecordingError, match=r"file: the recording cannot be written there"):
        synthesize(small(), tmp_path / "file", np.random.default_rng(0))


# Specs


def test_spec_of_plain_values():
    spec = spec_from({"body": {"stature": 1.6, "build": 0}, "motion": [{"motion": "reach", "seconds": 3}],
                      "cameras": [{"fov_deg": 45}], "scene": {"noise": 1}, "rate": 30})
    assert spec.body == Mannequin(stature=1.6, build=0)
    assert spec.motion == (Gesture(motion="reach", seconds=3),)
    assert spec.cameras[0].camera().matrix[0, 0] == pytest.approx(160 / np.tan(np.radians(22.5)))


@pytest.mark.parametrize(("values", "told"), [
    ({"bodi": {}}, r"spec: bodi: no such setting; possible are begin, body, cameras, faults, frames, motion, name, posture, rate"),
    ({"body": {"size": 1}}, r"body\.size: no such setting; possible are arm_length, build, girth"),
    ({"body": {"stature": 3.1}}, r"body\.stature: .*less than or equal to 2.2, found 3.1"),
    ({"body": {"stature": float("nan")}}, r"body\.stature: .*found nan"),
    ({"motion": [{"motion": "fly"}]}, r"motion\.0\.motion: .*'wave_hands'.*found 'fly'"),
    ({"motion": [{"motion": "reach", "seconds": -1}]}, r"motion\.0\.seconds: .*found -1"),
    ({"motion": []}, r"motion: .*at least 1 item"),
    ({"cameras": [{"name": "a"}, {"name": "a"}]}, r"cameras: found the names a, a, each must be used once"),
    ({"cameras": [{"name": "../a"}]}, r"cameras\.0\.name: .*found '../a'"),
    ({"cameras": [{"distortion": [1, 2, 3]}]}, r"distort.*3 numbers"),
    ({"rate": "fast"}, r"rate: .*found 'fast'"),
    ({"scene": {"noise": -1}}, r"scene\.noise: .*found -1"),
])
def test_a_bad_spec_is_reported_in_one_sentence(values, told):
    with pytest.raises(SettingsError, match=told) as caught:
        spec_from(values)
    assert "\n" not in str(caught.value)


def test_the_proving_ground_is_varied_and_fixed():
    specs = proving_ground()
    assert len(specs) >= 12
    assert len({spec.name for spec in specs}) == len(specs)
    assert specs == proving_ground()
    used = {gesture.motion for spec in specs for gesture in spec.motion}
    assert used >= set(gestures.GESTURES) - {"stand", "shake_hands"}  # which takes two people
    cameras = [spec.cameras[0] for spec in specs]
    assert min(c.distance for c in cameras) <= 1.8
    assert max(c.distance for c in cameras) >= 3.5
    assert {c.fov_deg for c in cameras} >= {45, 75}
    assert min(c.pitch_deg for c in cameras) < 0 < max(c.pitch_deg for c in cameras)
    assert min(spec.body.stature for spec in specs) < 1.4 < 1.8 < max(spec.body.stature for spec in specs)


def test_the_rings_of_the_proving_ground_are_varied_and_fixed():
    specs = proving_rings()
    assert len(specs) >= 10
    assert len({spec.name for spec in specs}) == len(specs) == len({spec.seed for spec in specs})
    assert specs == proving_rings()
    assert {len(spec.views()) for spec in specs} == {3, 4, 5, 6, 7, 8}
    used = {gesture.motion for spec in specs for gesture in spec.motion}
    assert used >= {"walk", "jog", "box", "squat", "lift", "sit", "march", "jump", "bow_forward", "bend_aside", "wave_hands", "reach"}
    assert {spec.training == () for spec in specs} == {spec.training is None for spec in specs} == {True, False}
    assert all(spec.rate <= 60 and 4 <= sequence_seconds(spec.motion) <= 7 for spec in specs)
    assert min(spec.body.stature for spec in specs) < 1.35 < 1.8 < max(spec.body.stature for spec in specs)
    assert min(spec.body.girth for spec in specs) < 0.9 < 1.1 < max(spec.body.girth for spec in specs)


def test_the_demo_shows_the_papers_motions_and_a_reach():
    spec = demo_spec()
    assert [g.motion for g in spec.motion] == ["wave_hands", "bend_aside", "bow_forward", "reach"]
    assert 13 < gestures.duration([(g.motion, g.seconds) for g in spec.motion]) < 16.5


@pytest.mark.shared
def test_truth_has_the_shared_recordings_columns(shared, made):
    theirs = shared / "recordings" / "upper_body"
    columns = list(rows_of(theirs / "truth.csv")[0])
    assert list(rows_of(made / "truth.csv")[0])[: len(columns)] == columns
    camera = read_calibration(theirs / "calibration.toml")[0]
    np.testing.assert_allclose(demo_spec().cameras[0].camera().T_camera_world, camera.T_camera_world, atol=1e-9)
    assert demo_spec().cameras[0].camera().matrix[0, 0] == pytest.approx(camera.matrix[0, 0], rel=1e-3)
