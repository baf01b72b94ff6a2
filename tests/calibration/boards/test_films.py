"""Films of a board: which files are films, when they are looked at, how fast corners move."""

from __future__ import annotations

from pathlib import Path

import boards
import numpy as np
import pytest

from shadowpuppet.calibration.boards import films
from shadowpuppet.calibration.boards.detection import View
from shadowpuppet.calibration.boards.films import LEAST_STEP, SAMPLES, _Facts, _velocity, films_in, read_films, view_at_rest
from shadowpuppet.errors import CalibrationError


def view(ids, pixels, time: float = 0.0) -> View:
    return View(time, np.array(ids, np.int64), np.array(pixels, float), 1.0)


def test_films_pictures_and_folders_of_pictures_are_named_by_their_cameras(tmp_path):
    for name in ("a.mp4", "b.jpg", "c/1.png", "c/note.txt", "empty/note.txt", "note.txt", ".hidden.mp4"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    assert films_in(tmp_path) == {"a": tmp_path / "a.mp4", "b": tmp_path / "b.jpg", "c": tmp_path / "c"}
    assert films_in(tmp_path / "nowhere") == {}
    (tmp_path / "a.png").touch()
    with pytest.raises(CalibrationError, match=r"found a\.mp4, a\.png for the camera 'a', expected one of them"):
        films_in(tmp_path)


def test_velocities_of_corners_are_their_own_or_the_others_mean():
    before = view([1, 2, 3, 4], [[0, 0], [10, 0], [20, 0], [30, 0]])
    after = view([4, 2, 9, 1], [[33, 0], [10, 1], [5, 5], [0, 2]])
    np.testing.assert_allclose(_velocity(before, after, 10.0), [[0, 20], [0, 10], [10, 10], [30, 0]])
    assert _velocity(before, view([1, 9], [[0, 2], [0, 0]]), 10.0) is None  # fewer than half
    assert _velocity(before, view([1, 2], [[0, 2], [10, 2]]), 10.0) is not None
    assert _velocity(before, None, 10.0) is None


def at_rest(ids, pixels: float = 0.0, time: float = 0.0) -> View:
    return view(ids, np.full((len(ids), 2), pixels), time)


def test_a_board_at_rest_is_the_median_of_its_views():
    views = [at_rest(range(12), 1.0, 3.0), at_rest(range(12), 2.0, 4.0), at_rest(range(20), 9.0, 5.0)]
    found = view_at_rest(views)
    assert found is not None
    assert found.time == 3.0
    np.testing.assert_array_equal(found.ids, np.arange(12))  # corners of half the views and more
    np.testing.assert_array_equal(found.pixels, 2.0)
    assert view_at_rest([]) is None
    few = view_at_rest([at_rest(range(0, 6)), at_rest(range(6, 12)), at_rest(range(12, 18))])
    assert few is not None
    assert len(few.ids) == 18
    half = view_at_rest([at_rest(range(8)), at_rest(range(16))])
    assert half is not None
    assert len(half.ids) == 16


class Board:
    """A film in which a corner moves by 2 pixels a second, and which ends; it has frames each 0.04 s."""

    def __init__(self, path: Path, size) -> None:
        self.end, self.shown = {"a": 3.0, "b": 40.0}[path.stem], np.nan

    def __enter__(self):
        return self

    def __exit__(self, *error) -> None:
        pass

    def at(self, time: float):
        self.shown = round(time * 25) / 25
        return np.full((2, 2), 2 * self.shown) if time < self.end else None

    @staticmethod
    def find(grey, time: float = -1.0) -> View:
        return view([5], [[grey[0, 0], 0.0]], time)


@pytest.fixture
def made(monkeypatch):
    monkeypatch.setattr(films, "_facts", lambda path: _Facts((2, 2), 25.0, {"a": 3.0, "b": 40.0}[path.stem]))
    monkeypatch.setattr(films, "Seeker", Board)
    monkeypatch.setattr(films, "BoardDetector", lambda board: Board)


def test_films_are_looked_at_at_the_same_times_of_the_session(made):
    told = []
    found = read_films({"a": Path("a.mp4"), "b": Path("b.mp4")}, boards.BOARD, {"a": 1.0, "b": -2.0}, True, lambda: told.append(1))
    assert len(told) == 2
    step = max(LEAST_STEP, 42.0 / SAMPLES)
    for name, start, end in (("a", 1.0, 3.0), ("b", -2.0, 40.0)):
        film = found[name]
        np.testing.assert_allclose(film.times, np.arange(0, 42.0, step))
        for time, each, speed in zip(film.times, film.views, film.velocities):
            if not 0 <= time + start < end:
                assert each is None
                assert speed is None
                continue
            assert each is not None
            assert each.time == time
            if round((time + start) * 25) / 25 + 1 / 25 < end:
                assert each.pixels[0, 0] == pytest.approx(2 * (time + start))  # as between frames
                np.testing.assert_allclose(speed, [[2, 0]], atol=1e-9)
            else:
                assert speed is None
    alone = read_films({"a": Path("a.mp4")}, boards.BOARD, {}, False)["a"]
    np.testing.assert_allclose(alone.times, np.arange(0, 3.0, max(LEAST_STEP, 3.0 / SAMPLES)))
    assert alone.velocities == (None,) * len(alone.times)
