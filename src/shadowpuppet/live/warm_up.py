"""Compiles all Numba functions before a session begins, by calling them once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from shadowpuppet.body.anthropometry import AVERAGE_HEIGHT
from shadowpuppet.body.models import average_body, average_sizes
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.pipeline.options import Options
from shadowpuppet.silhouette import learn_background
from shadowpuppet.tracking.monocular.initialization import find_person
from shadowpuppet.tracking.monocular.size_search import PersonEstimate
from shadowpuppet.tracking.monocular.tracker import MonocularTracker
from shadowpuppet.tracking.multiview.surface.visual_hull import VisualHull
from shadowpuppet.tracking.multiview.tracker import MultiviewTracker


def warm_up(cameras: Sequence[Camera], options: Options) -> None:
    """Segment, measure and track a rendered person, in pictures of the cameras' sizes; discards the result."""
    if len(cameras) > 1:
        return _warm_up_rig(tuple(cameras), options)
    (camera,), rng = cameras, np.random.default_rng(0)
    body = options.tracker.body
    picture = PersonEstimate(average_sizes(body, AVERAGE_HEIGHT), AVERAGE_HEIGHT, 2.5, -0.3).picture(camera, body)
    mask = picture.mask(np.zeros(len(picture.body.skeleton.dofs)))
    _segment(mask, options)
    quick = replace(options.initialization, hypotheses=2, rounds=1, sweeps=1)
    find_person(rng, camera, [mask], height=AVERAGE_HEIGHT, distance=2.5, body=options.tracker.body, settings=quick)
    tracker = MonocularTracker(picture, options.tracker)
    tracker.cycle(rng, tracker.start(rng, mask), mask)
    return None


def _warm_up_rig(cameras: tuple[Camera, ...], options: Options) -> None:
    body, rng = average_body(options.multiview.body), np.random.default_rng(0)
    pose = np.zeros(len(body.skeleton.dofs))
    masks = [Picture(body, camera, camera.T_camera_world).mask(pose) for camera in cameras]
    _segment(masks[0], options)
    points = VisualHull(cameras, options.multiview.hull).points(masks)
    tracker = MultiviewTracker(body, cameras, options.multiview)
    tracker.step(rng, tracker.start(rng, points, masks), points, masks)


def _segment(mask: Mask, options: Options) -> None:
    rng = np.random.default_rng(0)
    empty = [rng.integers(100, 110, (*mask.shape, 3), dtype=np.uint8) for _ in range(2)]
    image = empty[0].copy()
    image[mask] = (40, 40, 200)
    learn_background(empty, options.silhouette)(image)
