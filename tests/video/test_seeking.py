"""Frames of a film at any time are those that reading it from the start gives."""

from __future__ import annotations

import av
import cv2
import numpy as np
import pytest
from films import encoded, pictures
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from made import write_film

from shadowpuppet.errors import VideoError
from shadowpuppet.video import open_frames, seeking
from shadowpuppet.video.seeking import Seeker

RATE, FRAMES, SIZE = 20.0, 70, (64, 48)


def numbered(n: int) -> np.ndarray:
    """A picture that tells its number, whatever compression does to it."""
    image = np.full((SIZE[1], SIZE[0], 3), 20, np.uint8)
    for bit in range(8):
        if n >> bit & 1:
            image[8:40, 8 * bit : 8 * bit + 7] = 230
    return image


def number_of(image: np.ndarray) -> int:
    return sum(1 << bit for bit in range(8) if image[10:38, 8 * bit + 1 : 8 * bit + 6].mean() > 125)


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    path = tmp_path_factory.mktemp("film") / "film.mp4"
    write_film(path, [numbered(n) for n in range(FRAMES)], RATE)
    return path


@given(st.lists(st.integers(0, FRAMES - 1), min_size=1, max_size=8))
@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_order_gives_the_frames_of_their_times(film, order):
    times = [frame.time for frame in open_frames(film)]
    with Seeker(film, SIZE) as seeker:
        assert [number_of(seeker.at(times[n])) for n in order] == order


def test_frames_that_are_passed_over_change_no_picture(tmp_path):
    """Of a film with frames that refer to others before and behind them."""
    path, shown = tmp_path / "film.mkv", np.random.default_rng(1).integers(0, 255, (SIZE[1], SIZE[0] + 60, 3)).astype(np.uint8)
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", round(RATE), options={"bf": "3", "g": "30", "crf": "30"})
        stream.width, stream.height, stream.pix_fmt = *SIZE, "yuv420p"
        for n in range(60):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(np.ascontiguousarray(shown[:, n : n + SIZE[0]]), "bgr24")))
        container.mux(stream.encode())
    frames = list(open_frames(path))
    with Seeker(path, SIZE) as seeker:
        for n in (17, 18, 27, 59, 3, 41):
            np.testing.assert_array_equal(seeker.at(frames[n].time), frames[n].image)


@pytest.mark.parametrize(("name", "interval", "seeks"), [("a.mp4", 300, 0), ("a.mp4", 40, 7), ("a.mkv", 300, 13), ("a.mkv", 40, 8)])
def test_a_film_is_decoded_on_where_no_key_frame_comes_between(tmp_path, monkeypatch, name, interval, seeks):
    """Matroska's index is read at the first seek, and ends with the last key frame: what comes behind it is not known."""
    path = encoded(tmp_path / name, pictures(300, SIZE), g=str(interval), sc_threshold="0", b_strategy="0", bf="3")
    frames, sought, seek = list(open_frames(path)), list[float](), seeking._Film._seek
    monkeypatch.setattr(seeking._Film, "_seek", lambda self, wanted: (sought.append(wanted), seek(self, wanted))[1])
    with Seeker(path, SIZE) as seeker:
        for n in range(0, 300, 22):
            np.testing.assert_array_equal(seeker.at(frames[n].time), frames[n].image)
    assert len(sought) == seeks


def test_between_two_frames_it_is_the_nearer_and_beyond_the_ends_none(film):
    with Seeker(film, SIZE) as seeker:
        assert number_of(seeker.at(10.4 / RATE)) == 10
        assert number_of(seeker.at(10.6 / RATE)) == 11
        assert seeker.at((FRAMES + 3) / RATE) is None
        assert number_of(seeker.at((FRAMES - 1) / RATE)) == FRAMES - 1
        assert seeker.at(1000.0) is None
        assert number_of(seeker.at(0.0)) == 0


def test_a_given_rate_counts_frames(film):
    with Seeker(film, SIZE, rate=2 * RATE) as seeker:
        assert [number_of(seeker.at(n / (2 * RATE))) for n in (40, 7, 69)] == [40, 7, 69]


def test_a_film_without_times_is_counted_from_the_start(film, tmp_path):
    import av

    raw = tmp_path / "film.h264"
    with av.open(str(film)) as source, av.open(str(raw), "w", format="h264") as target:
        stream = source.streams.video[0]
        copy = target.add_stream_from_template(stream)
        for packet in source.demux(stream):
            if packet.dts is not None:
                packet.stream = copy
                target.mux(packet)
    rate = open_frames(raw).rate
    with Seeker(raw, SIZE) as seeker:
        assert [number_of(seeker.at(n / rate)) for n in (5, 3, 40)] == [5, 3, 40]


def test_a_folder_and_a_picture(tmp_path):
    for n in (2, 10, 1):
        cv2.imwrite(str(tmp_path / f"{n}.png"), numbered(n))
    (tmp_path / "timestamps.txt").write_text("0\n0.5\n1.0\n")
    with Seeker(tmp_path, SIZE) as seeker:
        assert [number_of(seeker.at(time)) for time in (1.0, 0.1, 0.5)] == [10, 1, 2]
        assert seeker.at(9.0) is None
    with Seeker(tmp_path / "2.png", (32, 24)) as seeker:
        assert seeker.at(123.0).shape == (24, 32, 3)


def test_what_is_no_film_is_said(tmp_path):
    for name, data in (("a.mp4", b""), ("b.mp4", b"\x00" * 2000), ("c.png", b"none")):
        (tmp_path / name).write_bytes(data)
        with pytest.raises(VideoError, match=name):
            Seeker(tmp_path / name, SIZE)


def test_a_broken_film_gives_what_it_has(film, tmp_path):
    mkv = tmp_path / "film.mkv"
    write_film(mkv, [numbered(n) for n in range(FRAMES)], RATE, lossless=True)
    data = mkv.read_bytes()
    mkv.write_bytes(data[: len(data) // 2])
    with Seeker(mkv, SIZE) as seeker:
        assert number_of(seeker.at(5 / RATE)) == 5
        assert seeker.at((FRAMES - 1) / RATE) is None
        assert number_of(seeker.at(2 / RATE)) == 2
