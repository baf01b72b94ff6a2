"""A tracker for tests of what is around a tracker: it puts a body upright where the surface points are."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from shadowpuppet.body.models import average_sizes, make_body
from shadowpuppet.errors import NOTED, Finding
from shadowpuppet.io.person import Person
from shadowpuppet.pipeline.person_rig import MultiviewSubject
from shadowpuppet.tracking.multiview.observation import BodyInViews
from shadowpuppet.tracking.multiview.surface.visual_hull import VisualHull
from shadowpuppet.tracking.particle_filter import Particles


class Standing(NamedTuple):
    pose: np.ndarray
    status: str
    particles: Particles
    cost: float = 0.0
    overlap: float = 0.9
    unexplained: tuple = ()


class Follower:
    """Puts a body upright where the surface points are."""

    def __init__(self, body, cameras) -> None:
        self.body, self.cameras, self.calls = body, tuple(cameras), []
        self.views = BodyInViews(body, ())  # an upright body is no measure of whether cameras are in step

    def start(self, rng, points, masks, facing=None, keypoints=()) -> Standing:
        self.calls.append("start")
        return self._there(rng, points, masks)

    def step(self, rng, state, points, masks, codes=(), keypoints=()) -> Standing:
        self.calls.append("step")
        return self._there(rng, points, masks) if len(points.points) else state._replace(status="lost")

    def shown(self, *_) -> None:
        """No keypoints."""

    def _there(self, rng, points, masks) -> Standing:
        pose = np.zeros(len(self.body.skeleton.dofs))
        pose[:3] = points.points.mean(0) + rng.normal(0, 1e-3, 3)
        status = "tracked" if sum(mask is not None for mask in masks) > 2 else "uncertain"
        return Standing(pose, status, Particles(pose[None], np.zeros(1), np.zeros(1)))


def followed(cameras) -> MultiviewSubject:
    """A person of average sizes whom the tracker follows in these cameras."""
    sizes = average_sizes("anatomical", 1.7)
    body = make_body("anatomical", sizes)
    return MultiviewSubject(body=body, tracker=Follower(body, cameras), hull=VisualHull(cameras), person=Person(sizes),
                            summary={"height": 1.7}, doubts=(Finding("the sizes are a guess", "sizes are a guess: give --person", NOTED),))
