"""Do the films of several cameras begin together: by silhouettes of consecutive sets, before a run."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace

from shadowpuppet.calibration.silhouettes import Row, silhouettes_of
from shadowpuppet.calibration.time_offset import certain_offsets, delays_in_words, time_offsets
from shadowpuppet.errors import HARMFUL, Finding, ShadowPuppetWarning
from shadowpuppet.pipeline.rig import Rig, synchronized_frames
from shadowpuppet.pipeline.silhouettes import Silhouettes
from shadowpuppet.threads import usable_cores

SECONDS, SETS = 3.0, 45
"""Length (s) of the films' middle that is read, as at first people often stand still, and greatest number of sets of it."""
LEAST = 1.0
"""Frames by which a film must be late for the recording to be in doubt."""


def delay_cautions(rig: Rig, silhouettes: Sequence[Silhouettes], ready: bool) -> list[Finding]:
    """A sentence on films that are certainly late or early by over a frame, with the remedy; empty if none is, or if the films are short or
    the person moves too little to tell."""
    if (rig.count or 0) < SECONDS * rig.rate:
        return []
    every = max(1, round(SECONDS * rig.rate / SETS))
    offsets = time_offsets(rig.cameras, _middle(rig, silhouettes, every, ready))
    found = [late * every for late in certain_offsets(offsets)]
    late = {name: frames for name, frames in zip(rig.names, found) if abs(frames) > LEAST}
    if not late:
        return []
    return [Finding(f"the films do not begin together ({delays_in_words(late)}): `shadowpuppet check --fix` measures that and writes it "
                    "into [start] of recording.toml", "films do not begin together: `shadowpuppet check --fix`", HARMFUL, late)]


def _middle(rig: Rig, silhouettes: Sequence[Silhouettes], every: int, ready: bool) -> list[Row]:
    """Silhouettes of the middle of the films."""
    begin = rig.recording.begin + (rig.count or 0) / rig.rate / 2 - SECONDS / 2
    recording = replace(rig.recording, begin=begin, duration=begin + SECONDS)
    part = Rig(recording, tuple(replace(footage, recording=recording) for footage in rig.footage))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ShadowPuppetWarning)  # a film that breaks off is reported when the run comes to it
        return [silhouettes_of(each.seen.masks) for each in synchronized_frames(part, [one.segmented for one in silhouettes], ready=ready,
                                                                               every=every, threads=usable_cores())]
