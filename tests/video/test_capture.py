"""Pictures as they come: the newest one counts, films keep their pace, what breaks off is tried again."""

from __future__ import annotations

import http.server
import io
import itertools
import math
import socket
import threading
import time

import made
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from live_film import Clock
from waiting import LONG, until

from shadowpuppet.errors import ShadowPuppetWarning, VideoError
from shadowpuppet.video import FrameSource, network_stream, open_frames, write_image
from shadowpuppet.video.capture import FIRST_WAIT, LONGEST_WAIT, CameraCapture, Newest
from shadowpuppet.video.frames import Frame
from shadowpuppet.video.live_source import Feed, Snapshot, film_feed, open_feed
from shadowpuppet.video.network_stream import without_secrets

GREY = np.full((12, 16, 3), 90, np.uint8)


# The newest picture


def test_what_is_put_replaces_what_nobody_took():
    place = Newest[str]()
    for item in "abc":
        place.put(item)
    assert (place.take(), place.take(), place.dropped, place.put_count) == ("c", None, 2, 3)


def test_a_waiting_taker_gets_what_comes():
    place = Newest[int]()
    threading.Timer(0.05, place.put, [7]).start()
    assert place.take(timeout=LONG) == 7


@given(rate=st.floats(5, 60), costs=st.lists(st.floats(0.001, 0.5), min_size=1, max_size=40))
def test_however_slow_the_work_a_picture_is_never_older_than_one_interval_when_it_begins(rate, costs):
    """Frames are dropped, not queued: simulated with a clock that passes only by the work."""
    place, now, sent, taken = Newest[tuple[float, int]](), 0.0, 0, []
    for cost in costs:
        while sent / rate <= now:
            place.put((sent / rate, sent))
            sent += 1
        item = place.take()
        if item is None:  # the work was faster than the camera
            now = sent / rate
            place.put((now, sent))
            sent += 1
            item = place.take()
        assert item is not None
        assert now - item[0] <= 1 / rate + 1e-9
        taken.append(item[1])
        now += cost
    assert taken == sorted(set(taken))
    assert place.dropped == taken[-1] + 1 - len(taken)


# Films at their own rate


def source(times, name="film"):
    frames = [Frame(t, np.full((12, 16, 3), i, np.uint8)) for i, t in enumerate(times)]
    return FrameSource(name, (16, 12), 10.0, len(times), math.nan, lambda _: iter(frames))


def test_a_film_s_frames_come_when_they_are_due():
    clock = Clock()
    feed = film_feed(source([0, 0.1, 0.25, 0.3]), clock=clock, wait=clock.wait)
    shots = [(shot.captured, clock.now, shot.shown) for shot in feed.read()]
    assert shots == [(pytest.approx(100 + t), pytest.approx(100 + t), t) for t in (0, 0.1, 0.25, 0.3)]
    assert not feed.live


def test_speed_is_a_factor_on_the_rate():
    clock = Clock()
    feed = film_feed(source([0, 0.1, 0.2]), 4.0, clock=clock, wait=clock.wait)
    assert [shot.captured for shot in feed.read()] == pytest.approx([100, 100.025, 100.05])
    assert feed.rate == 40


def test_frames_are_stamped_when_they_were_due_not_when_there_was_time():
    clock, shots = Clock(), []
    for shot in film_feed(source([0, 0.1, 0.2, 0.3]), clock=clock, wait=clock.wait).read():
        shots.append(clock.now - shot.captured)
        clock.now += 0.15 if len(shots) == 1 else 0.0
    assert shots == pytest.approx([0, 0.05, 0, 0])


def test_a_film_that_stood_still_goes_on_where_it_was_and_is_not_called_slow(recwarn):
    clock, shots = Clock(), []
    feed = film_feed(source([0.1 * i for i in range(6)]), clock=clock, wait=clock.wait)
    for shot in feed.read():
        shots.append(clock.now - shot.captured)
        if len(shots) == 2:
            clock.now += 30.0
            feed.put_off(30.0)
    assert shots == pytest.approx([0] * 6)
    assert not recwarn


def test_a_film_is_held_and_a_camera_is_not():
    for live, expected in ((False, 0), (True, 3)):
        shots = [Snapshot(0.1 * n, GREY, 0.1 * n) for n in range(3)]
        said = list[float]()
        end = threading.Event()

        def read(shots=shots, end=end):
            yield from shots
            end.wait(LONG)

        capture = CameraCapture(Feed("film", (16, 12), 10.0, live, read, said.append))
        capture.hold(True)
        with capture:
            until(lambda capture=capture, expected=expected: capture.newest.put_count >= expected)
            time.sleep(0.3)
            assert capture.newest.put_count == expected
            capture.hold(False)
            until(lambda capture=capture: capture.newest.put_count >= 3)
            shot = capture.newest.take(LONG)
            end.set()
        assert shot is not None
        assert bool(said) != live
        assert capture.newest.put_count == 3


def test_a_film_that_cannot_be_decoded_in_time_is_played_slower_and_that_is_said_once():
    clock, late = Clock(), []

    def read():
        for shot in film_feed(source([0.1 * i for i in range(9)]), clock=clock, wait=clock.wait).read():
            late.append(clock.now - shot.captured)
            clock.now += 0.6

    with pytest.warns(ShadowPuppetWarning, match="cannot be decoded as fast") as said:
        read()
    assert len(said) == 1
    assert max(late) <= 1.0 + 0.6


def test_a_film_without_times_is_refused_unless_a_rate_is_given(tmp_path):
    import av

    path = tmp_path / "raw.h264"
    with av.open(str(path), "w", format="h264") as output:
        coded = output.add_stream("libx264", rate=10)
        coded.width, coded.height, coded.pix_fmt = 32, 24, "yuv420p"
        for i in range(12):
            output.mux(coded.encode(av.VideoFrame.from_ndarray(np.full((24, 32, 3), 20 * i, np.uint8), format="bgr24")))
        output.mux(coded.encode(None))
    with pytest.raises(VideoError, match=r"raw.h264: its frames have no times, .* \(--rate\)"):
        open_feed(str(path))
    shots = list(itertools.islice(open_feed(str(path), rate=50.0, speed=10).read(), 5))
    assert [shot.shown for shot in shots] == pytest.approx([0, 0.02, 0.04, 0.06, 0.08])


def test_a_folder_without_times_is_refused_unless_a_rate_is_given(tmp_path):
    for i in range(3):
        write_image(tmp_path / f"{i}.png", GREY)
    with pytest.raises(VideoError, match="its frames have no times"):
        open_feed(str(tmp_path))
    assert len(list(open_feed(str(tmp_path), rate=200.0).read())) == 3
    (tmp_path / "timestamps.txt").write_text("0\n0.01\n0.02\n")
    assert [shot.shown for shot in open_feed(str(tmp_path)).read()] == [0, 0.01, 0.02]


@pytest.mark.parametrize(("given_", "said"), [
    ("nowhere.mp4", "nowhere.mp4: no such film"),
    ("gopher://here", "found an address of the kind 'gopher', expected one of http, https, rtmp"),
    ("file:///etc/passwd", "found an address of the kind 'file'"),
    ("a.png", "a.png: found a single picture, expected a film"),
    ("http://127.0.0.1:1/x", "http://127.0.0.1:1/x: no stream of pictures there that can be read"),
])  # fmt: skip
def test_what_cannot_be_opened_is_said(given_, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_image(tmp_path / "a.png", GREY)
    with pytest.raises(VideoError, match=said):
        open_feed(given_)


# Cameras


class Device:
    """OpenCV's camera, with some pictures."""

    def __init__(self, number):
        self.left, self.released = 4, False

    def isOpened(self):
        return True

    def set(self, key, value):
        pass

    def get(self, key):
        return 30.0

    def grab(self):
        self.left -= 1
        return self.left >= 0

    def retrieve(self):
        return True, GREY + self.left

    def read(self):
        return self.grab(), self.retrieve()[1]

    def release(self):
        self.released = True


@pytest.mark.parametrize("given_", ["1", 1, "camera:1"])
def test_a_camera_s_pictures_are_stamped_as_they_come(monkeypatch, given_):
    import cv2

    monkeypatch.setattr(cv2, "VideoCapture", Device)
    before = time.monotonic()
    feed = open_feed(given_)
    shots = list(feed.read())
    assert (feed.name, feed.size, feed.rate, feed.live) == ("camera 1", (16, 12), 30.0, True)
    assert before <= shots[0].captured <= shots[1].captured <= shots[2].captured <= time.monotonic()
    assert [int(shot.image[0, 0, 0]) for shot in shots] == [92, 91, 90]
    assert len(list(feed.read())) == 3  # opened again


# Breaks


class Unsteady:
    """A camera that does as a script says: numbers of pictures, or what it says when it cannot be opened."""

    def __init__(self, *script):
        self.script, self.opened = list(script), 0

    def read(self):
        self.opened += 1
        step = self.script.pop(0) if self.script else 0
        if isinstance(step, str):
            raise VideoError(step)
        for i in range(step):
            yield Snapshot(float(i), GREY)

    def feed(self, live=True):
        return Feed("cam", (16, 12), math.nan, live, self.read)


def read_with_waits(capture, enough):
    """Run the reader here, not in its thread, and note how long it would wait."""
    waits = []

    def wait(seconds):
        waits.append((seconds, capture.problem))
        return len(waits) >= enough

    capture._read_on(wait)
    return waits


def test_a_camera_that_is_gone_is_tried_again_with_longer_and_longer_waits():
    capture = CameraCapture(Unsteady(2, *["unplugged"] * 8).feed())
    waits = read_with_waits(capture, 8)
    assert [seconds for seconds, _ in waits[:2]] == [FIRST_WAIT, 2 * FIRST_WAIT]
    assert waits[-1] == (LONGEST_WAIT, "unplugged")
    assert waits[0][1] == "cam: gives no more pictures"


def test_a_camera_that_returns_is_read_on_and_the_next_wait_is_short_again():
    camera = Unsteady(1, "gone", "gone", "gone", 3, "gone")
    capture = CameraCapture(camera.feed())
    waits = read_with_waits(capture, 6)
    assert [seconds / FIRST_WAIT for seconds, _ in waits] == [1, 2, 4, 8, 1, 2]
    assert capture.newest.put_count == 4
    assert camera.opened == 6


def test_a_film_that_is_over_is_over():
    with CameraCapture(Unsteady(3).feed(live=False)) as capture:
        until(lambda: capture.ended)
        shot = capture.newest.take()
    assert shot is not None
    assert (shot.number, capture.newest.dropped, capture.error) == (2, 2, None)


def test_who_waits_for_a_picture_of_a_film_that_ends_waits_no_longer():
    end = threading.Event()

    def read():
        end.wait(LONG)
        yield from ()

    with CameraCapture(Feed("film", (16, 12), math.nan, False, read)) as capture:
        waiting = threading.Thread(target=capture.newest.take, args=(3 * LONG,), daemon=True)
        waiting.start()
        until(lambda: capture.newest._changed._waiters)
        end.set()
        waiting.join(LONG)
        assert not waiting.is_alive()


def test_a_film_that_breaks_ends_with_its_error():
    with CameraCapture(Unsteady("a hole").feed(live=False)) as capture:
        until(lambda: capture.ended)
    assert str(capture.error) == "a hole"


def test_what_is_no_fault_of_the_camera_is_not_hidden():
    def read():
        raise RuntimeError("a bug")
        yield

    with CameraCapture(Feed("cam", (16, 12), math.nan, True, read)) as capture:
        until(lambda: capture.ended)
    assert isinstance(capture.error, RuntimeError)


def test_a_frozen_camera_is_opened_again_at_once_when_asked():
    opened = []

    def read():
        opened.append(1)
        while True:
            time.sleep(0.002)
            yield Snapshot(0.0, GREY)

    with CameraCapture(Feed("cam", (16, 12), math.nan, True, read)) as capture:
        until(lambda: capture.newest.put_count > 2)
        capture.again()
        until(lambda: len(opened) == 2)
        assert capture.problem == ""


# Streams


class MotionJpeg(http.server.BaseHTTPRequestHandler):
    """A network camera: MJPEG over HTTP, as most give it."""

    pictures: list[np.ndarray]
    stall = 0.0

    def do_GET(self):
        import cv2

        self.send_response(200)
        self.send_header("Content-Type", "multipart/x-mixed-replace; boundary=frame")
        self.end_headers()
        try:
            for image in self.pictures:
                data = cv2.imencode(".jpg", image)[1].tobytes()
                self.wfile.write(b"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n%s\r\n" % (len(data), data))
                time.sleep(0.02)
            time.sleep(self.stall)
        except OSError:  # the reader has enough
            pass

    def log_message(self, *_):
        pass


@pytest.fixture
def camera_server(request):
    images = [np.full((48, 64, 3), 10 * (i % 20), np.uint8) for i in range(30)]
    handler = type("Handler", (MotionJpeg,), {"pictures": images})
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    server.daemon_threads = True
    server.block_on_close = False
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield server, handler, f"http://127.0.0.1:{server.server_port}/video"
    server.shutdown()
    server.server_close()


def test_a_network_camera_is_read_as_it_comes_and_taken_up_again(camera_server):
    _, _, address = camera_server
    begun = time.monotonic()
    feed = open_feed(address)
    assert (feed.size, feed.live, feed.name) == ((64, 48), True, address)
    seen = set()
    with CameraCapture(feed) as capture:
        def enough() -> bool:
            shot = capture.newest.take(0.1)
            if shot is not None:
                seen.add(int(shot.image[0, 0, 0]) // 10)
                assert begun <= shot.captured <= time.monotonic()
            return capture.newest.put_count >= 40  # more than it gives at once

        until(enough)
    assert capture.newest.put_count >= 40
    assert len(seen) > 5


def test_a_stream_that_stalls_is_said_and_not_waited_for_forever(camera_server, monkeypatch):
    monkeypatch.setattr(network_stream, "READ_SECONDS", 0.4)
    _, handler, address = camera_server
    handler.stall = 30.0
    with CameraCapture(open_feed(address)) as capture:
        until(lambda: "the stream broke off (it does not answer)" in capture.problem)
        until(lambda: capture.problem == "")  # tried again


def test_an_address_that_does_not_answer_is_given_up(monkeypatch):
    monkeypatch.setattr(network_stream, "OPEN_SECONDS", 0.3)
    with socket.socket() as silent:
        silent.bind(("127.0.0.1", 0))
        silent.listen()
        with pytest.raises(VideoError, match=r"no stream of pictures there that can be read \(it does not answer\)"):
            open_feed(f"http://127.0.0.1:{silent.getsockname()[1]}/")


def test_a_coded_stream_over_the_loopback():
    """H.264 in MPEG-TS over TCP, as encoders send it."""
    import av

    data = io.BytesIO()
    with av.open(data, "w", format="mpegts") as output:
        coded = output.add_stream("libx264", rate=25, options={"tune": "zerolatency", "g": "10"})
        coded.width, coded.height, coded.pix_fmt = 64, 48, "yuv420p"
        for i in range(60):
            output.mux(coded.encode(av.VideoFrame.from_ndarray(np.full((48, 64, 3), 4 * i, np.uint8), format="bgr24")))
        output.mux(coded.encode(None))

    def send():
        connection = server.accept()[0]
        with connection:
            for start in range(0, len(data.getvalue()), 1880):
                connection.sendall(data.getvalue()[start : start + 1880])
                time.sleep(0.01)

    with socket.create_server(("127.0.0.1", 0)) as server:
        threading.Thread(target=send, daemon=True).start()
        feed = open_feed(f"tcp://127.0.0.1:{server.getsockname()[1]}")
        shots = list(feed.read())
    assert (feed.size, feed.live) == ((64, 48), True)
    assert len(shots) > 10  # what was looked at to know the format is not given again
    assert [shot.captured for shot in shots] == sorted(shot.captured for shot in shots)


def test_passwords_are_not_told():
    assert without_secrets("rtsp://me:secret@cam.local/live@1") == "rtsp://cam.local/live@1"
    with pytest.raises(VideoError) as error:
        open_feed("http://me:secret@127.0.0.1:1/")
    assert "secret" not in str(error.value)


# Films whose pictures have their own times


def test_a_film_with_its_own_times_keeps_them(tmp_path):
    from shadowpuppet.video import write_frames

    times = [0.0, 0.066, 0.2, 0.201, 0.9]
    with write_frames(tmp_path / "a.mp4", 15) as film:
        for i, t in enumerate(times):
            film.write(np.full((24, 32, 3), 30 * i, np.uint8), t)
    assert [frame.time for frame in open_frames(tmp_path / "a.mp4")] == pytest.approx(times, abs=6e-4)
    assert len(made.images(tmp_path / "a.mp4")) == 5
