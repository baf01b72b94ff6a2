"""The run of a recording of several people: a run folder for each, and people.csv."""

from __future__ import annotations

import operator
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.shapes import Body
from shadowpuppet.body.sizes import BoneSizes
from shadowpuppet.camera.bits import Bits
from shadowpuppet.errors import SettingsError, ShadowPuppetError, TrackingError
from shadowpuppet.io.inputs.inputs import NO_INPUTS, Resuming
from shadowpuppet.io.people import open_places, person_folder, write_place
from shadowpuppet.io.run import read_run
from shadowpuppet.io.run_writer import RunWriter, write_metrics
from shadowpuppet.motion.motion import Motion, MotionFrame
from shadowpuppet.pipeline.findings.look import RigLook, Survey
from shadowpuppet.pipeline.findings.verdict import verdict_of_run
from shadowpuppet.pipeline.frame_process import Task, frames_beside
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.overlay_video import overlay_of_people
from shadowpuppet.pipeline.people.census import Census
from shadowpuppet.pipeline.people.fitting import fit_apart
from shadowpuppet.pipeline.people.group import Group, first_people, seen_in
from shadowpuppet.pipeline.people.kept import TYPES, KeptGroup, kept, remade, restore
from shadowpuppet.pipeline.people.member import Look, Member, Sighting
from shadowpuppet.pipeline.people.retracing import Packed, Stretch, packed, retraced, stretches, with_final_bodies
from shadowpuppet.pipeline.people.truths import matched_truths
from shadowpuppet.pipeline.person_rig import MultiviewSubject
from shadowpuppet.pipeline.progress import (
    FALLBACK_RATE,
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
from shadowpuppet.pipeline.rig import FrameSet, Rig, read_frames
from shadowpuppet.pipeline.subject import joint_names, motion_frame
from shadowpuppet.threads import usable_cores
from shadowpuppet.tracking.frozen import Interval
from shadowpuppet.tracking.multiview.surface.visual_hull import VisualHull
from shadowpuppet.tracking.multiview.watch.rig_watch import RigWatch
from shadowpuppet.tracking.people.exchanges import given_back
from shadowpuppet.tracking.people.facing import Doubted
from shadowpuppet.tracking.people.presence import Followed
from shadowpuppet.tracking.people.tracker import place_of
from shadowpuppet.video import write_frames

Smooth = Callable[[RunWriter, Sequence[tuple[int, MultiviewSubject]], Options, Listener, Motion], None]
"""Replaces the motion of a run by a given one, smoothed."""


def check_people(options: Options) -> None:
    """Raise a `ShadowPuppetError` for what a run of several people cannot do."""
    if options.person is not None:
        raise SettingsError(f"person: found {options.person} for several people, expected none: each is measured")


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
    begun: bool
    """Whether the first people have been looked for."""
    group: KeptGroup


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
        self.aside: Sequence[Interval] = ()
        self.sets = 0
        """Number of frame sets that were read."""

    def track(self, for_fit: np.random.Generator, for_track: np.random.Generator, smooth: Smooth) -> dict[int, dict[str, Any]]:
        """Track all people; returns each person's metrics by number, none if no person is found."""
        carried: Carried | None = self.writer.hand_over((*TYPES, Carried))
        if carried is not None and not is_same_look(carried.look, json_text(self.survey.look)):
            raise ShadowPuppetError(f"{self.folder}: the run there cannot go on: its look.json differs from what the recording gives now")
        self.listener.begin(f"measuring {self.census.number} people")
        group = self._group(for_fit, for_track, carried)
        with ExitStack() as stack:
            self._follow(group, stack, carried)
            for number, motion in self._put_right(group).items():
                smooth(self.writers[number], [(0, group.members[number - 1].subject)], self.options, self.listener, motion)
            truths = matched_truths({n: writer.motion for n, writer in self.writers.items()}, self.rig.recording.truths)
            for n, truth in truths.items():
                self.writers[n].info["truth"] = str(truth.resolve())
            self.writer.check()  # before each person's run is complete
        found = {n: self._finished(n, truths.get(n)) for n in self.writers}
        write_metrics(self.folder, self.metrics | {"people": len(found)})
        warn_of_set_aside(self.metrics.get("set_aside", []))
        return found

    def _put_right(self, group: Group) -> dict[int, Motion]:
        """The people's motions with what became known later: which way they faced, and who was who."""
        motions, people = dict[int, Motion](), dict[int, tuple[Body, BoneSizes]]()
        for number, writer in self.writers.items():
            member = group.members[number - 1]
            body, sizes = member.subject.body, member.subject.person.sizes
            assert isinstance(sizes, BoneSizes)  # of a whole body
            motions[number], people[number] = member.facing.corrected(writer.motion, body, sizes), (body, sizes)
        motions = with_final_bodies(group, motions)
        if wanted := stretches(group, motions):
            self.listener.begin("following people back to the beginning")
            motions = retraced(group, motions, wanted, self._silhouettes_of(wanted))
        return given_back(motions, group.exchanges, people)

    def _silhouettes_of(self, wanted: Sequence[Stretch]) -> list[Packed]:
        """The silhouettes of some stretches, read again, without those of cameras that were set aside."""
        segment, last, found = [each.segmented for each in self.survey.silhouettes], max(each.until for each in wanted), list[Packed]()
        with closing(read_frames(self.rig, segment, ready=self.options.masks, every=self.options.every)) as frames:
            for now in frames:
                if now.time >= last:
                    break
                if any(each.begin - 1e-6 <= now.time < each.until for each in wanted):
                    aside = {each.camera for each in self.aside if each.begin <= now.time <= each.end}
                    found.append(packed(now.time, [None if n in aside else mask for n, mask in enumerate(now.seen.masks)]))
        return found

    def _finished(self, number: int, truth: Path | None) -> dict[str, Any]:
        """The metrics of a person's finished run, written into its folder."""
        folder = person_folder(self.folder, number)
        run = read_run(folder)
        recording = replace(self.rig.recording, truth=truth)
        metrics = run.metrics | evaluated(replace(self.rig, recording=recording), run.motion)
        frames = self.sets, tracked(self.survey.look.frames, self.options.every)
        metrics["verdict"] = verdict_of_run(self.survey.look, run.motion, self.metrics.get("set_aside", ()), frames).plain()
        write_metrics(folder, metrics)
        return metrics

    def _group(self, for_fit: np.random.Generator, for_track: np.random.Generator, carried: Carried | None) -> Group:
        """The people of the first seconds, measured, or those of a checkpoint."""
        rate, floor = self.rig.rate / self.options.every, self.census.floor
        first = self.survey.first

        def fit(rng: np.random.Generator, sets: Sequence[Sighting]) -> MultiviewSubject:
            return fit_apart(rng, self.rig.cameras, floor, self.options, rate, sets)

        group = Group(floor, VisualHull(self.rig.cameras, self.options.multiview.hull, company=True), fit, for_track)
        if carried is not None:
            restore(group, carried.group, lambda held: remade(for_fit, self.rig.cameras, self.options, rate, held))
            return group
        people, every = first_people(floor, first.times, [first.seen(n) for n in range(len(first.times))])
        seen = {n: Look(figures, masks, ()) for n, (figures, masks) in enumerate(zip(every, first.masks))}

        def measured(found: Followed, seed: int) -> MultiviewSubject | None:
            try:
                return fit(np.random.default_rng(seed), seen_in(found, seen))
            except TrackingError:
                return None  # may be found later

        with ThreadPoolExecutor(usable_cores(), "sizes") as pool:
            subjects = list(pool.map(measured, people, for_fit.integers(2**63, size=len(people)).tolist()))
        for found, subject in zip(people, subjects):
            if subject is not None:
                group.add(subject, found.height, found.figures[0].place)
        return group

    def _follow(self, group: Group, stack: ExitStack, carried: Carried | None) -> None:
        """For each frame set: segment, compute the hull, update all people, write."""
        survey, options, timer, checkpoints = self.survey, self.options, StageTimer(), Checkpoints()
        look = survey.look
        assert isinstance(look, RigLook)
        rate = look.rate if np.isfinite(look.rate) else FALLBACK_RATE
        watch, begun = RigWatch(len(self.rig.footage), self.rig.short), carried is not None and carried.begun
        self.listener.begin("tracking", tracked(look.frames, options.every))
        began = time.perf_counter()
        write_beside(self.folder, look, self.rig)
        places = stack.enter_context(open_places(self.folder, None if carried is None else carried.size))
        overlay = stack.enter_context(write_frames(self.folder / "overlay.mp4", rate / options.every)) if options.overlay else None
        task = Task(self.rig, survey.silhouettes, options.masks, options.every, images=options.overlay, corrected=options.appearance,
                    hull=group.hull)
        frames = stack.enter_context(closing(frames_beside(task)))
        clear = [] if carried is None else carried.clear.tolist()
        earlier = iter(self._earlier(group, carried, stack))

        def judged(now: FrameSet, found: Mapping[int, MotionFrame], is_clear: bool) -> None:
            subjects = {n: group.members[n - 1].subject_at(frame.time) for n, frame in found.items()}
            drawn = [subjects[n].drawn(frame) for n, frame in found.items()]
            watch.tracked(_together(drawn) if is_clear else ())
            if overlay is not None:
                overlay.write(overlay_of_people(now, [(n, frame, subjects[n].pictures) for n, frame in found.items()]))

        try:
            for now in timer.each("wait", frames):
                seen = watch(now.time, now.seen)
                if (known := next(earlier, None)) is not None:
                    judged(now, *known)
                    continue
                timer.add(decode=now.decoding, segment=now.segmenting, hull=now.carving)
                with timer.time("hull"):
                    points = now.points
                    if points is None or not all(map(operator.is_, seen.masks, now.seen.masks)):
                        points = group.hull.points(seen.masks)
                with timer.time("track"):
                    if not begun and len(points.points):
                        begun = True
                        group.start(now.time, points, seen)
                    group.next(now.time, points, seen, now.corrected if options.appearance else ())
                with timer.time("write"):
                    found = self._write(group, now, stack, places)
                    clear.append(group.is_clear)
                    judged(now, found, clear[-1])
                    checkpoints.keep(partial(self._keep, group, places, clear, begun))
                self.listener.advance(len(clear))
        finally:
            self.aside, self.sets = watch.intervals, len(clear)
            count = len(clear) - (0 if carried is None else len(carried.clear))
            self.metrics |= timings(timer, STAGES, count, time.perf_counter() - began) | set_aside(watch.intervals, self.rig.names)

    def _keep(self, group: Group, places: BinaryIO, clear: Sequence[bool], begun: bool) -> None:
        """Write a checkpoint."""
        numbers = tuple(len(self.writers[member.number]) if member.number in self.writers else 0 for member in group.members)
        self.writer.checkpoint(Carried(json_text(self.survey.look), places.tell(), numbers, np.array(clear), begun, kept(group)))

    def _earlier(self, group: Group, carried: Carried | None, stack: ExitStack) -> list[tuple[dict[int, MotionFrame], bool]]:
        """The frames of each frame set before a checkpoint, by person, and whether cameras could be judged in it."""
        if carried is None:
            return []
        found = [(dict[int, MotionFrame](), is_clear) for is_clear in carried.clear.tolist()]
        for member, number in zip(group.members, carried.numbers):
            if number:
                frames = self._open(member, stack, number)
                for (people, _), frame in zip(found[len(found) - number :], frames, strict=True):
                    people[member.number] = frame
        return found

    @staticmethod
    def _doubted(frame: MotionFrame) -> MotionFrame:
        """The frame of a person who may face the other way, or be another one: nothing of it is `tracked`."""
        limbs = None if frame.limb_status is None else ["uncertain" if status == "tracked" else status for status in frame.limb_status]
        return frame._replace(status="uncertain" if frame.status == "tracked" else frame.status, limb_status=limbs)

    def _write(self, group: Group, now: FrameSet, stack: ExitStack, places: BinaryIO) -> dict[int, MotionFrame]:
        """Write a frame of each person found so far."""
        found = dict[int, MotionFrame]()
        for member in group.members:
            if member.state is None and member.number not in self.writers:
                continue
            if member.state is None or member.share is None:
                frame, member.before = MotionFrame(now.time, "absent"), None
            else:
                frame, member.before = motion_frame(member.subject, now.time, member.state, member.observation, member.before)
                doubted = group.identity.is_doubted(member.number)
                if not member.facing.is_known:
                    would_be = self._doubted(frame) if doubted else frame
                    member.facing.doubted[frame.time] = Doubted(would_be.status, tuple(would_be.limb_status or ()))
                if doubted or not member.is_front_sure:
                    frame = self._doubted(frame)
            self._writer(member, stack).write(frame)
            if member.measured_at == now.time:
                self._write_person(member)
            here = frame.status not in ("absent", "lost") and member.state is not None
            place = place_of(member.subject.body, member.state) if here and member.state is not None else np.full(2, np.nan)
            write_place(places, now.time, member.number, frame.status, place)
            found[member.number] = frame
        places.flush()
        return found

    def _writer(self, member: Member, stack: ExitStack) -> RunWriter:
        """The writer of a person's run, opened when they are first seen."""
        if member.number not in self.writers:
            self._open(member, stack)
        return self.writers[member.number]

    def _open(self, member: Member, stack: ExitStack, number: int = 0) -> list[MotionFrame]:
        """Open the writer of a person's run; returns the earlier run's frames, of this `number`, after which it goes on."""
        subject, folder = member.subject, person_folder(self.folder, member.number)
        body, info = subject.body, self.info | {"person": member.number}
        resume = Resuming(bool(number), NO_INPUTS)  # the group's writer watches the inputs
        writer = RunWriter(folder, body.name, body.skeleton.dof_names, joint_names(body), info, resume, of_group=True)
        self.writers[member.number] = stack.enter_context(writer)
        frames = writer.go_on(number) if number else []
        writer.begin()
        self._write_person(member)
        return frames

    def _write_person(self, member: Member) -> None:
        """Write the person's sizes, and what the look found of them."""
        subject = member.subject
        look = self.survey.look_with(subject.summary, subject.doubts)
        write_beside(person_folder(self.folder, member.number), look, self.rig, subject.person)


def _together(drawn: Sequence[tuple[Bits, ...]]) -> tuple[Bits, ...]:
    """Several bodies in each camera's picture, as bits."""
    shown = [bits for bits in drawn if bits]
    return tuple(np.bitwise_or.reduce(each) for each in zip(*shown)) if shown else ()
