"""A calibration tested against silhouettes: time told apart from place, and what is found against what is true."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import made_rig
import numpy as np
import pytest

from shadowpuppet.calibration.rotation_error import estimate_rotation_error
from shadowpuppet.calibration.silhouettes import silhouettes_of
from shadowpuppet.calibration.time_offset import time_offsets
from shadowpuppet.camera.camera import Camera
from shadowpuppet.cli.app import run
from shadowpuppet.errors import RecordingError
from shadowpuppet.geometry import rigid, rotation_from_vector
from shadowpuppet.io.calibration.calibration_files import write_calibration
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.repair.films import check_calibration
from shadowpuppet.pipeline.rig import open_rig

FRAMES = 70
MASKS = Options(masks=True)


@pytest.fixture(scope="module")
def masks(cameras):
    return made_rig.masks(cameras, FRAMES)


def shifted(masks, late, frames=50):
    """As cameras see it whose films are late by so many frames."""
    return [[masks[10 + f - steps][k] for k, steps in enumerate(late)] for f in range(frames)]


def silhouettes(rows):
    return [silhouettes_of(row) for row in rows]


def moved(camera: Camera, right=0.0, down=0.0, clockwise=0.0) -> Camera:
    """The calibration of a camera that was turned since by so many degrees."""
    vector = -np.radians([down, -right, -clockwise])
    return replace(camera, T_camera_world=rigid(rotation_from_vector(vector), np.zeros(3)) @ camera.T_camera_world)


@pytest.mark.parametrize("late", [(0, 0, 0, 0), (0, 4, 0, 0), (0, 0, -3, 0), (0, 2, 0, -5)])
def test_frames_by_which_films_are_late(cameras, masks, late):
    found = time_offsets(cameras, silhouettes(shifted(masks, late)))
    np.testing.assert_allclose(found.frames, late, atol=0.15)
    assert max(found.spread) < 0.15
    assert found.pairs[0][1] == pytest.approx(late[1] - late[0], abs=0.15)
    assert found.pairs[1][0] == pytest.approx(late[0] - late[1], abs=0.15)


def test_half_frames_are_reported(cameras):
    masks = made_rig.masks(cameras, 120)
    rows = [[masks[20 + 2 * f - (3 if k == 1 else 0)][k] for k in range(4)] for f in range(45)]  # every second: 1.5 sets
    np.testing.assert_allclose(time_offsets(cameras, silhouettes(rows)).frames, (0, 1.5, 0, 0), atol=0.25)


def test_two_cameras_are_distinguished_only(cameras, masks):
    found = time_offsets(cameras[:2], silhouettes([row[:2] for row in shifted(masks, (0, 4, 0, 0))]))
    assert found.frames[0] == 0
    assert found.frames[1] == pytest.approx(4, abs=0.15)


def test_a_camera_that_was_moved_a_little_is_not_late(cameras, masks):
    wrong = [cameras[0], moved(cameras[1], right=2), *cameras[2:]]
    np.testing.assert_allclose(time_offsets(wrong, silhouettes(shifted(masks, (0, 3, 0, 0)))).frames, (0, 3, 0, 0), atol=0.6)


def test_a_person_who_stands_still_tells_nothing(cameras, masks):
    still = silhouettes([masks[0]] * 50)
    assert time_offsets(cameras, still).frames == (None,) * 4
    assert time_offsets(cameras, still[:10]).frames == (None,) * 4
    assert time_offsets(cameras, [[None] * 4] * 50).frames == (None,) * 4


@pytest.mark.parametrize("turn", [{"right": 3.0}, {"down": -2.0}, {"clockwise": 4.0}, {"right": -6.0, "down": 3.0}])
def test_how_a_camera_was_turned(cameras, masks, turn):
    wrong = [*cameras[:2], moved(cameras[2], **turn), cameras[3]]
    found = estimate_rotation_error(wrong, silhouettes(masks[::6]), 2)
    assert found is not None
    told = {"right": found.right, "down": found.down, "clockwise": found.clockwise}
    assert told == pytest.approx({"right": 0, "down": 0, "clockwise": 0} | turn, abs=0.4)
    assert found.degrees == pytest.approx(np.linalg.norm(list(turn.values())), abs=0.4)
    assert found.after < 0.3 * found.before
    np.testing.assert_allclose(found.of(wrong[2]).T_camera_world, cameras[2].T_camera_world, atol=0.03)


def test_a_turn_takes_three_cameras(cameras, masks):
    assert estimate_rotation_error(cameras[:2], silhouettes([row[:2] for row in masks[::6]]), 1) is None
    assert estimate_rotation_error(cameras, [[None] * 4], 1) is None


@pytest.fixture(scope="module")
def recording(tmp_path_factory, cameras, masks):
    return made_rig.write(tmp_path_factory.mktemp("check") / "r", cameras, masks[:50])


def checked(folder, options=MASKS):
    return check_calibration(open_rig(folder, options), options)


@pytest.mark.parametrize("options", [MASKS, Options()], ids=["exact", "from film"])
def test_an_untouched_recording_is_good(recording, options):
    found = checked(recording, options)
    assert found.good
    assert found.agreement.wrong == ()
    assert max(found.agreement.apart) < 1.6
    assert max(abs(frames) for frames in found.lateness.frames) < 0.5
    assert (found.turns, found.late, found.starts) == ({}, (), {})


@pytest.fixture
def again(recording, cameras):
    """With another calibration; as it was afterwards."""
    yield lambda changed: write_calibration(recording / "calibration.toml", changed) or recording
    write_calibration(recording / "calibration.toml", cameras)


def test_a_camera_that_was_turned_is_named_with_its_turn(again, cameras):
    found = checked(again([*cameras[:2], moved(cameras[2], right=5), cameras[3]]))
    (doubt,) = found.doubts
    assert re.search(r"camera 'cam3' disagrees .* turned by [45]\.\d degrees \([45]\.\d to the right", doubt)
    assert doubt.endswith("--camera cam1,cam2,cam4")
    assert found.turns["cam3"].apart < 1.5
    assert found.late == ()


def test_a_late_film_is_reported_with_what_mends_it(tmp_path, cameras, masks):
    folder = made_rig.write(tmp_path / "r", cameras, shifted(masks, (0, 0, 4, 0)))
    found = checked(folder)
    assert found.late == ("cam3",)
    assert found.starts == {"cam3": pytest.approx(4 / made_rig.RATE, abs=0.03)}
    (doubt,) = found.doubts
    assert re.search(r"cam3 (3\.9|4\.0|4\.1) frames late\): put into \[start\] of recording.toml: cam3 = 0\.[34]", doubt)
    (folder / "recording.toml").write_text("start.cam3 = 0.4\n")
    assert checked(folder).good


def test_turned_and_late_at_once(tmp_path, cameras, masks):
    folder = made_rig.write(tmp_path / "r", [*cameras[:2], moved(cameras[2], down=4), cameras[3]], shifted(masks, (0, 0, 4, 0)))
    found = checked(folder)
    assert found.late == ("cam3",)
    assert found.turns["cam3"].turn.down == pytest.approx(4, abs=0.6)
    assert len(found.doubts) == 2


def test_a_camera_that_was_carried_off_is_named_and_not_late(again, cameras):
    carried = replace(cameras[2], T_camera_world=rigid(np.eye(3), [0.4, 0, 0]) @ cameras[2].T_camera_world)
    found = checked(again([*cameras[:2], carried, cameras[3]]))
    assert found.late == ()
    assert any("camera 'cam3' disagrees" in doubt for doubt in found.doubts)


def test_swapped_films_are_reported_and_no_time_is(recording, again, cameras):
    swapped = [replace(cameras[1], name="cam1"), replace(cameras[0], name="cam2"), *cameras[2:]]
    found = checked(again(swapped))
    assert "'cam1' and 'cam2' are swapped" in found.doubts[0]
    assert found.lateness is None


def test_nobody_is_said(tmp_path, cameras):
    folder = made_rig.write(tmp_path / "r", cameras, [[np.zeros(camera.size[::-1], bool) for camera in cameras]] * 4)
    with pytest.raises(RecordingError, match="no two cameras see a person"):
        checked(folder)


def test_check_as_a_user_types_it(recording, again, cameras, capsys, tmp_path):
    assert run(["check", str(recording), "--masks"]) == 0
    out = capsys.readouterr().out
    assert "all cameras agree" in out
    assert out.count(" frames") >= 4
    again([*cameras[:2], moved(cameras[2], right=5), cameras[3]])
    assert run(["check", str(recording), "--masks", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["agreement"]["names"] == ["cam1", "cam2", "cam3", "cam4"]
    assert "cam3" in told["turns"]
    assert run(["check", str(tmp_path / "nowhere")]) == 2
    assert "no such recording" in capsys.readouterr().err
    assert run(["check", str(recording / "calibration.toml")]) == 2
    assert "is a calibration, expected a recording with films" in capsys.readouterr().err
    assert run(["check", str(recording), "--camera", "cam1"]) == 2
    assert "found one camera, expected two or more" in capsys.readouterr().err
