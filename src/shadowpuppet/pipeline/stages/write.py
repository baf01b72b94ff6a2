"""The write stage: each frame's rows and overlay, a checkpoint about every second, and the frames of an earlier run that goes on."""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from functools import partial
from typing import Generic, NamedTuple

import numpy as np

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.io.run_writer import RunWriter
from shadowpuppet.motion.motion import BLANK, MotionFrame
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.prepare import Prepared
from shadowpuppet.pipeline.progress import (
    FALLBACK_RATE,
    Checkpoints,
    LeftOut,
    LeftOutEntry,
    add_left_out,
    is_same_look,
    json_text,
    left_out_metrics,
    write_beside,
)
from shadowpuppet.pipeline.rig import FrameSet
from shadowpuppet.pipeline.subject import Before, Observation, State
from shadowpuppet.video import FrameWriter, write_frames


class Carried(NamedTuple, Generic[State, Before]):
    """What a frame needs of those before it: what a checkpoint keeps. Silhouettes, and cameras set aside, follow from the film."""

    look: str
    """The text of look.json."""
    generator: Mapping[str, object]
    """State of the random generator."""
    state: State | None
    """The tracker's; None while there is no person."""
    before: Before | None
    """What the doubt about the next frame needs."""
    left_out: tuple[LeftOut | None, ...]


class Written(Generic[State, Observation, Before]):
    """Writes what a run finds in each frame, after the frames of an earlier run that goes on."""

    def __init__(self, writer: RunWriter, prepared: Prepared[State, Observation, Before], options: Options,
                 rng: np.random.Generator) -> None:
        """Begin the tables at the start, or after the frames of a checkpoint, which sets the random generator. Raises
        `ShadowPuppetError` if the look was another one."""
        self.writer, self.survey, self.rng, self.subject, self.options = writer, prepared.survey, rng, prepared.check(), options
        self.carried, self.earlier = self._resumed(json_text(prepared.look))
        self.leans = array("d")
        """`TrackedSubject.lean` of each frame."""
        self.count = len(self.earlier)
        self._left_out, self._checkpoints = self.carried.left_out, Checkpoints()
        self._overlay: FrameWriter | None = None
        self._last: MotionFrame | None = None
        writer.begin()
        write_beside(writer.folder, prepared.look, self.survey.rig, self.subject.person)

    @contextmanager
    def shown(self, rate: float) -> Iterator[None]:
        """Context in which overlay.mp4 is written, at a film's rate (frames/s), if it is asked for."""
        rate = (rate if np.isfinite(rate) else FALLBACK_RATE) / self.options.every
        with write_frames(self.writer.folder / "overlay.mp4", rate) if self.options.overlay else nullcontext() as self._overlay:
            yield
            self.writer.check()  # before the overlay gets its name

    def repeated(self, frames: Iterable[FrameSet]) -> Iterator[MotionFrame]:
        """What the earlier run found in the first of the frames, shown again."""
        for found, now in zip(self.earlier, frames):
            yield found
            self._show(now, found)

    def write(self, now: FrameSet, found: MotionFrame, state: State | None, before: Before | None) -> None:
        """Write what is found in a frame; `state`, `before`: what the next frame needs."""
        self._left_out = add_left_out(self._left_out, now.time, self.subject.left_out(state))
        self.writer.write(found)
        self._show(now, found)
        carried = self.carried._replace(generator=self.rng.bit_generator.state, state=self.subject.kept(state), before=before,
                                        left_out=self._left_out)
        self._checkpoints.keep(partial(self.writer.checkpoint, carried))
        self.count += 1

    @property
    def left_out(self) -> dict[str, list[LeftOutEntry]]:
        """The entry `left_out` of metrics.json."""
        return left_out_metrics(self._left_out, [footage.view.camera for footage in self.survey.rig.footage])

    def _show(self, now: FrameSet, found: MotionFrame) -> None:
        self.leans.append(self.subject.lean(found, now.seen.masks))
        self._last = self._last if found.status in BLANK else found
        if self._overlay is not None:
            images = (None if image is None else each.steadied(image) for each, image in zip(self.survey.silhouettes, now.images))
            self._overlay.write(self.subject.draw(now._replace(images=tuple(images)), found, self._last))

    def _resumed(self, look: str) -> tuple[Carried[State, Before], list[MotionFrame]]:
        """Where the run begins, and the frames before, by the text of look.json."""
        found = self.writer.resumed((*self.subject.state_types, Carried, LeftOut))
        carried, frames = found or (Carried(look, {}, None, None, ()), [])
        if not is_same_look(carried.look, look):
            raise ShadowPuppetError(f"{self.writer.folder}: the run there cannot go on: its look.json differs from what the recording "
                                    "gives now")
        if carried.generator:
            self.rng.bit_generator.state = carried.generator
        return carried._replace(look=look), frames
