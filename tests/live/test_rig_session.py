"""Several cameras live: films played together, the person measured in their first seconds and tracked in all."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import made
import made_rig
import numpy as np
import pytest
from follower import followed

from shadowpuppet.errors import CalibrationError, SettingsError, TrackingError
from shadowpuppet.io.calibration.calibration_files import read_calibration
from shadowpuppet.io.run import read_run
from shadowpuppet.live.rig_capture import NewestSet, RigCapture, SnapshotSet
from shadowpuppet.live.rig_session import RigSession
from shadowpuppet.live.rig_sources import is_rig, open_rig_sources
from shadowpuppet.live.run import run_live
from shadowpuppet.live.settings import LiveSettings
from shadowpuppet.live.timing import Timing
from shadowpuppet.live.watchdog import CameraWatchdog
from shadowpuppet.pipeline.options import Options
from shadowpuppet.video.capture import Newest
from shadowpuppet.video.live_source import Snapshot

SETTINGS = LiveSettings(countdown=0, learn=0.3, show="none")


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    return made_rig.write(tmp_path_factory.mktemp("made") / "rig")


@pytest.fixture(scope="module")
def films(recording, tmp_path_factory):
    """Films that begin with the empty scene, as cameras would give it."""
    folder = tmp_path_factory.mktemp("films")
    for camera in made_rig.cameras():
        images = [image for kind in ("background", "video") for image in made.images(recording / kind / f"{camera.name}.mp4")]
        made.write_film(folder / f"{camera.name}.mp4", images, made_rig.RATE)
    return ",".join(str(folder / f"{camera.name}.mp4") for camera in made_rig.cameras())


@pytest.fixture
def quick(monkeypatch):
    """Measuring takes no time, and half a second of silhouettes; gives how often it was done."""
    done = []

    def fit(rng, cameras, views, options, rate, height=None, training=None):
        done.append((len(views), rate, height))
        if len(done) == 1:
            raise TrackingError("nobody is found")
        return followed(cameras)

    monkeypatch.setattr("shadowpuppet.live.rig_session.fit_in_views", fit)
    monkeypatch.setattr("shadowpuppet.live.rig_session.OPENING", 0.3)
    monkeypatch.setattr("shadowpuppet.live.run.warm_up", lambda *_: None)
    return done


@pytest.mark.filterwarnings("ignore:.*played slower")  # where the machine is busy
@pytest.mark.parametrize("source", ["folder", "films"])
def test_films_of_several_cameras_are_played_as_if_live(recording, films, quick, tmp_path, source):
    if source == "folder":
        options, camera = Options(), str(recording)
    else:
        options, camera = Options(calibration=recording / "calibration.toml", height=1.7), films
    settings = replace(SETTINGS, camera=camera, still=0.1, speed=0.5, record=True)
    metrics = run_live(tmp_path / "run", options, settings)
    assert metrics is not None
    run = read_run(tmp_path / "run")
    assert len(quick) == 2  # nobody was found at first
    assert set(run.motion.status) == {"tracked"}
    assert len(run.motion) > 0  # a busy machine drops most
    assert run.info["method"] == "Ni 2008, several cameras, live"
    assert (metrics["cameras"], "cost_m2" in metrics) == (4, True)
    assert metrics["live"]["pictures"] >= len(run.motion)
    assert [camera.name for camera in read_calibration(tmp_path / "run" / "calibration.toml")] == ["cam1", "cam2", "cam3", "cam4"]
    pelvis = run.motion.table.select(["pelvis"]).positions[:, 0]
    first = 0 if source == "folder" else 5
    true = np.array([made_rig.place(round(time * made_rig.RATE) - first) for time in run.motion.times])
    assert np.linalg.norm(pelvis - true, axis=1).max() < 0.35
    kept = sorted(path.name for path in (tmp_path / "run" / "recording" / "video").iterdir())
    assert kept == ["cam1.mp4", "cam2.mp4", "cam3.mp4", "cam4.mp4"]
    assert len(made.images(tmp_path / "run" / "recording" / "video" / "cam3.mp4")) == len(run.motion)


def test_a_camera_that_freezes_is_set_aside_by_name_and_taken_back():
    cameras, now = made_rig.cameras(), [0.0]
    subject = followed(cameras)
    scene = [[np.full((*camera.size[::-1], 3), 90, np.uint8)] for camera in cameras]
    session = RigSession(Options(), SETTINGS, np.random.default_rng(0), lambda: now[0], Timing(20.0), full=tuple(cameras), scene=scene,
                         watchdogs=tuple(CameraWatchdog(camera.name, camera.size, live=False) for camera in cameras))
    session._begin_tracking(subject)

    def masks(frame: int):
        pose = np.zeros(len(subject.body.skeleton.dofs))
        pose[:3] = 0.1 * np.sin(frame), 0, 0.9
        return [picture.mask(pose) for picture in subject.pictures]

    messages = []
    for n in range(24):
        seen = masks(n)
        seen[1] = masks(5)[1] if 5 < n < 18 else seen[1]
        session._masks = lambda shot, images, seen=seen: tuple(seen)
        now[0] = n / 20
        outcome = session.step(SnapshotSet(now[0], tuple(each[0] for each in scene), number=n))
        assert outcome.frame is not None
        messages.append(outcome.view.message)
    assert messages[4] == messages[-1] == ""
    assert messages[14] == f"set aside: {cameras[1].name} (frozen)"


def test_what_is_several(recording, films):
    assert is_rig(str(recording))
    assert is_rig(films)
    assert is_rig("0, 1")
    assert not is_rig("0")
    assert not is_rig(films.split(",")[0])


def test_several_cameras_need_a_calibration_of_as_many(recording, films):
    with pytest.raises(CalibrationError, match="found 4 cameras without a calibration"):
        open_rig_sources(Options(), replace(SETTINGS, camera=films))
    two = ",".join(films.split(",")[:2])
    with pytest.raises(CalibrationError, match=r"expected 2, in the order of --camera"):
        open_rig_sources(Options(calibration=recording / "calibration.toml"), replace(SETTINGS, camera=two))
    with pytest.raises(SettingsError, match="region: found one for several cameras"):
        open_rig_sources(Options(region=(0, 0, 9, 9)), replace(SETTINGS, camera=films))


class Source:
    """A capture that returns given frames."""

    def __init__(self) -> None:
        self.newest, self.ended = Newest(), False

    def give(self, captured: float) -> None:
        self.newest.put(Snapshot(captured, np.full((2, 2), round(10 * captured), np.uint8)))


def test_all_cameras_are_opened_again():
    class Opened:
        times = 0

        def again(self):
            self.times += 1

    capture = RigCapture((), 0.1)
    capture.captures = cameras = [Opened(), Opened()]
    capture.again()
    assert [camera.times for camera in cameras] == [1, 1]


def test_pictures_of_one_time_are_a_set():
    sources = one, other = Source(), Source()
    newest = NewestSet(sources, 0.1)
    one.give(1.0)
    assert newest.take() is None
    other.give(0.9)
    assert newest.take() is None  # it waits for the other's next
    other.give(1.04)
    taken = newest.take()
    assert taken is not None
    assert (taken.captured, taken.number, [int(image[0, 0]) for image in taken.images]) == (1.04, 0, [10, 10])
    one.give(1.1)
    other.ended = True
    assert newest.take() is None
    assert not newest.waiting


@pytest.mark.parametrize(("state", "said"), [
    ({"phase": "waiting", "_hint": "walk into the middle"}, ("walk into the middle", None)),
    ({"phase": "measuring"}, ("measuring: one moment", None)),
    ({"phase": "tracking", "_gone": True}, ("the body does not fit any more: measure again", None)),
    ({"phase": "tracking", "_gone": False, "_aside": lambda: "set aside: b (late)"}, ("set aside: b (late)", None)),
    ({"phase": "learning", "_collectors": [SimpleNamespace(left=left, message=f"{left} s") for left in (1.0, 3.0, 2.0)]}, ("3.0 s", 3.0)),
])
def test_what_is_said_in_each_phase(state, said):
    assert RigSession._message(SimpleNamespace(**state), ()) == said


def test_cameras_that_are_set_aside_are_named_in_order():
    watched = SimpleNamespace(watchdogs=[SimpleNamespace(name=name) for name in "abc"],
                              _watch=SimpleNamespace(present={2: "late", 0: "frozen"}))  # fmt: skip
    assert RigSession._aside(watched) == "set aside: a (frozen), c (late)"
    assert RigSession._aside(SimpleNamespace(_watch=None)) == ""
