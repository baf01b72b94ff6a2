"""The trunk as lofts: breadths and depths at the heights where they are measured; sections between are set by eye."""

from __future__ import annotations

import numpy as np

from shadowpuppet.synthetic.person.clothes import Clothes
from shadowpuppet.synthetic.person.mannequin import Mannequin
from shadowpuppet.synthetic.person.surface import Loft, Sections, loft_between, stations_of


def trunk(body: Mannequin, clothes: Clothes) -> list[Loft]:
    """Pelvis, abdomen and thorax, overlapping; seat, waist and chest are measured at 0.525, 0.61 and 0.725 of stature."""
    H, joints, m, loose = body.stature, body.rest(), body.measure, clothes.looseness
    hip, seat = m("hip_breadth") / 2 + 0.6 * loose, m("buttock_depth") / 2 + 0.5 * loose
    waist, belly = m("waist_breadth") / 2 + loose, m("waist_depth") / 2 + loose
    chest, breast = m("chest_breadth") / 2 + 0.7 * loose, m("chest_depth") / 2 + 0.5 * loose
    loin, loin_d = 0.4 * hip + 0.6 * waist, 0.4 * seat + 0.6 * belly
    rib, rib_d = 0.6 * waist + 0.4 * chest, 0.6 * belly + 0.4 * breast
    crotch = joints["pelvis"][2] / H - 0.045
    rows: dict[str, Sections] = {
        "pelvis": [
            (crotch, 0.74 * hip, 0.62 * seat, 0, 0.010),
            (crotch + 0.03, 0.96 * hip, 0.96 * seat, 0, 0.010),
            (0.525, hip, 0.98 * seat, 0, 0.008),
            (0.57, loin, loin_d, 0, 0.002),
            (0.615, 0.93 * waist, 0.93 * belly),
        ],
        "abdomen": [
            (0.57, 0.92 * loin, 0.92 * loin_d),
            (0.61, 0.985 * waist, 0.985 * belly),
            (0.65, 0.98 * rib, 0.97 * rib_d),
            (0.69, 0.91 * chest, 0.89 * breast),
        ],
        "thorax": [
            (0.64, 0.91 * rib, 0.91 * rib_d),
            (0.685, 0.975 * chest, 0.95 * breast),
            (0.725, chest, 0.98 * breast, 0, 0.002),
            (0.765, 0.96 * chest, 0.88 * breast, 0, 0.008),
            (0.795, 0.84 * chest, 0.66 * breast, 0, 0.014),
            (0.815, 0.60 * chest, 0.45 * breast, 0, 0.014),
        ],
    }
    parts = []
    for segment, joint in (("pelvis", "pelvis"), ("abdomen", "lumbar"), ("thorax", "thoracic")):
        start = np.array([0, 0, rows[segment][0][0] * H]) - joints[joint]
        parts.append(
            Loft(segment, start, np.eye(3), stations_of(rows[segment], H), (0.04, 0.03), 0.03,
                 ("trousers" if segment == "pelvis" else "shirt", "shirt"), (0.545 - crotch) * H)
        )
    return parts


def shoulders(body: Mannequin, clothes: Clothes) -> list[Loft]:
    """Lofts from neck to shoulder, moving with the clavicle, and of a woman's breasts. The shoulders slope: in the middle between neck and
    acromion their tops are some 30 mm above the acromion's (Gordon et al. 1989: midshoulder and acromial heights, sitting)."""
    H, joints, neck = body.stature, body.rest(), body.measure("neck") / (2 * np.pi)
    breast, unit = body.measure("chest_depth") / 2 + 0.5 * clothes.looseness, H / 1.75
    shirt = {"materials": ("shirt", "shirt")}
    inner = np.array([0.6 * neck, joints["neck"][1] + 0.006, 0.845 * H])
    outer = joints["left_shoulder"] + np.array([-0.006, 0.002, 0.012]) * unit
    rows: Sections = [
        (0, 0.040 * unit, 0.034 * unit),
        (0.5, 0.048 * unit, 0.033 * unit),
        (1, 0.048 * unit * body.girth, 0.038 * unit * body.girth),
    ]
    left = [loft_between("left_clavicle", joints["left_clavicle"], inner, outer, rows, caps=(0.03, 0.03), blend=0.05, **shirt)]
    size = max(0.0, 1 - 2.5 * body.build) ** 0.5 * unit * body.girth
    if size > 0.3:
        inside = np.array([0.046 * H, -0.56 * breast, 0.715 * H])
        rows = [(0, 0.070 * size, 0.068 * size), (1, 0.051 * size, 0.049 * size)]
        left.append(
            loft_between("thorax", joints["thoracic"], inside, inside + np.array([0.008, -0.024, -0.006]), rows, caps=(0.03, 0.026),
                         blend=0.06, **shirt)
        )
    return [*left, *(loft.mirrored() for loft in left)]
