"""Agreement of several cameras' silhouettes: which camera disagrees with the others, by how much, and the likely remedy."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from shadowpuppet.calibration.epipolar_tangency import tangent_distances
from shadowpuppet.calibration.silhouette_coverage import pixels_beyond, triangulated_centre
from shadowpuppet.calibration.silhouettes import Row, outlines_of, silhouettes_of
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask
from shadowpuppet.errors import HARMFUL, RUINOUS, Finding
from shadowpuppet.geometry import Array, evenly_spread, inverse, rigid, unit
from shadowpuppet.threads import MadeOnDemand

MAX_DISAGREEMENT = 0.01
"""Disagreement from which on a camera is in doubt, over the picture's longer side (6 of 640 pixels); good cameras differ by one pixel."""
REMEDY_SHARE = 0.4
"""A remedy is named if it leaves at most this share of the disagreement."""
BLAME_SHARE = 0.5
"""A single camera is blamed if at most this share of the disagreement is left without it."""
MAX_SHIFT = 12
"""Greatest time shift of a camera that is tried, sets."""
SETS_COMPARED, SETS_PER_REMEDY = 10, 4
"""Number of sets in which cameras are compared, and in which each remedy is tried."""
MILLIMETRE_HEIGHT = 100.0
"""Height of the person in the calibration's metres from which on its lengths are assumed to be millimetres."""
PERSON_HEIGHTS = (0.5, 2.8)
"""Range of people's heights, metres: sitting, and with raised arms."""


@dataclass(frozen=True, kw_only=True)
class Agreement:
    """How well the cameras' silhouettes agree; plain values."""

    names: tuple[str, ...]
    """Names of the cameras."""
    apart: tuple[float | None, ...]
    """Disagreement of each camera with the others, pixels (with those that agree, if one is to blame); None if unknown."""
    pairs: tuple[tuple[float | None, ...], ...]
    """Distance of the tangents of every two cameras, pixels."""
    limit: float
    """Disagreement from which on a camera is in doubt, pixels."""
    height: float | None
    """Height of the person in the calibration's metres: median of the silhouettes' greatest extents at the triangulated person."""
    remedy: str | None = None
    """What would make the cameras agree, if known."""
    hopeless: bool = False
    """Whether nothing can be tracked with this calibration."""

    @property
    def wrong(self) -> tuple[str, ...]:
        """Cameras that disagree with the others."""
        return tuple(name for name, apart in zip(self.names, self.apart) if apart is not None and apart > self.limit)

    def refusal(self) -> str | None:
        """Why tracking is hopeless, and the remedy; None if it is not."""
        return self.remedy if self.hopeless else None

    def doubts(self) -> tuple[Finding, ...]:
        """A sentence on each camera that disagrees, with the remedy; none if there is a refusal."""
        if self.hopeless:
            return ()
        if self.remedy is not None:
            return (Finding(self.remedy, "cameras and calibration do not fit: see `shadowpuppet check`", RUINOUS),)
        return tuple(self._disagreements())

    def _disagreements(self) -> Iterator[Finding]:
        rest = {name: apart for name, apart in zip(self.names, self.apart) if name not in self.wrong}
        if self.wrong and len(rest) < 2:
            values = ", ".join(f"{name} {apart:.0f}" for name, apart in zip(self.names, self.apart) if apart is not None)
            yield Finding(f"the cameras' silhouettes do not fit together (pixels apart: {values}; expected under {self.limit:.0f}): does "
                          "the calibration belong to these films, and were they begun together? calibrate again, or say in [start] of "
                          "recording.toml when each began", "cameras and calibration do not fit: calibrate again", RUINOUS,
                          {name: apart for name, apart in zip(self.names, self.apart) if apart is not None})
            return
        good = max((apart for apart in rest.values() if apart is not None), default=0.0)
        for name in self.wrong:
            yield Finding.of("camera {camera!r} disagrees with the others by {pixels:.0f} pixels, they with each other by {others:.1f}: "
                             "was it moved, or is the calibration another's? calibrate it again, or leave it out: --camera {rest}",
                             "camera {camera!r} disagrees: calibrate again, or --camera {rest}", HARMFUL, camera=name,
                             pixels=self.apart[self.names.index(name)] or 0.0, others=good, rest=",".join(rest))


def agreement(cameras: Sequence[Camera], masks: Sequence[Sequence[Mask | None]], seconds: float = np.nan) -> Agreement:
    """`compare_cameras` of masks (H, W) by set and camera, None where there is none."""
    rows = MadeOnDemand(lambda n: silhouettes_of(masks[n]), len(masks))
    rows.several(evenly_spread(len(masks), SETS_COMPARED).tolist() if masks else ())
    return compare_cameras(cameras, rows, seconds)


def compare_cameras(cameras: Sequence[Camera], rows: Sequence[Row], seconds: float = np.nan, remedies: bool = True) -> Agreement:
    """The `Agreement` of the cameras' silhouettes.

    seconds: time between consecutive sets; NaN if they are not consecutive: then no camera is tested for being late.
    remedies: whether to look for the cause of a disagreement.
    """
    scene = _Scene(tuple(cameras), rows)
    limit = MAX_DISAGREEMENT * max(max(camera.size) for camera in cameras)
    apart, blamed = scene.judged(limit)
    height = scene.height()
    found = Agreement(names=tuple(camera.name for camera in cameras), apart=plain_values(apart), limit=limit, height=height,
                      pairs=tuple(map(plain_values, scene.tangents())))
    if height is not None and height > MILLIMETRE_HEIGHT:
        spread = max(float(np.linalg.norm(a.centre - b.centre)) for a, b in combinations(cameras, 2))
        remedy = (f"the calibration makes the person {height:,.0f} m high and the cameras up to {spread:,.0f} m apart: it is in "
                  "millimetres, it seems; divide every translation in calibration.toml by 1000")
        return replace(found, remedy=remedy, hopeless=True)
    if found.wrong:
        return replace(found, remedy=_remedy(scene, found, blamed, seconds) if remedies else None)
    low, high = PERSON_HEIGHTS
    if height is not None and not low < height < high:
        remedy = (f"the calibration makes the person {height:.2g} m high, expected {low:g} to {high:g} m: is it in metres? "
                  "multiply every translation in calibration.toml by what is missing")
        return replace(found, remedy=remedy)
    return found


@dataclass(frozen=True, eq=False)
class _Scene:
    """Cameras and their silhouettes by set."""

    cameras: tuple[Camera, ...]
    rows: Sequence[Row]

    def spread(self, count: int) -> list[Row]:
        """`count` of the sets at most, evenly spread."""
        return [self.rows[f] for f in evenly_spread(len(self.rows), count) if self.rows]

    def tangents(self, count: int = SETS_COMPARED) -> Array:
        """Distances (C, C) between the tangents of every two cameras, pixels."""
        return tangent_distances(self.cameras, self.spread(count))

    def beyond(self, count: int = SETS_COMPARED) -> Array:
        """`pixels_beyond` (C, C + 1), median over sets."""
        values = np.array([pixels_beyond(self.cameras, row) for row in self.spread(count)])
        return _median(values.reshape(-1, len(self.cameras), len(self.cameras) + 1))

    def total(self) -> float:
        """Disagreement of all cameras as one number, pixels: the mean of `tangents` plus that of `beyond`."""
        return _mean(self.tangents(SETS_PER_REMEDY)) + float(np.nan_to_num(_mean(self.beyond(SETS_PER_REMEDY)[:, -1])))

    def judged(self, limit: float) -> tuple[Array, int | None]:
        """Disagreement of each camera (C,), pixels, and the index of the camera to blame, if it is a single one."""
        tangents, beyond = self.tangents(), self.beyond()
        lowest = np.array([_lower_median(row) for row in tangents])  # so that one wrong camera raises no other's value
        apart, C = np.fmax(lowest, beyond[:, -1]), len(tangents)
        if not (apart > limit).any() or C < 3:
            return apart, None
        without = np.array([_mean(np.fmax(lowest, beyond[:, w])[np.arange(C) != w]) for w in range(C)])
        if np.isnan(without).all():
            return apart, None
        w = int(np.nanargmin(without))
        if without[w] > min(BLAME_SHARE * _mean(apart), limit):
            return apart, None
        rest = np.fmax(lowest, beyond[:, w])
        rest[w] = apart[w]
        return rest, w

    def height(self) -> float | None:
        """Median of the silhouettes' greatest extents at the triangulated person, across the view, metres; None if unknown."""
        from scipy.spatial.distance import pdist

        heights = []
        for row in self.spread(SETS_COMPARED):
            outlines = outlines_of(self.cameras, row)
            middle = triangulated_centre(self.cameras, outlines)
            for camera, outline in zip(self.cameras, outlines):
                if middle is not None and outline is not None:
                    mean = unit(outline.rays.mean(0))
                    across = outline.rays / np.maximum(outline.rays @ mean, 0.1)[:, None]
                    heights.append(pdist(across).max() * np.linalg.norm(middle - camera.centre))
        return float(np.median(heights)) if heights else None


# Remedies


def _remedy(scene: _Scene, found: Agreement, blamed: int | None, seconds: float) -> str | None:
    """A sentence on the known mistake that explains the disagreement best, and its remedy; None if none explains it."""
    before = scene.total()
    tried = ((changed.total(), sentence) for changed, sentence in _changes(scene, found.names, blamed, seconds))
    after, sentence = min(tried, key=lambda each: each[0])
    if after > min(REMEDY_SHARE * before, found.limit):
        return None
    return f"{sentence}: then all agree within {after:.1f} pixels, instead of {before:.0f}"


def _changes(scene: _Scene, names: Sequence[str], blamed: int | None, seconds: float) -> Iterator[tuple[_Scene, str]]:
    """For each known mistake, the scene with it corrected, and the sentence to the user."""
    C = len(names)
    for a, b in combinations(range(C), 2):
        if scene.cameras[a].size == scene.cameras[b].size:
            order = list(range(C))
            order[a], order[b] = b, a
            yield (replace(scene, rows=[[row[n] for n in order] for row in scene.rows]),
                   f"cameras {names[a]!r} and {names[b]!r} are swapped, it seems; exchange their films, or their names in calibration.toml")
    for n in range(C):
        yield _mirrored(scene, [n]), f"camera {names[n]!r} shows mirrored pictures, it seems; turn the mirroring off, or flip its film"
    yield (_mirrored(scene, range(C)),
           "all cameras show mirrored pictures, it seems; turn the mirroring off, or flip the films")
    turned = tuple(replace(camera, T_camera_world=inverse(camera.T_camera_world)) for camera in scene.cameras)
    yield (replace(scene, cameras=turned),
           "the calibration says where cameras stand (camera to world), it seems, instead of how the world lies to them; invert every "
           "rotation and translation in calibration.toml")
    centred = tuple(replace(camera, T_camera_world=_with_centre(camera.T_camera_world)) for camera in scene.cameras)
    yield (replace(scene, cameras=centred),
           "the calibration's translations are the places of the cameras, it seems, as in Human3.6M; replace every translation T in "
           "calibration.toml by -R T")
    if not np.isfinite(seconds):
        return
    for n in range(C) if blamed is None and C < 4 else [blamed] if blamed is not None else []:
        for steps in range(-MAX_SHIFT, MAX_SHIFT + 1):
            if steps:
                yield _shifted(scene, n, steps), _late(names, n, seconds * steps)


def _with_centre(T: Array) -> Array:
    """World to camera (4, 4) of a camera that stands at the translation of T."""
    return rigid(T[:3, :3], -T[:3, :3] @ T[:3, 3])


def _mirrored(scene: _Scene, which: Sequence[int]) -> _Scene:
    """The scene with the pictures of the cameras `which` mirrored."""
    return replace(scene, rows=[[silhouette.mirrored() if silhouette is not None and n in which else silhouette
                                 for n, silhouette in enumerate(row)] for row in scene.rows])


def _shifted(scene: _Scene, n: int, steps: int) -> _Scene:
    """The scene with camera `n`'s pictures `steps` sets earlier; sets for which it then has none are left out."""
    rows = scene.rows
    return replace(scene, rows=[[*rows[f][:n], rows[f + steps][n], *rows[f][n + 1 :]]
                                for f in range(len(rows)) if 0 <= f + steps < len(rows)])


def _late(names: Sequence[str], n: int, late: float) -> str:
    later = [names[n]] if late > 0 else [name for name in names if name != names[n]]
    start = ", ".join(f"{name} = {abs(late):.2f}" for name in later)
    return (f"camera {names[n]!r} is about {abs(late):.2f} s {'late' if late > 0 else 'early'}, it seems; add to [start] of "
            f"recording.toml: {start}")


# Figures


def _lower_median(values: Array) -> float:
    known = np.sort(values[np.isfinite(values)])
    return float(known[(len(known) - 1) // 2]) if len(known) else np.nan


def _mean(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else np.nan


def _median(values: Array) -> Array:
    """Median over the first axis, ignoring NaN; NaN where all values are."""
    known = np.isfinite(values).any(0)
    out = np.full(values.shape[1:], np.nan)
    out[known] = np.nanmedian(values[:, known], axis=0)
    return out


def plain_values(values: Array) -> tuple[float | None, ...]:
    """Values rounded to 0.01, None for NaN, as in files."""
    return tuple(round(float(value), 2) if np.isfinite(value) else None for value in values)
