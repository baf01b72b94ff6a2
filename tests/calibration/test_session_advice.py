"""Which views of a session are used, and what is said of what was solved from them, for made figures."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import boards
import numpy as np
import pytest

from shadowpuppet.calibration import session as sessions
from shadowpuppet.calibration.boards.detection import View
from shadowpuppet.calibration.boards.films import BoardFilm
from shadowpuppet.calibration.session import _bad_fit, _narrow, _placed, delays_of, place_advice
from shadowpuppet.errors import CalibrationError

SPEED = np.ones((4, 2))


def view(time: float = 0.0, pixels=0.0, ids=range(12)) -> View:
    return View(time, np.array(ids, np.int64), np.zeros((len(ids), 2)) + pixels, 1.0)


def film(*views, rate: float = 25.0, speeds=None) -> BoardFilm:
    return BoardFilm(Path("a.mp4"), (960, 720), rate, np.arange(len(views)) / 5, views, speeds or (None,) * len(views))


@pytest.fixture
def given(monkeypatch):
    """What is given to the solver of places."""
    kept = []
    monkeypatch.setattr(sessions, "place_cameras", lambda *values: kept.append(values) or SimpleNamespace(floor=values[3]))
    session = SimpleNamespace(board=boards.BOARD, folder=Path("lab"))

    def place(carried, laid=None, names=("a", "b")):
        _, notes = _placed(session, names, (), carried, laid or {})
        return (*kept[-1][2:], notes)

    return place


def test_views_are_given_by_moment_with_their_speeds(given):
    first, second, third = view(0.0), view(0.2), view(0.4)
    moments, floor, speeds, notes = given({"a": film(first, None, third, speeds=(SPEED, None, 2 * SPEED)), "b": film(None, second, third)})
    assert moments == [{0: first}, {}, {0: third}]  # of a film only views of known speed
    assert [list(each) for each in speeds] == [[0], [], [0]]
    assert floor is None
    assert notes[0].startswith("no film of the board on the floor")
    moments, floor, speeds, notes = given({"a": film(first, None, rate=0.0), "b": film(first, second, third, rate=0.0)},
                                          {"b": film(first, first)})
    assert moments == [{0: first, 1: first}, {1: second}, {1: third}]  # of pictures all
    assert speeds is None
    assert list(floor) == [1]
    assert notes == []


def test_a_camera_without_a_film_is_named(given):
    with pytest.raises(CalibrationError, match="has no film of b, expected one of every camera"):
        given({"a": film(view())})
    _, floor, _, notes = given({"a": film(view(), rate=0.0)}, {"b": film(None)})
    assert floor is None
    assert notes[0] == "no camera finds the board in floor/: the floor is unknown"


def camera(name: str, centre=(0.0, 0, 0)):
    return SimpleNamespace(name=name, size=(2000, 1500), centre=np.array(centre, float))


def placement(residuals=(0.5, 0.5), delay=(0.0, 0.0), delay_sd=(0.0, 0.0), place=(0.0, 0.0), angle=(0.0, 0.0), cameras=None):
    cameras = cameras or (camera("a", (1, 0, 0)), camera("b", (0, 1, 0)))
    solved = SimpleNamespace(residuals=np.array([[each, 0.0] for each in residuals for _ in range(12)]), place_sd=place, angle_sd=angle,
                             delay_sd=delay_sd, bundle=SimpleNamespace(delays=delay, boards=np.eye(4)[None]))  # fmt: skip
    return SimpleNamespace(cameras=cameras, views=[(n, 0, view()) for n in range(len(residuals))], solved=solved)


FILMS = {"a": film(rate=25.0), "b": film(rate=50.0)}


def test_delays_are_told_in_frames():
    found = delays_of(placement(delay=(0.01, -0.02), delay_sd=(0.001, 0.0)), FILMS)
    assert found == {"a": (pytest.approx(0.25), pytest.approx(0.075))}
    assert delays_of(placement(delay=(0.01, 0.0), delay_sd=(0.001, 0.0)), {}) == {}


def advice(**figures) -> list[str]:
    return place_advice(placement(**figures), FILMS)


def test_what_is_doubtful():
    assert advice() == []
    assert advice(residuals=(1.99, 2.0)) == []  # a pixel of a picture 1000 wide
    (said,) = advice(residuals=(0.5, 2.01))
    assert said.startswith("camera 'b': the carried board is 2.0 pixels off where the other cameras have it (expected under 2)")
    (said,) = advice(residuals=(0.5,))
    assert said.startswith("camera 'b': none of its views of the board fits the others'")
    (said,) = advice(place=(0.0018, 0.0016))
    assert said.startswith("camera 'a': its place is known to 5 mm and its direction to 0.00 degrees only")
    (said,) = advice(angle=(np.radians(0.03), np.radians(0.04)))
    assert said.startswith("camera 'b': its place is known to 0 mm and its direction to 0.12 degrees only")
    (said,) = advice(delay=(0.0, 0.004), delay_sd=(0.0, 0.0001))
    assert said.startswith("the film of camera 'b' is 0.20 frames late (give or take 0.03); this is accounted for here")
    assert "0.20 frames early" in advice(delay=(0.0, -0.004), delay_sd=(0.0, 0.0001))[0]
    assert advice(delay=(0.0, 0.0029), delay_sd=(0.0, 0.0001)) == []
    assert advice(delay=(0.0, 0.004), delay_sd=(0.0, 0.0014)) == []  # not beyond its doubt


@pytest.mark.parametrize(("degrees", "said"), [(3.9, True), (4.1, False)])
def test_two_cameras_alone_stand_apart(degrees, said):
    turn = np.radians(degrees)
    pair = camera("a", (2, 0, 0)), camera("b", (2 * np.cos(turn), 2 * np.sin(turn), 0))
    found = _narrow(placement(cameras=pair))
    assert bool(found) == said
    if said:
        assert "(3.9 degrees apart, 0.14 m)" in found[0]
    assert _narrow(placement(cameras=(*pair, camera("c")))) == []


def test_a_lens_that_fits_badly():
    assert _bad_fit(SimpleNamespace(camera=camera("a"), rms=2.0)) is None
    assert "2.01 pixels of error (expected under 2)" in (_bad_fit(SimpleNamespace(camera=camera("a"), rms=2.01)) or "")
