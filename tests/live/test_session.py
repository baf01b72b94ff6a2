"""A live session by a fake clock: learning, waiting, measuring, tracking, and what goes wrong in between."""

from __future__ import annotations

import math
import subprocess
import sys
from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest
from live_film import EMPTY, HEIGHT, QUICK, RATE, Clock, frames

from shadowpuppet.body.models import average_sizes, make_body
from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import SettingsError
from shadowpuppet.live import base_session
from shadowpuppet.live.first_look import look_at, scene_of
from shadowpuppet.live.phases import KEPT, MOVING, BackgroundCollector, StandStillDetector, in_background, unfit
from shadowpuppet.live.session import CameraSession
from shadowpuppet.live.settings import LiveSettings
from shadowpuppet.live.timing import Timing
from shadowpuppet.live.watchdog import FIRST_PATIENCE, CameraWatchdog
from shadowpuppet.pipeline.options import make_options
from shadowpuppet.settings import validate
from shadowpuppet.video.live_source import Snapshot

SIZE = (160, 120)
OPTIONS = make_options(QUICK | {"height": HEIGHT, "distance": 2.0})
SETTINGS = LiveSettings(countdown=0.5, learn=1.0, still=0.4, lag=0)


@pytest.fixture(scope="module")
def pictures(tmp_path_factory):
    return frames(tmp_path_factory.mktemp("made") / "live", SIZE)


class Stage:
    """A session, and a camera and a clock that are told what to do."""

    def __init__(self, settings=SETTINGS, options=OPTIONS, live=True, size=SIZE, work=None):
        self.clock, self.number = Clock(), 0
        full, dog = Camera.from_fov(size, np.radians(60)), CameraWatchdog("cam", size, live)
        more = {} if work is None else {"work": work}
        self.session = CameraSession(options, settings, np.random.default_rng(1), self.clock, Timing(RATE), full=full, watchdog=dog, **more)

    def give(self, image, after=1 / RATE, cost=0.0):
        """A picture after some seconds, which takes some seconds to work on."""
        self.clock.now += after
        shot = Snapshot(self.clock.now, image, None, self.number)
        self.number += 1
        self.clock.now += cost
        return self.session.step(shot)

    def play(self, images, **more):
        return [self.give(image, **more) for image in images]

    def idle(self, seconds, problem=""):
        self.clock.now += seconds
        return self.session.idle(problem)

    def to_tracking(self, pictures):
        empty, person = pictures
        self.play(empty)
        self.play(person[:20])
        assert self.session.phase == "tracking"
        return self


@pytest.fixture(scope="module")
def whole(pictures):
    """All pictures, one after another; how far away the person stands is not known."""
    stage = Stage(options=replace(OPTIONS, distance=None))
    return stage, stage.play([*pictures[0], *pictures[1]])


@pytest.fixture(scope="module")
def begun(pictures):
    return Stage().to_tracking(pictures)


@pytest.fixture
def tracking(begun):
    """A session in which somebody is tracked."""
    return deepcopy(begun)


# The way of a session


def test_phases_follow_one_another(whole):
    _, outcomes = whole
    phases = [outcome.view.phase for outcome in outcomes]
    changes = [phase for before, phase in zip(["", *phases], phases) if phase != before]
    assert changes == ["learning", "measuring", "waiting", "measuring", "tracking"]


def test_the_countdown_counts_down_and_then_the_learning(whole):
    _, outcomes = whole
    learning = [outcome.view for outcome in outcomes if outcome.view.phase == "learning"]
    out = [view.countdown for view in learning if view.message.startswith("step out of the picture")]
    stay = [view.countdown for view in learning if view.message.startswith("stay out")]
    assert out[0] == pytest.approx(SETTINGS.countdown)
    assert stay[0] == pytest.approx(SETTINGS.learn, abs=1.1 / RATE)
    assert (np.diff(out) < 0).all()
    assert (np.diff(stay) < 0).all()
    assert len(learning) == pytest.approx((SETTINGS.countdown + SETTINGS.learn) * RATE, abs=2)


def test_who_stood_still_is_tracked(whole):
    stage, outcomes = whole
    tracked = [outcome for outcome in outcomes if outcome.frame is not None]
    assert len(tracked) > 60
    assert all(outcome.frame.status == "tracked" for outcome in tracked)
    assert np.mean([outcome.view.overlap for outcome in tracked]) > 0.75
    assert stage.session.measured.guess.height == pytest.approx(HEIGHT)
    assert stage.session.measured.guess.distance == pytest.approx(2.0, abs=0.35)
    hands = np.array([outcome.frame.joints for outcome in tracked])
    assert np.ptp(hands[..., 2], axis=0).max() > 0.3  # they waved


def test_the_colours_of_arms_are_learnt(whole):
    assert whole[0].session._state.colours.rest.sum() > 0


def test_rows_have_the_camera_s_times(whole):
    _, outcomes = whole
    times = [outcome.frame.time for outcome in outcomes if outcome.frame is not None]
    np.testing.assert_allclose(np.diff(times), 1 / RATE)
    assert times[0] > EMPTY


def test_angles_are_reported_in_degrees_within_their_limits(whole):
    _, outcomes = whole
    for angle in outcomes[-1].view.angles:
        assert angle.low - 1 <= angle.value <= angle.high + 1
    assert {angle.name for angle in outcomes[-1].view.angles} >= {"torso bow", "left shoulder abduction", "right elbow flexion"}
    assert len(outcomes[-1].view.angles) == 11


def test_limits_of_angles_are_whole_degrees_and_half_a_turn_where_there_are_none():
    body = make_body("anatomical", average_sizes("anatomical", 1.7))
    pose = body.skeleton.pose(root_heading=1.0, left_elbow_flexion=0.5)
    found = {angle.name: angle for angle in base_session._angles(body, pose)}
    assert found["root heading"][1:] == (pytest.approx(57.29578), -180, 180)
    assert found["left elbow flexion"][1:] == (pytest.approx(28.64789), 0, 150)
    assert "root x" not in found
    assert np.isnan([angle.value for angle in base_session._angles(body, None)]).all()


def test_the_same_seed_is_the_same_session(pictures, tracking):
    again = Stage().to_tracking(pictures)
    for image in pictures[1][20:30]:
        one, other = tracking.give(image).frame, again.give(image).frame
        np.testing.assert_array_equal(one.joints, other.joints)


def test_what_takes_seconds_is_waited_for_beside_the_pictures(pictures):
    asked, todo = [], []

    def later(task):
        todo.append(task)
        return lambda: asked.append(1) or (task() if len(asked) % 4 == 0 else None)

    stage = Stage(work=later)
    outcomes = stage.play([*pictures[0], *pictures[1][:30]])
    assert [outcome.view.phase for outcome in outcomes].count("measuring") == 8
    assert stage.session.phase == "tracking"
    assert all(outcome.view.image is not None for outcome in outcomes)
    assert len(todo) == 2  # the scene, and the person


def test_work_in_the_background_gives_its_result_or_its_error():
    import threading

    go = threading.Event()
    result = in_background(lambda: go.wait(60) and 7)
    assert result() is None
    go.set()
    for thread in threading.enumerate():
        if thread.name == "measuring":
            thread.join(60)
    assert result() == 7
    failed = in_background(lambda: 1 // 0)
    for thread in threading.enumerate():
        if thread.name == "measuring":
            thread.join(60)
    with pytest.raises(ZeroDivisionError):
        failed()


def test_the_program_s_end_waits_for_a_task():
    text = ("import time\nfrom shadowpuppet.live.phases import in_background\n"
            "in_background(lambda: (time.sleep(0.3), print('measured', flush=True)))")
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("measured\n", "")


def test_known_sizes_are_kept(pictures):
    from shadowpuppet.body.anthropometry import sizes_from_height
    from shadowpuppet.io.person import Person

    sizes = sizes_from_height(1.72)
    stage = Stage(options=make_options(QUICK | {"distance": 2.0}))
    stage.session.person = Person(sizes, 1.72)
    stage.to_tracking(pictures)
    assert stage.session.measured.guess.sizes == sizes
    assert stage.session.measured.guess.height == 1.72


@pytest.mark.parametrize("silhouette", [{"method": "averaging"}, {"clean": False}])
def test_in_plain_silhouettes_people_are_tracked_but_not_measured(pictures, silhouette):
    stage = Stage(options=make_options(QUICK | {"height": HEIGHT, "distance": 2.0, "silhouette": silhouette})).to_tracking(pictures)
    plain = stage.give(pictures[1][22]).view.mask
    clean = Stage().to_tracking(pictures).give(pictures[1][22]).view.mask
    assert (plain & clean).sum() > 0.6 * clean.sum()
    assert (plain != clean).any()
    assert stage.session.measured.guess.sizes == Stage().to_tracking(pictures).session.measured.guess.sizes


def test_a_known_background_is_not_learnt_again(pictures):
    full = Camera.from_fov(SIZE, np.radians(60))
    parts = np.random.default_rng(1), Clock(), Timing(RATE)
    session = CameraSession(OPTIONS, SETTINGS, *parts, full=full, watchdog=CameraWatchdog("cam", SIZE, True), scene=pictures[0][:5])
    assert session.phase == "waiting"


def test_larger_pictures_are_scaled(pictures):
    stage = Stage(options=replace(OPTIONS, max_size=80))
    stage.to_tracking(pictures)
    outcome = stage.give(pictures[1][25])
    assert outcome.view.image.shape == (60, 80, 3)
    assert outcome.frame.status == "tracked"


def test_a_region_that_is_none_is_refused():
    with pytest.raises(SettingsError, match=r"region: found 0,0,999,10"):
        Stage(options=replace(OPTIONS, region=(0, 0, 999, 10)))


@pytest.mark.parametrize("values", [{"learn": 0}, {"speed": 0}, {"speed": "fast"}, {"show": "tv"}, {"port": 70000}, {"camra": "0"}])
def test_impossible_settings_are_refused(values):
    with pytest.raises(SettingsError, match=f"flags: .*{next(iter(values))}"):
        validate(LiveSettings, values, "flags")


# Learning


def test_pictures_are_collected_after_the_countdown_and_spread(pictures):
    learner, seen = BackgroundCollector(0.2, 8.0), 0
    while not learner.see(seen / RATE, pictures[0][0]):
        seen += 1
    times = np.array([time for time, _ in learner.pictures.kept])
    assert seen / RATE == pytest.approx(8.2, abs=1 / RATE)
    assert KEPT <= len(times) < 2 * KEPT
    assert times[0] == pytest.approx(0.2, abs=1 / RATE)
    assert times[-1] > 7.5
    assert np.ptp(np.diff(times)) < 1e-9


def test_the_empty_scene_is_found_behind_who_moves(pictures):
    empty, person = pictures
    scene = scene_of(person[::2])
    assert scene is not None
    unlike = np.abs(scene.pictures[0].astype(float) - np.mean(empty, axis=0)).max(2) > 25
    assert unlike[~scene.covered].mean() < 0.01


def test_a_scene_in_which_nothing_moves_is_taken_as_it_is(pictures):
    assert scene_of(pictures[0]) is None
    stage = Stage()
    stage.play(pictures[0])
    assert len(stage.session.scenes[0]) > 5


@pytest.mark.whole
def test_who_never_leaves_the_picture_is_tracked_and_measured_again(pictures):
    person = pictures[1]
    stage = Stage(SETTINGS, replace(OPTIONS, distance=None), live=False)
    outcomes = stage.play([*person, *person[::-1]])
    frames = [outcome.frame for outcome in outcomes if outcome.frame is not None]
    assert stage.session.scenes == ([],)
    assert len(frames) > len(person)
    assert np.mean([frame.status == "tracked" for frame in frames]) > 0.9
    truth = Stage().to_tracking(pictures)
    mask, seen = (one.give(person[40]).view.mask for one in (truth, stage))
    assert (mask & seen).sum() > 0.8 * (mask | seen).sum()


def test_a_new_look_that_shows_less_changes_nothing(tracking, pictures, monkeypatch):
    kept = tracking.session.fit
    monkeypatch.setattr("shadowpuppet.live.session.GAIN", 1.0)
    tracking.play([*pictures[1][20:], *pictures[1][:20]])
    assert tracking.session.fit is kept
    monkeypatch.setattr("shadowpuppet.live.session.GAIN", -1.0)
    tracking.session._due = 0.0
    tracking.play(pictures[1][20:24])
    assert tracking.session.fit is not kept
    assert tracking.session.newly_measured()


def test_a_break_while_learning_begins_the_countdown_again(pictures):
    stage = Stage()
    stage.play(pictures[0][:12])
    stage.idle(5.0)
    again = stage.give(pictures[0][12])
    assert (again.view.phase, again.view.countdown) == ("learning", pytest.approx(SETTINGS.countdown))


# Waiting


def blob(x0=30, x1=60, y0=20, y1=100, size=(100, 100)):
    mask = np.zeros(size, bool)
    mask[y0:y1, x0:x1] = True
    return mask


@pytest.mark.parametrize(("mask", "said"), [
    (blob(), ""),
    (np.zeros((100, 100), bool), "step into the picture"),
    (blob(40, 45, 50, 60), "step into the picture"),
    (blob(y0=0), "step back: the head"),
    (blob(10, 90, 10, 90), "step back"),
    (blob(0, 40), "move to the middle"),
    (blob(60, 100), "move to the middle"),
    (np.ones((100, 100), bool), "nearly all of the picture has changed"),
])  # fmt: skip
def test_people_who_cannot_be_measured_are_reported_why(mask, said):
    assert unfit(mask).startswith(said)
    assert bool(unfit(mask)) == bool(said)


def test_a_person_must_stand_still_for_a_while():
    waiter = StandStillDetector(1.0)
    walking = [waiter.see(t / 10, blob(10 + 4 * t, 40 + 4 * t)) for t in range(10)]
    assert walking == [None] * 10
    standing = [waiter.see(1.0 + t / 10, blob(46, 76)) for t in range(20)]
    first = next(k for k, masks in enumerate(standing) if masks)
    assert 10 <= first <= 14
    assert 1 <= len(standing[first]) <= 6


def test_stillness_begins_again_after_a_break():
    waiter = StandStillDetector(1.0)
    for t in range(9):
        assert waiter.see(t / 10, blob()) is None
    waiter.wait()
    assert waiter.see(5.0, blob()) is None
    assert waiter.see(5.1, blob()) is None


def test_who_never_stands_still_is_measured_all_the_same():
    waiter, now, found = StandStillDetector(1.0), 0.0, None
    while found is None:
        found = waiter.see(now, blob(30 + int(40 * now) % 30, 60 + int(40 * now) % 30))
        now += 0.1
    assert now == pytest.approx(MOVING, abs=0.25)
    assert len(found) > 6


def test_what_is_no_person_is_not_tracked(pictures):
    """A board in the picture: nobody's body fits it."""
    stage, empty = Stage(), pictures[0]
    stage.play(empty)
    board = empty[0].copy()
    board[40:60, 10:150] = (20, 20, 230)
    noisy = [np.clip(board.astype(int) + np.random.default_rng(i).integers(-2, 3, board.shape), 0, 255).astype(np.uint8) for i in range(20)]
    outcomes = stage.play(noisy)
    assert stage.session.phase != "tracking"
    assert any("no person's shape" in outcome.view.message for outcome in outcomes)


@pytest.mark.parametrize(("overlaps", "found"), [((0.0, 0.9, 0.9), True), ((0.0, 0.0, 0.9), False)])
def test_a_measurement_is_good_if_most_silhouettes_fit(tracking, overlaps, found):
    session = tracking.session
    fit = replace(session.measured, overlaps=dict(enumerate(overlaps)))
    task = session._task(None)._replace(fit=lambda masks: fit)
    looked = look_at(task, [np.ones((120, 160), bool)], session._scene, [])
    assert (looked.fit is fit) == found
    assert looked.tried


def test_who_is_measured_again_keeps_the_height_that_was_measured(tracking):
    session, known = tracking.session, tracking.session.measured
    session.ask("measure")
    task = session._task(replace(known.guess, height=1.62))
    assert (task.fit.keywords["height"], task.fit.keywords["distance"], task.fit.keywords["sizes"]) == (1.62, None, known.guess.sizes)


def test_stillness_begins_again_after_pictures_did_not_come(pictures):
    stage = Stage()
    stage.play([*pictures[0], *pictures[1][:8]])  # of which the last stand still, but not for long enough
    assert not np.isnan(stage.session._still._since)
    stage.idle(5.0)
    assert stage.give(pictures[1][8]).view.phase == "waiting"
    assert stage.play(pictures[1][9:20])[-1].view.phase in ("measuring", "tracking")


# Leaving and returning


def test_who_is_lost_for_long_is_advised_to_be_measured_again(pictures, tracking, monkeypatch):
    plain = base_session.motion_frame

    def lost(*args):
        frame, before = plain(*args)
        return frame._replace(status="lost"), before

    def said(count):
        return [tracking.give(image, after=0.5).view.message for image in pictures[1][25 : 25 + count]]

    advice = "the body does not fit any more: measure again"
    for _ in range(2):  # the second time it is counted again
        monkeypatch.setattr(base_session, "motion_frame", lost)
        assert said(7) == [""] * 5 + [advice] * 2
        monkeypatch.setattr(base_session, "motion_frame", plain)
        assert said(1) == [""]


def test_a_person_who_leaves_is_absent_and_tracked_again_when_they_return(pictures, tracking):
    empty, person = pictures
    stage = tracking
    gone = stage.play(empty[:8])
    back = stage.play(person[30:40])
    assert {outcome.frame.status for outcome in gone} == {"absent"}
    assert all(outcome.view.pose is None for outcome in gone)
    assert all(outcome.frame.status in ("tracked", "uncertain") for outcome in back)
    assert all(outcome.view.overlap > 0.5 for outcome in back)


def test_the_background_can_be_learnt_again_and_the_person_stays(pictures, tracking):
    empty, person = pictures
    stage = tracking
    fit = stage.session.measured
    rows, columns = np.indices(empty[0].shape[:2]) // 10
    lamp = np.where((rows + columns) % 2, 70, -50)[..., None]  # spots: neither exposure nor a smooth change makes them
    brighter = [np.clip(image + lamp, 0, 255).astype(np.uint8) for image in [*empty, *person]]
    lit = stage.play(brighter[len(empty) : len(empty) + 5])
    assert "let the background be learnt again" in lit[-1].view.message
    stage.session.ask("learn")
    outcomes = stage.play(brighter[: len(empty)])
    assert outcomes[0].view.phase == "learning"
    after = stage.play(brighter[len(empty) + 5 : len(empty) + 12])
    assert stage.session.measured is fit
    assert after[-1].frame.status == "tracked"
    assert stage.session.timing.dropped == 0


def test_a_person_can_be_measured_again_with_the_sizes_known(pictures, tracking):
    stage = tracking
    sizes = stage.session.measured.guess.sizes
    assert stage.session.newly_measured()
    assert not stage.session.newly_measured()
    stage.session.ask("measure")
    outcomes = stage.play(pictures[1][:25])
    assert outcomes[0].view.phase == "waiting"
    assert stage.session.phase == "tracking"
    assert stage.session.newly_measured()
    assert stage.session.measured.guess.sizes == sizes


# Smoothed motion, some frames later


def lagging(pictures, lag=0.2):
    return Stage(replace(SETTINGS, lag=lag)).to_tracking(pictures)


def shaking(frames):
    joints = np.array([frame.joints for frame in frames])
    return np.abs(np.diff(joints, n=2, axis=0)).mean()


def test_with_a_lag_the_same_frames_come_later_and_smoother_with_their_own_pictures(pictures):
    stage = lagging(pictures)
    before = len(stage.session.rest())  # of the frames until here
    outcomes = stage.play(pictures[1][20:40], cost=0.01)
    assert before == 3
    assert [len(outcome.given) for outcome in outcomes] == [0] * 3 + [1] * 17
    given = [outcome.given[0] for outcome in outcomes[3:]]
    raw = [outcome.frame for outcome in outcomes]
    assert [each.frame.time for each in given] == [frame.time for frame in raw[:-3]]
    assert shaking([each.frame for each in given]) < 0.8 * shaking(raw)
    for outcome, first in zip(outcomes[3:], outcomes):
        (frame, age), view = outcome.given[0], outcome.view
        assert view.image is first.images[0]
        assert view.lag == 0.2
        assert [stage.session.subject.picture] == list(view.pictures)
        assert age == view.latency == pytest.approx(3 * (1 / RATE + 0.01) + 0.01)
        np.testing.assert_array_equal(view.pose, frame.pose)
    smoothed = stage.session.timing.summary()["smoothed_latency_ms"]
    assert smoothed["median"] > 3000 / RATE


def test_frames_that_wait_are_given_when_the_pictures_break_off_or_the_person_is_measured_again(pictures):
    stage = lagging(pictures)
    stage.session._due = np.inf  # no new look
    stage.session.rest()
    stage.play(pictures[1][20:30])
    silent = stage.idle(2.0)
    assert silent.view.trouble
    assert len(silent.given) == 3
    assert not stage.session.rest()
    stage.play(pictures[1][30:33])
    stage.session.ask("measure")
    assert len(stage.give(pictures[1][33]).given) == 3


@pytest.mark.parametrize(("lag", "values", "expected"), [(None, {}, 0.1), (None, {"preset": "liu2011"}, 0), (None, {"smooth": "off"}, 0),
                                                         (0, {}, 0), (0.3, {"smooth": "off"}, 0.3)])  # fmt: skip
def test_the_default_lag(lag, values, expected):
    assert Stage(replace(SETTINGS, lag=lag), make_options(values)).session.lag == expected


def test_without_a_lag_frames_are_given_at_once_as_tracked(pictures, tracking):
    outcome = tracking.give(pictures[1][25], cost=0.03)
    assert outcome.given == ((outcome.frame, pytest.approx(0.03)),)


# Cameras that fail


def test_a_silent_camera_is_said_and_the_person_is_kept(pictures, tracking):
    stage = tracking
    before = stage.session._state
    assert stage.idle(0.5).view.trouble == ""
    silent = stage.idle(1.0)
    assert silent.view.trouble == "cam: no picture for 2 s"
    assert (silent.frame, silent.view.chip) == (None, "paused")
    assert stage.session._state is before
    back = stage.give(pictures[1][24], after=3.0)
    assert (back.view.trouble, back.frame.status) == ("", "tracked")


def test_a_reader_s_own_word_is_passed_on_at_once(pictures, tracking):
    stage = tracking
    assert stage.idle(0.01, "cam: unplugged").view.trouble == "cam: unplugged (it is tried again)"


def test_a_frozen_picture_is_said_not_tracked_and_taken_up_when_it_moves(pictures, tracking):
    stage = tracking
    outcomes = stage.play([pictures[1][25]] * 40)
    frozen = [outcome.view.trouble == "cam: the picture stands still" for outcome in outcomes]
    assert frozen.index(True) == pytest.approx(1.5 * RATE, abs=2)
    assert all(frozen[frozen.index(True) :])
    assert all((outcome.frame is None) == still for outcome, still in zip(outcomes, frozen))
    assert stage.give(pictures[1][26]).frame.status == "tracked"


def test_a_frozen_camera_is_opened_again_now_and_then():
    dog, image = CameraWatchdog("cam", (4, 4), True), np.zeros((4, 4, 3), np.uint8)
    asked = []
    for n in range(1500):
        dog.see(n / 15, image)
        if dog.asks_again(n / 15):
            asked.append(n / 15)
    assert asked[0] == pytest.approx(1.5 + FIRST_PATIENCE, abs=0.2)
    assert np.diff(asked) == pytest.approx([FIRST_PATIENCE * 2**k for k in range(1, len(asked))], abs=0.2)
    dog.see(100.0, image + 1)
    assert not dog.asks_again(100.0)


def test_a_film_may_stand_still(pictures):
    stage = Stage(live=False).to_tracking(pictures)
    stage.session._due = np.inf
    assert all(outcome.frame is not None for outcome in stage.play([pictures[1][25]] * 40))
    assert stage.idle(60.0).view.trouble == ""


def test_pictures_of_another_size_are_refused_and_said(pictures, tracking):
    stage = tracking
    odd = stage.give(np.zeros((60, 80, 3), np.uint8))
    assert odd.view.trouble == "cam: found pictures of 80 x 60 pixels, expected 160 x 120 as before; they are not used"
    assert odd.frame is None
    assert stage.give(pictures[1][21]).frame.status == "tracked"


# Latency


def test_latency_is_from_capture_to_pose(pictures, tracking):
    stage = tracking
    late = stage.give(pictures[1][22], cost=0.03)
    assert late.view.latency == pytest.approx(0.03)


def test_timing_counts_latency_rate_and_what_was_dropped():
    timing, clock = Timing(math.nan), Clock(0.0)
    for n in range(0, 60, 2):  # every second picture is dropped
        timing.came(n / 30, n)
        timing.done(n / 30, n / 30 + (0.02 if n else 0.2), n)
    assert timing.interval == pytest.approx(1 / 30)
    assert timing.rate == pytest.approx(15)
    assert timing.dropped == 29
    found = timing.summary()
    assert found["latency_ms"] == {"median": 20, "p95": 20, "max": 200}
    assert found["latency_frames"]["median"] == pytest.approx(0.6)
    assert clock() == 0


def test_a_pause_is_neither_slow_nor_dropped():
    timing = Timing(15.0)
    assert timing.interval == pytest.approx(1 / 15)
    assert timing.summary() == {}
    for start, first in ((0.0, 0), (100.0, 500)):
        for n in range(20):
            timing.came(start + n / 30, first + n)
            timing.done(start + n / 30, start + n / 30 + 0.01, first + n)
        timing.pause()
    assert timing.dropped == 0
    assert timing.interval == pytest.approx(1 / 30)
    assert timing.summary()["frames_per_s"] == pytest.approx(30, rel=0.1)


