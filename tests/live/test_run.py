"""Live runs as a user types them: a film played at its own rate, a camera that is not there, Ctrl-C."""

from __future__ import annotations

import contextlib
import functools
import io
import itertools
import json
import math
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from dataclasses import replace

import made
import numpy as np
import pytest
from listeners import OscEar
from live_film import EMPTY, FLAGS, FOV, HEIGHT, QUICK, RATE, frames
from websockets.sync.client import connect

from shadowpuppet.cli import app as cli
from shadowpuppet.errors import ShadowPuppetError, ShadowPuppetWarning, VideoError
from shadowpuppet.io import run_writer
from shadowpuppet.io.files.lock import LOCK
from shadowpuppet.io.person import read_person
from shadowpuppet.io.run import read_run
from shadowpuppet.io.run_writer import write_metrics
from shadowpuppet.live import run as live_run
from shadowpuppet.live.display.view import Display, LiveListener
from shadowpuppet.live.run import run_live
from shadowpuppet.live.settings import LiveSettings
from shadowpuppet.live.sources import lens
from shadowpuppet.pipeline.options import make_options
from shadowpuppet.video import write_image
from shadowpuppet.video.live_source import Feed, Snapshot

SHORT = ["--learn", "0.8", "--still", "0.3"]
OPTIONS = make_options(QUICK | {"height": HEIGHT, "distance": 2.0, "fov": FOV})
SETTINGS = LiveSettings(countdown=0.2, learn=0.8, still=0.3, show="none")


@pytest.fixture(scope="module")
def pictures(tmp_path_factory):
    return frames(tmp_path_factory.mktemp("made") / "live", (320, 240))


@pytest.fixture(scope="module")
def film(pictures, tmp_path_factory):
    """The empty scene, and the person, who waves to and fro."""
    path = tmp_path_factory.mktemp("film") / "live.mp4"
    made.write_film(path, [*pictures[0], *pictures[1], *pictures[1][:44:-1]], RATE)
    return path


def command(film, folder, *more, countdown=0.2):
    given = ["--height", HEIGHT, "--fov", FOV, "--distance", 2.0, "--show", "none", "--countdown", countdown, *SHORT, *more]
    return ["live", "--camera", str(film), "-o", str(folder), *map(str, given)]


@pytest.fixture(scope="module")
def played(film, tmp_path_factory):
    """A film played at its own rate through the command line, with the default tracker; how long that took, and what it said."""
    folder, out, err = tmp_path_factory.mktemp("run") / "run", io.StringIO(), io.StringIO()
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        patch.setenv("COLUMNS", "80")
        start = time.monotonic()
        assert cli.run([*command(film, folder), *FLAGS[4:]]) == 0
    return read_run(folder), time.monotonic() - start, out.getvalue(), err.getvalue()


# A film played at its own rate


def test_a_film_is_played_at_its_own_rate_and_tracked(played, film):
    run, seconds, _, _ = played
    length = len(made.images(film)) / RATE
    assert seconds > length - 0.5
    assert run.complete
    assert run.motion.times[0] > EMPTY
    assert run.motion.times[-1] == pytest.approx(length - 1 / RATE, abs=0.5)
    np.testing.assert_allclose(run.motion.times * RATE, np.round(run.motion.times * RATE), atol=1e-3)  # the film's own times
    assert run.motion.status_counts["tracked"] > 0.8 * len(run.motion)


def test_latency_is_at_most_two_frames(played):
    """Of a film of 15 Hz at 320 x 240, by the default tracker; about 0.2 frames where nothing else runs, and more on a loaded machine."""
    load = os.getloadavg()[0] / (os.cpu_count() or 1)
    live = played[0].metrics["live"]
    assert live["interval_ms"] == pytest.approx(1000 / RATE, rel=0.05)
    assert 0 < live["latency_frames"]["median"] < 2 * max(1.0, load)
    assert live["latency_ms"]["median"] == pytest.approx(live["latency_frames"]["median"] * live["interval_ms"], rel=0.02)
    assert live["latency_ms"]["median"] <= live["latency_ms"]["p95"] <= live["latency_ms"]["max"]


def test_every_picture_is_worked_on_or_counted_as_dropped(played):
    run = played[0]
    live, motion = run.metrics["live"], run.motion
    assert round((motion.times[-1] - motion.times[0]) * RATE) + 1 == live["dropped"] + len(motion)


def test_the_folder_tells_how_it_was_made_and_keeps_no_picture(played, film):
    run = played[0]
    names = {path.name for path in run.folder.iterdir()}
    assert names == {"raw.csv", "joints.csv", "angles.csv", "angles.toml", "intervals.csv", "motion.npz", "run.toml", "metrics.json",
                     "person.toml", "calibration.toml"}
    assert run.info["camera"] == str(film)
    assert run.info["live"]["countdown"] == 0.2
    assert run.info["smoothing"]["method"] == "tracker"
    assert run.metrics["live"]["smoothed_latency_ms"]["median"] > run.metrics["live"]["latency_ms"]["median"] + 50
    assert run.info["settings"]["height"] == HEIGHT
    assert read_person(run.folder / "person.toml").height == HEIGHT
    assert json.loads((run.folder / "metrics.json").read_text())["overlap"]["mean"] > 0.8


def test_what_is_said_and_shown(played):
    run, _, out, err = played
    for line in ("step out of the picture, or stay and move: 1", "stay out, or keep moving: finding the empty scene: 1",
                 "measuring: one moment", "tracking"):
        assert line in err.splitlines()
    for word in ("latency", "from capture to pose", "frames/s of 15", "dropped", str(run.folder / "joints.csv")[-20:]):
        assert word in out.replace("\n", "")
    assert max(map(len, out.splitlines())) <= 80


def test_what_was_recorded_can_be_tracked_again_and_a_background_file_is_taken_instead_of_the_countdown(film, pictures, tmp_path):
    write_image(tmp_path / "empty.png", pictures[0][0])
    heard, options = Heard(), replace(OPTIONS, background=tmp_path / "empty.png")
    run_live(tmp_path / "run", options, replace(SETTINGS, camera=str(film), speed=1.5, record=True), heard, Presses(heard, 12))
    assert not any("step out" in note for note in heard.notes)
    motion, recording = read_run(tmp_path / "run").motion, tmp_path / "run" / "recording"
    assert len(made.images(recording / "video" / "cam.mp4")) == len(motion) == 12
    assert cli.run(["track", str(recording), "-o", str(tmp_path / "again"), "--quiet", *FLAGS]) == 0
    again = read_run(tmp_path / "again").motion
    assert again.times == pytest.approx(motion.times - motion.times[0], abs=2e-3)
    neck = motion.joint_names.index("neck")
    assert np.median(np.abs(again.joints[:, neck] - motion.joints[:, neck])) < 0.15


@pytest.mark.whole
def test_a_film_without_an_empty_scene_is_tracked_after_its_first_seconds_by_its_name_alone(pictures, tmp_path, capsys):
    """Nobody steps out of the picture or stands still, and no picture is lost while the person is measured."""
    film = tmp_path / "film.mp4"
    made.write_film(film, [*pictures[1][40:], *pictures[1][:39:-1], *pictures[1][40:]], RATE)
    given = ["--height", HEIGHT, "--fov", FOV, "--show", "none", "--learn", "1.5", "-o", tmp_path / "run", *FLAGS]
    assert cli.run(["live", *map(str, [film, *given])]) == 0
    run = read_run(tmp_path / "run")
    assert run.motion.times[0] < 2.0
    assert run.motion.status_counts["tracked"] > 0.8 * len(run.motion)
    assert "step out" not in capsys.readouterr().err
    assert cli.run(["live", str(film), "--camera", "0"]) == 2


def test_a_film_with_nobody_in_it_leaves_nothing(pictures, tmp_path, capsys):
    made.write_film(tmp_path / "empty.mp4", pictures[0], RATE)
    assert cli.run(command(tmp_path / "empty.mp4", tmp_path / "run", "--speed", "2")) == 0
    err = capsys.readouterr().err
    assert "nobody was tracked: nothing was written; the film ended before" in err
    assert f"`shadowpuppet track {tmp_path / 'empty.mp4'}` follows the person in all of it" in err
    assert not (tmp_path / "run").exists()


# What cannot be


@pytest.mark.parametrize(("flags", "said"), [
    (["--show", "none", "--camera", "77"], "camera 77: gives no picture; is it connected, and not in use by another program?"),
    (["--show", "none", "--camera", "nowhere.mp4"], "nowhere.mp4: no such film"),
    (["--show", "none", "--camera", "rtsp://127.0.0.1:1/x"], "no stream of pictures there that can be read"),
    (["--show", "none", "--camera", "gopher://x"], "found an address of the kind 'gopher'"),
    (["--show", "tv"], "tv"),
    (["--show", "none", "--learn", "0"], "learn: found 0"),
    (["--port", "1", "--listen", "127.0.0.999", "--show", "browser"], "listen: 127.0.0.999, port: 1: the page cannot be served there"),
])  # fmt: skip
def test_what_cannot_be_is_said_in_a_line(flags, said, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cli.run(["live", "--height", "1.8", "--fov", "60", *flags]) == 2
    err = capsys.readouterr().err.splitlines()
    assert len(err) == 1
    assert err[0].startswith("error: ")
    assert said in err[0]
    assert not list(tmp_path.iterdir())


def test_a_folder_with_other_things_is_refused_before_the_camera_is_opened(tmp_path):
    (tmp_path / "thesis.tex").touch()
    with pytest.raises(Exception, match=r"found thesis.tex in it but no run.toml"):
        run_live(tmp_path, OPTIONS, replace(SETTINGS, camera="no camera"))


def test_a_calibration_for_another_size_is_refused(film, tmp_path):
    from shadowpuppet.camera.camera import Camera
    from shadowpuppet.io.calibration.calibration_files import write_calibration

    write_calibration(tmp_path / "c.toml", [Camera.from_fov((640, 480), 1.0)])
    options = replace(OPTIONS, fov=None, calibration=tmp_path / "c.toml")
    with pytest.raises(Exception, match="size: found 640 x 480 pixels, expected 320 x 240 as the camera gives them"):
        run_live(tmp_path / "run", options, replace(SETTINGS, camera=str(film)))
    assert not (tmp_path / "run").exists()


def test_what_is_assumed_is_said(film, tmp_path):
    with pytest.warns(ShadowPuppetWarning, match="65 degrees are assumed"), pytest.warns(ShadowPuppetWarning, match="give --height"):
        run_live(tmp_path / "run", make_options(QUICK), replace(SETTINGS, camera=str(film), speed=20.0))


def test_an_upright_camera_sees_less_from_side_to_side():
    with pytest.warns(ShadowPuppetWarning, match="39 degrees are assumed"):
        camera = lens(make_options({}), (1080, 1920))
    assert camera.size == (1080, 1920)


# Stops


class Heard(LiveListener):
    """Keeps what it is told."""

    def __init__(self):
        self.notes, self.troubles, self.frames = [], [], 0

    def note(self, message):
        self.notes.append(message)

    def trouble(self, message):
        self.troubles.append(message)

    def advance(self, frames):
        self.frames = frames


class Presses(Display):
    """A display on which stop is pressed after some frames."""

    def __init__(self, heard, frames):
        self.heard, self.frames = heard, frames

    def command(self):
        return "stop" if self.heard.frames >= self.frames else ""


def test_the_stop_button_ends_a_run_that_is_whole(film, tmp_path):
    heard = Heard()
    metrics = run_live(tmp_path / "run", OPTIONS, replace(SETTINGS, camera=str(film)), heard, Presses(heard, 8))
    run = read_run(tmp_path / "run")
    assert (run.complete, len(run.motion)) == (True, 8)
    assert metrics == run.metrics


def test_a_film_that_changes_while_it_is_played_makes_no_complete_run(film, tmp_path):
    own, heard = tmp_path / "own.mp4", Heard()
    own.write_bytes(film.read_bytes())

    class Changes(Presses):
        def command(self):
            os.utime(own, (1, 1))
            return super().command()

    with pytest.raises(ShadowPuppetError, match=r"run: own.mp4 has changed while the run went on: it is not complete"):
        run_live(tmp_path / "run", OPTIONS, replace(SETTINGS, camera=str(own)), heard, Changes(heard, 8))
    assert not read_run(tmp_path / "run").complete


def test_measures_are_written_while_the_folder_is_locked(film, tmp_path, monkeypatch):
    heard, seen = Heard(), list[tuple[bool, set[str]]]()

    def written(folder, metrics):
        seen.append(((folder / LOCK).exists(), set(metrics)))
        write_metrics(folder, metrics)

    monkeypatch.setattr(run_writer, "write_metrics", written)
    metrics = run_live(tmp_path / "run", OPTIONS, replace(SETTINGS, camera=str(film)), heard, Presses(heard, 4))
    assert seen == [(True, set(metrics))]  # no measure comes after the lock is given back


def begun(film, folder, **more):
    """A session in a process of its own that heeds Ctrl-C, even where the tests run in the background."""
    heeding = functools.partial(signal.signal, signal.SIGINT, signal.SIG_DFL)
    tokens = [sys.executable, "-m", "shadowpuppet", *command(film, folder, **more), *FLAGS]
    return subprocess.Popen(tokens, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=heeding)


def test_control_c_is_the_normal_end(film, tmp_path):
    folder = tmp_path / "run"
    child, end = begun(film, folder), time.monotonic() + 300
    rows = folder / "joints.csv"
    while child.poll() is None and time.monotonic() < end and (not rows.exists() or rows.read_text().count("\n") < 6):
        time.sleep(0.02)
    child.send_signal(signal.SIGINT)
    out, err = child.communicate(timeout=300)
    assert child.returncode == 0, err
    assert "Traceback" not in err
    assert "from capture to pose" in out
    run = read_run(folder)
    assert run.complete
    assert 5 <= len(run.motion) < 8 * RATE
    assert run.metrics["live"]["latency_ms"]["median"] > 0


def test_control_c_before_anybody_is_tracked_leaves_nothing(film, tmp_path):
    child = begun(film, tmp_path / "run", countdown=60)
    assert child.stderr is not None
    assert any("step out of the picture" in line for line in iter(child.stderr.readline, ""))
    child.send_signal(signal.SIGINT)
    _, err = child.communicate(timeout=300)
    assert child.returncode == 0
    assert re.search("nobody was tracked: nothing was written", err)
    assert not (tmp_path / "run").exists()


TWICE = """
import os, signal, sys
from shadowpuppet.live import run

end = run._Live._give

def second(self, given):
    end(self, given)
    if self.stop.wished:
        os.kill(os.getpid(), signal.SIGINT)

run._Live._give = second
sys.argv = ["shadowpuppet", *sys.argv[1:]]
from shadowpuppet.cli.entry import main
main()
"""
"""A session that hears a second Ctrl-C as soon as it heeds the first."""


@pytest.mark.parametrize("tracked", [False, True])
def test_a_second_control_c_aborts(film, tmp_path, tracked):
    folder, heeding = tmp_path / "run", functools.partial(signal.signal, signal.SIGINT, signal.SIG_DFL)
    tokens = [sys.executable, "-c", TWICE, *command(film, folder, countdown=0.2 if tracked else 60), *FLAGS]
    child = subprocess.Popen(tokens, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=heeding)
    rows = folder / "joints.csv"
    assert child.stderr is not None
    assert any("step out of the picture" in line for line in iter(child.stderr.readline, ""))
    while tracked and child.poll() is None and (not rows.exists() or rows.read_text().count("\n") < 6):
        time.sleep(0.02)
    child.send_signal(signal.SIGINT)
    out, err = child.communicate(timeout=300)
    assert (child.returncode, out) == (130, "")
    assert "Traceback" not in err
    assert err.splitlines()[-1].startswith("interrupted: the" if tracked else "interrupted: nothing was written")
    assert folder.exists() == tracked
    assert not tracked or not read_run(folder).complete


# Other programs


def test_other_programs_get_every_frame_while_it_is_tracked(film, tmp_path, capsys):
    folder = tmp_path / "run"
    with OscEar() as ear, socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        heard, texts = [], []
        listening = threading.Thread(target=lambda: heard.extend(ear.heard(60)), daemon=True)
        listening.start()
        port = free.getsockname()[1]
        free.close()

        def listen():
            for _ in range(30_000):
                with contextlib.suppress(OSError), connect(f"ws://127.0.0.1:{port}") as session:
                    texts.extend(session)
                    return
                time.sleep(0.01)

        reading = threading.Thread(target=listen, daemon=True)
        reading.start()
        at_once = ("--speed", 2, "--lag", 0, "--smooth", "off")
        assert cli.run([*command(film, folder, "--osc", ear.port, "--websocket", port, *at_once), *FLAGS]) == 0
        reading.join(60)
        listening.join(60)
        heard += ear.heard(0.1)
    motion, told = read_run(folder).motion, read_run(folder).metrics["live"]["outlets"]
    assert f"WebSocket at ws://127.0.0.1:{port}/" in capsys.readouterr().err
    begin, *frames = map(json.loads, texts)
    assert begin["type"] == "begin"
    assert begin["height"] == HEIGHT
    places = {frame["time"]: frame["joints"] for frame in frames}
    shared = [n for n, seconds in enumerate(motion.times) if round(float(seconds), 6) in places]
    assert len(shared) > 0.8 * len(motion)
    wrist = begin["joints"].index("left_wrist"), motion.joint_names.index("left_wrist")
    for n in shared:
        if motion.status[n] == "tracked":
            found = places[round(float(motion.times[n]), 6)][wrist[0]]
            np.testing.assert_allclose(found, motion.joints[n, wrist[1]], atol=2e-5)
    assert told["osc"] == {"sent": len(motion), "failed": 0}
    assert told["websocket"] == {"served": 1, "refused": 0}
    assert 0 < len([0 for address, _ in heard if address == "/VMC/Ext/T"]) <= len(motion)
    assert all(0 < frame["age"] < 10 for frame in frames)


# Cameras that fail, from the reader to the run


def test_a_camera_that_is_unplugged_is_said_once_and_taken_up_again(pictures, tmp_path, monkeypatch):
    """It breaks off when somebody is tracked, cannot be opened twice, and returns."""
    heard, opened, views = Heard(), [], []

    def read():
        opened.append(len(opened))
        if len(opened) in (2, 3):
            raise VideoError("cam: gives no picture")
        images = itertools.chain(pictures[0] if len(opened) == 1 else [], itertools.cycle([*pictures[1][:30], *pictures[1][29::-1]]))
        for image in images:
            if len(opened) == 1 and heard.frames >= 4:
                return
            time.sleep(0.03)
            yield Snapshot(time.monotonic(), image)

    class Until(Display):
        def show(self, view):
            views.append(view)

        def command(self):
            back = any(note.startswith("pictures come again") for note in heard.notes)
            return "stop" if back and views[-1].status == "tracked" else ""

    monkeypatch.setattr(live_run, "open_feed", lambda *_, **__: Feed("cam", (320, 240), math.nan, True, read))
    monkeypatch.setattr("shadowpuppet.video.capture.FIRST_WAIT", 0.1)
    run_live(tmp_path / "run", OPTIONS, replace(SETTINGS, countdown=0.1, learn=0.5), heard, Until())
    [trouble] = heard.troubles  # of a slow machine the first that is noticed may be that it cannot be opened again
    assert trouble in ("cam: gives no more pictures (it is tried again)", "cam: gives no picture (it is tried again)")
    broken = next(n for n, view in enumerate(views) if view.trouble)
    assert {view.phase for view in views[broken:]} == {"tracking"}  # nobody had to be found again
    assert {view.chip for view in views[broken:] if view.trouble} == {"paused"}
    assert opened == [0, 1, 2, 3]
    run = read_run(tmp_path / "run")
    assert run.complete
    assert run.metrics["live"]["breaks"] == 1
    assert max(np.diff(run.motion.times)) > 0.3
