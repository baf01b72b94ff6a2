"""How many people a recording of several cameras shows, and where, in frames sampled from the films."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask, may_be_person
from shadowpuppet.geometry import evenly_spread
from shadowpuppet.pipeline.footage import CameraFrame, Sample
from shadowpuppet.pipeline.silhouettes import Silhouettes
from shadowpuppet.tracking.multiview.surface.visual_hull import VisualHull
from shadowpuppet.tracking.people.carving import Room, make_room
from shadowpuppet.tracking.people.columns import Column, find_people
from shadowpuppet.tracking.people.presence import counted

SETS = 12
"""Number of frame sets in which people are counted before the run."""
LEAST_AREA, LEAST_HEIGHT = 0.15, 0.4
"""Least area and height of another person in a picture, over the largest part's: one two and a half times as far away."""
FEW_POINTS = 50
"""Least number of surface points of all sets together that show people."""


@dataclass(frozen=True, eq=False)
class Census:
    """The number of people, and the room in which they move."""

    number: int
    room: Room
    numbers: tuple[int, ...]
    """People seen in each of the frame sets."""

    def people(self, masks: Sequence[Mask | None]) -> list[Column]:
        """The people in one frame's masks (H, W), one per camera."""
        return find_people(self.room, _telling(masks))


def sampled_sets(samples: Sequence[Sample], silhouettes: Sequence[Silhouettes]) -> list[tuple[Mask | None, ...]]:
    """Masks (H, W) by camera of frames that were sampled from all films at the same times, `SETS` at most."""
    if not samples or not samples[0].frames:
        return []
    leader = samples[0]
    reach = 0.5 * leader.pace if np.isfinite(leader.pace) else 0.0
    chosen = [leader.frames[n] for n in evenly_spread(len(leader.frames), SETS)]
    return [tuple(None if (near := _nearest(sample, frame.time, reach)) is None else each(near)
                  for sample, each in zip(samples, silhouettes, strict=True)) for frame in chosen]  # fmt: skip


def take_census(cameras: Sequence[Camera], sets: Sequence[Sequence[Mask | None]]) -> Census | None:
    """The people in frame sets of masks (H, W), one per camera; None if nothing is seen by two cameras."""
    hull, sets = VisualHull(cameras), [_telling(masks) for masks in sets]
    points = [hull.points(masks).points for masks in sets]
    everywhere = np.concatenate(points) if points else np.zeros((0, 3))
    if len(everywhere) < FEW_POINTS:
        return None
    room = make_room(cameras, everywhere)
    numbers = tuple(len(find_people(room, masks)) for masks in sets)
    return Census(counted(numbers), room, numbers)


def _telling(masks: Sequence[Mask | None]) -> list[Mask | None]:
    """The masks without those that are nearly all of their picture, as of a camera that turned black: these show a person everywhere."""
    return [mask if mask is None or may_be_person(mask) or not mask.any() else None for mask in masks]


def count_in_picture(sample: Sample, silhouettes: Silhouettes) -> int:
    """Number of people whom one camera shows apart from each other, in frames sampled from its film."""
    if not sample.frames:
        return 0
    wide = silhouettes.of_several()
    chosen = (sample.frames[n] for n in evenly_spread(len(sample.frames), SETS))
    return counted([people_in(wide(frame)) for frame in chosen])


def people_in(mask: Mask) -> int:
    """Number of connected parts of a mask (H, W) that may be people: nearly as large and tall as the largest."""
    import cv2

    _, _, boxes, _ = cv2.connectedComponentsWithStats(mask.view(np.uint8), connectivity=8)
    areas, heights = boxes[1:, cv2.CC_STAT_AREA], boxes[1:, cv2.CC_STAT_HEIGHT]
    if not len(areas):
        return 0
    largest = areas.argmax()
    return int(np.count_nonzero((areas >= LEAST_AREA * areas[largest]) & (heights >= LEAST_HEIGHT * heights[largest])))


def _nearest(sample: Sample, time: float, reach: float) -> CameraFrame | None:
    found = min(sample.frames, key=lambda frame: abs(frame.time - time), default=None)
    return found if found is not None and abs(found.time - time) <= reach else None
