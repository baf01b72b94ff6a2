"""The run of a recording of several people: a run folder for each, and people.csv."""

from __future__ import annotations

import operator
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.camera.bits import Bits
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.errors import SettingsError, ShadowPuppetError, TrackingError
from shadowpuppet.io.inputs.inputs import NO_INPUTS, Resuming
from shadowpuppet.io.people import open_places, person_folder, write_place
from shadowpuppet.io.run import read_run
from shadowpuppet.io.run_writer import RunWriter, write_metrics
from shadowpuppet.motion.limbs import status_in_words
from shadowpuppet.motion.motion import BLANK, Motion, MotionFrame
from shadowpuppet.pipeline.findings.look import RigLook, Survey
from shadowpuppet.pipeline.findings.verdict import verdict_of_run
from shadowpuppet.pipeline.frame_process import Task, frames_beside
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.overlay_video import overlay_of_people
from shadowpuppet.pipeline.people.census import Census
from shadowpuppet.pipeline.people.corrections import put_right
from shadowpuppet.pipeline.people.fitting import fit_apart, known_sizes, one_of_several
from shadowpuppet.pipeline.people.group import Frames, Group, first_people
from shadowpuppet.pipeline.people.state import TYPES, Measured, PeopleState, PersonState
from shadowpuppet.pipeline.people.truths import matched_truths
from shadowpuppet.pipeline.person_rig import MultiviewSubject
from shadowpuppet.pipeline.progress import (
    STAGES,
    Checkpoints,
    Listener,
    StageTimer,
    evaluated,
    is_same_look,
    json_text,
    set_aside,
    timings,
    tracked,
    warn_of_set_aside,
    write_beside,
)
from shadowpuppet.pipeline.rig import Rig
from shadowpuppet.pipeline.silhouette_cache import MaskStore
from shadowpuppet.pipeline.stages.show import Drawing, show_run
from shadowpuppet.pipeline.subject import joint_names
from shadowpuppet.threads import usable_cores
from shadowpuppet.tracking.multiview.surface.visual_hull import VisualHull
from shadowpuppet.tracking.multiview.watch.rig_watch import RigWatch
from shadowpuppet.tracking.people.presence import Followed, Sighting

Smooth = Callable[[RunWriter, Sequence[tuple[int, MultiviewSubject]], Options, Listener, Motion], None]
"""Replaces the motion of a run by a given one, smoothed."""


def check_people(options: Options) -> None:
    """Raise a `ShadowPuppetError` for what a run of several people cannot do."""
    if options.person is not None and options.people != 1:
        raise SettingsError(f"person: found {options.person} for several people, expected none: each is measured; --people 1 "
                            "follows one")


class Carried(NamedTuple):
    """What a frame needs of those before it: what a checkpoint keeps. Silhouettes, and cameras set aside, follow from the films."""

    look: str
    """The text of look.json."""
    size: int
    """Of people.csv, bytes."""
    numbers: tuple[int, ...]
    """Number of frames of each person, by their numbers; 0 for one without a run so far."""
    clear: NDArray[np.bool_]
    """For each frame set, whether cameras could be judged in it."""
    people: PeopleState


@dataclass(eq=False)
class PeopleRun:
    """A run of several people into a folder."""

    writer: RunWriter
    """Of the folder in which theirs are."""
    survey: Survey
    census: Census
    options: Options
    info: dict[str, Any]
    """Entries of each person's run.toml."""
    listener: Listener

    def __post_init__(self) -> None:
        """Start without people."""
        self.rig: Rig = self.survey.rig
        self.folder: Path = self.writer.folder
        self.writers = dict[int, RunWriter]()
        self.metrics = dict[str, Any]()
        self.times = list[float]()
        """Of the frame sets that were read, seconds."""
        self.store = MaskStore()
        """Their silhouettes, if an overlay is asked for."""

    def track(self, for_fit: np.random.Generator, for_track: np.random.Generator, smooth: Smooth) -> dict[int, dict[str, Any]]:
        """Track all people; returns each person's metrics by number, none if no person is found."""
        carried: Carried | None = self.writer.hand_over((*TYPES, Carried))
        if carried is not None and not is_same_look(carried.look, json_text(self.survey.look)):
            raise ShadowPuppetError(f"{self.folder}: the run there cannot go on: its look.json differs from what the recording gives now")
        self.listener.begin(f"measuring {self.census.number} people")
        group, people = self._group(for_fit, for_track, carried)
        with ExitStack() as stack:
            people = self._follow(group, people, stack, carried)
            motions = {number: writer.motion for number, writer in self.writers.items()}
            for number, motion in put_right(people, motions, group.subject).items():
                subject = group.subject(people.people[number - 1].measured)
                smooth(self.writers[number], [(0, subject)], self.options, self.listener, motion)
            show_run(self.writer, self.survey, self.options, self.listener, self.store, self._drawings(group, people))
            truths = matched_truths({n: writer.motion for n, writer in self.writers.items()}, self.rig.recording.truths)
            for n, truth in truths.items():
                self.writers[n].info["truth"] = str(truth.resolve())
            self.writer.check()  # before each person's run is complete
        found = {n: self._finished(n, truths.get(n)) for n in self.writers}
        write_metrics(self.folder, self.metrics | {"people": len(found)})
        warn_of_set_aside(self.metrics.get("set_aside", []))
        return found

    def _drawings(self, group: Group, people: PeopleState) -> Iterator[Drawing]:
        """All people's motions in each frame set."""
        found: dict[float, list[tuple[int, MotionFrame, Sequence[Picture]]]] = {time: [] for time in self.times}
        for number, writer in self.writers.items():
            for frame in writer.motion.frames():
                found[frame.time].append((number, frame, group.subject(people.people[number - 1].sizes_at(frame.time)).pictures))
        for moment, each in found.items():
            said = [f"person {number} {status_in_words(frame.status, pictures[0].body.landmark_names, frame.limb_status)}"
                    for number, frame, pictures in each]  # fmt: skip
            yield partial(overlay_of_people, cameras=self.rig.cameras, people=each), f"{moment:.2f} s: {'; '.join(said) or 'no person yet'}"

    def _finished(self, number: int, truth: Path | None) -> dict[str, Any]:
        """The metrics of a person's finished run, written into its folder."""
        folder = person_folder(self.folder, number)
        run = read_run(folder)
        recording = replace(self.rig.recording, truth=truth)
        metrics = run.metrics | evaluated(replace(self.rig, recording=recording), run.motion)
        frames = len(self.times), tracked(self.survey.look.frames, self.options.every)
        metrics["verdict"] = verdict_of_run(self.survey.look, run.motion, self.metrics.get("set_aside", ()), frames).plain()
        write_metrics(folder, metrics)
        return metrics

    def _group(self, for_fit: np.random.Generator, for_track: np.random.Generator, carried: Carried | None) -> tuple[Group, PeopleState]:
        """How people are followed; and those of the first seconds, measured, or those of a checkpoint."""
        rate, floor, first, options = self.rig.rate / self.options.every, self.census.floor, self.survey.first, self.options
        subjects, known = dict[bytes, MultiviewSubject](), None if options.person is None else known_sizes(options)
        shown = dict(zip(first.times, first.keypoints))
        fit_seed, track_seed = (int(rng.integers(2**63)) for rng in (for_fit, for_track))

        def subject(measured: Measured) -> MultiviewSubject:
            key = measured.sizes.tobytes()
            if key not in subjects:
                subjects[key] = one_of_several(np.random.default_rng(fit_seed), self.rig.cameras, options, rate, measured)
            return subjects[key]

        def fit(rng: np.random.Generator, seen: Sequence[Sighting]) -> Measured:
            return fit_apart(rng, floor, options, rate, seen, shown) if known is None else known

        hull = VisualHull(self.rig.cameras, options.multiview.hull, company=True)
        group = Group(floor, hull, fit, subject, track_seed, options.people)
        if carried is not None:
            return group, carried.people
        found = first_people(floor, first.times, [first.seen(n) for n in range(len(first.times))], options.people)

        def measured(found: Followed, seed: int) -> Measured | None:
            try:
                return fit(np.random.default_rng(seed), found.sightings)
            except TrackingError:
                return None  # may be found later

        with ThreadPoolExecutor(usable_cores(), "sizes") as pool:
            fitted = list(pool.map(measured, found, for_fit.integers(2**63, size=len(found)).tolist()))
        people = [(each, sizes) for each, sizes in zip(found, fitted) if sizes is not None]
        return group, PeopleState(tuple(PersonState(n, sizes, each.height, each.sightings[0].figure.place)
                                        for n, (each, sizes) in enumerate(people, 1)))  # fmt: skip

    def _follow(self, group: Group, people: PeopleState, stack: ExitStack, carried: Carried | None) -> PeopleState:
        """For each frame set: segment, compute the hull, follow all people, write. Returns the last state."""
        survey, options, timer, checkpoints = self.survey, self.options, StageTimer(), Checkpoints()
        look = survey.look
        assert isinstance(look, RigLook)
        watch = RigWatch(len(self.rig.footage), self.rig.short)
        self.listener.begin("tracking", tracked(look.frames, options.every))
        began = time.perf_counter()
        write_beside(self.folder, look, self.rig)
        places = stack.enter_context(open_places(self.folder, None if carried is None else carried.size))
        task = Task(self.rig, survey.silhouettes, options.masks, options.every, images=False, corrected=options.appearance, hull=group.hull)
        frames = stack.enter_context(closing(frames_beside(task)))
        clear = [] if carried is None else carried.clear.tolist()
        earlier = iter(self._earlier(group, people, carried, stack))

        def judged(found: Mapping[int, MotionFrame], is_clear: bool) -> None:
            drawn = [group.subject(people.people[n - 1].sizes_at(frame.time)).drawn(frame) for n, frame in found.items()]
            watch.tracked(_together(drawn) if is_clear else ())

        try:
            for now in timer.each("wait", frames):
                seen = watch(now.time, now.seen)
                self.times.append(now.time)
                if options.overlay:
                    self.store.add(now.time, seen)
                if (known := next(earlier, None)) is not None:
                    judged(*known)
                    began = time.perf_counter()
                    continue
                timer.add(decode=now.decoding, segment=now.segmenting, hull=now.carving)
                with timer.time("hull"):
                    points = now.points
                    if points is None or not all(map(operator.is_, seen.masks, now.seen.masks)):
                        points = group.hull.points(seen.masks)
                with timer.time("track"):
                    people = group.next(people, Frames(now.time, points, seen, now.corrected if options.appearance else ()))
                with timer.time("write"):
                    found = self._write(group, people, stack, places)
                    clear.append(people.is_clear)
                    judged(found, clear[-1])
                    checkpoints.keep(partial(self._keep, people, places, clear))
                self.listener.advance(len(clear))
        finally:
            count = len(clear) - (0 if carried is None else len(carried.clear))
            self.metrics |= timings(timer, STAGES, count, time.perf_counter() - began) | set_aside(watch.intervals, self.rig.names)
        return people

    def _keep(self, people: PeopleState, places: BinaryIO, clear: Sequence[bool]) -> None:
        """Write a checkpoint."""
        numbers = tuple(len(self.writers[each.number]) if each.number in self.writers else 0 for each in people.people)
        self.writer.checkpoint(Carried(json_text(self.survey.look), places.tell(), numbers, np.array(clear), people.kept()))

    def _earlier(self, group: Group, people: PeopleState, carried: Carried | None,
                 stack: ExitStack) -> list[tuple[dict[int, MotionFrame], bool]]:
        """The frames of each frame set before a checkpoint, by person, and whether cameras could be judged in it."""
        if carried is None:
            return []
        found = [(dict[int, MotionFrame](), is_clear) for is_clear in carried.clear.tolist()]
        for person, number in zip(people.people, carried.numbers):
            if number:
                frames = self._open(person, group.subject(person.measured), stack, number)
                for (of_set, _), frame in zip(found[len(found) - number :], frames, strict=True):
                    of_set[person.number] = frame
        return found

    def _write(self, group: Group, people: PeopleState, stack: ExitStack, places: BinaryIO) -> dict[int, MotionFrame]:
        """Write a frame of each person found so far."""
        found = dict[int, MotionFrame]()
        for person in people.people:
            number, frame = person.number, person.frame
            if frame is None or (person.state is None and number not in self.writers):
                continue
            subject = group.subject(person.measured)
            if number not in self.writers:
                self._open(person, subject, stack)
            self.writers[number].write(frame)
            if person.measured_at == frame.time:
                self._write_person(number, subject)
            place = np.full(2, np.nan) if person.state is None or frame.status in BLANK else group.place(person)
            write_place(places, frame.time, number, frame.status, place)
            found[number] = frame
        places.flush()
        return found

    def _open(self, person: PersonState, subject: MultiviewSubject, stack: ExitStack, number: int = 0) -> list[MotionFrame]:
        """Open the writer of a person's run; returns the earlier run's frames, of this `number`, after which it goes on."""
        body, info = subject.body, self.info | {"person": person.number}
        resume = Resuming(bool(number), NO_INPUTS)  # the group's writer watches the inputs
        writer = RunWriter(person_folder(self.folder, person.number), body.name, body.skeleton.dof_names, joint_names(body), info, resume,
                           of_group=True)
        self.writers[person.number] = stack.enter_context(writer)
        frames = writer.go_on(number) if number else []
        writer.begin()
        self._write_person(person.number, subject)
        return frames

    def _write_person(self, number: int, subject: MultiviewSubject) -> None:
        """Write the person's sizes, and what the look found of them."""
        write_beside(person_folder(self.folder, number), self.survey.look_with(subject.summary, subject.doubts), self.rig, subject.person)


def _together(drawn: Sequence[tuple[Bits, ...]]) -> tuple[Bits, ...]:
    """Several bodies in each camera's picture, as bits."""
    shown = [bits for bits in drawn if bits]
    return tuple(np.bitwise_or.reduce(each) for each in zip(*shown)) if shown else ()
