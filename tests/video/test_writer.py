"""Written films: whole or readable up to the interruption, and never a half one under the final name."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from shadowpuppet.errors import VideoError
from shadowpuppet.video import open_frames, write_frames

KINDS = [("a.mp4", False), ("a.mkv", False), ("a.mkv", True)]


def noise(n, size=(64, 48)):
    rng = np.random.default_rng(7)
    return [rng.integers(0, 256, (size[1], size[0], 3), np.uint8) for _ in range(n)]


def write(path, images, *, lossless=False, error=None):
    with write_frames(path, 10, lossless=lossless) as film:
        for image in images:
            film.write(image)
        if error is not None:
            raise error


def names(folder):
    return sorted(path.name for path in folder.iterdir())


@pytest.mark.parametrize(("name", "lossless"), KINDS)
def test_a_film_gets_its_name_when_it_is_whole(tmp_path, name, lossless):
    with write_frames(tmp_path / name, 10, lossless=lossless) as film:
        for image in noise(30):
            film.write(image)
        assert names(tmp_path) == [film.partial.name]
    assert names(tmp_path) == [name]
    assert len(list(open_frames(tmp_path / name))) == 30


@pytest.mark.parametrize(("name", "lossless"), KINDS)
@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError])
def test_an_interrupted_film_keeps_every_frame_and_replaces_nothing(tmp_path, name, lossless, error):
    (tmp_path / name).write_bytes(b"the film of yesterday")
    with pytest.raises(error):
        write(tmp_path / name, noise(25), lossless=lossless, error=error)
    assert (tmp_path / name).read_bytes() == b"the film of yesterday"
    assert len(list(open_frames(tmp_path / f"a.part{name[1:]}"))) == 25


KILLED = """
import os, signal, sys
import numpy as np
from shadowpuppet.video import write_frames
image = np.random.default_rng(1).integers(0, 256, (48, 64, 3), np.uint8)
with write_frames(sys.argv[1], 10, lossless=sys.argv[2] == "True") as film:
    for i in range(100):
        film.write(np.roll(image, i, 0))
    os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.parametrize(("name", "lossless"), KINDS)
def test_ctrl_c_within_the_encoder_keeps_the_frames_before(tmp_path, name, lossless, monkeypatch):
    film = write_frames(tmp_path / name, 10, lossless=lossless)
    with pytest.raises(KeyboardInterrupt):
        write_until_ctrl_c(film, monkeypatch)
    assert len(list(open_frames(film.partial))) == 20


def write_until_ctrl_c(film, monkeypatch):
    with film:
        for image in noise(20):
            film.write(image)
        encode = film._stream.encode
        monkeypatch.setattr(film, "_stream", SimpleNamespace(encode=lambda frame: encode(frame) if frame is None else ctrl_c()))
        film.write(noise(1)[0])


def ctrl_c():
    raise KeyboardInterrupt


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="this system has no SIGKILL")
@pytest.mark.parametrize(("name", "lossless"), KINDS[::2])
def test_a_killed_program_leaves_a_film_that_can_be_played(tmp_path, name, lossless):
    subprocess.run([sys.executable, "-c", KILLED, str(tmp_path / name), str(lossless)], check=False)
    partial = tmp_path / f"a.part{name[1:]}"
    assert names(tmp_path) == [partial.name]
    source = open_frames(partial)
    assert source.count is None
    assert 60 <= len(list(source)) <= 100


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="this system has no /dev/full")
@pytest.mark.parametrize(("name", "lossless"), KINDS)
def test_a_full_disk_is_said(tmp_path, name, lossless):
    (tmp_path / f"a.part{name[1:]}").symlink_to("/dev/full")
    with pytest.raises(VideoError, match=rf"{name}: the film cannot be written \(no space left on device\)"):
        write(tmp_path / name, noise(60), lossless=lossless)
    assert not (tmp_path / name).exists()


def test_after_a_failure_nothing_more_is_written(tmp_path):
    film = write_frames(tmp_path / "a.mkv", 10, lossless=True)
    film.write(noise(1)[0])
    container = film._container
    calls = []

    def mux(packets):
        calls.append(packets)
        raise OSError(28, "No space left on device")

    film._container = SimpleNamespace(mux=mux, close=container.close)
    with pytest.raises(VideoError, match=r"what was written so far is in a.part.mkv"), film:
        film.write(noise(1)[0])
    assert len(calls) == 1
    assert len(list(open_frames(film.partial))) == 1


def test_the_first_picture_says_whether_a_film_is_grey(tmp_path):
    grey = [image[..., 0] for image in noise(3)]
    for name, lossless in KINDS:
        write(tmp_path / name, grey, lossless=lossless)
        colours = [frame.image for frame in open_frames(tmp_path / name)]
        assert all((image == image[..., :1]).all() for image in colours)


def test_pictures_are_scaled_to_a_given_size(tmp_path):
    with write_frames(tmp_path / "a.mkv", 10, size=(32, 24), lossless=True) as film:
        film.write(np.full((48, 64), 9, np.uint8))
        film.write(np.full((24, 32), 9, np.uint8))
    assert open_frames(tmp_path / "a.mkv").size == (32, 24)


def test_by_one_thread_a_film_is_the_same_whatever_the_memory_held_before(tmp_path):
    """libx264's look-ahead of blocks (mbtree) reads what its allocator leaves, with AVX-512 and pictures that are not wide."""
    rng, films = np.random.default_rng(7), []
    waves = 100 + 90 * np.sin(np.arange(80)[None, :, None] / 9 + np.arange(60)[:, None, None] / 7 + np.arange(3))
    images = [np.clip(np.roll(waves, 2 * n, 1) + rng.normal(0, 2, waves.shape), 0, 255).astype(np.uint8) for n in range(15)]
    for _ in range(60):
        rubbish = [np.full(rng.integers(1, 300_000), rng.random()) for _ in range(rng.integers(8))]
        with write_frames(tmp_path / "a.mp4", 4, threads=1) as film:
            for image in images:
                film.write(image)
        films.append((tmp_path / "a.mp4").read_bytes())
        del rubbish
    assert len(set(films)) == 1


def test_colours_are_those_that_players_show(tmp_path):
    import av

    write(tmp_path / "a.mp4", [np.full((48, 64, 3), (30, 60, 200), np.uint8)])
    with av.open(str(tmp_path / "a.mp4")) as container:
        context = container.streams.video[0].codec_context
        assert (context.colorspace, context.color_range, context.pix_fmt) == (6, 1, "yuv420p")
    frame, = open_frames(tmp_path / "a.mp4")
    assert np.abs(frame.image.astype(int) - (30, 60, 200)).max() < 6


@pytest.mark.parametrize("rate", [0.5, 15, 29.97, 30000 / 1001, 60, 240])
def test_the_rate_is_kept(tmp_path, rate):
    with write_frames(tmp_path / "a.mp4", rate) as film:
        for image in noise(5):
            film.write(image)
    source = open_frames(tmp_path / "a.mp4")
    assert source.rate == pytest.approx(rate, rel=1e-5)
    np.testing.assert_allclose([frame.time for frame in source], np.arange(5) / rate, rtol=1e-5)


@pytest.mark.parametrize(("name", "rate", "lossless", "said"), [
    ("a.avi", 10, False, "found the ending '.avi', a film is written to .mkv or .mov or .mp4"),
    ("a.mp4", 10, True, "found the ending '.mp4', a lossless film is written to .mkv"),
    ("a.mp4", 0, False, "rate: found 0"),
    ("a.mp4", float("nan"), False, "rate: found nan"),
])
def test_what_cannot_be_written_is_said(tmp_path, name, rate, lossless, said):
    with pytest.raises(VideoError, match=said):
        write_frames(tmp_path / name, rate, lossless=lossless)


def test_bad_pictures_and_bad_places_are_said(tmp_path):
    image = noise(1)[0]
    film = write_frames(tmp_path / "nowhere" / "a.mp4", 10)
    with pytest.raises(VideoError, match="no such file or directory"):
        film.write(image)  # not many pictures later, when the encoder gives its first
    with pytest.raises(VideoError, match="no frame was given"):
        write(tmp_path / "a.mp4", [])
    with pytest.raises(VideoError, match=r"picture 1 has the shape \(48, 64\), those before it \(48, 64, 3\)"):
        write(tmp_path / "a.mp4", [image, image[..., 0]])
    with pytest.raises(VideoError, match="found a picture of float64"):
        write(tmp_path / "a.mp4", [image / 255])


def test_importing_it_loads_no_codec():
    code = "import sys, shadowpuppet.video; print([m for m in ('av', 'cv2') if m in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip() == "[]"
