"""What a session shows: drawn pictures, the page and who may see it."""

from __future__ import annotations

import contextlib
import http.client
import json
import shutil
import socket
import threading
import time

import cv2
import numpy as np
import people
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shadowpuppet import network, page_server
from shadowpuppet.errors import SettingsError, ShadowPuppetWarning
from shadowpuppet.live.display import web
from shadowpuppet.live.display.drawing import drawn
from shadowpuppet.live.display.view import Display, DofAngle, SessionState, open_display
from shadowpuppet.live.display.web import PORT, WebDisplay
from shadowpuppet.video import read_image

ROOM = np.full((120, 160, 3), 90, np.uint8)


def tracked(**more) -> SessionState:
    picture = people.picture("rounded")
    pose = np.zeros(len(picture.body.skeleton.dofs))
    angles = tuple(DofAngle(f"{part} {name}", 20.0, -40, 90) for part in ("torso", "left", "right") for name in ("bend", "twist"))
    known = {"phase": "tracking", "status": "tracked", "overlap": 0.91, "angles": angles, "latency": 0.012, "rate": 15.0,
             "interval": 1 / 15, "image": ROOM, "mask": picture.mask(pose), "picture": picture, "pose": pose}
    return SessionState(**known | more)


# Pictures


def test_a_small_picture_is_enlarged_and_the_person_drawn_where_they_are():
    shown, bare = drawn(tracked()), drawn(tracked(mask=None, pose=None))
    assert shown is not None
    assert bare is not None
    assert shown.shape == bare.shape == (480, 640, 3)
    changed = (shown != bare).any(2)
    body = tracked().mask
    assert body is not None
    inside = np.kron(body, np.ones((4, 4), bool))
    assert changed[inside].mean() > 0.9
    assert changed[:, :40].sum() == 0
    assert (ROOM == 90).all()  # not written to


@pytest.mark.parametrize(("more", "darker"), [({}, False), ({"phase": "learning"}, True), ({"trouble": "gone"}, True),
                                              ({"phase": "waiting"}, False)])
def test_what_is_not_tracked_is_dimmed(more, darker):
    shown = drawn(tracked(mask=None, pose=None, **more))
    assert shown is not None
    assert (shown.mean() < 60) == darker


def test_grey_and_large_pictures_and_none():
    assert drawn(SessionState(phase="waiting")) is None
    grey = drawn(SessionState(phase="waiting", image=ROOM[..., 0]))
    assert grey is not None
    assert grey.shape == (480, 640, 3)
    large = drawn(SessionState(phase="waiting", image=np.zeros((1080, 1920, 3), np.uint8)))
    assert large is not None
    assert large.shape == (540, 960, 3)


@given(st.floats(allow_nan=True), st.floats(allow_nan=True), st.none() | st.floats(allow_nan=True))
def test_figures_are_json_whatever_is_not_known(latency, overlap, countdown):
    view = SessionState(phase="waiting", latency=latency, overlap=overlap, countdown=countdown, angles=(DofAngle("a b", latency, 0, 1),))
    json.dumps(view.figures(), allow_nan=False)


def test_the_chip_says_what_matters():
    assert tracked().chip == "tracked"
    assert tracked(trouble="unplugged").chip == "paused"
    assert SessionState(phase="measuring").chip == "measuring"
    assert tracked(status="").chip == "tracking"
    assert tracked(trouble="unplugged").figures()["message"] == "unplugged"


# The page


@pytest.fixture
def page():
    with WebDisplay(port=0, footer="nothing is kept") as display:
        yield display


def ask(display, path, method="GET", headers=None, read=True):
    connection = http.client.HTTPConnection("127.0.0.1", display.server.server_port, timeout=60)
    connection.request(method, path, headers=headers or {})
    answer = connection.getresponse()
    return answer, answer.read() if read else b""


def test_the_page_needs_nothing_from_elsewhere(page):
    texts = []
    assert ask(page, "/icon.svg")[1].startswith(b"<svg")
    for path, kind in (("/", "text/html"), ("/page.css", "text/css"), ("/page.js", "text/javascript")):
        answer, body = ask(page, path)
        assert (answer.status, answer.headers["Content-Type"]) == (200, f"{kind}; charset=utf-8")
        assert "default-src 'none'" in answer.headers["Content-Security-Policy"]
        assert answer.headers["Cross-Origin-Resource-Policy"] == "same-origin"
        texts.append(body.decode())
    assert "<!doctype html>" in texts[0]
    assert not any(word in text for text in texts for word in ("http://", "https://", "//cdn", "@import", "style=", "onclick=\""))
    assert page.where == f"at http://127.0.0.1:{page.server.server_port}/"
    assert ask(page, "/../web.py")[0].status == 404


def test_the_picture_is_a_jpeg_of_the_newest_view(page, tmp_path):
    page.show(tracked())
    answer, body = ask(page, "/picture.jpg")
    (tmp_path / "a.jpg").write_bytes(body)
    assert answer.headers["Content-Type"] == "image/jpeg"
    assert np.abs(read_image(tmp_path / "a.jpg").astype(int) - drawn(tracked())).mean() < 4


def test_pictures_are_pushed_and_each_ends_with_a_boundary(page):
    page.show(tracked())
    answer, _ = ask(page, "/picture.mjpeg", read=False)
    assert answer.headers["Content-Type"] == "multipart/x-mixed-replace; boundary=shadowpuppet"
    assert answer.readline() == b"--shadowpuppet\r\n"
    for n in range(2):
        assert answer.readline() == b"Content-Type: image/jpeg\r\n"
        length = int(answer.readline().split()[1])
        assert answer.readline() == b"\r\n"
        data = answer.read(length)
        assert data[:2] + data[-2:] == b"\xff\xd8\xff\xd9"
        assert answer.readline() + answer.readline() == b"\r\n--shadowpuppet\r\n"
        page.show(tracked(image=ROOM + 20 * n))
    answer.close()


def events(answer):
    for line in iter(answer.readline, b""):
        if line.startswith(b"data: "):
            yield json.loads(line[6:])


def test_figures_are_pushed_until_the_session_is_over():
    with WebDisplay(port=0, footer="nothing is kept") as page:
        page.show(tracked())
        answer, _ = ask(page, "/events", read=False)
        told = events(answer)
        first = next(told)
        assert (first["chip"], first["latency"], first["footer"]) == ("tracked", 12.0, "nothing is kept")
        assert first["angles"][0] == ["torso bend", 20.0, -40, 90]
        page.show(tracked(latency=0.02))
        assert any(view["latency"] == 20.0 for view in told)
    assert list(told)[-1] == {"over": True}


def test_views_without_a_picture_do_not_blank_the_page(page):
    page.show(tracked())
    seen = page.next(0, 0.0)[0]
    page.show(tracked(image=None, mask=None, pose=None))
    assert page.next(0, 0.0)[0] == seen
    page.show(tracked(image=None, trouble="unplugged"))
    assert page.next(0, 0.0)[1].chip == "paused"


def test_buttons_are_commands_once(page):
    for command in ("learn", "measure", "stop"):
        assert ask(page, f"/command/{command}", "POST", {"X-Shadowpuppet": "1"})[0].status == 200
        assert (page.command(), page.command()) == (command, "")
    assert ask(page, "/command/fly", "POST", {"X-Shadowpuppet": "1"})[0].status == 404


def test_other_sites_cannot_press_buttons(page):
    assert ask(page, "/command/stop", "POST")[0].status == 403
    assert ask(page, "/command/stop", "POST", {"Host": "evil.example", "X-Shadowpuppet": "1"})[0].status == 421
    assert page.command() == ""


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "http://127.0.0.1:1", "https://localhost"])
def test_pages_of_other_origins_are_refused(page, origin):
    page.show(tracked())
    for path in ("/", "/page.js", "/picture.jpg", "/picture.mjpeg", "/events"):
        answer, body = ask(page, path, headers={"Origin": origin})
        assert (answer.status, body) == (403, b"this page is served to itself only\n")
    assert ask(page, "/command/stop", "POST", {"Origin": origin, "X-Shadowpuppet": "1"})[0].status == 403
    assert page.command() == ""
    own = {"Origin": page.address.rstrip("/"), "X-Shadowpuppet": "1"}
    assert ask(page, "/", headers=own)[0].status == ask(page, "/command/stop", "POST", own)[0].status == 200


@pytest.mark.parametrize("path", ["/", "/picture.jpg", "/picture.mjpeg", "/events"])
def test_names_that_were_turned_to_this_machine_are_refused(page, path):
    page.show(tracked())
    answer, body = ask(page, path, headers={"Host": f"evil.example:{page.server.server_port}"})
    assert answer.status == 421
    assert b"\xff\xd8" not in body


def test_two_hosts_are_refused(page):
    with socket.create_connection(page.server.server_address) as raw:
        raw.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nHost: evil.example\r\n\r\n")
        raw.settimeout(60)
        assert raw.recv(100).split(b"\r\n")[0].split()[1] == b"421"


def test_the_page_listens_to_this_machine_alone_by_default(page):
    assert page.server.server_address[0] == "127.0.0.1"
    with WebDisplay("0.0.0.0", 0) as wide:
        assert not wide.server.loopback
        assert ask(wide, "/")[0].status == 200


@contextlib.contextmanager
def page_of_two(monkeypatch, limit):
    """A page that serves two connections by a limit, the address of its server, and a third connection while the two are open."""
    monkeypatch.setattr(network, limit, 2)
    with WebDisplay(port=0) as page, contextlib.ExitStack() as stack:
        address = ("127.0.0.1", page.server.server_port)
        third = [stack.enter_context(socket.create_connection(address)) for _ in range(3)][-1]
        third.settimeout(60)
        yield page, address, third, stack


def test_a_full_server_serves_again_after_a_connection_ends(monkeypatch):
    with page_of_two(monkeypatch, "MAX_CONNECTIONS") as (page, _, third, stack):
        assert third.recv(1) == b""
        stack.close()
        end = time.monotonic() + 60
        while True:  # the first two are noticed to be gone
            with contextlib.suppress(OSError, http.client.HTTPException):
                if ask(page, "/")[0].status == 200:
                    break
            assert time.monotonic() < end, "a connection that ended still counts"
            time.sleep(0.01)


def test_one_address_does_not_take_all_connections(monkeypatch):
    with page_of_two(monkeypatch, "MAX_OF_ADDRESS") as (_, address, third, _stack):
        with contextlib.suppress(ConnectionError):
            third.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
            assert third.recv(1) == b""
        try:
            other = socket.create_connection(address, source_address=("127.0.0.2", 0))
        except OSError:
            pytest.skip("this machine has one address of its own")
        with other:
            other.settimeout(60)
            other.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
            assert other.recv(100).split(b"\r\n")[0].split()[1] == b"200"


def reading_nothing(port: int, path: str) -> socket.socket:
    """A client with little room that asks and does not read."""
    raw = socket.socket()
    raw.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    raw.connect(("127.0.0.1", port))
    raw.sendall(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode())
    return raw


def test_clients_that_read_nothing_are_dropped_and_the_page_comes(monkeypatch):
    """Without a limit of the time to send, they would keep others out as long as they like."""
    monkeypatch.setattr(page_server, "SEND_SECONDS", 0.2)
    monkeypatch.setattr(network, "MAX_OF_ADDRESS", 3)
    view = tracked(image=np.random.default_rng(1).integers(0, 255, (720, 960, 3), np.uint8), mask=None, picture=None, pose=None)
    with contextlib.ExitStack() as stack:
        page = stack.enter_context(WebDisplay(port=0))
        page.show(view)
        for _ in range(3):
            stack.enter_context(reading_nothing(page.server.server_port, "/picture.mjpeg"))
        end = time.monotonic() + 20
        while True:
            page.show(view)
            with contextlib.suppress(OSError, http.client.HTTPException):
                if ask(page, "/")[0].status == 200:
                    break
            assert time.monotonic() < end, "clients that read nothing are still kept"
            time.sleep(0.01)


@pytest.mark.parametrize("begun", [b"", b"GET / HT", b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n"])
def test_half_a_request_is_ended_however_slowly_it_goes_on(monkeypatch, begun):
    monkeypatch.setattr(page_server, "REQUEST_SECONDS", 0.3)
    with WebDisplay(port=0) as page, socket.create_connection(("127.0.0.1", page.server.server_port)) as slow:
        slow.settimeout(0.05)
        slow.sendall(begun)
        end = time.monotonic() + 60
        while True:
            assert time.monotonic() < end, "it is still being waited for"
            with contextlib.suppress(TimeoutError):
                try:
                    slow.sendall(b"x")
                    if slow.recv(1000) == b"":
                        break
                except (ConnectionError, BrokenPipeError):
                    break


def test_a_stream_goes_on_after_the_time_for_requests(monkeypatch):
    monkeypatch.setattr(page_server, "REQUEST_SECONDS", 2.0)  # within which the request must have come on a loaded machine too
    with WebDisplay(port=0) as page:
        page.show(tracked())
        answer, _ = ask(page, "/events", read=False)
        told = events(answer)
        next(told)
        time.sleep(2.2)
        page.show(tracked(latency=0.02))
        assert any(view["latency"] == 20.0 for view in told)


def test_a_taken_port_is_refused_and_without_one_another_is_found():
    said = r"listen: 127.0.0.1, port: \d+: the page cannot be served there"
    with socket.create_server(("127.0.0.1", 0)) as taken, pytest.raises(SettingsError, match=said):
        WebDisplay(port=taken.getsockname()[1])
    with WebDisplay() as one, WebDisplay() as other:
        assert one.server.server_port != other.server.server_port
        assert PORT in (one.server.server_port, other.server.server_port) or one.server.server_port > 1024


# Where it is shown


def test_where_nothing_is_to_be_shown_nothing_is():
    display = open_display("none")
    assert type(display) is Display
    assert (display.where, display.command()) == ("", "")
    with display:
        display.show(tracked())


@pytest.mark.parametrize(("show", "screen", "opened"), [("auto", True, 1), ("auto", False, 0), ("browser", True, 0)])
def test_the_page_is_opened_where_there_is_a_screen(show, screen, opened, monkeypatch):
    addresses = []
    monkeypatch.setattr(network, "has_screen", lambda: screen)
    monkeypatch.setattr("webbrowser.open", addresses.append)
    with open_display(show, port=0) as display:
        assert isinstance(display, WebDisplay)
        assert addresses == [display.address] * opened
        assert "joints and angles alone are saved" in display.footer


def test_what_is_recorded_is_said():
    display = open_display("browser", port=0, record=True)
    assert isinstance(display, WebDisplay)
    assert "recorded" in display.footer
    display.server.server_close()


def test_a_page_that_others_can_see_is_said():
    with pytest.warns(ShadowPuppetWarning, match=r"the page is served at 0\.0\.0\.0: everybody who reaches this machine can see"):
        display = open_display("browser", "0.0.0.0", 0)
    assert isinstance(display, WebDisplay)
    display.server.server_close()


@pytest.mark.parametrize(("show", "successor"), [("window", "the same on a page"), ("viewer", "the body in space too")])
def test_what_is_gone_names_its_successor(show, successor):
    with pytest.raises(SettingsError, match=f"show: found '{show}', which is gone: --show browser shows {successor}"):
        open_display(show)


@contextlib.contextmanager
def browsed(page, complaints):
    """The page in Chromium without a screen, and what its scripts complain of."""
    playwright = pytest.importorskip("playwright.sync_api")
    program = next((found for name in ("chromium", "chromium-browser", "google-chrome") if (found := shutil.which(name))), None)
    if program is None:
        pytest.skip("no Chromium here")
    with playwright.sync_playwright() as tool:
        try:
            browser = tool.chromium.launch(executable_path=program, args=["--no-sandbox", "--disable-dev-shm-usage"])
        except playwright.Error as error:
            pytest.skip(f"Chromium cannot be run here: {str(error)[:200]}")
        opened = browser.new_page(viewport={"width": 1280, "height": 760})
        opened.on("console", lambda said: complaints.append(said.text))
        opened.on("pageerror", lambda error: complaints.append(str(error)))
        opened.goto(page.address, wait_until="domcontentloaded", timeout=60_000)  # the stream of pictures never ends
        yield opened
        browser.close()


def wait(opened, true, what):
    """Wait for something to come true while the browser works."""
    end = time.monotonic() + 60
    while not true():
        assert time.monotonic() < end, what
        opened.wait_for_timeout(20)


def test_keys_of_the_page_are_commands(page, monkeypatch):
    pressed = list[str]()
    monkeypatch.setattr(page, "press", pressed.append)
    with browsed(page, []) as opened:
        for key, count in (("q", 1), ("x", 1), ("Escape", 2), ("Control+b", 2), ("b", 3), ("m", 4)):
            opened.keyboard.press(key)
            wait(opened, lambda count=count: len(pressed) >= count, key)
    assert pressed == ["stop", "stop", "learn", "measure"]


def test_a_picture_is_drawn_once_for_all_pages_that_ask_at_once(page, monkeypatch):
    drawings, got, view = [], [], tracked()

    def slow(shown: SessionState) -> np.ndarray | None:
        drawings.append(shown)
        time.sleep(0.2)
        return drawn(shown)

    monkeypatch.setattr(web, "drawn", slow)
    asking = [threading.Thread(target=lambda: got.append(page.picture(7, view))) for _ in range(4)]
    for each in asking:
        each.start()
    for each in asking:
        each.join()
    assert (len(drawings), len(got), len(set(got))) == (1, 4, 1)


def test_a_browser_shows_the_page(page):
    """The chip's and the skeleton's colours are in what it shows, and no script complains."""
    complaints = []
    right, left = (slice(880, 1270), slice(10, 750)), (slice(20, 860), slice(20, 740))
    colours = [(right, (0x3F, 0xB6, 0x8B), 100), (right, (0xD0, 0x8C, 0xB8), 50),  # the chip and the left arm's bars; the right arm's
               (left, (0x56, 0xB4, 0xE9), 500), (left, (0xF0, 0xE4, 0x42), 100)]  # the silhouette's outline; the spine
    with browsed(page, complaints) as opened:

        def shows():
            page.show(tracked())
            shown = cv2.imdecode(np.frombuffer(opened.screenshot(timeout=60_000), np.uint8), cv2.IMREAD_COLOR).astype(int)
            assert shown.shape == (760, 1280, 3)
            return all((np.abs(shown[y, x] - colour[::-1]).max(-1) < 30).sum() > least for (x, y), colour, least in colours)

        wait(opened, shows, "all colours are seen")
    assert complaints == []


def test_angles_of_every_body_are_shown(page):
    from shadowpuppet.body.models import average_sizes, make_body
    from shadowpuppet.live.base_session import _angles

    complaints, body = [], make_body("anatomical", average_sizes("anatomical", 1.75))
    angles = _angles(body, np.zeros(len(body.skeleton.dofs)))
    with browsed(page, complaints) as opened:
        page.show(SessionState(phase="tracking", status="tracked", image=ROOM, angles=angles, latency=0.012, interval=1 / 15))
        wait(opened, lambda: opened.locator(".angle").count() == len(angles), "each has a bar")
        wait(opened, lambda: opened.inner_text("#latency") == "12", "the latency is said")
    assert complaints == []
