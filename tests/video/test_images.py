"""Pictures, folders of them, and live cameras as sources of frames."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
import pytest

from shadowpuppet.errors import ShadowPuppetWarning, VideoError
from shadowpuppet.video import open_frames, read_image, write_image

SIZE = (32, 24)


@pytest.fixture
def colours(rng):
    return rng.integers(0, 256, (24, 32, 3), np.uint8)


@pytest.fixture
def folder(tmp_path, rng):
    """Twelve pictures 1.png to 12.png of which number i is grey level i."""
    path = tmp_path / "take"
    path.mkdir()
    for i in range(1, 13):
        write_image(path / f"{i}.png", np.full((24, 32), i, np.uint8))
    return path


@pytest.mark.parametrize("name", ["a.png", "a.bmp", "a.tif", "ein Bild – 写真.PNG"])
def test_pictures_come_back_bit_by_bit(tmp_path, colours, name):
    write_image(tmp_path / name, colours)
    np.testing.assert_array_equal(read_image(tmp_path / name), colours)
    write_image(tmp_path / name, colours[..., 0])
    np.testing.assert_array_equal(read_image(tmp_path / name, grey=True), colours[..., 0])
    np.testing.assert_array_equal(read_image(tmp_path / name), np.stack([colours[..., 0]] * 3, -1))
    assert [p.name for p in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("name", ["a.jpg", "a.webp"])
def test_lossy_pictures_come_back_nearly(tmp_path, name):
    image = np.tile(np.linspace(40, 200, 32).astype(np.uint8)[:, None], (24, 1, 3))
    write_image(tmp_path / name, image)
    assert np.abs(read_image(tmp_path / name).astype(int) - image).max() < 12


def test_sixteen_bit_pictures_and_transparent_ones_become_plain(tmp_path):
    import cv2

    for name, image in (("deep.png", np.full((4, 5), 200 * 257, np.uint16)), ("clear.png", np.full((4, 5, 4), 200, np.uint8))):
        (tmp_path / name).write_bytes(cv2.imencode(".png", image)[1].tobytes())
        found = read_image(tmp_path / name)
        assert (found.shape, found.dtype) == ((4, 5, 3), np.uint8)
        assert (found == 200).all()


@pytest.mark.parametrize(("shape", "kind"), [
    ((4, 4, 4), "uint8"), ((4, 4), "float64"), ((0, 4), "uint8"), ((4,), "uint8"), ((4, 4), "bool"),
])
def test_arrays_that_are_no_pictures_are_said(tmp_path, shape, kind):
    with pytest.raises(VideoError, match=r"a.png: found a picture of .* expected uint8, \(H, W, 3\) or \(H, W\)"):
        write_image(tmp_path / "a.png", np.zeros(shape, kind))


def test_pictures_that_cannot_be_read_or_written_are_said(tmp_path, colours):
    with pytest.raises(VideoError, match=r"found the ending '.pic', expected one of .bmp, .jpeg"):
        write_image(tmp_path / "a.pic", colours)
    with pytest.raises(VideoError, match=r"cannot be written \(no such file or directory"):
        write_image(tmp_path / "nowhere" / "a.png", colours)
    with pytest.raises(VideoError, match=r"cannot be read \(no such file or directory"):
        read_image(tmp_path / "nowhere.png")
    with pytest.raises(VideoError, match=r"cannot be read \(is a directory"):
        read_image(tmp_path)
    write_image(tmp_path / "a.png", colours)
    (tmp_path / "a.png").write_bytes((tmp_path / "a.png").read_bytes()[:500])
    with pytest.raises(VideoError, match="not a picture that can be read"):
        read_image(tmp_path / "a.png")


@pytest.mark.parametrize("grey", [False, True])
def test_one_picture_is_a_film_of_one_frame(tmp_path, colours, grey):
    write_image(tmp_path / "a.png", colours)
    source = open_frames(tmp_path / "a.png", grey=grey)
    assert (source.size, source.count, math.isnan(source.rate)) == (SIZE, 1, True)
    for _ in range(2):
        frame, = source
        assert frame.time == 0
        np.testing.assert_array_equal(frame.image, read_image(tmp_path / "a.png", grey))
    assert open_frames(str(tmp_path / "a.png"), size=(16, 12)).size == (16, 12)


def test_a_folder_is_read_in_natural_order(folder):
    (folder / "notes.md").write_text("")
    (folder / ".hidden.png").write_bytes(b"")
    source = open_frames(folder, grey=True, rate=25)
    assert (source.size, source.count, source.rate) == (SIZE, 12, 25)
    for i, frame in enumerate(source):
        assert frame.time == i / 25
        assert (frame.image == i + 1).all()


def test_a_folder_that_says_nothing_of_time_is_taken_at_30_frames_with_a_warning(folder):
    source = open_frames(folder, grey=True)
    with pytest.warns(ShadowPuppetWarning, match="no timestamps.txt in it and no rate given: 30 frames/s are assumed"):
        times = [frame.time for frame in source]
    np.testing.assert_allclose(times, np.arange(12) / 30)


@pytest.mark.parametrize(("name", "line", "heading"), [
    ("timestamps.txt", "{}", ""), ("timestamps.csv", "{},{}.png", "time,picture\n"), ("timestamps.txt", "{}\t7", "# seconds\n"),
])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_a_folder_s_times_are_read(folder, name, line, heading, encoding):
    stamps = 1_700_000_000 + np.arange(12) ** 2 / 8
    (folder / name).write_text(heading + "\n".join(line.format(t, i) for i, t in enumerate(stamps.tolist())) + "\n\n", encoding)
    source = open_frames(folder, grey=True)
    assert [frame.time for frame in source] == (np.arange(12) ** 2 / 8).tolist()
    assert source.rate == 11 / (11**2 / 8)


@pytest.mark.parametrize(("text", "said"), [
    ("1\n2\n", "found 2 times for 12 pictures, expected one for each"),
    ("\n".join("123456789abc"), "expected one time in seconds a line"),
    ("\n".join(map(str, [0, 0, *range(10)])), "expected increasing seconds"),
    ("\n".join(["0", "1", "nan"] + ["5"] * 9), "not finite"),
    (b"\xff\xfe", "expected one time in seconds a line"),
])
def test_times_that_cannot_be_are_said(folder, text, said):
    (folder / "timestamps.txt").write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(VideoError, match=said):
        open_frames(folder)


def test_folders_without_pictures_and_with_bad_ones_are_said(folder, tmp_path):
    (tmp_path / "empty").mkdir()
    with pytest.raises(VideoError, match="no pictures in this folder"):
        open_frames(tmp_path / "empty")
    write_image(folder / "3.png", np.zeros((24, 30), np.uint8))
    with pytest.raises(VideoError, match=r"3.png: frame 2 \(0.200 s\) is 30 x 24 pixels, those before it 32 x 24"):
        list(open_frames(folder, rate=10))
    (folder / "2.png").write_bytes(b"no picture")
    with pytest.raises(VideoError, match=r"2.png: not a picture that can be read"):
        list(open_frames(folder, rate=10))


class FakeCapture:
    """A camera with three pictures, in OpenCV's clothes."""

    opened: ClassVar[list[FakeCapture]] = []

    def __init__(self, number):
        self.number, self.left, self.settings, self.released = number, 3, {}, False
        FakeCapture.opened.append(self)

    def isOpened(self):
        return self.number != 9

    def set(self, key, value):
        self.settings[key] = value

    def get(self, key):
        return 0.0

    def grab(self):
        self.left -= 1
        return self.left >= 0

    def retrieve(self):
        return True, np.full((24, 32, 3), 100 + self.left, np.uint8)

    def read(self):
        return self.grab(), self.retrieve()[1]

    def release(self):
        self.released = True


@pytest.fixture
def camera(monkeypatch):
    import cv2

    monkeypatch.setattr(FakeCapture, "opened", [])
    monkeypatch.setattr(cv2, "VideoCapture", FakeCapture)


@pytest.mark.parametrize("source", [1, "camera:1"])
def test_a_camera_is_read_as_it_comes(camera, source):
    frames = open_frames(source, grey=True, size=(16, 12))
    assert (frames.name, frames.size, frames.count, math.isnan(frames.rate)) == ("camera:1", (16, 12), None, True)
    with pytest.warns(ShadowPuppetWarning, match="camera 1: gave no more pictures after 2"):
        found = list(frames)
    assert [int(frame.image[0, 0]) for frame in found] == [101, 100]
    times = [frame.time for frame in found]
    assert times[0] == 0
    assert times[1] > 0
    assert len(FakeCapture.opened) == 1


def test_a_camera_is_let_go_and_opened_again(camera):
    frames = open_frames(1)
    for _ in range(2):
        reading = iter(frames)
        next(reading)
        reading.close()  # type: ignore[attr-defined]
    assert [capture.released for capture in FakeCapture.opened] == [True, True]


def test_a_camera_that_gives_nothing_is_said(camera):
    with pytest.raises(VideoError, match="camera 9: gives no picture; is it connected"):
        open_frames("camera:9")
    assert FakeCapture.opened[0].released
