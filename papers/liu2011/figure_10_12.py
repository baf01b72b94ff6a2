"""Fig. 10, 11 and 12: wave hands, bend aside, bow forward, tracked with DRS; best estimate, matching result and raw image below one
another."""

from __future__ import annotations

import numpy as np

from papers.common.experiment import Experiment, Outcome, Request, Table
from papers.liu2011.material import Case, Part, cases
from papers.liu2011.repeats import Runs, repeat
from papers.liu2011.shown import stem, told
from shadowpuppet.camera.drawing import draw_model, in_colour, matching
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.status import UNCERTAIN_OVERLAP
from shadowpuppet.video import Image

COLUMNS, WIDTH, GREYS = 6, 1200, 6
"""Frames side by side, pixels of them all, and the step of the grey levels: sensor noise would not compress."""


def make(request: Request) -> Outcome:
    """A picture a motion, of the run whose 2D error is the median of all."""
    outcome = Outcome()
    for case in cases(request):
        runs = repeat(request, case, case.tracker)
        which = int(np.argsort(runs.costs.mean(1))[len(runs.costs) // 2])
        outcome.said.append(f"Shown is the run with the median 2D error of {len(runs.costs)}, seed {request.seeds[which]}.")
        for number, part in zip((10, 11, 12), case.parts):
            frames = moments(case, part)
            name = stem(f"figure_{number}", request, case)
            outcome.pictures[name] = sheet(case, runs.poses[which], frames)
            outcome.tables[name] = Table(("frame", "seconds", "motion", "cost_px", "overlap"), [
                [n, float(case.times[n]), part.name, float(runs.costs[which, n]), float(runs.overlaps[which, n])] for n in frames])
            when = ", ".join(f"{case.times[n]:.1f}" for n in frames)
            outcome.said.append(f"Fig. {number}, {part.name}, at {when} s. {followed(runs, part)}")
        outcome.settings |= told(case)
    return outcome


def followed(runs: Runs, part: Part) -> str:
    """How well all runs follow a motion."""
    during = runs.overlaps[:, (runs.times >= part.start) & (runs.times <= part.end)]
    poor = int((np.nanmin(during, axis=1) < UNCERTAIN_OVERLAP).sum())
    return (f"Model and silhouette overlap by {np.nanmean(during):.2f} on average over all runs; in {poor} of {len(during)} by less than "
            f"{UNCERTAIN_OVERLAP} at some time.")


def moments(case: Case, part: Part) -> list[int]:
    """Frames spread over a motion, from its first third on: before, people get ready."""
    begin = part.start + 0.15 * (part.end - part.start)
    wanted = np.linspace(begin, part.end - 0.05 * (part.end - part.start), COLUMNS)
    return [int(np.abs(case.times - time).argmin()) for time in wanted]


def sheet(case: Case, poses: Array, frames: list[int]) -> Image:
    """Three rows, a column a frame, of poses (T, D)."""
    import cv2

    seen = zip(frames, case.frames(frames))
    columns = [column(case.picture, image, case.masks[n], poses[n], case.tracker.ignore_legs) for n, image in seen]
    whole = np.concatenate([np.pad(each, ((0, 0), (2, 2), (0, 0))) for each in columns], axis=1)
    return np.asarray(cv2.resize(whole, (WIDTH, round(whole.shape[0] * WIDTH / whole.shape[1])), interpolation=cv2.INTER_AREA), np.uint8)


def column(picture: Picture, image: Image, mask: np.ndarray, pose: Array, without_legs: bool) -> Image:
    """A frame: the model in its pose, model and silhouette together, the picture; legs, which do not count, in grey."""
    import cv2

    calm = cv2.bilateralFilter(in_colour(image), 7, 30, 3) // GREYS * GREYS
    best = np.full_like(calm, 255)
    draw_model(best, picture, pose)
    matched = matching(picture.mask(pose), mask, mask & picture.legs(pose) if without_legs else None)
    return np.asarray(np.concatenate([best, matched, calm]), np.uint8)


EXPERIMENT = Experiment("figure_10_12", "Fig. 10, 11, 12: wave hands, bend aside, bow forward: best estimate, matching result, raw image",
                        "half a minute", make, runs=100, short_runs=4)
