"""A scene to be shown, as plain data: figures, cameras, points, curves. Independent of how it is drawn."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.keypoints import Keypoints
from shadowpuppet.geometry import Array
from shadowpuppet.motion.limbs import LIMBS
from shadowpuppet.motion.mesh import Mesh
from shadowpuppet.motion.synchronization import nearest, step_of
from shadowpuppet.video import Image

REACH = 0.75
"""Distance from a figure's nearest frame, in its own time steps, beyond which it is hidden."""
VIEW_DIRECTION = (1.0, 1.6, 0.9)
"""Default direction of the first viewpoint: forward, to the side, up."""


class LimbDoubt(NamedTuple):
    """Limbs of a figure that are not vouched for."""

    frames: NDArray[np.bool_]
    """Whether a limb is not, of shape (T, K), for the K `LIMBS`."""
    limbs: NDArray[np.int64]
    """The limb that each joint of the mesh belongs to, of shape (J,)."""

    def named(self, n: int) -> list[str]:
        """Limbs that are not vouched for in a frame, in words."""
        return [LIMBS[k].replace("_", " ") for k in np.flatnonzero(self.frames[n])]


class ParticleCloud(NamedTuple):
    """Particles of one frame."""

    lines: Array
    """Bones of each particle, world, metres, of shape (N, B, 2, 3)."""
    weights: Array
    """Weights relative to the greatest, of shape (N,)."""


class HullPoints(NamedTuple):
    """Points on the visual hull."""

    points: Array
    """World, metres, of shape (P, 3)."""
    cameras: NDArray[np.int64]
    """Index of the camera that each point was found with (it lies on that camera's contour), of shape (P,)."""


@dataclass(frozen=True, eq=False)
class SceneFigure:
    """A moving figure: a mesh, each point attached to a joint."""

    name: str
    times: Array
    """Seconds, of shape (T,); with a single time the figure does not move."""
    mesh: Mesh
    rest: Array
    """Joints of the mesh at rest, of shape (J, 3), metres."""
    places: Array
    """Positions of the joints, world, metres, of shape (T, J, 3); NaN where unknown."""
    turns: Array
    """Rotations of the joints from rest, of shape (T, J, 3, 3)."""
    kind: str = "estimate"
    """estimate, truth, other, or mean (of a region of poses)."""
    status: NDArray[np.str_] | None = None
    """Of shape (T,), names in `motion.STATUSES`."""
    overlap: Array | None = None
    """Overlap of the drawn body and the silhouettes, of shape (T,)."""
    joints: Array | None = None
    """Named joints, of shape (T, K, 3), metres."""
    joint_names: tuple[str, ...] = ()
    """Their names."""
    joint_sd: Array | None = None
    """Their standard deviations along the world's axes, of shape (T, K, 3), metres."""
    bones: tuple[tuple[int, int], ...] = ()
    """Pairs of these joints with a line between them, where a figure is drawn as lines, or a camera is looked through."""
    limbs: tuple[str, ...] = ()
    """Limbs, of `LIMBS`, with a status."""
    limb_status: NDArray[np.str_] | None = None
    """Their statuses, of shape (T, limbs), of `motion.STATUSES`."""
    doubtful: LimbDoubt | None = None
    """Which limbs are not vouched for; None: all are."""
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Offset at which it is drawn, metres."""
    tint: tuple[int, int, int] | None = None
    """Colour mixed into the mesh's, 0..255, in place of its kind's: one of several people."""

    def at(self, time: float) -> int | None:
        """Frame to be shown at a time, seconds; None if none is near enough or no joint is known in it."""
        if len(self.times) == 1:
            return 0 if self.known[0] else None
        n = int(nearest(self.times, np.array(time)))
        return n if abs(self.times[n] - time) <= REACH * self.step and self.known[n] else None

    @cached_property
    def step(self) -> float:
        """Seconds from frame to frame."""
        return step_of(self.times)

    @cached_property
    def known(self) -> NDArray[np.bool_]:
        """Whether any joint is known, of shape (T,)."""
        finite: NDArray[np.bool_] = np.asarray(np.isfinite(self.places).all(2))
        return np.asarray(np.logical_or.reduce(finite, axis=1))

    @cached_property
    def quaternions(self) -> NDArray[np.float32]:
        """Rotations as unit quaternions w, x, y, z, of shape (T, J, 4); no rotation where unknown."""
        from scipy.spatial.transform import Rotation

        flat = self.turns.reshape(-1, 3, 3)
        good = np.isfinite(flat).all((1, 2))
        out = np.tile(np.array([1.0, 0, 0, 0]), (len(flat), 1))
        if good.any():
            out[good] = np.roll(Rotation.from_matrix(flat[good]).as_quat(), 1, axis=1)
        return out.reshape(*self.turns.shape[:2], 4).astype(np.float32)


class CameraImages(Protocol):
    """Pictures and silhouettes of a camera, read on demand."""

    def picture(self, time: float) -> Image | None:
        """Picture (H, W, 3), BGR, at a time of the recording (s); None if there is none."""
        ...

    def mask(self, time: float) -> NDArray[np.bool_] | None:
        """Silhouette (H, W) of the same picture."""
        ...


@dataclass(frozen=True, eq=False)
class SceneCamera:
    """A camera and its images."""

    camera: Camera
    """For pictures of the size of `images`."""
    images: CameraImages | None = None
    keypoints: Callable[[float], Keypoints] | None = None
    """What a detector found at a time of the recording (s), in pixels of these pictures; None: there was none."""


@dataclass(frozen=True, eq=False)
class Chart:
    """Curves over time of one unit."""

    name: str
    unit: str
    times: Array
    """Seconds, of shape (T,)."""
    curves: Mapping[str, Array]
    """Values (T,) by name; NaN where unknown."""
    sd: Mapping[str, Array] = field(default_factory=dict)
    """Standard deviations (T,) of some curves, by name; NaN where none is stated."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Stage:
    """Everything to be shown. Functions are called for one frame at a time, and are slow."""

    title: str
    times: Array
    """Frames of the timeline, seconds, of shape (T,)."""
    figures: tuple[SceneFigure, ...] = ()
    cameras: tuple[SceneCamera, ...] = ()
    charts: tuple[Chart, ...] = ()
    hull: Callable[[float], HullPoints] | None = None
    """Hull points at a time of the recording (s)."""
    cloud: Callable[[float], ParticleCloud | None] | None = None
    """Particles of the filter, run again, at a time (s)."""
    labels: tuple[tuple[str, tuple[float, float, float]], ...] = ()
    """Texts and their positions, metres."""
    facts: Mapping[str, str] = field(default_factory=dict)
    """Facts for the panel, by name."""
    notes: tuple[str, ...] = ()
    """Remarks for the user, a sentence each."""
    problems: tuple[str, ...] = ()
    """Parts that could not be shown, and reasons, a sentence each."""

    @cached_property
    def box(self) -> tuple[Array, Array]:
        """Least and greatest x, y, z of the figures; else of the cameras' views; else around the origin, metres."""
        points = [(figure.places + np.array(figure.shift)).reshape(-1, 3) for figure in self.figures]
        known = np.concatenate([np.zeros((0, 3)), *points])
        known = known[np.isfinite(known).all(1)]
        if not len(known) and self.cameras:
            known = _view_points(self.cameras)
        if not len(known):
            known = np.array([[-0.5, -0.5, 0.0], [0.5, 0.5, 1.8]])
        return known.min(0), known.max(0)

    @cached_property
    def middle(self) -> Array:
        """Middle of the box, of shape (3,), metres."""
        return np.asarray((self.box[0] + self.box[1]) / 2)

    @cached_property
    def size(self) -> float:
        """Diagonal of the box, at least 1, metres."""
        return max(float(np.linalg.norm(self.box[1] - self.box[0])), 1.0)

    @cached_property
    def floor(self) -> float:
        """Height of the floor, metres: 0 if the lowest joint is near it, else below the lowest joint."""
        low = float(self.box[0][2])
        return 0.0 if -0.15 < low < 0.35 else low - 0.1

    @cached_property
    def viewpoint(self) -> Array:
        """First viewpoint, of shape (3,), metres: near the camera if there is one, else from `VIEW_DIRECTION`."""
        if len(self.cameras) == 1:
            away = self.cameras[0].camera.centre - self.middle
            side = np.array([-away[1], away[0], 0.0])
            out = away + 0.55 * side
            out = out / max(float(np.linalg.norm(out)), 1e-6)
        else:
            out = np.array(VIEW_DIRECTION) / np.linalg.norm(VIEW_DIRECTION)
        return self.middle + out * (0.8 + 0.85 * self.size) + np.array([0, 0, 0.12 * self.size])


def _view_points(cameras: tuple[SceneCamera, ...]) -> Array:
    """Positions of the cameras and points in front of them, of shape (2 C, 3), metres."""
    centres = np.array([each.camera.centre for each in cameras])
    ahead = np.array([each.camera.T_camera_world[2, :3] for each in cameras])
    reach = max(float(np.linalg.norm(np.ptp(centres, axis=0))) / 2, 1.0)
    return np.concatenate([centres, centres + reach * ahead])
