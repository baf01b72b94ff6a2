"""What is to be shown, as plain data: figures, cameras, points, curves. Knows nothing of how it is drawn."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.camera.camera import Camera
from shadowpuppet.geometry import Array
from shadowpuppet.motion.mesh import Mesh
from shadowpuppet.motion.synchronization import step_of
from shadowpuppet.video import Image

REACH = 0.75
"""Steps of a figure's own times within which its nearest frame is shown; beyond, it is not there."""
EYE_TO_EYE = (1.0, 1.6, 0.9)
"""Whence a show is first looked at where nothing tells better: forward, aside and up, in parts of how large it is."""


class Spread(NamedTuple):
    """How uncertain some points are, as ellipsoids: half axes and the turn of them."""

    points: Array
    """World, metres, of shape (K, 3)."""
    axes: Array
    """Standard deviations along the ellipsoid's own axes, metres, of shape (K, 3)."""
    turns: Array
    """Rotations (K, 3, 3) of these axes to the world."""


class Cloud(NamedTuple):
    """Particles of one frame."""

    lines: Array
    """Bones of each, world, metres, of shape (N, B, 2, 3)."""
    weights: Array
    """How much each counts, of shape (N,), of the greatest."""
    spread: Spread
    """Of the joints."""


class Surface(NamedTuple):
    """Points on the visual hull."""

    points: Array
    """World, metres, of shape (P, 3)."""
    cameras: NDArray[np.int64]
    """The camera on whose contour each lies, of shape (P,)."""


@dataclass(frozen=True, eq=False)
class Figure:
    """Somebody who moves: a mesh, each point carried by a joint."""

    name: str
    times: Array
    """Seconds, of shape (T,); one alone stands still for good."""
    mesh: Mesh
    rest: Array
    """Where the mesh's joints are in its own axes, of shape (J, 3), metres."""
    places: Array
    """World, metres, of shape (T, J, 3); not a number where unknown."""
    turns: Array
    """Rotations against rest, of shape (T, J, 3, 3)."""
    kind: str = "estimate"
    """estimate, truth, other, or mean (of a region of poses)."""
    status: NDArray[np.str_] | None = None
    """Of shape (T,), of `motion.STATUSES`."""
    overlap: Array | None = None
    """Of the drawn body and the silhouettes, of shape (T,)."""
    joints: Array | None = None
    """Joints whose uncertainty is known, of shape (T, K, 3), metres."""
    joint_sd: Array | None = None
    """Their standard deviations along the world's axes, of shape (T, K, 3), metres."""
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """By what it is moved aside to be looked at, metres."""

    def at(self, time: float) -> int | None:
        """The frame to be shown at a time, seconds; None where there is none near enough, or nobody in it."""
        if len(self.times) == 1:
            return 0 if self.known[0] else None
        after = int(np.clip(np.searchsorted(self.times, time), 1, len(self.times) - 1))
        n = after - 1 if abs(self.times[after - 1] - time) <= abs(self.times[after] - time) else after
        return n if abs(self.times[n] - time) <= REACH * self.step and self.known[n] else None

    @cached_property
    def step(self) -> float:
        """Seconds from frame to frame."""
        return step_of(self.times)

    @cached_property
    def known(self) -> NDArray[np.bool_]:
        """Frames (T,) in which some joint is known."""
        finite: NDArray[np.bool_] = np.asarray(np.isfinite(self.places).all(2))
        return np.asarray(np.logical_or.reduce(finite, axis=1))

    @cached_property
    def quaternions(self) -> NDArray[np.float32]:
        """The turns as unit quaternions w, x, y, z, of shape (T, J, 4); none where unknown."""
        from scipy.spatial.transform import Rotation

        flat = self.turns.reshape(-1, 3, 3)
        good = np.isfinite(flat).all((1, 2))
        out = np.tile(np.array([1.0, 0, 0, 0]), (len(flat), 1))
        if good.any():
            out[good] = np.roll(Rotation.from_matrix(flat[good]).as_quat(), 1, axis=1)
        return out.reshape(*self.turns.shape[:2], 4).astype(np.float32)

    def spread(self, n: int) -> Spread | None:
        """The stated uncertainty of a frame; None where there is none."""
        if self.joints is None or self.joint_sd is None:
            return None
        good = np.isfinite(self.joint_sd[n]).all(1) & np.isfinite(self.joints[n]).all(1)
        if not good.any():
            return None
        return Spread(self.joints[n, good], self.joint_sd[n, good], np.tile(np.eye(3), (int(good.sum()), 1, 1)))


class Seen(Protocol):
    """What a camera saw, read when it is asked for."""

    def picture(self, time: float) -> Image | None:
        """The picture (H, W, 3), blue green red, at a time of the recording (s); None where there is none."""
        ...

    def mask(self, time: float) -> NDArray[np.bool_] | None:
        """The silhouette (H, W) of the same picture."""
        ...


@dataclass(frozen=True, eq=False)
class Eye:
    """A camera, and what it saw."""

    camera: Camera
    """For pictures of the size that `seen` gives."""
    seen: Seen | None = None


@dataclass(frozen=True, eq=False)
class Chart:
    """Curves over time of one unit."""

    name: str
    unit: str
    times: Array
    """Seconds, of shape (T,)."""
    curves: Mapping[str, Array]
    """Values (T,) by name; not a number where unknown."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Show:
    """All that is to be seen. Whatever is a function is asked for one frame at a time, and takes its time."""

    title: str
    times: Array
    """Frames of the timeline, seconds, of shape (T,); one alone: nothing moves."""
    figures: tuple[Figure, ...] = ()
    eyes: tuple[Eye, ...] = ()
    charts: tuple[Chart, ...] = ()
    hull: Callable[[float], Surface] | None = None
    """Surface points at a time of the recording (s)."""
    cloud: Callable[[float], Cloud | None] | None = None
    """The filter's particles at a time, made anew."""
    labels: tuple[tuple[str, tuple[float, float, float]], ...] = ()
    """Words, and where they stand, metres."""
    facts: Mapping[str, str] = field(default_factory=dict)
    """What is told about it."""
    notes: tuple[str, ...] = ()
    """What whoever looks should know, a sentence each."""
    lacks: tuple[str, ...] = ()
    """What could not be shown, and why, a sentence each."""

    @property
    def states_spread(self) -> bool:
        """Whether some figure's uncertainty is known."""
        return any(figure.joint_sd is not None and bool(np.isfinite(figure.joint_sd).any()) for figure in self.figures)

    @cached_property
    def box(self) -> tuple[Array, Array]:
        """Where the people are: least and greatest x, y, z, metres; else between the cameras; else about the origin."""
        points = [(figure.places + np.array(figure.shift)).reshape(-1, 3) for figure in self.figures]
        known = np.concatenate([np.zeros((0, 3)), *points])
        known = known[np.isfinite(known).all(1)]
        if not len(known) and self.eyes:
            known = aims(self.eyes)
        if not len(known):
            known = np.array([[-0.5, -0.5, 0.0], [0.5, 0.5, 1.8]])
        return known.min(0), known.max(0)

    @cached_property
    def middle(self) -> Array:
        """What is looked at, of shape (3,), metres."""
        return np.asarray((self.box[0] + self.box[1]) / 2)

    @cached_property
    def size(self) -> float:
        """How large what is looked at is, metres."""
        return max(float(np.linalg.norm(self.box[1] - self.box[0])), 1.0)

    @cached_property
    def floor(self) -> float:
        """Height at which a floor is drawn, metres: 0 where people stand about there, else under the lowest joint."""
        low = float(self.box[0][2])
        return 0.0 if -0.15 < low < 0.35 else low - 0.1

    @cached_property
    def viewpoint(self) -> Array:
        """Whence it is first looked at, of shape (3,), metres: from the front of a person as one camera saw them, else from aside."""
        if len(self.eyes) == 1:
            away = self.eyes[0].camera.centre - self.middle
            side = np.array([-away[1], away[0], 0.0])
            out = away + 0.55 * side
            out = out / max(float(np.linalg.norm(out)), 1e-6)
        else:
            out = np.array(EYE_TO_EYE) / np.linalg.norm(EYE_TO_EYE)
        return self.middle + out * (0.8 + 0.85 * self.size) + np.array([0, 0, 0.12 * self.size])


def aims(eyes: tuple[Eye, ...]) -> Array:
    """Points (2 E, 3) where cameras are and some way before them, metres."""
    centres = np.array([eye.camera.centre for eye in eyes])
    ahead = np.array([eye.camera.T_camera_world[2, :3] for eye in eyes])
    reach = max(float(np.linalg.norm(np.ptp(centres, axis=0))) / 2, 1.0)
    return np.concatenate([centres, centres + reach * ahead])
