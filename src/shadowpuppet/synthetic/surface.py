"""The mannequin's skin and clothes: lofts of elliptic cross-sections along the segments, later blended by the renderer.

A loft is a tube about a straight axis whose half width, half depth and centre change smoothly along it, with rounded caps:
limbs taper, swell and lie off their bones. Cross-sections follow the measures of `mannequin.MEASURES`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from shadowpuppet.geometry import Array
from shadowpuppet.synthetic.kinematics import SEGMENTS
from shadowpuppet.synthetic.mannequin import Mannequin

MATERIALS = ("skin", "shirt", "trousers", "hair", "shoes", "eyes", "lips")
GROUPS = ("trunk", "left_arm", "right_arm", "left_leg", "right_leg")
"""Parts blend within a group, and groups with the trunk only close to their shoulder or hip: a hanging arm does not melt into the side."""
SAMPLES = 33
ALONG_Z = np.eye(3)
ALONG_X = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""Loft frames as columns (width, depth, axis). Along x, the left arm's: width forward (thumb's side), depth down (palm's side)."""


@dataclass(frozen=True)
class Loft:
    """One part of the surface."""

    segment: str
    start: Array
    """Where the axis starts, of shape (3,), metres, in the segment's frame, from its joint."""
    frame: Array
    """Columns width, depth, axis, of shape (3, 3), in the segment's frame."""
    stations: Array
    """Rows of (along, half width, half depth, centre's width, centre's depth), of shape (n, 5), metres."""
    caps: tuple[float, float]
    """How far the rounded ends stand out, metres."""
    blend: float = 0.02
    """Width of the smooth union with what came before it in its group, metres."""
    materials: tuple[str, str] = ("skin", "skin")
    change: float = np.inf
    """Where along the axis the second material begins, metres."""
    group: str = "trunk"


class Surface(NamedTuple):
    """All lofts as arrays; P parts."""

    segment: np.ndarray
    """Index into `SEGMENTS`, of shape (P,)."""
    start: Array
    frame: Array
    """Of shapes (P, 3) and (P, 3, 3)."""
    table: Array
    """Half width, half depth, centre, sampled evenly along the axis, of shape (P, SAMPLES, 4), metres."""
    size: Array
    """Length, both caps, blend, change of material, greatest radius, of shape (P, 6), metres."""
    code: np.ndarray
    """Index into `GROUPS` and twice into `MATERIALS`, of shape (P, 3)."""


@dataclass(frozen=True)
class Clothes:
    """What the person wears. Lengths in metres; sleeves as a fraction of the arm down to the wrist."""

    looseness: float = 0.012
    sleeve: float = 0.35
    hair: float = 0.012
    colours: dict[str, tuple[float, float, float]] = field(default_factory=dict)
    """RGB, 0 to 1, of each of `MATERIALS`."""
    stripes: float = 0.0

    @classmethod
    def draw(cls, rng: np.random.Generator) -> Clothes:
        """Everyday clothes in any colour."""
        import colorsys

        def colour(low: float, high: float, saturation: float) -> tuple[float, float, float]:
            return colorsys.hsv_to_rgb(rng.uniform(), rng.uniform(0.1, saturation), rng.uniform(low, high))

        tone = rng.uniform(0, 1)
        skin = tuple(float(v) for v in (1 - tone) * np.array([0.86, 0.66, 0.55]) + tone * np.array([0.42, 0.27, 0.20]))
        hair = tuple(float(v) for v in np.array([0.30, 0.20, 0.13]) * rng.uniform(0.3, 1.4))
        lips = (0.85 * skin[0], 0.6 * skin[1], 0.6 * skin[2])
        colours = dict(skin=skin, hair=hair, lips=lips, eyes=(0.12, 0.10, 0.09), shirt=colour(0.25, 0.85, 0.8), trousers=colour(0.1, 0.45, 0.5), shoes=colour(0.1, 0.4, 0.3))
        return cls(rng.uniform(0.006, 0.022), float(rng.choice([0.28, 0.36, 0.9])), rng.uniform(0.004, 0.022), colours,
                   float(rng.choice([0, 0, 0.35])))


def surface(body: Mannequin, clothes: Clothes) -> Surface:
    """The surface of `body` in `clothes` as arrays, its parts in the order of `GROUPS`."""
    lofts = [*_trunk(body, clothes), *_head(body, clothes)]
    for limb in (_arm(body, clothes), _leg(body, clothes)):
        lofts += limb + [_mirrored(loft) for loft in limb]
    lofts.sort(key=lambda loft: GROUPS.index(loft.group))
    table, size = zip(*(_sampled(loft) for loft in lofts))
    code = [(GROUPS.index(p.group), *map(MATERIALS.index, p.materials)) for p in lofts]
    return Surface(np.array([SEGMENTS.index(p.segment) for p in lofts]), np.stack([p.start for p in lofts]),
                   np.stack([p.frame for p in lofts]), np.stack(table), np.array(size), np.array(code))


def _sampled(loft: Loft) -> tuple[Array, list[float]]:
    from scipy.interpolate import PchipInterpolator

    rows = loft.stations
    length = rows[-1, 0] - rows[0, 0]
    table = PchipInterpolator(rows[:, 0], rows[:, 1:])(np.linspace(rows[0, 0], rows[-1, 0], SAMPLES))
    radius = float((np.maximum(table[:, 0], table[:, 1]) + np.hypot(table[:, 2], table[:, 3])).max())
    return table, [length, *loft.caps, loft.blend, min(loft.change, 9.0), radius]


def _mirrored(loft: Loft) -> Loft:
    """The same part on the right: everything with its x reversed."""
    flip = np.array([-1.0, 1.0, 1.0])
    right = {"segment": loft.segment.replace("left", "right"), "group": loft.group.replace("left", "right")}
    return Loft(**(loft.__dict__ | right | {"start": loft.start * flip, "frame": loft.frame * flip[:, None]}))


def _along(segment: str, base: Array, rows: list[tuple[float, ...]], **more) -> Loft:
    """A loft along z from rows of (height, half width, half depth[, centre back]) in the world of the T-pose; `base` is the joint."""
    table = np.array([(*row[:3], 0.0, row[3] if len(row) > 3 else 0.0) for row in rows])
    table[:, 4] -= base[1]
    return Loft(segment, np.array([0, 0, table[0, 0] - base[2]]), ALONG_Z, table, **more)


def _trunk(body: Mannequin, clothes: Clothes) -> list[Loft]:
    H, at, m, loose = body.stature, body.rest(), body.measure, clothes.looseness
    hip, seat = m("hip_breadth") / 2 + 0.6 * loose, m("buttock_depth") / 2 + 0.5 * loose
    waist, belly = m("waist_breadth") / 2 + loose, m("waist_depth") / 2 + loose
    chest, breast = m("chest_breadth") / 2 + 0.7 * loose, m("chest_depth") / 2 + 0.5 * loose
    shirt = ("shirt", "shirt")
    crotch = at["pelvis"][2] - 0.045 * H
    mid = lambda a, b, t: a + (b - a) * t  # noqa: E731
    rows = {
        "pelvis": [(crotch, 0.74 * hip, 0.62 * seat, 0.010), (crotch + 0.03 * H, 0.96 * hip, 0.96 * seat, 0.010), (0.525 * H, hip, 0.98 * seat, 0.008),
                   (0.57 * H, mid(hip, waist, 0.55), mid(seat, belly, 0.6), 0.002), (0.615 * H, 0.93 * waist, 0.93 * belly)],
        "abdomen": [(0.57 * H, 0.92 * mid(hip, waist, 0.6), 0.92 * mid(seat, belly, 0.6)), (0.61 * H, 0.985 * waist, 0.985 * belly),
                    (0.65 * H, 0.98 * mid(waist, chest, 0.4), 0.97 * mid(belly, breast, 0.4)), (0.69 * H, 0.91 * chest, 0.89 * breast)],
        "thorax": [(0.64 * H, 0.91 * mid(waist, chest, 0.4), 0.91 * mid(belly, breast, 0.4)), (0.685 * H, 0.975 * chest, 0.95 * breast),
                   (0.725 * H, chest, 0.98 * breast, 0.002), (0.765 * H, 0.96 * chest, 0.88 * breast, 0.008),
                   (0.795 * H, 0.84 * chest, 0.66 * breast, 0.014), (0.815 * H, 0.60 * chest, 0.45 * breast, 0.014)],
    }
    parts = [_along(name, at[base], rows[name], caps=(0.04, 0.03), blend=0.03, materials=materials, change=0.545 * H - crotch)
             for name, base, materials in (("pelvis", "pelvis", ("trousers", "shirt")), ("abdomen", "lumbar", shirt), ("thorax", "thoracic", shirt))]
    neck = m("neck") / (2 * np.pi)
    for sign in (1, -1):
        shoulder = at["left_shoulder"] * (sign, 1, 1)
        inner = np.array([sign * 0.6 * neck, at["neck"][1] + 0.006, 0.826 * H])
        outer = shoulder + np.array([-sign * 0.006, 0.002, 0.012]) * H / 1.75
        parts.append(_between(("left" if sign > 0 else "right") + "_clavicle", at["left_clavicle"] * (sign, 1, 1), inner, outer,
                              [(0, 0.040, 0.034), (0.5, 0.048, 0.033), (1, 0.048 * body.girth, 0.038 * body.girth)], scale=H / 1.75,
                              caps=(0.03, 0.03), blend=0.05, materials=shirt))
        if body.build < 0.4:
            size = (1 - body.build) * H / 1.63 * body.girth
            inside = np.array([sign * 0.046 * H, -0.56 * breast, 0.715 * H])
            parts.append(_between("thorax", at["thoracic"], inside, inside + np.array([sign * 0.008, -0.024, -0.006]),
                                  [(0, 0.066, 0.064), (1, 0.048, 0.046)], scale=size, caps=(0.03, 0.026), blend=0.06, materials=shirt))
    return parts


def _between(segment: str, base: Array, start: Array, end: Array, rows: list[tuple[float, ...]], scale: float = 1.0, **more) -> Loft:
    """A loft from `start` to `end` (world of the T-pose); rows of (fraction, half width, half depth[, off width, off depth])."""
    axis = end - start
    length = float(np.linalg.norm(axis))
    axis = axis / length
    depth = np.array([0.0, 1.0, 0.0]) if abs(axis[1]) < 0.8 else np.array([0.0, 0.0, 1.0])
    depth = depth - (depth @ axis) * axis
    depth /= np.linalg.norm(depth)
    table = np.array([(row[0] * length, *(v * scale for v in row[1:]), *([0.0] * (5 - len(row)))) for row in rows])
    return Loft(segment, start - base, np.stack([np.cross(depth, axis), depth, axis], 1), table, **more)


def _head(body: Mannequin, clothes: Clothes) -> list[Loft]:
    m, at, H = body.measure, body.rest(), body.stature
    width, length, height = m("head_breadth") / 2, m("head_length") / 2, m("head_height")
    neck = m("neck") / (2 * np.pi)
    centre = np.array([0, at["head"][1] - 0.012, H - 0.44 * height])
    unit = height / 0.232
    face = centre + np.array([0, -0.55 * length, 0])

    def ball(middle: Array, rx: float, ry: float, rz: float, **more) -> Loft:
        """An ellipsoid: a short loft with long caps."""
        rows = [(0, rx, ry), (1, rx, ry)]
        half = np.array([0, 0, 0.12 * rz])
        return _between("head", at["head"], middle - half, middle + half, rows, caps=(0.88 * rz, 0.88 * rz), **more)

    parts = [
        _between("neck", at["neck"], at["neck"] + [0, 0.004, -0.035], at["head"] + [0, 0.008, 0.02],
                 [(0, 1.12 * neck, 1.08 * neck), (0.4, 0.96 * neck, 0.98 * neck), (1, 0.92 * neck, 0.97 * neck)], caps=(0.02, 0.02), blend=0.03,
                 materials=("shirt", "skin"), change=0.045 * unit),
        ball(centre, width, length, 0.44 * height, blend=0.02),
        _between("head", at["head"], centre + np.array([0, -0.30 * length, -0.10 * height]), H * np.array([0, 0, 1]) + [0, face[1] - 0.10 * length, -0.955 * height],
                 [(0, 0.80 * width, 0.55 * length), (0.55, 0.72 * width, 0.46 * length), (1, 0.40 * width, 0.24 * length)], caps=(0.03, 0.012), blend=0.02),
        _between("head", at["head"], face + np.array([0, -0.36 * length, -0.02 * height]), face + np.array([0, -0.52 * length, -0.16 * height]),
                 [(0, 0.007, 0.010), (1, 0.014, 0.014)], scale=unit, caps=(0.006, 0.006), blend=0.010),
    ]
    for sign in (1, -1):
        ear = centre + np.array([sign * width * 1.0, 0.10 * length, -0.08 * height])
        parts.append(ball(ear, 0.010 * unit, 0.018 * unit, 0.030 * unit, blend=0.006))
        eye = centre + np.array([sign * 0.42 * width, -0.86 * length, -0.02 * height])
        parts.append(ball(eye, 0.012 * unit, 0.008 * unit, 0.006 * unit, blend=0.002, materials=("eyes", "eyes")))
        parts.append(ball(eye + [sign * 0.002, -0.003, 0.016 * unit], 0.018 * unit, 0.008 * unit, 0.0035 * unit, blend=0.002, materials=("hair", "hair")))
    mouth = centre + np.array([0, -0.93 * length, -0.275 * height])
    parts.append(ball(mouth, 0.022 * unit, 0.010 * unit, 0.005 * unit, blend=0.004, materials=("lips", "lips")))
    parts.append(ball(centre + np.array([0, 0.12 * length, 0.05 * height]), width + 0.7 * clothes.hair, 0.94 * length + clothes.hair,
                      0.42 * height + 0.6 * clothes.hair, blend=0.006, materials=("hair", "hair")))
    if body.build < 0.5 and clothes.hair > 0.008:
        top = centre + np.array([0, 0.45 * length, 0.02 * height])
        parts.append(_between("head", at["head"], top, top + np.array([0, 0.020, -0.62 * height]),
                              [(0, 0.95 * width, 0.55 * length), (0.5, 1.02 * width, 0.50 * length), (1, 0.85 * width, 0.34 * length)],
                              caps=(0.04, 0.02), blend=0.02, materials=("hair", "hair")))
    return parts


def _arm(body: Mannequin, clothes: Clothes) -> list[Loft]:
    """The left arm along +x: deltoid to elbow, forearm, palm, thumb and four fingers."""
    m, loose = body.measure, clothes.looseness
    upper, fore, hand = (body.length(name) for name in ("upper_arm", "forearm", "hand"))
    biceps, belly, wrist = (m(name) / (2 * np.pi) for name in ("biceps", "forearm", "wrist"))
    elbow = 0.5 * (biceps + belly) * 0.90
    end = clothes.sleeve * (upper + fore)

    def sleeved(rows: list[tuple[float, ...]], length: float, offset: float) -> tuple[Array, float]:
        """The limb's stations with the sleeve's cloth over them, and where it ends on this limb."""
        from scipy.interpolate import PchipInterpolator

        bare = np.array([(row[0] * length, *row[1:]) for row in rows])
        along = np.linspace(0, length, 25)
        table = np.column_stack([along, PchipInterpolator(bare[:, 0], bare[:, 1:])(along)])
        cloth = (0.35 + 0.65 * min(1.0, loose / 0.02)) * 0.016 / (1 + np.exp((along + offset - end) / 0.004))
        table[:, 1:3] += cloth[:, None]
        return table, end - offset

    rows = [(0, 1.06 * biceps, 1.10 * biceps, 0, -0.010), (0.25, 1.05 * biceps, 1.06 * biceps, 0, -0.006), (0.5, biceps, biceps, 0.006, 0),
            (0.8, 0.90 * biceps, 0.86 * biceps, 0.003, 0), (1, elbow, 0.92 * elbow, 0, 0)]
    table, change = sleeved(rows, upper, 0)
    common = dict(group="left_arm")
    parts = [Loft("left_upper_arm", np.zeros(3), ALONG_X, table, (0.85 * biceps, 0.9 * elbow), 0.02, ("shirt", "skin"), change, **common)]
    rows = [(0, elbow, 0.94 * elbow, 0, 0), (0.22, 1.04 * belly, 0.97 * belly, 0.004, 0), (0.5, 0.90 * belly, 0.86 * belly, 0.002, 0),
            (0.8, 1.18 * wrist, 1.0 * wrist, 0, 0), (1, 1.14 * wrist, 0.84 * wrist, 0, 0)]
    table, change = sleeved(rows, fore, upper)
    parts.append(Loft("left_forearm", np.zeros(3), ALONG_X, table, (0.9 * elbow, 0.02), 0.025, ("shirt", "skin"), change, **common))
    return parts + _hand(hand, m("hand_breadth") / 2, wrist)


def _hand(length: float, half: float, wrist: float) -> list[Loft]:
    """Palm, fingers a little spread and bent, thumb; the palm looks down in the T-pose (proportions after Garrett 1971)."""
    thick = 0.155 * 2 * half
    rows = np.array([(0, 1.05 * wrist, 0.80 * wrist, 0, 0), (0.2 * length, 0.78 * half, 1.12 * thick, 0, 0.002), (0.42 * length, half, thick, 0, 0.001),
                     (0.50 * length, 0.97 * half, 0.80 * thick, 0, 0)])
    common = dict(segment="left_hand", group="left_arm")
    parts = [Loft(start=np.zeros(3), frame=ALONG_X, stations=rows, caps=(0.02, 0.012), blend=0.02, **common)]
    for place, extent, spread in ((0.72, 0.42, 0.14), (0.24, 0.47, 0.04), (-0.25, 0.44, -0.05), (-0.70, 0.35, -0.16)):
        root = np.array([0.47 * length, -place * half, 0.0])
        axis = np.array([np.cos(spread), -np.sin(spread), -0.12])
        r = 0.105 * half * 2
        parts.append(_digit(root, axis / np.linalg.norm(axis), extent * length, [(0, r, 0.95 * r), (0.5, 0.92 * r, 0.85 * r), (1, 0.72 * r, 0.62 * r)]))
    root, axis = np.array([0.14 * length, -0.50 * half, -0.006]), np.array([0.72, -0.62, -0.30])
    r = 0.13 * half * 2
    parts.append(_digit(root, axis / np.linalg.norm(axis), 0.40 * length, [(0, 1.3 * r, 1.2 * r), (0.5, r, 0.95 * r), (1, 0.72 * r, 0.66 * r)]))
    return parts


def _digit(root: Array, axis: Array, length: float, rows: list[tuple[float, float, float]]) -> Loft:
    depth = np.array([0.0, 0.0, -1.0]) - axis * -axis[2]
    depth /= np.linalg.norm(depth)
    bent = [0.0, 0.02, 0.10]
    table = np.array([(t * length, a, b, 0.0, bend * length) for (t, a, b), bend in zip(rows, bent)])
    return Loft("left_hand", root, np.stack([np.cross(depth, axis), depth, axis], 1), table, (0.3 * rows[0][1], rows[-1][2]), 0.008, group="left_arm")


def _leg(body: Mannequin, clothes: Clothes) -> list[Loft]:
    m, loose = body.measure, clothes.looseness + 0.004
    thigh, knee, calf, ankle = (m(name) / (2 * np.pi) for name in ("thigh", "knee", "calf", "ankle"))
    long, low = body.length("thigh"), body.length("shank")
    common = dict(group="left_leg", materials=("trousers", "trousers"))
    rows = np.array([(-0.06, 0.72 * thigh, 0.76 * thigh, -0.012, 0.004), (0.06, 0.92 * thigh, 0.95 * thigh, -0.010, 0.004),
                     (0.2, 0.96 * thigh, 0.99 * thigh, -0.006, 0.0), (0.5, 0.84 * thigh, 0.88 * thigh, 0.0, -0.006),
                     (0.85, 1.04 * knee, 1.08 * knee, 0.0, -0.004), (1, 0.93 * knee, 0.97 * knee, 0, 0)])
    rows[:, 0] *= long
    rows[:, 1:3] += loose
    down = np.array([[1.0, 0, 0], [0, 1.0, 0], [0, 0, -1.0]])
    parts = [Loft("left_thigh", np.array([0, 0, 0.06 * long]), down, _from_zero(rows), (0.06, 0.05), 0.03, **common)]
    rows = np.array([(0, 0.93 * knee, 0.97 * knee, 0, 0), (0.10, 0.97 * knee, knee, 0, 0.006), (0.28, calf, 1.02 * calf, 0.002, 0.018), (0.6, 0.72 * calf, 0.75 * calf, 0, 0.010), (0.9, 1.02 * ankle, 1.1 * ankle, 0, 0),
                     (1, ankle, 1.1 * ankle, 0, 0)])
    rows[:, 0] *= low
    rows[:, 1:3] += loose
    parts.append(Loft("left_shank", np.zeros(3), down, rows, (0.05, 0.02), 0.03, **common))
    foot, broad, high = m("foot_length"), m("foot_breadth") / 2, body.length("ankle")
    rows = np.array([(0, 0.62 * broad, 0.036, 0, -0.030), (0.3, 0.72 * broad, 0.045, 0, -0.022), (0.7, broad, 0.026, 0, -0.002), (0.93, 0.70 * broad, 0.018, 0, 0.006)])
    rows[:, 0] *= foot
    frame = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, -1.0, 0]])
    parts.append(Loft("left_foot", np.array([0, 0.20 * foot, 0.030 - high]), frame, rows, (0.03, 0.02), 0.03, ("shoes", "shoes"), group="left_leg"))
    return parts


def _from_zero(rows: Array) -> Array:
    rows = rows.copy()
    rows[:, 0] -= rows[0, 0]
    return rows
