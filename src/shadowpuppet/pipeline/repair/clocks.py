"""Reads the clocks of a recording's films, timecode or sound, and puts them in step by these."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from shadowpuppet.calibration.clock_offset import ClockOffsets, timecode_offsets
from shadowpuppet.calibration.sound_offset import RATE, sound_offsets
from shadowpuppet.errors import VideoError
from shadowpuppet.pipeline.footage import Footage
from shadowpuppet.pipeline.rig import Rig
from shadowpuppet.threads import usable_cores
from shadowpuppet.video.sound import Sound, read_sound
from shadowpuppet.video.timecode import read_timecode

Stated = TypeVar("Stated")
LONGEST = 300.0
"""Seconds of a film that are listened to."""


def clock_offsets(rig: Rig) -> ClockOffsets | None:
    """Offsets of the films by their timecodes; if these tell nothing, by their sound; None if fewer than two films have sound."""
    codes = [_read(footage, read_timecode) for footage in rig.footage]
    stated = timecode_offsets(rig.names, codes, [footage.view.start for footage in rig.footage], rig.rate)
    return heard_offsets(rig) if stated is None else stated


def heard_offsets(rig: Rig) -> ClockOffsets | None:
    """Offsets of the films by their sound, beside the starts that the recording states; None if fewer than two have sound."""
    with ThreadPoolExecutor(usable_cores(), "sound") as pool:
        sounds = list(pool.map(lambda footage: _read(footage, _sound_of), rig.footage))
    if sum(sound is not None for sound in sounds) < 2:
        return None
    begins = [0.0 if sound is None else sound.begin - footage.view.start for sound, footage in zip(sounds, rig.footage)]
    return sound_offsets(rig.names, [None if sound is None else sound.samples for sound in sounds], begins,
                         np.array([camera.centre for camera in rig.cameras]))


def _sound_of(film: Path) -> Sound | None:
    return read_sound(film, RATE, LONGEST)


def _read(footage: Footage, read: Callable[[Path], Stated | None]) -> Stated | None:
    """What a film states; None for folders of pictures, live cameras, and films whose frames are timed by the recording's `rate`."""
    film = footage.view.video
    if not isinstance(film, Path) or not film.is_file() or footage.recording.rate is not None:
        return None
    try:
        return read(film)
    except VideoError:
        return None  # a picture, or a film that the look reports


def in_step(rig: Rig, late: Sequence[float | None]) -> Rig:
    """The rig with each film's start moved by the seconds by which it is late; no start becomes negative."""
    starts = [footage.view.start + (value or 0.0) for footage, value in zip(rig.footage, late)]
    least = min(0.0, *starts)
    moved = {footage.camera.name: start - least for footage, start in zip(rig.footage, starts)}
    views = tuple(replace(view, start=moved.get(view.camera.name, view.start)) for view in rig.recording.views)
    recording = replace(rig.recording, views=views)
    return Rig(recording, tuple(replace(footage, recording=recording, view=replace(footage.view, start=moved[footage.camera.name]))
                                for footage in rig.footage))
