"""`calibrate --from-person`: cameras placed by a walking person, with height and floor; what is written, and what is doubted."""

from __future__ import annotations

import shutil
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import made_rig
import numpy as np
import pytest

from shadowpuppet.cli.app import run
from shadowpuppet.errors import CalibrationError
from shadowpuppet.geometry import rigid, rotation_from_vector, unit
from shadowpuppet.io.calibration.calibration_files import read_calibration, write_calibration
from shadowpuppet.pipeline.options import make_options
from shadowpuppet.pipeline.repair.placing import _above, _Ends, _floor, check_placed, place_cameras, write_placed
from shadowpuppet.pipeline.rig import open_rig

TALL = 1.73
"""Height of the made person, metres: from the legs' lower ends to the crown."""
GROWN, TILT = 1.15, np.radians(2.0)


def moved(camera, rng):
    """A camera turned by 2 degrees and moved by 8 cm, in a world that is too large and tilted."""
    turn, move = np.radians(2.0) * unit(rng.normal(size=3)), 0.08 * unit(rng.normal(size=3))
    tilted = rotation_from_vector([TILT, 0.0, 0.0])
    R = rotation_from_vector(turn) @ camera.T_camera_world[:3, :3] @ tilted.T
    return replace(camera, T_camera_world=rigid(R, -R @ (GROWN * tilted @ (camera.centre + move))))


@pytest.fixture(scope="module")
def lab(rig_recording, tmp_path_factory):
    """The recording of a walking person with a rough calibration, and the exact one."""
    folder = tmp_path_factory.mktemp("placing") / "lab"
    shutil.copytree(rig_recording, folder)
    exact, rng = read_calibration(folder / "calibration.toml"), np.random.default_rng(2)
    write_calibration(folder / "calibration.toml", [moved(camera, rng) for camera in exact])
    return folder, exact


@pytest.fixture(scope="module")
def placed(lab):
    options = make_options({"masks": True, "height": TALL})
    return place_cameras(open_rig(lab[0], options), options)


def test_places_and_scale_are_the_true_ones(lab, placed):
    exact = lab[1]
    assert placed.scale == pytest.approx(1 / GROWN, rel=0.04)
    for a, b in ((0, 1), (0, 2), (1, 3)):
        apart, true = (np.linalg.norm(cameras[a].centre - cameras[b].centre) for cameras in (placed.cameras, exact))
        assert apart == pytest.approx(true, rel=0.04)
    assert (placed.fit.after < 0.5).all()


def ends(rng, along, tilt=TILT, height=0.3):
    """The ends of hulls of a person who walks over a floor that is tilted about x and lies at a height, with feet lifted now and then."""
    ground = np.column_stack([along, np.tan(tilt) * along[:, 1] + height])
    bottom = ground + np.column_stack([np.zeros((len(along), 2)), rng.normal(0, 0.005, len(along)) + 0.3 * (rng.random(len(along)) < 0.05)])
    return _Ends(bottom, ground + np.array([0, 0, 1.75]))


def test_the_floor_is_the_plane_that_feet_stand_on(rng):
    found = ends(rng, rng.uniform(-1.5, 1.5, (80, 2)))
    level, tilt = _floor(found)
    assert tilt == pytest.approx(TILT, abs=np.radians(0.3))
    assert np.median(np.abs(_above(level, found.bottom))) < 0.01
    np.testing.assert_allclose(level[:3, :3] @ level[:3, :3].T, np.eye(3), atol=1e-12)
    x, y = (found.bottom - found.bottom.mean(0))[:, :2].T
    turned = found.bottom @ level[:3, :3].T
    assert np.corrcoef(x, turned[:, 0])[0, 1] > 0.999  # the world keeps its heading
    assert np.corrcoef(y, turned[:, 1])[0, 1] > 0.999


def test_where_nobody_walks_the_rough_vertical_stays(rng):
    at = np.column_stack([rng.uniform(-1.5, 1.5, 80), np.zeros(80)])  # along x: the tilt about x cannot be seen
    level, tilt = _floor(ends(rng, at))
    assert tilt < np.radians(0.5)
    assert np.median(np.abs(_above(level, ends(rng, at).bottom))) < 0.02


def test_without_a_height_the_scale_stays_and_it_is_said(lab):
    options = make_options({"masks": True})
    found = place_cameras(open_rig(lab[0], options), options)
    assert found.scale == 1
    assert any("state the person's --height" in sentence for sentence in found.advice)


def test_the_calibration_is_written_and_the_old_one_kept(lab, placed, tmp_path):
    folder = shutil.copytree(lab[0], tmp_path / "lab")
    rig = open_rig(folder, make_options({"masks": True}))
    written = write_placed(rig, placed)
    assert [path.name for path in written][:2] == ["calibration.toml", "calibration.before1.toml"]
    for camera, found in zip(read_calibration(folder / "calibration.toml"), placed.cameras):
        np.testing.assert_allclose(camera.T_camera_world, found.T_camera_world, atol=1e-6)
    other = write_placed(rig, placed, tmp_path / "other.toml")
    assert other == [tmp_path / "other.toml"]
    with pytest.raises(CalibrationError, match="its folder does not exist"):
        write_placed(rig, placed, tmp_path / "nowhere" / "c.toml")


def test_the_command_shows_what_it_did(lab, tmp_path, capsys):
    folder = shutil.copytree(lab[0], tmp_path / "lab")
    code = run(["calibrate", str(folder), "--from-person", "--masks", "--height", str(TALL), "-o", str(tmp_path / "new.toml")])
    said, warned = capsys.readouterr()
    assert code in (0, 1), warned
    for word in ("moved", "turned", "tangents", "new.toml", *(camera.name for camera in lab[1])):
        assert word in said
    assert len(read_calibration(tmp_path / "new.toml")) == len(lab[1])


def test_that_the_height_is_missing_is_said_before_anything_is_written(lab, tmp_path, monkeypatch, capsys):
    def stopped(*_):
        raise CalibrationError("stopped")

    monkeypatch.setattr("shadowpuppet.pipeline.repair.placing.place_cameras", stopped)
    for told in ([], ["--height", "1.8"]):
        assert run(["calibrate", str(lab[0]), "--from-person", "--masks", *told]) == 2
        assert ("warning: the scale is the rough calibration's" in capsys.readouterr().err) == (not told)
    alone = shutil.copytree(lab[0], tmp_path / "alone")
    (alone / "calibration.toml").unlink()
    for film in sorted((alone / "video").iterdir())[1:]:
        film.unlink()
    assert run(["calibrate", str(alone), "--from-person"]) == 2
    assert "alone: found one camera, expected two or more" in capsys.readouterr().err


def test_a_recording_without_calibration_is_placed_from_rough_toml(lab, tmp_path, capsys):
    folder, exact = shutil.copytree(lab[0], tmp_path / "lab"), lab[1]
    (folder / "calibration.toml").unlink()
    command = ["calibrate", str(folder), "--from-person", "--masks", "--height", str(TALL)]
    assert run(command) == 2
    said = capsys.readouterr().err
    assert f"{folder / 'rough.toml'}: no such file, expected one that says where the cameras stand" in said
    assert "such as [cam1] with the three lines at = [2.5, -3.0, 1.4], toward = [0.0, 0.0, 1.0], fov = 65" in said
    assert f"`shadowpuppet calibrate {folder} --from-person --height METRES`" in said
    lines = []
    for camera in exact:
        ahead = camera.centre + 3 * camera.T_camera_world[2, :3] + np.array([0.1, 0, 0])
        at, toward = (", ".join(f"{value:.2f}" for value in point) for point in (camera.centre + np.array([0, 0.1, 0.05]), ahead))
        degrees = np.degrees(2 * np.arctan(camera.size[0] / 2 / camera.matrix[0, 0]))
        lines.append(f"[{camera.name}]\nat = [{at}]\ntoward = [{toward}]\nfov = {degrees:.2f}\n")
    (folder / "rough.toml").write_text("".join(lines[:-1]))
    assert run(command) == 2
    said = capsys.readouterr().err
    assert f"rough.toml: found no section of {exact[-1].name}, expected one for each film, such as [{exact[-1].name}]" in said
    assert "--camera" not in said
    (folder / "rough.toml").write_text("".join(lines))
    assert run(command) in (0, 1)
    assert "field of view" in capsys.readouterr().out
    found = read_calibration(folder / "calibration.toml")
    for a, b in ((0, 1), (0, 2), (1, 3)):
        apart, true = (np.linalg.norm(cameras[a].centre - cameras[b].centre) for cameras in (found, exact))
        assert apart == pytest.approx(true, rel=0.05)
    for camera, true in zip(found, exact):
        assert camera.matrix[0, 0] == pytest.approx(true.matrix[0, 0], rel=0.05)
        assert abs(camera.matrix[0, 0] / true.matrix[0, 0] - 1) > 1e-5  # it was solved, not copied


@pytest.mark.whole
def test_silent_films_that_begin_apart_are_put_in_step_while_cameras_are_placed(tmp_path):
    exact, late, frames = made_rig.cameras(), (0, 4, 0, -3), 80
    seen = made_rig.masks(exact, frames + 20)
    folder = made_rig.write(tmp_path, exact, made_rig.shifted(seen, late, frames))
    rng = np.random.default_rng(5)
    write_calibration(folder / "calibration.toml", [moved(camera, rng) for camera in exact])
    options = make_options({"masks": True, "height": TALL})
    rig = open_rig(folder, options)
    placed = place_cameras(rig, options)
    found = np.array([placed.starts[camera.name] for camera in exact]) * made_rig.RATE
    np.testing.assert_allclose(found - found.min(), np.array(late) + 3, atol=0.3)
    assert np.nanmax(placed.fit.after) < 0.6
    for a, b in ((0, 1), (0, 2), (1, 3)):
        apart, true = (np.linalg.norm(cameras[a].centre - cameras[b].centre) for cameras in (placed.cameras, exact))
        assert apart == pytest.approx(true, rel=0.04)
    written = write_placed(rig, placed)
    assert folder / "recording.toml" in written
    assert place_cameras(open_rig(folder, options), options).starts == {}  # in step now


def test_a_single_camera_is_refused(lab):
    options = make_options({"masks": True})
    rig = open_rig(lab[0], options)
    with pytest.raises(CalibrationError, match="lab: found one camera, expected two or more"):
        place_cameras(replace(rig, footage=rig.footage[:1]), options)


def test_a_camera_without_a_place_is_refused(lab):
    options = make_options({"masks": True})
    unknown: Any = SimpleNamespace(cameras=[replace(camera, oriented=False) for camera in open_rig(lab[0], options).cameras])
    with pytest.raises(CalibrationError, match="camera 'cam1': found only a field of view, expected also where it stands, roughly"):
        place_cameras(unknown, options)


def test_cameras_whose_tangents_do_not_fit_are_not_placed(placed):
    check_placed(replace(placed.fit, far=0.4))
    with pytest.raises(CalibrationError, match=r"74 % of the tangents do not fit wherever the cameras stand, so none is placed"):
        check_placed(replace(placed.fit, far=0.74))
