"""Quality of silhouettes, judged without tracking: size, steadiness, contact with the border, specks and holes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.camera.mask import NEARLY_ALL, Mask
from shadowpuppet.errors import HARMFUL, NOTED, Finding, SilhouetteError

MIN_AREA = 0.003
"""Least share of the picture that a person must cover for limbs to be wide enough (15 pixels high of 240)."""
AREA_JUMP = 0.25
"""Relative change of the area between frames that no motion causes: a part of the person was lost or found."""
MIN_CONTACT = 2
"""Least number of pixels on a side of the picture for the person to touch it; one may be noise."""

# Limits of the warnings. Exact silhouettes of walking, running and waving people reach at most a third of these.
WARN_CONTACT = 0.02
WARN_AREA_CHANGE = 0.05
WARN_JUMPS = 0.02
WARN_FLICKER = 0.06
WARN_SPECK_AREA = 0.02
WARN_HOLE_AREA = 0.1
WARN_HOLES = 10


REMEDY = "the program that made the masks is unsure; make them again, or leave --masks out"
"""What is to be done about masks of another program."""


@dataclass(frozen=True)
class MaskQuality:
    """Quality measures of silhouettes. `warnings` says what is wrong with them, `refusal` whether tracking is hopeless."""

    frames: int
    """Number of silhouettes."""
    area: float
    """Median share of the picture that the person covers, over frames with a person."""
    area_change: float
    """Median relative change of the area from one frame to the next; a moving person's changes by a percent or two."""
    area_jumps: float
    """Share of frames in which the area changed by over a quarter of itself."""
    flicker: float
    """Median over frames of the pixels that differ from both the frame before and the one after, over the person's area.

    Motion causes few such pixels in a typical frame: only where something passes that is thinner than its step between frames.
    """
    border: dict[str, float]
    """Share of frames in which the person touches the left, right, top and bottom side of the picture."""
    specks: float
    """Mean number of parts other than the largest."""
    speck_area: float
    """Mean of the total area of these parts over the largest part's."""
    holes: float
    """Mean number of holes in the largest part."""
    hole_area: float
    """Mean of the total area of these holes over the largest part's."""
    empty: int
    """Frames without any silhouette."""
    full: int
    """Frames in which silhouette covers nearly all of the picture."""
    first_empty: int | None = None
    """The first empty frame, from 0."""
    first_full: int | None = None
    """The first full frame, from 0."""
    ready: bool = False
    """Whether another program made the silhouettes, so that light and empty scenes have no part in them."""

    def refusal(self) -> str | None:
        """Why tracking is hopeless, and the remedy, in a sentence; None if it is not."""
        if not self.frames:
            return "there is no silhouette: the film has no frames"
        expected = "expected the person alone in white on black, in the alpha, or with a label (--label)"
        if self.ready and self.empty > 0.9 * self.frames:
            return f"the masks are empty in {self._share(self.empty)} of the frames; {expected}"
        if self.ready and self.full > 0.5 * self.frames:
            return f"the masks cover nearly all of the picture in {self._share(self.full)} of the frames; {expected}"
        if self.empty > 0.9 * self.frames:
            return (f"the silhouette is empty in {self._share(self.empty)} of the frames: nobody is in the picture, or "
                    "the person does not differ from the background; give a background of the same light, or set another method")
        if self.full > 0.5 * self.frames:
            return (f"nearly all of the picture is silhouette in {self._share(self.full)} of the frames: the light changed "
                    "or the camera moved since the background was taken; take it again, or leave it out: the film then serves")
        return None

    @property
    def cut_off(self) -> tuple[str, ...]:
        """Sides of the picture at which the person is cut off, but for the bottom, where an upper body's legs may be."""
        return tuple(side for side in ("left", "right", "top") if self.border[side] > WARN_CONTACT)

    def warnings(self, whole_elsewhere: bool = False) -> tuple[Finding, ...]:
        """What harms tracking, and the remedy, a sentence each; none if there is a refusal. `whole_elsewhere`: whether enough other cameras
        show all of a person who is cut off."""
        return () if self.refusal() else (*self._incomplete(NOTED if whole_elsewhere else HARMFUL), *self._unsteady(), *self._unclean())

    def _incomplete(self, cut_off: int) -> Iterator[Finding]:
        if self.empty:
            why = ("or the masks miss them; cut the film, or make the masks again" if self.ready else
                   "or does not differ from the background; cut the film, or set another method")
            yield Finding(f"the silhouette is empty in {self._share(self.empty)} of the frames, first in frame {self.first_empty}: the "
                          f"person is out of the picture, {why}",
                          f"nobody seen in {self._share(self.empty)} of frames: cut them",
                          HARMFUL if self.empty > 0.3 * self.frames else NOTED, {"frames": self.frames, "empty": self.empty})
        if self.full:
            why, short = (("make the masks again", f"masks cover all at frame {self.first_full}: make them again") if self.ready else
                          ("the light changed or the camera moved; cut the film there, or fix camera and exposure",
                           f"light or camera changed at frame {self.first_full}: --end {self.first_full}f"))
            yield Finding(f"nearly all of the picture is silhouette in {self._share(self.full)} of the frames, first in frame "
                          f"{self.first_full}: {why}", short, HARMFUL, {"frames": self.frames, "full": self.full})
        for side in self.cut_off:
            yield Finding(f"the silhouette touches the {side} border in {_percent(self.border[side])} of the frames: the person "
                          "is partly outside the picture, and what is outside is guessed; step back, or turn the camera",
                          f"person is cut off at the {side}: step back", cut_off, {"percent": 100 * self.border[side]})
        if 0 < self.area < MIN_AREA:
            yield Finding.of("the person covers {percent:.2g} % of the picture: too little to see limbs; go nearer, or use a camera with "
                             "more pixels", "person is too small in the picture: go nearer", HARMFUL, percent=100 * self.area)

    def _unsteady(self) -> Iterator[Finding]:
        remedy = REMEDY if self.ready else (
                  "the person hardly differs from the background; more light, other clothes or another wall help, and a picture of the "
                  "empty scene where there is none")
        short = "parts of the person vanish: " + ("make the masks again" if self.ready else "more light, or other clothes")
        if self.area_jumps > WARN_JUMPS:
            yield Finding(f"the area of the silhouette changes by over {_percent(AREA_JUMP)} at once in {_percent(self.area_jumps)} of the "
                          f"frames, as parts are lost and found: {remedy}", short, HARMFUL, {"percent": 100 * self.area_jumps})
        elif self.area_change > WARN_AREA_CHANGE:
            yield Finding(f"the area of the silhouette changes by {_percent(self.area_change)} from frame to frame: {remedy}", short,
                          HARMFUL, {"percent": 100 * self.area_change})
        if self.flicker > WARN_FLICKER:
            why = (REMEDY if self.ready else
                   "noise in dim light, a lamp's flicker, or silhouettes that are not cleaned; use more light, or --silhouette.clean")
            yield Finding(f"pixels worth {_percent(self.flicker)} of the person's area flicker from frame to frame: {why}",
                          f"outlines flicker: {'make the masks again' if self.ready else 'use more light'}", HARMFUL,
                          {"percent": 100 * self.flicker})

    def _unclean(self) -> Iterator[Finding]:
        if self.speck_area > WARN_SPECK_AREA:
            why, short = (("make the masks of the person alone", "masks hold more than the person: make them again") if self.ready else
                          ("noise, shadow or another person; use --silhouette.clean, or keep others out of the picture",
                           "noise, shadows or others beside the person: keep them out"))
            yield Finding(f"the silhouette has {self.specks:.1f} parts beside the person, {_percent(self.speck_area)} of its area: {why}",
                          short, HARMFUL, {"parts": self.specks, "percent": 100 * self.speck_area})
        if self.hole_area > WARN_HOLE_AREA or self.holes > WARN_HOLES:
            why, short = ((REMEDY, "masks have holes: make them again") if self.ready else
                          ("clothes like the background, or noise; try another method, or other clothes",
                           "silhouettes have holes: wear other colours than the background"))
            yield Finding(f"the silhouette has {self.holes:.1f} holes, {_percent(self.hole_area)} of its area: {why}", short, HARMFUL,
                          {"holes": self.holes, "percent": 100 * self.hole_area})

    def _share(self, frames: int) -> str:
        return _percent(frames / self.frames)


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %" if share >= 0.01 else "under 1 %"


class _Measures(NamedTuple):
    """Measures of one silhouette."""

    area: int
    touched: tuple[bool, bool, bool, bool]
    specks: int
    speck_share: float
    holes: int
    hole_share: float


def mask_quality(masks: Iterable[Mask]) -> MaskQuality:
    """Quality of silhouettes (H, W) in order of time; at most three are in memory.

    Raises `SilhouetteError` for an array that is no silhouette, and for different sizes.
    """
    measures: list[_Measures] = []
    blinks: list[int] = []
    last: list[Mask] = []
    for n, mask in enumerate(masks):
        _check(mask, last[-1].shape if last else None, n)
        measures.append(_measure(mask))
        last = [*last[-2:], mask]
        if len(last) == 3:
            before, now, after = last
            blinks.append(int(np.count_nonzero((now ^ before) & (now ^ after))))
    return _summary(measures, blinks, last[0].size if last else 0)


def _check(mask: Mask, shape: tuple[int, ...] | None, n: int) -> None:
    found = getattr(mask, "shape", ())
    if len(found) != 2 or mask.dtype != bool or not mask.size:
        raise SilhouetteError(f"silhouette {n}: found {getattr(mask, 'dtype', type(mask).__name__)} of shape {found}, "
                              "expected true and false of shape (H, W)")
    if shape is not None and shape != found:
        raise SilhouetteError(f"silhouette {n}: found {found[1]} x {found[0]} pixels, expected {shape[1]} x {shape[0]}")


def _measure(mask: Mask) -> _Measures:
    import cv2

    x, y, width, height = cv2.boundingRect(mask.view(np.uint8))
    # A margin joins the whole outside, so that all other background is a hole.
    pixels = np.pad(mask[y : y + height, x : x + width].view(np.uint8), 1)
    _, _, parts, _ = cv2.connectedComponentsWithStats(pixels, connectivity=8)
    areas = np.sort(parts[1:, cv2.CC_STAT_AREA])[::-1]
    _, _, gaps, _ = cv2.connectedComponentsWithStats(1 - pixels, connectivity=4)
    holes = gaps[2:, cv2.CC_STAT_AREA]
    largest = max(int(areas[0]) if len(areas) else 0, 1)
    sides = (mask[:, 0], mask[:, -1], mask[0], mask[-1])
    left, right, top, bottom = (int(np.count_nonzero(side)) >= MIN_CONTACT for side in sides)
    specks = areas[1:]
    return _Measures(int(areas.sum()), (left, right, top, bottom), len(specks), float(specks.sum() / largest), len(holes),
                     float(holes.sum() / largest))


def _summary(measures: list[_Measures], blinks: list[int], size: int) -> MaskQuality:
    areas = np.array([each.area for each in measures], float)
    empty = np.flatnonzero(areas == 0)
    full = np.flatnonzero(areas >= NEARLY_ALL * max(size, 1))
    person = _median(areas[areas > 0])
    change = np.abs(np.diff(areas)) / np.maximum(np.maximum(areas[1:], areas[:-1]), 1)
    touched = np.mean([each.touched for each in measures] or [(0, 0, 0, 0)], axis=0)
    specks, speck_area, holes, hole_area = np.mean([each[2:] for each in measures] or [(0, 0, 0, 0)], axis=0).tolist()
    return MaskQuality(
        frames=len(measures),
        area=person / max(size, 1),
        area_change=_median(change),
        area_jumps=float(np.mean(change > AREA_JUMP)) if len(change) else 0.0,
        flicker=_median(np.array(blinks)) / max(person, 1),
        border=dict(zip(("left", "right", "top", "bottom"), touched.tolist())),
        specks=specks,
        speck_area=speck_area,
        holes=holes,
        hole_area=hole_area,
        empty=len(empty),
        full=len(full),
        first_empty=int(empty[0]) if len(empty) else None,
        first_full=int(full[0]) if len(full) else None,
    )


def _median(values: NDArray) -> float:
    return float(np.median(values)) if len(values) else 0.0
