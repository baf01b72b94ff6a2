"""Head and neck as lofts."""

from __future__ import annotations

import numpy as np

from shadowpuppet.geometry import Array
from shadowpuppet.synthetic.person.clothes import Clothes
from shadowpuppet.synthetic.person.mannequin import Mannequin
from shadowpuppet.synthetic.person.surface import Loft, Sections, ellipsoid, loft_between


def head(body: Mannequin, clothes: Clothes) -> list[Loft]:
    """Neck, skull, jaw, nose, ears, eyes, lips and hair."""
    m, joints, H = body.measure, body.rest(), body.stature
    wide, deep, high = m("head_breadth") / 2, m("head_length") / 2, m("head_height")
    neck, unit, joint = m("neck") / (2 * np.pi), m("head_height") / 0.232, joints["head"]
    skull = np.array([0, joint[1] - 0.012, H - 0.44 * high])
    cheek, chin = skull + np.array([0, -0.30 * deep, -0.10 * high]), np.array([0, skull[1] - 0.65 * deep, H - 0.955 * high])
    bridge, tip = skull + np.array([0, -0.91 * deep, -0.02 * high]), skull + np.array([0, -1.07 * deep, -0.16 * high])
    parts = [
        loft_between("neck", joints["neck"], joints["neck"] + np.array([0, 0.004, -0.035]), joint + np.array([0, 0.008, 0.02]),
                     [(0, 1.12 * neck, 1.08 * neck), (0.4, 0.96 * neck, 0.98 * neck), (1, 0.92 * neck, 0.97 * neck)], caps=(0.02, 0.02),
                     blend=0.03, materials=("shirt", "skin"), change=0.045 * unit),
        ellipsoid("head", joint, skull, (wide, deep, 0.44 * high), blend=0.02),
        loft_between("head", joint, cheek, chin,
                     [(0, 0.80 * wide, 0.55 * deep), (0.55, 0.72 * wide, 0.46 * deep), (1, 0.40 * wide, 0.24 * deep)], caps=(0.03, 0.012),
                     blend=0.02),
        loft_between("head", joint, bridge, tip, [(0, 0.007 * unit, 0.010 * unit), (1, 0.014 * unit, 0.014 * unit)], caps=(0.006, 0.006),
                     blend=0.010),
    ]
    for sign in (1, -1):
        ear, eye = (
            skull + np.array(p) * (sign, 1, 1)
            for p in ((wide, 0.10 * deep, -0.08 * high), (0.42 * wide, -0.86 * deep, -0.02 * high))
        )
        marks = [
            (ear, (0.010, 0.018, 0.030), 0.006, "skin"),
            (eye, (0.012, 0.008, 0.006), 0.002, "eyes"),
            (eye + np.array([0, -0.003, 0.016 * unit]), (0.018, 0.008, 0.0035), 0.002, "hair"),
        ]
        parts += [
            ellipsoid("head", joint, at, (rx * unit, ry * unit, rz * unit), blend=blend, materials=(material, material))
            for at, (rx, ry, rz), blend, material in marks
        ]
    parts.append(
        ellipsoid("head", joint, skull + np.array([0, -0.93 * deep, -0.275 * high]), (0.022 * unit, 0.010 * unit, 0.005 * unit),
                  blend=0.004, materials=("lips", "lips"))
    )
    return parts + _hair(skull, (wide, deep, high), joint, clothes.hair, long=body.build < 0.5 and clothes.hair > 0.008)


def _hair(skull: Array, size: tuple[float, float, float], joint: Array, thick: float, long: bool) -> list[Loft]:
    (wide, deep, high), hair = size, {"materials": ("hair", "hair")}
    cap = ellipsoid("head", joint, skull + np.array([0, 0.13 * deep + 0.9 * thick, 0.05 * high]),
                    (wide + 0.7 * thick, 0.94 * deep + thick, 0.42 * high + 0.6 * thick), blend=0.006, **hair)
    top = skull + np.array([0, 0.45 * deep, 0.02 * high])
    rows: Sections = [(0, 0.95 * wide, 0.55 * deep), (0.5, 1.02 * wide, 0.50 * deep), (1, 0.85 * wide, 0.34 * deep)]
    return (
        [cap, loft_between("head", joint, top, top + np.array([0, 0.020, -0.62 * high]), rows, caps=(0.04, 0.02), blend=0.02, **hair)]
        if long
        else [cap]
    )
