"""Arm, hand and leg of the left side as lofts with the measured girths; the right side is mirrored."""

from __future__ import annotations

from typing import Any

import numpy as np

from shadowpuppet.geometry import Array
from shadowpuppet.synthetic.person.clothes import Clothes
from shadowpuppet.synthetic.person.mannequin import KNUCKLES, Mannequin
from shadowpuppet.synthetic.person.surface import Loft, Sections, frame_of, stations_of

DOWN = np.diag([1.0, 1.0, -1.0])
ALONG_X = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""Loft frames. Along x, the left arm's: width forward (the thumb's side), depth down (the palm's)."""
FORWARD = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, -1.0, 0.0]])


def arm(body: Mannequin, clothes: Clothes) -> list[Loft]:
    """The left arm along +x: deltoid to elbow, forearm, hand."""
    upper, fore, hand = (body.length(name) for name in ("upper_arm", "forearm", "hand"))
    biceps, belly, wrist = (body.measure(name) / (2 * np.pi) for name in ("biceps", "forearm", "wrist"))
    elbow, end = 0.45 * (biceps + belly), clothes.sleeve * (upper + fore)
    cloth = 0.0056 + 0.52 * min(clothes.looseness, 0.02)
    sleeved: dict[str, Any] = {"materials": ("shirt", "skin"), "group": "left_arm"}
    rows: Sections = [
        (0, 1.06 * biceps, 1.10 * biceps, 0, -0.010),
        (0.25, 1.05 * biceps, 1.06 * biceps, 0, -0.006),
        (0.5, biceps, biceps, 0.006),
        (0.8, 0.90 * biceps, 0.86 * biceps, 0.003),
        (1, elbow, 0.92 * elbow),
    ]
    parts = [
        Loft("left_upper_arm", np.zeros(3), ALONG_X, _sleeved(stations_of(rows, upper), end, cloth), (0.85 * biceps, 0.9 * elbow), 0.02,
             change=end, **sleeved)
    ]
    rows = [
        (0, elbow, 0.94 * elbow),
        (0.22, 1.04 * belly, 0.97 * belly, 0.004),
        (0.5, 0.90 * belly, 0.86 * belly, 0.002),
        (0.8, 1.18 * wrist, 1.0 * wrist),
        (1, 1.14 * wrist, 0.84 * wrist),
    ]
    parts.append(
        Loft("left_forearm", np.zeros(3), ALONG_X, _sleeved(stations_of(rows, fore), end - upper, cloth), (0.9 * elbow, 0.02), 0.025,
             change=end - upper, **sleeved)
    )
    return parts + _hand(hand, body.measure("hand_breadth") / 2, wrist)


def _sleeved(stations: Array, end: float, cloth: float) -> Array:
    """A limb's stations with `cloth` (m) over them as far as `end` (m)."""
    from scipy.interpolate import PchipInterpolator

    along = np.linspace(0, stations[-1, 0], 25)
    table = np.column_stack([along, PchipInterpolator(stations[:, 0], stations[:, 1:])(along)])
    table[:, 1:3] += cloth / (1 + np.exp((along[:, None] - end) / 0.004))
    return table


def _hand(length: float, half: float, wrist: float) -> list[Loft]:
    """Palm, fingers a little spread and bent, thumb; the palm looks down in the T-pose (fingers after Garrett 1971)."""
    thick, group = 0.31 * half, "left_arm"
    rows: Sections = [
        (0, 1.05 * wrist, 0.80 * wrist),
        (0.2 * length, 0.78 * half, 1.12 * thick, 0, 0.002),
        (0.42 * length, half, thick, 0, 0.001),
        (0.50 * length, 0.97 * half, 0.80 * thick),
    ]
    parts = [Loft("left_hand", np.zeros(3), ALONG_X, stations_of(rows), (0.02, 0.012), 0.02, group=group)]
    digits = [
        ((0.47 * length, -place * half, 0.0), (np.cos(spread), -np.sin(spread), -0.12), extent, 0.21 * half)
        for place, extent, spread in ((0.72, 0.42, 0.14), (0.24, 0.47, 0.04), (-0.25, 0.44, -0.05), (-0.70, 0.35, -0.16))
    ]
    digits.append(((0.14 * length, -0.50 * half, -0.006), (0.72, -0.62, -0.30), 0.40, 0.27 * half))
    for n, (root, axis, extent, r) in enumerate(digits):
        finger, knuckle = n < 4, np.array([KNUCKLES * length, 0, 0])
        reach, unit = extent * length, np.array(axis) / np.linalg.norm(axis)
        rows = [(0, 1.05 * r, r), (0.5, 0.92 * r, 0.86 * r, 0, 0.02 * reach), (1, 0.72 * r, 0.63 * r, 0, 0.10 * reach)]
        parts.append(
            Loft("left_fingers" if finger else "left_hand", np.array(root) - knuckle if finger else np.array(root),
                 frame_of(unit, np.array([0, 0, -1.0])), stations_of(rows, reach), (0.3 * r, 0.63 * r), 0.008, group=group)
        )
    return parts


def leg(body: Mannequin, clothes: Clothes) -> list[Loft]:
    """Thigh, shank and shoe of the left leg, in trousers."""
    thigh, knee, calf, ankle = (body.measure(name) / (2 * np.pi) for name in ("thigh", "knee", "calf", "ankle"))
    cloth, upper, lower = [0, *2 * [clothes.looseness + 0.004], 0, 0], body.length("thigh"), body.length("shank")
    rows: Sections = [
        (-0.06, 0.72 * thigh, 0.76 * thigh, -0.012, 0.004),
        (0.06, 0.92 * thigh, 0.95 * thigh, -0.010, 0.004),
        (0.2, 0.96 * thigh, 0.99 * thigh, -0.006),
        (0.5, 0.84 * thigh, 0.88 * thigh, 0.0, -0.006),
        (0.85, 1.04 * knee, 1.08 * knee, 0.0, -0.004),
        (1, 0.93 * knee, 0.97 * knee),
    ]
    trousers: dict[str, Any] = {"materials": ("trousers", "trousers"), "group": "left_leg"}
    parts = [Loft("left_thigh", np.array([0, 0, 0.06 * upper]), DOWN, stations_of(rows, upper) + cloth, (0.06, 0.05), 0.03, **trousers)]
    rows = [
        (0, 0.93 * knee, 0.97 * knee),
        (0.10, 0.97 * knee, knee, 0, 0.006),
        (0.28, calf, 1.02 * calf, 0.002, 0.018),
        (0.6, 0.72 * calf, 0.75 * calf, 0, 0.010),
        (0.9, 1.02 * ankle, 1.1 * ankle),
        (1, ankle, 1.1 * ankle),
    ]
    parts.append(Loft("left_shank", np.zeros(3), DOWN, stations_of(rows, lower) + cloth, (0.05, 0.02), 0.03, **trousers))
    return [*parts, *_foot(body)]


HEEL = 0.17
"""Where the shoe's axis begins behind the ankle, share of the foot's length; with its rounded end the heel's rear is some 60 mm behind. The
bare heel's is 49 mm behind (Delp et al. 1990, as OpenSim's gait2392 has it for 1.8 m)."""


def _foot(body: Mannequin) -> list[Loft]:
    """The left shoe, of some 10 mm over the foot; its sole is flat from heel to ball, 2 mm over the floor, and it bends at the ball."""
    long, broad = body.measure("foot_length"), body.measure("foot_breadth") / 2
    rows: Sections = [
        (0, 0.66 * broad, 0.034, 0, -0.006),
        (0.17, 0.70 * broad, 0.042, 0, -0.014),
        (0.27, 0.76 * broad, 0.045, 0, -0.017),
        (0.69, broad, 0.027, 0, 0.001),
        (0.905, 0.70 * broad, 0.018, 0, 0.008),
    ]
    whole = _sleeved(stations_of(rows, long), 0.0, 0.0)
    heel = np.array([0, HEEL * long, 0.030 - body.length("ankle")])
    bend = int(np.searchsorted(whole[:, 0], HEEL * long - body.ball()[1]))
    toes = whole[bend - 1 :] - [whole[bend - 1, 0], 0, 0, 0, 0]
    tip = heel - [0, whole[bend - 1, 0], 0] - body.ball()
    shoe: dict[str, Any] = {"materials": ("shoes", "shoes"), "group": "left_leg"}
    return [
        Loft("left_foot", heel, FORWARD, whole[: bend + 1], (0.014, 0.012), 0.03, **shoe),
        Loft("left_toes", tip, FORWARD, toes, (0.012, 0.02), 0.008, **shoe),
    ]
