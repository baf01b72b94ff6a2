"""The show stage: overlay.mp4, which shows the motion that the run has in the end, smoothed and mended."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import closing
from functools import partial

import numpy as np

from shadowpuppet.camera.captions import WHITE, strip
from shadowpuppet.camera.drawing import CROSS, LEGEND, MATCHED
from shadowpuppet.errors import ShadowPuppetWarning
from shadowpuppet.io.run_writer import RunWriter
from shadowpuppet.motion.limbs import status_in_words
from shadowpuppet.motion.motion import BLANK, Motion
from shadowpuppet.pipeline.findings.look import Survey
from shadowpuppet.pipeline.frame_process import Task, frames_beside
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.overlay_video import OUTLINED
from shadowpuppet.pipeline.progress import FALLBACK_RATE, Listener
from shadowpuppet.pipeline.rig import FrameSet, read_frames
from shadowpuppet.pipeline.silhouette_cache import MaskStore
from shadowpuppet.pipeline.silhouettes import segments_of
from shadowpuppet.pipeline.subject import Before, Observation, State, TrackedSubject
from shadowpuppet.video import Image, write_frames

Drawing = tuple[Callable[[FrameSet], Image], str]
"""Draws what a run has in a frame set over its pictures; and the words below them: time and status."""


def show_run(writer: RunWriter, survey: Survey, options: Options, listener: Listener, store: MaskStore,
             drawings: Iterable[Drawing]) -> None:
    """Write overlay.mp4, if it is asked for: the films are read once more, and each frame set is drawn by one of `drawings`; below are the
    colours in words, and the frame's own. `store`: the silhouettes as they were tracked; where they were too many to be kept, they are made
    again."""
    if not options.overlay:
        return
    legend = [*LEGEND, *(() if not survey.silhouettes else OUTLINED if survey.rig.is_multiview else MATCHED)]
    legend += CROSS if any(each.view.keypoints is not None for each in survey.rig.footage) else ()
    chosen, high = list(drawings), 0
    rate = (survey.look.rate if np.isfinite(survey.look.rate) else FALLBACK_RATE) / options.every
    listener.begin("drawing", len(store.sets) or None)
    start = time.perf_counter()
    with write_frames(writer.folder / "overlay.mp4", rate) as film, closing(_pictured(survey, options, store)) as frames:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ShadowPuppetWarning)  # what reading the films warns of was said while they were tracked
            for n, (now, (draw, words)) in enumerate(zip(frames, chosen), 1):
                picture = draw(now)
                wide = picture.shape[1]
                high = high or max(len(strip(wide, [legend, [(each, WHITE)]])) for each in {said for _, said in chosen})
                film.write(np.concatenate([picture, strip(wide, [legend, [(words, WHITE)]], high)]))
                listener.advance(n)
        writer.check()  # before the overlay gets its name
    writer.metrics["overlay_s"] = round(time.perf_counter() - start, 3)


def drawings(subject: TrackedSubject[State, Observation, Before], motion: Motion) -> Iterator[Drawing]:
    """Each frame of a person's motion; where there is no pose, the last one is dashed."""
    last = None
    for found in motion.frames():
        last = last if found.status in BLANK else found
        words = status_in_words(found.status, subject.body.landmark_names, found.limb_status)
        if last is not None and last is not found:
            words = f"{found.status}; dashed: as at {last.time:.2f} s"
        fit = "" if np.isnan(found.overlap) else f", overlap {found.overlap:.2f}"
        yield partial(subject.draw, found=found, last=last), f"{found.time:.2f} s: {words}{fit}"


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
