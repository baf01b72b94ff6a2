"""Calibration sessions: folders of films or pictures in, a calibration, a page and sentences out."""

from __future__ import annotations

import shutil
from dataclasses import replace
from types import SimpleNamespace

import boards
import numpy as np
import pytest

from shadowpuppet.calibration import session as session_module
from shadowpuppet.calibration.boards.board import board_from, board_text
from shadowpuppet.calibration.session import calibrate, open_session
from shadowpuppet.calibration.solve.bundle import Bundle, Solved
from shadowpuppet.calibration.solve.placement import Placement
from shadowpuppet.cli.app import run
from shadowpuppet.errors import CalibrationError
from shadowpuppet.io.calibration.calibration_files import read_calibration, write_calibration

SIZE = (960, 720)


def rig():
    """Two cameras without distortion that see one side of the board."""
    made = boards.ring(2, spread=1.8)
    matrix = np.array([[930.0, 0, 482], [0, 933.0, 357], [0, 0, 1]])
    return [replace(camera, size=SIZE, matrix=matrix, distortion=np.zeros(4)) for camera in made]


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    return boards.pictured(tmp_path_factory.mktemp("session") / "lab", rig())


@pytest.fixture
def copy(lab, tmp_path):
    return shutil.copytree(lab, tmp_path / "lab")


def test_a_session_of_pictures(copy, capsys):
    (copy / "calibration.toml").write_text("old")
    assert run(["calibrate", str(copy)]) in (0, 1)
    found = read_calibration(copy / "calibration.toml")
    for true, camera in zip(rig(), found):
        assert camera.name == true.name
        assert abs(camera.matrix[0, 0] / true.matrix[0, 0] - 1) < 0.01
        assert np.linalg.norm(camera.centre - true.centre) < 0.05
    assert (copy / "calibration.before1.toml").read_text() == "old"
    page = (copy / "calibration.html").read_text()
    assert "What to film again" in page
    assert "<svg" in page
    assert "cam2" in capsys.readouterr().out


@pytest.mark.parametrize(("board", "said"), [(boards.BOARD, True), (board_from("checkerboard 8x5", 0.1), False)],
                         ids=["charuco", "checkerboard"])  # fmt: skip
def test_a_board_printed_inverted_needs_no_setting(tmp_path, capsys, board, said):
    lab = boards.pictured(tmp_path / "lab", rig(), 5, inverted=True, board=board)
    write_calibration(lab / "lenses.toml", rig())
    assert run(["calibrate", str(lab), "--lenses", str(lab / "lenses.toml")]) in (0, 1)
    for true, camera in zip(rig(), read_calibration(lab / "calibration.toml")):
        T = true.T_camera_world @ np.diag([-1, -1, 1, 1]) if board.kind == "checkerboard" else true.T_camera_world
        assert np.linalg.norm(camera.centre - replace(true, T_camera_world=T).centre) < 0.05
    sentence = "the board is printed inverted, black and white exchanged: found so by cam1, cam2"
    assert (sentence in " ".join(capsys.readouterr().out.split())) == said
    assert (sentence in (lab / "calibration.html").read_text()) == said


def test_a_board_printed_as_described_is_not_said_to_be_inverted(copy):
    found = calibrate(open_session(copy), {camera.name: camera for camera in rig()})
    assert not any("inverted" in note for note in found.notes)


def test_given_lenses_are_kept(copy):
    lenses = {camera.name: camera for camera in rig()}
    shutil.rmtree(copy / "intrinsics")
    found = calibrate(open_session(copy), lenses)
    for true, camera in zip(rig(), found.cameras):
        np.testing.assert_array_equal(camera.matrix, true.matrix)
        assert np.linalg.norm(camera.centre - true.centre) < 0.03


def test_a_mirrored_film_is_reported(copy):
    shutil.rmtree(copy)
    boards.pictured(copy, rig()[:1], 3, mirrored=True)
    with pytest.raises(CalibrationError, match="the film is mirrored"):
        calibrate(open_session(copy))


def test_another_board_than_was_filmed(copy):
    (copy / "board.toml").write_text(board_text(replace(boards.BOARD, dictionary="6X6_250", marker=0.0)))
    with pytest.raises(CalibrationError, match=r"found 0 different views .*is it the board that the settings describe"):
        calibrate(open_session(copy))


def test_a_board_that_looks_the_same_after_half_a_turn(copy):
    session = open_session(copy)
    lenses = {camera.name: camera for camera in rig()}
    board = replace(boards.BOARD, kind="checkerboard", dictionary="", marker=0.0)
    with pytest.raises(CalibrationError, match="looks the same after half a turn"):
        calibrate(replace(session, board=board), lenses)


@pytest.mark.parametrize(("change", "message"), [
    (lambda lab: (lab / "board.toml").unlink(), "board.toml is missing"),
    (lambda lab: shutil.rmtree(lab / "extrinsics" / "cam2") or shutil.rmtree(lab / "floor" / "cam2"), "has no film of cam2"),
    (lambda lab: (lab / "board.toml").write_text(board_text(boards.BOARD) + "[start]\ncam9 = 1.0"), "start: found 'cam9'"),
    (lambda lab: (lab / "board.toml").write_text(board_text(boards.BOARD) + "[start]\ncam1 = 'x'"), "start.cam1: found 'x'"),
    (lambda lab: [shutil.rmtree(lab / name) for name in ("intrinsics", "extrinsics", "floor")], "found no films"),
], ids=["board", "films", "start", "seconds", "nothing"])  # fmt: skip
def test_what_is_missing_is_named(copy, change, message):
    change(copy)
    with pytest.raises(CalibrationError, match=message):
        calibrate(open_session(copy))


def test_a_board_is_printed(tmp_path, capsys):
    assert run(["calibrate", "--print-board", str(tmp_path / "b.pdf"), "--board", "charuco 7x5", "--square", "0.04"]) == 0
    assert "A3" in capsys.readouterr().out
    assert run(["calibrate", "--print-board", str(tmp_path / "b.pdf")]) == 2
    assert run(["calibrate"]) == 2
    capsys.readouterr()
    assert run(["calibrate", "--print-board", str(tmp_path / "c.pdf"), "--board", "checkerboard 7x5"]) == 2
    assert "looks the same after half a turn" in (said := capsys.readouterr().err)
    assert "take one with an odd and an even number of squares, such as 8x5, or a ChArUco board" in said
    assert not (tmp_path / "c.pdf").exists()


@pytest.mark.parametrize(("late", "read_again"), [(0.1, True), (0.015, False)])
def test_films_that_begin_apart_are_read_again_in_step(copy, monkeypatch, late, read_again):
    begins, found = [], iter([late, 0.002])

    def read(films, board, starts, moving, advance):
        if moving:
            begins.append(dict(starts))
        return {name: SimpleNamespace(rate=25.0, size=SIZE, found=[]) for name in films}

    def placed(session, names, cameras, carried, laid):
        bundle = Bundle(tuple(cameras), np.eye(4)[None], np.array([0.0, next(found)]))
        return Placement(cameras=tuple(cameras), solved=Solved(bundle, *[np.zeros(0)] * 6), views=(), left_out=0, pairs=(), floor=True), []

    monkeypatch.setattr(session_module, "read_films", read)
    monkeypatch.setattr(session_module, "_placed", placed)
    monkeypatch.setattr(session_module, "place_advice", lambda placed, carried: [])
    session = replace(open_session(copy), starts={"cam1": 0.5})
    delays = calibrate(session, {camera.name: camera for camera in rig()}).placement.solved.bundle.delays
    np.testing.assert_allclose(delays, [0.0, late + 0.002 * read_again])
    assert begins == [{"cam1": 0.5}, *([{"cam1": 0.5, "cam2": late}] if read_again else [])]
