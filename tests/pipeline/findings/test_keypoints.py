"""What detectors found in a recording is listed, and whether the cameras' rays meet."""

from __future__ import annotations

import json

import made_rig
import numpy as np
import pytest

from shadowpuppet.io.calibration.calibration_files import write_calibration
from shadowpuppet.io.keypoints.film_keypoints import film_keypoints, write_keypoints
from shadowpuppet.io.recording import read_recording
from shadowpuppet.pipeline.findings.keypoints import look_at_keypoints
from shadowpuppet.pipeline.footage import camera_footage
from shadowpuppet.pipeline.options import make_options
from shadowpuppet.video import write_frames

NAMES = ("nose", "left_hip", "right_hip")
RATE = 10


def joints(seconds):
    """Places (3, 3) of the landmarks at a time."""
    return np.array([[0, 0, 1.7], [-0.2, 0.1, 1], [0.2, 0.1, 1]]) + np.array([0.3 * seconds, 0, 0])


def seen(camera, start=0.0, shift=0.0, persons=1):
    """Keypoints of a camera's film of 12 frames, whose recording begins `start` seconds late in it."""
    xy = np.array([camera.project(joints(n / RATE - start)) for n in range(12)])
    xy[..., 0] += shift
    frames = np.repeat(np.arange(12), persons)
    return film_keypoints(NAMES, frames, np.zeros(len(frames), int), xy[frames], np.ones((len(frames), 3)), "made", camera.size)


@pytest.fixture
def recording(tmp_path):
    """Two cameras; the second film begins 0.2 s before the recording."""
    cameras = made_rig.cameras(4)[:2]
    write_calibration(tmp_path / "calibration.toml", cameras)
    (tmp_path / "keypoints").mkdir()
    for camera, start in zip(cameras, (0, 0.2)):
        with write_frames(tmp_path / f"{camera.name}.mp4", RATE) as film:
            for _ in range(12):
                film.write(np.zeros(camera.size[::-1], np.uint8))
        write_keypoints(tmp_path / "keypoints" / f"{camera.name}.npz", seen(camera, start))
    (tmp_path / "recording.toml").write_text(f"[start]\n{cameras[1].name} = 0.2\n")
    return tmp_path


def look(path):
    recording = read_recording(path)
    return look_at_keypoints([camera_footage(recording, view, make_options({})) for view in recording.views])


def test_rays_of_one_moment_meet(recording):
    found = look(recording)
    assert [(film.detector, film.landmarks, film.frames, film.persons) for film in found.films] == [("made", 3, 12, 1)] * 2
    assert found.apart < 1e-4
    assert found.apart_pixels < 0.01


def test_rays_of_a_camera_that_looks_elsewhere_pass_each_other(recording):
    second = read_recording(recording).views[1].camera
    good = seen(second, 0.2)
    moved = film_keypoints(NAMES, good.frame, good.person, good.xy + np.float32([0, 8]), good.confidence, "made", second.size)
    write_keypoints(recording / "keypoints" / f"{second.name}.npz", moved)
    found = look(recording)
    focal = second.matrix[0, 0]
    assert found.apart_pixels == pytest.approx(4, rel=0.2)  # half of 8: the point is between the rays
    assert found.apart == pytest.approx(4 / focal * 3, rel=0.2)


def test_frames_with_several_persons_are_not_compared(recording):
    second = read_recording(recording).views[1].camera
    write_keypoints(recording / "keypoints" / f"{second.name}.npz", seen(second, 0.2, persons=2))
    found = look(recording)
    assert (found.films[1].persons, found.apart, found.apart_pixels) == (2, None, None)


def test_a_recording_without_keypoints_has_no_look_at_them(recording):
    for path in (recording / "keypoints").iterdir():
        path.unlink()
    assert look(recording) is None


def test_a_look_is_plain_values(recording):
    assert json.dumps({**vars(look(recording)), "films": [vars(film) for film in look(recording).films]})
