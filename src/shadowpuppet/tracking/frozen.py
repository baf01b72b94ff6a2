"""Frozen pictures: silhouettes that stay the same, and cameras that are set aside while they are frozen or see nothing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from shadowpuppet.camera.mask import Mask, may_be_person

FROZEN_FRAMES, FROZEN_SECONDS = 4, 0.25
"""Frames and time from which on a silhouette that is the same is a frozen picture's: conversion to a higher frame rate repeats fewer."""
SAME = 1e-3
"""Share of the silhouette that may differ in a frozen picture: a codec's key frames differ from those before. The noise at the outline of a
person who stands still changes some five times as much."""
MOVES = 1e-2
"""Share of another camera's silhouette that must differ for the person to have moved."""
LEAST = 2
"""Number of cameras that are never set aside."""


def same_silhouette(one: Mask, other: Mask, share: float = SAME) -> bool:
    """Whether two masks (H, W) are of the same picture, up to a `share` of the silhouette: what a codec changes."""
    if one.shape != other.shape:
        return False
    area = np.count_nonzero(other)
    return bool(abs(np.count_nonzero(one) - area) <= share * area and np.count_nonzero(one ^ other) <= share * area)  # most differ in area


def is_frozen(frames: int, seconds: float) -> bool:
    """Whether a silhouette that has been the same for some frames and seconds is a frozen picture's."""
    return frames >= FROZEN_FRAMES and seconds >= FROZEN_SECONDS


def is_blind(mask: Mask | None) -> bool:
    """Whether a camera sees nothing, as nearly all of its picture (H, W) is silhouette; not without a picture."""
    return mask is not None and bool(mask.any()) and not may_be_person(mask)


class Interval(NamedTuple):
    """When a camera was set aside."""

    camera: int
    """Its index."""
    why: str
    """`frozen`, `blind`, `late` or `early`."""
    begin: float
    """Seconds, of the first frame."""
    end: float
    """Seconds, of the last."""
    frames: int


class SetAside:
    """When cameras were set aside, and why."""

    def __init__(self, number: int) -> None:
        """For a number of cameras."""
        self.intervals: list[Interval] = []
        self._present: list[int | None] = [None] * number
        """Index of the present interval of each camera."""

    def note(self, seconds: float, why: Sequence[str]) -> None:
        """Add a frame at a time (s); `why`: of each camera that is set aside, empty of others."""
        for camera, each in enumerate(why):
            place = self._present[camera]
            if not each:
                self._present[camera] = None
            elif place is None or self.intervals[place].why != each:
                self._present[camera] = len(self.intervals)
                self.intervals.append(Interval(camera, each, seconds, seconds, 1))
            else:
                before = self.intervals[place]
                self.intervals[place] = before._replace(end=seconds, frames=before.frames + 1)

    @property
    def present(self) -> dict[int, str]:
        """Why cameras are set aside in the last frame, by index."""
        return {camera: self.intervals[place].why for camera, place in enumerate(self._present) if place is not None}


class CameraWatch:
    """Sets cameras aside, and takes them back: `frozen` ones, whose silhouette stays the same while the person moves in another camera's,
    and `blind` ones, of which nearly all is silhouette, as when the picture turns black.

    `watch(seconds, masks)` has None in place of their masks. Frames are given in order.
    """

    def __init__(self, number: int) -> None:
        """For a number of cameras."""
        self.aside = SetAside(number)
        self._last: list[Mask | None] = [None] * number
        self._still, self._since = [0] * number, [0.0] * number

    def __call__(self, seconds: float, masks: Sequence[Mask | None]) -> tuple[Mask | None, ...]:
        """The masks (H, W) of a frame set at a time (s), None for a camera without a picture or one that is set aside."""
        moved = [now is not None and last is not None and not same_silhouette(last, now, MOVES) for now, last in zip(masks, self._last)]
        for n, (now, last) in enumerate(zip(masks, self._last)):
            if now is None or last is None or not now.any() or not same_silhouette(last, now):
                self._still[n], self._since[n] = 0, seconds
            elif any(moved):
                self._still[n] += 1
        blind = [is_blind(mask) for mask in masks]
        frozen = [is_frozen(still, seconds - since) and not full for still, since, full in zip(self._still, self._since, blind)]
        self._last = [last if now is None else now for now, last in zip(masks, self._last)]
        if sum(mask is not None and not one and not other for mask, one, other in zip(masks, frozen, blind)) < LEAST:
            frozen = [False] * len(frozen)
        self.aside.note(seconds, ["blind" if full else "frozen" if still else "" for full, still in zip(blind, frozen)])
        return tuple(None if one or other else mask for mask, one, other in zip(masks, frozen, blind))
