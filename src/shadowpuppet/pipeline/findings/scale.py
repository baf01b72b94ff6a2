"""Is the calibration's scale right? The height that silhouettes ask for, against the person's or people's."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from shadowpuppet.body.anthropometry import AVERAGE_HEIGHT
from shadowpuppet.calibration.agreement import SETS_COMPARED
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask, may_be_person
from shadowpuppet.errors import RUINOUS, Finding
from shadowpuppet.geometry import Array, evenly_spread, unit
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.rig import Rig
from shadowpuppet.threads import one_blas_thread
from shadowpuppet.tracking.multiview.height_estimation import DEVIATION, extents
from shadowpuppet.tracking.multiview.seen_stature import hull_points, seen_stature
from shadowpuppet.tracking.multiview.settings import MultiviewSettings
from shadowpuppet.tracking.multiview.size_estimation import STATURE_DEVIATION

PEOPLE = (0.9, 2.2)
"""Heights of people, metres, from children on."""
WRONG = 1.15
"""Ratio of scales that counts as wrong if the height is known; it is named from half of that way on, the square root."""
FRAMES = 4
"""Number of moments in which the height is looked for."""
ALONG = np.cos(np.radians(45))
"""Cosine of the angle between two views from which on they do not cross."""
SLENDER = 3.0
"""Least ratio of the longest extent of a person who stands to the geometric mean of the others: who sits has about 2.6."""


@dataclass(frozen=True, kw_only=True)
class ScaleError:
    """A wrong scale; plain values."""

    height: float
    """Of the person in the calibration's metres."""
    expected: float
    """The person's height, metres; if it is not known, people's mean."""
    is_known: bool
    """Whether the person's height is known."""
    doubt: float
    """Relative standard deviation of `factor`."""

    @property
    def factor(self) -> float:
        """By which the calibration's lengths are too large."""
        return self.height / self.expected

    def caution(self) -> Finding:
        """The error and its remedy."""
        usual = "the {expected:.2f} m that are given" if self.is_known else "the {expected:.2f} m of most people"
        remedy = ("`shadowpuppet check --fix` divides every translation by that" if self.is_known else
                  "give the person's --height, and `shadowpuppet check --fix` mends it")
        off = "{factor:.2f} ± {within:.2f}"
        off = f"{off} times too large" if self.factor > 1 else f"too small, {off} times what they should be"
        return Finding.of(f"the calibration makes the person {{height:.2f}} m tall: the board's square? All lengths are {off} by {usual}; "
                          f"measure the square and calibrate again, or {remedy}",
                          "calibration's scale is wrong, {factor:.2f} times: the board's square?", RUINOUS,
                          height=self.height, expected=self.expected, factor=self.factor, within=self.factor * self.doubt)


@dataclass(frozen=True, eq=False)
class Moment:
    """What one moment shows of a whole person."""

    masks: tuple[Mask | None, ...]
    points: Array
    """Surface points of the hull, (P, 3), metres."""

    @cached_property
    def extents(self) -> Array:
        """Of the hull, (3,), metres, the longest first."""
        return extents(self.points)

    @property
    def is_slender(self) -> bool:
        """Whether the person stands or lies, arms at the sides or raised."""
        return is_slender(self.extents)


def error_in(rig: Rig, moments: Sequence[Moment], options: Options) -> ScaleError | None:
    """`scale_error` of a rig, of a person whose height the options or the recording may give."""
    return scale_error(rig.cameras, moments, options.multiview, options.height or rig.recording.subject.height)


@one_blas_thread()
def scale_error(cameras: Sequence[Camera], moments: Sequence[Moment], settings: MultiviewSettings,
                height: float | None = None) -> ScaleError | None:
    """The scale's error by moments of a person of a known `height`, metres, or any; None if the scale may be right, or too few moments show
    the person.

    Hulls of a person who stands tell at once that a scale is right. A body is fitted where they do not: of people who sit, or reach aside.
    """
    moments = few_of(moments)
    if stands([moment.extents for moment in moments], height):
        return None
    (low, high), heights = _limits(height), list[float]()
    for found in fitted_heights(cameras, moments, settings):
        heights.append(found)
        if 2 * sum(low < each < high for each in heights) >= len(moments):
            return None  # whatever the other moments say: a fit takes seconds
    return judged(np.array(heights), height)


def moments_of(cameras: Sequence[Camera], views: Sequence[Sequence[Mask | None]], settings: MultiviewSettings) -> list[Moment]:
    """Moments, spread over `views`, masks (H, W) by time and camera, in which at least two cameras see a whole person."""
    return [moment for n in evenly_spread(len(views), SETS_COMPARED) if views for moment in _moment(cameras, views[n], settings)]


def few_of(moments: Sequence[Moment]) -> list[Moment]:
    """`FRAMES` of the moments at most, evenly spread."""
    return [moments[n] for n in evenly_spread(len(moments), FRAMES) if moments]


def stands(extents: Sequence[Array], height: float | None) -> bool:
    """Whether hulls of these extents (3,), metres, are mostly a standing person's, who is as tall as people are, or as is known."""
    low, high = _limits(height)
    standing = [each[0] for each in extents if is_slender(each)]
    return 2 * len(standing) > len(extents) and bool(low < np.median(standing) < high)


def is_slender(extents: Array) -> bool:
    """Whether extents (3,) are those of a person who stands or lies, arms at the sides or raised."""
    longest, second, third = extents
    return bool(longest > SLENDER * (second * third) ** 0.5)


def fitted_heights(cameras: Sequence[Camera], moments: Sequence[Moment], settings: MultiviewSettings) -> Iterator[float]:
    """The heights, metres, of bodies fitted to the moments that a body fits."""
    fitted = (seen_stature(np.random.default_rng(0), cameras, moment.masks, settings) for moment in moments)
    return (each.height for each in fitted if each is not None)


def judged(heights: Array, height: float | None) -> ScaleError | None:
    """The scale's error by heights (F,), metres, that moments ask for: their median is beyond the limits by more than their spread."""
    if len(heights) < 2:
        return None
    low, high = np.log(_limits(height))
    found, spread = float(np.median(np.log(heights))), float(np.log(heights).std(ddof=1))
    if low - spread < found < high + spread:
        return None
    fitted = STATURE_DEVIATION / AVERAGE_HEIGHT  # alike in all moments: clothes, hair, shoes
    unknown = 0.0 if height is not None else DEVIATION / AVERAGE_HEIGHT
    return ScaleError(height=float(np.exp(found)), expected=height or AVERAGE_HEIGHT, is_known=height is not None,
                      doubt=float(np.linalg.norm([spread, fitted, unknown])))


def _limits(height: float | None) -> tuple[float, float]:
    """Heights, metres, between which a scale may be right."""
    return PEOPLE if height is None else (height / WRONG**0.5, height * WRONG**0.5)


def _moment(cameras: Sequence[Camera], masks: Sequence[Mask | None], settings: MultiviewSettings) -> list[Moment]:
    """A moment, if at least two cameras see a whole person from sides that cross: what reaches the picture's border may be cut off, and
    views from about the same or the opposite side leave the hull open along them."""
    whole = tuple(None if mask is None or not may_be_person(mask) else _whole(mask) for mask in masks)
    points = hull_points(cameras, whole, settings.hull) if sum(mask is not None for mask in whole) > 1 else np.zeros((0, 3))
    if not len(points):
        return []
    views = unit(np.array([camera.centre for camera, mask in zip(cameras, whole) if mask is not None]) - points.mean(0))
    return [Moment(whole, points)] if np.abs(views @ views.T).min() < ALONG else []


def _whole(mask: Mask) -> Mask | None:
    """The largest connected part of a mask (H, W); None if it reaches the border."""
    import cv2

    _, labels, boxes, _ = cv2.connectedComponentsWithStats(np.ascontiguousarray(mask).view(np.uint8), connectivity=8)
    largest = 1 + boxes[1:, cv2.CC_STAT_AREA].argmax()
    x, y, width, height = boxes[largest, :4]
    inside = x > 0 and y > 0 and x + width < mask.shape[1] and y + height < mask.shape[0]
    return np.asarray(labels == largest) if inside else None
