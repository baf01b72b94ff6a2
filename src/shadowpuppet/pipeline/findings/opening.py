"""The beginning of a recording of several cameras: the silhouettes of its frame sets, in which the person is measured."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from itertools import islice

import numpy as np

from shadowpuppet.camera.mask import Seen
from shadowpuppet.errors import ShadowPuppetWarning
from shadowpuppet.pipeline.findings.look import FirstSeconds
from shadowpuppet.pipeline.footage import CameraFrame, Opening, Sample
from shadowpuppet.pipeline.rig import Rig, shown_in, synchronized_frames
from shadowpuppet.pipeline.silhouettes import Silhouettes, segments_of
from shadowpuppet.threads import MadeOnDemand, usable_cores

OPENING, OPENED = 2.0, 40
"""Length (s) of the beginning in which the person is measured, and the greatest number of frame sets kept of it."""
IN_STEP = 0.25
"""Greatest difference of the times of frame n of all films, over the least interval of two frames, with which it makes set n."""


def opening_of(rig: Rig) -> Opening:
    """The frames of the beginning from which the person is measured."""
    return Opening(OPENING, max(1, round(OPENING * rig.rate / OPENED)), OPENED)


def first_seconds(rig: Rig, silhouettes: Sequence[Silhouettes], samples: Sequence[Sample], opening: Opening, ready: bool) -> FirstSeconds:
    """Silhouettes of the opening's frame sets, of the frames that the samples kept of it; films that are not in step are read once more,
    with their `ready` silhouettes if these are used."""
    kept = kept_sets(rig, samples, opening)
    return read_sets(rig, silhouettes, opening, ready) if kept is None else _segmented(rig, silhouettes, kept)


def kept_sets(rig: Rig, samples: Sequence[Sample], opening: Opening) -> list[tuple[CameraFrame, ...]] | None:
    """The opening's frame sets, of the frames that the samples kept of it; None if the films do not have their frames at the same times, so
    that it is not frame n of each that belongs to set n."""
    times = samples[rig.leaders[0]].times[: opening.every * opening.number]
    times = times[times <= rig.recording.begin + opening.seconds]
    if len(times) < 2 or any(len(each.times) < len(times) for each in samples):
        return None
    apart = max(float(np.abs(each.times[: len(times)] - times).max()) for each in samples)
    if apart > IN_STEP * float(np.diff(times).min()):
        return None
    number = -(-len(times) // opening.every)
    firsts = [each.first[:number] for each in samples]
    return list(zip(*firsts, strict=True)) if all(len(each) == number for each in firsts) else None


def _segmented(rig: Rig, silhouettes: Sequence[Silhouettes], sets: Sequence[tuple[CameraFrame, ...]]) -> FirstSeconds:
    number = len(sets)

    def seen(n: int) -> Seen:
        return shown_in([each.segmented(frame) for each, frame in zip(silhouettes, sets[n], strict=True)])

    found = MadeOnDemand(seen, number)
    return FirstSeconds([frames[rig.leaders[0]].time for frames in sets], MadeOnDemand(lambda n: found[n].masks, number),
                        shadows=MadeOnDemand(lambda n: found[n].shadows, number),
                        keypoints=[tuple(frame.keypoints for frame in frames) for frames in sets])


def read_sets(rig: Rig, silhouettes: Sequence[Silhouettes], opening: Opening, ready: bool) -> FirstSeconds:
    """As `first_seconds`, of films that are read; `silhouettes`: empty without."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ShadowPuppetWarning)  # a film that breaks off is reported when the run comes to it
        frames = synchronized_frames(rig, segments_of(rig, silhouettes), ready=ready, every=opening.every, threads=usable_cores())
        sets = [(each.time, each.seen) for each in islice(frames, opening.number)]
    sets = [each for each in sets if each[0] <= rig.recording.begin + opening.seconds] or sets[:1]
    return FirstSeconds([time for time, _ in sets], [seen.masks for _, seen in sets], shadows=[seen.shadows for _, seen in sets],
                        keypoints=[seen.keypoints for _, seen in sets])
