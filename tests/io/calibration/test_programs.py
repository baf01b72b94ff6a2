"""Calibrations of other programs: every kind gives the same cameras, units and ways up are settled, and nothing hostile gets by."""

from __future__ import annotations

import re
from dataclasses import replace

import calibrations
import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import CalibrationError, ShadowPuppetError
from shadowpuppet.geometry import rigid
from shadowpuppet.io.calibration.calibration_files import (
    UPS,
    examine_calibration,
    read_calibration,
    rotated_up,
    write_calibration,
)
from shadowpuppet.io.calibration.formats import find_calibration, is_calibration
from shadowpuppet.io.calibration.opencv_storage import read_storage
from shadowpuppet.io.calibration.vicon import ViconDistortion, opencv_distortion
from shadowpuppet.io.recording import read_recording

KINDS = ("anipose.toml", "freemocap.toml", "camera_array.toml", "Calib.qca.txt", "easy", "yaml", "xml", "KRT", "biocv")
"""That hold OpenCV's own lens; Vicon's is another."""
SCRATCH = [HealthCheck.function_scoped_fixture]


@pytest.fixture(scope="module")
def made() -> list[Camera]:
    return calibrations.cameras()


@pytest.fixture(scope="module")
def files(tmp_path_factory, made):
    return calibrations.write_all(tmp_path_factory.mktemp("rigs"), made)


def said(path, *words, error=CalibrationError, **more):
    with pytest.raises(error) as caught:
        read_calibration(path, **more)
    text = str(caught.value)
    assert "\n" not in text
    for word in words:
        assert word in text, text


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_tells_the_same_cameras(files, made, kind, rng):
    found = examine_calibration(files[kind], sizes=lambda name: calibrations.SIZE)
    points = rng.normal(0, 0.4, (60, 3))
    assert len(found.cameras) == len(made)
    for a, b in zip(found.cameras, made):
        assert a.size == b.size
        np.testing.assert_allclose(a.project(points), b.project(points), atol=1e-5)
    assert [camera.name for camera in found.cameras] == ([f"cam_{n}" for n in range(3)] if kind == "camera_array.toml"
                                                         else [camera.name for camera in made])


@pytest.mark.parametrize(("kind", "unit", "told"), [
    ("freemocap.toml", "mm", True), ("Calib.qca.txt", "mm", True), ("session.xcp", "mm", True),
    ("biocv", "mm", True), ("KRT", "m", False), ("camchain.yaml", "m", True),
    ("anipose.toml", "m", False), ("easy", "m", False),
])
def test_what_lengths_are_in_is_reported(files, kind, unit, told):
    found = examine_calibration(files[kind])
    assert (found.unit, found.unit_known) == (unit, told)


def test_a_unit_that_no_file_tells_is_asked_for_by_name(tmp_path, made):
    path = tmp_path / "c.toml"
    path.write_text(calibrations.toml(made, 1000.0))
    said(path, "[cam_0]: translation:", "--unit mm")
    np.testing.assert_allclose(read_calibration(path, unit="mm")[1].centre, made[1].centre, atol=1e-9)
    path.write_text(calibrations.toml(made, 100.0))
    np.testing.assert_allclose(read_calibration(path, unit="cm")[1].centre, made[1].centre, atol=1e-9)
    said(path, "unit: found 'inch', expected one of m, cm, mm", unit="inch")
    said(path, "up: found 'north'", up="north")


@pytest.mark.parametrize(("square", "unit"), [("58.0", "mm"), ("0.058", "m"), ("1.0", "m")])
def test_freemocap_s_board_tells_the_unit(tmp_path, made, square, unit):
    path = tmp_path / "c.toml"
    path.write_text(calibrations.toml(made, 1.0, f"[metadata]\ncharuco_square_size = {square}\n"))
    found = examine_calibration(path)
    assert (found.unit, found.unit_known) == (unit, square != "1.0")
    assert any("FreeMoCap" in note for note in found.notes)


def test_a_number_too_large_for_any_board_is_none(tmp_path, made):
    path = tmp_path / "c.toml"
    path.write_text(calibrations.toml(made, 1.0, f"[metadata]\ncharuco_square_size = {'9' * 400}\n"))
    assert not any("FreeMoCap" in note for note in examine_calibration(path).notes)


@pytest.mark.parametrize("board", ["[metadata.board]\nsquare_length_mm = 54.0\n", "[board]\nsquare_length_mm = 54\n",
                                   '[metadata]\n"board.square_length_mm" = 54.0\n'])
def test_newer_files_of_freemocap_have_millimetres(tmp_path, made, board):
    (tmp_path / "c.toml").write_text(calibrations.toml(made, 1000.0, board))
    found = examine_calibration(tmp_path / "c.toml")
    assert (found.unit, found.unit_known, found.notes) == ("mm", True, ("FreeMoCap's, with squares of 54 mm",))
    np.testing.assert_allclose(found.cameras[1].centre, made[1].centre, atol=1e-9)


def test_cameras_that_are_not_to_be_used_are_left_out_and_named(files):
    assert any("set aside in Caliscope, left out: 9" in note for note in examine_calibration(files["camera_array.toml"]).notes)
    assert any("not placed, left out: 8" in note for note in examine_calibration(files["camera_array.toml"]).notes)
    assert any("markers are left out: marker" in note for note in examine_calibration(files["Calib.qca.txt"]).notes)
    assert examine_calibration(files["session.xcp"]).notes == ("cameras for markers are left out: 999", "not calibrated, left out: 77")


@pytest.mark.parametrize(("calibration", "film"), [
    ("Calib.qca.txt", "marker.avi"), ("Calib.qca.txt", "video/marker.mp4"), ("calibration/Calib.qca.txt", "video/marker.mp4"),
    ("Calib.qca.txt", "video/marker/1.png"),
])  # fmt: skip
def test_a_camera_of_qualisys_that_filmed_is_one_for_films(tmp_path, made, calibration, film):
    """Whatever its model is."""
    (tmp_path / calibration).parent.mkdir(exist_ok=True)
    (tmp_path / calibration).write_text(calibrations.qualisys(made))
    assert "marker" not in {camera.name for camera in examine_calibration(tmp_path / calibration).cameras}
    (tmp_path / film).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / film).write_bytes(b"")
    found = examine_calibration(tmp_path / calibration)
    assert [camera.name for camera in found.cameras] == [*(camera.name for camera in made), "marker"]
    assert not found.notes


def test_a_camera_of_vicon_that_filmed_is_one_for_films(tmp_path, made):
    (tmp_path / "a.xcp").write_text(calibrations.vicon(made))
    (tmp_path / "999.avi").write_bytes(b"")
    found = examine_calibration(tmp_path / "a.xcp")
    assert [camera.name for camera in found.cameras] == [*(camera.name for camera in made), "999"]


def test_hybrid_cameras_of_qualisys_make_films(tmp_path, made):
    text = calibrations.qualisys(made).replace("Oqus 400", "Miqus Hybrid")
    (tmp_path / "Calib.qca.txt").write_text(text)
    assert [camera.name for camera in examine_calibration(tmp_path / "Calib.qca.txt").cameras][-1] == "marker"


def test_caliscope_without_places_is_said(tmp_path):
    path = tmp_path / "camera_array.toml"
    path.write_text("[cameras.0]\ncam_id = 0\nsize = [640, 480]\n")
    said(path, "found 1 cameras, none with a rotation and translation", "extrinsic calibration")


@pytest.mark.parametrize("radial", [1, 2])
def test_vicon_s_cameras_see_what_vicon_says(tmp_path, made, rng, radial):
    """Projected by Vicon's rules, solved for the seen pixel: the straight one is told of it, not the other way round."""
    path = tmp_path / "a.xcp"
    path.write_text(calibrations.vicon(made, radial=radial))
    points = rng.normal(0, 0.4, (60, 3))
    k = calibrations.VICON_K
    for found, camera in zip(read_calibration(path), made):
        X = points @ camera.T_camera_world[:3, :3].T + camera.T_camera_world[:3, 3]
        c = camera.matrix[:2, 2]
        straight = camera.matrix[0, 0] * X[:, :2] / X[:, 2:] + c
        seen = straight.copy()
        for _ in range(50):
            r2 = ((seen - c) ** 2).sum(1, keepdims=True)
            seen = c + (straight - c) / (1 + k[0] * r2 + k[1] * r2**2)
        assert np.abs(seen - straight).max() > 0.2  # there is something to undo
        np.testing.assert_allclose(found.project(points), seen, atol=0.02)


def test_vicon_s_distortion_over_the_focal_length_is_known_by_its_size(tmp_path, made):
    path, other = tmp_path / "a.xcp", tmp_path / "b.xcp"
    focal = made[0].matrix[0, 0]
    path.write_text(calibrations.vicon(made))
    other.write_text(calibrations.vicon(made, [value * focal ** (2 * n + 2) for n, value in enumerate(calibrations.VICON_K)]))
    np.testing.assert_allclose(read_calibration(path)[0].distortion, read_calibration(other)[0].distortion, atol=1e-12)


def test_a_distortion_that_opencv_cannot_follow_is_reported():
    matrix = np.array([[500.0, 0, 320], [0, 500, 240], [0, 0, 1]])
    straight, none = opencv_distortion(matrix, np.array([640, 480]), ViconDistortion(np.array([320.0, 240]), np.zeros(3)))
    assert np.abs(straight).max() < 1e-12
    assert none < 1e-9
    assert opencv_distortion(matrix, np.array([640, 480]), ViconDistortion(np.array([320.0, 240]), np.array([-6e-6, 0, 0])))[1] > 0.5


def test_a_file_without_sizes_is_given_one(tmp_path, made):
    (tmp_path / "intri.yml").write_text(calibrations.intri(made, sizes=False))
    (tmp_path / "extri.yml").write_text(calibrations.extri(made))
    found = examine_calibration(tmp_path / "extri.yml")
    assert {camera.size for camera in found.cameras} == {(640, 480)}
    assert "taken for 640 x 480, by the principal point" in found.notes[0]
    assert read_calibration(tmp_path, sizes=lambda name: (1280, 960))[0].size == (1280, 960)


def test_easymocap_without_its_second_file_is_said(tmp_path, made):
    (tmp_path / "intri.yml").write_text(calibrations.intri(made))
    said(tmp_path / "intri.yml", "no rotation of", "extri.yml beside intri.yml")


def test_a_stereo_pair_stands_in_the_first_camera(tmp_path, made):
    a, b = made[:2]
    relative = b.T_camera_world @ np.linalg.inv(a.T_camera_world)
    text = "%YAML:1.0\n---\n" + "".join(calibrations._node(f"{key}{n}", value) for n, camera in ((1, a), (2, b))
                                        for key, value in (("M", camera.matrix), ("D", camera.distortion[None, :5])))
    (tmp_path / "intrinsics.yml").write_text(text)
    extrinsics = {"R": relative[:3, :3], "T": relative[:3, 3:], "R1": np.eye(3), "R2": np.eye(3), "P1": np.eye(3, 4), "P2": np.eye(3, 4)}
    (tmp_path / "extrinsics.yml").write_text("%YAML:1.0\n---\n" + "".join(map(calibrations._node, extrinsics, extrinsics.values())))
    first, second = read_calibration(tmp_path / "intrinsics.yml", sizes=lambda name: calibrations.SIZE)
    np.testing.assert_allclose(first.T_camera_world, np.eye(4))
    np.testing.assert_allclose(second.T_camera_world, relative, atol=1e-12)


def test_a_lens_alone_is_a_level_camera(tmp_path, made):
    path = tmp_path / "cam.yaml"
    path.write_text("image_width: 640\nimage_height: 480\ncamera_name: left\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: [500, 0, 320, "
                    "0, 500, 240, 0, 0, 1]\ndistortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n"
                    "  data: [0.1, 0, 0, 0, 0]\n")  # fmt: skip
    found = examine_calibration(path)
    (camera,) = found.cameras
    assert (camera.name, camera.size, camera.oriented, camera.distortion[0]) == ("left", (640, 480), False, 0.1)
    assert "lens alone" in found.notes[0]


@pytest.mark.parametrize("up", [up for up in UPS if up != "cameras"])
def test_the_way_up_is_brought_to_z(made, up):
    axis = np.array(UPS[up], float)
    turned = rotated_up(tuple(made), up)
    for a, b in zip(turned, made):
        assert a.centre[2] == pytest.approx(b.centre @ axis)
        assert np.linalg.det(a.T_camera_world[:3, :3]) == pytest.approx(1)
        assert np.linalg.norm(a.centre - turned[0].centre) == pytest.approx(np.linalg.norm(b.centre - made[0].centre))


def test_cameras_in_the_first_one_s_world_are_stood_up(tmp_path, made):
    """As Anipose and FreeMoCap have them: the world is the first camera, its y down."""
    home = np.linalg.inv(made[0].T_camera_world)
    write_calibration(tmp_path / "c.toml", [replace(camera, T_camera_world=camera.T_camera_world @ home) for camera in made])
    level = read_calibration(tmp_path / "c.toml", up="cameras")
    heights = [camera.centre[2] - level[0].centre[2] for camera in level]
    np.testing.assert_allclose(heights, [camera.centre[2] - made[0].centre[2] for camera in made], atol=1e-9)


@pytest.mark.parametrize("name", ["out.toml", "folder", "folder/intri.yml", "of/folders/that/are/new"])
def test_what_is_written_is_read(tmp_path, made, name):
    (tmp_path / "folder").mkdir()
    write_calibration(tmp_path / name, made)
    for a, b in zip(read_calibration(tmp_path / name), made, strict=True):
        assert (a.name, a.size) == (b.name, b.size)
        np.testing.assert_allclose(a.matrix, b.matrix)
        np.testing.assert_allclose(a.distortion, b.distortion)
        np.testing.assert_allclose(a.T_camera_world, b.T_camera_world, atol=1e-12)


def test_easymocap_s_files_are_opencv_s(tmp_path, made):
    """OpenCV's own reader, which EasyMocap uses, is an independent one."""
    import cv2

    write_calibration(tmp_path / "easy", made)
    intri = cv2.FileStorage(str(tmp_path / "easy" / "intri.yml"), cv2.FILE_STORAGE_READ)
    extri = cv2.FileStorage(str(tmp_path / "easy" / "extri.yml"), cv2.FILE_STORAGE_READ)
    assert [intri.getNode("names").at(n).string() for n in range(3)] == [camera.name for camera in made]
    for camera in made:
        np.testing.assert_allclose(intri.getNode(f"K_{camera.name}").mat(), camera.matrix)
        np.testing.assert_allclose(intri.getNode(f"dist_{camera.name}").mat().ravel(), camera.distortion[:5])
        np.testing.assert_allclose(cv2.Rodrigues(extri.getNode(f"R_{camera.name}").mat())[0], camera.T_camera_world[:3, :3], atol=1e-9)
        np.testing.assert_allclose(extri.getNode(f"T_{camera.name}").mat(), camera.T_camera_world[:3, 3:])
        assert int(intri.getNode(f"W_{camera.name}").real()) == 640


def test_our_reader_of_opencv_s_files_reads_what_opencv_writes(tmp_path, made, rng):
    import cv2

    values = {"K": made[0].matrix, "row": rng.normal(size=(1, 12)), "tall": rng.normal(size=(17, 1))}
    for name in ("a.yml", "a.xml"):
        storage = cv2.FileStorage(str(tmp_path / name), cv2.FILE_STORAGE_WRITE)
        for key, value in values.items():
            storage.write(key, value)
        storage.write("count", 7)
        storage.write("word", "two words")
        storage.release()
        found = read_storage(tmp_path / name)
        for key, value in values.items():
            np.testing.assert_array_equal(found[key], value)
        assert (found["count"], found["word"]) == (7.0, "two words")


def test_what_cannot_be_written_is_said(tmp_path, made):
    with pytest.raises(CalibrationError, match="fisheye, which EasyMocap"):
        write_calibration(tmp_path / "easy", [replace(made[0], fisheye=True, distortion=np.zeros(4))])
    with pytest.raises(CalibrationError, match="letters, digits"):
        write_calibration(tmp_path / "easy", [replace(made[0], name="left one")])
    with pytest.raises(CalibrationError, match=r"expected NAME.toml, or intri.yml"):
        write_calibration(tmp_path / "rig.xml", made)
    assert not list(tmp_path.iterdir())


def test_a_pickle_is_refused_with_the_way_round(files):
    path = files["anipose.toml"].parent / "cameraIntrinsicsExtrinsics.pickle"
    said(path, "is a pickle, as OpenCap saves calibrations", "runs any program", "Pose2Sim makes TOML of it")
    renamed = path.with_suffix(".toml")
    renamed.write_bytes(path.read_bytes())
    said(renamed, "is a pickle")
    renamed.unlink()


@pytest.mark.parametrize(("text", "words"), [
    ('<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a "b"><!ENTITY c "&a;&a;">]><calibration><camera>&c;</camera></calibration>', ["DOCTYPE"]),
    ("<calibration><camera>" + "<a>" * 100_000, ["levels of XML"]),
    ("<calibration><cameras><camera active='1' serial='1'/></cameras></calibration>", ["camera '1': <fov_video>: missing"]),
    ("<calibration><cameras><camera active='0' serial='1'/></cameras></calibration>", ["no active camera"]),
    ("<Cameras><Camera DEVICEID='5'/></Cameras>", ["no calibrated camera"]),
    ("<Cameras><Camera DEVICEID='5'><KeyFrames><KeyFrame FOCAL_LENGTH='x'/></KeyFrames></Camera></Cameras>", ["camera '5': SENSOR_SIZE"]),
    ("<Cameras><Camera DEVICEID='5' SENSOR_SIZE='640 480'><KeyFrames><KeyFrame FOCAL_LENGTH='900' PRINCIPAL_POINT='1 2' POSITION='0 0 0' "
     "ORIENTATION='0 0 0 2'/></KeyFrames></Camera></Cameras>", ["ORIENTATION", "length 2"]),
    ("%YAML:1.0\n---\nK: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 1., 2.,", ["does not end", "cut off"]),
    ("%YAML:1.0\n---\nK: !!opencv-matrix\n   rows: 3\n", ["K: found a matrix with rows", "cut off"]),
    ("%YAML:1.0\n---\nK: !!opencv-matrix\n   rows: 1e99\n   cols: 3\n   data: [1]\n", ["K"]),
    ("%YAML:1.0\n---\nK: !!opencv-matrix\n   rows: -1\n   cols: 3\n   data: [1]\n", ["whole numbers"]),
    ("%YAML:1.0\n---\nmap: !!opencv-matrix\n   rows: 480\n   cols: 640\n   data: [1]\n", ["no camera matrix"]),
    ("%YAML:1.0\n---\n!!opencv-matrix\n  - what\n", ["expected a key and a colon"]),
    ("%YAML:1.0\n---\nhello: !!opencv-matrix\n", ["hello"]),
], ids=range(14))  # fmt: skip
def test_hostile_and_broken_files_are_said(tmp_path, text, words):
    path = tmp_path / ("a.yml" if text.startswith("%") else "a.xml")
    path.write_text(text)
    said(path, str(path), *words)


def test_a_huge_file_and_no_calibration_are_said(tmp_path):
    for name in ("a.yml", "a.xcp", "a.qca.txt"):
        with (tmp_path / name).open("wb") as file:
            file.write(b"<calibration><camera>" if name == "a.qca.txt" else b"")
            file.truncate(11_000_000)
        said(tmp_path / name, "found 11000000 bytes")
    (tmp_path / "notes.txt").write_text("milk, eggs")
    said(tmp_path / "notes.txt", "found no calibration in it that is known, expected one of: JSON")
    assert not is_calibration(tmp_path / "notes.txt")
    assert not is_calibration(tmp_path / "nowhere.toml")


INSERTED = (b"nan", b"-", b"9" * 400, b"<", b"]", b"\n", b"[cam_0]\n", b"\xff", b"1e308", b":", b"\0")
PIECES = {"anipose.toml": calibrations.toml, "camera_array.toml": calibrations.caliscope, "a.qca.txt": calibrations.qualisys,
          "a.xcp": calibrations.vicon, "a.yml": lambda made: calibrations.opencv(made[0]),
          "a.xml": lambda made: calibrations.opencv_xml(made[0])}  # fmt: skip


@pytest.mark.parametrize("name", PIECES)
@settings(max_examples=40, suppress_health_check=SCRATCH, deadline=None)
@given(data=st.data())
def test_damaged_files_are_read_or_said(tmp_path, name, data):
    """Bytes changed, cut off, put in, doubled: cameras that could be, or one sentence that names the file."""
    content = bytearray(PIECES[name](calibrations.cameras(2)).encode())
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, max(0, len(content) - 1)))
        how = data.draw(st.sampled_from(["change", "cut", "insert", "remove", "double"]))
        if how == "change" and content:
            content[at] = data.draw(st.integers(0, 255))
        elif how == "cut":
            del content[at:]
        elif how == "insert":
            content[at:at] = data.draw(st.sampled_from(INSERTED))
        else:
            piece = bytes(content[at : at + data.draw(st.integers(1, 300))])
            content[at : at + (len(piece) if how == "remove" else 0)] = b"" if how == "remove" else piece
    path = tmp_path / name
    path.write_bytes(bytes(content))
    assert told_or_read(path)


def told_or_read(path) -> bool:
    try:
        found = examine_calibration(path)
    except ShadowPuppetError as error:
        return str(path) in str(error) and "\n" not in str(error) and len(str(error)) < 900
    return len(found.cameras) > 0 and all(np.isfinite(camera.T_camera_world).all() for camera in found.cameras)


@pytest.mark.parametrize(("rows", "cols"), [("0", "1e308"), ("1e308", "0"), ("0", "5000"), ("1e200", "1e200")])
def test_impossible_matrices_are_passed_over(tmp_path, rows, cols):
    (tmp_path / "a.yml").write_text(f"%YAML:1.0\nmap: !!opencv-matrix\n  rows: {rows}\n  cols: {cols}\n  dt: d\n  data: []\n")
    with pytest.raises(CalibrationError, match=r"a\.yml: no camera matrix in it"):
        examine_calibration(tmp_path / "a.yml")


def test_a_distortion_that_no_lens_has_is_said(tmp_path, files):
    text = files["session.xcp"].read_text()
    text = re.sub(r'VICON_RADIAL2="ViconRadial2 (\S+) (\S+) \S+', r'VICON_RADIAL2="ViconRadial2 \1 \2 1e300', text)
    text = re.sub(r'VICON_RADIAL="\S+', 'VICON_RADIAL="1e300', text)
    (tmp_path / "a.xcp").write_text(text)
    with pytest.raises(CalibrationError, match=r"a\.xcp: camera '.*': found the distortion .*, expected that of a lens"):
        examine_calibration(tmp_path / "a.xcp")


@settings(max_examples=30, suppress_health_check=SCRATCH, deadline=None)
@given(st.binary(max_size=200), st.sampled_from(["x.toml", "x.yml", "x.xml", "x.xcp", "x.qca.txt", "x"]))
@example(b"\x80\x04cos\nsystem\n", "x.yml")
def test_any_bytes_are_said(tmp_path, content, name):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ShadowPuppetError, match=re.escape(name)):
        read_calibration(tmp_path / name)


def test_a_recording_may_have_any_of_them(tmp_path, made, files):
    import made_rig

    small = made_rig.cameras(3)
    folder = made_rig.write(tmp_path / "r", small, made_rig.masks(small, 2))
    (folder / "calibration.toml").unlink()
    for name, text in (("Calib.qca.txt", calibrations.qualisys(small)), ("lab.xcp", calibrations.vicon(small, (0, 0, 0))),
                       ("x_camera_calibration.toml", calibrations.freemocap(small))):
        (folder / name).write_text(text)
        found = [view.camera for view in read_recording(folder).views]
        for a, b in zip(found, small, strict=True):
            np.testing.assert_allclose(a.T_camera_world, b.T_camera_world, atol=1e-7)
        (folder / name).unlink()
    (folder / "intri.yml").write_text(calibrations.intri(small, sizes=False))
    (folder / "extri.yml").write_text(calibrations.extri(small))
    assert find_calibration(folder) == folder
    assert [view.camera.size for view in read_recording(folder).views] == [made_rig.SIZE] * 3
    (folder / "other.toml").write_text(calibrations.toml(small))
    with pytest.raises(CalibrationError, match=r"found several calibrations \(extri.yml, intri.yml, other.toml\); say in recording.toml"):
        read_recording(folder)
    (folder / "other.toml").write_text(calibrations.toml(small, 1000))
    (folder / "recording.toml").write_text('calibration = "other.toml"\nunit = "mm"\nup = "z"\n')
    np.testing.assert_allclose(read_recording(folder).views[0].camera.centre, small[0].centre, atol=1e-9)


def test_a_turn_of_half_a_circle_is_one(made):
    camera = Camera("a", (4, 4), np.eye(3), T_camera_world=rigid(np.eye(3), [1, 2, 3]))
    assert np.allclose(rotated_up((camera,), "-z")[0].centre, [-1, 2, 3])
