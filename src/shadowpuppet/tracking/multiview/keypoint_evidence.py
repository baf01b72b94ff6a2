"""What the keypoints of one frame say of the person: the rays to landmarks, poses by inverse kinematics, the front.

They decide what is discrete, as person, front and sides, by candidates and log odds; and what is continuous by a cost added to that of the
surface. Not in Ni 2008.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from shadowpuppet.body.whole_body import heading_column
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.keypoints import Keypoints, cameras_with_persons
from shadowpuppet.camera.mask import Mask
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.keypoints.candidates import candidates, pose_at, seem_wrong, triangulated_landmarks
from shadowpuppet.tracking.keypoints.choice import people_at, people_in, person_between
from shadowpuppet.tracking.keypoints.front import CERTAIN, KeypointFront, front_of
from shadowpuppet.tracking.keypoints.likelihood import exchanges
from shadowpuppet.tracking.keypoints.sights import NEAR, Sights, sights_of
from shadowpuppet.tracking.multiview.refinement.correspondence import make_cloud
from shadowpuppet.tracking.multiview.refinement.refiner import Pass, Refiner
from shadowpuppet.tracking.multiview.settings import MultiviewSettings

FEWEST = 4
"""Least number of landmarks of a person in a picture."""
NO_POINTS = make_cloud(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0))


class KeypointEvidence:
    """Keypoints of one frame. Everything is computed on first use."""

    def __init__(self, refiner: Refiner, sights: Sights, settings: MultiviewSettings, middle: Array, cameras: int,
                 last: Array | None = None) -> None:
        """`middle` (3,): about where the person is, world; `cameras`: number of all cameras; `last`: the last pose (D,), if the person was
        tracked."""
        self.refiner, self.sights, self.settings, self.middle, self.cameras, self.last = refiner, sights, settings, middle, cameras, last
        self.worth = settings.keypoints

    def without(self, camera: int) -> KeypointEvidence:
        """The same without a camera."""
        return KeypointEvidence(self.refiner, self.sights.without(camera), self.settings, self.middle, self.cameras, self.last)

    @property
    def show_person(self) -> bool:
        """Whether two cameras, or the only one, show enough landmarks of a person."""
        sure = self.sights.cameras[self.sights.outlying < 0.5]
        return int((np.bincount(sure, minlength=1) >= FEWEST).sum()) >= min(2, self.cameras)

    def support(self, pose: Array) -> float:
        """Share of the keypoints that lie near the landmarks of a pose (D,): `Sights.support`."""
        marks = self.refiner.landmarks
        return self.sights.support(self.refiner.body.skeleton.points(pose[None], marks.joints, marks.places)[0], marks)

    def rays(self, alone: bool) -> tuple[Sights, float]:
        """The rays, and what a nat of their surprise costs, m^2: `alone`, or beside a surface.

        Beside it a nat is one of its weights (eq. 29), and more than two cameras count as two: the surface's cost is a mean over all of
        them, and a landmark lies beside its joint in all of them alike.
        """
        cameras = len(np.unique(self.sights.cameras))
        return self.sights, self.worth if alone else self.settings.sigma_cost**2 * min(1.0, 2 / max(cameras, 1))

    def cost(self, poses: Array) -> Array:
        """Cost (N,), m^2, of poses (N, D)."""
        return self.worth * self.refiner.surprises(poses, self.sights)

    @cached_property
    def proposed(self) -> Array:
        """The pose (1, D) that the keypoints show: the last one brought to the rays, or, where it does not come near them, that of the
        triangulated landmarks, sides as in the last pose where that says that a camera exchanges them; (0, D) if too little is known."""
        marks, body, turned = self.refiner.landmarks, self.refiner.body, None
        if self.last is not None:
            near = self._fitted(self.last[None])
            places = body.skeleton.points(near, marks.joints, marks.places)[0]
            turned = exchanges(places, self.sights, marks)
            far = self.sights.landmarks[self.sights.squares_from(places, marks) > NEAR**2]
            if np.bincount(far, minlength=1).max() < 2 and not seem_wrong(turned, self.sights).any():
                return near
        pose = pose_at(body, marks, triangulated_landmarks(self.sights, marks, turned), self.last)
        return self._fitted(np.zeros((0, len(body.skeleton.dofs))) if pose is None else pose[None])

    @cached_property
    def either_way(self) -> Array:
        """Poses (n, D) with sides as the detector says, and exchanged."""
        return self._fitted(candidates(self.refiner.body, self.refiner.landmarks, self.sights, self.last))

    @cached_property
    def front(self) -> KeypointFront | None:
        """Which way the person faces; None if too little is known."""
        headings = self.either_way[:, heading_column(self.refiner.body.skeleton)]
        return front_of(headings, self.refiner.surprises(self.either_way, self.sights))

    def toward(self, pose: Array) -> float:
        """Log odds for the way that a pose (D,) faces; 0 if the keypoints do not tell."""
        column = heading_column(self.refiner.body.skeleton)
        return 0.0 if self.front is None else self.front.odds * float(np.sign(np.cos(self.front.heading - pose[column])))

    def against(self, pose: Array) -> float:
        """Log odds against the way that a pose (D,) faces; 0 if the keypoints show no other."""
        column = heading_column(self.refiner.body.skeleton)
        if not len(self.proposed) or np.cos(self.proposed[0, column] - pose[column]) > 0:
            return 0.0
        return 0.0 if self.front is None or np.cos(self.front.heading - pose[column]) > 0 else self.front.odds

    def _fitted(self, poses: Array) -> Array:
        """Poses (n, D) brought to the rays, without the surface."""
        if not len(poses):
            return poses
        s = self.settings.gauss_newton
        each = Pass(NO_POINTS, s.coarse + s.fine, s.fine_tau, sights=self.sights, worth=self.worth)
        return self.refiner.descend(poses, each, poses, np.full(poses.shape[1], s.pull), s.damping)[0]


def keypoint_evidence(refiner: Refiner, cameras: Sequence[Camera], settings: MultiviewSettings, keypoints: Sequence[Keypoints | None],
                      masks: Sequence[Mask | None], middle: Array | None, last: Array | None = None) -> KeypointEvidence | None:
    """What a frame's keypoints, one per camera, say of the person: of those in the masks (H, W), or of those nearest to the `last` pose
    (D,). `middle` (3,): about where the person is, world; None if that is not known. None without keypoints."""
    if not settings.keypoints or not cameras_with_persons(keypoints):
        return None
    marks = refiner.landmarks
    if last is not None:
        places = refiner.body.skeleton.points(last[None], marks.joints, marks.places)[0]
        people = people_at(places, cameras, keypoints, marks)
        middle = np.asarray(places.mean(0) if middle is None else middle)
    elif middle is not None:
        people = people_in(masks, cameras, keypoints)
    else:
        people, middle = person_between(cameras, keypoints, marks)
    sights = sights_of(cameras, keypoints, people, marks, middle)
    return KeypointEvidence(refiner, sights, settings, middle, len(cameras), last)


def opening_heading(looks: Sequence[KeypointEvidence], now: KeypointEvidence) -> float | None:
    """The heading (rad) in the frame `now` if some looks at the person together are certain whether they face as the detector says."""
    odds, column = 0.0, heading_column(now.refiner.body.skeleton)
    for each in looks:
        if len(each.proposed) and each.front is not None:
            odds += each.front.odds * np.sign(np.cos(each.front.heading - each.proposed[0, column]))
    if abs(odds) <= CERTAIN or not len(now.proposed):
        return None
    return float(now.proposed[0, column]) + (0.0 if odds > 0 else np.pi)
