"""The kinds of picture faults, each a function and a row of `KINDS`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal, NamedTuple

import numpy as np

from shadowpuppet.geometry import Array

FaultName = Literal[
    "gain", "white_balance", "flicker", "lamp", "sun", "vignetting", "defocus", "black", "motion_blur", "noise", "crf",
    "nudge", "shake", "frozen", "dropped", "repeated", "late", "absent",
]  # fmt: skip
LAMP_REACH = 0.35
"""Radius of the patch that a switched lamp lights, a Gaussian's standard deviation, over the picture's width."""
SUN_SIZE, SUN_BLUR, SUN_WAY = (0.1, 0.14), 0.008, (0.1, 0.2)
"""Half the width and the height of the sun's patch, the blur of its border, and the place of its middle with how far it wanders, over the
picture's width."""
SHAKE_SECONDS = 0.12
"""Smoothness of a shaking tripod's movement: standard deviation of the Gaussian that filters white noise, seconds."""


class LightMoment(NamedTuple):
    """Circumstances of a fault of light, besides its amount."""

    share: float
    """Share of the fault that is there, over 0 to 1: less than 1 while it builds up."""
    seconds: float
    """Seconds after the film's first frame; negative in the film of the empty scene."""
    hz: float
    """Frequency of flicker, Hz."""
    chance: Array
    """Numbers drawn once for the fault and camera, of shape (4,), each 0 to 1."""


# Faults of light: of a picture (H, W, 3), RGB, 0 to 1, an amount and a moment, a picture. Sensor noise comes after them, and clipping.


def gain(light: Array, amount: float, now: LightMoment) -> Array:
    """Exposure, times the amount."""
    return light * amount**now.share


def white_balance(light: Array, amount: float, now: LightMoment) -> Array:
    """Red times the amount, blue divided by it."""
    factor = amount**now.share
    return light * np.array([factor, 1.0, 1 / factor])


def flicker(light: Array, amount: float, now: LightMoment) -> Array:
    """Brightness that swings by the amount, relative."""
    return light * (1 + amount * now.share * np.sin(2 * np.pi * now.hz * now.seconds))


def lamp(light: Array, amount: float, now: LightMoment) -> Array:
    """A lamp that is switched, at the left or the right: the light there times the amount, less and less away from it."""
    height, width = light.shape[:2]
    centre = np.array([(0.15 if now.chance[0] < 0.5 else 0.85) * width, (0.2 + 0.4 * now.chance[1]) * height])
    away = np.hypot(*(np.meshgrid(np.arange(width) - centre[0], np.arange(height) - centre[1]))) / (LAMP_REACH * width)
    return light * (1 + (amount - 1) * now.share * np.exp(-(away**2) / 2))[..., None]


def sun(light: Array, amount: float, now: LightMoment) -> Array:
    """The sun through a window, at the left or the right: the light in an upright patch on the wall times the amount. With `drift` it comes
    within the first tenth of the time, and wanders inward."""
    height, width = light.shape[:2]
    x, y = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / width)
    across = np.abs((x if now.chance[0] < 0.5 else 1 - x) - SUN_WAY[0] - SUN_WAY[1] * now.share) - SUN_SIZE[0]
    down = np.abs(y - (0.25 + 0.2 * now.chance[1]) * height / width) - SUN_SIZE[1]
    there = min(10 * now.share, 1.0) / (1 + np.exp(np.maximum(across, down) / SUN_BLUR))
    return light * (1 + (amount - 1) * there)[..., None]


def vignetting(light: Array, amount: float, now: LightMoment) -> Array:
    """Light that falls off from the centre with the square of the distance; at the corners the amount is missing."""
    height, width = light.shape[:2]
    across, down = np.meshgrid(np.linspace(-1, 1, width) * width, np.linspace(-1, 1, height) * height)
    return light * (1 - amount * now.share * (across**2 + down**2) / (width**2 + height**2))[..., None]


def defocus(light: Array, amount: float, now: LightMoment) -> Array:
    """Gaussian blur; the amount is its standard deviation, pixels."""
    import cv2

    return np.asarray(cv2.GaussianBlur(light, (0, 0), amount * now.share), float)


def black(light: Array, _: float, now: LightMoment) -> Array:
    """No light."""
    return light * (1 - now.share)


# Faults of the tripod: of the number of frames, frames per second and a generator, the directions (T, 2) and turns (T,) by frame of a
# movement; lengths are at most 1, and are multiplied by the fault's amount and roll.


def nudge(count: int, _: float, __: np.random.Generator) -> tuple[Array, Array]:
    """The same for all frames, to the right and clockwise; the fault turns the direction."""
    return np.tile([1.0, 0.0], (count, 1)), np.ones(count)


def shake(count: int, rate: float, rng: np.random.Generator) -> tuple[Array, Array]:
    """Smooth random movement; its farthest place has length 1."""
    reach = int(np.ceil(4 * SHAKE_SECONDS * rate))
    window = np.exp(-0.5 * (np.arange(-reach, reach + 1) / (SHAKE_SECONDS * rate)) ** 2)
    moves = np.stack([np.convolve(noise, window, "valid") for noise in rng.standard_normal((3, count + 2 * reach))], 1)
    return moves[:, :2] / np.hypot(*moves[:, :2].T).max(), moves[:, 2] / np.abs(moves[:, 2]).max()


# Faults of timing: of the list that says which frame of the world each frame of the film shows, the first frame with the fault and the
# first without, the amount and a generator, such a list.


def frozen(sources: Sequence[int], first: int, last: int, _: float, __: np.random.Generator) -> list[int]:
    """The same picture all the time."""
    return [*sources[:first], *[sources[first]] * (last - first), *sources[last:]]


def dropped(sources: Sequence[int], first: int, last: int, amount: float, rng: np.random.Generator) -> list[int]:
    """Frames missing in the file, the amount being their share; later ones move up."""
    missing = rng.random(last - first) < amount
    return [*sources[:first], *(one for one, gone in zip(sources[first:last], missing) if not gone), *sources[last:]]


def repeated(sources: Sequence[int], first: int, last: int, amount: float, _: np.random.Generator) -> list[int]:
    """Each picture shown in place of the following ones, an amount of times in all."""
    return [source if not first <= n < last else sources[n - (n - first) % round(amount)] for n, source in enumerate(sources)]


def late(sources: Sequence[int], first: int, last: int, amount: float, _: np.random.Generator) -> list[int]:
    """Pictures that come an amount of frames later."""
    return [source if not first <= n < last else sources[max(n - round(amount), 0)] for n, source in enumerate(sources)]


LightFault = Callable[[Array, float, LightMoment], Array]
Displacement = Callable[[int, float, np.random.Generator], tuple[Array, Array]]
TimingFault = Callable[[Sequence[int], int, int, float, np.random.Generator], list[int]]


class FaultKind(NamedTuple):
    """A kind of fault: its amount, and where it acts."""

    unit: str
    """Meaning of the amount; empty if the kind has none."""
    default: float = 1.0
    least: float = 1.0
    most: float = 1.0
    light: LightFault | None = None
    displacement: Displacement | None = None
    timing: TimingFault | None = None
    whole: bool = False
    """Whether the amount is a whole number."""
    everywhere: bool = False
    """Whether all cameras have it."""

    @property
    def gradual(self) -> bool:
        """Whether it can build up slowly."""
        return self.timing is None and self.unit not in ("", CRF)

    @property
    def in_empty_scene(self) -> bool:
        """Whether it can be in the film of the empty scene as well."""
        return self.displacement is None and self.timing is None and self.unit not in ("", FRAMES_AVERAGED)


CRF, FRAMES_AVERAGED = "H.264's constant rate factor", "number of pictures averaged"
KINDS: dict[str, FaultKind] = {
    "gain": FaultKind("factor on the light", 1.3, 0.1, 10, light=gain),
    "white_balance": FaultKind("factor on red and divisor of blue", 1.2, 0.3, 3, light=white_balance),
    "flicker": FaultKind("relative amplitude", 0.05, 0, 0.5, light=flicker),
    "lamp": FaultKind("factor on the light beside the lamp", 1.5, 0.1, 5, light=lamp),
    "sun": FaultKind("factor on the light in a patch of sun", 1.3, 0.1, 5, light=sun),
    "vignetting": FaultKind("share of light missing at the corners", 0.3, 0, 0.9, light=vignetting),
    "defocus": FaultKind("standard deviation of the blur, pixels", 1.5, 0.3, 20, light=defocus),
    "black": FaultKind("", light=black),
    "motion_blur": FaultKind(FRAMES_AVERAGED, 2, 2, 30, whole=True),
    "noise": FaultKind("standard deviation of further noise, grey levels at middle grey", 10, 0, 100),
    "crf": FaultKind(CRF, 28, 0, 51, whole=True),
    "nudge": FaultKind("pixels", 10, 0, 200, displacement=nudge),
    "shake": FaultKind("greatest displacement, pixels", 3, 0, 100, displacement=shake),
    "frozen": FaultKind("", timing=frozen),
    "dropped": FaultKind("share of frames missing", 0.1, 0, 1, timing=dropped),
    "repeated": FaultKind("times that each picture is shown", 2, 2, 1000, timing=repeated, whole=True),
    "late": FaultKind("frames", 5, 1, 1000, timing=late, whole=True),
    "absent": FaultKind("", everywhere=True),
}
"""All kinds by name. Those without a function are `camera_faults.CameraFaults`' own: they change how pictures become a film, or remove the
person."""
