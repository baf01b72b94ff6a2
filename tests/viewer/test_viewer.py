"""What is shown of runs, recordings, priors and files, as data; what is in the page; who may look at it."""

from __future__ import annotations

import base64
import json
import warnings
from dataclasses import replace
from html import escape
from pathlib import Path

import cv2
import made
import made_rig
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from runs import body_of, make_people, make_run, smooth_poses

from shadowpuppet.body.shapes import Quads
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.drawing import SIDE_COLOURS
from shadowpuppet.camera.keypoints import Keypoints
from shadowpuppet.cli.app import run as command
from shadowpuppet.errors import FormatError, SettingsError, ShadowPuppetError, ShadowPuppetWarning
from shadowpuppet.geometry import rigid, rotation_about
from shadowpuppet.io.calibration.calibration_files import write_calibration
from shadowpuppet.io.keypoints.film_keypoints import film_keypoints, write_keypoints
from shadowpuppet.io.motion.bvh_writer import write_bvh
from shadowpuppet.io.motion.table import write_joints
from shadowpuppet.io.prior import write_prior
from shadowpuppet.io.run import read_run
from shadowpuppet.motion.body_animation import BodyTree
from shadowpuppet.motion.limbs import LIMBS
from shadowpuppet.motion.motion import STATUSES, JointTable
from shadowpuppet.motion.prior.settings import PriorSettings
from shadowpuppet.motion.prior.vqpca import fit_prior
from shadowpuppet.pipeline.options import Options
from shadowpuppet.viewer.scene.figures import animation_figure, joint_figure, pose_figure
from shadowpuppet.viewer.scene.film_images import hull_function
from shadowpuppet.viewer.scene.of_prior import body_of as body_of_prior
from shadowpuppet.viewer.scene.of_prior import prior_scene, sampled_motion, stationary_shares
from shadowpuppet.viewer.scene.of_run import side_by_side
from shadowpuppet.viewer.scene.open_any import cut_scene, open_scene
from shadowpuppet.viewer.scene.scene import SceneCamera, SceneFigure, Stage
from shadowpuppet.viewer.scene.strip import doubtful_moments, nearest_frames, strips_of
from shadowpuppet.viewer.web.content import mesh_colours, motion_content, page_text
from shadowpuppet.viewer.web.frustum_images import Undistorter, camera_image
from shadowpuppet.viewer.web.page import kept_frames, write_page
from shadowpuppet.viewer.web.serve import ScenePage, serving


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    return made_rig.write(tmp_path_factory.mktemp("rig") / "rig")


@pytest.fixture(scope="module")
def tracked(tmp_path_factory):
    """A tiny recording of one camera, tracked."""
    folder = tmp_path_factory.mktemp("tracked")
    recording = made.make(folder / "tiny")
    from shadowpuppet.pipeline.options import make_options
    from shadowpuppet.pipeline.track import track_recording

    track_recording(recording, folder / "run", make_options({"seed": 1}))
    return folder / "run"


def skinned(figure: SceneFigure, n: int) -> np.ndarray:
    """The mesh's points (V, 3) in a frame, as a page moves them."""
    mesh, x, y, z, w = figure.mesh, *(figure.quaternions[n][figure.mesh.joints].T[k] for k in (1, 2, 3, 0))
    R = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                  [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                  [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])  # fmt: skip
    return np.einsum("xyv,vy->vx", R, mesh.points - figure.rest[mesh.joints]) + figure.places[n][mesh.joints]


# Figures


@pytest.mark.parametrize("name", ["cardbox", "rounded", "cylinders", "anatomical"])
def test_a_bodys_mesh_goes_where_its_shapes_are(name, rng):
    body = body_of(name)
    poses, root = smooth_poses(body, 3, rng), rigid(rotation_about([0, 0, 1], 0.7), [1.0, -2.0, 0.5])
    figure = pose_figure("a", body, np.arange(3) / 10, poses, root)
    for n in range(3):
        points = skinned(figure, n)
        joints = body.points(poses[n : n + 1], root)[0]
        reach = np.linalg.norm(points[:, None] - joints[None], axis=2).min(0)  # every landmark is in or on the mesh
        assert reach.max() < 0.19
        if isinstance(body.shapes, Quads):
            frames = body.skeleton.forward(poses[n : n + 1], root)[0][body.shapes.joints[:, 0]]
            corners = np.einsum("sxy,scy->scx", frames[:, :, :3], body.shapes.corners) + frames[:, None, :, 3]
            assert points == pytest.approx(corners.reshape(-1, 3), abs=1e-5)


def test_sticks_lie_between_their_joints(rng):
    names = ("pelvis", "neck", "left_shoulder", "left_elbow", "marker")
    start = np.array([[0, 0, 1.0], [0, 0, 1.5], [0.2, 0, 1.4], [0.4, 0.1, 1.2], [2, 2, 2]])
    turns = rotation_about([0.6, 0.0, 0.8], np.linspace(0, 3, 7))
    places = np.einsum("txy,jy->tjx", turns, start) + rng.normal(size=(7, 1, 3))
    places[3, 3] = np.nan
    figure = joint_figure("a", JointTable(np.arange(7) / 10, names, places))
    for n in (0, 2, 6):
        points = skinned(figure, n)
        for joint in places[n, :4]:
            assert np.linalg.norm(points - joint, axis=1).min() < 0.06
        between = (places[n, 2] + places[n, 3]) / 2
        assert np.linalg.norm(points - between, axis=1).min() < 0.05
    assert figure.known.all()
    assert np.isnan(figure.places[3]).any()  # the forearm of the frame without elbow
    assert np.isfinite(figure.places[2, 1:]).all()


def test_the_frame_that_is_shown_is_the_nearest_and_only_where_near():
    times = np.array([0.0, 0.1, 0.2, 0.3])
    places = np.zeros((4, 1, 3))
    places[2] = np.nan
    table = joint_figure("a", JointTable(times, ("pelvis", "neck"), np.stack([np.zeros((4, 3)), np.tile([0, 0, 0.5], (4, 1))], 1)))
    figure = replace(table, places=np.where(np.arange(4)[:, None, None] == 2, np.nan, table.places))
    assert [figure.at(time) for time in (0.0, 0.04, 0.06, 0.14, 0.21, 0.3, 0.37, 0.4, -0.2)] == [0, 0, 1, 1, None, 3, 3, None, None]
    still = replace(table, times=times[:1], places=table.places[:1], turns=table.turns[:1])
    assert still.at(99.0) == 0


# The whole run at a glance


def test_a_strip_has_every_frame_of_the_timeline_and_doubt_begins_moments(tmp_path):
    doubtful = {2: {"left_arm": "uncertain"}, 3: {"left_arm": "predicted"}, 20: {"right_leg": "uncertain"}}
    scene = open_scene(make_run(tmp_path / "run", frames=25, lost=(24,), spread=True, doubtful=doubtful))
    (strip,) = strips_of(scene)
    assert strip.limbs == tuple(limb.replace("_", " ") for limb in LIMBS)
    names = {n: [STATUSES[code] for code in strip.status[n]] for n in (0, 2, 3, 20, 24)}
    assert names[0] == ["tracked"] * 5
    assert [names[n][LIMBS.index("left_arm")] for n in (2, 3)] == ["uncertain", "predicted"]
    assert (names[20][LIMBS.index("right_leg")], set(names[24])) == ("uncertain", {"lost"})
    motion = read_run(tmp_path / "run").motion
    assert strip.width[7] == pytest.approx(2000 * 1.645 * motion.joint_sd[7].max())
    assert np.isnan(strip.width[24])
    assert strip.overlap[:24] == pytest.approx(0.9)
    assert np.isnan(strip.error).all()
    assert doubtful_moments(scene) == [2, 20]  # the lost frame is one moment with the doubtful one a sixth of a second before
    assert doubtful_moments(cut_scene(scene, 0.2, 0.7)) == []
    assert strips_of(replace(scene, figures=())) == []


@given(st.lists(st.floats(0, 9), min_size=1, max_size=12, unique=True), st.lists(st.floats(-3, 12), min_size=1, max_size=12))
def test_nearest_frames_are_those_of_a_search_through_all(times, wanted):
    times, wanted = np.sort(times), np.array(wanted)
    off = np.abs(times[:, None] - wanted)
    step = np.median(np.diff(times)) if len(times) > 1 else np.inf
    found = nearest_frames(times, wanted)
    for n, least in enumerate(off.min(0)):
        assert found[n] == -1 if least > step else off[found[n], n] == least


def test_a_second_runs_strip_has_its_own_errors(tracked):
    one = open_scene(tracked)
    worse = {"mean": one.charts[0].curves["mean"] + 100}
    strips = strips_of(side_by_side(one, replace(one, charts=(replace(one.charts[0], curves=worse),))))
    assert np.nanmean(strips[1].error - strips[0].error) == pytest.approx(100)


# Cameras


@pytest.mark.parametrize("fisheye", [False, True])
def test_pictures_in_frustums_have_no_distortion_and_their_axis_in_the_middle(fisheye):
    """A world point is in the plain picture where a camera of the frustum's angle, without distortion, sees it."""
    matrix = np.array([[160.0, 0, 150.0], [0, 155.0, 130.0], [0, 0, 1]])
    camera = Camera("a", (320, 240), matrix, np.array([-0.2, 0.05, 0.001, -0.002]), fisheye=fisheye)
    plain = Undistorter(camera, 160)
    assert plain.size == (160, 120)
    image = np.zeros((240, 320), np.uint8)
    for point in np.array([[0.0, 0, 2], [0.5, 0.3, 2], [-0.8, 0.5, 2], [0.6, -0.6, 2]]):
        column, row = np.round(camera.project(point)).astype(int)
        image[:] = 0
        image[row - 3 : row + 4, column - 3 : column + 4] = 255
        found = np.argwhere(plain(image) > 100).mean(0)[::-1]
        half = np.array([plain.aspect, 1.0]) * np.tan(plain.fov / 2)
        expected = ((point[:2] / point[2] / half + 1) / 2) * np.array(plain.size) - 0.5
        assert found == pytest.approx(expected, abs=1.3)


class OneFrame:
    def __init__(self, image, mask):
        self.image, self.made = image, mask

    def picture(self, time):
        return self.image if time < 1 else None

    def mask(self, time):
        return self.made if time < 1 else None


def test_silhouettes_show_nothing_of_the_picture(rng):
    camera = Camera.from_fov((64, 48), 1.0)
    mask = np.zeros((48, 64), bool)
    mask[10:30, 20:40] = True
    noise = rng.integers(0, 255, (48, 64, 3)).astype(np.uint8)
    plain = Undistorter(camera, 64)
    a, b = (camera_image(OneFrame(image, mask), plain, 0.0, False) for image in (noise, 255 - noise))
    assert np.array_equal(a, b)
    assert (a[20, 30], a[2, 2]) == (255, 0)
    picture = camera_image(OneFrame(noise, mask), plain, 0.0, True)
    assert picture.shape == (48, 64, 3)
    assert np.abs(picture.astype(int) - noise).max() <= 1
    assert camera_image(OneFrame(noise, mask), plain, 2.0, True) is None
    assert camera_image(OneFrame(noise, mask), plain, 2.0, False) is None


# Recordings


def test_a_recording_is_shown_with_its_cameras_hull_and_frames(rig):
    scene = open_scene(rig)
    assert len(scene.cameras) == made_rig.CAMERAS
    assert scene.times == pytest.approx(np.arange(made_rig.FRAMES) / made_rig.RATE)
    assert scene.hull is not None
    for n in (20, 3, 11):
        surface = scene.hull(float(scene.times[n]))
        assert len(surface.points) > 300
        assert np.linalg.norm(surface.points.mean(0)[:2] - made_rig.place(n)[:2]) < 0.12
        seen = scene.cameras[0].images
        exact = made_rig.masks([scene.cameras[0].camera], 1, n)[0][0]
        mask = seen.mask(float(scene.times[n]))
        assert (mask & exact).sum() / (mask | exact).sum() > 0.9
        assert seen.picture(float(scene.times[n])).shape == (120, 160, 3)
    assert scene.cameras[0].images.mask(99.0) is None


def test_silhouettes_are_made_where_none_are_ready(rig, tmp_path):
    folder = made.copied(rig, tmp_path / "rig", ["masks"])
    scene = open_scene(folder)
    assert "made as" in scene.facts["silhouettes"]
    mask, exact = scene.cameras[1].images.mask(0.5), made_rig.masks([scene.cameras[1].camera], 1, 5)[0][0]
    assert (mask & exact).sum() / (mask | exact).sum() > 0.85


def test_a_film_whose_silhouettes_cannot_be_made_is_shown_without(rig, tmp_path):
    folder = made.copied(rig, tmp_path / "rig", ["masks", "background"])
    made.write_film(folder / "video" / "cam2.mp4", [np.zeros((120, 160, 3), np.uint8)] * 2, made_rig.RATE)
    (folder / "background").mkdir()
    (folder / "background" / "cam2.png").write_bytes((rig / "calibration.toml").read_bytes())
    with pytest.raises(ShadowPuppetError, match="cam2"):  # said before anything is shown
        open_scene(folder)
    (folder / "background" / "cam2.png").unlink()
    seen = open_scene(folder).cameras[1].images
    seen.options = replace(seen.options, silhouette=replace(seen.options.silhouette, method="averaging"))
    with pytest.warns(ShadowPuppetWarning, match="'cam2': no silhouettes"):
        assert seen.mask(0.0) is None
    assert seen.mask(0.1) is None  # said once
    plain = Undistorter(seen.footage.camera, 160)
    assert camera_image(seen, plain, 0.0, True).shape == (120, 160, 3)
    assert camera_image(seen, plain, 0.0, False) is None


def test_one_camera_has_no_hull(rig):
    scene = open_scene(rig, Options(camera="cam1"))
    assert ([eye.camera.name for eye in scene.cameras], scene.hull) == (["cam1"], None)
    assert hull_function([SceneCamera(Camera.from_fov((64, 48), 1.0)), SceneCamera(Camera.from_fov((64, 48), 1.0))], Options()) is None


# Runs


def test_a_run_is_shown_beside_its_truth_with_errors_angles_and_particles(tracked):
    scene = open_scene(tracked)
    estimate, truth = scene.figures
    assert (estimate.kind, truth.kind, scene.problems) == ("estimate", "truth", ())
    names = [chart.name for chart in scene.charts]
    assert names[:2] == ["error", "overlap"]
    assert {"angles: left arm", "angles: right arm", "angles: trunk and head"} <= set(names)
    measured = read_run(tracked).metrics["errors"]
    mean = next(chart for chart in scene.charts if chart.name == "error").curves["mean"]
    assert np.nanmean(mean) == pytest.approx(measured["mean_mm"], rel=0.02)
    n = 14
    cloud = scene.cloud(float(scene.times[n]))
    assert cloud is not None
    joints = read_run(tracked).motion.joints[n]
    hand = read_run(tracked).motion.joint_names.index("left_elbow")
    ends = cloud.lines.reshape(-1, 3)
    assert np.linalg.norm(ends - joints[hand], axis=1).min() < 0.08  # some particle is where the run's own estimate was
    assert (cloud.weights.max(), cloud.weights.min() >= 0) == (1.0, True)
    again = scene.cloud(float(scene.times[n]))
    assert np.array_equal(again.lines, cloud.lines)


@pytest.mark.parametrize(("name", "lost"), [("anatomical", (3, 4)), ("cardbox", ())])
def test_a_runs_puppet_stands_where_its_joints_are(tmp_path, name, lost):
    folder = make_run(tmp_path / "run", name, frames=12, lost=lost, spread=True)
    scene = open_scene(folder)
    figure, motion = scene.figures[0], read_run(folder).motion
    for n in (0, 7):
        points = skinned(figure, n)
        assert np.linalg.norm(points[:, None] - motion.joints[n][None], axis=2).min(0).max() < 0.19
    assert [figure.at(float(time)) for time in motion.times] == [None if n in lost else n for n in range(12)]
    assert np.array_equal(figure.joint_sd, motion.joint_sd, equal_nan=True)
    assert figure.joint_names == motion.joint_names
    assert scene.notes == ()
    assert (scene.cloud, scene.hull, scene.cameras) == (None, None, ())


def test_a_run_without_sizes_is_shown_by_its_joints_and_says_so(tmp_path):
    scene = open_scene(make_run(tmp_path / "run", frames=5, person=False))
    assert scene.figures[0].known.all()
    assert len(scene.problems) == 2
    assert "person.toml" in scene.problems[0]
    assert "the recording made is not there" in scene.problems[1]


def test_a_recording_that_is_gone_is_said_and_another_can_be_given(tracked, tmp_path):
    import shutil

    run = shutil.copytree(tracked, tmp_path / "run")
    recording = read_run(run).info["recording"]
    made.replace_text(run / "run.toml", recording, str(tmp_path / "gone"))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        scene = open_scene(run)
        assert any("gone" in problem for problem in scene.problems)
        assert [eye.images for eye in scene.cameras] == [None]  # where it stood is known
        assert open_scene(run, recording=Path(recording)).cameras[0].images is not None


def test_particles_of_several_cameras_are_about_the_pose(tmp_path):
    from shadowpuppet.io.motion.motion_files import read_truth
    from shadowpuppet.motion.inverse_kinematics import fit_poses
    from shadowpuppet.motion.motion import MotionBuilder, MotionFrame
    from shadowpuppet.pipeline.footage import open_recording
    from shadowpuppet.synthetic import synthesize
    from shadowpuppet.viewer.scene.of_recording import cameras_of
    from shadowpuppet.viewer.scene.particles import ParticleRerun

    options = Options()
    cameras = cameras_of(open_recording(synthesize(made.RING, tmp_path / "ring", np.random.default_rng(3)), options), options, True)[0]
    found = fit_poses(read_truth(tmp_path / "ring" / "truth.csv"))
    names = [name for name in found.body.landmark_names if not name.endswith("_fist")]
    builder = MotionBuilder(found.body.name, found.body.skeleton.dof_names, names)
    for time, pose, places in zip(found.times, found.poses, found.body.points(found.poses, names=names)):
        builder.append(MotionFrame(time, "tracked" if time > 0.3 else "lost", pose, places))
    motion = builder.build()
    rerun = ParticleRerun(found.body, motion, options, cameras)
    n = 12
    cloud = rerun(float(motion.times[n]))
    assert cloud is not None
    middle = cloud.lines[np.argmax(cloud.weights)].reshape(-1, 3)
    off = np.linalg.norm(middle[:, None] - motion.joints[n][None], axis=2).min(1)
    assert np.median(off) < 0.1
    assert rerun(float(motion.times[0])) is None  # lost: there is no pose to begin from


def test_two_runs_side_by_side_or_over_each_other(tmp_path):
    runs = [open_scene(make_run(tmp_path / name, frames=frames, seed=seed)) for name, frames, seed in (("a", 10, 1), ("b", 14, 2))]
    both = side_by_side(*runs, 1.5)
    assert [figure.kind for figure in both.figures] == ["estimate", "other"]
    assert np.linalg.norm(both.figures[1].shift) == pytest.approx(1.5)
    assert abs(both.figures[1].shift[2]) < 1e-12
    assert side_by_side(*runs, 0.0).figures[1].shift == pytest.approx((0, 0, 0))
    assert len(both.times) == 14
    curves = next(chart for chart in both.charts if chart.name == "angles: left arm").curves
    assert sum(name.endswith(", beside") for name in curves) == len(curves) / 2


def test_all_people_of_a_run_are_shown_in_one_world(tmp_path):
    scene = open_scene(make_people(tmp_path / "pair"))
    assert [(figure.name, figure.kind, figure.shift) for figure in scene.figures] == [("person 1", "estimate", (0, 0, 0)),
                                                                                      ("person 2", "estimate", (0, 0, 0))]
    assert scene.figures[0].tint != scene.figures[1].tint
    assert np.abs(mesh_colours(scene.figures[0]) - mesh_colours(scene.figures[1])).max() > 30
    assert len(scene.times) == 14  # the second is seen from frame 2 on
    assert scene.figures[1].at(0.0) is None
    assert scene.figures[0].at(0.0) == 0
    names = [chart.name for chart in scene.charts]
    assert {"person 1, angles: left arm", "person 2, angles: left arm"} <= set(names)
    assert {"person 1", "person 2"} <= set(scene.facts)
    with pytest.raises(ShadowPuppetError, match=r"it is a run of several people; view .*person-1"):
        open_scene(tmp_path / "pair", truth=tmp_path / "truth.csv")


# Priors and files


def test_a_prior_is_shown_by_its_regions_and_a_motion_drawn_from_it(tmp_path, rng):
    body = body_of("anatomical")
    kept = [n for n, name in enumerate(body.skeleton.dof_names) if name not in ("root_x", "root_y", "root_z", "root_heading")]
    poses = smooth_poses(body, 120, rng)[:, kept]
    names = tuple(body.skeleton.dof_names[n] for n in kept)
    prior = fit_prior(rng, [poses], PriorSettings(regions=4), names=names, rate=50.0).prior
    write_prior(tmp_path / "prior.npz", prior)
    scene = open_scene(tmp_path / "prior.npz")
    assert [figure.kind for figure in scene.figures] == ["estimate"] + ["mean"] * 4
    assert len(scene.times) == 500
    assert scene.figures[0].known.all()
    assert body_of_prior(tmp_path, prior).name == "anatomical"
    share = stationary_shares(prior)
    assert share @ prior.transitions == pytest.approx(share, abs=1e-6)
    drawn = sampled_motion(np.random.default_rng(3), prior, 50)
    assert drawn.shape == (50, len(names))
    assert np.abs(drawn - drawn.mean(0)).max() > 0.05  # it moves
    lowest = min(skinned(figure, 0)[:, 2].min() for figure in scene.figures)
    assert -0.15 < lowest < 0.15
    other = replace(prior, names=("a", *names[1:]))
    write_prior(tmp_path / "other.npz", other)
    with pytest.raises(FormatError, match="names"):
        prior_scene(tmp_path / "other.npz")


def test_files_of_motion_and_calibrations(tmp_path, rng):
    body = body_of("anatomical")
    poses = smooth_poses(body, 20, rng)
    times = np.arange(20) / 25
    animation = BodyTree(body).animation(times, poses, np.eye(4))
    write_bvh(tmp_path / "a.bvh", animation, "m")
    write_joints(tmp_path / "a.csv", JointTable(times, body.landmark_names, body.points(poses)))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        bvh, table = open_scene(tmp_path / "a.bvh"), open_scene(tmp_path / "a.csv")
    assert (len(bvh.times), len(table.times)) == (20, 20)
    reference = animation_figure("a", animation)
    assert skinned(bvh.figures[0], 5).mean(0) == pytest.approx(skinned(reference, 5).mean(0), abs=0.02)
    write_calibration(tmp_path / "calibration.toml", made_rig.cameras())
    scene = open_scene(tmp_path / "calibration.toml")
    assert (len(scene.cameras), scene.figures, len(scene.times)) == (4, (), 1)
    assert np.linalg.norm(scene.middle[:2]) < 0.3
    assert np.linalg.norm(scene.viewpoint - scene.middle) > 3
    assert open_scene(tmp_path).title == "calibration.toml"


def test_markers_of_unknown_names_are_shown_all(tmp_path, rng):
    write_joints(tmp_path / "a.csv", JointTable(np.arange(3) / 10, ("m1", "m2"), rng.normal(size=(3, 2, 3))))
    scene = open_scene(tmp_path / "a.csv")
    assert scene.facts["joints"] == "2"


def test_a_part_of_a_show():
    scene = Stage(title="a", times=np.arange(50) / 10)
    assert cut_scene(scene, 1.0, 2.0).times == pytest.approx(np.arange(10, 21) / 10)
    assert len(cut_scene(scene, None, None).times) == 50
    with pytest.raises(ShadowPuppetError, match="a part of"):
        cut_scene(scene, 7.0, None)


def test_what_cannot_be_shown_is_said_in_a_sentence(tmp_path, capsys):
    (tmp_path / "empty").mkdir()
    (tmp_path / "a.txt").write_text("hello")
    (tmp_path / "a.bvh").write_text("HIERARCHY\nROOT")
    (tmp_path / "a.npz").write_bytes(b"PK\x03\x04 none")
    (tmp_path / "a.toml").write_text("x = 1")
    (tmp_path / "a.mp4").write_bytes(b"\x00" * 500)
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "run.toml").write_text("complete = true\nbody = 'cardbox'\n[versions]\n")
    for name in ("none", "empty", "a.txt", "a.bvh", "a.npz", "a.toml", "a.mp4", "run"):
        assert command(["view", str(tmp_path / name), "--no-open"]) == 2
        error = capsys.readouterr().err
        assert name in error
        assert error.startswith("error: ")
        assert "Traceback" not in error
    run = str(make_run(tmp_path / "good", frames=3))
    for more, expected in ((["--pictures"], "--html"), (["--port", "70000"], "port"), (["--html", str(tmp_path / "a.png")], ".html"),
                           (["--html", str(tmp_path / "none" / "a.html")], "no folder"), (["--listen", "203.0.113.7"], "listen"),
                           (["--start", "9"], "part of"), (["--start", "900f"], "start and end: found "),
                           (["--end", "1:30"], "end: found 1:30; expected seconds such as 3.5"), ([run, "--beside", run], "one of them"),
                           (["--truth", str(tmp_path / "a.txt")], "a.txt")):  # fmt: skip
        code, error = command(["view", run, "--no-open", *more]), capsys.readouterr()
        assert (code == 2, expected in error.err) == (True, True), (more, error.err)
    assert command(["view", str(tmp_path / "a.bvh"), "--truth", run]) == 2


# The page


def content(text: str) -> dict:
    """The numbers within a page."""
    return json.loads(text.partition('id="data">')[2].partition("</script>")[0])


def unpacked(values: dict) -> np.ndarray:
    return np.frombuffer(base64.b64decode(values["data"]), f"<{values['type']}")


def test_the_page_has_the_figures_where_they_are(tmp_path):
    scene = open_scene(make_run(tmp_path / "run", frames=6, lost=(2,), spread=True, doubtful={4: {"left_arm": "uncertain"}}))
    figure, data = scene.figures[0], content(page_text(scene, [], None))
    (shown,) = data["figures"]
    assert unpacked(shown["frames"]).tolist() == [0, 1, -1, 2, 3, 4]  # of the five that are known
    J = shown["joints"]
    places, turns = unpacked(shown["places"]).reshape(-1, J, 3), unpacked(shown["turns"]).reshape(-1, J, 4) / 32767
    assert places[2] == pytest.approx(figure.places[3], abs=1e-5)
    assert np.roll(turns[4], 1, axis=1) == pytest.approx(figure.quaternions[5], abs=1e-4)
    assert unpacked(shown["named"]).reshape(5, -1, 3)[3] == pytest.approx(read_run(tmp_path / "run").motion.joints[4], abs=1e-5)
    assert unpacked(shown["doubtful"]).reshape(5, -1)[:, LIMBS.index("left_arm")].tolist() == [0, 0, 0, 1, 0]
    mesh = {name: unpacked(values) for name, values in shown["mesh"].items()}
    own = mesh["joints"].astype(int)
    assert mesh["points"].reshape(-1, 3) + figure.rest[own] == pytest.approx(figure.mesh.points, abs=1e-6)
    colours = mesh["colours"].reshape(-1, 3)
    for side, colour in SIDE_COLOURS.items():  # blue green red; at rest x is to the left
        beside = figure.mesh.points[(colours == colour[::-1]).all(1), 0] * (1 if side == "left" else -1)
        assert len(beside) > 1000
        assert np.median(beside) > 0.1
    assert data["moments"] == [2]
    assert [chart["sd"] for chart in data["charts"]][-1] == {}  # these poses state none


def test_a_truth_with_bones_is_lines(tracked):
    truth = content(page_text(open_scene(tracked), [], None))["figures"][1]
    assert truth["kind"] == "truth"
    assert "mesh" not in truth
    assert [truth["jointNames"][a] for a, _ in truth["bones"]].count("neck") > 1


def test_what_a_page_may_fetch_and_texts_of_others_cannot_be_script():
    scene = Stage(title="</script><b>run</b>", times=np.zeros(1), facts={"a": "</script><script>alert(1)</script>"})
    alone, served = page_text(scene, [], {}), page_text(scene, [], None)
    for page in (alone, served):
        assert "<b>" not in page
        assert page.count("</script>") == 2
        assert "default-src 'none'" in page
        assert "https:" not in page
        assert content(page)["title"] == scene.title
    assert "connect-src 'none'" in alone
    assert "connect-src 'self'" in served
    assert "'unsafe" not in alone + served


@pytest.mark.parametrize("name", ["@SCRIPT@", "@DATA@", "@POLICY@", "@STYLE@", "@TITLE@", r"\g<1> \1 @NONE@"])
def test_names_that_look_like_places_of_the_template_stay_names(name):
    usual, page = (page_text(Stage(title=each, times=np.zeros(1), facts={"camera": each}), [], {}) for each in ("walk-on", name))
    told = content(page)
    for written in (json.dumps(name)[1:-1].replace("<", "\\u003c"), name, escape(name)):
        page = page.replace(written, "walk-on")
    assert page == usual
    assert told["title"] == told["facts"]["camera"] == name


def test_a_file_has_pictures_only_where_they_are_asked_for(tracked, tmp_path):
    """What is in the file: silhouettes of two colours, and pictures if they are asked for."""
    scene = cut_scene(open_scene(tracked), 0.0, 0.2)
    for asked in (False, True):
        text = write_page(tmp_path / f"{asked}.html", scene, asked).read_text()
        data, found = content(text), {}
        for layer, of_cameras in data["images"].items():
            (images,) = of_cameras
            assert len(images) == len(unpacked(data["times"]))
            kind, _, coded = images[0].partition(";base64,")
            found[layer] = kind, cv2.imdecode(np.frombuffer(base64.b64decode(coded), np.uint8), cv2.IMREAD_UNCHANGED)
        assert {layer: kind for layer, (kind, _) in found.items()} == {
            "silhouettes": "data:image/png", **({"pictures": "data:image/jpeg"} if asked else {})}
        assert set(np.unique(found["silhouettes"][1])) == {0, 255}
        assert ("image/jpeg" in text) == asked
        if asked:
            assert found["pictures"][1].ndim == 3


@pytest.mark.parametrize("fisheye", [False, True])
def test_keypoints_are_crosses_where_the_undistorted_picture_has_them(fisheye, rng):
    """Two people in the second of three frames and none in the last, with their confidences and sides."""
    camera = replace(Camera.from_fov((320, 240), 1.2), distortion=np.array([-0.2, 0.05, 0, 0]), fisheye=fisheye)
    names, lens = ("left_wrist", "right_wrist", "nose"), Undistorter(camera, 240)
    points = [rng.uniform((60, 50), (260, 190), (people, 3, 2)) for people in (1, 2, 0)]
    points[0][0, 1] = np.nan
    sure = [np.where(np.isnan(each).any(2), 0, 0.5) for each in points]
    found = [Keypoints(names, each, own, np.full(len(each), -1), "HALPE_26") for each, own in zip(points, sure)]
    scene = Stage(title="", times=np.arange(3.0), cameras=(SceneCamera(camera, keypoints=lambda time: found[int(time)]),))
    data = content(page_text(scene, [lens], None))
    (own,) = data["cameras"]
    assert own["sides"] == [1, 2, 0, 1, 2, 0]
    assert data["sides"][1:] == [[*colour[::-1]] for colour in SIDE_COLOURS.values()]
    marks = unpacked(own["keypoints"]).reshape(3, 6, 3) / 10_000
    for n, each in enumerate(points):
        assert marks[n, :, 2].tolist() == [*sure[n].ravel(), *[0] * (6 - each[..., 0].size)]
        for place, (x, y) in zip(marks[n, :, :2], each.reshape(-1, 2)):
            if np.isfinite(x):
                image = np.zeros((240, 320), np.uint8)
                cv2.circle(image, (round(16 * x), round(16 * y)), 16 * 4, 255, -1, cv2.LINE_AA, 4)
                where = np.argwhere(lens(image) > 100).mean(0)[::-1]
                assert (place + 1) / 2 * lens.size - 0.5 == pytest.approx(where, abs=0.8)
    assert "keypoints" not in content(page_text(replace(scene, cameras=(SceneCamera(camera),)), [lens], None))["cameras"][0]


def test_a_recordings_keypoints_are_those_of_the_frames(rig, tmp_path):
    folder = made.copied(rig, tmp_path / "rig")
    (folder / "keypoints").mkdir()
    spots = np.stack([np.arange(made_rig.FRAMES) + 20.0, np.full(made_rig.FRAMES, 30.0)], 1)[:, None]
    ones = np.ones(made_rig.FRAMES)
    for camera in made_rig.cameras():
        write_keypoints(folder / "keypoints" / f"{camera.name}.npz", film_keypoints(
            ["nose"], np.arange(made_rig.FRAMES), ones, spots, ones[:, None], "HALPE_26", made_rig.SIZE))
    scene = open_scene(folder)
    for n in (0, 7, 23):
        for each in scene.cameras:
            assert each.keypoints is not None
            assert each.keypoints(float(scene.times[n])).xy.tolist() == [[[20.0 + n, 30.0]]]
    assert open_scene(rig).cameras[0].keypoints is None


def test_what_the_page_asks_for_is_made(tracked, rig):
    scene = open_scene(rig)
    page = ScenePage(scene)
    points = np.frombuffer(page.part("/hull/9")[0], "<f4").reshape(-1, 4)
    surface = scene.hull(float(scene.times[9]))
    off = np.linalg.norm(points[:100, None, :3] - surface.points[None], axis=2).min(1)
    assert off.max() < 1e-5
    assert set(np.unique(points[:, 3])) <= set(range(made_rig.CAMERAS))
    for kind, shape in (("silhouettes", (120, 160)), ("pictures", (120, 160, 3))):
        data, name = page.part(f"/image/1/9/{kind}")
        assert cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED).shape == shape
        assert name.startswith("image/")
    for path in ("/image/9/9/pictures", "/image/1/999/pictures", "/image/1/9/faces", "/image/-1/9/pictures", "/hull/x", "/hull",
                 "/particles/3", "/../secret", "/image/1/٣/pictures"):  # fmt: skip
        assert page.part(path) is None
    run = open_scene(tracked)
    cloud, lines = run.cloud(float(run.times[14])), np.frombuffer(ScenePage(run).part("/particles/14")[0], "<f4").reshape(-1, 7)
    assert lines[-1, 6] == pytest.approx(1)
    assert lines[-1, :6] == pytest.approx(cloud.lines[np.argmax(cloud.weights), -1].ravel(), abs=1e-5)


@pytest.mark.parametrize("person", [True, False])
def test_limbs_that_are_not_vouched_for_are_pale_in_their_frames(tmp_path, person):
    doubtful = {2: {"left_arm": "uncertain"}, 3: {"left_arm": "predicted", "right_leg": "uncertain"}}
    scene = open_scene(make_run(tmp_path / "run", frames=5, person=person, doubtful=doubtful))
    (figure,) = scene.figures
    assert figure.doubtful is not None
    told = unpacked(motion_content(figure, scene.times)["doubtful"]).reshape(5, -1)
    assert [[LIMBS[k] for k in np.flatnonzero(frame)] for frame in told] == [list(doubtful.get(n, {})) for n in range(5)]
    assert [figure.doubtful.named(n) for n in range(5)] == [[], [], ["left arm"], ["left arm", "right leg"], []]


def test_a_file_has_no_more_frames_than_are_seen():
    assert len(kept_frames(np.arange(120) / 60)) == 60
    assert len(kept_frames(np.arange(50) / 25)) == 50
    assert len(kept_frames(np.zeros(1))) == 1


def test_the_page_is_for_its_own_machine_and_itself(rig):
    import urllib.error
    import urllib.request

    scene = open_scene(rig)
    with serving(scene, port=0) as address:
        with urllib.request.urlopen(f"{address}image/0/0/silhouettes") as answer:
            assert (answer.status, answer.headers["Cross-Origin-Resource-Policy"]) == (200, "same-origin")
        for headers, code in (({"Host": "evil.example"}, 421), ({"Origin": "http://evil.example"}, 403)):
            with pytest.raises(urllib.error.HTTPError) as refused:
                urllib.request.urlopen(urllib.request.Request(address, headers=headers))
            refused.value.close()
            assert refused.value.code == code
        with pytest.raises(urllib.error.HTTPError, match="404") as refused:
            urllib.request.urlopen(f"{address}etc/passwd")
        refused.value.close()
        with pytest.raises(SettingsError, match="free port"), serving(scene, port=int(address.rstrip("/").rpartition(":")[2])):
            pass
