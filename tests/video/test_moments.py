"""Moments of a film as users write them, and films from one moment to another."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shadowpuppet.errors import SettingsError
from shadowpuppet.video import open_frames, write_frames, write_image
from shadowpuppet.video.live_source import open_feed
from shadowpuppet.video.moments import moment_text, read_moment, span_of


@pytest.mark.parametrize(("text", "seconds"),
                         [("3.5", 3.5), ("3.5s", 3.5), (" .5 ", 0.5), (3, 3.0), (0.25, 0.25), ("120f", 4.0), ("0f", 0.0)])
def test_moments_are_seconds_or_frames(text, seconds):
    assert read_moment(text).seconds(30.0) == pytest.approx(seconds)


@pytest.mark.parametrize("text", ["", "x", "-1", "1.5f", "3 min", "1e3", "nan", "inf", True, None, "9999999", "1:30"])
def test_anything_else_is_refused_with_what_is_possible(text):
    with pytest.raises(ValueError, match=r"expected seconds such as 3.5, or frames such as 120f"):
        read_moment(text)


@given(st.floats(0, 1e5).map(lambda x: round(x, 3)))
def test_texts_of_moments_are_read_back(number):
    assert read_moment(moment_text(number)).number == pytest.approx(number, abs=1e-3)
    assert moment_text(moment_text(number)) == moment_text(number)
    assert moment_text(f"{int(number)}f") == f"{int(number)}f"


def test_frames_need_a_rate():
    with pytest.raises(SettingsError, match=r"start: found 12f; the film does not state its frames/s"):
        span_of("12f", None, math.nan, math.nan)


def test_a_span_lies_within_its_film():
    assert span_of(None, None, 25.0, 10.0) == (0.0, math.inf)
    assert span_of("50f", "3", 25.0, 10.0) == (2.0, 3.0)
    assert span_of("5", None, 25.0, math.nan) == (5.0, math.inf)
    with pytest.raises(SettingsError, match=r"end: found 50f, 2 s, expected a moment after the start, 3 s"):
        span_of("3", "50f", 25.0, 10.0)
    with pytest.raises(SettingsError, match=r"start: found 10, 10 s, expected a moment before the film's end, 10.000 s"):
        span_of("10", None, 25.0, 10.0)


def counted(n: int) -> list[np.ndarray]:
    return [np.full((16, 16, 3), 10 * i, np.uint8) for i in range(n)]


@pytest.fixture(params=["film", "folder"])
def source(request, tmp_path):
    """Twelve pictures at 10 frames/s."""
    if request.param == "film":
        with write_frames(tmp_path / "a.mkv", 10.0, lossless=True) as out:
            for image in counted(12):
                out.write(image)
        return tmp_path / "a.mkv"
    (tmp_path / "a").mkdir()
    for n, image in enumerate(counted(12)):
        write_image(tmp_path / "a" / f"{n}.png", image)
    (tmp_path / "a" / "timestamps.txt").write_text("\n".join(f"{n / 10}" for n in range(12)))
    return tmp_path / "a"


@pytest.mark.parametrize("size", [None, (8, 8)])
def test_a_film_read_from_a_moment_on_gives_the_same_frames_at_the_same_times(source, size):
    film = open_frames(source, size=size)
    whole = list(film)
    for begin in (0.0, 0.25, 0.7, 1.1, 2.0):
        part = list(film.read(lambda time, begin=begin: time >= begin))
        assert [frame.time for frame in part] == [frame.time for frame in whole if frame.time >= begin]
        for one, other in zip(part, whole[len(whole) - len(part) :], strict=True):
            np.testing.assert_array_equal(one.image, other.image)
    assert [round(frame.time, 6) for frame in film.between(0.3, 0.6)] == [0.3, 0.4, 0.5]


def test_a_film_is_played_from_one_moment_to_another(source):
    shots = list(open_feed(source, speed=100.0, start="3f", end="0.6").read())
    assert [shot.shown for shot in shots] == pytest.approx([0.3, 0.4, 0.5])


@pytest.mark.parametrize("camera", ["0", "rtsp://door/1"])
def test_a_live_camera_has_no_moments(camera):
    with pytest.raises(SettingsError, match="expected them with a film only"):
        open_feed(camera, start="3")
