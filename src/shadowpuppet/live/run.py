"""A live run: tracks a camera into a run folder, and serves the display and the outlets. Prints nothing: it notifies a `Listener`."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import asdict
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from shadowpuppet.body.models import average_body
from shadowpuppet.errors import SettingsError
from shadowpuppet.io.calibration.calibration_files import write_calibration
from shadowpuppet.io.inputs.inputs import inputs_of
from shadowpuppet.io.person import write_person
from shadowpuppet.io.run import read_run
from shadowpuppet.io.run_writer import RunWriter
from shadowpuppet.live.base_session import Given, LiveSession, StepResult
from shadowpuppet.live.display.view import Display, LiveListener
from shadowpuppet.live.interrupt import Stop
from shadowpuppet.live.phases import in_background
from shadowpuppet.live.recorder import Recorder
from shadowpuppet.live.rig_capture import RigCapture
from shadowpuppet.live.rig_session import RigSession
from shadowpuppet.live.rig_sources import is_rig, open_rig_sources, sources_of
from shadowpuppet.live.session import CameraSession
from shadowpuppet.live.settings import LiveSettings
from shadowpuppet.live.sources import empty_scene, known_person, lens
from shadowpuppet.live.stream.outlet import Outlets, StreamSubject
from shadowpuppet.live.timing import Timing
from shadowpuppet.live.warm_up import warm_up
from shadowpuppet.live.watchdog import CameraWatchdog
from shadowpuppet.motion.metrics import evaluate
from shadowpuppet.pipeline.options import PATHS, Options, plain_options
from shadowpuppet.pipeline.stages.smooth import smooth_run
from shadowpuppet.pipeline.subject import FittedPerson, joint_names
from shadowpuppet.settings import validate
from shadowpuppet.threads import one_blas_thread
from shadowpuppet.video.capture import CameraCapture
from shadowpuppet.video.live_source import corrected, open_feed
from shadowpuppet.video.network_stream import without_secrets

IDLE = 0.05
"""Longest wait for a new picture, seconds, before the display is updated."""


class _Nobody(Exception):
    """Nobody was tracked, so there is no run to keep."""


def check_number(options: Options) -> None:
    """Raise `SettingsError` for several people."""
    if (options.people or 1) > 1:
        raise SettingsError(f"people: found {options.people} for a live session, expected 1: `track` follows several, also in what "
                            "--record has kept")


@one_blas_thread()
def run_live(folder: str | Path, options: Options | None = None, settings: LiveSettings | None = None,
             listener: LiveListener | None = None, display: Display | None = None,
             clock: Callable[[], float] = time.monotonic, outlets: Outlets | None = None) -> dict[str, Any] | None:
    """Track a camera, or several, into a run folder, until Ctrl-C, the display's command `stop` or a film's end.

    Also sends every frame to the `outlets`. In addition to the files that `io.run` describes, the folder gets person.toml,
    calibration.toml and, with `LiveSettings.record`, recording/. Returns the contents of metrics.json; None if nobody was tracked, and then
    no folder remains. Raises a `ShadowPuppetError` if something cannot be used.
    """
    options, settings = options or Options(), settings or LiveSettings()
    listener, display = listener or LiveListener(), display or Display()
    outlets = outlets or Outlets()
    check_number(options)
    several = is_rig(settings.camera)
    body = average_body((options.multiview if several else options.tracker).body)
    told = validate(LiveSettings, asdict(settings) | {"camera": without_secrets(settings.camera)})
    info = {"camera": told.camera, "method": f"{'Ni 2008, several cameras' if several else 'Liu 2011, one camera'}, live",
            "started": datetime.now().astimezone().isoformat("T", "seconds"),
            "settings": plain_options(options), "live": told}
    folder = Path(folder)
    try:
        inputs = inputs_of(sources_of(settings.camera), {name: getattr(options, name) for name in PATHS})
        with outlets, RunWriter(folder, body.name, body.skeleton.dof_names, joint_names(body), info, inputs) as run:
            session = _Live(run, options, settings, listener, display, clock, outlets)
            session.run()
            smooth_run(run, session.subjects, options, listener, run.motion, session.session.leans)
            cameras = session.session.worked_cameras
            found = evaluate(run.motion, camera=None if several else cameras[0], cameras=len(cameras))
            run.metrics |= found
    except _Nobody:
        return None
    return read_run(folder).metrics | found


class _Live:
    """The parts of a live run: session, capture, run folder, display, outlets."""

    def __init__(self, run: RunWriter, options: Options, settings: LiveSettings, listener: LiveListener, display: Display,
                 clock: Callable[[], float], outlets: Outlets) -> None:
        self.run_, self.options, self.listener, self.display, self.clock = run, options, listener, display, clock
        self.outlets, self.settings, self.stop = outlets, settings, Stop()
        self.session, self.capture, self.rate, self.is_live = self._several() if is_rig(settings.camera) else self._single()
        self.recorder = Recorder(run.folder / "recording", self.session.worked_cameras, self.rate) if settings.record else None
        self.frames, self.breaks, self.broke, self.said = 0, 0, np.nan, ""
        self.subjects = list[tuple[int, FittedPerson]]()
        """Measured persons, each with its first frame."""

    def _single(self) -> tuple[LiveSession, CameraCapture | RigCapture, float, bool]:
        """The session of one camera, its reader, its frames/s, and whether it is live (not a film)."""
        options, settings = self.options, self.settings
        person = known_person(options)
        feed = open_feed(settings.camera, rate=settings.rate, speed=settings.speed, start=options.start, end=options.end)
        (feed,) = corrected([feed], settings.delay)
        full = lens(options, feed.size)
        session = CameraSession(options, settings, np.random.default_rng(options.seed), self.clock, Timing(feed.rate), in_background,
                          full=full, watchdog=CameraWatchdog(feed.name, feed.size, feed.live), person=person,
                          scene=empty_scene(options, full))
        return session, CameraCapture(feed), feed.rate, feed.live

    def _several(self) -> tuple[LiveSession, CameraCapture | RigCapture, float, bool]:
        """The session of several cameras, their reader, their frame sets/s, and whether they are live (not films)."""
        sources = open_rig_sources(self.options, self.settings)
        watchdogs = tuple(CameraWatchdog(camera.name, size, sources.live) for camera, size in zip(sources.cameras, sources.sizes))
        session = RigSession(self.options, self.settings, np.random.default_rng(self.options.seed), self.clock, Timing(sources.rate),
                             in_background, full=sources.cameras, watchdogs=watchdogs, scene=sources.scenes, height=sources.height)
        return session, sources.capture, sources.rate, sources.live

    def run(self) -> None:
        """Process all pictures. Raises `_Nobody` if no person was tracked."""
        try:
            with ExitStack() as stack:
                stack.enter_context(self.stop)
                stack.enter_context(self.display)
                if self.recorder is not None:
                    stack.enter_context(self.recorder)
                self._open(stack)
                self._follow()
        except KeyboardInterrupt:
            if self.frames or self.stop.wished:  # the second one, if `wished`
                raise
        finally:
            self.run_.metrics |= self._measures()
        if not self.frames:
            raise _Nobody

    def _open(self, stack: ExitStack) -> None:
        """Warm up and start reading. Reading starts before the warm-up for a camera, and after it for a film."""
        self.listener.begin("getting ready")
        self.stop.hasty = True
        if self.is_live:
            stack.enter_context(self.capture)
        warm_up(self.session.worked_cameras, self.options)
        if not self.is_live:
            stack.enter_context(self.capture)
        self.stop.hasty = False
        self.listener.begin(self.session.phase)
        if self.display.where:
            self.listener.note(f"to be seen {self.display.where}")
        if self.outlets.where:
            self.listener.note(f"given to other programs: {self.outlets.where}")

    def _follow(self) -> None:
        """Process pictures as they come. A film stands still on its last picture while the person is measured."""
        last = None
        while not (self.stop.wished or self._is_over):
            shot = self.capture.newest.take(IDLE)
            if shot is None and not self.is_live and self.session.phase == "measuring":
                shot = last
            last = shot
            outcome = self.session.step(shot) if shot is not None else self.session.idle(self.capture.problem)
            self.capture.hold(self.session.phase == "measuring")
            self._keep(outcome)
            self._tell(outcome)
            self.display.show(outcome.view)
            if (command := self.display.command()) == "stop":
                break
            self.session.ask(command)
        self._give(self.session.rest())
        if self.capture.error is not None:
            raise self.capture.error

    @property
    def _is_over(self) -> bool:
        """Whether a film has ended, and nothing waits for its last picture."""
        return self.capture.ended and not self.capture.newest.waiting and (self.is_live or self.session.phase != "measuring")

    def _give(self, given: tuple[Given, ...]) -> None:
        for frame, age in given:
            self.outlets.follow(frame, age)

    def _keep(self, outcome: StepResult) -> None:
        for camera in self.session.asks_again(self.clock()):
            self.capture.again(camera)
        if outcome.frame is None:
            self._give(outcome.given)
            return
        if self.session.newly_measured():
            self.subjects.append((self.frames, self._person))
            self._write_beside()
            self.outlets.begin(self._stream_subject())
        self._give(outcome.given)
        self.run_.write(outcome.frame)
        self.frames += 1
        self.listener.advance(self.frames)
        if self.recorder is not None:
            self.recorder.write(outcome.frame.time, outcome.images, self.session.scenes, self._person.person.height)

    @property
    def _person(self) -> FittedPerson:
        assert self.session.subject is not None
        return self.session.subject

    def _stream_subject(self) -> StreamSubject:
        """The measured person, for the outlets."""
        base, floor = self.session.placed()
        return StreamSubject(self._person.body, base, self._person.person.height, floor)

    def _write_beside(self) -> None:
        """Write person.toml and calibration.toml; called again whenever the person was measured again."""
        self.run_.begin()
        write_person(self.run_.folder / "person.toml", self._person.person)
        write_calibration(self.run_.folder / "calibration.toml", self.session.cameras)

    def _tell(self, outcome: StepResult) -> None:
        """Report changes to the listener, each once."""
        view, now = outcome.view, self.clock()
        if said := self.outlets.trouble():
            self.listener.trouble(said)
        if view.trouble and np.isnan(self.broke):
            self.broke, self.breaks = now, self.breaks + 1
            self.listener.trouble(view.trouble)
        elif not view.trouble and view.image is not None and not np.isnan(self.broke):
            self.listener.note(f"pictures come again, after {now - self.broke:.1f} s")
            self.broke = np.nan
        if not view.trouble and (said := _said(view.phase, view.message, view.countdown)) != self.said:
            self.said = said
            if said:
                self.listener.note(said)

    def _measures(self) -> dict[str, Any]:
        live = {"pictures": self.capture.newest.put_count, "dropped": self.session.timing.dropped, "breaks": self.breaks}
        live |= {"outlets": counts} if (counts := self.outlets.counts()) else {}
        return {"live": live | self.session.timing.summary()}


def _said(phase: str, message: str, countdown: float | None) -> str:
    """The message of a view, with the seconds of a countdown; empty when the countdown reaches 0."""
    if countdown is None:
        return message or phase
    return f"{message}: {np.ceil(countdown):.0f}" if countdown > 0 else ""
