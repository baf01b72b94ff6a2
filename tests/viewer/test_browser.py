"""The viewer's page in a browser: Chromium without a screen, by Playwright. One browser for all; skipped where there is none."""

from __future__ import annotations

import re
import shutil
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from dataclasses import replace
from functools import partial

import cv2
import made
import numpy as np
import pytest

from shadowpuppet.live.display.view import Angle, View
from shadowpuppet.pipeline.options import make_options
from shadowpuppet.pipeline.track import track_recording
from shadowpuppet.viewer.scene.open_any import cut_scene, open_scene

pytest.importorskip("viser")
playwright = pytest.importorskip("playwright.sync_api")

FLAGS = ("--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--disable-dev-shm-usage")
PATIENCE = 30.0
"""Seconds that a page may take: it is drawn by a processor that others use too."""
ONLY_CANVAS = "body *:not(canvas):not(:has(canvas)) { visibility: hidden !important; }"

@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("viewed")
    track_recording(made.make(folder / "tiny"), folder / "run", make_options({"seed": 1}))
    return folder / "run"


@pytest.fixture(scope="module")
def browser():
    program = next((found for name in ("chromium", "chromium-browser", "google-chrome") if (found := shutil.which(name))), None)
    if program is None:
        pytest.skip("no Chromium here")
    with playwright.sync_playwright() as tool:
        try:
            opened = tool.chromium.launch(executable_path=program, args=[*FLAGS])
        except playwright.Error as error:
            pytest.skip(f"Chromium cannot be run here: {str(error)[:200]}")
        yield opened
        opened.close()


class Page:
    """A page, with all that it asked for and complained of."""

    def __init__(self, browser, address):
        self.requests, self.sockets, self.errors = [], [], []
        self.page = browser.new_page(viewport={"width": 640, "height": 420})
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.on("websocket", lambda socket: self.sockets.append(socket.url))
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("console", lambda said: self.errors.append(said.text) if said.type == "error" else None)
        self.page.goto(address, timeout=1000 * PATIENCE)
        self.page.wait_for_selector("canvas", timeout=1000 * PATIENCE)

    def seen(self):
        """The canvas alone, (H, W, 3) red green blue."""
        data = self.page.screenshot(style=ONLY_CANVAS, timeout=1000 * PATIENCE)
        return cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)[..., ::-1].astype(int)

    def wait(self, true, what):
        """Wait for something to come true."""
        end = time.monotonic() + PATIENCE
        while not true():
            assert time.monotonic() < end, what
            self.page.wait_for_timeout(100)

    def outside(self, *allowed):
        """Requests beyond those to some addresses."""
        kinds = ("data:", "blob:", *allowed)
        return [url for url in (*self.requests, *self.sockets) if not url.startswith(kinds)]


@contextmanager
def page_of(browser, address):
    page = Page(browser, address)
    try:
        yield page
    finally:
        page.page.close()


def coloured(image):
    """Pixels that are no shade of grey: people, here."""
    return int((np.ptp(image, axis=2) > 25).sum())


def moved(a, b):
    """How many cells of 6 x 6 pixels differ: pictures are drawn coarser where the processor is slow."""
    a, b = (cv2.resize(image.astype(np.float32), None, fx=1 / 6, fy=1 / 6, interpolation=cv2.INTER_AREA) for image in (a, b))
    return int((np.abs(a - b).max(2) > 18).sum())


def greenish(image):
    red, green, blue = np.moveaxis(image, 2, 0)
    return int(((green > red + 20) & (green > blue + 20)).sum())


def test_the_page_shows_the_puppet_the_timeline_moves_it_and_clicks_reach_the_program(browser, run):
    from shadowpuppet.viewer.web.scene_view import ViewOptions
    from shadowpuppet.viewer.web.serve import serving

    scene = replace(open_scene(run), charts=())  # which are canvases, too
    with serving(scene, ViewOptions(transparent=True, cameras=False)) as (address, panel), page_of(browser, address) as page:
        page.wait(lambda: coloured(page.seen()) > 300, "the puppet is seen")
        page.page.wait_for_timeout(1500)  # what fades in has done so
        first = page.seen()
        assert greenish(first) > 30  # the truth
        click = page.page.get_by_role("button", name=">", exact=True).click
        for _ in range(9):
            click()
        page.wait(lambda: panel.timeline.frame == 9, "nine steps")
        page.wait(lambda: moved(page.seen(), first) > 12, "the timeline moves the puppet")
        assert "frame 9" in page.page.inner_text("body")
        page.page.get_by_role("button", name="|<", exact=True).click()
        page.wait(lambda: moved(page.seen(), first) < 6, "back where it was")
        for key, frame in (("l", 1), ("l", 2), ("j", 1)):
            page.page.keyboard.press(key)
            page.wait(lambda frame=frame: panel.timeline.frame == frame, f"the key {key}")
        page.page.get_by_label("truth", exact=True).click()
        page.wait(lambda: not panel.view.options.figures["truth"], "a click reaches the program")
        page.wait(lambda: greenish(page.seen()) < 10, "the truth is gone")
        page.page.get_by_role("button", name="Play", exact=True).click()
        page.wait(lambda: panel.timeline.frame > 3, "it plays")
        page.page.get_by_role("button", name="Pause", exact=True).click()
        page.wait(lambda: not panel.timeline.playing, "it stays")
        address = address.rstrip("/")
        assert page.outside(address, address.replace("http", "ws")) == []
        assert page.sockets
        assert page.errors == []


def test_the_file_plays_alone(browser, run, tmp_path):
    from shadowpuppet.viewer.web.page import write_page
    from shadowpuppet.viewer.web.serve import default_view

    scene = cut_scene(open_scene(run), 0.0, 2.5)
    path = write_page(tmp_path / "run.html", scene, default_view(scene, pictures=False))
    assert path.stat().st_size < 3e6
    with page_of(browser, path.as_uri()) as page:
        page.wait(lambda: coloured(page.seen()) > 300, "the puppet is seen")
        first = page.seen()
        page.wait(lambda: moved(page.seen(), first) > 12, "it plays")
        assert page.outside(path.as_uri()) == []
        assert (page.sockets, page.errors) == ([], [])
        assert page.page.title() == "run"


def test_a_file_has_pictures_only_where_they_are_asked_for(run, tmp_path):
    """What is in the file: silhouettes are as good as transparent pictures of one colour."""
    from shadowpuppet.viewer.web import page as pages
    from shadowpuppet.viewer.web.serve import default_view

    scene, seen = cut_scene(open_scene(run), 0.0, 0.5), []
    eye = scene.cameras[0].images
    original = eye.picture
    for asked in (False, True):
        seen.clear()
        eye.picture = lambda time: seen.append(time) or original(time)
        eye.mask(99.0)
        eye._masked = (np.nan, None)
        pages.write_page(tmp_path / f"{asked}.html", scene, default_view(scene, pictures=asked))
    sizes = [(tmp_path / f"{asked}.html").stat().st_size for asked in (False, True)]
    assert sizes[1] > sizes[0] + 10_000


def test_the_command_serves_until_it_is_interrupted(browser, run):
    command = [sys.executable, "-m", "shadowpuppet", "view", str(run), "--no-open", "--port", "0"]
    heeding = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)  # tests begun in the background do not
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=heeding)
    try:
        said = process.stdout.readline()
        address = re.search(r"http://127\.0\.0\.1:\d+/", said)
        assert address, said + process.stderr.read()
        with page_of(browser, address[0]) as page:
            page.wait(lambda: coloured(page.seen()) > 300, "the puppet is seen")
    finally:
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
    assert (process.returncode, out, err) == (0, "", "")


def test_a_live_session_is_shown_and_its_buttons_are_commands(browser, run):
    from shadowpuppet.body.models import make_body
    from shadowpuppet.camera.rasterize import Picture
    from shadowpuppet.io.calibration.calibration_files import read_calibration
    from shadowpuppet.io.person import read_person
    from shadowpuppet.io.run import read_run
    from shadowpuppet.viewer.web.live import ViewerDisplay

    motion, body = read_run(run).motion, make_body("rounded", read_person(run / "person.toml", "rounded").sizes)
    camera = read_calibration(run / "calibration.toml")[0]
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = [[0, 1, 0], [0, 0, -1], [-1, 0, 0]], [0, 0.3, 2.0]
    picture = Picture(body, camera, T)
    image = np.full((*camera.size[::-1], 3), 90, np.uint8)
    with ViewerDisplay(port=0, footer="No picture is kept.") as display:
        assert display.where.startswith("at http://127.0.0.1:")
        display.show(View(phase="learning", message="step out of the picture", countdown=3.0))
        with page_of(browser, display.where.removeprefix("at ")) as page:
            page.wait(lambda: "step out of the picture" in page.page.inner_text("body"), "what to do is said")

            def shows(n):
                view = View(phase="tracking", status="tracked", overlap=0.91, image=image, mask=picture.mask(motion.poses[n]), latency=0.02,
                            rate=8.0, picture=picture, pose=motion.poses[n], angles=(Angle("left elbow flexion", 10.0, 0, 150),))
                display.show(view)
                return page.seen()

            page.wait(lambda: coloured(shows(0)) > 300, "the puppet is seen")
            page.page.wait_for_timeout(1500)
            first = shows(0)
            page.wait(lambda: moved(shows(10), first) > 12, "it moves")
            assert "overlap 0.91" in page.page.inner_text("body")
            display.show(View(phase="tracking"))  # no picture came for a moment: what was seen last stays
            page.page.wait_for_timeout(500)
            assert coloured(page.seen()) > 300
            assert "overlap 0.91" in page.page.inner_text("body")
            assert display.command() == ""
            page.page.get_by_role("button", name="Stop", exact=True).click()
            page.wait(lambda: display.command() == "stop", "a button is a command")
            assert page.errors == []
