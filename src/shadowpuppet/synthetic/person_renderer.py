"""Images of the mannequin: exact silhouettes and shaded, anti-aliased pictures by sphere tracing."""

from __future__ import annotations

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.geometry import Array, inverse
from shadowpuppet.synthetic.compositing import FAR, Layer
from shadowpuppet.synthetic.person.clothes import Clothes
from shadowpuppet.synthetic.person.kinematics import PosedBody
from shadowpuppet.synthetic.person.mannequin import JOINTS
from shadowpuppet.synthetic.person.surface import GROUPS, MATERIALS, Surface

EDGE_SAMPLES = np.array([(-0.375, -0.125), (0.125, -0.375), (0.375, 0.125), (-0.125, 0.375)])
"""Sample positions in a pixel at an edge, a rotated grid, pixels from its centre."""


class PersonRenderer:
    """Draws one person with one camera; rays and tiles are prepared once."""

    def __init__(self, camera: Camera, surface: Surface, clothes: Clothes, lights: Array) -> None:
        """lights: (3, 4), unit directions toward the two lamps and their strengths; the third row holds the ambient light's."""
        from shadowpuppet.synthetic._ray_marching import TILE

        width, height = camera.size
        R = inverse(camera.T_camera_world)[:3, :3]
        self.camera, self.surface, self.lights = camera, surface, lights
        self.colours = np.array([clothes.colours.get(name, (0.5, 0.5, 0.5)) for name in MATERIALS])
        self.stripes = clothes.stripes
        self.table = np.concatenate([1 / surface.table[..., :2], surface.table[..., 2:]], -1)
        self.rays = _unit(camera.rays(np.stack(np.meshgrid(np.arange(width), np.arange(height)), -1)) @ R.T)
        self.across, down = -(-width // TILE), -(-height // TILE)
        corner = np.stack(np.meshgrid(np.arange(self.across + 1), np.arange(down + 1)), -1) * float(TILE) - 0.5
        if camera.fisheye:  # beyond the border of its picture there may be no rays
            corner = np.minimum(corner, np.array([width, height]) - 0.5)
        corners = _unit(camera.rays(corner) @ R.T)
        corners = np.stack([corners[:-1, :-1], corners[:-1, 1:], corners[1:, :-1], corners[1:, 1:]])
        self.direction = _unit(corners.mean(0)).reshape(-1, 3)
        angle = np.arccos(np.clip((corners.reshape(4, -1, 3) * self.direction).sum(-1).min(0), -1, 1)) * 1.05
        self.sine, self.cosine = np.sin(angle), np.cos(angle)

    def fine_rays(self) -> Array:
        """Unit rays (2H, 2W, 3), world, four per pixel: for objects that are drawn once."""
        width, height = self.camera.size
        grid = np.stack(np.meshgrid(np.arange(2 * width), np.arange(2 * height)), -1) / 2.0 - 0.25
        return _unit(self.camera.rays(grid) @ inverse(self.camera.T_camera_world)[:3, :3].T)

    def draw(self, figure: PosedBody, index: int) -> Layer:
        """The figure in its posture `index`."""
        from shadowpuppet.synthetic import _ray_marching

        traced, depth, near = self._traced(figure, index)
        alpha, picture = np.zeros(depth.shape), np.zeros((*depth.shape, 3))
        _ray_marching.colour_surface(*traced, depth, near, self.colours, self.lights, self.stripes, EDGE_SAMPLES, picture, alpha)
        return Layer(picture, alpha, depth)

    def mask(self, figure: PosedBody, index: int) -> np.ndarray:
        """The exact silhouette (H, W) of the figure in its posture `index`, as `draw` has it, without colours."""
        return self._traced(figure, index)[1] < FAR

    def _traced(self, figure: PosedBody, index: int) -> tuple[tuple, Array, np.ndarray]:
        """The kernels' arguments for the figure in a posture; depth (H, W) of its surface, and the nearest part (H, W)."""
        from shadowpuppet.synthetic import _ray_marching

        s, (width, height), eye = self.surface, self.camera.size, self.camera.centre
        R, o = figure.rotation[index, s.segment], figure.origin[index, s.segment]
        axes, origin = R @ s.frame, o + (R @ s.start[..., None])[..., 0]
        middle = origin + axes[:, :, 2] * (s.length[:, None] / 2)
        reach = s.length / 2 + s.radius + s.caps.max(1)
        sizes = [s.length, 1 / s.caps, s.blend, (s.table.shape[1] - 1) / s.length, s.change]
        placed = np.column_stack([axes.swapaxes(1, 2).reshape(-1, 9), origin, middle, reach, *sizes])
        lists, span = np.zeros((len(self.direction), len(origin) + 1), np.int64), np.zeros((len(self.direction), 2))
        _ray_marching.list_parts(self.direction, self.sine, self.cosine, eye, _covering(origin, axes, s), lists, span)
        traced = eye, self.rays, self.across, lists, span, placed, self.table, s.code, self._joins(figure, index)
        depth, near = np.empty((height, width)), np.empty((height, width), np.int64)
        _ray_marching.find_surface(*traced, depth, near)
        return traced, depth, near

    def _joins(self, figure: PosedBody, index: int) -> Array:
        """Place at which each of `GROUPS` blends into the trunk, and the radius, of shape (5, 4), metres."""
        names = [JOINTS.index(name) for name in ("neck", "left_shoulder", "right_shoulder", "left_hip", "right_hip")]
        assert len(names) == len(GROUPS)
        elbow, wrist = (figure.joints[index, JOINTS.index(name)] for name in ("left_elbow", "left_wrist"))
        scale = float(np.linalg.norm(wrist - elbow)) / 0.27
        return np.column_stack([figure.joints[index, names], np.array([0.15, 0.15, 0.15, 0.22, 0.22]) * scale])


def _unit(v: Array) -> Array:
    """Vectors (..., 3) of length 1, contiguous for the kernels."""
    return np.ascontiguousarray(v / np.linalg.norm(v, axis=-1, keepdims=True))


def _covering(origin: Array, axes: Array, s: Surface) -> Array:
    """Spheres (P, 4, 4) that cover each part with its caps and half its blend."""
    low, high = -s.caps[:, 0], s.length + s.caps[:, 1]
    step = (high - low) / 4
    along = low[:, None] + step[:, None] * (np.arange(4) + 0.5)
    centres = origin[:, None] + axes[:, None, :, 2] * along[..., None]
    radius = np.hypot(s.radius, step / 2) + 0.5 * s.blend + 0.005
    return np.concatenate([centres, np.broadcast_to(radius[:, None, None], (*along.shape, 1))], -1)
