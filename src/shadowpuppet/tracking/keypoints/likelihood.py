"""How likely keypoints are, given a body's landmarks: Student-t across the ray with outliers, sides as the detector says or exchanged.

A keypoint's distance r across its ray has the density p = (1 - o) t(r; s) + o / `BOX`: Student-t in the plane with `NU` degrees of freedom,
scale s, and what lies anywhere on the person. A detector exchanges both arms, both legs or all of them at once, so a camera's keypoints
are a mixture of four. A surprise is -log p, less that of a ray through the landmark, in nats.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.geometry import Array
from shadowpuppet.jit import device, kernel
from shadowpuppet.tracking.keypoints.definitions import ARMS, LEGS, Landmarks
from shadowpuppet.tracking.keypoints.sights import Sights

NU = 4
"""Degrees of freedom: of MediaPipe's errors on a made film 3.4. The exponent of the density, NU / 2 + 1, is 3."""
BOX = 2.0
"""Area (m^2) over which keypoints on something else are spread: that of a person's height and reach of one arm."""
EXCHANGED = 0.02
"""Probability of each exchange, of arms, of legs and of both, in a frame of a camera."""


def surprises(points: Array, sights: Sights, landmarks: Landmarks, *, anywhere: bool = False) -> Array:
    """Surprise (N,), nats, of what is seen given the landmarks' places (N, K, 3) in N poses. `anywhere`: at whatever distance from the one
    camera; how large a person is in its picture tells the distance no better than proportions are known."""
    out, points = np.zeros(len(points)), np.ascontiguousarray(points)
    if anywhere:
        points = points.copy()
        _put_along(points, sights, sights.rays.mean(0))
    _surprises(points, landmarks.mirrored, landmarks.limbs, sights, np.zeros((sights.size, 2, 2)), out)
    return out


def exchanges(points: Array, sights: Sights, landmarks: Landmarks) -> Array:
    """Probabilities (C, 2) that arms and legs are exchanged in each camera, given the landmarks' places (K, 3)."""
    logs = np.zeros((sights.size, 2, 2))
    sum_surprises(np.ascontiguousarray(points), landmarks.mirrored, landmarks.limbs, sights, logs)
    return np.array([sides(each)[1:] for each in logs]).reshape(-1, 2)


def odds_turned(points: Array, sights: Sights, landmarks: Landmarks) -> float:
    """Log odds that all sides are exchanged in one camera, given the landmarks' places (K, 3): that the person faces the other way rather
    than as the body does. A frame's are bounded, as a detector exchanges all sides now and then."""
    logs = np.zeros((1, 2, 2))
    sum_surprises(np.ascontiguousarray(points), landmarks.mirrored, landmarks.limbs, sights, logs)
    said, turned = logs[0].sum(0)
    rare, usual = np.log([EXCHANGED, 1 - EXCHANGED])
    return float(np.logaddexp(usual - turned, rare - said) - np.logaddexp(usual - said, rare - turned))


def pulls(points: Array, sights: Sights, landmarks: Landmarks) -> tuple[NDArray[np.int64], Array]:
    """The landmark (M,) to which each ray probably leads, on the side that its camera seems to see, given the landmarks' places (K, 3); and
    the derivative (M,) of the surprise by its squared distance."""
    turned = exchanges(points, sights, landmarks)[sights.cameras, landmarks.limbs[sights.landmarks]] > 0.5
    chosen = np.where(turned, landmarks.mirrored[sights.landmarks], sights.landmarks)
    out = np.zeros(len(chosen))
    _attractions(np.ascontiguousarray(points), chosen, sights, out)
    return chosen, out


@kernel
def _attractions(points, chosen, sights, out):  # pragma: no cover
    for m in range(out.size):
        out[m] = attraction(points[chosen[m]], m, sights)


@kernel
def _surprises(points, mirrored, limbs, sights, logs, out):  # pragma: no cover
    for n in range(points.shape[0]):
        sum_surprises(points[n], mirrored, limbs, sights, logs)
        for c in range(logs.shape[0]):
            out[n] += sides(logs[c])[0]


@kernel
def _put_along(points, sights, view):  # pragma: no cover
    """Move landmarks (N, K, 3) along one camera's `view` (3,) to where they are nearest to its rays."""
    for n in range(points.shape[0]):
        asked, tells = 0.0, 0.0
        for m in range(sights.landmarks.size):
            point, origin = points[n, sights.landmarks[m]], sights.origins[m]
            weight = (1 - sights.outlying[m]) / (sights.squares[m] + across(point, m, sights) / NU)
            for i in range(2):
                a = sights.across[m, i]
                step = a[0] * view[0] + a[1] * view[1] + a[2] * view[2]
                asked += weight * step * (a[0] * (point[0] - origin[0]) + a[1] * (point[1] - origin[1]) + a[2] * (point[2] - origin[2]))
                tells += weight * step * step
        if tells > 0:
            for k in range(points.shape[1]):
                for i in range(3):
                    points[n, k, i] -= asked / tells * view[i]


@kernel
def sum_surprises(points, mirrored, limbs, sights, logs):  # pragma: no cover
    """Fill logs (C, 2, 2): sums of the surprises in each camera by the landmarks' `limbs` (K,), with points (K, 3) of the side that the
    detector says, and of the other side, `mirrored` (K,)."""
    logs[:] = 0.0
    for m in range(sights.landmarks.size):
        k, own = sights.landmarks[m], logs[sights.cameras[m]]
        own[limbs[k], 0] += surprise(points[k], m, sights)
        own[limbs[k], 1] += surprise(points[mirrored[k]], m, sights)


@device
def surprise(point, m, sights):  # pragma: no cover
    """Surprise of ray `m`, given the place (3,) of its landmark."""
    near, far = _densities(point, m, sights)
    return np.log(((1 - sights.outlying[m]) / (2 * np.pi * sights.squares[m]) + far) / (near + far))


@device
def attraction(point, m, sights):  # pragma: no cover
    """Derivative of `surprise` by the squared distance across the ray: 0 far away, where the ray leads to something else."""
    near, far = _densities(point, m, sights)
    square = sights.squares[m]
    return near / (near + far) * (0.5 + 1 / NU) / (square + across(point, m, sights) / NU)


@device
def _densities(point, m, sights):  # pragma: no cover
    """Densities of ray `m` if it leads to a landmark at a place (3,), and to something else."""
    square, outlying = sights.squares[m], sights.outlying[m]
    falloff = 1 + across(point, m, sights) / (NU * square)
    return (1 - outlying) / (2 * np.pi * square * falloff * falloff * falloff), outlying / BOX


@device
def across(point, m, sights):  # pragma: no cover
    """Squared distance from ray `m` to a point (3,)."""
    total = 0.0
    for i in range(2):
        a = sights.across[m, i]
        away = sights.origins[m]
        total += (a[0] * (point[0] - away[0]) + a[1] * (point[1] - away[1]) + a[2] * (point[2] - away[2])) ** 2
    return total


@device
def sides(logs):  # pragma: no cover
    """Surprise of a camera's keypoints from its sums (2, 2), and the probabilities that arms and legs are exchanged."""
    arms, legs = logs[ARMS, 1] - logs[ARMS, 0], logs[LEGS, 1] - logs[LEGS, 0]
    as_said, odds = 1 - 3 * EXCHANGED, EXCHANGED
    least = min(0.0, arms, legs, arms + legs)
    a, b, c, d = as_said * np.exp(least), odds * np.exp(least - arms), odds * np.exp(least - legs), odds * np.exp(least - arms - legs)
    total = a + b + c + d
    return logs[ARMS, 0] + logs[LEGS, 0] + least - np.log(total), (b + d) / total, (c + d) / total
