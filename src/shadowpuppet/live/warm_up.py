"""All compiled code used once, so that nobody waits for a compiler in the middle of a session."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from shadowpuppet.body.anthropometry import AVERAGE_HEIGHT
from shadowpuppet.body.models import average_sizes
from shadowpuppet.camera.camera import Camera
from shadowpuppet.pipeline.options import Options
from shadowpuppet.silhouette import learn_background
from shadowpuppet.tracking.monocular.initialization import PersonEstimate, find_person
from shadowpuppet.tracking.monocular.tracker import MonocularTracker


def warm_up(camera: Camera, options: Options) -> None:
    """Segment, measure and track somebody drawn, in pictures of the camera's size, and forget all of it."""
    rng = np.random.default_rng(0)
    body = options.tracker.body
    picture = PersonEstimate(average_sizes(body, AVERAGE_HEIGHT), AVERAGE_HEIGHT, 2.5, -0.3).picture(camera, body)
    mask = picture.mask(np.zeros(len(picture.body.skeleton.dofs)))
    empty = [rng.integers(100, 110, (*mask.shape, 3), dtype=np.uint8) for _ in range(2)]
    image = empty[0].copy()
    image[mask] = (40, 40, 200)
    learn_background(empty, options.silhouette)(image)
    quick = replace(options.initialization, hypotheses=2, rounds=1, sweeps=1)
    find_person(rng, camera, [mask], height=AVERAGE_HEIGHT, distance=2.5, body=options.tracker.body, settings=quick)
    tracker = MonocularTracker(picture, options.tracker)
    tracker.cycle(rng, tracker.start(rng, mask), mask)
