"""Checks a recording: its calibration by silhouettes, and whether its films are in step by silhouettes and by the films' clocks."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from shadowpuppet.calibration.clock_offset import ClockOffsets
from shadowpuppet.calibration.time_offset import MIN_OFFSET, SPREAD_FACTOR, TimeOffsets
from shadowpuppet.errors import RecordingError
from shadowpuppet.pipeline.findings.scale import error_in, moments_of
from shadowpuppet.pipeline.findings.upright import up_caution
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.progress import Listener
from shadowpuppet.pipeline.repair.check import (
    SAME_PIXELS,
    CalibrationCheck,
    SilhouetteSets,
    doubts_of,
    gather_silhouettes,
    judge_calibration,
)
from shadowpuppet.pipeline.repair.clocks import clock_offsets, in_step
from shadowpuppet.pipeline.rig import Rig

DISAGREE = {"sound": "sound and silhouettes disagree about the films' delays: does the sound of a film lag behind its pictures?",
            "timecode": "timecodes and silhouettes disagree about the films' delays: were the cameras' clocks set together?"}


def check_calibration(rig: Rig, options: Options, listener: Listener | None = None) -> CalibrationCheck:
    """Test the calibration of several cameras, and whether their films are in step, by silhouettes and by the films' clocks.

    Raises a `ShadowPuppetError` if there are no silhouettes, or no person in them.
    """
    return check_films(rig, options, listener).check


class Checked(NamedTuple):
    """A check with the silhouettes that it rests on."""

    check: CalibrationCheck
    sets: SilhouetteSets
    """As the films were compared: put in step by their clocks if `check.by_clock`."""
    before: SilhouetteSets
    """As the recording states the films' starts."""


def check_films(rig: Rig, options: Options, listener: Listener | None = None) -> Checked:
    """As `check_calibration`; also returns the silhouettes compared."""
    checked = _in_step(rig, options, listener or Listener())
    if checked.check.agreement.hopeless:
        return checked
    masks = [[None if each is None else each.mask for each in row] for row in checked.sets.rows]
    moments = moments_of(rig.cameras, masks, options.multiview)
    scale, not_up = error_in(rig, moments, options), up_caution(rig.cameras, moments, options.multiview)
    said = [str(each) for each in (None if scale is None else scale.caution(), not_up) if each is not None]
    return checked._replace(check=replace(checked.check, scale=scale, doubts=(*said, *checked.check.doubts)))


def _in_step(rig: Rig, options: Options, listener: Listener) -> Checked:
    """The check of agreement and delays."""
    if not rig.is_multiview:
        raise RecordingError(f"{rig.recording.path}: found one camera, expected two or more")
    sets = gather_silhouettes(rig, options, listener)
    listener.begin("reading the films' clocks")
    clock = clock_offsets(rig)
    listener.begin("comparing")
    check = replace(judge_calibration(rig, sets, options.masks), clock=clock)
    if clock is None or not _differs(clock, check):
        return Checked(check, sets, sets)
    moved = in_step(rig, clock.seconds)
    again = gather_silhouettes(moved, options, listener)
    listener.begin("comparing")
    other = judge_calibration(moved, again, options.masks)
    if _mean_disagreement(other) > _mean_disagreement(check) + (SAME_PIXELS if check.still else 0.0):
        return Checked(replace(check, doubts=(*check.doubts, DISAGREE[clock.by])), sets, sets)
    return Checked(_by_clock(rig, moved, other, clock), again, sets)


def _differs(clock: ClockOffsets, check: CalibrationCheck) -> bool:
    """Whether the films' clocks state an offset that the silhouettes do not."""
    seen = (None,) * len(clock.names) if check.lateness is None else check.lateness.frames
    certain = [0.0 if late is None or name not in check.late else late for name, late in zip(check.agreement.names, seen)]
    return any(seconds is not None and spread is not None
               and abs(seconds * check.frame_rate - late) > max(1.0, SPREAD_FACTOR * spread * check.frame_rate)
               for seconds, spread, late in zip(clock.seconds, clock.spread, certain))


def _mean_disagreement(check: CalibrationCheck) -> float:
    """Pixels, over the cameras."""
    known = [apart for apart in check.agreement.apart if apart is not None]
    return float(np.mean(known)) if known else np.inf


def _by_clock(rig: Rig, moved: Rig, check: CalibrationCheck, clock: ClockOffsets) -> CalibrationCheck:
    """The check of films that their clocks put in step, with delays against the starts that the recording states."""
    names, rate = rig.names, rig.rate
    late = [(value or 0.0) * rate for value in clock.seconds]
    seen = [None] * len(names) if check.lateness is None else [frames if name in check.late else None
                                                               for name, frames in zip(names, check.lateness.frames)]
    spreads = [None] * len(names) if check.lateness is None else check.lateness.spread
    frames = tuple(round(own + (known or 0.0), 2) for own, known in zip(late, seen))
    spread = tuple((None if width is None else round(width * rate, 2)) if known is None else of_seen
                   for known, of_seen, width in zip(seen, spreads, clock.spread))
    starts = {footage.camera.name: footage.view.start + (known or 0.0) / rate for footage, known in zip(moved.footage, seen)}
    least = min(starts.values())
    found = TimeOffsets(names=names, frames=frames, spread=spread,
                        pairs=tuple((None,) * len(names) for _ in names) if check.lateness is None else check.lateness.pairs)
    check = replace(check, lateness=found, clock=clock, by_clock=True,
                    late=tuple(name for name, value, width in zip(names, frames, spread) if abs(value) > max(MIN_OFFSET, width or 0.0)),
                    starts={name: round(start - least, 4) for name, start in starts.items() if start - least > 1e-4})
    return replace(check, doubts=tuple(doubts_of(check)))
