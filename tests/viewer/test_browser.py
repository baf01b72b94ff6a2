"""The viewer's page in a browser: Chromium without a screen, by Playwright. One browser for all; skipped where there is none."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from contextlib import closing, contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path

import cv2
import made
import numpy as np
import pytest

from shadowpuppet.camera.keypoints import Keypoints
from shadowpuppet.live.display.view import SessionState
from shadowpuppet.pipeline.options import make_options
from shadowpuppet.pipeline.track import track_recording
from shadowpuppet.viewer.scene.open_any import cut_scene, open_scene

pytestmark = pytest.mark.whole

playwright = pytest.importorskip("playwright.sync_api")

FLAGS = ("--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--disable-dev-shm-usage")
PATIENCE = 60.0
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

    def __init__(self, browser, address, width=1280, scheme="light", live=False):
        """`live`: a page whose stream of pictures never ends; its own rules about what may be loaded hold."""
        self.requests, self.sockets, self.errors = [], [], []
        self.context = browser.new_context(viewport={"width": width, "height": 760}, color_scheme=scheme, bypass_csp=not live)
        self.page = self.context.new_page()
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.on("websocket", lambda socket: self.sockets.append(socket.url))
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("console", lambda said: self.errors.append(said.text) if said.type == "error" else None)
        self.page.goto(address, timeout=1000 * PATIENCE, wait_until="domcontentloaded" if live else "load")
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

    def frame(self):
        """The frame that is shown."""
        return self.page.evaluate("page.frame")

    def outside(self, *allowed):
        """Requests beyond those to some addresses."""
        kinds = ("data:", "blob:", *allowed)
        return [url for url in (*self.requests, *self.sockets) if not url.startswith(kinds)]


@contextmanager
def page_of(browser, address, **more):
    page = Page(browser, address, **more)
    try:
        yield page
    finally:
        page.context.close()


def coloured(image):
    """Pixels that are no shade of grey: people, here."""
    return int((np.ptp(image, axis=2) > 25).sum())


def moved(a, b):
    """How many cells of 6 x 6 pixels differ: pictures are drawn coarser where the processor is slow."""
    a, b = (cv2.resize(image.astype(np.float32), None, fx=1 / 6, fy=1 / 6, interpolation=cv2.INTER_AREA) for image in (a, b))
    return int((np.abs(a - b).max(2) > 18).sum())


def of_colour(image, colour):
    """Pixels of the hue of a colour, lit or shaded."""
    unit = np.array(colour) / np.linalg.norm(colour)
    lit = np.linalg.norm(image, axis=2)
    return int(((image @ unit > 0.985 * lit) & (lit > 90)).sum())


@pytest.fixture(scope="module")
def axe():
    """The text of axe-core, which finds what keeps people from using a page, from npm (`.ci/run`); empty where it is not there."""
    folders = [Path(folder) for folder in os.environ.get("NODE_PATH", "").split(os.pathsep) if folder]
    found = next((path for folder in folders if (path := folder / "axe-core" / "axe.min.js").exists()), None)
    return "" if found is None else found.read_text()


@pytest.fixture(scope="module")
def file(run, tmp_path_factory):
    """A file of a run with doubtful limbs and intervals."""
    from shadowpuppet.viewer.web.page import write_page

    return write_page(tmp_path_factory.mktemp("file") / "run.html", cut_scene(open_scene(run), 0.0, 2.5))


def test_the_page_opens_playing_with_body_truth_film_and_all_cameras(browser, run):
    from shadowpuppet.viewer.web.serve import serving

    scene = open_scene(run)
    with serving(scene, port=0) as address, page_of(browser, address) as page:
        page.wait(lambda: page.frame() > 2, "it plays")
        page.page.get_by_role("button", name="Pause", exact=True).click()
        page.wait(lambda: page.page.evaluate("document.getElementById('film').naturalWidth") > 0, "the film is in the corner")
        image = page.seen()
        for colour in ((0, 158, 115), (204, 121, 167)):
            assert of_colour(image, colour) > 100, "left and right in the overlay's colours"
        for place in ("page.stage.cameras[0].centre", "[9, -8, 3]"):  # wherever the camera stands
            assert page.page.evaluate("""place => { const stage = page.stage, camera = stage.cameras[0], own = camera.centre;
                camera.centre = place; page.frameAll();
                const at = stage.onScreen(place), box = stage.canvas;
                camera.centre = own; page.frameAll();
                return at && at[0] > 0 && at[1] > 0 && at[0] < box.clientWidth && at[1] < box.clientHeight }""", page.page.evaluate(place))
        page.page.get_by_role("button", name="First frame").click()
        first = page.seen()
        for _ in range(9):
            page.page.get_by_role("button", name="One frame on").click()
        assert page.frame() == 9
        page.wait(lambda: moved(page.seen(), first) > 12, "the timeline moves the puppet")
        for key, frame in (("l", 10), ("l", 11), ("j", 10)):
            page.page.keyboard.press(key)
            assert page.frame() == frame
        with_truth = page.seen()
        page.page.get_by_label("truth", exact=True).click()
        page.wait(lambda: moved(page.seen(), with_truth) > 3, "the truth is gone")
        page.page.get_by_role("button", name=scene.cameras[0].camera.name, exact=True).click()
        page.wait(lambda: page.page.evaluate("page.stage.through") == 0, "a click looks through the camera")
        page.wait(lambda: moved(page.seen(), with_truth) > 300, "the film is behind the body")
        particles = page.page.get_by_label("particles", exact=True)
        particles.click()
        page.wait(lambda: page.page.evaluate("page.stage.extra.particles !== null"), "particles are made")
        assert page.outside(address.rstrip("/")) == []
        assert (page.sockets, page.errors) == ([], [])


def test_the_strip_seeks_and_a_joint_on_the_body_chooses_its_curves(browser, file):
    with page_of(browser, file.as_uri()) as page:
        page.page.evaluate("page.seek(0)")
        strip = page.page.get_by_label("Status of left arm over the run")
        box = strip.bounding_box()
        strip.click(position={"x": 0.5 * box["width"], "y": 4})
        last = page.page.evaluate("page.times.length") - 1
        assert abs(page.frame() - last / 2) <= 1
        page.page.evaluate("page.data.moments = [7, 20]; document.getElementById('next').disabled = false; page.seek(3)")
        for frame in (7, 20, 7):
            page.page.get_by_role("button", name="Next doubtful moment").click()
            assert page.frame() == frame
        x, y = page.page.evaluate("""() => { const f = page.stage.figures[0], j = f.jointNames.indexOf("right elbow");
            return page.stage.onScreen(page.stage.joint(f, f.frames[page.frame], j)) }""")
        page.page.locator("#space").click(position={"x": x, "y": y})
        first, second = page.page.locator(".plot select").all()
        assert first.input_value() == "right elbow (picked)"
        assert second.input_value() == "angles: right arm"
        legend = page.page.locator(".plot .legend").first.inner_text()
        place = page.page.evaluate("""() => { const f = page.stage.figures[0];
            return page.stage.joint(f, f.frames[page.frame], f.jointNames.indexOf("right elbow")) }""")
        assert f"{place[0]:.3f} m ±" in legend, "the value at the current time, with its interval"
        plot = page.page.locator(".plot canvas").first
        plot.hover(position={"x": 60, "y": 40})
        assert page.page.locator(".plot .legend").first.inner_text() != legend, "the values at the cursor"
        plot.click(position={"x": 60, "y": 40})
        assert page.frame() < 7


def test_pictures_silhouettes_and_keypoints_of_a_file_are_switched_on_and_off(browser, run, tmp_path):
    from shadowpuppet.viewer.web.page import write_page

    scene = cut_scene(open_scene(run), 0.0, 0.6)
    size = np.array(scene.cameras[0].camera.size)

    def keypoints(time):
        spots = np.array([[0.3, 0.4], [0.7, 0.4], [0.5, 0.2 + 0.1 * time]]) * size
        return Keypoints(("left_wrist", "right_wrist", "nose"), spots[None], np.array([[1.0, 0.5, 1.0]]), np.array([-1]), "HALPE_26")

    file = write_page(tmp_path / "run.html", replace(scene, cameras=(replace(scene.cameras[0], keypoints=keypoints),)), pictures=True)
    with page_of(browser, file.as_uri()) as page:
        page.page.evaluate("page.seek(1)")
        page.wait(lambda: page.page.evaluate("['film', 'person'].every(name => document.getElementById(name).naturalWidth > 0)"), "images")
        marks = page.page.locator("#marks path")
        assert [mark.get_attribute("stroke-opacity") for mark in marks.all()] == ["1", "0.5", "1"]
        before = marks.nth(2).get_attribute("d")
        page.page.evaluate("page.seek(3); page.look(0)")
        assert marks.nth(2).get_attribute("d") != before, "they move"

        def switch(name):
            return page.page.get_by_label(name, exact=True)

        def state():
            return page.page.evaluate("""["film", "person"].map(name => document.getElementById(name)).map(
                image => image.style.visibility == "visible" ? image.className || "alone" : "")""")

        assert state() == ["alone", "over"]
        def differs(seen):
            return (np.abs(page.seen() - seen).max(2) > 18).sum()

        seen = page.seen()
        for name, told, other in (("keypoints", ["alone", "over"], 40), ("silhouettes", ["alone", ""], 3000), ("pictures", ["", ""], 3000)):
            switch(name).click()
            page.wait(lambda told=told: state() == told, name)
            page.wait(lambda seen=seen, other=other: differs(seen) > other, f"{name} are gone from what is behind the body")
            seen = page.seen()
        assert marks.count() == 0
        switch("silhouettes").click()
        page.wait(lambda: state() == ["", "alone"], "the silhouette alone")
        switch("keypoints").click()
        assert marks.count() == 3
        page.page.evaluate("page.frameAll()")
        seen = page.seen()
        switch("rays of the keypoints").click()
        page.wait(lambda: differs(seen) > 100, "rays from the camera")
        assert (page.outside(file.as_uri()), page.errors) == ([], [])


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [390, 820, 1280])
def test_the_file_plays_alone_at_any_width_and_is_open_to_all(browser, file, axe, width, scheme):
    with page_of(browser, file.as_uri(), width=width, scheme=scheme) as page:
        page.wait(lambda: page.frame() > 2, "it plays")
        page.page.evaluate("page.play(false)")
        page.wait(lambda: coloured(page.seen()) > 300, "the puppet is seen")
        assert page.page.evaluate("document.documentElement.scrollWidth") <= width, "nothing is beside the page"
        ground = page.page.evaluate("getComputedStyle(document.body).backgroundColor")
        assert (max(map(int, re.findall(r"\d+", ground))) < 60) == (scheme == "dark")
        assert page.page.locator("#show").is_visible() == (width > 820), "the panel is folded on narrow screens"
        assert page.outside(file.as_uri()) == []
        assert (page.sockets, page.errors) == ([], [])
        assert page.page.title() == "run"
        if not axe:
            pytest.skip("all but axe-core's rules was looked at: npm install axe-core, and NODE_PATH")
        page.page.evaluate(axe)
        page.page.evaluate("document.getElementById('panel').open = true")
        found = page.page.evaluate("axe.run()")["violations"]
        assert [(each["id"], [node["html"][:90] for node in each["nodes"]]) for each in found] == []


def test_the_report_of_a_run_can_be_read_on_a_phone_too(browser, run, axe):
    from shadowpuppet.evaluation.evaluation import measure_run
    from shadowpuppet.evaluation.report.page import write_report

    pytest.importorskip("matplotlib")
    write_report(run / "report.html", measure_run(run))
    with closing(browser.new_context(bypass_csp=True)) as context:
        page = context.new_page()
        page.goto((run / "report.html").as_uri())
        for width in (390, 1280):
            page.set_viewport_size({"width": width, "height": 760})
            assert page.evaluate("document.documentElement.scrollWidth") <= width, "the page is no wider than the screen"
            heights = page.evaluate("[...document.querySelectorAll('svg text')].map(each => each.getBoundingClientRect().height)")
            assert min(height for height in heights if height) >= 9, "letters of charts, pixels"
        if not axe:
            pytest.skip("all but axe-core's rules was looked at: npm install axe-core, and NODE_PATH")
        page.evaluate(axe)
        found = page.evaluate("axe.run()")["violations"]
        assert [(each["id"], [node["html"][:90] for node in each["nodes"]]) for each in found] == []


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
    others = [line for line in err.splitlines() if not line.startswith("... ")]  # progress is told of what takes long
    assert (process.returncode, out, others) == (0, "", [])


def test_a_live_session_is_shown_in_space_and_its_buttons_are_commands(browser, run):
    from shadowpuppet.body.models import make_body
    from shadowpuppet.camera.rasterize import Picture
    from shadowpuppet.io.calibration.calibration_files import read_calibration
    from shadowpuppet.io.person import read_person
    from shadowpuppet.io.run import read_run
    from shadowpuppet.viewer.web.live import SpaceDisplay

    motion, body = read_run(run).motion, make_body("rounded", read_person(run / "person.toml", "rounded").sizes)
    camera = read_calibration(run / "calibration.toml")[0]
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = [[0, 1, 0], [0, 0, -1], [-1, 0, 0]], [0, 0.3, 2.0]
    first, again = Picture(body, camera, T), Picture(body, camera, T)
    image = np.full((*camera.size[::-1], 3), 90, np.uint8)
    with SpaceDisplay(port=0, footer="No picture is kept.") as display, page_of(browser, display.address, live=True) as page:
        display.show(SessionState(phase="learning", message="step out of the picture", countdown=3.0, image=image))
        page.wait(lambda: "step out of the picture" in page.page.inner_text("body"), "what to do is said")
        assert page.page.locator("#scene").is_hidden()

        def shows(n, picture=first, **more):
            pose = motion.poses[n]
            view = {"phase": "tracking", "status": "tracked", "overlap": 0.91, "image": image, "mask": picture.mask(pose), "latency": 0.02,
                    "rate": 8.0, "picture": picture, "pictures": (picture,), "pose": pose}  # fmt: skip
            display.show(SessionState(**view | more))
            return True

        def green():
            data = page.page.locator("#space").screenshot(timeout=1000 * PATIENCE)
            return of_colour(cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)[..., ::-1].astype(int), (0, 158, 115))

        def place(joint="right wrist"):
            return page.page.evaluate("""name => { const stage = window.stage, figure = stage?.figures[0];
                return figure && stage.joint(figure, figure.frames[0], figure.jointNames.indexOf(name)) }""", joint)

        page.wait(lambda: shows(0) and place(), "the space is there")
        page.wait(lambda: green() > 100, "the puppet's left arm is seen")
        begun = place()
        page.wait(lambda: shows(10) and np.abs(np.subtract(place(), begun)).max() > 0.01, "it moves")
        page.wait(lambda: "0.91" in page.page.inner_text("#overlap"), "the overlap is said")
        page.wait(lambda: shows(10) and page.page.evaluate("stage.cameras[0].layers.pictures.ready"), "the camera has its image")
        page.wait(lambda: shows(10, pose=None, status="lost") and page.page.inner_text("#chip") == "lost", "it says lost")
        page.wait(lambda: place() is None, "without a pose there is no body")
        page.wait(lambda: shows(10, again) and page.page.evaluate("stage.data.number") == 2, "measured again: a new scene")
        page.wait(lambda: shows(10, again) and green() > 100, "the new puppet is seen")
        for name, through in (("Through the camera", 0), ("Person", None)):
            page.page.get_by_role("button", name=name, exact=True).click()
            assert page.page.evaluate("stage.through") == through
        page.page.get_by_role("button", name="Picture only", exact=True).click()
        assert page.page.locator("#scene").is_hidden()
        assert display.command() == ""
        page.page.get_by_role("button", name="Stop", exact=True).click()
        page.wait(lambda: display.command() == "stop", "a button is a command")
        assert page.errors == []
        assert page.outside(display.address.rstrip("/")) == []
