"""A calibration in words: where cameras stand, what they see together, what is odd; and as the command line tells it."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import calibrations
import made_rig
import numpy as np
import pytest

from shadowpuppet.calibration.overview import MAP_COLUMNS, look_at_calibration, map_cells, meeting_point
from shadowpuppet.cli.app import run
from shadowpuppet.geometry import rigid, rotation_from_vector
from shadowpuppet.io.calibration.calibration_files import read_calibration, rotated_up, write_calibration


@pytest.fixture(scope="module")
def rig():
    return made_rig.cameras(4, size=(640, 480))


@pytest.fixture
def path(tmp_path, rig):
    write_calibration(tmp_path / "c.toml", rig)
    return tmp_path / "c.toml"


def test_where_they_stand_and_what_they_look_at(path, rig):
    look, found = look_at_calibration(path)
    assert len(found.cameras) == 4
    np.testing.assert_allclose(look.middle, (0, 0, 0.9), atol=0.05)  # principal points are a little off the middle
    for told, camera in zip(look.cameras, rig):
        assert told.place == pytest.approx(camera.centre)
        assert told.away == pytest.approx(np.linalg.norm(camera.centre - look.middle))
        assert told.facing == pytest.approx(np.degrees(np.arctan2(-camera.centre[1], -camera.centre[0])), abs=1e-6)
        below = (camera.centre[2] - 0.9) / np.linalg.norm(camera.centre - (0, 0, 0.9))
        assert told.down == pytest.approx(np.degrees(np.arcsin(below)), abs=1e-6)
        assert told.roll == pytest.approx(0, abs=1e-6)
        assert told.fov[0] == pytest.approx(np.degrees(2 * np.arctan(320 / camera.matrix[0, 0])))
        assert (told.lens, told.bend) == ("pinhole", 0)
    assert look.doubts == ()


def test_a_roll_is_reported_clockwise(tmp_path, rig):
    """The camera turned clockwise about its axis: its right side goes down."""
    turned = replace(rig[0], T_camera_world=rigid(rotation_from_vector([0, 0, -np.radians(20)]), np.zeros(3)) @ rig[0].T_camera_world)
    assert (turned.T_camera_world[:3, :3].T @ [1, 0, 0])[2] < 0
    write_calibration(tmp_path / "c.toml", [turned, *rig[1:]])
    assert look_at_calibration(tmp_path / "c.toml")[0].cameras[0].roll == pytest.approx(20)


def test_the_map_counts_who_sees_a_person_whole(path, rig):
    look, _ = look_at_calibration(path)
    seen, places = np.array(look.seen), map_cells(look.corners)
    assert seen.shape == (MAP_COLUMNS // 2, MAP_COLUMNS)
    assert places[0, 0, 1] > places[-1, 0, 1]  # y up
    for row, column in np.ndindex(MAP_COLUMNS // 2, MAP_COLUMNS):
        x, y = places[row, column]
        pixels = [camera.project([[x, y, z] for z in (0, 0.9, 1.8)]) for camera in rig]
        assert seen[row, column] == sum(((p >= 0) & (p <= [639, 479])).all() for p in pixels)
    assert seen.max() > 0


@pytest.mark.parametrize(("up", "told"), [("y", "y"), ("-y", "-y"), ("x", "x")])
def test_a_world_that_is_not_upright_is_doubted_with_the_way_up(tmp_path, rig, up, told):
    back = {"y": "-y", "-y": "y", "x": "-x", "-x": "x"}[up]
    write_calibration(tmp_path / "c.toml", rotated_up(tuple(rig), back))
    (doubt, *_) = look_at_calibration(tmp_path / "c.toml")[0].doubts
    assert f"its direction {told} is" in doubt
    assert f"--up {told}" in doubt
    assert not any("not up" in doubt for doubt in look_at_calibration(tmp_path / "c.toml", up=told)[0].doubts)


def test_what_is_odd_is_doubted(tmp_path, rig):
    def doubts(cameras):
        write_calibration(tmp_path / "c.toml", cameras)
        return " | ".join(look_at_calibration(tmp_path / "c.toml")[0].doubts)

    def scaled(factor):
        return [replace(c, T_camera_world=rigid(c.T_camera_world[:3, :3], c.T_camera_world[:3, 3] * factor)) for c in rig]

    assert "is that in metres?" in doubts(scaled(20))
    assert "is that in metres?" in doubts(scaled(0.01))
    assert "stand at the same place" in doubts([rig[0], replace(rig[0], name="copy"), *rig[1:]])
    off = rig[0].matrix + np.array([[0, 0, 250], [0, 0, 0], [0, 0, 0]])
    assert "the principal point" in doubts([replace(rig[0], matrix=off), *rig[1:]])
    assert "turns back at" in doubts([replace(rig[0], distortion=np.array([-0.9, 0, 0, 0])), *rig[1:]])
    away = replace(rig[0], T_camera_world=rigid(rotation_from_vector([0, np.radians(70), 0]), np.zeros(3)) @ rig[0].T_camera_world)
    assert f"camera {rig[0].name!r} looks past" in doubts([away, *rig[1:]])
    lower = [replace(c, T_camera_world=c.T_camera_world @ rigid(np.eye(3), [0, 0, 3])) for c in rig]
    assert "below the floor" in doubts(lower)


def test_cameras_side_by_side_meet_nowhere(rig):
    beside = [replace(rig[0], name=f"c{n}", T_camera_world=rigid(np.eye(3), [n, 0, 0]) @ rig[0].T_camera_world) for n in range(3)]
    assert meeting_point(beside) is None
    assert meeting_point(rig[:1]) is None


def shown(capsys, *tokens) -> tuple[int, str, str]:
    code = run([str(token) for token in tokens])
    out = capsys.readouterr()
    assert "Traceback" not in out.err
    return code, out.out, out.err


def test_info_explains_any_calibration(tmp_path, capsys):
    made = calibrations.cameras()
    for name, path in calibrations.write_all(tmp_path, made).items():
        code, out, _ = shown(capsys, "info", path)
        assert code == 0, name
        assert "3 cameras" in out
        assert re.search(r"^A  \S+ +640x480", out, re.M)
        assert out.count("·") + len(re.findall(r"[0-9]", out)) > 200  # the top view
        assert "\x1b" not in out
    code, out, _ = shown(capsys, "info", tmp_path / "Calib.qca.txt", "--json")
    assert json.loads(out)["unit"] == "mm"


def test_info_writes_another_kind(tmp_path, capsys):
    made = calibrations.cameras()
    source = calibrations.write_all(tmp_path, made)["freemocap.toml"]
    for to in ("out.toml", "easymocap"):
        code, out, _ = shown(capsys, "info", source, "--to", tmp_path / to)
        assert code == 0
        assert "written" in out
        for a, b in zip(read_calibration(tmp_path / to), made, strict=True):
            np.testing.assert_allclose(a.centre, b.centre, atol=1e-9)
    code, _, _ = shown(capsys, "info", source, "--up", "-y", "--to", tmp_path / "up.toml")
    assert code == 0
    assert read_calibration(tmp_path / "up.toml")[0].centre[2] == pytest.approx(-made[0].centre[1])


@pytest.mark.parametrize(("tokens", "words"), [
    (["cameraIntrinsicsExtrinsics.pickle"], "is a pickle, as OpenCap"),
    (["anipose.toml", "--unit", "feet"], "unit: found 'feet'"),
    (["anipose.toml", "--up", "-q"], "up: found '-q'"),
    (["anipose.toml", "--to", "a.xml"], "expected NAME.toml"),
    (["notes.toml", "--unit", "mm"], "which is no calibration file"),
])
def test_what_cannot_be_explained_is_said(tmp_path, capsys, monkeypatch, tokens, words):
    calibrations.write_all(tmp_path, calibrations.cameras())
    (tmp_path / "notes.toml").write_text("eggs = 3\n")
    monkeypatch.chdir(tmp_path)
    code, _, err = shown(capsys, "info", *tokens)
    assert code == 2
    assert words in err
    assert len(err.strip().splitlines()) == 1


@pytest.mark.parametrize("turns", [(2, 2, 2, 2), (0, 2, 1, 0), (1, 0, 3, 0), (1, 1, 1, 1)])
def test_cameras_rolled_by_quarter_turns_say_nothing_against_z(tmp_path, rig, turns):
    def rolled(camera, quarters):
        roll = rotation_from_vector(np.array([0, 0, quarters * np.pi / 2]))
        return replace(camera, T_camera_world=rigid(roll, np.zeros(3)) @ camera.T_camera_world)

    write_calibration(tmp_path / "c.toml", [rolled(camera, quarters) for camera, quarters in zip(rig, turns)])
    assert not any("not up" in doubt for doubt in look_at_calibration(tmp_path / "c.toml")[0].doubts)
