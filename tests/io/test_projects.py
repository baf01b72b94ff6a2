"""Project folders of other programs are read as they lie: films, calibration, the person's height, the part of the film."""

from __future__ import annotations

import numpy as np
import pytest

from shadowpuppet.camera.camera import Camera
from shadowpuppet.cli.calibration.explain import is_explained
from shadowpuppet.errors import RecordingError, ShadowPuppetWarning
from shadowpuppet.io.calibration.calibration_files import write_calibration
from shadowpuppet.io.projects import find_project
from shadowpuppet.io.recording import read_recording
from shadowpuppet.video import write_frames

SIZE = (32, 24)


def film(path, frames=3):
    path.parent.mkdir(parents=True, exist_ok=True)
    with write_frames(path, 10) as writer:
        for _ in range(frames):
            writer.write(np.full(SIZE[::-1], 100, np.uint8))


def calibration(path, *names):
    path.parent.mkdir(parents=True, exist_ok=True)
    write_calibration(path, [Camera.from_fov(SIZE, 1.0 + n / 10, name) for n, name in enumerate(names)])


@pytest.fixture
def pose2sim(tmp_path):
    """A session with one trial; settings and calibration lie above it."""
    session = tmp_path / "session"
    trial = session / "S00_P00" / "walk"
    for name in ("cam1", "cam2"):
        film(trial / "videos" / f"{name}.mp4")
    calibration(session / "calibration" / "Calib_board.toml", "cam1", "cam2")
    for folder in (session, session / "S00_P00", trial):
        (folder / "Config.toml").write_text("[project]\n")
    (session / "Config.toml").write_text("[project]\nparticipant_height = 1.6\nframe_rate = 'auto'\nframe_range = 'auto'\n")
    return trial


@pytest.fixture
def freemocap(tmp_path):
    session = tmp_path / "2026-01-02_walk"
    for name in ("Camera_000_synchronized", "Camera_001_synchronized"):
        film(session / "synchronized_videos" / f"{name}.mp4")
    calibration(session / "2026-01-02_walk_camera_calibration.toml", "cam_0", "cam_1")
    return session


@pytest.fixture
def opencap(tmp_path):
    session = tmp_path / "OpenCapData_1"
    for camera in ("Cam0", "Cam1"):
        for trial in ("calibration", "neutral", "squats"):
            film(session / "Videos" / camera / "InputMedia" / trial / f"{trial}-{camera}.mov")
        (session / "Videos" / camera / "cameraIntrinsicsExtrinsics.pickle").write_bytes(b"\x80\x04")
    (session / "sessionMetadata.yaml").write_text("checkerBoard:\n  squareSideLength_mm: 35.0\nheight_m: 1.83\nmass_kg: 80.1\n")
    return session


def films_of(recording):
    return {view.camera.name: view.video.name for view in recording.views}


def test_a_trial_of_pose2sim_has_what_lies_above_it(pose2sim):
    found = read_recording(pose2sim)
    assert (found.name, found.subject.height, found.rate, found.begin, found.duration) == ("walk", 1.6, None, 0.0, None)
    assert films_of(found) == {"cam1": "cam1.mp4", "cam2": "cam2.mp4"}
    assert find_project(pose2sim).results == ("trc", pose2sim / "pose-3d")
    assert not is_explained(pose2sim)  # `info` looks at the films, not at the calibration alone


def test_the_trial_s_settings_of_pose2sim_come_before_the_session_s(pose2sim):
    (pose2sim / "Config.toml").write_text("[project]\nparticipant_height = [1.72]\nframe_range = [1, 2]\nframe_rate = 20\n")
    found = read_recording(pose2sim)
    assert (found.subject.height, found.rate) == (1.72, 20.0)
    assert found.begin == pytest.approx(0.5 / 20)  # frame 1 is the first
    assert found.duration == pytest.approx(2.5 / 20)  # frame 2 the last
    (pose2sim / "Config.toml").write_text("[project]\nframe_range = [1, 2]\n")
    assert read_recording(pose2sim).duration == pytest.approx(2.5 / 10)  # at the film's rate


def test_of_two_people_s_heights_none_is_taken(pose2sim):
    (pose2sim / "Config.toml").write_text("[project]\nparticipant_height = [1.72, 1.4]\n")
    assert read_recording(pose2sim).subject.height is None


@pytest.mark.parametrize(("text", "several"), [("", False), ("multi_person = false\n", False), ("multi_person = true\n", True)])
def test_a_project_may_state_several_people(pose2sim, text, several):
    (pose2sim.parent / "Config.toml").write_text(f"[project]\n{text}")
    assert read_recording(pose2sim).several == several


@pytest.mark.parametrize(("text", "said"), [
    ("participant_height = 172", "project.participant_height: found 172, expected 0.5 to 2.5 metres"),
    ("frame_range = [10]", r"project.frame_range: found \[10\], expected 'auto', 'all', or the first and last frame"),
    ("frame_range = [10, 3]", r"project.frame_range: found \[10, 3\]"),
    ("frame_range = [0.5, 3]", r"project.frame_range: found \[0.5, 3\]"),
    (f"frame_range = [0, {'9' * 400}]", r"project.frame_range: found \[0, 9+"),
    (f"frame_rate = {'9' * 400}", r"project.frame_rate: found 9+"),
    ("frame_rate = [20]", r"project.frame_rate: found \[20\], expected 0.1 to 10000 frames/s"),
    ("frame_range = [", "not valid TOML"),
])
def test_settings_of_pose2sim_that_cannot_be_meant_are_reported(pose2sim, text, said):
    (pose2sim / "Config.toml").write_text(f"[project]\n{text}\n")
    with pytest.raises(RecordingError, match=rf"Config.toml: .*{said}"):
        read_recording(pose2sim)


def test_a_recording_s_own_file_comes_before_the_project_s(pose2sim):
    (pose2sim / "recording.toml").write_text("duration = 0.2\n[subject]\nheight = 1.9\n[start]\ncam2 = 0.1\n")
    (pose2sim / "Config.toml").write_text("[project]\nframe_range = [1, 2]\n")
    found = read_recording(pose2sim)
    assert (found.subject.height, found.begin, found.duration, found.views[1].start) == (1.9, 0.0, 0.2, 0.1)


def test_empty_scenes_and_masks_lie_in_a_project_as_in_a_recording(pose2sim):
    film(pose2sim / "background" / "cam1.mp4")
    film(pose2sim / "masks" / "cam2.mkv")
    left, right = read_recording(pose2sim).views
    assert (left.background, right.background) == (pose2sim / "background" / "cam1.mp4", None)
    assert (left.masks, right.masks) == (None, pose2sim / "masks" / "cam2.mkv")


def test_films_without_settings_or_calibration_are_no_project(tmp_path):
    folder = tmp_path / "films"
    film(folder / "videos" / "cam1.mp4")
    (tmp_path / "calibrated last year").mkdir()  # not a session's: no settings are beside it
    assert find_project(folder) is None
    with pytest.raises(RecordingError, match="found neither films nor video/"):
        read_recording(folder)


def test_a_project_s_missing_calibration_is_named_as_the_program_s(pose2sim):
    (pose2sim.parent.parent / "calibration" / "Calib_board.toml").unlink()
    with pytest.raises(RecordingError, match=r"Pose2Sim.s calibration, a file in calibration/ beside or above the trial, is missing"):
        read_recording(pose2sim)


def test_freemocap_s_films_are_paired_with_its_calibration_by_order(freemocap):
    with pytest.warns(ShadowPuppetWarning, match="paired by order, as FreeMoCap does: Camera_000_synchronized is cam_0, Camera_001"):
        found = read_recording(freemocap)
    assert films_of(found) == {name: f"{name}.mp4" for name in ("Camera_000_synchronized", "Camera_001_synchronized")}
    first, second = (view.camera.matrix[0, 0] for view in found.views)
    assert first > second  # the narrower field of view is the first one's
    assert find_project(freemocap).results == ("trc", freemocap / "output_data")


def test_cameras_of_other_names_and_another_number_are_reported(freemocap):
    film(freemocap / "synchronized_videos" / "Camera_002_synchronized.mp4")
    with pytest.raises(RecordingError, match="the calibration knows no such camera; cameras known: cam_0, cam_1"):
        read_recording(freemocap)


def test_opencap_s_calibration_is_asked_for_as_it_is_a_pickle(opencap, tmp_path):
    with pytest.raises(RecordingError, match=r"OpenCap keeps its calibration in Python pickles, which are never opened, .*--calibration"):
        read_recording(opencap)
    calibration(tmp_path / "converted.toml", "Cam0", "Cam1")
    found = read_recording(opencap, calibration=tmp_path / "converted.toml")
    assert (found.name, found.subject.height) == ("squats", 1.83)
    assert films_of(found) == {"Cam0": "squats-Cam0.mov", "Cam1": "squats-Cam1.mov"}
    assert find_project(opencap).results == ("trc", opencap / "MarkerData")


def test_of_several_trials_of_opencap_one_is_named_below_the_session(opencap, tmp_path):
    calibration(tmp_path / "converted.toml", "Cam0", "Cam1")
    for camera in ("Cam0", "Cam1"):
        folder = opencap / "Videos" / camera / "InputMedia" / "walk"
        film(folder / "raw.mov")
        film(folder / "walk_sync.mp4")  # the film that OpenCap put in step with the others
    with pytest.raises(RecordingError, match=r"found the trials calibration, neutral, squats, walk of an OpenCap session, .*_1.squats"):
        read_recording(opencap, calibration=tmp_path / "converted.toml")
    found = read_recording(opencap / "walk", calibration=tmp_path / "converted.toml")
    assert (found.name, films_of(found)) == ("walk", {"Cam0": "walk_sync.mp4", "Cam1": "walk_sync.mp4"})
    with pytest.raises(RecordingError, match="jump: no such recording"):
        read_recording(opencap / "jump", calibration=tmp_path / "converted.toml")


@pytest.mark.parametrize(("text", "height"), [("height_m: 'unknown'\n", None), ("mass_kg: 80\n", None), ("height_m: 1.7.1\n", None)])
def test_opencap_s_height_may_be_missing(opencap, text, height):
    (opencap / "sessionMetadata.yaml").write_text(text)
    assert find_project(opencap).height is height


def test_an_impossible_height_of_opencap_s_is_reported(opencap):
    (opencap / "sessionMetadata.yaml").write_text("height_m: 183\n")
    with pytest.raises(RecordingError, match=r"sessionMetadata.yaml: height_m: found 183, expected 0.5 to 2.5 metres"):
        find_project(opencap)
