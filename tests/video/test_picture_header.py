"""Sizes of pictures are read before they are decoded: they are those of the decoder, and what is too large takes no memory."""

from __future__ import annotations

import struct

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from memory import memory_of
from PIL import Image
from png import png

from shadowpuppet.errors import VideoError
from shadowpuppet.video import read_image
from shadowpuppet.video.frames import MOST_PIXELS
from shadowpuppet.video.picture_header import read_header

WIDTH, HEIGHT = 31, 17
WIDTH_TAG, HEIGHT_TAG = 256, 257
KINDS = {
    "a.bmp": ("RGB", {}), "grey.bmp": ("L", {}), "a.jpg": ("RGB", {"quality": 90}), "progressive.jpg": ("RGB", {"progressive": True}),
    "exif.jpg": ("L", {"exif": Image.Exif(), "comment": b"\xff\xc0 no marker"}), "cmyk.jpg": ("CMYK", {}), "a.png": ("RGB", {}),
    "deep.png": ("I;16", {}), "clear.png": ("RGBA", {}), "a.tif": ("RGB", {}), "packed.tif": ("RGB", {"compression": "tiff_deflate"}),
    "big.tif": ("RGB", {"big_tiff": True}), "bit.tif": ("1", {"compression": "group4"}), "lossy.webp": ("RGB", {}),
    "lossless.webp": ("RGB", {"lossless": True}), "clear.webp": ("RGBA", {"exif": Image.Exif()}),
}  # fmt: skip


def written(folder, name):
    """A picture as another program writes it."""
    mode, options = KINDS[name]
    noise = np.random.default_rng(1).integers(0, 256, (HEIGHT, WIDTH, 4), np.uint8)
    Image.fromarray(noise, "RGBA").convert("RGB" if mode != "RGBA" else mode).convert("L" if mode == "I;16" else mode).convert(mode).save(
        folder / name, **options)
    return folder / name


@pytest.mark.parametrize("name", KINDS)
def test_a_header_tells_the_size_that_the_picture_has(tmp_path, name):
    path = written(tmp_path, name)
    header = read_header(path.read_bytes())
    assert header is not None
    assert (*header,) == (WIDTH, HEIGHT, WIDTH * HEIGHT)
    assert read_image(path).shape == (HEIGHT, WIDTH, 3)


@pytest.mark.parametrize("name", KINDS)
@settings(max_examples=60, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(changes=st.lists(st.tuples(st.integers(0, 400), st.integers(0, 255)), min_size=1, max_size=4), again=st.integers(0, 400))
def test_a_changed_picture_never_decodes_to_more_than_its_header_tells(tmp_path_factory, capfd, name, changes, again):
    folder = tmp_path_factory.getbasetemp()
    data = bytearray(written(folder, name).read_bytes())
    for at, value in changes:
        data[at % min(len(data), 400)] = value
    data = bytes(data[:again] + data[again // 2 :])  # parts of the header may be there twice
    header = read_header(data)
    if header is not None and header.most < 10**6:
        try:
            image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
        except cv2.error:
            image = None
        assert image is None or sorted(image.shape[:2]) == sorted(header[:2])


def tiff(*tags):
    """A header of TIFF with some tags and their values, whole numbers of 32 bits."""
    entries = b"".join(struct.pack("<HHII", tag, 4, 1, value) for tag, value in tags)
    return b"II*\0" + struct.pack("<IH", 8, len(tags)) + entries + bytes(4)


HUGE = {
    "a.png": png(30_000, 30_000), "a.bmp": b"BM" + struct.pack("<IIIIiiHHI", 0, 0, 54, 40, 30_000, -30_000, 1, 24, 0) + bytes(30),
    "old.bmp": b"BM" + struct.pack("<IIIIHHHH", 0, 0, 26, 12, 30_000, 30_000, 1, 24),
    "a.jpg": b"\xff\xd8\xff\xe0\0\4ab junk \xff\xff\xc2\0\x11\x08" + struct.pack(">HH", 30_000, 30_000) + bytes(20),
    "lossy.webp": b"RIFF\0\0\0\0WEBPVP8 " + bytes(7) + b"\x9d\x01\x2a" + struct.pack("<HH", 16383, 16383),
    "lossless.webp": b"RIFF\0\0\0\0WEBPVP8L" + bytes(4) + b"\x2f\xff\xff\xff\xff\xff",
    "a.webp": b"RIFF\0\0\0\0WEBPVP8X" + bytes(8) + (30_000).to_bytes(3, "little") * 2,
    "a.tif": tiff((WIDTH_TAG, 30_000), (HEIGHT_TAG, 30_000)),
    "twice.tif": tiff((WIDTH_TAG, 9), (HEIGHT_TAG, 30_000), (WIDTH_TAG, 30_000)),
    "tiles.tif": tiff((WIDTH_TAG, 9), (HEIGHT_TAG, 9), (322, 30_000), (323, 30_000)),
    "deep.tif": tiff((WIDTH_TAG, 5_000), (HEIGHT_TAG, 5_000), (258, 64), (277, 4)),
}  # fmt: skip


@pytest.mark.parametrize("name", HUGE)
def test_a_picture_that_states_too_much_is_refused_before_it_is_decoded(tmp_path, monkeypatch, name):
    (tmp_path / name).write_bytes(HUGE[name])
    monkeypatch.setattr(cv2, "imdecode", lambda *_: pytest.fail("decoded"))
    with pytest.raises(VideoError, match=rf"found a picture of \d+ x \d+ pixels, .* expected at most {MOST_PIXELS}: scale it") as error:
        read_image(tmp_path / name)
    assert str(tmp_path / name) in str(error.value)


def test_what_cannot_be_sized_is_not_decoded(tmp_path, monkeypatch):
    monkeypatch.setattr(cv2, "imdecode", lambda *_: pytest.fail("decoded"))
    for content in (png(8, 8, b"IHDX"), b"P6 8 8 255 " + bytes(192), b"GIF89a" + bytes(30), b"\xff\xd8\xff\xd9", b"II*\0" + bytes(4),
                    b"BM"):
        (tmp_path / "a.png").write_bytes(content)
        with pytest.raises(VideoError, match=r"a\.png: not a picture that can be read"):
            read_image(tmp_path / "a.png")


def test_a_huge_picture_takes_little_memory_and_the_largest_takes_what_is_promised(tmp_path):
    side = int(MOST_PIXELS**0.5)
    (tmp_path / "small.png").write_bytes(png(8, 8))
    for name, (width, height), most in (("huge", (30_000, 30_000), 20e6), ("largest", (side, side), 500e6)):
        (tmp_path / f"{name}.png").write_bytes(png(width, height))
        found = memory_of("from shadowpuppet.video import open_frames", "open_frames", tmp_path / f"{name}.png", tmp_path / "small.png")
        assert found < most
