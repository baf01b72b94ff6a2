"""Timecodes of films, whole and dropping frames, in the containers that cameras write."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from timecodes import add_timecode

from shadowpuppet.errors import VideoError
from shadowpuppet.video import write_frames
from shadowpuppet.video.timecode import read_timecode, seconds_of


@pytest.fixture
def film(tmp_path):
    with write_frames(tmp_path / "a.mp4", 25) as writer:
        for _ in range(10):
            writer.write(np.full((24, 32), 100, np.uint8))
    return tmp_path / "a.mp4"


@pytest.mark.parametrize("suffix", [".mp4", ".mov", ".mkv"])
def test_a_film_says_when_it_began(film, suffix):
    assert read_timecode(film) is None
    assert read_timecode(add_timecode(film, "10:02:45:12", suffix)) == pytest.approx(36165 + 12 / 25)


def test_a_film_that_cannot_be_opened_is_an_error(tmp_path):
    (tmp_path / "a.mov").write_bytes(b"nothing")
    with pytest.raises(VideoError):
        read_timecode(tmp_path / "a.mov")


@pytest.mark.parametrize("text", ["", "10:02:45", "10:62:00:00", "25:00:00:00", "10:00:00:25", "now", "-1:00:00:00"])
def test_what_is_no_timecode_has_no_seconds(text):
    assert seconds_of(text, 25.0) is None


@given(st.integers(0, 24 * 3600 - 1), st.sampled_from([30000 / 1001, 60000 / 1001]))
def test_timecodes_that_drop_frames_keep_the_time_of_day(second, rate):
    """That is what they are for: a day's end is 86 ms off."""
    hours, minutes, seconds = second // 3600, second // 60 % 60, second % 60
    dropped = round(rate / 15) if seconds == 0 and minutes % 10 else 0  # numbers that do not occur
    text = f"{hours:02}:{minutes:02}:{seconds:02};{dropped:02}"
    assert seconds_of(text, rate) == pytest.approx(second + dropped / rate, abs=0.15)


def test_timecodes_that_drop_none_fall_behind():
    assert seconds_of("01:00:00:00", 30000 / 1001) == pytest.approx(3603.6)
