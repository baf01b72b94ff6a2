"""Cameras that are out of step with the others: late ones, and those whose film has lost frames, so that its later ones come too early."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from shadowpuppet.camera.bits import Bits, count, pack
from shadowpuppet.camera.mask import Mask, half_size
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.frozen import LEAST, SetAside

LAGS = (0.07, 0.13, 0.2, 0.3, 0.4)
"""Times (s) by which a camera may be late, or early."""
PACE = 1 / 40
"""Least time (s) between frames that are compared."""
MEMORY = 1.0
"""Time (s) in which what was seen counts for 1/e."""
ENOUGH = 0.5
"""Change of the drawn body over the area of the silhouette, summed, that a verdict needs."""
LATE = 0.35
"""Share of the body's change, by which another moment's body explains the silhouette better, from which on a camera is out of step. It is
-1 if the silhouette is exactly the present body, 1 if it is the other's; below 0 a camera is taken back."""
MOST = 1.5
"""The same, beyond which older evidence gives way to newer."""
OTHERS = 0.5
"""The other cameras' shares, over this one's, must be below: else the body is wrong, not the camera."""
MISFIT = 0.6
"""Pixels that may differ from the body of the other moment, over the silhouette's: else it is no explanation."""
AHEAD = 2
"""Number of frames after which a verdict counts; one less may be read before the first of them is tracked."""


class TrackedSet(NamedTuple):
    """A tracked frame set."""

    seconds: float
    masks: tuple[Bits | None, ...]
    """Silhouettes at half size, as bits, by camera."""
    drawn: tuple[Bits, ...]
    """The body in the same pictures."""


class StepWatch:
    """Compares each camera's silhouettes with the body of earlier and later frames. `late` is a camera whose silhouette is better explained
    by the body of an earlier frame, `early` one whose earlier silhouette is better explained by the present body.

    A frame set is read with `__call__`, and given back with `tracked` when its body is known, in the same order. What is set aside in a
    frame depends on frames `AHEAD` or more before, so that it does not matter how far ahead frames are read.
    """

    def __init__(self, number: int, short: Sequence[bool] = ()) -> None:
        """For a number of cameras; `short`: those whose films have fewer frames than others."""
        self.aside = SetAside(number)
        self._short = tuple(short) or (False,) * number
        self._read = deque[tuple[float, tuple[Bits | None, ...]]]()
        self._seen = deque[TrackedSet]()
        self._verdicts = deque[tuple[str, ...]]([("",) * number] * AHEAD)
        self._gain, self._change, self._misfit = np.zeros((3, number, 2 * len(LAGS)))
        self._out = [""] * number

    def __call__(self, seconds: float, masks: Sequence[Mask | None]) -> tuple[Mask | None, ...]:
        """The masks (H, W) of a frame set at a time (s), None for a camera without one or one that is out of step."""
        self._read.append((seconds, tuple(None if mask is None else pack(half_size(mask)) for mask in masks)))
        why = self._verdicts.popleft()
        there = sum(mask is not None and not each for mask, each in zip(masks, why))
        why = why if there >= LEAST else ("",) * len(masks)
        self.aside.note(seconds, ["" if mask is None else each for mask, each in zip(masks, why)])
        return tuple(None if each else mask for mask, each in zip(masks, why))

    def tracked(self, drawn: Sequence[Bits]) -> None:
        """The body of the first frame set that was read and is not yet tracked, as bits in each camera's picture of half the size; empty
        if it has none."""
        seconds, masks = self._read.popleft()
        if not drawn:
            self._seen.clear()
        elif not self._seen or seconds - self._seen[-1].seconds >= PACE:
            self._compare(TrackedSet(seconds, masks, tuple(drawn)))
        self._verdicts.append(self._verdict())

    def _compare(self, now: TrackedSet) -> None:
        """Add what a frame set shows."""
        fade = np.exp((self._seen[-1].seconds - now.seconds) / MEMORY) if self._seen else 1.0
        for sums in (self._gain, self._change, self._misfit):
            sums *= fade
        for n, mask in enumerate(now.masks):
            if mask is None:  # without a picture, or set aside for another reason
                self._gain[n] = self._change[n] = self._misfit[n] = 0
            else:
                found = self._evidence(now, n, mask)
                kept = np.clip((MOST - found[1]) / np.maximum(self._change[n], 1e-9), 0, 1)
                self._gain[n], self._change[n] = kept * self._gain[n] + found[0], kept * self._change[n] + found[1]
                self._misfit[n] = kept * self._misfit[n] + found[2]
        self._seen.append(now)
        while now.seconds - self._seen[0].seconds > LAGS[-1] + PACE:
            self._seen.popleft()

    def _evidence(self, now: TrackedSet, camera: int, mask: Bits) -> Array:
        """What a silhouette shows of each lag, late and early: by how much the other body explains it better and by how much bodies differ,
        both over its area, and what the other body leaves unexplained, times the difference (3, 2 x LAGS)."""
        found, area = np.zeros((3, 2, len(LAGS))), count(mask)
        drawn = now.drawn[camera]
        for k, lag in enumerate(LAGS):
            then = self._at(now.seconds - lag)
            if then is None or not area or (own := then.masks[camera]) is None:
                continue
            left = np.array([count(mask ^ then.drawn[camera]), count(own ^ drawn)]) / area
            found[0, :, k] = np.array([count(mask ^ drawn), count(own ^ then.drawn[camera])]) / area - left
            found[1, :, k] = count(drawn ^ then.drawn[camera]) / area
            found[2, :, k] = left * found[1, :, k]
        return found.reshape(3, -1)

    def _at(self, seconds: float) -> TrackedSet | None:
        """The frame set nearest to a time (s); None if none is within a frame's time."""
        nearest = min(self._seen, key=lambda each: abs(each.seconds - seconds), default=None)
        return nearest if nearest is not None and abs(nearest.seconds - seconds) < 0.035 else None

    def _verdict(self) -> tuple[str, ...]:
        """For each camera `late`, `early` or nothing."""
        share = np.where(self._change >= ENOUGH, self._gain / np.maximum(self._change, ENOUGH), np.nan)
        explained = self._misfit <= MISFIT * self._change
        best = np.array([np.nanmax(row) if np.isfinite(row).any() else np.nan for row in share])
        for n, gain in enumerate(best):
            lag = int(np.nan_to_num(share[n], nan=-np.inf).argmax())
            # a film of fewer frames has lost some: where the body follows it, cameras that are in step look late
            lossy = self._short[n] and lag >= len(LAGS)
            others = [other for m, other in enumerate(best) if m != n and not self._out[m] and (self._short[m] or not lossy)]
            alone = np.isfinite(gain) and all(other < OTHERS * gain for other in others)
            against = share[n, (lag + len(LAGS)) % (2 * len(LAGS))]  # a body that jitters explains neither moment
            clear = bool(gain > LATE and alone and against < 0 and explained[n, lag])
            if not self._out[n]:  # most cameras decide what the time is
                clear = clear and 2 * sum(map(bool, self._out)) + 2 < len(best)
                self._out[n] = ("late" if lag < len(LAGS) else "early") if clear else ""
            elif gain < 0 and not (self._short[n] and self._out[n] == "early"):  # lost frames do not come back
                self._out[n] = ""
        return tuple(self._out)
