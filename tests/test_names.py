"""Names that look the same are the same, however they are composed: macOS names files with two signs where others take one."""

from __future__ import annotations

from unicodedata import normalize

import numpy as np
import pytest

from shadowpuppet.calibration.boards.films import films_in
from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import CalibrationError, RecordingError, ShadowPuppetError
from shadowpuppet.io.calibration.calibration_files import write_calibration
from shadowpuppet.io.motion.joint_names import with_names
from shadowpuppet.io.motion.motion_files import read_truth
from shadowpuppet.io.motion.table import read_joints, write_joints
from shadowpuppet.io.recording import read_recording
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.names import composed, spelled_as
from shadowpuppet.pipeline.footage import chosen_views
from shadowpuppet.video import write_frames

ONE, TWO = (normalize(form, "Überkopf é") for form in ("NFC", "NFD"))
BOTH = pytest.mark.parametrize(("ours", "theirs"), [(ONE, TWO), (TWO, ONE)], ids=["file-nfd", "file-nfc"])


def film(path):
    path.parent.mkdir(exist_ok=True, parents=True)
    with write_frames(path, 10) as writer:
        writer.write(np.full((24, 32), 100, np.uint8))
        writer.write(np.full((24, 32), 100, np.uint8))


def camera(name):
    return Camera.from_fov((32, 24), 1.0, name)


@BOTH
def test_names_are_compared_composed_and_keep_their_spelling(ours, theirs):
    assert ours != theirs
    assert composed(ours) == composed(theirs) == ONE
    assert spelled_as({theirs: 1, "b": 2}, [ours, "a"]) == {ours: 1, "b": 2}


@BOTH
def test_films_empty_scenes_masks_and_starts_are_their_cameras(tmp_path, ours, theirs):
    for kind in ("video", "background", "masks"):
        film(tmp_path / kind / f"{theirs}.mp4")
    film(tmp_path / "video" / "b.mp4")
    write_calibration(tmp_path / "calibration.toml", [camera(ours), camera("b")])
    (tmp_path / "recording.toml").write_text(f'[start]\n"{theirs}" = 0.1\n', "utf-8")
    found = read_recording(tmp_path, asked=[theirs])
    view = found.views[0]
    assert (view.camera.name, view.start) == (ours, 0.1)
    assert [path and path.name for path in (view.video, view.background, view.masks)] == [f"{theirs}.mp4"] * 3
    assert [view.camera.name for view in chosen_views(found, theirs)] == [ours]
    with pytest.raises(RecordingError, match="each once"):
        chosen_views(found, f"{ours},{theirs}")


@BOTH
def test_a_single_film_is_its_camera(tmp_path, ours, theirs):
    film(tmp_path / f"{theirs}.mp4")
    write_calibration(tmp_path / "c.toml", [camera("b"), camera(ours)])
    found = read_recording(tmp_path / f"{theirs}.mp4", calibration=tmp_path / "c.toml")
    assert [view.camera.name for view in found.views] == [ours]


@BOTH
def test_files_that_a_recording_names_are_found(tmp_path, ours, theirs):
    film(tmp_path / theirs / f"{theirs}.mp4")
    write_calibration(tmp_path / f"{theirs}.toml", [camera("a")])
    text = f'calibration = "{ours}.toml"\n[video]\na = "{ours}/{ours}.mp4"\n'
    (tmp_path / "recording.toml").write_text(text, "utf-8")
    assert read_recording(tmp_path).views[0].video.name == f"{theirs}.mp4"
    (tmp_path / "recording.toml").write_text(text.replace(".mp4", ".mkv"), "utf-8")
    with pytest.raises(RecordingError, match=r"video\.a: found .*, expected the path of an existing file"):
        read_recording(tmp_path)


def test_two_films_of_one_name_are_two_of_one_camera(tmp_path):
    for name in (ONE, TWO):
        film(tmp_path / "video" / f"{name}.mp4")
    if len([*(tmp_path / "video").iterdir()]) < 2:
        return  # this system's disk composes names itself
    write_calibration(tmp_path / "calibration.toml", [camera(ONE)])
    with pytest.raises(RecordingError, match="expected one of them"):
        read_recording(tmp_path)
    with pytest.raises(CalibrationError, match="expected one of them"):
        films_in(tmp_path / "video")


@BOTH
def test_films_of_a_board_are_of_one_camera(tmp_path, ours, theirs):
    for folder, name in (("intrinsics", ours), ("extrinsics", theirs)):
        film(tmp_path / folder / f"{name}.mp4")
    assert films_in(tmp_path / "intrinsics").keys() == films_in(tmp_path / "extrinsics").keys()


@BOTH
def test_joints_of_a_truth_are_those_of_the_run(tmp_path, ours, theirs):
    table = JointTable(np.arange(2.0), ("neck", theirs), np.arange(12.0).reshape(2, 2, 3))
    write_joints(tmp_path / "truth.csv", table)
    assert read_joints(tmp_path / "truth.csv").names == ("neck", theirs)  # as they are in the file
    assert read_truth(tmp_path / "truth.csv", ["neck", ours]).names == ("neck", ours)
    np.testing.assert_array_equal(table.select([ours]).positions, table.positions[:, 1:])
    assert with_names(table.names, {"head": ours}) == ("neck", "head")
    with pytest.raises(ShadowPuppetError, match="names of joints: found"):
        JointTable(np.zeros(1), (ours, theirs), np.zeros((1, 2, 3)))
