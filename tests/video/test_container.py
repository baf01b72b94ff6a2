"""A film opens no other file, and none that is too large is decoded."""

from __future__ import annotations

import contextlib
import http.server
import os
import re
import struct
import threading

import numpy as np
import pytest
from films import encoded, pictures
from memory import memory_of
from png import png

from shadowpuppet.errors import ShadowPuppetWarning, VideoError
from shadowpuppet.video import open_frames
from shadowpuppet.video.container import opened
from shadowpuppet.video.frames import MOST_PIXELS
from shadowpuppet.video.live_source import open_feed
from shadowpuppet.video.seeking import Seeker
from shadowpuppet.video.sound import read_sound
from shadowpuppet.video.timecode import read_timecode

pipes = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes in files")
SESSION = "v=0\no=- 0 0 IN IP4 127.0.0.1\ns=x\nc=IN IP4 127.0.0.1\nt=0 0\nm=video 5004 RTP/AVP 96\na=rtpmap:96 H264/90000\n"
LISTS = {
    "concat.mp4": ("ffconcat version 1.0\nfile other.avi\n", "a list of films"),
    "bare.ffconcat": ("ffconcat version 1.0\nfile 'file:other.avi'\n", "a list of films"),
    "x.m3u8": ("#EXTM3U\n#EXT-X-TARGETDURATION:1\n#EXTINF:1,\nother.avi\n", "a play list"),  # without end
    "x.mp4": ("#EXTM3U\n#EXT-X-TARGETDURATION:1\n#EXT-X-MAP:URI=\"other.avi\"\n#EXTINF:1,\nother.avi\n#EXT-X-ENDLIST\n", "a play list"),
    "x.sdp": (SESSION, "the description of a session"),
    "x.mpd": ('<?xml version="1.0"?><MPD xmlns="urn:mpeg:dash:schema:mpd:2011"><BaseURL>other.avi</BaseURL></MPD>', "an XML file"),
    "x.asx": ('<asx version="3.0"><entry><ref href="other.avi"/></entry></asx>', ""), "x.idx": ("# VobSub index file, v7\n", ""),
    "x.avs": ('AVISource("other.avi")\n', ""), "x.vpy": ("import vapoursynth\n", ""), "x.txt": ("other.avi\n", ""),
}  # fmt: skip


@pytest.fixture
def watched(tmp_path):
    """A pipe `other.avi`, and whether anything has opened it."""
    path, seen = tmp_path / "other.avi", threading.Event()
    os.mkfifo(path)

    def wait():
        with path.open("wb"):  # waits until the pipe is opened to be read
            seen.set()

    thread = threading.Thread(target=wait, daemon=True)
    thread.start()
    yield seen
    with contextlib.closing(os.fdopen(os.open(path, os.O_RDONLY | os.O_NONBLOCK))):
        thread.join()


@pipes
@pytest.mark.parametrize("name", LISTS)
@pytest.mark.parametrize("read", [open_frames, read_timecode, lambda path: read_sound(path, 8000, 1.0), lambda path: open_feed(str(path)),
                                  lambda path: Seeker(path, (4, 4))], ids=["frames", "timecode", "sound", "feed", "seeker"])  # fmt: skip
def test_what_names_other_files_is_refused_and_opens_none(tmp_path, watched, name, read):
    content, kind = LISTS[name]
    (tmp_path / name).write_text(content)
    with pytest.raises(VideoError, match=rf"{name}: (found {kind}.* expected a film that holds|no film that can be read)") as error:
        read(tmp_path / name)
    assert kind in str(error.value)
    assert not watched.is_set()


def test_a_name_with_a_number_is_one_file(tmp_path):
    encoded(tmp_path / "a1.avi", pictures(3), codec="mjpeg", pixels="yuvj420p")
    (tmp_path / "a%d.avi").write_bytes((tmp_path / "a1.avi").read_bytes())
    assert len(list(open_frames(tmp_path / "a%d.avi"))) == 3
    (tmp_path / "a%d.ppm").write_bytes(b"P6 1 1 255 abc")
    (tmp_path / "a0.ppm").write_bytes(b"P6 1 1 255 abc")
    with pytest.raises(VideoError, match=r"a%d\.ppm: no film that can be read \(none of "):
        open_frames(tmp_path / "a%d.ppm")


def boxed(data, path, change):
    """A file of boxes (MP4, MOV), the content of one of them changed, with the sizes of all around it."""
    at, out = 0, b""
    while at < len(data):
        size, kind = struct.unpack_from(">I4s", data, at)
        content = data[at + 8 : at + size]
        if kind == path[0]:
            content = change(content) if len(path) == 1 else boxed(content, path[1:], change)
        out, at = out + struct.pack(">I4s", len(content) + 8, kind) + content, at + size
    return out


@pipes
def test_a_film_whose_pictures_are_in_another_file_does_not_open_it(tmp_path, watched):
    """An alias of QuickTime, to a file in the same folder and by its whole path."""
    path = encoded(tmp_path / "a.mov", pictures(3), codec="mjpeg", pixels="yuvj420p")
    name, whole = b"other.avi", os.fsencode(tmp_path / "other.avi")
    head = bytes(10) + b"\4disk".ljust(28, b"\0") + bytes(12) + (bytes([len(name)]) + name).ljust(64, b"\0") + bytes(16)
    places = struct.pack(">HH", 1, 1) + bytes(16)
    tags = b"".join(struct.pack(">HH", tag, len(text)) + text + b"\0" * (len(text) % 2) for tag, text in ((2, whole), (18, whole)))
    alias = head + places + tags + struct.pack(">HH", 0xFFFF, 0)
    entry = struct.pack(">I4sI", len(alias) + 12, b"alis", 0) + alias
    data = boxed(path.read_bytes(), [b"moov", b"trak", b"mdia", b"minf", b"dinf", b"dref"], lambda _: struct.pack(">II", 0, 1) + entry)
    path.write_bytes(data)
    with contextlib.suppress(VideoError):
        list(open_frames(path))
    assert not watched.is_set()


class Lists(http.server.BaseHTTPRequestHandler):
    """Serves a list that names a file of this machine."""

    content = b""

    def do_GET(self):
        self.send_response(200)
        self.send_header("Content-Length", str(len(self.content)))
        self.end_headers()
        with contextlib.suppress(OSError):
            self.wfile.write(self.content)

    def log_message(self, *_):
        pass


@pipes
@pytest.mark.parametrize("form", ["#EXTM3U\n#EXT-X-TARGETDURATION:1\n#EXTINF:1,\n{}\n#EXT-X-ENDLIST\n",
                                  "ffconcat version 1.0\nfile '{}'\n"])
@pytest.mark.parametrize("scheme", ["file:", "file://", "", "crypto:file:", "concat:", "subfile,,start,0,end,0,,:"])
def test_a_play_list_from_the_network_opens_no_file(tmp_path, watched, form, scheme):
    handler = type("Handler", (Lists,), {"content": form.format(f"{scheme}{tmp_path / 'other.avi'}").encode()})
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        with pytest.raises(VideoError, match=r"no stream of pictures there that can be read|found a stream without pictures"):
            open_feed(f"http://127.0.0.1:{server.server_port}/x.m3u8")
    finally:
        server.shutdown()
        server.server_close()
    assert not watched.is_set()


def test_pictures_of_an_unknown_kind_are_said(tmp_path):
    path = encoded(tmp_path / "a.mov", pictures(3), codec="png", pixels="rgb24")
    path.write_bytes(path.read_bytes().replace(b"png ", b"xyz "))
    with pytest.raises(VideoError, match=r"a\.mov: (its pictures are of a kind that cannot be decoded|no )"):
        open_frames(path)


def test_names_in_a_film_need_be_no_text(tmp_path):
    path = encoded(tmp_path / "a.mkv", pictures(3), codec="mjpeg", pixels="yuvj420p")
    path.write_bytes(path.read_bytes().replace(b"Lavf", b"L\xff\xfev"))
    assert len(list(open_frames(path))) == 3


# Sizes


@pytest.mark.parametrize(("name", "content"), [
    ("a.y4m", b"YUV4MPEG2 W10000 H10000 F25:1 C420jpeg\nFRAME\n" + bytes(99)),
    ("a.gif", b"GIF89a" + struct.pack("<HHBBB", 10_000, 10_000, 0x80, 0, 0) + bytes(6) + b"," + struct.pack("<HHHHB", 0, 0, 1, 1, 0)
     + b"\2\2\x44\1\0;"),
])  # fmt: skip
def test_a_film_of_huge_frames_is_refused(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(VideoError, match=rf"{name}: found frames of 10000 x 10000 pixels, expected at most {MOST_PIXELS} in a frame"):
        open_frames(tmp_path / name)


def of_png(path, *frames):
    """A film of these pictures, whatever its container tells of them."""
    data = encoded(path, pictures(len(frames)), codec="png", pixels="rgb24").read_bytes()
    data = boxed(data, [b"mdat"], lambda _: b"".join(frames))
    sizes = struct.pack(f">{3 + len(frames)}I", 0, 0, len(frames), *map(len, frames))
    path.write_bytes(boxed(data, [b"moov", b"trak", b"mdia", b"minf", b"stbl", b"stsz"], lambda _: sizes))
    return path


@pytest.mark.parametrize(("side", "said"), [(10_000, "found frames of 10000 x 10000 pixels, expected at most"),
                                            (30_000, "no frame of it can be decoded (png; at most 40000000 pixels are)")])  # fmt: skip
def test_a_frame_that_is_larger_than_its_film_tells_takes_no_memory(tmp_path, side, said):
    huge, small = of_png(tmp_path / "huge.mov", png(side, side)), encoded(tmp_path / "a.mov", pictures(1), codec="png", pixels="rgb24")
    with pytest.raises(VideoError, match=re.escape(f"huge.mov: {said}")):
        open_frames(huge)
    assert memory_of("from shadowpuppet.video import open_frames", "open_frames", huge, small) < 50e6


def test_a_later_frame_that_is_larger_takes_no_memory(tmp_path):
    small = of_png(tmp_path / "a.mov", png(32, 24), png(32, 24))
    huge = of_png(tmp_path / "huge.mov", png(32, 24), png(10_000, 10_000))
    assert len(list(open_frames(small))) == 2
    with pytest.warns(ShadowPuppetWarning, match="broken off at frame [01] of 2"):  # a thread may still hold the first
        assert all(frame.image.shape == (24, 32, 3) for frame in open_frames(huge))
    assert memory_of("from shadowpuppet.video import open_frames", "lambda path: list(open_frames(path))", huge, small) < 50e6


def test_large_frames_are_decoded_by_few_threads(tmp_path, monkeypatch):
    from shadowpuppet.video import container

    path = encoded(tmp_path / "a.mp4", pictures(1, (64, 48)))
    for memory, number in ((3 * 64 * 48, 1), (2 * 3 * 64 * 48, 2), (10**9, 5)):
        monkeypatch.setattr(container, "thread_limit", lambda: 5)
        monkeypatch.setattr(container, "FILE_MEMORY", memory)
        with opened(path) as (_, stream):
            assert stream.codec_context.thread_count == number
    assert np.array_equal(next(iter(open_frames(path))).image.shape, (48, 64, 3))
