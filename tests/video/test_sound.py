"""The sound of films: on the clock of the pictures, mixed to one channel, and none where there is none."""

from __future__ import annotations

import noises
import numpy as np
import pytest

from shadowpuppet.errors import VideoError
from shadowpuppet.video import write_frames
from shadowpuppet.video.sound import read_sound

RATE = 16000


@pytest.fixture
def film(tmp_path):
    with write_frames(tmp_path / "a.mp4", 20) as writer:
        for _ in range(40):
            writer.write(np.full((24, 32), 100, np.uint8))
    return tmp_path / "a.mp4"


@pytest.mark.parametrize("codec", ["aac", "mp2"])
def test_a_click_is_where_it_was(film, codec):
    samples = np.zeros(2 * RATE)
    samples[RATE : RATE + 40] = 0.8
    noises.add_sound(film, samples, RATE, codec)
    found = read_sound(film, 8000, 10.0)
    assert found.rate == 8000
    assert found.begin + np.argmax(np.abs(found.samples)) / 8000 == pytest.approx(1.0, abs=0.03 if codec == "mp2" else 0.004)
    assert len(found.samples) / 8000 == pytest.approx(2.0, abs=0.2)


@pytest.mark.parametrize("late", [-0.4, 0.0, 0.6])
def test_a_sound_s_begin_is_counted_from_the_first_picture(film, late):
    samples = np.zeros(3 * RATE)
    samples[RATE : RATE + 40] = 0.8
    noises.add_sound(film, samples, RATE, late=late)
    found = read_sound(film, 8000, 10.0)
    assert found.begin + np.argmax(np.abs(found.samples)) / 8000 == pytest.approx(1.0 + late, abs=0.004)


def test_only_the_beginning_is_read(film):
    noises.add_sound(film, 0.1 * np.random.default_rng(1).standard_normal(2 * RATE), RATE)
    assert len(read_sound(film, 8000, 0.5).samples) == 4000


def test_a_film_without_sound_has_none(film):
    assert read_sound(film, 8000, 10.0) is None


def test_a_damaged_film_s_sound_ends_at_the_break(film, tmp_path):
    noises.add_sound(film, 0.1 * np.random.default_rng(1).standard_normal(2 * RATE), RATE)
    data = bytearray(film.read_bytes())
    data[len(data) // 2 : len(data) // 2 + 400] = bytes(400)
    (tmp_path / "b.mp4").write_bytes(data)
    found = read_sound(tmp_path / "b.mp4", 8000, 10.0)
    assert found is None or np.isfinite(found.samples).all()


def test_what_is_no_film_is_reported(tmp_path):
    (tmp_path / "a.mp4").write_text("no film")
    with pytest.raises(VideoError):
        read_sound(tmp_path / "a.mp4", 8000, 1.0)
