"""Which keypoints are which camera's: in a recording's folder, named in recording.toml, or in a project of Pose2Sim."""

from __future__ import annotations

import json
import shutil
import unicodedata

import numpy as np
import pytest
from detections import SIZE, alphapose, made_film, openpose

from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import FormatError, RecordingError
from shadowpuppet.io.calibration.calibration_files import write_calibration
from shadowpuppet.io.keypoints.film_keypoints import write_keypoints
from shadowpuppet.io.recording import read_recording
from shadowpuppet.video import write_frames


def films(folder, *names):
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        with write_frames(folder / f"{name}.mp4", 10) as film:
            film.write(np.zeros(SIZE[::-1], np.uint8))


@pytest.fixture
def recording(tmp_path):
    """A recording of the cameras a and b."""
    films(tmp_path / "video", "a", "b")
    write_calibration(tmp_path / "calibration.toml", [Camera.from_fov(SIZE, 1.0, name) for name in ("a", "b")])
    (tmp_path / "keypoints").mkdir()
    return tmp_path


def of_cameras(path):
    return {view.camera.name: view.keypoints for view in read_recording(path).views}


def test_keypoints_lie_beside_the_films_under_their_names(recording):
    made = made_film(np.random.default_rng(1))
    write_keypoints(recording / "keypoints" / "a.npz", made)
    openpose(recording / "keypoints" / "b_json", made)
    found = of_cameras(recording)
    assert {name: source.path.name for name, source in found.items()} == {"a": "a.npz", "b": "b_json"}
    for source in found.values():
        np.testing.assert_allclose(source.read(SIZE).xy, made.xy, atol=0.01)


def test_nothing_is_read_before_it_is_asked_for(recording):
    (recording / "keypoints" / "a.npz").write_text("damaged")
    source = of_cameras(recording)["a"]
    with pytest.raises(FormatError, match=r"a\.npz: File is not a zip file"):
        source.read(SIZE)


def test_a_name_is_the_same_in_any_form_of_its_signs(tmp_path):
    films(tmp_path / "video", unicodedata.normalize("NFD", "é"))
    write_calibration(tmp_path / "calibration.toml", [Camera.from_fov(SIZE, 1.0, "é")])
    (tmp_path / "keypoints").mkdir()
    (tmp_path / "keypoints" / f"{unicodedata.normalize('NFD', 'é')}.json").write_text("[]")
    assert of_cameras(tmp_path)["é"] is not None


def test_recording_toml_names_other_places_and_the_model(recording):
    (recording / "other.json").write_text(json.dumps(alphapose(made_film(np.random.default_rng(1), "BODY_25B"))))
    (recording / "recording.toml").write_text('[keypoints]\nmodel = "BODY_25B"\na = "other.json"\n')
    source = of_cameras(recording)["a"]
    assert (source.path.name, source.read(SIZE).detector) == ("other.json", "BODY_25B")


@pytest.mark.parametrize(("files", "words"), [
    (("c.npz",), "found c, but the calibration knows no such camera; cameras known: a, b"),
    (("a.npz", "a.jsonl"), "found a.jsonl and a.npz, expected one of them"),
    (("a.csv", "aDLC_net.csv"), "found a.csv and aDLC_net.csv, expected one of them"),
])  # fmt: skip
def test_files_of_no_camera_and_two_of_one_are_refused(recording, files, words):
    for name in files:
        (recording / "keypoints" / name).write_text("")
    with pytest.raises(RecordingError) as error:
        read_recording(recording)
    assert words in str(error.value)


@pytest.fixture
def pose2sim(tmp_path):
    """A trial in a session, with keypoints in pose/."""
    trial = tmp_path / "session" / "person" / "trial"
    films(trial / "videos", "a", "b")
    (tmp_path / "session" / "calibration").mkdir()
    write_calibration(tmp_path / "session" / "calibration" / "Calib.toml", [Camera.from_fov(SIZE, 1.0, name) for name in ("a", "b")])
    for folder in (trial, trial.parent, trial.parent.parent):
        (folder / "Config.toml").write_text("")
    made = made_film(np.random.default_rng(1), "BODY_25")
    for name in ("a", "b", "c"):
        openpose(trial / "pose" / f"{name}_json", made, "{:06d}", [float("nan")] * 3)
    (trial / "pose" / "a_pose.mp4").write_text("")
    return trial


def test_a_project_of_pose2sim_has_its_keypoints_where_it_writes_them(pose2sim):
    found = of_cameras(pose2sim)
    assert {name: source.path for name, source in found.items()} == {name: pose2sim / "pose" / f"{name}_json" for name in ("a", "b")}
    assert found["a"].model is None


def test_a_file_in_its_place_is_no_folder_of_keypoints(pose2sim):
    shutil.rmtree(pose2sim / "pose" / "a_json")
    (pose2sim / "pose" / "a_json").write_text("")
    assert of_cameras(pose2sim)["a"] is None


@pytest.mark.parametrize("level", [0, 1, 2])
def test_its_model_is_that_of_the_nearest_settings(pose2sim, level):
    folders = [pose2sim, *pose2sim.parents][level:3]
    for folder, model in zip(folders, ("BODY_25B", "Body", "Body")):
        (folder / "Config.toml").write_text(f"[pose]\npose_model = '{model}'\n")
    assert of_cameras(pose2sim)["a"].read(SIZE).detector == "BODY_25B"


def test_its_own_model_is_a_tree_in_its_settings(pose2sim):
    (pose2sim / "Config.toml").write_text("[pose]\npose_model = 'MINE'\n[[pose.MINE]]\nname = 'RHip'\nid = 24\n[[pose.MINE.children]]\n"
                                          "name = 'Nose'\nid = 0\n")  # fmt: skip
    found = of_cameras(pose2sim)["a"].read(SIZE)
    assert (found.names, found.detector) == (("nose", "right_hip"), "CUSTOM")


def test_keypoints_in_a_projects_keypoints_folder_come_before_its_own(pose2sim):
    (pose2sim / "keypoints").mkdir()
    (pose2sim / "keypoints" / "a.json").write_text("[]")
    assert {name: source and source.path.name for name, source in of_cameras(pose2sim).items()} == {"a": "a.json", "b": None}
