"""Which of several cameras disagrees with the others, by their silhouettes alone, and what would make it agree.

Two cameras and their silhouettes fit together where the outermost planes through both cameras that touch the one silhouette touch the
other too (epipolar tangency: Wong & Cipolla 2001, "Structure and motion from silhouettes"). A distance in pixels is what is left.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.camera import Camera
from shadowpuppet.geometry import Array, inverse
from shadowpuppet.masks import Mask, may_be_person

DISAGREES = 0.01
"""Tangents farther apart than this, over the picture's longer side, are in doubt (6 pixels of 640); good ones are a pixel apart."""
BETTER = 0.35
"""A remedy is told where it leaves no more than this of the disagreement."""
WIDE = 2.6
"""Radians that a silhouette may cover around the line from camera to camera: beyond, that line runs through or along it."""
EVERY = 2
"""Pixels of a contour from one taken to the next."""
BORDER = 2
"""Pixels from the picture's border within which nothing can be said of an outline."""
MOVING = 12
"""Sets by which a camera's film is moved, to and fro, to see whether it runs late."""
TRIED = 14
"""Sets in which remedies are tried."""
MILLIMETRES = 100.0
"""Height (metres by the calibration) of a person from which on it is in millimetres."""
PEOPLE = (0.5, 2.6)
"""Height of people, metres, with raised arms or sitting."""

Outlines = list[list[Array | None]]
"""Pixels (K, 2) of the outline, and whether each is far from the picture's border: (K, 3), by set and camera."""


@dataclass(frozen=True, kw_only=True)
class Agreement:
    """How well cameras fit together; plain values."""

    names: tuple[str, ...]
    """Of the cameras."""
    apart: tuple[float | None, ...]
    """By how many pixels each disagrees with most others, median; None where nothing can be said."""
    pairs: tuple[tuple[float | None, ...], ...]
    """The same for every pair."""
    limit: float
    """Pixels from which on this is in doubt."""
    outside: tuple[float | None, ...]
    """Share of each camera's silhouettes that no place in space explains which the others see silhouette at, too."""
    height: float | None
    """What the silhouettes measure from top to bottom at the place where they meet, metres by the calibration, median."""
    remedy: str | None = None
    """What would make them agree, where that is known."""
    hopeless: bool = False
    """Whether nothing can be tracked as it is."""

    def refusal(self) -> str | None:
        """Why tracking is hopeless, and the remedy; None where it is not."""
        return self.remedy if self.hopeless else None

    def doubts(self) -> tuple[str, ...]:
        """Which cameras disagree, by how much, and the remedy, a sentence each; none where there is a refusal."""
        if self.hopeless:
            return ()
        if self.remedy is not None:
            return (self.remedy,)
        wrong = self.wrong
        if not wrong:
            return ()
        if len(self.names) - len(wrong) < 2:
            told = ", ".join(f"{name} {apart:.0f}" for name, apart in zip(self.names, self.apart) if apart is not None)
            return (f"the cameras' silhouettes do not fit together (pixels apart: {told}; expected under {self.limit:.0f}): does the "
                    "calibration belong to these films, and were they begun together? calibrate again, or say in [start] of "
                    "recording.toml when each begins",)
        rest = [name for name in self.names if name not in wrong]
        good = max((apart for name, apart in zip(self.names, self.apart) if name in rest and apart is not None), default=0.0)
        return tuple(f"camera {name!r} disagrees with the others by {self.apart[self.names.index(name)]:.0f} pixels, they with each other "
                     f"by {good:.1f}: was it moved, or is the calibration another's? calibrate it again, or leave it out: --camera "
                     f"{','.join(rest)}" for name in wrong)

    @property
    def wrong(self) -> tuple[str, ...]:
        """Cameras that disagree with most others."""
        return tuple(name for name, apart in zip(self.names, self.apart) if apart is not None and apart > self.limit)


@dataclass(frozen=True)
class _Scene:
    """Cameras and what they saw."""

    cameras: tuple[Camera, ...]
    outlines: Outlines
    rays: list[list[Array | None]] = field(init=False)
    """Unit directions in the world of the outlines' pixels, (K, 3)."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "rays", [[self._directions(n, outline) for n, outline in enumerate(row)] for row in self.outlines])

    def _directions(self, n: int, outline: Array | None) -> Array | None:
        if outline is None:
            return None
        rays = self.cameras[n].rays(outline[:, :2]) @ self.cameras[n].T_camera_world[:3, :3]
        return rays / np.linalg.norm(rays, axis=1, keepdims=True)

    def focal(self, n: int) -> float:
        """Pixels a radian."""
        return float(np.diag(self.cameras[n].matrix)[:2].mean())


def agreement(cameras: Sequence[Camera], masks: Sequence[Sequence[Mask | None]], seconds: float = np.nan) -> Agreement:
    """How well the cameras' silhouettes fit together: `masks` (H, W) by set and camera, None where there is none.

    `seconds`: from set to set, with which a film that runs late is told in time.
    """
    names = tuple(camera.name for camera in cameras)
    limit = DISAGREES * max(max(camera.size) for camera in cameras)
    scene = _Scene(tuple(cameras), [[_outline(mask) for mask in row] for row in masks])
    pairs = _distances(scene)
    apart = _of_cameras(pairs)
    height = _height(scene)
    found = Agreement(names=names, apart=_plain(apart), pairs=tuple(map(_plain, pairs)), limit=limit,
                      outside=_plain(_outside(cameras, masks)), height=height)
    if height is not None and height > MILLIMETRES:
        told = (f"the calibration makes the person {height:,.0f} m high and the cameras stand {_spread(cameras):,.0f} m apart: it is in "
                "millimetres, it seems; divide every translation in calibration.toml by 1000")
        return replace(found, remedy=told, hopeless=True)
    if found.wrong:
        return _with_remedy(found, scene, seconds)
    if height is not None and not PEOPLE[0] < height < PEOPLE[1]:
        told = (f"the calibration makes the person {height:.2g} m high, expected {PEOPLE[0]:g} to {PEOPLE[1]:g} m: is it in metres? multiply "
                "every translation in calibration.toml by what is missing")
        return replace(found, remedy=told)
    return found


# Tangents


def _outline(mask: Mask | None) -> Array | None:
    """Pixels of the outlines of a person's mask, and whether each is far from the border, (K, 3); None where nobody is."""
    import cv2

    if mask is None or not may_be_person(mask):
        return None
    contours = cv2.findContours(mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]
    largest = max(map(len, contours))
    pixels = np.concatenate([c[::EVERY, 0] for c in contours if len(c) > 0.1 * largest]).astype(float)
    size = np.array(mask.shape[::-1])
    far = ((pixels >= BORDER) & (pixels < size - BORDER)).all(1)
    return np.concatenate([pixels, far[:, None]], 1)


def _distances(scene: _Scene, only: set[int] | None = None, sets: Sequence[int] | None = None) -> Array:
    """Median distance (C, C) of the cameras' tangents, pixels; not a number where there is none. `only`: pairs with one of these."""
    C = len(scene.cameras)
    out = np.full((C, C), np.nan)
    sets = range(len(scene.outlines)) if sets is None else sets
    for i, j in combinations(range(C), 2):
        if only is None or i in only or j in only:
            values = np.array([_apart(scene, f, i, j) for f in sets]).ravel()
            values = values[np.isfinite(values)]
            out[i, j] = out[j, i] = np.median(values) if len(values) else np.nan
    return out


def _apart(scene: _Scene, f: int, i: int, j: int) -> tuple[float, float]:
    """Distances (pixels) of both pairs of outermost tangents in set `f`."""
    a, b = scene.rays[f][i], scene.rays[f][j]
    line = scene.cameras[j].centre - scene.cameras[i].centre
    length = np.linalg.norm(line)
    if a is None or b is None or length < 1e-9:
        return np.nan, np.nan
    line /= length
    aside = [rays - (rays @ line)[:, None] * line for rays in (a, b)]
    ahead = sum(part.sum(0) / max(float(np.linalg.norm(part.sum(0))), 1e-12) for part in aside)
    if np.linalg.norm(ahead) < 1e-9:
        ahead = aside[0].sum(0)
    ahead = ahead / np.linalg.norm(ahead)
    angles = [np.arctan2(part @ np.cross(line, ahead), part @ ahead) for part in aside]
    if max(float(np.ptp(each)) for each in angles) > WIDE:
        return np.nan, np.nan
    ends = []
    for pick in (np.argmin, np.argmax):
        k = [int(pick(each)) for each in angles]
        firm = all(scene.outlines[f][n][at, 2] for n, at in zip((i, j), k))  # type: ignore[index]
        lever = np.mean([scene.focal(n) * np.linalg.norm(part[at]) for n, part, at in zip((i, j), aside, k)])
        ends.append(abs(angles[0][k[0]] - angles[1][k[1]]) * lever if firm else np.nan)
    return ends[0], ends[1]


def _of_cameras(pairs: Array) -> Array:
    """By how much each camera disagrees with most others (C,): the lower median over them, so that one wrong camera blames no other."""
    out = np.full(len(pairs), np.nan)
    for n, row in enumerate(pairs):
        known = np.sort(row[np.isfinite(row)])
        if len(known):
            out[n] = known[(len(known) - 1) // 2]
    return out


# Remedies


def _with_remedy(found: Agreement, scene: _Scene, seconds: float) -> Agreement:
    """The agreement, with what would mend it, where that is found."""
    sets = np.unique(np.linspace(0, len(scene.outlines) - 1, TRIED).astype(int)).tolist()
    start = _total(_distances(scene, sets=sets))
    best, told = start, ""
    for changed, only, text in _changes(found, scene, seconds):
        pairs = _distances(scene, sets=sets)
        pairs_after = _distances(changed, only, sets)
        total = _total(np.where(np.isfinite(pairs_after) | _touched(pairs, only), pairs_after, pairs))
        if total < best:
            best, told = total, text
    if best > max(BETTER * start, 0.0) or not told:
        return found
    return replace(found, remedy=f"{told}: then all agree within {best:.1f} pixels, instead of {start:.0f}")


def _touched(pairs: Array, only: set[int] | None) -> NDArray[np.bool_]:
    """Pairs of which one is among `only`, (C, C)."""
    which = np.array([only is None or n in only for n in range(len(pairs))])
    return which[:, None] | which[None]


def _total(pairs: Array) -> float:
    """One figure for all pairs."""
    upper = pairs[np.triu_indices(len(pairs), 1)]
    return float(np.nanmean(upper)) if np.isfinite(upper).any() else np.inf


def _changes(found: Agreement, scene: _Scene, seconds: float) -> Iterator[tuple[_Scene, set[int] | None, str]]:
    """What may be wrong: the scene with it mended, the cameras that this concerns (None: all), and how to say it."""
    names, C = found.names, len(found.names)
    for a, b in combinations(range(C), 2):
        if scene.cameras[a].size == scene.cameras[b].size:
            yield _exchanged(scene, a, b), {a, b}, (f"cameras {names[a]!r} and {names[b]!r} are swapped, it seems; exchange their films, or "
                                                    "their names in calibration.toml")
    for n in range(C):
        yield _mirrored(scene, {n}), {n}, f"camera {names[n]!r} shows mirrored pictures, it seems; turn the mirroring off, or flip its film"
    everything = set(range(C))
    yield _mirrored(scene, everything), None, "all cameras show mirrored pictures, it seems; turn the mirroring off, or flip the films"
    yield _turned(scene), None, ("the calibration says where cameras stand (camera to world), it seems, instead of how the world lies to them; "
                                 "invert every rotation and translation in calibration.toml")
    for n in range(C):
        for steps in (s for s in range(-MOVING, MOVING + 1) if s):
            late = seconds * steps
            start = (f"{names[n]} = {late:.2f}" if late > 0 else ", ".join(f"{name} = {-late:.2f}" for name in names if name != names[n]))
            yield _moved(scene, n, steps), {n}, (f"camera {names[n]!r} is about {abs(late):.2f} s {'early' if late < 0 else 'late'}, it seems; "
                                                 f"add that in [start] of recording.toml: {start}")


def _exchanged(scene: _Scene, a: int, b: int) -> _Scene:
    order = list(range(len(scene.cameras)))
    order[a], order[b] = b, a
    return replace(scene, outlines=[[row[n] for n in order] for row in scene.outlines])


def _mirrored(scene: _Scene, which: set[int]) -> _Scene:
    def flipped(n: int, outline: Array | None) -> Array | None:
        return outline if outline is None or n not in which else np.array([scene.cameras[n].size[0] - 1, 0, 0]) + outline * (-1, 1, 1)

    return replace(scene, outlines=[[flipped(n, outline) for n, outline in enumerate(row)] for row in scene.outlines])


def _turned(scene: _Scene) -> _Scene:
    return replace(scene, cameras=tuple(replace(camera, T_camera_world=inverse(camera.T_camera_world)) for camera in scene.cameras))


def _moved(scene: _Scene, n: int, steps: int) -> _Scene:
    """With camera `n`'s pictures so many sets earlier in the row; where there is none, it says nothing."""
    F = len(scene.outlines)
    return replace(scene, outlines=[[scene.outlines[f + steps][n] if 0 <= f + steps < F else None if k == n else outline
                                     for k, outline in enumerate(row)] if True else row for f, row in enumerate(scene.outlines)])


# Space


def _middle(scene: _Scene, f: int) -> Array | None:
    """The place nearest to the rays through the silhouettes' middles in set `f`."""
    rays = [(camera.centre, each.mean(0)) for camera, each in zip(scene.cameras, scene.rays[f]) if each is not None]
    if len(rays) < 2:
        return None
    A, b = np.zeros((3, 3)), np.zeros(3)
    for centre, ray in rays:
        across = np.eye(3) - np.outer(ray, ray) / (ray @ ray)
        A, b = A + across, b + across @ centre
    return np.linalg.solve(A, b) if np.linalg.cond(A) < 1e9 else None


def _height(scene: _Scene) -> float | None:
    """What the silhouettes measure at their longest, at the place where they meet, metres by the calibration; the median."""
    heights = []
    for f in range(0, len(scene.outlines), max(1, len(scene.outlines) // TRIED)):
        middle = _middle(scene, f)
        for camera, rays in zip(scene.cameras, scene.rays[f]):
            if middle is not None and rays is not None:
                reach = rays @ rays.mean(0)
                angle = 2 * np.arccos(np.clip(reach.min() / np.linalg.norm(rays.mean(0)), -1, 1))
                heights.append(2 * np.tan(min(angle, 3.0) / 2) * np.linalg.norm(middle - camera.centre))
    return float(np.median(heights)) if heights else None


def _spread(cameras: Sequence[Camera]) -> float:
    """Greatest distance between two cameras, metres by the calibration."""
    return max(float(np.linalg.norm(a.centre - b.centre)) for a, b in combinations(cameras, 2))


def _outside(cameras: Sequence[Camera], masks: Sequence[Sequence[Mask | None]]) -> Array:
    return np.full(len(cameras), np.nan)


def _plain(values: Array) -> tuple[float | None, ...]:
    return tuple(round(float(value), 2) if np.isfinite(value) else None for value in values)
