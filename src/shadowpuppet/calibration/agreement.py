"""Which of several cameras disagrees with the others, by their silhouettes alone, and what would make it agree."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np

from shadowpuppet.calibration.epipolar_tangency import Outline, Outlines, tangent_distances
from shadowpuppet.calibration.silhouette_coverage import Coverage, triangulated_centre
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask
from shadowpuppet.geometry import Array, inverse

MAX_DISAGREEMENT = 0.01
"""Pixels, over the picture's longer side, from which on cameras are in doubt (6 of 640); good ones are apart by one."""
REMEDY_SHARE = 0.4
"""A remedy is told where no more than this of the disagreement is left..."""
BLAME_SHARE = 0.5
"""... and a camera is blamed where no more than this is left without it."""
MAX_SHIFT = 12
"""Sets by which a camera's pictures are moved, to and fro, to see whether they come late."""
SETS_COMPARED, SETS_PER_REMEDY = 10, 4
"""Sets in which cameras are compared, and in which each remedy is tried."""
MILLIMETRE_HEIGHT = 100.0
"""Height (metres by the calibration) of a person from which on it is in millimetres."""
PERSON_HEIGHT_RANGE = (0.5, 2.8)
"""Height of people, metres: sitting, and with raised arms."""


@dataclass(frozen=True, kw_only=True)
class Agreement:
    """How well cameras fit together; plain values."""

    names: tuple[str, ...]
    """Of the cameras."""
    apart: tuple[float | None, ...]
    """By how many pixels each disagrees with the others (with those that agree, where one is to blame); None where it cannot be told."""
    pairs: tuple[tuple[float | None, ...], ...]
    """By how many pixels every two cameras' tangents differ."""
    limit: float
    """Pixels from which on cameras are in doubt."""
    height: float | None
    """What the silhouettes measure at their longest, at the place where they meet, metres by the calibration, median."""
    remedy: str | None = None
    """What would make them agree, where that is known."""
    hopeless: bool = False
    """Whether nothing can be tracked as it is."""

    @property
    def wrong(self) -> tuple[str, ...]:
        """Cameras that disagree with the others."""
        return tuple(name for name, apart in zip(self.names, self.apart) if apart is not None and apart > self.limit)

    def refusal(self) -> str | None:
        """Why tracking is hopeless, and the remedy; None where it is not."""
        return self.remedy if self.hopeless else None

    def doubts(self) -> tuple[str, ...]:
        """Which cameras disagree, by how much, and the remedy, a sentence each; none where there is a refusal."""
        if self.hopeless:
            return ()
        if self.remedy is not None:
            return (self.remedy,)
        return tuple(self._disagreements())

    def _disagreements(self) -> Iterator[str]:
        rest = {name: apart for name, apart in zip(self.names, self.apart) if name not in self.wrong}
        if self.wrong and len(rest) < 2:
            told = ", ".join(f"{name} {apart:.0f}" for name, apart in zip(self.names, self.apart) if apart is not None)
            yield (f"the cameras' silhouettes do not fit together (pixels apart: {told}; expected under {self.limit:.0f}): does the "
                   "calibration belong to these films, and were they begun together? calibrate again, or say in [start] of recording.toml "
                   "when each began")
            return
        good = max((apart for apart in rest.values() if apart is not None), default=0.0)
        for name in self.wrong:
            yield (f"camera {name!r} disagrees with the others by {self.apart[self.names.index(name)]:.0f} pixels, they with each other "
                   f"by {good:.1f}: was it moved, or is the calibration another's? calibrate it again, or leave it out: --camera "
                   f"{','.join(rest)}")


def agreement(cameras: Sequence[Camera], masks: Sequence[Sequence[Mask | None]], seconds: float = np.nan,
              remedies: bool = True) -> Agreement:
    """How well the cameras' silhouettes fit together: `masks` (H, W) by set and camera, None where there is none.

    `seconds`: from set to set, by which it is told how late a film is; if left out, sets do not follow one another, and that is not asked.
    `remedies`: whether what would mend them is looked for.
    """
    scene = _Scene(tuple(cameras), [list(row) for row in masks])
    limit = MAX_DISAGREEMENT * max(max(camera.size) for camera in cameras)
    apart, blamed = scene.judged(limit)
    height = scene.height()
    names, pairs = tuple(camera.name for camera in cameras), tuple(map(_plain, scene.tangents()))
    found = Agreement(names=names, apart=_plain(apart), pairs=pairs, limit=limit, height=height)
    if height is not None and height > MILLIMETRE_HEIGHT:
        told = (f"the calibration makes the person {height:,.0f} m high and the cameras up to {_spread(cameras):,.0f} m apart: it is in "
                "millimetres, it seems; divide every translation in calibration.toml by 1000")
        return replace(found, remedy=told, hopeless=True)
    if found.wrong:
        return replace(found, remedy=_remedy(scene, found, blamed, seconds) if remedies else None)
    if height is not None and not PERSON_HEIGHT_RANGE[0] < height < PERSON_HEIGHT_RANGE[1]:
        told = (f"the calibration makes the person {height:.2g} m high, expected {PERSON_HEIGHT_RANGE[0]:g} to {PERSON_HEIGHT_RANGE[1]:g} m: is it in metres? "
                "multiply every translation in calibration.toml by what is missing")
        return replace(found, remedy=told)
    return found


@dataclass(frozen=True, eq=False)
class _Scene:
    """Cameras and what they saw, by set; what is known of each mask is shared by the scenes made from one another."""

    cameras: tuple[Camera, ...]
    masks: list[list[Mask | None]]
    outlines: Outlines = field(default_factory=Outlines)
    coverage: Coverage = field(default_factory=Coverage)

    def rows(self, count: int = SETS_COMPARED) -> list[list[Mask | None]]:
        """Some of the sets, spread."""
        return [self.masks[f] for f in np.unique(np.linspace(0, len(self.masks) - 1, count).astype(int)) if self.masks]

    def seen(self, row: Sequence[Mask | None]) -> list[Outline | None]:
        return [self.outlines.of(camera, mask) for camera, mask in zip(self.cameras, row)]

    def tangents(self, count: int = SETS_COMPARED) -> Array:
        """Pixels (C, C) between the tangents of every two cameras."""
        return tangent_distances(self.cameras, [self.seen(row) for row in self.rows(count)])

    def beyond(self, count: int = SETS_COMPARED) -> Array:
        """Pixels (C, C + 1) of `Coverage.beyond`, median over sets."""
        values = np.array([self.coverage.beyond(self.cameras, row, self.seen(row)) for row in self.rows(count)])
        return _median(values.reshape(-1, len(self.cameras), len(self.cameras) + 1))

    def total(self) -> float:
        """One figure for how badly all fit together, pixels."""
        return _mean(self.tangents(SETS_PER_REMEDY)) + float(np.nan_to_num(_mean(self.beyond(SETS_PER_REMEDY)[:, -1])))

    def judged(self, limit: float) -> tuple[Array, int | None]:
        """By how many pixels each camera (C,) disagrees, and which one is to blame for it, if one alone is."""
        tangents, beyond = self.tangents(), self.beyond()
        lowest = np.array([_lower_median(row) for row in tangents])  # so that one wrong camera blames no other
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
        """What the silhouettes measure at their longest, at the place where they meet; the median."""
        heights = []
        for row in self.rows():
            outlines = self.seen(row)
            middle = triangulated_centre(self.cameras, outlines)
            for camera, outline in zip(self.cameras, outlines):
                if middle is not None and outline is not None:
                    mean = outline.rays.mean(0)
                    angle = np.arccos(np.clip((outline.rays @ mean).min() / np.linalg.norm(mean), 0.1, 1))
                    heights.append(2 * np.tan(angle) * np.linalg.norm(middle - camera.centre))
        return float(np.median(heights)) if heights else None


# Remedies


def _remedy(scene: _Scene, found: Agreement, blamed: int | None, seconds: float) -> str | None:
    """What would make the cameras agree; None where nothing of what is known to happen would."""
    before = scene.total()
    tried = ((changed.total(), told) for changed, told in _changes(scene, found.names, blamed, seconds))
    after, told = min(tried, key=lambda each: each[0])
    if after > min(REMEDY_SHARE * before, found.limit):
        return None
    return f"{told}: then all agree within {after:.1f} pixels, instead of {before:.0f}"


def _changes(scene: _Scene, names: Sequence[str], blamed: int | None, seconds: float) -> Iterator[tuple[_Scene, str]]:
    """What may be wrong: the scene with it mended, and how to say so."""
    C = len(names)
    for a, b in combinations(range(C), 2):
        if scene.cameras[a].size == scene.cameras[b].size:
            order = list(range(C))
            order[a], order[b] = b, a
            yield (replace(scene, masks=[[row[n] for n in order] for row in scene.masks]),
                   f"cameras {names[a]!r} and {names[b]!r} are swapped, it seems; exchange their films, or their names in calibration.toml")
    for n in range(C):
        yield _mirrored(scene, [n]), f"camera {names[n]!r} shows mirrored pictures, it seems; turn the mirroring off, or flip its film"
    yield (_mirrored(scene, range(C)),
           "all cameras show mirrored pictures, it seems; turn the mirroring off, or flip the films")
    turned = tuple(replace(camera, T_camera_world=inverse(camera.T_camera_world)) for camera in scene.cameras)
    yield (replace(scene, cameras=turned),
           "the calibration says where cameras stand (camera to world), it seems, instead of how the world lies to them; invert every "
           "rotation and translation in calibration.toml")
    if not np.isfinite(seconds):
        return
    for n in range(C) if blamed is None and C < 4 else [blamed] if blamed is not None else []:
        for steps in range(-MAX_SHIFT, MAX_SHIFT + 1):
            if steps:
                yield _shifted(scene, n, steps), _late(names, n, seconds * steps)


def _mirrored(scene: _Scene, which: Sequence[int]) -> _Scene:
    return replace(scene, masks=[[np.ascontiguousarray(mask[:, ::-1]) if mask is not None and n in which else mask
                                  for n, mask in enumerate(row)] for row in scene.masks])


def _shifted(scene: _Scene, n: int, steps: int) -> _Scene:
    """With camera `n`'s pictures so many sets earlier; sets for which it then has none are left out."""
    F = len(scene.masks)
    return replace(scene, masks=[[*scene.masks[f][:n], scene.masks[f + steps][n], *scene.masks[f][n + 1 :]]
                                 for f in range(F) if 0 <= f + steps < F])


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
    """Over the first axis, of what is known; not a number where nothing is."""
    known = np.isfinite(values).any(0)
    out = np.full(values.shape[1:], np.nan)
    out[known] = np.nanmedian(values[:, known], axis=0)
    return out


def _spread(cameras: Sequence[Camera]) -> float:
    """Greatest distance between two cameras, metres by the calibration."""
    return max(float(np.linalg.norm(a.centre - b.centre)) for a, b in combinations(cameras, 2))


def _plain(values: Array) -> tuple[float | None, ...]:
    return tuple(round(float(value), 2) if np.isfinite(value) else None for value in values)
