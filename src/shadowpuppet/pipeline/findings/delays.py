"""Do the films of several cameras begin together: by silhouettes of consecutive sets, before a run."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace

from shadowpuppet.calibration.agreement import compare_cameras
from shadowpuppet.calibration.silhouettes import Row, aligned_sets, silhouettes_of
from shadowpuppet.calibration.time_offset import MIN_COMMON_SETS, certain_offsets, delays_in_words, time_offsets
from shadowpuppet.errors import HARMFUL, Finding, ShadowPuppetWarning
from shadowpuppet.pipeline.findings.look import FirstSeconds
from shadowpuppet.pipeline.findings.opening import OPENING, opening_of
from shadowpuppet.pipeline.footage import FIRST_SECONDS
from shadowpuppet.pipeline.rig import Rig, synchronized_frames
from shadowpuppet.pipeline.silhouettes import Silhouettes
from shadowpuppet.threads import usable_cores

SECONDS, SETS = 3.0, 45
"""Greatest length (s) that is read, of the films' middle as at first people often stand still, and greatest number of sets of it."""


def delay_cautions(rig: Rig, silhouettes: Sequence[Silhouettes], first: FirstSeconds, ready: bool) -> list[Finding]:
    """A sentence on films that are certainly late or early by over a frame, with the remedy, if the cameras agree once that is mended; else
    empty, as of films with too few frames, or people who move too little to tell. Several people are compared as one, by the outermost.
    Films are read again unless the `first` seconds are all of them."""
    if (rig.count or 0) <= MIN_COMMON_SETS:
        return []
    length = min((rig.count or 0) / rig.rate, SECONDS)
    if length > OPENING:
        every = max(1, round(length * rig.rate / SETS))
        rows = _middle(rig, silhouettes, length, every, ready)
    else:
        every, rows = opening_of(rig).every, [silhouettes_of(masks) for masks in first.masks]
    shifts = certain_offsets(time_offsets(rig.cameras, rows))
    late = {name: sets * every for name, sets in zip(rig.names, shifts) if abs(sets * every) > 1}
    if not late or compare_cameras(rig.cameras, aligned_sets(rows, shifts), remedies=False).wrong:
        return []
    return [Finding(f"the films do not begin together ({delays_in_words(late)}): `shadowpuppet check --fix` measures that and writes it "
                    "into [start] of recording.toml", "films do not begin together: `shadowpuppet check --fix`", HARMFUL, late)]


def _middle(rig: Rig, silhouettes: Sequence[Silhouettes], length: float, every: int, ready: bool) -> list[Row]:
    """Silhouettes of a length (s) of the films' middle, or of what lies about `FIRST_SECONDS` if that comes before: to reach the middle of
    a long film takes minutes."""
    begin = rig.recording.begin + min((rig.count or 0) / rig.rate / 2, FIRST_SECONDS) - length / 2
    recording = replace(rig.recording, begin=begin, duration=begin + length)
    part = Rig(recording, tuple(replace(footage, recording=recording) for footage in rig.footage))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ShadowPuppetWarning)  # a film that breaks off is reported when the run comes to it
        return [silhouettes_of(each.seen.masks) for each in synchronized_frames(part, [one.segmented for one in silhouettes], ready=ready,
                                                                               every=every, threads=usable_cores())]
