"""A calibration tested against silhouettes: which camera disagrees, by how much, and how late each film is."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.calibration.agreement import DISAGREES, Agreement, agreement
from shadowpuppet.calibration.epipolar_tangency import Outline, Outlines
from shadowpuppet.calibration.rotation_error import Turn, turned_outline, turning
from shadowpuppet.calibration.time_offset import Lateness, lateness
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask, may_be_person
from shadowpuppet.errors import RecordingError, ShadowPuppetWarning
from shadowpuppet.pipeline.footage import Footage, take_sample
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.progress import Listener
from shadowpuppet.pipeline.rig import Rig, synchronized_frames
from shadowpuppet.pipeline.silhouettes import Silhouettes, learn_silhouettes
from shadowpuppet.pipeline.survey import brief_length
from shadowpuppet.threads import usable_cores

SETS, FEWEST, LONGEST = 240, 120, 3000
"""Sets of silhouettes that are compared, so many at least where the films are long enough, and among how many they are looked for."""
FASTEST = 31.0
"""Sets/s at most: more of them tell no more."""
COMPARED = 12
"""Sets, spread over them, by which places are judged."""
LATE, MISPLACED, SURE = 0.5, 1.5, 3.0
"""Sets from which on a film is said to be late; the same of a camera that disagrees about places, where time is told less well; and how
many times its pairs' spread."""
SLIGHT = 0.004
"""Pixels, over the picture's longer side, from which on a camera is looked into that agrees on the whole (2.6 of 640)."""
ALONE = 3.0
"""... and how many times as much as the middle one it must disagree, to be named where no turn explains it."""
MENDS = 0.5
"""A turn is told where no more than this of the disagreement is left."""


class Mended(NamedTuple):
    """What turning a camera back does."""

    turn: Turn
    apart: float
    """Pixels by which it then disagrees with the others."""


@dataclass(frozen=True, kw_only=True)
class RigCheck:
    """What silhouettes say of a calibration; plain values, so that it can be saved."""

    recording: str
    """Its path."""
    sets: int
    """How many sets of silhouettes were compared."""
    rate: float
    """Sets/s among which lateness is told."""
    frame_rate: float
    """Frames/s of the films."""
    agreement: Agreement
    """Of the cameras, at the times that fit best."""
    lateness: Lateness | None
    """In frames of the films; None where it cannot be told as the cameras are."""
    late: tuple[str, ...]
    """Cameras whose films are late or early for certain."""
    starts: dict[str, float]
    """What [start] of recording.toml should say, seconds, where films are late; empty where none is."""
    turns: dict[str, Mended]
    """By how much cameras that disagree were turned, where that explains it."""
    doubts: tuple[str, ...] = ()
    """What is wrong, and the remedy, a sentence each."""

    @property
    def good(self) -> bool:
        """Whether nothing is wrong."""
        return not self.doubts


class Seen(NamedTuple):
    """Sets of silhouettes that follow one another, by camera."""

    packed: list[list[NDArray[np.uint8] | None]]
    """Bits of masks; None where nobody is seen."""
    outlines: list[list[Outline | None]]
    every: int
    """Frames of the films from set to set."""


def check_rig(rig: Rig, options: Options, listener: Listener | None = None) -> RigCheck:
    """Test the calibration of several cameras. Raises a `ShadowPuppetError` where silhouettes cannot be had, or show nobody."""
    if not rig.is_multiview:
        raise RecordingError(f"{rig.recording.path}: found one camera, expected two or more")
    listener = listener or Listener()
    seen = gather(rig, options, listener)
    listener.begin("comparing")
    return judge(rig, seen)


def judge(rig: Rig, seen: Seen) -> RigCheck:
    """What silhouettes say of the calibration of `rig`. Raises `RecordingError` where no two cameras see a person at a time."""
    if sum(sum(outline is not None for outline in row) > 1 for row in seen.outlines) < 2:
        raise RecordingError(f"{rig.recording.path}: no two cameras see a person at the same time: do the films belong together?")
    found, late, shifts, turns = _judged(rig, seen)
    check = RigCheck(
        recording=str(rig.recording.path), sets=len(seen.outlines), rate=rig.rate / seen.every, frame_rate=rig.rate, agreement=found,
        lateness=None if late is None else _in_frames(late, seen.every), turns=turns,
        late=tuple(name for name, shift in zip(rig.names, shifts) if shift), starts=_starts(rig, shifts, seen.every),
    )  # fmt: skip
    return replace(check, doubts=tuple(_doubts(check)))


class _Judgement(NamedTuple):
    agreement: Agreement
    lateness: Lateness | None
    shifts: list[float]
    """Sets by which each film is late for certain."""
    turns: dict[str, Mended]


def _judged(rig: Rig, seen: Seen) -> _Judgement:
    """Places and times. A camera that was turned is turned back before times are asked for, and asked again once they are right."""
    still, rows = [0.0] * len(rig.cameras), _spread(rig, seen)
    found = agreement(rig.cameras, rows)
    if found.remedy is not None:
        return _Judgement(found, None, still, {})
    turns = _turns(rig, found, rows)
    late = _late(rig, seen, turns)
    shifts = _certain(late, found)
    if not any(shifts):
        return _Judgement(found, late, still, turns)
    aligned = _spread(rig, seen, shifts)
    later = agreement(rig.cameras, aligned, remedies=False)
    then = _turns(rig, later, aligned)
    if _left(later, then) >= _left(found, turns):
        return _Judgement(found, late, still, turns)  # what differs is not time
    late = _late(rig, seen, then)
    return _Judgement(later, late, _certain(late, later), then)


def _left(found: Agreement, turns: dict[str, Mended]) -> float:
    """Pixels by which cameras disagree, mean, once those that were turned are turned back."""
    known = [turns[name].apart if name in turns else apart for name, apart in zip(found.names, found.apart) if apart is not None]
    return float(np.mean(known)) if known else np.inf


def _mended(rig: Rig, turns: dict[str, Mended]) -> tuple[Camera, ...]:
    return tuple(turns[camera.name].turn.of(camera) if camera.name in turns else camera for camera in rig.cameras)


def _late(rig: Rig, seen: Seen, turns: dict[str, Mended]) -> Lateness:
    """How late films are, with cameras that were turned turned back."""
    mended = _mended(rig, turns)
    rows = [[turned_outline(outline, before, after) if outline is not None and before is not after else outline
             for outline, before, after in zip(row, rig.cameras, mended)] for row in seen.outlines]
    return lateness(mended, rows)


def gather(rig: Rig, options: Options, listener: Listener) -> Seen:
    """Silhouettes from the first set on in which two cameras see a person."""
    every = max(1, min(round(rig.rate / FASTEST), (rig.count or SETS * 9) // FEWEST))
    listener.begin("looking")
    with ThreadPoolExecutor(usable_cores(), "check") as pool:
        see = list(pool.map(lambda footage: _silhouettes(footage, options), rig.footage))
    seen = Seen([], [], every)
    listener.begin("reading", SETS)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ShadowPuppetWarning)  # what breaks off is said when a run comes to it
        for n, each in enumerate(synchronized_frames(rig, see, ready=options.masks, every=every, threads=usable_cores())):
            here = [mask is not None and may_be_person(mask) for mask in each.masks]
            if seen.outlines or sum(here) > 1:
                outlines = Outlines()
                seen.packed.append([np.packbits(mask) if mask is not None and good else None for mask, good in zip(each.masks, here)])
                seen.outlines.append([outlines.of(camera, mask) for camera, mask in zip(rig.cameras, each.masks)])
                listener.advance(len(seen.outlines))
            if len(seen.outlines) >= SETS or n >= LONGEST:
                break
    return seen


def _silhouettes(footage: Footage, options: Options) -> Silhouettes:
    return learn_silhouettes(footage, take_sample(footage, options.masks, brief_length(footage, options)), options)


def _spread(rig: Rig, seen: Seen, shifts: Sequence[float] | None = None) -> list[list[Mask | None]]:
    """Some sets of masks, each camera's so many sets later."""
    steps, F = [round(shift) for shift in shifts or [0.0] * len(rig.cameras)], len(seen.packed)
    first, last = max(0, -min(steps)), F - 1 - max(0, *steps)
    chosen = np.unique(np.linspace(first, max(first, last), COMPARED).astype(int))
    return [[_unpacked(seen.packed[f + step][k], rig.cameras[k].size) if f + step < F else None for k, step in enumerate(steps)]
            for f in chosen.tolist()]


def _unpacked(bits: NDArray[np.uint8] | None, size: tuple[int, int]) -> Mask | None:
    return None if bits is None else np.unpackbits(bits, count=size[0] * size[1]).reshape(size[1], size[0]).astype(bool)


def _certain(late: Lateness, found: Agreement) -> list[float]:
    """Sets by which films are late for certain; 0 for the others."""
    least = [max(MISPLACED if name in found.wrong else LATE, SURE * (spread or 0.0)) for name, spread in zip(late.names, late.spread)]
    return [frames if frames is not None and abs(frames) > limit else 0.0 for frames, limit in zip(late.frames, least)]


def _turns(rig: Rig, found: Agreement, rows: Sequence[Sequence[Mask | None]]) -> dict[str, Mended]:
    """Turns of cameras that disagree, or of the worst one, where they mend it."""
    turns = {}
    for name in found.wrong or _standing_out(found, 1.0):
        n = rig.names.index(name)
        turn, apart = turning(rig.cameras, rows, n), found.apart[n]
        if turn is not None and apart is not None:
            after = agreement([turn.of(camera) if k == n else camera for k, camera in enumerate(rig.cameras)], rows,
                              remedies=False).apart[n]
            if after is not None and after < MENDS * apart and after < found.limit:
                turns[name] = Mended(turn, after)
    return turns


def _standing_out(found: Agreement, times: float) -> tuple[str, ...]:
    """The camera that disagrees most, where it does by more than good ones do, and so many times as much as the middle one."""
    apart = {name: value for name, value in zip(found.names, found.apart) if value is not None}
    worst = max(apart, key=lambda name: apart[name], default="")
    least = max(SLIGHT / DISAGREES * found.limit, times * float(np.median(list(apart.values()))) if apart else 0.0)
    return (worst,) if worst and len(apart) > 2 and apart[worst] > least else ()


def _in_frames(late: Lateness, every: int) -> Lateness:
    def times(values: Sequence[float | None]) -> tuple[float | None, ...]:
        return tuple(None if value is None else round(value * every, 2) for value in values)

    return replace(late, frames=times(late.frames), spread=times(late.spread), pairs=tuple(map(times, late.pairs)))


def _starts(rig: Rig, shifts: Sequence[float], every: int) -> dict[str, float]:
    """[start] of recording.toml that mends times: what it is now, and the frames that a late film has too many."""
    if not any(shifts):
        return {}
    least = min(shifts)
    starts = {footage.camera.name: footage.view.start + (shift - least) * every / rig.rate for footage, shift in zip(rig.footage, shifts)}
    return {name: round(start, 4) for name, start in starts.items() if start > 1e-4}


def _doubts(check: RigCheck) -> list[str]:
    said, found = list[str](), check.agreement
    if check.late and check.lateness is not None:
        frames = {name: value for name, value in zip(check.lateness.names, check.lateness.frames) if name in check.late}
        told = ", ".join(f"{name} {abs(value or 0):.1f} frames {'late' if (value or 0) > 0 else 'early'}" for name, value in frames.items())
        start = ", ".join(f"{name} = {value:.4g}" for name, value in check.starts.items())
        said.append(f"the films do not begin together ({told}): put into [start] of recording.toml: {start}")
    if found.hopeless and found.remedy is not None:
        return [*said, found.remedy]
    said += [doubt for doubt in found.doubts() if not any(f"camera {name!r} disagrees" in doubt for name in check.turns)]
    for name in check.turns or (() if found.doubts() else _standing_out(found, ALONE)):
        others = [other for other in found.names if other != name]
        rest = max(value for other, value in zip(found.names, found.apart) if other != name and value is not None)
        told = f"camera {name!r} disagrees with the others by {found.apart[found.names.index(name)]:.1f} pixels, they by {rest:.1f} at most"
        if name in check.turns:
            turn, after = check.turns[name]
            told += (f"; it is as if it had been turned by {turn.degrees:.1f} degrees ({_ways(turn)}) since it was calibrated: turned "
                     f"back, {after:.1f} pixels would be left")
        said.append(f"{told}; calibrate it again, or leave it out: --camera {','.join(others)}")
    return said


def _ways(turn: Turn) -> str:
    ways = [(turn.right, "to the right", "to the left"), (turn.down, "down", "up"), (turn.clockwise, "clockwise", "counter-clockwise")]
    told = [f"{abs(value):.1f} {more if value > 0 else less}" for value, more, less in ways if abs(value) >= 0.05]
    return ", ".join(told) or "hardly"
