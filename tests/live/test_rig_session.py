"""Several cameras live: films played together, the person measured in their first seconds and tracked in all."""

from __future__ import annotations

import itertools
from dataclasses import replace
from types import SimpleNamespace

import made
import made_rig
import numpy as np
import pytest
from follower import followed
from hypothesis import given, settings
from hypothesis import strategies as st
from solids import seen_by

from shadowpuppet.camera.mask import Seen
from shadowpuppet.errors import CalibrationError, SettingsError, TrackingError
from shadowpuppet.io.calibration.calibration_files import read_calibration
from shadowpuppet.io.run import read_run
from shadowpuppet.live.recorder import Recorder
from shadowpuppet.live.rig_capture import Pairing, RigCapture, SnapshotSet
from shadowpuppet.live.rig_session import RigSession
from shadowpuppet.live.rig_sources import is_rig, open_rig_sources
from shadowpuppet.live.run import run_live
from shadowpuppet.live.settings import LiveSettings
from shadowpuppet.live.timing import Timing
from shadowpuppet.live.watchdog import CameraWatchdog
from shadowpuppet.pipeline.options import Options
from shadowpuppet.settings import validate
from shadowpuppet.video import open_frames
from shadowpuppet.video.live_source import Feed, Snapshot, corrected

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
    chosen = replace(SETTINGS, camera=camera, still=0.1, speed=0.5, record=True)
    metrics = run_live(tmp_path / "run", options, chosen)
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
        session._see = lambda shot, images, seen=seen: Seen(tuple(seen))
        now[0] = n / 20
        outcome = session.step(SnapshotSet(now[0], tuple(each[0] for each in scene), number=n))
        assert outcome.frame is not None
        messages.append(outcome.view.message)
    assert list(outcome.view.pictures) == subject.pictures
    assert messages[4] == messages[-1] == ""
    assert messages[14] == f"set aside: {cameras[1].name} (frozen)"


def test_a_camera_that_gives_nothing_is_left_out_by_name_and_taken_back():
    cameras, now = made_rig.cameras(), [0.0]
    subject = followed(cameras)
    scene = [[np.full((*camera.size[::-1], 3), 90, np.uint8)] for camera in cameras]
    session = RigSession(Options(), SETTINGS, np.random.default_rng(0), lambda: now[0], Timing(10.0), full=tuple(cameras), scene=scene,
                         watchdogs=tuple(CameraWatchdog(camera.name, camera.size, live=True) for camera in cameras))
    session._begin_tracking(subject)
    messages, statuses, troubles, rng = [], [], [], np.random.default_rng(1)
    for n in range(60):
        now[0] = n / 10
        images = [rng.integers(80, 100, (*camera.size[::-1], 3)).astype(np.uint8) for camera in cameras]
        for mask, image in zip((seen_by(camera, made_rig.person(n)) for camera in cameras), images):
            image[mask] = 20
        there = {n: [0, 1, 2, 3] for n in range(60)} | {n: [0, 2, 3] for n in range(10, 30)} | {n: [0] for n in range(40, 55)}
        seen = tuple(image if k in there[n] else None for k, image in enumerate(images))
        outcome = session.step(SnapshotSet(now[0], seen, number=n))
        messages.append(outcome.view.message)
        troubles.append(outcome.view.trouble)
        statuses.append("" if outcome.frame is None else outcome.frame.status)
        if n == 25:  # the others' next set is not there yet
            assert session.idle(f"{cameras[1].name}: gives no more pictures").view.trouble == ""
    assert messages[9] == messages[12] == messages[32] == ""  # one picture that is lost is not worth a word
    assert messages[25] == f"set aside: {cameras[1].name} (no pictures)"
    assert troubles[53].startswith(f"{cameras[1].name}: no picture for")
    assert not any([*troubles[:41], *troubles[55:]])
    assert "" not in [*statuses[:40], *statuses[55:]]


def test_a_recording_begins_with_all_cameras_and_skips_what_one_has_not(tmp_path):
    cameras, image = made_rig.cameras(2), np.zeros((120, 160, 3), np.uint8)
    with Recorder(tmp_path, cameras, 10.0) as recorder:
        for n, images in enumerate([(image, None), (image, image), (None, image), (image, image)]):
            recorder.write(n / 10, images, [[], []], None)
    films = [open_frames(tmp_path / "video" / f"{camera.name}.mp4") for camera in cameras]
    times = [[round(frame.time, 3) for frame in film] for film in films]
    assert times == [[0.0, 0.2], [0.0, 0.1, 0.2]]


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


def test_a_frozen_camera_alone_is_opened_again():
    class Opened:
        times = 0

        def again(self):
            self.times += 1

    capture = RigCapture(())
    capture.captures = cameras = [Opened(), Opened()]
    capture.again(1)
    assert [camera.times for camera in cameras] == [0, 1]
    dogs = [SimpleNamespace(asks_again=lambda now, asks=asks: asks) for asks in (False, True, True)]
    assert RigSession.asks_again(SimpleNamespace(watchdogs=dogs), 1.0) == [1, 2]


# Pictures of several cameras, paired


def paired(streams, delays=(), rates=()):
    """The sets of streams, as (time, each camera's time of capture or None); pictures come in the order of their arrival. A stream is the
    times at which its pictures were captured."""
    delays, rates = delays or (0.0,) * len(streams), rates or (10.0,) * len(streams)
    pairing, came = Pairing(rates, delays), []
    coming = sorted((time + delay, camera, time) for camera, (times, delay) in enumerate(zip(streams, delays)) for time in times)
    for now, camera, time in coming:
        for each in pairing.add(camera, Snapshot(time, time)):  # a picture is its time here
            came.append((now, each))
    return came


def regular(first, count=40, interval=0.1):
    return (first + interval * np.arange(count)).tolist()


def test_pictures_of_one_time_are_a_set_at_once():
    sets = paired([regular(1.0), regular(0.98)])
    assert len(sets) > 38
    for now, each in sets:
        assert each.images == pytest.approx((each.captured, each.captured - 0.02))
        assert now == each.captured


def test_cameras_whose_shutters_are_evenly_apart_are_in_every_set():
    sets = paired([regular(1.0 + 0.025 * n) for n in range(4)])[1:]
    assert len(sets) > 36
    for now, each in sets:
        assert None not in each.images
        assert np.ptp(each.images) <= 0.11
        assert now - each.captured <= 0.051


@pytest.mark.parametrize("delay", [0.15, 0.5, 1.2])
def test_a_stream_that_is_late_is_paired_with_what_was_seen_when_its_pictures_were_taken(delay):
    sets = paired([regular(1.0, 60), regular(1.01, 60), regular(0.99, 60)], (0.0, delay, 0.0))
    assert len(sets) > 55
    for now, each in sets:
        assert None not in each.images
        assert np.ptp(each.images) < 0.021
        assert now - each.captured == pytest.approx(delay + 0.01)


def test_one_at_half_the_rate_is_in_every_second_set_and_of_two_it_leads():
    streams = [regular(1.0), regular(1.01), regular(1.02, 20, 0.2)]
    sets = [each.images for _, each in paired(streams)][20:36]
    assert [images[2] is None for images in sets] in ([False, True] * 8, [True, False] * 8)
    two = [each.images for _, each in paired(streams[1:], rates=(10.0, 25.0)) if each.captured > 3]  # the stated rate is a stream's: wrong
    assert 7 <= len(two) <= 10
    assert all(one is not None and abs(one - other) <= 0.055 for one, other in two)


def test_a_faster_camera_is_not_waited_for():
    sets = paired([regular(1.0), regular(1.001, 160, 0.025), regular(1.0)])[10:]
    assert len(sets) > 28
    assert max(now - each.captured for now, each in sets) < 0.002


def test_a_picture_of_long_before_is_in_no_set():
    sets = paired([[time for time in regular(1.0) if abs(time - 3.1) > 0.01], [time for time in regular(1.06) if abs(time - 3.16) > 0.01]])
    (alone,) = [each for _, each in sets[1:] if None in each.images]
    assert alone.images == (pytest.approx(3.2), None)


def test_time_goes_on_when_a_late_camera_leads_again():
    streams = [[time for time in regular(1.0, 60) if not 3.0 < time < 5.0], regular(1.04, 60)]
    moments = [each.captured for _, each in paired(streams, (0.5, 0.0))]
    assert min(np.diff(moments)) > 0.03
    assert max(np.diff(moments)) < 0.7  # what the other gave while it was waited for


def test_a_camera_that_stops_is_not_waited_for_and_taken_back():
    streams = [regular(1.0, 80), regular(1.01, 80), [time for time in regular(0.99, 80) if not 3.0 < time < 5.0]]
    sets = paired(streams)
    without = [each.captured for _, each in sets if each.images[2] is None]
    assert (min(without), max(without)) == pytest.approx((3.1, 4.9), abs=0.11)
    assert all(None not in each.images[:2] for _, each in sets)
    assert max(now - each.captured for now, each in sets) < 0.35
    assert np.quantile([now - each.captured for now, each in sets], 0.9) < 0.02


@pytest.mark.parametrize("stops", [0, 1])
def test_the_rest_goes_on_in_order_when_the_leader_stops(stops):
    streams = [regular(1.0, 60), regular(1.04, 60)]
    streams[stops] = streams[stops][:20] + streams[stops][40:]
    sets = [each for _, each in paired(streams)]
    moments = np.array([each.captured for each in sets])
    assert np.diff(moments).min() > 0.04
    assert np.diff(moments).max() < 0.2
    assert sum(each.images[stops] is None for each in sets) == pytest.approx(20, abs=2)


@given(st.data())
@settings(max_examples=60, deadline=None)
def test_whatever_comes_no_picture_is_used_twice_and_those_of_a_set_are_near(data):
    streams = []
    for _ in range(data.draw(st.integers(2, 4))):
        phase, rate = data.draw(st.floats(0, 0.1)), data.draw(st.sampled_from([5.0, 10.0, 10.0, 20.0]))
        jitter = data.draw(st.lists(st.floats(0, 0.09), min_size=30, max_size=30))
        lost = data.draw(st.sets(st.integers(0, 29)))
        streams.append([1.0 + phase + (n + shake) / rate for n, shake in enumerate(jitter) if n not in lost])
    sets = [each for _, each in paired(streams)]
    assert (np.diff([each.captured for each in sets]) > 0).all()
    for camera in range(len(streams)):
        used = [each.images[camera] for each in sets if each.images[camera] is not None]
        assert all(one < other for one, other in itertools.pairwise(used))
    assert all(abs(image - each.captured) <= 0.12 * 5 for each in sets for image in each.images if image is not None)


def test_pictures_reach_the_session_as_numbered_sets():
    capture = RigCapture([Feed(name, (2, 2), 10.0, True, lambda: iter(())) for name in "ab"])
    for n in range(3):
        for camera in capture.captures:
            camera.newest.put(Snapshot(1 + 0.1 * n, n))
    taken = capture.newest.take()
    assert (taken.images, taken.number, capture.newest.dropped) == ((2, 2), 2, 2)


def test_delays_are_taken_off_the_times_of_arrival():
    def read():
        yield Snapshot(5.0, "picture")

    one, other = (Feed(name, (2, 2), 10.0, True, read) for name in "ab")
    assert [shot.captured for feed in corrected([one, other], (0.0, 0.25)) for shot in feed.read()] == [5.0, 4.75]
    assert corrected([one, other], ()) == [one, other]
    with pytest.raises(SettingsError, match="delay: found 1 for 2 cameras"):
        corrected([one, other], (0.1,))
    with pytest.raises(SettingsError, match="delay: found one for the film a"):
        corrected([replace(one, live=False)], (0.1,))


def test_films_have_no_delay_and_the_setting_is_numbers_with_commas(recording):
    with pytest.raises(SettingsError, match=r"delay: found .* for films"):
        open_rig_sources(Options(), replace(SETTINGS, camera=str(recording), delay=(0.0, 0.1, 0.0, 0.0)))
    assert validate(LiveSettings, {"delay": "0,0.15"}, "flags").delay == (0.0, 0.15)
    assert validate(LiveSettings, {"delay": [0, 0.15]}, "flags").delay == (0.0, 0.15)


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
                              _without={}, _watch=SimpleNamespace(present={2: "late", 0: "frozen"}))  # fmt: skip
    assert RigSession._aside(watched) == "set aside: a (frozen), c (late)"
    assert RigSession._aside(SimpleNamespace(_watch=None, _without={})) == ""
