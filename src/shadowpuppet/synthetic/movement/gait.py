"""Walking and jogging along a path: footprints on which the feet stay, and the published gait cycle (`gait_cycle.py`) between them.

Arms swing opposite to the legs: by some 30 degrees with nearly straight elbows in walking (Murray et al. 1967), with elbows near a right
angle in jogging (Yegian et al. 2019). Strides vary by some 2 % (Hausdorff 2005).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from shadowpuppet.geometry import Array
from shadowpuppet.synthetic.movement.gait_cycle import GRAVITY, JOGGING, WALKING, GaitCycle, smoothstep, stride_length
from shadowpuppet.synthetic.movement.gestures import STANDING, band_noise
from shadowpuppet.synthetic.movement.paths import Path, PathName
from shadowpuppet.synthetic.person.kinematics import CHANNELS, SIDES, TOE_OUT, LegPlacement, rotations
from shadowpuppet.synthetic.person.mannequin import Mannequin

CLOCK_STEP = 0.002
"""Step of the integration of speed and cadence, seconds."""
TRACK_HALF_WIDTH = {False: 0.055, True: 0.03}
"""Half the distance between the feet's tracks, leg lengths: walking (False) and jogging (True)."""
MAX_LEAN = np.radians(13)
"""Greatest lean into a turn, rad; small leans balance weight and centrifugal force."""
COMFORTABLE_SPEED = {False: 1.35, True: 2.6}
"""Comfortable speeds of an adult, m/s: walking (False) and jogging (True). Bodies of other sizes: the same Froude number."""
HEEL_RISE_PHASE, FLAT_PHASE = 0.3, 0.22
"""Phases of the leg at which the heel begins to rise and the foot lies flat again."""


class Footprints(NamedTuple):
    """Footprints of one foot in order, from stride `first` of its leg on."""

    first: int
    along: Array
    """Place along the path, metres."""
    aside: Array
    """Place to the left of the path, metres."""
    size: Array
    """Size of the following step, 0 (none) to 1 (full)."""


class PathWalk:
    """A walk or jog along a path, which begins and ends in standing."""

    def __init__(self, body: Mannequin, seconds: float, rng: np.random.Generator, jogging: bool = False, speed: float | None = None,
                 path: PathName = "circle", size: float = 1.2) -> None:
        """speed: m/s, by default a comfortable one; path, size: see `Path`."""
        hip = body.rest()["pelvis"][2]
        if speed is None:
            speed = float(COMFORTABLE_SPEED[jogging] * np.sqrt(hip / 0.93) * np.clip(1 + 0.04 * rng.standard_normal(), 0.9, 1.1))
        self.body, self.jogging, self.speed, self.seconds = body, jogging, speed, seconds
        self.cycle = GaitCycle(body, JOGGING if jogging else WALKING, speed, stride_length(speed, hip, jogging))
        self.path = Path(path, size, speed * seconds * 1.15)
        self.arms = rng.uniform(0.85, 1.2)
        self._clock(rng)
        self.prints = [self._prints(n, rng) for n in (0, 1)]

    def _clock(self, rng: np.random.Generator) -> None:
        """Set, at every tick: phase of the left leg, distance covered, fraction of full gait (0 to 1) and inward lean."""
        from scipy.ndimage import gaussian_filter1d

        self.ticks = np.arange(-1.0, self.seconds + 1.0 + CLOCK_STEP, CLOCK_STEP)
        period = self.cycle.stride / self.speed
        stops = self.seconds - 0.8 * period  # after it the feet come to stand side by side
        ramp = min(1.7 * period, 0.45 * stops)
        starts = smoothstep(self.ticks / ramp)
        self.fully = starts * smoothstep((self.seconds - self.ticks) / (ramp + 0.5 * period))
        cadence = (1 + 0.012 * band_noise(self.ticks, 0.4, rng)) / period
        self.phase = 0.5 + np.cumsum(cadence * CLOCK_STEP) - np.sum(cadence[self.ticks < 0] * CLOCK_STEP)
        slow = 1 / (1 + 0.2 * self.path.bend**2 * (self.cycle.leg / 0.86) ** 2)
        due = np.concatenate([[0], np.cumsum(np.diff(self.path.samples) / slow[1:])])
        short = min(1.0, stops / (3.0 * period))  # a walk of one or two steps does not reach full speed
        pace = short * self.speed * starts * smoothstep((stops - self.ticks) / ramp) * (1 + 0.015 * band_noise(self.ticks, 0.3, rng))
        self.gone = np.interp(np.cumsum(pace) * CLOCK_STEP, due, self.path.samples)
        quick = np.gradient(self.gone, CLOCK_STEP)
        pull = quick**2 * np.interp(self.gone, self.path.samples, self.path.bend) / GRAVITY
        self.lean = gaussian_filter1d(MAX_LEAN * np.tanh(pull / MAX_LEAN), 0.15 / CLOCK_STEP)

    def _prints(self, side: int, rng: np.random.Generator) -> Footprints:
        phase = self.phase - 0.5 * side
        strides = np.arange(np.floor(phase[0]) - 1, np.ceil(phase[-1]) + 2)
        along = np.interp(strides + self.cycle.middle, phase, self.gone)
        first, last = np.interp([0.0, self.seconds], self.ticks, phase)
        before, after = strides - 1 + HEEL_RISE_PHASE < first, strides >= np.floor(last - FLAT_PHASE)
        along = np.where(before, 0.0, np.where(after, self.gone[-1], along))
        goes = ~(before | after)
        sign = 1 - 2 * side
        width = np.where(goes, TRACK_HALF_WIDTH[self.jogging], 0.13) * self.cycle.leg * sign
        jitter = 0.012 * np.clip(rng.standard_normal((2, len(strides))), -2, 2) * np.where(goes, self.cycle.leg, 0)
        along, aside = along + jitter[0], width + jitter[1]
        size = np.minimum(np.hypot(np.diff(along, append=along[-1]), np.diff(aside, append=aside[-1])) / (0.5 * self.cycle.stride), 1)
        return Footprints(int(strides[0]), along, aside, size**0.7)

    def at(self, t: Array) -> tuple[Array, LegPlacement]:
        """Postures (T, `CHANNELS`) and stance at times `t` (T,), s, from the origin facing -Y."""
        phase, gone, fully, lean = (np.interp(t, self.ticks, values) for values in (self.phase, self.gone, self.fully, self.lean))
        feet = [self._foot(n, phase - 0.5 * n) for n in (0, 1)]
        heading = self.path.heading(gone)
        shift = np.column_stack([self.path.place(gone, 0 * gone), 0 * t]) if self.path.still else np.zeros(3)
        aside = (0.012 if self.jogging else 0.022) * self.cycle.leg * fully * np.cos(2 * np.pi * (phase - self.cycle.middle - 0.08))
        top = self.cycle.leg + self.body.length("ankle") + 0.02
        height = top + fully * (self.cycle.height(phase) - top)
        inward = np.sin(lean) * (height - self.cycle.sole.ankle)
        pelvis = np.column_stack([self.path.place(gone, aside + inward), height * np.cos(lean)])
        ankles, frames, toes = (np.stack(part, 1) for part in zip(*feet))
        around = rotations(0 * heading, 0 * heading, heading)
        ahead = frames @ np.array([0.0, -1.0, 0.0]) + (around @ np.array([0.0, -1.0, 0.0]))[:, None]
        ahead[..., 2] = 0
        postures = self._postures(t, phase, fully)
        postures[:, CHANNELS.index("turn")] = heading
        postures[:, CHANNELS.index("pelvis_side")] += lean
        postures[:, CHANNELS.index("head_tilt")] -= 0.6 * lean
        return postures, LegPlacement(pelvis - shift, ankles - np.reshape(shift, (-1, 1, 3)), frames, toes, ahead)

    def _foot(self, side: int, phase: Array) -> tuple[Array, Array, Array]:
        """Ankle (T, 3), frame of the foot (T, 3, 3) and bend of its toes (T,) at phases of its leg."""
        prints, stride = self.prints[side], np.floor(phase).astype(int)
        part, k = phase - stride, stride - prints.first
        swings, out = part > self.cycle.gait.carries, TOE_OUT * (1 - 2 * side)
        gone = self.cycle.progress(part)
        along = prints.along[k] + gone * (prints.along[k + 1] - prints.along[k])
        aside = prints.aside[k] + gone * (prints.aside[k + 1] - prints.aside[k])
        pitch = self.cycle.pitch(part)
        pitch = pitch * np.where((pitch < 0) | swings, prints.size[k], prints.size[k - 1])
        spent = smoothstep((part - self.cycle.gait.carries) / (0.6 * (1 - self.cycle.gait.carries)))
        toes = np.clip(-pitch * (1 - 0.4 * spent), 0, 1.0)
        hangs = 0.25 * self.body.measure("foot_length") * np.sin(np.clip(-pitch - toes, 0, None))
        forward, up = self.cycle.sole.rolled(pitch)
        turn = self.path.heading(along) + out
        place = self.path.place(along, aside) + forward[:, None] * np.column_stack([np.sin(turn), -np.cos(turn)])
        frame = rotations(0 * turn, 0 * turn, turn) @ rotations(-pitch, 0 * pitch, 0 * pitch)
        return np.column_stack([place, up + hangs + self.cycle.lift(part) * prints.size[k]]), frame, toes

    def _postures(self, t: Array, phase: Array, fully: Array) -> Array:
        """Postures of pelvis, trunk, arms and head, blended from standing to full gait by `fully`."""
        gait, of = self.cycle.gait, {name: n for n, name in enumerate(CHANNELS)}
        right_phase, wide = phase - 0.5, np.clip(self.cycle.amplitude, 0.6, 1.3)
        tilt, turn = (np.radians(wide * angle(right_phase)) for angle in (gait.obliquity, gait.rotation))
        lean = np.radians(4.0 if self.jogging else 1.5)
        table = np.zeros((len(t), len(CHANNELS)))
        rest = table.copy()
        for name, value in STANDING.items():
            rest[:, of[name]] = value
        values = {"pelvis_bow": np.radians(gait.bow) + 0 * t, "pelvis_side": tilt, "pelvis_twist": turn,
                  "spine_bow": lean + np.radians(1.0) * np.cos(4 * np.pi * phase), "spine_side": -0.85 * tilt,
                  "spine_twist": -(1.9 if self.jogging else 1.7) * turn, "head_turn": 0.75 * turn,
                  "head_nod": -0.8 * lean - 0.5 * np.radians(gait.bow) + 0 * t}
        for n, side in enumerate(SIDES):
            values |= {f"{side}_{name}": value for name, value in self._arm(phase - 0.5 * n).items()}
        for name, value in values.items():
            table[:, of[name]] = value
        return rest + fully[:, None] * (table - rest)

    def _arm(self, phase: Array) -> dict[str, Array]:
        """Channels of the arm on the side of a leg with this phase; it swings back when the leg is forward."""
        swing = -np.cos(2 * np.pi * (phase - 0.02))  # -1 backward, 1 forward
        bend = 0.5 - 0.5 * np.cos(2 * np.pi * (phase - 0.1))
        if self.jogging:
            amplitude = 26 * self.arms * np.clip(self.speed / 2.6, 0.7, 1.4)
            degrees = {"front": -14 + amplitude * swing, "elbow": 80 + 24 * bend, "side": 15 - 2 * swing, "roll": -10 - 8 * bend,
                       "supination": 25, "curl": 45, "wrist_flex": 5}  # fmt: skip
        else:
            amplitude = 15 * self.arms * np.clip(self.speed / 1.3, 0.3, 1.6)
            degrees = {"front": -3 + amplitude * swing, "elbow": 14 + amplitude * bend, "side": 8, "roll": -6 - 6 * bend,
                       "supination": 8, "curl": 22, "wrist_flex": 4}  # fmt: skip
        return {name: np.radians(value) + 0 * phase for name, value in degrees.items()}

