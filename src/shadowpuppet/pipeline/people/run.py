"""The run of a recording of several people: a run folder for each, and people.csv."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from shadowpuppet.body.sizes import BoneSizes
from shadowpuppet.camera.rasterize import Bits
from shadowpuppet.errors import SettingsError, ShadowPuppetError, TrackingError, warn
from shadowpuppet.io.motion.motion_files import read_truth
from shadowpuppet.io.people import PEOPLE, person_folder, write_header, write_place
from shadowpuppet.io.run import read_run
from shadowpuppet.io.run_writer import RunWriter, write_metrics
from shadowpuppet.motion.motion import JointTable, Motion, MotionFrame
from shadowpuppet.motion.synchronization import at_common_times
from shadowpuppet.pipeline.look import RigLook, Survey
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.overlay_video import overlay_of_people
from shadowpuppet.pipeline.people.census import Census
from shadowpuppet.pipeline.people.fitting import fit_apart
from shadowpuppet.pipeline.people.group import Group, Member, first_people, seen_in
from shadowpuppet.pipeline.person_rig import MultiviewSubject
from shadowpuppet.pipeline.progress import (
    FALLBACK_RATE,
    STAGES,
    Listener,
    StageTimer,
    evaluated,
    set_aside,
    timings,
    tracked,
    warn_of_set_aside,
    write_beside,
)
from shadowpuppet.pipeline.rig import FrameSet, Rig, read_frames
from shadowpuppet.pipeline.subject import joint_names, motion_frame
from shadowpuppet.pipeline.verdict.of_run import verdict_of_run
from shadowpuppet.tracking.multiview.rig_watch import RigWatch
from shadowpuppet.tracking.multiview.surface.visual_hull import VisualHull
from shadowpuppet.tracking.people.tracker import place_of
from shadowpuppet.video import write_frames

SAME_PERSON = 0.5
"""Greatest median distance (m) of a tracked person from a truth that is theirs."""
Smooth = Callable[[RunWriter, Sequence[tuple[int, MultiviewSubject]], Options, Listener, Motion], None]
"""Replaces the motion of a run by a given one, smoothed."""


def check_people(options: Options, resume: bool) -> None:
    """Raise a `ShadowPuppetError` for what a run of several people cannot do."""
    if resume:
        raise ShadowPuppetError("--resume: found several people, whose runs cannot go on, expected --force, which starts over")
    if options.person is not None:
        raise SettingsError(f"person: found {options.person} for several people, expected none: each is measured")


@dataclass(eq=False)
class PeopleRun:
    """A run of several people into a folder."""

    folder: Path
    survey: Survey
    census: Census
    options: Options
    info: dict[str, Any]
    """Entries of each person's run.toml."""
    listener: Listener

    def __post_init__(self) -> None:
        """Start without people."""
        self.rig: Rig = self.survey.rig
        self.writers = dict[int, RunWriter]()
        self.metrics = dict[str, Any]()

    def track(self, for_fit: np.random.Generator, for_track: np.random.Generator, smooth: Smooth) -> dict[int, dict[str, Any]]:
        """Track all people; returns each person's metrics by number, none if no person is found."""
        self.listener.begin(f"measuring {self.census.number} people")
        group = self._group(for_fit, for_track)
        with ExitStack() as stack:
            self._follow(group, stack)
            for member in group.members:
                if member.number in self.writers:
                    writer, subject = self.writers[member.number], member.subject
                    assert isinstance(subject.person.sizes, BoneSizes)  # of a whole body
                    motion = member.facing.corrected(writer.motion, subject.body, subject.person.sizes)
                    smooth(writer, [(0, subject)], self.options, self.listener, motion)
            truths = matched_truths({n: writer.motion for n, writer in self.writers.items()}, self.rig.recording.truths)
            for n, truth in truths.items():
                self.writers[n].info["truth"] = str(truth.resolve())
        found = {n: self._finished(n, truths.get(n)) for n in self.writers}
        write_metrics(self.folder, self.metrics | {"people": len(found)})
        warn_of_set_aside(self.metrics.get("set_aside", []))
        return found

    def _finished(self, number: int, truth: Path | None) -> dict[str, Any]:
        """The metrics of a person's finished run, written into its folder."""
        folder = person_folder(self.folder, number)
        run = read_run(folder)
        recording = replace(self.rig.recording, truth=truth)
        metrics = run.metrics | evaluated(replace(self.rig, recording=recording), run.motion)
        metrics["verdict"] = verdict_of_run(self.survey.look, run.motion, self.metrics.get("set_aside", ())).plain()
        write_metrics(folder, metrics)
        return metrics

    def _group(self, for_fit: np.random.Generator, for_track: np.random.Generator) -> Group:
        """The people of the first seconds, measured."""
        rate, floor = self.rig.rate / self.options.every, self.census.floor
        first = self.survey.first

        def fit(rng: np.random.Generator, sets: Sequence[Any]) -> MultiviewSubject:
            return fit_apart(rng, self.rig.cameras, floor, self.options, rate, sets)

        group = Group(floor, VisualHull(self.rig.cameras, self.options.multiview.hull), fit, for_track)
        people, every = first_people(floor, first.times, first.masks)
        seen = dict(enumerate(zip(every, first.masks)))
        for found in people:
            try:
                group.add(fit(for_fit, seen_in(found, seen)), found.height, found.figures[0].place)
            except TrackingError:
                continue  # may be found later
        return group

    def _follow(self, group: Group, stack: ExitStack) -> None:
        """For each frame set: segment, compute the hull, update all people, write."""
        survey, options, timer = self.survey, self.options, StageTimer()
        look = survey.look
        assert isinstance(look, RigLook)
        rate = look.rate if np.isfinite(look.rate) else FALLBACK_RATE
        watch, count, begun = RigWatch(len(self.rig.footage)), 0, False
        self.listener.begin("tracking", tracked(look.frames, options.every))
        began = time.perf_counter()
        write_beside(self.folder, look, self.rig)
        places = stack.enter_context((self.folder / PEOPLE).open("wb"))
        write_header(places)
        overlay = stack.enter_context(write_frames(self.folder / "overlay.mp4", rate / options.every)) if options.overlay else None
        segment = [silhouettes.following() for silhouettes in survey.silhouettes]
        frames = stack.enter_context(closing(read_frames(self.rig, segment, ready=options.masks, every=options.every)))
        try:
            for seen in timer.each("wait", frames):
                masks = watch(seen.time, seen.masks, seen.own)
                timer.add(decode=seen.decoding, segment=seen.segmenting)
                with timer.time("hull"):
                    points = group.hull.points(masks)
                with timer.time("track"):
                    if not begun and len(points.points):
                        begun = True
                        group.start(seen.time, points, masks)
                    group.next(seen.time, points, masks)
                    drawn = [member.subject.drawn(member.state) for member in group.present]
                    watch.tracked(_together(drawn) if group.is_clear else ())
                with timer.time("write"):
                    found = self._write(group, seen, stack, places)
                    if overlay is not None:
                        overlay.write(overlay_of_people(seen, [(n, frame, group.members[n - 1].subject.pictures)
                                                               for n, frame in found.items()]))
                count += 1
                self.listener.advance(count)
        finally:
            self.metrics |= timings(timer, STAGES, count, time.perf_counter() - began) | set_aside(watch.intervals, self.rig.names)

    @staticmethod
    def _doubted(frame: MotionFrame) -> MotionFrame:
        """The frame of a person who may face the other way: nothing of it is `tracked`."""
        limbs = None if frame.limb_status is None else ["uncertain" if status == "tracked" else status for status in frame.limb_status]
        return frame._replace(status="uncertain" if frame.status == "tracked" else frame.status, limb_status=limbs)

    def _write(self, group: Group, seen: FrameSet, stack: ExitStack, places: BinaryIO) -> dict[int, MotionFrame]:
        """Write a frame of each person found so far."""
        found = dict[int, MotionFrame]()
        for member in group.members:
            if member.state is None and member.number not in self.writers:
                continue
            if member.state is None or member.share is None:
                frame, member.before = MotionFrame(seen.time, "absent"), None
            else:
                frame, member.before = motion_frame(member.subject, seen.time, member.state, member.observation, member.before)
                if not member.facing.is_known:
                    member.facing.doubted[frame.time] = frame
                    frame = self._doubted(frame)
            self._writer(member, stack).write(frame)
            here = frame.status not in ("absent", "lost") and member.state is not None
            place = place_of(member.subject.body, member.state) if here and member.state is not None else np.full(2, np.nan)
            write_place(places, seen.time, member.number, frame.status, place)
            found[member.number] = frame
        places.flush()
        return found

    def _writer(self, member: Member, stack: ExitStack) -> RunWriter:
        """The writer of a person's run, opened when they are first seen."""
        if member.number not in self.writers:
            body, folder = member.subject.body, person_folder(self.folder, member.number)
            writer = RunWriter(folder, body.name, body.skeleton.dof_names, joint_names(body), self.info | {"person": member.number})
            self.writers[member.number] = stack.enter_context(writer)
            writer.begin()
            subject = member.subject
            write_beside(folder, self.survey.look_with(subject.summary, subject.doubts), self.rig, subject.person)
        return self.writers[member.number]


def _together(drawn: Sequence[tuple[Bits, ...]]) -> tuple[Bits, ...]:
    """Several bodies in each camera's picture, as bits."""
    shown = [bits for bits in drawn if bits]
    return tuple(np.bitwise_or.reduce(each) for each in zip(*shown)) if shown else ()


def matched_truths(motions: Mapping[int, Motion], truths: Sequence[Path]) -> dict[int, Path]:
    """For each person's motion the truth of a recording that is nearest in the mean, each truth for one person at most."""
    from scipy.optimize import linear_sum_assignment

    tables = [table for path in truths if (table := _read(path)) is not None]
    if not tables or not motions:
        return {}
    away = np.array([[_apart(motion, table) for _, table in tables] for motion in motions.values()])
    rows, figures = linear_sum_assignment(np.where(np.isfinite(away), away, 1e6))
    return {list(motions)[row]: tables[figure][0] for row, figure in zip(rows, figures) if away[row, figure] < SAME_PERSON}


def _read(path: Path) -> tuple[Path, JointTable] | None:
    try:
        return path, read_truth(path)
    except ShadowPuppetError as error:
        warn(f"{path}: no errors are computed: {error}")
        return None


def _apart(motion: Motion, truth: JointTable) -> float:
    """Median distance (m) of a motion's pelvis from a truth's."""
    if "pelvis" not in truth.names or not len(motion):
        return np.inf
    ours, theirs = at_common_times(motion.table, truth)
    delta = ours.positions[:, ours.names.index("pelvis")] - theirs.positions[:, theirs.names.index("pelvis")]
    away = np.linalg.norm(delta, axis=1)
    return float(np.nanmedian(away)) if np.isfinite(away).any() else np.inf
