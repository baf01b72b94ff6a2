"""Tests a calibration against silhouettes: finds cameras that disagree, by how much, and the time offset of each film."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from shadowpuppet.calibration.agreement import MAX_DISAGREEMENT, Agreement, compare_cameras
from shadowpuppet.calibration.clock_offset import ClockOffsets
from shadowpuppet.calibration.rotation_error import RotationError, estimate_place_error, estimate_rotation_error
from shadowpuppet.calibration.silhouettes import Row, aligned_sets, silhouettes_of
from shadowpuppet.calibration.time_offset import TimeOffsets, certain_offsets, delays_in_words, time_offsets
from shadowpuppet.errors import RecordingError, ShadowPuppetWarning
from shadowpuppet.pipeline.findings.film import brief_length
from shadowpuppet.pipeline.findings.scale import ScaleError
from shadowpuppet.pipeline.footage import Footage, take_sample
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.progress import Listener, Steps
from shadowpuppet.pipeline.rig import Rig, synchronized_frames
from shadowpuppet.pipeline.silhouettes import Silhouettes, learn_silhouettes
from shadowpuppet.threads import usable_cores

SETS, MIN_SETS, MAX_SETS_READ = 240, 120, 3000
"""Number of sets of silhouettes compared; their least number if the films are long enough; the greatest number of sets read."""
MAX_SET_RATE = 31.0
"""Greatest rate of the sets compared, 1/s; a higher one adds nothing."""
SAME_PIXELS = 0.1
"""Mean disagreement, pixels, by which films put in step may be worse: silhouettes of a person who hardly moves are as much alike."""
SLIGHT_DISAGREEMENT = 0.004
"""Disagreement, over the picture's longer side, above which the worst camera is tested for a rotation (2.6 of 640 pixels)."""
STANDOUT_FACTOR = 3.0
"""Ratio to the median disagreement above which a camera is reported although no rotation explains it."""
ROTATION_SHARE = 0.5
"""A rotation is reported if it leaves at most this share of the disagreement; a displacement, too, if it leaves this share of the rest."""
SLIGHT_PIXELS, MAX_PUSH = 0.7, 0.25
"""Disagreement of a camera, pixels, that a rotation may leave without a displacement being looked for; the greatest of these, metres."""


class RotationFix(NamedTuple):
    """Effect of rotating a camera back."""

    turn: RotationError
    apart: float
    """Remaining disagreement with the other cameras, pixels."""


@dataclass(frozen=True, kw_only=True)
class CalibrationCheck:
    """Result of testing a calibration against silhouettes; plain values, so that it can be saved."""

    recording: str
    """Its path."""
    sets: int
    """Number of sets of silhouettes compared."""
    rate: float
    """Sets/s."""
    frame_rate: float
    """Frames/s of the films."""
    agreement: Agreement
    """Agreement of the cameras, with the films shifted by their time offsets if that fits better."""
    lateness: TimeOffsets | None
    """Time offsets in frames of the films; None if the cameras disagree too much to estimate them."""
    late: tuple[str, ...]
    """Names of cameras whose films are certainly late or early."""
    starts: dict[str, float]
    """Values for [start] of recording.toml, seconds; empty if no film is late."""
    turns: dict[str, RotationFix]
    """Rotations that explain the disagreement of cameras, by camera name."""
    clock: ClockOffsets | None = None
    """Offsets of the films by their timecode or sound; None if fewer than two have any."""
    by_clock: bool = False
    """Whether the films were put in step by that before silhouettes were compared."""
    scale: ScaleError | None = None
    """A wrong scale of the calibration; None if it may be right."""
    doubts: tuple[str, ...] = ()
    """Problems with their remedies, a sentence each."""

    @property
    def still(self) -> bool:
        """Whether the person moves too little to tell any film's delay."""
        return self.lateness is not None and all(value is None for value in self.lateness.frames)

    @property
    def good(self) -> bool:
        """Whether there are no problems."""
        return not self.doubts


class SilhouetteSets(NamedTuple):
    """Consecutive sets of silhouettes."""

    rows: list[Row]
    """Silhouettes by set, then by camera."""
    every: int
    """Number of film frames from one set to the next."""


def gather_silhouettes(rig: Rig, options: Options, listener: Listener, whole: bool = False) -> SilhouetteSets:
    """Silhouettes of up to `SETS` sets, beginning with the first set in which two cameras see a person; of the `whole` films, or as many
    a second as tell delays."""
    every = max(1, min(round(rig.rate / MAX_SET_RATE), (rig.count or SETS * 9) // MIN_SETS))
    every = max(every, (rig.count or 0) // SETS) if whole else every
    steps = Steps(listener, rig.names)
    with ThreadPoolExecutor(usable_cores(), "check") as pool:
        segments = [each.segmented for each in pool.map(lambda footage: _silhouettes(footage, options, steps), rig.footage)]
    rows: list[Row] = []
    listener.begin("reading", SETS)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ShadowPuppetWarning)  # a film that breaks off is reported when a run comes to it
        for n, each in enumerate(synchronized_frames(rig, segments, ready=options.masks, every=every, threads=usable_cores())):
            row = silhouettes_of(each.seen.masks)
            if rows or sum(silhouette is not None for silhouette in row) > 1:
                rows.append(row)
                listener.advance(len(rows))
            if len(rows) >= SETS or n >= MAX_SETS_READ:
                break
    return SilhouetteSets(rows, every)


def _silhouettes(footage: Footage, options: Options, steps: Steps) -> Silhouettes:
    steps("reading the film", footage.camera.name)
    sample = take_sample(footage, options.masks, brief_length(footage, options))
    steps("making silhouettes", footage.camera.name)
    found = learn_silhouettes(footage, sample, options)
    steps("", footage.camera.name)
    return found


def judge_calibration(rig: Rig, sets: SilhouetteSets, ready: bool = False) -> CalibrationCheck:
    """Test the calibration of `rig` against silhouettes, made or `ready`. Raises `RecordingError` if no two cameras see a person at the
    same time."""
    if sum(sum(silhouette is not None for silhouette in row) > 1 for row in sets.rows) < 2:
        seen, asked = (("the masks of no two cameras show", "is mask n of each camera frame n of its film, and do they hold the person?")
                       if ready else ("no two cameras see", "do the films belong together?"))
        raise RecordingError(f"{rig.recording.path}: {seen} a person at the same time: {asked}")
    found = _judged(rig, sets.rows)
    offsets = None if found.offsets is None else _in_frames(found.offsets, sets.every)
    check = CalibrationCheck(
        recording=str(rig.recording.path), sets=len(sets.rows), rate=rig.rate / sets.every, frame_rate=rig.rate,
        agreement=found.agreement, lateness=offsets, turns=found.rotations, starts=_starts(rig, found.shifts, sets.every),
        late=tuple(name for name, shift in zip(rig.names, found.shifts) if shift),
    )  # fmt: skip
    return replace(check, doubts=tuple(doubts_of(check)))


class _Judgement(NamedTuple):
    agreement: Agreement
    rotations: dict[str, RotationFix]
    offsets: TimeOffsets | None
    """Time offsets in sets."""
    shifts: list[float]
    """Certain time offset of each film, in sets; 0 if it is uncertain."""

    def left(self) -> list[float]:
        """Disagreements of the cameras, pixels, after the estimated rotations are undone; infinite if none is known."""
        return [self.rotations[name].apart if name in self.rotations else apart
                for name, apart in zip(self.agreement.names, self.agreement.apart) if apart is not None] or [np.inf]


def _judged(rig: Rig, rows: Sequence[Row]) -> _Judgement:
    """Compare places, then times, then places again with the films aligned; the aligned result is used if it leaves no more disagreement,
    and most cameras fit then: where they do not, a delay is no more than noise."""
    still = [0.0] * len(rig.cameras)
    chosen = aligned_sets(rows, still)
    found = compare_cameras(rig.cameras, chosen)
    if found.remedy is not None:
        return _Judgement(found, {}, None, still)
    first = _with_times(rig, rows, found, chosen)
    if not any(first.shifts):
        return first._replace(rotations=first.rotations | _pushed(rig, first, chosen))
    aligned = aligned_sets(rows, first.shifts)
    second = _with_times(rig, rows, compare_cameras(rig.cameras, aligned, remedies=False), aligned)
    is_mended = np.median(second.left()) <= found.limit and np.mean(second.left()) <= np.mean(first.left()) + SAME_PIXELS
    return second if is_mended else first._replace(shifts=still)


def _with_times(rig: Rig, rows: Sequence[Row], found: Agreement, chosen: Sequence[Row]) -> _Judgement:
    """Rotations of cameras that disagree in the `chosen` sets, and time offsets from all sets after these rotations are undone."""
    rotations = _rotations(rig, found, chosen)
    cameras = [rotations[camera.name].turn.of(camera) if camera.name in rotations else camera for camera in rig.cameras]
    offsets = time_offsets(cameras, rows)
    return _Judgement(found, rotations, offsets, certain_offsets(offsets, found.wrong))


def _rotations(rig: Rig, found: Agreement, rows: Sequence[Row]) -> dict[str, RotationFix]:
    """Rotations of the cameras that disagree, or else of the outlier, if they remove the disagreement."""
    fixes = {}
    for name in found.wrong or _standing_out(found, 1.0):
        n = rig.names.index(name)
        fix, apart = _undone(rig, estimate_rotation_error(rig.cameras, rows, n), rows, n), found.apart[n]
        if fix is not None and apart is not None and fix.apart < min(ROTATION_SHARE * apart, found.limit) and fix.turn.certain:
            fixes[name] = fix
    return fixes


def _pushed(rig: Rig, found: _Judgement, rows: Sequence[Row]) -> dict[str, RotationFix]:
    """Displacements of the cameras that disagree, or else of the outlier, if they leave much less than a rotation. Of films in step only:
    before a late film a walking person is elsewhere, as if the camera were."""
    fixes, agreement = {}, found.agreement
    for name in agreement.wrong or _standing_out(agreement, 1.0):
        n = rig.names.index(name)
        left = found.rotations[name].apart if name in found.rotations else agreement.apart[n]
        if left is None or left < SLIGHT_PIXELS:
            continue
        fix = _undone(rig, estimate_place_error(rig.cameras, rows, n), rows, n)
        if fix is not None and fix.turn.distance < MAX_PUSH and fix.apart < ROTATION_SHARE * left and fix.apart < agreement.limit:
            fixes[name] = fix
    return fixes


def _undone(rig: Rig, error: RotationError | None, rows: Sequence[Row], n: int) -> RotationFix | None:
    """What an estimated error of camera `n` leaves if it is undone; None if it, or what is left, is not known."""
    if error is None:
        return None
    cameras = [error.of(camera) if k == n else camera for k, camera in enumerate(rig.cameras)]
    after = compare_cameras(cameras, rows, remedies=False).apart[n]
    return None if after is None else RotationFix(error, after)


def _standing_out(found: Agreement, times: float) -> tuple[str, ...]:
    """The camera that disagrees most, if it exceeds both the slight disagreement of good ones and `times` the median; else empty."""
    apart = {name: value for name, value in zip(found.names, found.apart) if value is not None}
    worst = max(apart, key=lambda name: apart[name], default="")
    least = max(SLIGHT_DISAGREEMENT / MAX_DISAGREEMENT * found.limit, times * float(np.median(list(apart.values()))) if apart else 0.0)
    return (worst,) if worst and len(apart) > 2 and apart[worst] > least else ()


def _in_frames(offsets: TimeOffsets, every: int) -> TimeOffsets:
    def times(values: Sequence[float | None]) -> tuple[float | None, ...]:
        return tuple(None if value is None else round(value * every, 2) for value in values)

    return replace(offsets, frames=times(offsets.frames), spread=times(offsets.spread), pairs=tuple(map(times, offsets.pairs)))


def _starts(rig: Rig, shifts: Sequence[float], every: int) -> dict[str, float]:
    """Values of [start] in recording.toml that align the films, seconds: the present values plus the offsets of late films."""
    if not any(shifts):
        return {}
    least = min(shifts)
    starts = {footage.camera.name: footage.view.start + (shift - least) * every / rig.rate for footage, shift in zip(rig.footage, shifts)}
    return {name: round(start, 4) for name, start in starts.items() if start > 1e-4}


def doubts_of(check: CalibrationCheck) -> list[str]:
    """What is wrong, with its remedy, a sentence each."""
    said, found = list[str](), check.agreement
    if check.late and check.lateness is not None:
        text = delays_in_words({name: value or 0.0 for name, value in zip(check.lateness.names, check.lateness.frames)
                                if name in check.late})
        start = ", ".join(f"{name} = {value:.4g}" for name, value in check.starts.items())
        said.append(f"the films do not begin together ({text}): put into [start] of recording.toml: {start}")
    if found.hopeless and found.remedy is not None:
        return [*said, found.remedy]
    said += [str(doubt) for doubt in found.doubts() if not any(f"camera {name!r} disagrees" in doubt for name in check.turns)]
    for name in check.turns or (() if found.doubts() else _standing_out(found, STANDOUT_FACTOR)):
        others = [other for other in found.names if other != name]
        rest = max(value for other, value in zip(found.names, found.apart) if other != name and value is not None)
        text = f"camera {name!r} disagrees with the others by {found.apart[found.names.index(name)]:.1f} pixels, they by {rest:.1f} at most"
        if name in check.turns:
            rotation, after = check.turns[name]
            moved, back = (f" and moved by {100 * rotation.distance:.0f} cm", "put") if rotation.distance else ("", "turned")
            text += (f"; it is as if it had been turned by {rotation.degrees:.1f} degrees ({_directions(rotation)}){moved} since it was "
                     f"calibrated: {back} back, {after:.1f} pixels would be left")
        said.append(f"{text}; calibrate it again, or leave it out: --camera {','.join(others)}")
    return said


def _directions(rotation: RotationError) -> str:
    """Each part of a rotation with its 90 % interval; those that may be none are left out."""
    directions = [(rotation.right, "to the right", "to the left"), (rotation.down, "down", "up"),
                  (rotation.clockwise, "clockwise", "counter-clockwise")]
    text = [f"{abs(value):.1f} ± {width:.1f} {more if value > 0 else less}"
            for (value, more, less), width in zip(directions, rotation.spread) if abs(value) > max(width, 0.05)]
    return ", ".join(text) or "no direction for certain"
