"""A detector's joints in one camera's picture, as the stages of its filter weigh them. Not in Liu 2011.

A silhouette does not show an arm before the trunk; a detector's joints do. Their surprise (`tracking.keypoints.likelihood`) is added to
eq. 2 in every stage.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from shadowpuppet.body.shapes import Body
from shadowpuppet.camera.keypoints import Keypoints
from shadowpuppet.camera.mask import Mask
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.geometry import Array
from shadowpuppet.motion.limbs import limb_of
from shadowpuppet.tracking.keypoints.choice import people_at, people_in
from shadowpuppet.tracking.keypoints.definitions import Landmarks, landmarks_of
from shadowpuppet.tracking.keypoints.likelihood import odds_turned, surprises
from shadowpuppet.tracking.keypoints.sights import NEAR, NO_SIGHTS, Sights, sights_of
from shadowpuppet.tracking.monocular.standing_place import PLACE


@dataclass(frozen=True, eq=False)
class JointsSeen:
    """The rays to one person's landmarks."""

    body: Body
    sights: Sights
    """In the body's frame."""

    @classmethod
    def of(cls, picture: Picture, keypoints: Keypoints | None, pose: Array, mask: Mask | None = None) -> JointsSeen | None:
        """Those of the person nearest to a pose (D,), or in a mask (H, W) there, if it is given; None without any."""
        if keypoints is None:
            return None
        found, camera = cls(picture.body, NO_SIGHTS), replace(picture.camera, T_camera_world=picture.T_camera_base)
        points, marks = found._places(pose[None])[0], found._landmarks
        people = people_at(points, [camera], [keypoints], marks) if mask is None else people_in([mask], [camera], [keypoints])
        sights = sights_of([camera], [keypoints], people, marks, points.mean(0))
        return replace(found, sights=sights) if len(sights.landmarks) else None

    def surprises(self, poses: Array, without: Sequence[str] = ()) -> Array:
        """Surprise (N,), nats, of the keypoints given poses (N, D); `without`: joints whose landmarks do not count."""
        hidden = [self.body.skeleton.joint_index(name) for name in without]
        sights = self.sights.only(~np.isin(self._landmarks.joints[self.sights.landmarks], hidden)) if hidden else self.sights
        return surprises(self._places(poses), sights, self._landmarks, anywhere=PLACE[0] in self.body.skeleton.dof_names)

    def against(self, pose: Array) -> float:
        """Log odds that the person faces the other way than in a pose (D,)."""
        return odds_turned(self._places(pose[None])[0], self.sights, self._landmarks)

    def support(self, pose: Array) -> float:
        """Share of the keypoints near a pose (D,): `Sights.support`."""
        return self.sights.support(self._places(pose[None])[0], self._landmarks)

    def missed(self, pose: Array) -> dict[str, float]:
        """Of each limb that has landmarks the share of them, by the keypoints' confidence, that no keypoint shows near a pose (D,)."""
        marks, seen = self._landmarks, np.zeros(len(self._landmarks.names))
        near = self.sights.squares_from(self._places(pose[None])[0], marks) < NEAR**2
        seen[self.sights.landmarks] = near * (1 - self.sights.outlying)
        limbs = np.array([limb_of(self.body.skeleton.joint_names[joint]) for joint in marks.joints])
        return {str(limb): float(1 - seen[limbs == limb].mean()) for limb in np.unique(limbs)}

    def _places(self, poses: Array) -> Array:
        """Places (N, K, 3) of the landmarks in poses (N, D)."""
        return self.body.skeleton.points(poses, self._landmarks.joints, self._landmarks.places)

    @cached_property
    def _landmarks(self) -> Landmarks:
        return landmarks_of(self.body)
