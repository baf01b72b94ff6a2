"""What a calibration file states is used, named as not used, or refused; and programs with rules of their own."""

from __future__ import annotations

import json
import re

import calibrations
import numpy as np
import pytest

from shadowpuppet.calibration.overview import look_at_calibration, up_direction
from shadowpuppet.errors import CalibrationError, ShadowPuppetWarning
from shadowpuppet.geometry import rigid
from shadowpuppet.io.calibration.calibration_files import examine_calibration, read_calibration
from shadowpuppet.io.calibration.formats import find_calibration

MADE = calibrations.cameras(3)
LENS_KEYS = [{"fisheye": True}, {"fisheye": 1}, {"is_fisheye": True}, {"fisheye_model": 1}, {"camera_model": "OPENCV_FISHEYE"},
             {"distortion_model": "equidistant"}, {"model": "fisheye"}, {"projection": "Kannala-Brandt"}]  # fmt: skip


def written(folder, name, text):
    (folder / name).write_text(text)
    return folder / name


def said(path, *words, **more):
    with pytest.raises(CalibrationError) as caught:
        read_calibration(path, **more)
    assert all(word in str(caught.value) for word in (path.name, *words)), str(caught.value)


def as_json(camera, **more):
    T = camera.T_camera_world
    return {"K": camera.matrix.tolist(), "R": T[:3, :3].tolist(), "t": T[:3, 3].tolist(), "D": camera.distortion[:4].tolist(),
            "size": list(camera.size), **more}  # fmt: skip


def rig(folder, **more):
    return written(folder, "c.json", json.dumps({camera.name: as_json(camera, **more) for camera in MADE}))


def same_rig(found, made=MADE, scale=1.0):
    """Cameras that see the same, in whichever frame."""
    first = found[0].T_camera_world
    for n, (a, b) in enumerate(zip(found, made, strict=True)):
        wanted = calibrations.relative(made, n)
        np.testing.assert_allclose(a.T_camera_world @ np.linalg.inv(first), rigid(wanted[:3, :3], scale * wanted[:3, 3]), atol=1e-9)
        np.testing.assert_allclose(a.matrix, b.matrix, atol=1e-9)
        np.testing.assert_allclose(a.distortion, b.distortion, atol=1e-12)
        assert a.size == b.size


# Keys


@pytest.mark.parametrize("key", LENS_KEYS)
def test_a_fisheye_is_known_by_every_name(tmp_path, key):
    assert [camera.fisheye for camera in read_calibration(rig(tmp_path, **key))] == [True] * 3
    assert not read_calibration(rig(tmp_path))[0].fisheye


@pytest.mark.parametrize("key", ["fisheye_model: 1", "distortion_model: equidistant", "camera_model: FISHEYE", "fisheye: 1"])
def test_opencv_s_yaml_may_be_a_fisheye(tmp_path, key):
    text = calibrations.opencv(calibrations.cameras(1, (-0.03, 0.004, -0.002, 0.0005))[0])
    text = text.replace("rows: 5", "rows: 4").replace(",\n       0.0 ]", " ]").replace("flags: 0", key)
    camera, = read_calibration(written(tmp_path, "a.yml", text))
    assert camera.fisheye
    np.testing.assert_allclose(camera.distortion, [-0.03, 0.004, -0.002, 0.0005])


@pytest.mark.parametrize(("key", "words"), [("rotation_count: 1", "rotation_count: found 1"), ("distortion_kind: 2", "distortion_kind")])
def test_a_key_that_is_no_camera_s_is_not_taken_for_one(tmp_path, key, words):
    said(written(tmp_path, "a.yml", calibrations.opencv(MADE[0]).replace("flags: 0", key)), words, "may change where points are seen")


def test_places_of_a_camera_without_a_lens_are_named(tmp_path):
    calibrations.write_all(tmp_path, MADE)
    path = tmp_path / "easy" / "extri.yml"
    path.write_text(path.read_text() + calibrations._node("T_balcony", np.zeros((3, 1))))
    with pytest.warns(ShadowPuppetWarning, match="stated there but not used: T_balcony"):
        assert len(read_calibration(path)) == 3


@pytest.mark.parametrize("key", ["fisheye_model: 0", "distortion_model: plumb_bob", "camera_model: pinhole"])
def test_a_pinhole_may_be_named(tmp_path, key):
    assert not read_calibration(written(tmp_path, "a.yml", calibrations.opencv(MADE[0]).replace("flags: 0", key)))[0].fisheye


@pytest.mark.parametrize(("more", "words"), [
    ({"camera_model": "omni"}, ("camera_model: found 'omni', expected pinhole",)),
    ({"fisheye": 2}, ("fisheye: found 2, expected true or false",)),
    ({"fisheye": False, "camera_model": "fisheye"}, ("fisheye and camera_model: found False and 'fisheye'",)),
    ({"distortion_model": 3}, ("distortion_model: found 3",)), ({"units": "inch"}, ("units: found 'inch', expected one of m, cm, mm",)),
    ({"rotation_flipped": True}, ("camera 'camera_0': rotation_flipped: found True, which is not known here",)),
    ({"axes": "opengl"}, ("axes: found 'opengl'",)), ({"lens": {"transposed": True}}, ("transposed: found True",)),
    ({"distortion_scale": 2}, ("distortion_scale: found 2",)), ({"skew": 0.1}, ("skew: found 0.1",)),
])  # fmt: skip
def test_a_key_that_may_move_points_is_used_or_refused(tmp_path, more, words):
    words = [word.replace("camera_0", MADE[0].name) for word in words]
    said(rig(tmp_path, **more), *words)


@pytest.mark.parametrize("more", [{"flipped": False}, {"axes": None}, {"inverted": 0}, {"skew": 0.0}])
def test_such_a_key_without_a_value_states_nothing(tmp_path, more):
    assert len(read_calibration(rig(tmp_path, **more))) == 3


def test_keys_that_are_not_known_are_named_once(tmp_path):
    path = rig(tmp_path, shutter="global", gain=3)
    with pytest.warns(ShadowPuppetWarning) as caught:
        read_calibration(path)
    assert [str(each.message) for each in caught] == [f"{path}: stated there but not used: shutter, gain"]
    assert examine_calibration(path).notes == (str(caught[0].message),)


@pytest.mark.parametrize(("name", "before", "after", "key"), [
    ("anipose.toml", "\nsize", "\ngain = 3\nsize", "gain"), ("anipose.toml", "[metadata]", "[lights]\na = 1\n[metadata]", "lights"),
    ("camera_array.toml", "\nsize", "\ngain = 3\nsize", "gain"), ("multical.json", '"K"', '"gain": 3, "K"', "gain"),
    ("multical.json", '"image_sets"', '"gains": {"a": 1}, "image_sets"', "gains"),
    ("calibrated_cameras_data.yml", "   img_width", "   gain: 3\n   img_width", "gain"),
    ("calibrated_cameras_data.yml", "nb_camera", "gain: 3\nnb_camera", "gain"),
    ("transforms.json", '"frames"', '"gain": 3, "frames"', "gain"), ("transforms.json", '"fl_x"', '"gain": 3, "fl_x"', "gain"),
    ("easy/intri.yml", "names:", "gain: 3\nnames:", "gain"), ("camchain.yaml", "  cam_overlaps", "  gain: 3\n  cam_overlaps", "gain"),
    ("Calib.qca.txt", 'active="1"', 'active="1" gain="3"', "gain"), ("Calib.qca.txt", "skew=", 'gain="3" skew=', "gain"),
    ("session.xcp", "DISPLAY_TYPE", 'gain="3" DISPLAY_TYPE', "gain"), ("session.xcp", "IMAGE_ERROR", 'gain="3" IMAGE_ERROR', "gain"),
])  # fmt: skip
def test_every_format_names_what_it_does_not_know(tmp_path, name, before, after, key):
    calibrations.write_all(tmp_path, MADE)
    path = tmp_path / name
    assert before in path.read_text()
    path.write_text(path.read_text().replace(before, after))
    with pytest.warns(ShadowPuppetWarning, match=f"stated there but not used: {key}"):
        read_calibration(path)
    path.write_text(path.read_text().replace(key, "flipped_axes").replace("flipped_axes = 1", "flipped_axes = true"))
    said(path, "flipped_axes: found", "may change where points are seen")


@pytest.mark.parametrize(("word", "unit"), [("mm", "mm"), ("millimeters", "mm"), ("cm", "cm"), ("meters", "m")])
def test_a_stated_unit_is_used(tmp_path, word, unit):
    found = examine_calibration(rig(tmp_path, units=word))
    assert (found.unit, found.unit_known) == (unit, True)
    found = examine_calibration(written(tmp_path, "c.toml", calibrations.toml(MADE, tail=f'[metadata]\nunits = "{word}"\n')))
    assert (found.unit, found.unit_known) == (unit, True)


# Places


def test_several_lenses_without_places_are_refused(tmp_path):
    tables = {camera.name: {key: value for key, value in as_json(camera).items() if key not in "Rt"} for camera in MADE}
    path = written(tmp_path, "c.json", json.dumps({**tables, "positions": {"a": 1}}))
    said(path, f"found lenses without places of {MADE[0].name}, {MADE[1].name}", "stated there but not used: positions")
    path.write_text(json.dumps(tables))
    assert len(read_calibration(path, places=False)) == 3
    path.write_text(json.dumps({MADE[0].name: tables[MADE[0].name]}))
    assert not read_calibration(path)[0].oriented


def test_a_folder_of_lenses_is_refused(tmp_path):
    for camera in MADE[:2]:
        written(tmp_path, f"{camera.name}.yml", calibrations.opencv(camera).partition("rvec")[0])
    said(tmp_path, "found lenses without places")


def test_a_transposed_matrix_is_named(tmp_path):
    said(rig(tmp_path, K=MADE[0].matrix.T.tolist()), "the matrix is transposed, as MATLAB's are")


# Programs


def quarters(tmp_path, made, turns):
    """Caliscope's file of cameras mounted on their sides, in the first one's world."""
    home, text = np.linalg.inv(made[0].T_camera_world), ""
    for n, (camera, turn) in enumerate(zip(made, turns)):
        angle = -turn * np.pi / 2
        spun = rigid([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]], np.zeros(3))
        T = spun @ camera.T_camera_world @ home
        text += (f"[cameras.{n}]\ncam_id = {n}\nrotation_count = {turn}\nsize = [640, 480]\nmatrix = {camera.matrix.tolist()}\n"
                 f"distortions = [0.0, 0.0, 0.0, 0.0]\nrotation = {T[:3, :3].tolist()}\ntranslation = {T[:3, 3].tolist()}\n")
    return written(tmp_path, "camera_array.toml", text)


def test_caliscope_s_rotation_count_tells_what_is_up(tmp_path):
    path = quarters(tmp_path, MADE, (0, -1, 1))
    found = examine_calibration(path, up="cameras")
    assert "rotation_count" in found.notes[0]
    assert "cam_1, cam_2" in found.notes[0]
    heights = [camera.centre[2] - found.cameras[0].centre[2] for camera in found.cameras]
    np.testing.assert_allclose(heights, [camera.centre[2] - MADE[0].centre[2] for camera in MADE], atol=1e-9)
    plain = written(tmp_path, "plain.toml", path.read_text().replace("rotation_count", "port"))
    assert np.ptp([camera.centre[2] for camera in read_calibration(plain, up="cameras")]) > 0.1  # without it the world is tilted


def test_an_overview_looks_at_the_pictures_as_they_are_shown(tmp_path):
    path = quarters(tmp_path, MADE, (0, -1, 1))
    found = examine_calibration(path)
    level = np.linalg.norm(up_direction(MADE))
    assert np.linalg.norm(up_direction(found.shown)) == pytest.approx(level, abs=1e-9)
    assert np.linalg.norm(up_direction(found.cameras)) < 0.8
    assert not any("is not up" in doubt for doubt in look_at_calibration(path, up="cameras")[0].doubts)


@pytest.mark.parametrize("value", ["1.5", "true", "4", '"1"'])
def test_a_rotation_count_is_a_number_of_quarter_turns(tmp_path, value):
    path = quarters(tmp_path, MADE[:1], (0,))
    said(written(tmp_path, "c.toml", path.read_text().replace("rotation_count = 0", f"rotation_count = {value}")),
         "[cameras.0]: rotation_count: found", "quarter turns")


@pytest.mark.parametrize(("kind", "names"), [
    ("multical.json", [camera.name for camera in MADE]), ("calibrated_cameras_data.yml", ["camera_0", "camera_1", "camera_2"]),
    ("jarvis", [camera.name for camera in MADE]), ("transforms.json", [camera.name for camera in MADE]),
])
def test_programs_with_rules_of_their_own(tmp_path, kind, names):
    found = examine_calibration(calibrations.write_all(tmp_path, MADE)[kind], sizes=lambda name: calibrations.SIZE)
    same_rig(found.cameras)
    assert [camera.name for camera in found.cameras] == names
    assert (found.unit, found.unused) == ("mm" if kind == "jarvis" else "m", "")


@pytest.mark.parametrize("kind", ["multical.json", "calibrated_cameras_data.yml", "camchain.yaml"])
def test_a_world_that_is_a_camera_s_is_said(tmp_path, kind):
    assert "say what is up with --up" in examine_calibration(calibrations.write_all(tmp_path, MADE)[kind]).notes[0]


@pytest.mark.parametrize("kind", ["multical.json", "calibrated_cameras_data.yml", "transforms.json"])
def test_a_recording_may_have_them(tmp_path, kind):
    path = calibrations.write_all(tmp_path, MADE)[kind]
    (tmp_path / "recording").mkdir()
    moved = path.rename(tmp_path / "recording" / kind)
    assert find_calibration(moved.parent) == moved


def test_jarvis_places_are_in_the_world(tmp_path):
    found = read_calibration(calibrations.write_all(tmp_path, MADE)["jarvis"])
    np.testing.assert_allclose([camera.T_camera_world for camera in found], [camera.T_camera_world for camera in MADE], atol=1e-9)


def test_transforms_are_in_the_world(tmp_path):
    found = read_calibration(calibrations.write_all(tmp_path, MADE)["transforms.json"])
    np.testing.assert_allclose([camera.T_camera_world for camera in found], [camera.T_camera_world for camera in MADE], atol=1e-9)


def test_mc_calib_s_fisheyes(tmp_path):
    fish = calibrations.cameras(2, (-0.03, 0.004, -0.002, 0.0005))
    found = read_calibration(written(tmp_path, "c.yml", calibrations.mc_calib(fish, distortion=1)))
    assert [camera.fisheye for camera in found] == [True, True]


@pytest.mark.parametrize(("before", "after", "words"), [
    ("distortion_type: 0", "distortion_type: 2", ("camera 'camera_0': distortion_type: found 2",)),
    ("camera_group: 0", "camera_group: 1", ("camera_group: found 0.0, 1.0, expected one group",)),
    ("img_width: 640", "", ("camera 'camera_0': img_width: missing",)),
    ("camera_pose_matrix:", "pose:", ("camera 'camera_0': camera_pose_matrix: missing",)),
    ("rows: 4\n      cols: 4", "rows: 2\n      cols: 8", ("camera_pose_matrix: found", "4 x 4 finite numbers")),
    ("rows: 3\n      cols: 3", "rows: 1\n      cols: 9", ("camera_matrix: found", "3 x 3 finite numbers")),
])  # fmt: skip
def test_what_is_wrong_in_mc_calib_s_file_is_named(tmp_path, before, after, words):
    text = calibrations.mc_calib(MADE)
    assert before in text
    said(written(tmp_path, "c.yml", text.replace(before, after, 1)), *words)


def test_a_pose_of_mc_calib_s_is_a_rotation(tmp_path):
    text = re.sub(r"(cols: 4\s+dt: d\s+data: \[ )\S+", r"\g<1>2.0,", calibrations.mc_calib(MADE), count=1)
    said(written(tmp_path, "c.yml", text), "camera_pose_matrix: found", "expected a rotation")


def changed(text, change):
    values = json.loads(text)
    change(values)
    return json.dumps(values)


@pytest.mark.parametrize(("change", "words"), [
    (lambda v: v["camera_poses"].pop(next(iter(list(v["camera_poses"])[1:]))), ("found lenses without places of",)),
    (lambda v: v["camera_poses"].update(other={"R": 1, "T": 2}), ("camera_poses: found 'other', expected <camera>_to_<camera>",)),
    (lambda v: v["camera_poses"].update({next(iter(v["cameras"])): 3}), ("camera_poses: found",)),
    (lambda v: v["camera_poses"].update({"_to_".join([*v["cameras"]][1:]): {"R": np.eye(3).tolist(), "T": [0, 0, 0]}}),
     ("expected all relative to one camera",)),
    (lambda v: v["camera_poses"][next(iter(v["cameras"]))].update(R=[[1]]), ("rotation: found 1 values",)),
])  # fmt: skip
def test_what_is_wrong_in_multical_s_file_is_named(tmp_path, change, words):
    said(written(tmp_path, "c.json", changed(calibrations.multical(MADE), change)), *words)


@pytest.mark.parametrize(("change", "words"), [
    (lambda v: v["frames"][1].update(transform_matrix=[[1]]), ("frame 1: transform_matrix: found [[1]], expected 4 x 4",)),
    (lambda v: v["frames"][1].update(transform_matrix=[[2, 0, 0, 0]] * 4), ("frame 1: transform_matrix: found", "expected a rotation")),
    (lambda v: v["frames"][0].pop("w"), ("frame 0: w: found nothing",)),
    (lambda v: v["frames"][0].pop("fl_x"), ("camera_angle_x: found nothing",)),
    (lambda v: v["frames"][0].update(k4=0.1), ("k4: found 0.1, expected 0",)), (lambda v: v.update(camera_model="OMNI"), ("found 'OMNI'",)),
    (lambda v: v["frames"][0].update(k1=None), ("k1: found nothing",)), (lambda v: v["frames"][0].update(fl_x=True), ("fl_x: found True",)),
    (lambda v: (v["frames"][0].pop("fl_x"), v.update(camera_angle_x=4)), ("camera_angle: found 4",)),
    (lambda v: v.update(camera_model="OPENCV_FISHEYE"), ("p1: found", "OpenCV's fisheye has no such")),
])  # fmt: skip
def test_what_is_wrong_in_transforms_is_named(tmp_path, change, words):
    said(written(tmp_path, "c.json", changed(calibrations.transforms(MADE), change)), *words)


def test_transforms_may_state_an_angle_and_a_fisheye(tmp_path):
    def change(values):
        for frame in values["frames"]:
            for key in ("fl_x", "fl_y", "cx", "cy", "k1", "k2", "k3", "p1", "p2"):
                frame.pop(key)
        values.update(camera_angle_x=2 * np.arctan(640 / 2 / 520), is_fisheye=True, k4=0.01)

    camera = read_calibration(written(tmp_path, "c.json", changed(calibrations.transforms(MADE), change)))[1]
    np.testing.assert_allclose(camera.matrix, [[520, 0, 319.5], [0, 520, 239.5], [0, 0, 1]])
    assert camera.fisheye
    np.testing.assert_allclose(camera.distortion, [0, 0, 0, 0.01])


def test_transforms_of_several_folders_are_named_after_them(tmp_path):
    def change(values):
        values["frames"] = [{**frame, "file_path": f"{n}/{k}.png"} for n, frame in enumerate(values["frames"]) for k in range(2)]

    path = written(tmp_path, "c.json", changed(calibrations.transforms(MADE), change))
    assert [camera.name for camera in read_calibration(path)] == ["0", "1", "2"]


@pytest.mark.parametrize(("name", "before", "after", "key"), [
    ("Calib.qca.txt", 'skew="0"', 'skew="0.5"', "skew: found 0.5"), ("session.xcp", 'SKEW="0"', 'SKEW="1.5"', "SKEW: found 1.5"),
])
def test_oblique_pixels_are_refused(tmp_path, name, before, after, key):
    calibrations.write_all(tmp_path, MADE)
    (tmp_path / name).write_text((tmp_path / name).read_text().replace(before, after))
    said(tmp_path / name, f"camera '{MADE[0].name}': {key}", "may change where points are seen")


def test_a_view_turned_in_qtm_is_named_where_a_run_reads_it(tmp_path):
    path = written(tmp_path, "Calib.qca.txt", calibrations.qualisys(MADE).replace('viewrotation="0"', 'viewrotation="90"', 1))
    with pytest.warns(ShadowPuppetWarning, match="not used: viewrotation"):
        read_calibration(path)
    assert any("was turned in QTM" in note for note in examine_calibration(path).notes)


def test_a_chain_s_delays_are_named(tmp_path):
    text = calibrations.kalibr(calibrations.cameras(2, (-0.08, 0.03, 0.0004, -0.0003)))
    with pytest.warns(ShadowPuppetWarning, match="not used: timeshift_cam_imu"):
        read_calibration(written(tmp_path, "camchain.yaml", text.replace("  rostopic", "  timeshift_cam_imu: 0.01\n  rostopic")))
