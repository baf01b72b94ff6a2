"""`check --fix`: what is certain is written, old files are kept, and nothing is changed without a cause."""

from __future__ import annotations

import shutil
import tomllib
from dataclasses import replace

import made_rig
import numpy as np
import pytest

from shadowpuppet.calibration.silhouettes import silhouettes_of
from shadowpuppet.geometry import inverse, rigid, rotation_from_vector
from shadowpuppet.io.calibration.calibration_files import read_calibration, write_calibration
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.repair.check import SilhouetteSets, judge_calibration
from shadowpuppet.pipeline.repair.films import Checked
from shadowpuppet.pipeline.repair.fix import fix_recording, write_notes
from shadowpuppet.pipeline.rig import open_rig


@pytest.fixture(scope="module")
def masks(cameras):
    return made_rig.masks(cameras, 60)


@pytest.fixture
def copy(rig_recording, tmp_path):
    return shutil.copytree(rig_recording, tmp_path / "lab")


def sets_of(masks, late=(0, 0, 0, 0), frames=50):
    return SilhouetteSets([silhouettes_of([masks[8 + f - steps][k] for k, steps in enumerate(late)]) for f in range(frames)], 1)


def test_a_pushed_tripod_is_put_back(copy, cameras, masks):
    """One degree and five centimetres."""
    turn = rigid(rotation_from_vector(np.radians([0.6, 0.8, 0.0])), np.zeros(3)) @ cameras[1].T_camera_world
    turn[:3, 3] -= turn[:3, :3] @ [0.04, 0.03, 0.0]
    write_calibration(copy / "calibration.toml", [cameras[0], replace(cameras[1], T_camera_world=turn), *cameras[2:]])
    rig, sets = open_rig(copy, Options(masks=True)), sets_of(masks)
    check = judge_calibration(rig, sets)
    fix = fix_recording(rig, Checked(check, sets, sets))
    assert list(check.turns) == [cameras[1].name]
    _, before, after = fix.pixels[1]
    assert after is not None
    assert after < 0.5 < before
    if check.turns[cameras[1].name].turn.distance:
        assert "moved back by" in fix.done[0]


def test_a_late_film_and_a_turned_camera_are_mended(copy, cameras, masks):
    turn = rigid(rotation_from_vector(np.radians([0.0, 2.0, 0.0])), np.zeros(3))
    wrong = [replace(camera, T_camera_world=turn @ camera.T_camera_world) if n == 2 else camera for n, camera in enumerate(cameras)]
    write_calibration(copy / "calibration.toml", wrong)
    rig, sets = open_rig(copy, Options(masks=True)), sets_of(masks, (0, 4, 0, 0))
    fix = fix_recording(rig, Checked(judge_calibration(rig, sets), sets, sets))
    assert len(fix.done) == 2
    start = tomllib.loads((copy / "recording.toml").read_text())["start"]
    assert start == {cameras[1].name: pytest.approx(4 / rig.rate, abs=0.3 / rig.rate)}
    found = read_calibration(copy / "calibration.toml")[2]
    T = found.T_camera_world @ inverse(cameras[2].T_camera_world)
    assert np.degrees(np.arccos((np.trace(T[:3, :3]) - 1) / 2)) < 0.5
    assert (copy / "calibration.before1.toml").exists()
    name, before, after = fix.pixels[2]
    assert name == cameras[2].name
    assert before is not None
    assert after is not None
    assert after < 0.5 * before


def test_nothing_is_changed_in_a_good_recording_or_of_a_still_person(copy, masks):
    rig = open_rig(copy, Options(masks=True))
    before = (copy / "calibration.toml").read_bytes()
    for sets in (sets_of(masks), SilhouetteSets([silhouettes_of(masks[20])] * 50, 1)):
        found = judge_calibration(rig, sets)
        assert fix_recording(rig, Checked(found, sets, sets)).done == ()
    assert found.still
    assert (copy / "calibration.toml").read_bytes() == before
    assert not (copy / "calibration.before1.toml").exists()


def test_other_notes_stay_and_those_on_another_calibration_go(tmp_path):
    path = tmp_path / "recording.toml"
    path.write_text('unit = "mm"\ncalibration = "old.yml"\nrate = 30\n[start]\na = 1.0\nb = 2.0\n')
    assert write_notes(path, {"start": {"a": 0.5}, "calibration": None}) == [path, tmp_path / "recording.before1.toml"]
    assert tomllib.loads(path.read_text()) == {"rate": 30, "start": {"a": 0.5}}
    assert write_notes(path, {"start": {"a": 0.5}}) == []
