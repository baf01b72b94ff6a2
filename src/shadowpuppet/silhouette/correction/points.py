"""Textured points of the empty scene, compared with a frame's reduced picture under a movement, and the steps that improve the movement."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.silhouette.background import Floats

Homography = NDArray[np.float64]
"""Of shape (3, 3): pixels of the empty scene to pixels of the frame, in coordinates about the middle over half the width."""

BLOCKS = 8, 6
"""Number of blocks across and down; points are taken from each."""
POINTS = 40
"""Greatest number of points in a block."""
MIN_SLOPE = 2.5
"""Least slope of a point's brightness, grey levels per pixel of the reduced picture: below, it is noise, rounding or a faint shadow."""
MIN_BLOCKS = 0.25
"""Least share of blocks with points: a plain wall shows no movement, and moves no silhouette."""
OFFSET = 16
"""Added to grey levels before the logarithm: noise of dark pixels counts less."""
REACH = 0.1
"""Greatest shift that is searched, over the width."""
MIN_SCALE = 0.01
"""Least assumed standard deviation of a point's difference, log brightness."""
BEND = 0.04
"""Standard deviation of the corners, over half the width, that is assumed for a change of view beyond shift and roll."""
OUTSIDE = 1e3
"""Difference of a point outside the picture."""
CORRELATION = 4.0
"""Number of neighbouring points whose differences count as one."""
STEPS = 8
"""Greatest number of steps of a refinement."""
SEARCHED = 3
"""Step over the points in the search of shifts."""
SHIFTS = np.zeros((8, 3))
SHIFTS[2, 0] = SHIFTS[5, 1] = 1
SHIFTS[1, 2], SHIFTS[3, 2] = -1, 1
"""The parameters (8, 3) of a small shift and roll."""
BEYOND_SHIFTS = np.eye(8) - SHIFTS @ np.linalg.pinv(SHIFTS)
"""What of parameters is neither."""


class Points(NamedTuple):
    """Textured points of the empty scene at one reduction."""

    xy: Floats
    """Their places (N, 2), coordinates about the middle over half the width."""
    value: Floats
    """Values of the reduced scene (N,)."""
    jacobian: Floats
    """Derivatives of the values with respect to the eight parameters of a homography (N, 8)."""
    rigid: Floats
    """The same (N, 3) with respect to shift and roll."""
    places: NDArray[np.intp]
    """Columns and rows (2, N) of the points, pixels of the reduced picture."""
    typical: float
    """Median of the values without their signs."""

    def some(self, step: int) -> Points:
        """Every `step`-th of them."""
        def part(values: Floats) -> Floats:
            return np.ascontiguousarray(values[::step])

        return Points(part(self.xy), part(self.value), part(self.jacobian), part(self.rigid), self.places[:, ::step].copy(), self.typical)


def textured_points(picture: Floats, grey: Floats) -> Points | None:
    """The points of steepest slope in each block of a reduced picture (H, W), of brightness `grey` (H, W), grey levels; None if too few
    blocks have any."""
    height, width = picture.shape
    down, across = (np.asarray(slope) for slope in np.gradient(picture))
    slope = np.hypot(down, across)
    slope[slope * (grey + OFFSET) < MIN_SLOPE] = 0
    slope[:2], slope[-2:], slope[:, :2], slope[:, -2:] = 0, 0, 0, 0
    rows, columns, filled = list[NDArray[np.intp]](), list[NDArray[np.intp]](), 0
    for ys in np.array_split(np.arange(height), BLOCKS[1]):
        for xs in np.array_split(np.arange(width), BLOCKS[0]):
            block = slope[np.ix_(ys, xs)].ravel()
            order = np.argsort(-block, kind="stable")[: min(POINTS, len(block) // 3)]
            best = order[block[order] > 0]
            filled += len(best) >= 3
            rows.append(ys[best // len(xs)])
            columns.append(xs[best % len(xs)])
    if filled < MIN_BLOCKS * BLOCKS[0] * BLOCKS[1]:
        return None
    y, x = np.concatenate(rows), np.concatenate(columns)
    half = width / 2
    u, v = (x + 0.5) / half - 1, (y + 0.5 - height / 2) / half
    a, b = across[y, x] * half, down[y, x] * half
    along = a * u + b * v
    jacobian = np.column_stack([a * u, a * v, a, b * u, b * v, b, -along * u, -along * v])
    values = picture[y, x]
    return Points(np.column_stack([u, v]).astype(np.float32), values, jacobian.astype(np.float32), (jacobian @ SHIFTS).astype(np.float32),
                  np.stack([x, y]), median_of(np.abs(values)))


def searched_shift(points: Points, picture: Floats) -> Homography:
    """The shift under which most points look alike, to a pixel of a reduced picture (H, W)."""
    from shadowpuppet.silhouette.correction._kernels import shift_costs

    reach = round(REACH * picture.shape[1])
    costs, numbers = (np.empty((2 * reach + 1, 2 * reach + 1), np.float32) for _ in range(2))
    x, y = (np.ascontiguousarray(each[::SEARCHED]) for each in points.places)
    padded, inside = np.pad(picture, reach), np.pad(np.ones_like(picture), reach)
    shift_costs(x, y, points.value[::SEARCHED], padded, inside, np.float32(points.typical), costs, numbers)
    y, x = np.unravel_index(np.argmin(costs), costs.shape)
    out = np.eye(3)
    out[:2, 2] = (int(x) - reach, int(y) - reach)
    out[:2, 2] /= picture.shape[1] / 2
    return out


def refined(points: Points, picture: Floats, movement: Homography, rigid: bool, tolerance: float) -> Homography:
    """A movement refined by Gauss-Newton steps; `rigid`: shift and roll alone."""
    for _ in range(STEPS):
        difference = compared(points, picture, movement)
        step = solved_step(points, difference, median_of(np.abs(difference)), movement, rigid)
        movement = movement @ np.linalg.inv(matrix_of(step))
        movement = movement / movement[2, 2]
        if np.abs(step).sum() < tolerance:
            break
    return movement


def compared(points: Points, picture: Floats, movement: Homography) -> Floats:
    """Differences (N,) of a reduced picture (H, W) and points under a movement; a point outside the picture has a very large one."""
    from shadowpuppet.silhouette.correction._kernels import point_differences

    out = np.empty(len(points.value), np.float32)
    point_differences(points.xy, points.value, picture, movement.astype(np.float32), np.float32(OUTSIDE), out)
    return out


def solved_step(points: Points, difference: Floats, typical: float, movement: Homography, rigid: bool) -> NDArray[np.float64]:
    """The step (8,) from a movement that takes points' differences (N,) away, of median `typical`."""
    from shadowpuppet.silhouette.correction._kernels import normal_equations

    jacobian = points.rigid if rigid else points.jacobian
    left, right = np.empty((jacobian.shape[1],) * 2), np.empty(jacobian.shape[1])
    normal_equations(jacobian, difference, np.float32(max(1.4826 * typical, MIN_SCALE)), left, right)
    if rigid:
        return SHIFTS @ np.linalg.solve(left + np.eye(3), right)
    prior = CORRELATION / BEND**2 * BEYOND_SHIFTS
    now = (movement - np.eye(3)).ravel()[:8]
    return np.asarray(np.linalg.solve(left + prior + np.eye(8), right + prior @ now), float)


def median_of(values: Floats) -> float:
    """The median (the upper one of two) of values (N,)."""
    middle = len(values) // 2
    return float(np.partition(values, middle)[middle])


def matrix_of(step: NDArray[np.float64]) -> Homography:
    """The movement of a step (8,)."""
    return np.eye(3) + np.append(step, 0).reshape(3, 3)
