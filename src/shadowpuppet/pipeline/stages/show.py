"""The show stage: overlay.mp4, which shows the motion that the run has in the end, smoothed and mended."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import closing
from functools import partial

import numpy as np

from shadowpuppet.errors import ShadowPuppetWarning
from shadowpuppet.io.run_writer import RunWriter
from shadowpuppet.motion.motion import BLANK, Motion
from shadowpuppet.pipeline.findings.look import Survey
from shadowpuppet.pipeline.frame_process import Task, frames_beside
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.progress import FALLBACK_RATE, Listener
from shadowpuppet.pipeline.rig import FrameSet, read_frames
from shadowpuppet.pipeline.silhouette_cache import MaskStore
from shadowpuppet.pipeline.silhouettes import segments_of
from shadowpuppet.pipeline.subject import Before, Observation, State, TrackedSubject
from shadowpuppet.video import Image, write_frames

Draw = Callable[[FrameSet], Image]
"""Draws what a run has in a frame set over its pictures."""


def show_run(writer: RunWriter, survey: Survey, options: Options, listener: Listener, store: MaskStore, drawings: Iterable[Draw]) -> None:
    """Write overlay.mp4, if it is asked for: the films are read once more, and each frame set is drawn by one of `drawings`. `store`: the
    silhouettes as they were tracked; where they were too many to be kept, they are made again."""
    if not options.overlay:
        return
    rate = (survey.look.rate if np.isfinite(survey.look.rate) else FALLBACK_RATE) / options.every
    listener.begin("drawing", len(store.sets) or None)
    start = time.perf_counter()
    with write_frames(writer.folder / "overlay.mp4", rate) as film, closing(_pictured(survey, options, store)) as frames:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ShadowPuppetWarning)  # what reading the films warns of was said while they were tracked
            for n, (now, draw) in enumerate(zip(frames, drawings), 1):
                film.write(draw(now))
                listener.advance(n)
        writer.check()  # before the overlay gets its name
    writer.metrics["overlay_s"] = round(time.perf_counter() - start, 3)


def drawings(subject: TrackedSubject[State, Observation, Before], motion: Motion) -> Iterator[Draw]:
    """Draws each frame of a person's motion; where there is no pose, the last one is pale."""
    last = None
    for found in motion.frames():
        last = last if found.status in BLANK else found
        yield partial(subject.draw, found=found, last=last)


def _pictured(survey: Survey, options: Options, store: MaskStore) -> Generator[FrameSet]:
    """The frame sets of a run, with pictures as the cameras would take them without their movement."""
    if store.sets:
        with closing(read_frames(survey.rig, segments_of(survey.rig, ()), every=options.every)) as read:
            yield from (_steadied(survey, kept._replace(images=now.images)) for now, kept in zip(read, store))
    else:
        with closing(frames_beside(Task(survey.rig, survey.silhouettes, options.masks, options.every, corrected=False))) as made:
            yield from (_steadied(survey, now) for now in made)


def _steadied(survey: Survey, now: FrameSet) -> FrameSet:
    images = (None if image is None else each.steadied(image) for each, image in zip(survey.silhouettes, now.images))
    return now._replace(images=tuple(images) or now.images)
