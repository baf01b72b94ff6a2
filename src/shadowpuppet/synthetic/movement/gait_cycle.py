"""One cycle of walking or jogging: published joint angles fitted to a body and a speed.

The angles alone would let the feet slide and sink a little. So the cycle is split into a constraint (a foot stands still from contact to
toe-off, rolling over heel and ball) and two motions computed from the angles: the swing of the foot, and the rise and fall of the pelvis.
`gait.py` combines them over footprints.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from shadowpuppet.geometry import Array
from shadowpuppet.synthetic.movement.gait_curves import KNEE_ZERO, RUN, STANDING_TILT, WALK, curve
from shadowpuppet.synthetic.person.mannequin import Mannequin

GRAVITY = 9.81
CYCLE_SAMPLES = 200
"""Number of phases at which a cycle is computed."""
FLAT_PITCH = np.radians(5.0)
"""Pitch of a loaded foot, rad, below which it lies almost flat."""


class Sole(NamedTuple):
    """The foot in its sagittal plane, metres."""

    heel: float
    """Distance of the heel's roll-off behind the ankle."""
    ball: float
    """Distance of the ball in front of the ankle."""
    tip: float
    """Distance of the tips of the toes in front of the ankle."""
    ankle: float
    """Height of the ankle over the floor."""

    @classmethod
    def of(cls, body: Mannequin) -> Sole:
        """The sole of a body."""
        long = body.measure("foot_length")
        return cls(0.14 * long, 0.48 * long, 0.72 * long, body.length("ankle"))

    def rolled(self, pitch: Array) -> tuple[Array, Array]:
        """Ankle of a foot with `pitch` (rad, toes up): forward and up, metres, from the floor point below the ankle of the flat foot.

        The foot rolls over the heel or the ball, and from some 20 degrees on also over the tips of the toes.
        """
        c, s = np.cos(pitch), np.sin(pitch)
        late = smoothstep((-pitch - np.radians(20)) / np.radians(60))
        lever = np.where(pitch > 0, -self.heel, self.ball + late * (self.tip - self.ball))
        return lever - lever * c - self.ankle * s, -lever * s + self.ankle * c


class GaitCurves(NamedTuple):
    """A gait as published joint angles over the cycle."""

    carries: float
    """Share of the cycle in which a foot stands."""
    clears: float
    """Least height of the ball of the foot in mid-swing, leg lengths."""
    bow: float
    """Forward tilt of the pelvis against standing, degrees."""
    thigh: Callable[[Array], Array]
    """Angle of the thigh forward of the vertical at a phase, degrees."""
    knee: Callable[[Array], Array]
    """Flexion, degrees."""
    ankle: Callable[[Array], Array]
    """Dorsiflexion, degrees."""
    obliquity: Callable[[Array], Array]
    """Rise of the pelvis on the side of the leg, degrees."""
    rotation: Callable[[Array], Array]
    """Forward rotation of the pelvis on that side, degrees."""


WALKING = GaitCurves(
    0.62,
    0.022,
    0.3,
    lambda p: curve(WALK["hip"], p) - curve(WALK["tilt"], p),
    lambda p: curve(WALK["knee"], p) + KNEE_ZERO,
    lambda p: curve(WALK["ankle"], p) + 0.5 * KNEE_ZERO,
    lambda p: curve(WALK["obliquity"], p),
    lambda p: curve(WALK["rotation"], p),
)
JOGGING = GaitCurves(
    0.38,
    0.045,
    6.0,
    lambda p: curve(RUN["hip"], p) - 3.0,
    lambda p: curve(RUN["knee"], p),
    lambda p: curve(RUN["ankle"], p),
    lambda p: 4.0 * np.cos(2 * np.pi * (p - 0.15)),
    lambda p: 5.0 * np.cos(2 * np.pi * (p - 0.03)),
)
"""Jogging: the pelvis' small motions in the frontal and horizontal plane by the sizes of Novacheck (1998, fig. 4)."""
assert STANDING_TILT == 10.0  # WALKING.bow is relative to it: 10.3 on average


def stride_length(speed: float, leg: float, jogging: bool) -> float:
    """Length (m) of a stride at `speed` (m/s) of a person whose hips are `leg` (m) high.

    Walking: it grows with the root of the speed (Inman 1981) and is 1.2 hip heights at one hip height per second, so that the angles of
    `WALK` fit at the speed at which they were measured; bodies of other sizes move alike at equal Froude number. Jogging: 2.3 hip
    heights times the Froude number to the power of 0.3 (Alexander 1989).
    """
    if jogging:
        return 2.3 * leg * (speed**2 / (GRAVITY * leg)) ** 0.3
    return 1.2 * leg * (speed / np.sqrt(0.9 * leg)) ** 0.5


class GaitCycle:
    """A gait of a body at a speed (m/s)."""

    def __init__(self, body: Mannequin, gait: GaitCurves, speed: float, stride: float) -> None:
        """stride: its length, metres."""
        self.body, self.gait, self.speed, self.stride = body, gait, speed, stride
        self.sole = Sole.of(body)
        self.leg = body.length("thigh") + body.length("shank")
        self.amplitude = self._amplitude()
        phase = np.arange(CYCLE_SAMPLES) / CYCLE_SAMPLES
        thigh, shank, pitch = self._angles(phase, self.amplitude)
        base, drop = self._foot(phase, thigh, shank, pitch)
        carried = phase <= gait.carries
        self.lead = float(base[carried].mean())
        """Distance of a foot in front of the pelvis at contact, metres."""
        self.middle = self.lead / stride
        """Phase at which the foot is below the pelvis."""
        self.height = _harmonics(phase, drop + self.sole.rolled(pitch)[1], np.where(phase < 0.8 * gait.carries, 1.0, 0.02) * carried)
        self._pitch = _periodic(pitch + self._more_pitch(phase, pitch))
        swing = np.linspace(gait.carries, 1, 60)
        self._progress, self._lift = self._swing(swing)

    def pitch(self, phase: Array) -> Array:
        """Pitch of the foot, rad, toes up, at phases of its leg."""
        return self._pitch(phase % 1)

    def progress(self, phase: Array) -> Array:
        """Progress of the foot to its next footprint, 0 to 1; 0 in stance."""
        return np.where(phase % 1 > self.gait.carries, self._progress(np.maximum(phase % 1, self.gait.carries)), 0.0)

    def lift(self, phase: Array) -> Array:
        """Lift of the foot beyond the lift by its pitch, metres."""
        return np.where(phase % 1 > self.gait.carries, self._lift(np.maximum(phase % 1, self.gait.carries)), 0.0)

    def _angles(self, phase: Array, amplitude: float) -> tuple[Array, Array, Array]:
        """Angles of thigh and shank forward of the vertical, and pitch of the foot, rad; swing: `amplitude` times the published one."""
        whole = np.arange(CYCLE_SAMPLES) / CYCLE_SAMPLES
        mean, more = self.gait.thigh(whole).mean(), np.sqrt(amplitude)
        least = self.gait.knee(whole).min()
        thigh = np.radians(mean + amplitude * (self.gait.thigh(phase) - mean))
        shank = thigh - np.radians(least + more * (self.gait.knee(phase) - least))
        pitch = shank + np.radians(more * self.gait.ankle(phase))
        return thigh, shank, pitch * np.abs(pitch) / (np.abs(pitch) + FLAT_PITCH)

    def _foot(self, phase: Array, thigh: Array, shank: Array, pitch: Array) -> tuple[Array, Array]:
        """Place of the flat foot's ankle along the path, and depth of the ankle below the pelvis, metres."""
        long, short, half = self.body.length("thigh"), self.body.length("shank"), self.body.rest()["left_hip"][0]
        turned, raised = np.radians(self.gait.rotation(phase)), np.radians(self.gait.obliquity(phase))
        ahead = long * np.sin(thigh) + short * np.sin(shank) + half * np.sin(turned)
        drop = long * np.cos(thigh) + short * np.cos(shank) - half * np.sin(raised)
        return self.stride * phase + ahead - self.sole.rolled(pitch)[0], drop

    def _amplitude(self) -> float:
        """Factor on the leg's swing at which a foot in stance stays in place at this speed."""
        from scipy.optimize import brentq

        phase = np.linspace(0.02, self.gait.carries - 0.02, 80)

        def slope(amplitude: float) -> float:
            return float(np.polyfit(phase, self._foot(phase, *self._angles(phase, amplitude))[0], 1)[0])

        low, high = 0.2, 2.2
        if slope(low) < 0 or slope(high) > 0:
            return low if slope(low) < 0 else high
        return float(brentq(slope, low, high, xtol=1e-4))  # pyright: ignore[reportArgumentType]

    def _more_pitch(self, phase: Array, pitch: Array) -> Array:
        """Additional rise of the heel late in stance, rad, with which the knee bends as published over a foot that does not slip.

        Without it, small errors of the published angles would stretch or bend the knee far more.
        """
        from scipy.ndimage import gaussian_filter1d

        long, short, half = self.body.length("thigh"), self.body.length("shank"), self.body.rest()["left_hip"][0]
        knee = self._angles(phase, self.amplitude)[:2]
        wanted = np.sqrt(long**2 + short**2 + 2 * long * short * np.cos(knee[0] - knee[1]))
        turned, raised = np.radians(self.gait.rotation(phase)), np.radians(self.gait.obliquity(phase))
        tries = np.radians(np.arange(-10.0, 31.0, 0.5))
        forward, up = self.sole.rolled(pitch[:, None] - tries)
        ahead = (self.lead - self.stride * phase - half * np.sin(turned))[:, None] + forward
        down = (self.height(phase) + half * np.sin(raised))[:, None] - up
        off = np.abs(np.hypot(ahead, down) - wanted[:, None]) + 0.03 * tries**2
        late = (phase > 0.55 * self.gait.carries) & (phase <= self.gait.carries)
        more = np.where(late, tries[off.argmin(1)], 0.0)
        last = int(np.flatnonzero(late)[-1])
        after = np.arange(last + 1, CYCLE_SAMPLES)
        more[after] = more[last] * (1 - smoothstep((phase[after] - phase[last]) / 0.25))
        return -gaussian_filter1d(more, 0.02 * CYCLE_SAMPLES, mode="wrap")

    def _swing(self, phase: Array) -> tuple[Callable, Callable]:
        """`progress` and `lift` from toe-off to contact: as published, without jerks at the ends."""
        from scipy.interpolate import CubicSpline

        thigh, shank, pitch = self._angles(phase, self.amplitude)
        pitch = self._pitch(phase)
        base, drop = self._foot(phase, thigh, shank, pitch)
        forward = (base - self.lead) / self.stride
        up = self.height(phase) - drop - self.sole.rolled(pitch)[1]
        part = (phase - self.gait.carries) / (1 - self.gait.carries)
        clear = self.gait.clears * self.leg * 4 * part * (1 - part)
        progress, lift = forward - _ends(phase, forward, (0, 1)), np.hypot(np.maximum(up - _ends(phase, up), 0), clear)
        return CubicSpline(phase, progress, bc_type="clamped"), CubicSpline(phase, lift)


def smoothstep(x: Array) -> Array:
    """From 0 to 1 as x goes from 0 to 1, with continuous speed and acceleration (a quintic)."""
    x = np.clip(x, 0, 1)
    return x**3 * (10 - 15 * x + 6 * x * x)


def _ends(x: Array, y: Array, wanted: tuple[float, float] = (0, 0)) -> Array:
    """The cubic to subtract from `y` (n,) at `x` (n,) for `wanted` values and zero slopes at the ends."""
    from scipy.interpolate import CubicHermiteSpline

    return CubicHermiteSpline(x[[0, -1]], y[[0, -1]] - wanted, np.gradient(y, x)[[0, -1]])(x)


def _periodic(values: Array) -> Callable:
    """A periodic cubic through values (n,) at 0, 1/n, ..."""
    from scipy.interpolate import CubicSpline

    return CubicSpline(np.linspace(0, 1, len(values) + 1), np.append(values, values[0]), bc_type="periodic")


def _harmonics(phase: Array, wanted: Array, weight: Array) -> Callable[[Array], Array]:
    """Weighted fit of `wanted` for both legs, half a cycle apart: mean and first two harmonics of a step."""

    def waves(p: Array) -> Array:
        return np.stack([np.ones_like(p), *(f(4 * np.pi * k * p) for k in (1, 2) for f in (np.cos, np.sin))], -1)

    basis = waves(phase)
    ridge = np.diag([0, 0, 0, 1, 1]) * 0.05 * weight.sum()
    weights = np.linalg.solve(basis.T @ (weight[:, None] * basis) + ridge, basis.T @ (weight * wanted))
    return lambda p: waves(np.asarray(p, float)) @ weights
