"""Cameras placed by a walking person alone: outlines refine a rough calibration, the height gives the scale, the feet the floor."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from shadowpuppet.calibration.results import replace_calibration
from shadowpuppet.calibration.silhouettes import Row, aligned_sets
from shadowpuppet.calibration.solve.tangency_bundle import ROUGH_FOCAL, TangencyFit, place_by_outlines
from shadowpuppet.calibration.time_offset import time_offsets
from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import CalibrationError, typed
from shadowpuppet.geometry import Array, inverse, rigid, rotation_from_vector, unit
from shadowpuppet.io.calibration.rough import ROUGH_NAME
from shadowpuppet.io.recording import UncalibratedError
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.progress import Listener
from shadowpuppet.pipeline.repair.check import SilhouetteSets, gather_silhouettes
from shadowpuppet.pipeline.repair.clocks import clock_offsets, in_step
from shadowpuppet.pipeline.repair.fix import write_notes
from shadowpuppet.pipeline.rig import Rig, open_rig
from shadowpuppet.tracking.multiview.surface.visual_hull import VisualHull

SETS = 90
"""Number of sets, over all of the films, whose outlines are compared."""
ROUNDS, SAME_START = 10, 0.002
"""Greatest number of times that cameras are placed and films put in step, in turn; least difference of starts, seconds, that is written."""
STANDING = 80
"""Percentile of the heights of the visual hull that counts as the person's: walking and bending people are lower."""
MAX_CROUCH = 1.03
"""Ratio of that height to the median from which on the person is not upright enough for a scale."""
EXTREMES = 4
"""Number of the hull's points whose mean is its top, or its bottom."""
LEVEL_SD, END_SD, FLOOR_QUANTILE = np.radians(5.0), 0.02, 0.8
"""Standard deviations of a rough calibration's vertical, rad, and of a hull's ends, metres; the share of the lowest ends at or below the
floor."""
LEAST_POINTS, LEAST_HULLS = 50, 10
"""Least number of points of a hull, and of hulls, whose ends are used."""
DOUBT_FACTOR = 3.0
"""Factor on the fit's standard deviations: silhouettes err alike in all of a film, which it does not know."""
MAX_PLACE_DOUBT, MAX_ANGLE_DOUBT = 0.02, np.radians(0.3)
"""Doubts about a camera's place, metres, and direction, rad, that are not remarked on."""
MAX_FOCAL_DOUBT = 0.01
"""Relative doubt about a focal length that is not remarked on."""
STATED_FOCAL = ("fields of view stay as they are stated: this film does not tell them; a person who walks near and far would, and a board "
                "filmed by each camera (`shadowpuppet calibrate LAB`)")
ROUGH_EXAMPLE = "at = [2.5, -3.0, 1.4], toward = [0.0, 0.0, 1.0], fov = 65"
"""What such a file says of a camera, for messages."""
NO_HEIGHT = "the scale is the rough calibration's: state the person's --height, in metres with shoes on"
MANY_FAR = 0.15
"""Share of tangents that are far apart (`TangencyFit.far`) that is remarked on."""
MOST_FAR = 0.5
"""That share from which on cameras are not placed at all: what was found then is no rig."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Placed:
    """Cameras as a person's outlines place them."""

    cameras: tuple[Camera, ...]
    """In metres, z up from the floor."""
    fit: TangencyFit
    """Before scale and floor."""
    sets: int
    """Number of sets of silhouettes compared."""
    scale: float
    """Factor on the rough calibration's lengths."""
    tilt: float
    """Angle between the rough calibration's vertical and the floor's, rad."""
    advice: tuple[str, ...]
    """What to doubt, a sentence each; none if all is well."""
    starts: dict[str, float]
    """[start] of the recording by camera, seconds, as found; the earliest film begins when it did. Empty if all stay as they are."""

    @property
    def place_doubt(self) -> Array:
        """What each camera's place is known to within the rig, of shape (C,), metres."""
        return DOUBT_FACTOR * self.scale * self.fit.place_sd

    @property
    def focal_doubt(self) -> Array:
        """The same of its focal length, of shape (C,), relative; 0 where it was given."""
        return DOUBT_FACTOR * self.fit.focal_sd

    @property
    def angle_doubt(self) -> Array:
        """The same of its direction, of shape (C,), rad."""
        return DOUBT_FACTOR * self.fit.angle_sd


def open_rough(recording: Path, options: Options) -> tuple[Rig, float]:
    """The rig of a recording with cameras as its rough.toml places them, or else its calibration; and the `rough_focal` of their lenses,
    0 if they are known. Raises a `ShadowPuppetError`."""
    file = recording / ROUGH_NAME
    try:
        if not file.exists():
            return open_rig(recording, options), 0.0
        return open_rig(recording, replace(options, calibration=file)), ROUGH_FOCAL
    except UncalibratedError as error:
        raise CalibrationError(_without_places(recording, error, file.exists())) from None


def _without_places(recording: Path, error: UncalibratedError, begun: bool) -> str:
    """What to write into rough.toml for the cameras that have a film but no place, for a message; `begun`: whether the file exists."""
    file, cameras = recording / ROUGH_NAME, error.cameras
    if len(cameras) == 1 and not error.known:
        return f"{recording}: found one camera, expected two or more: outlines are compared"
    command = typed("calibrate", recording, "--from-person", "--height", "METRES")
    names = ", ".join(cameras)
    said = (f"found no section of {names}, expected one for each film" if begun else
            f"no such file, expected one that says where the cameras stand: a section for each film ({names})")
    return (f"{file}: {said}, such as [{cameras[0]}] with the three lines {ROUGH_EXAMPLE} (metres, z up; degrees across the picture; "
            f"docs/calibration.md), or move films that are not to be used out of the folder; then `{command}`, with the person's height")


def place_cameras(rig: Rig, options: Options, listener: Listener | None = None, rough_focal: float = 0.0) -> Placed:
    """The places and directions of cameras with rough places, from the person in their films; focal lengths, too, unless `rough_focal` is 0
    (see `place_by_outlines`).

    Films are put in step first, by their timecode or sound and then, as far as the rough places allow, by the silhouettes. The scale is
    the one at which the person is as tall as `options.height` or the recording's; without, the rough calibration's. Raises
    `CalibrationError` if too little of the person is seen by two cameras at a time, or a camera's rough place is not known.
    """
    if len(rig.cameras) < 2:
        raise CalibrationError(f"{rig.recording.path}: found one camera, expected two or more: outlines are compared")
    for camera in rig.cameras:
        if not camera.oriented:
            raise CalibrationError(f"camera {camera.name!r}: found only a field of view, expected also where it stands, roughly")
    listener = listener or Listener()
    listener.begin("reading the films' clocks")
    clock = clock_offsets(rig)
    there = rig if clock is None else in_step(rig, clock.seconds)
    sets = gather_silhouettes(there, options, listener, whole=True)
    listener.begin("placing the cameras")
    fit, late = placed_in_step(there.cameras, sets, rough_focal)
    if any(late):
        there = in_step(there, [sets.every * steps / there.rate for steps in late])
        sets = gather_silhouettes(there, options, listener, whole=True)
    rows = aligned_sets(sets.rows, [0.0] * len(there.cameras), SETS)
    fit = placed_by_rows(there.cameras, rows, rough_focal) if any(late) else fit
    check_placed(fit)
    listener.begin("floor and height")
    unknown = rough_focal > 0 and not fit.focal_sd.any()
    placed = grounded(fit, rows, options.height or rig.recording.subject.height)
    early = min(view.start for view in there.recording.views) - min(view.start for view in rig.recording.views)  # of the clock itself
    starts = {view.camera.name: round(view.start - early, 4) for view in there.recording.views}
    changed = any(abs(starts[view.camera.name] - view.start) > SAME_START for view in rig.recording.views)
    placed = replace(placed, advice=(*placed.advice, STATED_FOCAL)) if unknown else placed
    return replace(placed, starts=starts) if changed else placed


def check_placed(fit: TangencyFit) -> None:
    """Raise `CalibrationError` if most tangents are far apart in the best fit."""
    if fit.far > MOST_FAR:
        raise CalibrationError(f"{100 * fit.far:.0f} % of the tangents do not fit wherever the cameras stand, so none is placed: are the "
                               "films of one moment and in step, is each silhouette the same whole person (`shadowpuppet info`), and are "
                               "the rough places within half a metre and ten degrees?")


def placed_in_step(cameras: Sequence[Camera], sets: SilhouetteSets, rough_focal: float = 0.0) -> tuple[TangencyFit, list[float]]:
    """The fit in which fewest tangents are far apart, and the sets by which each film is late there (0 for all if none is).

    Cameras are placed, delays estimated as seen from there, and both again with the films shifted: a wrong place turns a tangent by a
    nearly constant angle, which delays do not depend on, so that both converge. Where that fails it is begun once more with the delays as
    seen from the rough places. Raises `CalibrationError` as `place_by_outlines`.
    """
    best = dict[tuple[int, ...], tuple[TangencyFit, Array]]()
    for seen_from in ((), cameras):
        shifts = _shifts(seen_from, sets)
        for _ in range(ROUNDS):
            steps = tuple(np.rint(shifts).astype(int).tolist())
            if steps in best:
                break
            try:
                fit = placed_by_rows(cameras, aligned_sets(sets.rows, steps, SETS), rough_focal)
            except CalibrationError:
                if not best:
                    raise
                break  # shifted so, the films have too little in common
            shifts = _shifts(fit.cameras, sets)
            best[steps] = fit, shifts
        if min(fit.far for fit, _ in best.values()) < MANY_FAR:
            break
    steps = min(best, key=lambda steps: best[steps][0].far)
    fit, shifts = best[steps]
    return fit, (np.where(np.abs(shifts - steps) < 1, shifts, steps) if any(steps) else np.zeros(len(steps))).tolist()


def placed_by_rows(cameras: Sequence[Camera], rows: Sequence[Row], rough_focal: float) -> TangencyFit:
    """As `place_by_outlines`; focal lengths that the film tells less well than `rough_focal` stay as they are."""
    fit = place_by_outlines(cameras, rows, rough_focal=rough_focal)
    known = DOUBT_FACTOR * float(fit.focal_sd.max()) <= rough_focal
    return fit if known else place_by_outlines(cameras, rows)


def _shifts(cameras: Sequence[Camera], sets: SilhouetteSets) -> Array:
    """Sets (C,) by which films are late as seen from cameras; 0 where that is not known, and without cameras."""
    return np.array([late or 0.0 for late in time_offsets(cameras, sets.rows).frames] if cameras else np.zeros(len(sets.rows[0])))


def grounded(fit: TangencyFit, rows: Sequence[Row], height: float | None) -> Placed:
    """The cameras of a fit with the floor at z = 0 and, if the person's height (metres) is known, in metres: by the visual hulls' ends."""
    ends, advice = _ends(fit.cameras, rows), list[str]()
    if ends is None:
        advice.append("floor and scale are the rough calibration's: the person is hardly ever whole in two pictures")
        return _with_doubts(Placed(cameras=fit.cameras, fit=fit, sets=len(rows), scale=1.0, tilt=0.0, advice=tuple(advice), starts={}))
    level, tilt = _floor(ends)
    usual, tall = np.percentile(_above(level, ends.top), [50, STANDING])
    if height is None:
        advice.append(NO_HEIGHT)
    elif tall > MAX_CROUCH * usual:
        advice.append(f"the scale is rough: the person bends in most of the film ({usual:.2f} m high, {tall:.2f} when upright)")
    scale = 1.0 if height is None else height / float(tall)
    return _with_doubts(Placed(cameras=tuple(_seen_from(camera, level, scale) for camera in fit.cameras), fit=fit, sets=len(rows),
                               scale=scale, tilt=tilt, advice=tuple(advice), starts={}))


def _with_doubts(placed: Placed) -> Placed:
    return replace(placed, advice=(*_doubts(placed), *placed.advice))


class _Ends(NamedTuple):
    """The lowest and highest places of the person, one a set."""

    bottom: Array
    """Of shape (F, 3), metres."""
    top: Array
    """Of shape (F, 3), metres."""


def _ends(cameras: Sequence[Camera], rows: Sequence[Row]) -> _Ends | None:
    """The ends of the visual hulls; None if there are too few hulls."""
    hull, bottom, top = VisualHull(cameras), [], []
    for row in rows:
        points = hull.points([None if silhouette is None else silhouette.mask for silhouette in row]).points
        if len(points) >= LEAST_POINTS:
            order = points[np.argsort(points[:, 2])]
            bottom.append(order[:EXTREMES].mean(0))
            top.append(order[-EXTREMES:].mean(0))
    return _Ends(np.array(bottom), np.array(top)) if len(bottom) >= LEAST_HULLS else None


def _floor(ends: _Ends) -> tuple[Array, float]:
    """The motion (4, 4) of the world that puts the floor on z = 0, and its tilt (rad).

    Feet stand on one plane, and crowns, but for walking's ups and downs, lie on another above it. Both are fitted at once, robustly. A hull
    ends at or below the soles, as few cameras may see them: its lowest places have the floor as an upper quantile. Where they lie along a
    line or at one place, the rough calibration's vertical decides (a prior).
    """
    from scipy.optimize import least_squares

    middle = np.median(ends.bottom, axis=0)

    def heights(places: Array, plane: Array, k: int) -> Array:
        away = places - middle
        return (away[:, 2] - away[:, :2] @ plane[:2] - plane[k]) / END_SD

    def cost(plane: Array) -> Array:
        low, high = heights(ends.bottom, plane, 2), heights(ends.top, plane, 3)
        pulls = np.where(low > 0, FLOOR_QUANTILE, 1 - FLOOR_QUANTILE)
        return np.r_[np.sqrt(2 * pulls) * _soft(low), _soft(high), plane[:2] / np.tan(LEVEL_SD)]

    plane = least_squares(cost, np.r_[np.zeros(3), np.median(ends.top[:, 2]) - middle[2]]).x
    up = unit(np.array([-plane[0], -plane[1], 1.0]))
    axis = np.cross(up, [0.0, 0.0, 1.0])
    sine, angle = float(np.linalg.norm(axis)), float(np.arccos(np.clip(up[2], -1, 1)))
    R = rotation_from_vector(axis / sine * angle) if sine > 1e-9 else np.eye(3)
    ground = middle + plane[2] * np.array([0.0, 0.0, 1.0])
    return rigid(R, ground * [1, 1, 0] - R @ ground), angle


def _soft(values: Array) -> Array:
    """Residuals whose squares are soft L1 losses."""
    return np.sqrt(2 * (np.sqrt(1 + values**2) - 1))


def _above(level: Array, places: Array) -> Array:
    """Heights (F,) over the floor."""
    return places @ level[2, :3] + level[2, 3]


def _seen_from(camera: Camera, level: Array, scale: float) -> Camera:
    """The camera in the world moved by `level` (4, 4) and grown by `scale`."""
    T = camera.T_camera_world @ inverse(level)
    T[:3, 3] *= scale
    return replace(camera, T_camera_world=T)


def _doubts(placed: Placed) -> Iterator[str]:
    """What to doubt about the fit, a sentence each."""
    if placed.fit.far > MANY_FAR:
        yield (f"{100 * placed.fit.far:.0f} % of the tangents do not fit: are the films in step (`shadowpuppet check`), and are "
               "silhouettes whole? A leg that is missing in one camera moves all others")
    poor = [f"{camera.name} to {1000 * place:.0f} mm and {np.degrees(angle):.1f} degrees"
            for camera, place, angle in zip(placed.cameras, placed.place_doubt, placed.angle_doubt)
            if place > MAX_PLACE_DOUBT or angle > MAX_ANGLE_DOUBT]
    if poor:
        yield f"places are not well known ({', '.join(poor)}): film a person who walks through all of the room, bends and reaches"
    if (doubt := float(placed.focal_doubt.max())) > MAX_FOCAL_DOUBT:
        yield (f"focal lengths are known to {100 * doubt:.1f} % only, and places suffer: a board filmed by each camera tells them "
               "(`shadowpuppet calibrate LAB`), once for all recordings")


def _replaced(camera: Camera, now: Camera, before: Camera) -> Camera:
    """The camera at its new place, its focal length changed by as much as that of `before`, whose pictures may be reduced."""
    factor = np.array([now.matrix[0, 0] / before.matrix[0, 0], now.matrix[1, 1] / before.matrix[1, 1], 1])
    return replace(camera, T_camera_world=now.T_camera_world, matrix=camera.matrix * factor)


def write_placed(rig: Rig, placed: Placed, path: Path | None = None) -> list[Path]:
    """Write the calibration (.toml), by default the recording's own; returns the files written. One that is there is kept under another
    name. Cameras that were not placed stay as they are. Raises `CalibrationError` or `RecordingError` if a file cannot be written."""
    path = path or rig.recording.path / "calibration.toml"
    own = path == rig.recording.path / "calibration.toml"
    if not path.parent.is_dir():
        raise CalibrationError(f"{path}: its folder does not exist")
    placings = {camera.name: (camera, old) for camera, old in zip(placed.cameras, rig.cameras)}
    written = replace_calibration(path, [_replaced(view.camera, *placings.get(view.camera.name, (view.camera, view.camera)))
                                         for view in rig.recording.views])
    notes = {"calibration": None, **({"start": placed.starts} if placed.starts else {})}
    return [*written, *(write_notes(rig.recording.path / "recording.toml", notes) if own else [])]
