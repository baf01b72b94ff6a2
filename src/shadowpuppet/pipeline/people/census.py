"""How many people a recording of several cameras shows, and where, in frames sampled from the films."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask, Seen
from shadowpuppet.errors import NOTED, Finding
from shadowpuppet.geometry import Array, evenly_spread
from shadowpuppet.pipeline.footage import CameraFrame, Footage, Sample
from shadowpuppet.pipeline.rig import Rig, shown_in
from shadowpuppet.pipeline.silhouettes import Silhouettes
from shadowpuppet.silhouette.segmenter import Segmented
from shadowpuppet.threads import usable_cores
from shadowpuppet.tracking.multiview.surface.visual_hull import VisualHull
from shadowpuppet.tracking.multiview.tracker import MIN_POINTS
from shadowpuppet.tracking.people.figures import Figure, find_floor, find_people, telling
from shadowpuppet.tracking.people.floor import Floor
from shadowpuppet.tracking.people.presence import certain_number, counted, sure_number
from shadowpuppet.video.seeking import Seeker

SETS = 12
"""Number of frame sets in which people are counted before the run."""
LATER = 1.0
"""Least length (s) of the rest of a film in which people are counted."""
FLOOR_SETS = 6
"""Number of those on which the floor is found."""
LEAST_AREA, LEAST_HEIGHT = 0.15, 0.4
"""Least area and height of another person in a picture, over the largest part's: one two and a half times as far away."""


@dataclass(frozen=True, eq=False)
class Census:
    """The number of people, and the floor on which they move."""

    number: int
    floor: Floor
    numbers: tuple[int, ...]
    """People seen in each of the frame sets."""

    def people(self, seen: Seen) -> list[Figure]:
        """The people in one frame set."""
        return find_people(self.floor, seen)


def sampled_sets(samples: Sequence[Sample], silhouettes: Sequence[Silhouettes]) -> list[Seen]:
    """What is seen in frames that were sampled from all films at the same times, `SETS` at most."""
    if not samples or not samples[0].frames:
        return []
    leader = samples[0]
    reach = 0.5 * leader.pace if np.isfinite(leader.pace) else 0.0
    chosen = [leader.frames[n] for n in evenly_spread(len(leader.frames), SETS)]

    def segmented(sample: Sample, each: Silhouettes) -> list[Segmented | None]:
        return [None if (near := _nearest(sample, frame.time, reach)) is None else each.segmented(near) for frame in chosen]

    with ThreadPoolExecutor(usable_cores(), "census") as pool:
        return [shown_in(found) for found in zip(*pool.map(segmented, samples, silhouettes), strict=True)]


def later_sets(rig: Rig, silhouettes: Sequence[Silhouettes], after: float) -> list[Seen]:
    """What is seen at `SETS` moments at most, spread over the rest of the films `after` a time (s): of people who come later. Found by
    seeking; none of ready silhouettes, and of films that do not state their length."""
    ends = [footage.count / footage.film.rate for footage in rig.footage if footage.count and np.isfinite(footage.film.rate)]
    begin = rig.recording.begin
    if len(ends) < len(rig.footage) or any(each.segmenter is None for each in silhouettes) or begin + min(ends) < after + LATER:
        return []
    times = np.linspace(after + LATER / 2, begin + min(ends) - LATER / 2, SETS)
    with ThreadPoolExecutor(usable_cores(), "census") as pool:
        every = list(pool.map(lambda footage, each: list(_at(footage, each, times)), rig.footage, silhouettes))
    return [shown_in(found) for found in zip(*every, strict=True)]


def _at(footage: Footage, silhouettes: Silhouettes, times: Array) -> Iterator[Segmented | None]:
    with Seeker(Path(str(footage.view.video)), footage.camera.size, footage.recording.rate) as seeker:
        for time in times:
            image = seeker.at(footage.view.start + float(time))
            yield None if image is None else silhouettes.segmented(CameraFrame(float(time), image, None))


def take_census(cameras: Sequence[Camera], sets: Sequence[Seen], later: Sequence[Seen] = ()) -> Census | None:
    """The people in frame sets of the film's beginning and of what comes `later`; None if nothing is seen by two cameras."""
    hull, begun = VisualHull(cameras, company=True), len(sets)
    sets = [seen._replace(masks=tuple(telling(seen.masks))) for seen in (*sets, *later)]
    with ThreadPoolExecutor(usable_cores(), "census") as pool:
        points = [surface.points for surface in pool.map(lambda seen: hull.points(seen.masks), sets)]
        everywhere = np.concatenate(points) if points else np.zeros((0, 3))
        if len(everywhere) < MIN_POINTS:
            return None
        floor = find_floor(cameras, everywhere, [sets[n] for n in evenly_spread(len(sets), FLOOR_SETS)])
        every = list(pool.map(lambda seen: find_people(floor, seen), sets))
    numbers, certain = tuple(map(sure_number, every)), [certain_number(figures) for figures in every]
    return Census(max(counted(numbers[:begun]), counted(numbers[begun:]), counted(certain, share=0.0)), floor, numbers)


def census_by_keypoints(rig: Rig) -> Census | None:
    """The people whose keypoints' rays meet, at `SETS` moments spread over all films; None if there are none."""
    ends = [film.frame[-1] / rate - footage.view.start for footage, rate in zip(rig.footage, rig.rates)
            if (film := footage.keypoints) is not None and len(film.frame)]  # fmt: skip
    floor, blind = Floor(rig.cameras, 0.0, np.zeros((0, 2)), 0.0, np.zeros((0, 0, 0, 0), np.int32)), (None,) * len(rig.cameras)
    times = np.linspace(rig.recording.begin, max(min(ends, default=0.0), rig.recording.begin), SETS)
    sets = [Seen(blind, keypoints=tuple(footage.keypoints_at(float(time)) for footage in rig.footage)) for time in times]
    numbers = tuple(len(find_people(floor, seen)) for seen in sets)
    return Census(counted(numbers), floor, numbers) if any(numbers) else None


def people_finding(number: int) -> Finding:
    """Says that a number of people are tracked."""
    return Finding.of("{people} people are in the recording: each is tracked, into person-1, person-2, ... of the run",
                      "{people} people: each is tracked", NOTED, people=number)


def are_apart(sets: Sequence[Seen]) -> bool:
    """Whether two cameras show several people apart from each other, so that these are not one person whom the cameras place apart."""
    each = zip(*(seen.masks for seen in sets))
    return sum(counted([people_in(mask) for mask in masks if mask is not None]) > 1 for masks in each) > 1


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
