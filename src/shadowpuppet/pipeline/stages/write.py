"""The write stage: each frame's rows, a checkpoint about every second, and the frames of an earlier run that goes on."""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Iterator, Mapping
from functools import partial
from typing import Generic, NamedTuple

import numpy as np

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.io.run_writer import RunWriter
from shadowpuppet.motion.motion import MotionFrame
from shadowpuppet.pipeline.prepare import Prepared
from shadowpuppet.pipeline.progress import (
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

    def __init__(self, writer: RunWriter, prepared: Prepared[State, Observation, Before], rng: np.random.Generator) -> None:
        """Begin the tables at the start, or after the frames of a checkpoint, which sets the random generator. Raises
        `ShadowPuppetError` if the look was another one."""
        self.writer, self.survey, self.rng, self.subject = writer, prepared.survey, rng, prepared.check()
        self.carried, self.earlier = self._resumed(json_text(prepared.look))
        self.leans = array("d")
        """`TrackedSubject.lean` of each frame."""
        self.count = len(self.earlier)
        self._left_out, self._checkpoints = self.carried.left_out, Checkpoints()
        writer.begin()
        write_beside(writer.folder, prepared.look, self.survey.rig, self.subject.person)

    def repeated(self, frames: Iterable[FrameSet]) -> Iterator[MotionFrame]:
        """What the earlier run found in the first of the frames."""
        for found, now in zip(self.earlier, frames):
            yield found
            self.leans.append(self.subject.lean(found, now.seen.masks))

    def write(self, now: FrameSet, found: MotionFrame, state: State | None, before: Before | None) -> None:
        """Write what is found in a frame; `state`, `before`: what the next frame needs."""
        self._left_out = add_left_out(self._left_out, now.time, self.subject.left_out(state))
        self.writer.write(found)
        self.leans.append(self.subject.lean(found, now.seen.masks))
        carried = self.carried._replace(generator=self.rng.bit_generator.state, state=self.subject.kept(state), before=before,
                                        left_out=self._left_out)
        self._checkpoints.keep(partial(self.writer.checkpoint, carried))
        self.count += 1

    @property
    def left_out(self) -> dict[str, list[LeftOutEntry]]:
        """The entry `left_out` of metrics.json."""
        return left_out_metrics(self._left_out, [footage.view.camera for footage in self.survey.rig.footage])

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
