"""The person in a synthetic recording: body measures from published surveys, and joint centres.

Nothing is shared with the bodies that trackers fit: joints, lengths and shapes come from anthropometry, the surface (`surface.py`) is
made of blended lofts, and postures are rotation vectors of ball joints (`kinematics.py`).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Literal

import numpy as np
from pydantic import Field
from pydantic.dataclasses import dataclass

from shadowpuppet.errors import SettingsError
from shadowpuppet.geometry import Array
from shadowpuppet.settings import STRICT

PersonKind = Literal["woman", "man", "child"]

JOINTS = ("pelvis", "neck", "head", *(f"{side}_{joint}" for side in ("left", "right") for joint in ("shoulder", "elbow", "wrist", "hand")),
          *(f"{side}_{joint}" for side in ("left", "right") for joint in ("hip", "knee", "ankle")))
"""The 17 joints of a truth file, in its order."""

STATURES = (0.9, 2.2)
"""Limits of the stature, metres."""
STATURE = (1.629, 1.756)
"""Mean stature (m) of the women and men measured by `MEASURES`."""

MEASURES = {"biacromial_breadth": (0.365, 0.416), "chest_breadth": (0.272, 0.290), "chest_depth": (0.248, 0.254),
            "waist_breadth": (0.300, 0.326), "waist_depth": (0.220, 0.236), "hip_breadth": (0.348, 0.343), "buttock_depth": (0.235, 0.249),
            "neck": (0.330, 0.398), "biceps": (0.292, 0.338), "forearm": (0.254, 0.296), "wrist": (0.155, 0.176),
            "hand_breadth": (0.079, 0.0885), "thigh": (0.617, 0.626), "knee": (0.370, 0.388), "calf": (0.373, 0.392),
            "ankle": (0.216, 0.229), "foot_length": (0.246, 0.271), "foot_breadth": (0.093, 0.102), "head_breadth": (0.148, 0.154),
            "head_length": (0.190, 0.199), "head_height": (0.218, 0.232)}
"""Breadths, depths and girths (m) of the mean woman and man: rounded means of ANSUR II (Gordon et al. 2014, NATICK/TR-15/007;
biceps and forearm some 5 % less than its flexed girths, knee its lower thigh, head height from vertex to chin)."""

FRACTIONS = {"upper_arm": (0.1586, 0.1618), "forearm": (0.1523, 0.1545), "hand": (0.108, 0.108), "thigh": (0.245, 0.245),
             "shank": (0.246, 0.246), "ankle": (0.039, 0.039)}
"""Lengths between joint centres as fractions of stature, women and men: the arm's by de Leva (1996, table 4: SJC-EJC, EJC-WJC),
hand and leg by Drillis & Contini (1966) as given by Winter (2009, fig. 4.1)."""

HAND_POINT = 0.18
"""Place of the joint `*_hand`, fraction of the hand's length from the wrist: the root of the metacarpals, as in the project's shared
recordings (0.019 of stature beyond the wrist)."""
KNUCKLES = 0.46
"""Place of the knuckles, where the fingers bend, as the same fraction."""

BODY_MASS = (25.6, 27.8)
"""Mean body mass index (kg/m2) of the same women and men."""
HEAD_MASS = 5.0
"""Mass of an adult's head, kg."""

GROWTH = {"age": (4, 6, 8, 10, 12, 14), "stature": (1.02, 1.15, 1.275, 1.385, 1.505, 1.62),
          "body_mass": (15.5, 15.3, 15.9, 16.7, 17.9, 19.2), "legs": (0.906, 0.933, 0.952, 0.973, 0.99, 1.0)}
"""Children by years, means of girls and boys: stature (m) and body mass index (kg/m2), medians of the CDC charts (Kuczmarski et al.
2000); legs' share of stature against adults', from sitting heights (Fredriks et al. 2005)."""

Factor = Annotated[float, Field(ge=0.7, le=1.4)]


@dataclass(frozen=True, config=STRICT)
class Mannequin:
    """A person: stature, build, and factors on the mean measures of that stature and build."""

    stature: Annotated[float, Field(ge=STATURES[0], le=STATURES[1])] = 1.75
    """Height of the crown over the floor, metres."""
    build: Annotated[float, Field(ge=0, le=1)] = 1.0
    """From the mean woman's proportions (0) to the mean man's (1)."""
    girth: Factor = 1.0
    """Factor on all girths and depths of trunk and limbs."""
    shoulder_width: Factor = 1.0
    """Factor on the distance between the shoulders."""
    hip_width: Factor = 1.0
    """Factor on the hip's breadth."""
    arm_length: Annotated[float, Field(ge=0.85, le=1.15)] = 1.0
    """Factor on upper arm, forearm and hand."""
    head_size: Annotated[float, Field(ge=0.85, le=1.15)] = 1.0
    """Factor on the head."""
    leg_length: Annotated[float, Field(ge=0.88, le=1.08)] = 1.0
    """Factor on thigh and shank; the trunk compensates for it."""

    @classmethod
    def draw(cls, rng: np.random.Generator, kind: PersonKind | None = None, *, stature: float | None = None, bmi: float | None = None,
             age: float | None = None) -> Mannequin:
        """A random plausible person; by default of a random kind (every sixth a child).

        stature: metres; bmi: body mass index, kg/m2, which sets the girths; age: of a child, 4 to 14 years. Values not given are drawn:
        standard deviations follow ANSUR II (stature 64 and 69 mm, girths about 8 %, biacromial breadth 5 %), children are 6 to 12 years
        old (Snyder et al. 1977). A child of given age or stature has a child's legs and girths (`GROWTH`).
        Raises `SettingsError` if there is no such person.
        """
        kind = kind or ("woman", "man", "child")[rng.choice(3, p=[5 / 12, 5 / 12, 1 / 6])]
        mean, spread, build = {"woman": (1.629, 0.064, 0.0), "man": (1.756, 0.069, 1.0), "child": (1.34, 0.11, 0.5)}[kind]
        z = np.clip(rng.standard_normal(7), -2, 2)
        known = kind == "child" and (age is not None or stature is not None)
        if age is not None:
            if kind != "child" or not 4 <= age <= 14:
                raise SettingsError(f"age: found {age:g} for a {kind}, expected 4 to 14 for a child")
            mean, spread = float(np.interp(age, GROWTH["age"], GROWTH["stature"])), 0.05
        person = cls(stature=_within("stature", mean + spread * z[0] if stature is None else stature, *STATURES),
                     build=float(np.clip(build + 0.15 * z[1], 0, 1)), girth=float((0.9 if kind == "child" else 1.0) * (1 + 0.08 * z[2])),
                     shoulder_width=float(1 + 0.045 * z[3]), hip_width=float(1 + 0.05 * z[4]), arm_length=float(1 + 0.025 * z[5]),
                     head_size=float(1 + 0.02 * z[6]))
        if known:
            age = float(np.interp(person.stature, GROWTH["stature"], GROWTH["age"])) if age is None else age
            person = replace(person, leg_length=float(np.interp(age, GROWTH["age"], GROWTH["legs"])))
            usual = float(np.interp(age, GROWTH["age"], GROWTH["body_mass"])) * (1 + 0.08 * float(z[2])) ** 2
            bmi = usual if bmi is None else bmi
        return person if bmi is None else replace(person, girth=person.girth_of(bmi))

    def girth_of(self, bmi: float) -> float:
        """The factor on girths that gives a body mass index (kg/m2). Raises `SettingsError` beyond the possible factors.

        Mass is taken as proportional to stature times the square of girths; the head's mass as proportional to stature alone.
        """
        mean, stature = (float(np.interp(self.build, (0, 1), pair)) for pair in (BODY_MASS, STATURE))
        scale = self.stature / stature
        head, usual = HEAD_MASS * scale, (mean * stature**2 - HEAD_MASS) * scale**3
        low, high = ((head + usual * factor**2) / self.stature**2 for factor in (0.7, 1.4))
        return float(np.clip(np.sqrt((_within("bmi", bmi, low, high) * self.stature**2 - head) / usual), 0.7, 1.4))

    def measure(self, name: str) -> float:
        """A breadth, depth or girth of `MEASURES` (m) for this person; heads follow the cube root of stature."""
        women, men = MEASURES[name]
        scale = self.stature / np.interp(self.build, (0, 1), STATURE)
        if name.startswith("head"):
            return float(np.interp(self.build, (0, 1), (women, men)) * scale**0.33 * self.head_size)
        if name in ("biacromial_breadth", "foot_length", "hand_breadth"):
            factor = {"biacromial_breadth": self.shoulder_width, "hand_breadth": self.arm_length}.get(name, 1.0)
        else:
            factor = self.girth * (self.hip_width if name == "hip_breadth" else 1.0)
        return float(np.interp(self.build, (0, 1), (women, men)) * scale * factor)

    def length(self, name: str) -> float:
        """A segment's length of `FRACTIONS`, metres."""
        own = {"thigh": self.leg_length, "shank": self.leg_length, "ankle": 1.0}
        factor = own.get(name, self.arm_length)
        return float(np.interp(self.build, (0, 1), FRACTIONS[name]) * self.stature * factor)

    def ball(self) -> Array:
        """The ball of the foot, about which the toes bend, (3,), metres, from the ankle of a flat foot facing -Y."""
        return np.array([0, -0.48 * self.measure("foot_length"), 0.02 - self.length("ankle")])

    def rest(self) -> dict[str, Array]:
        """Joint centres (3,), metres, of the person standing with arms level to the sides, facing -Y; left is +X.

        Besides `JOINTS`: `lumbar` (L5/S1), `thoracic` (T12/L1), `*_clavicle` (its end at the breastbone).
        Heights on the trunk follow Drillis & Contini (1966); the shoulder's centre lies 18 mm inside the acromion (de Leva 1996).
        """
        H, up = self.stature, self.stature / 1.75
        leg = self.length("thigh") + self.length("shank") + self.length("ankle")
        half = self.measure("biacromial_breadth") / 2 - 0.018 * up
        points = {"pelvis": (0, 0, leg), "lumbar": (0, 0.010 * H, leg + 0.055 * H), "thoracic": (0, 0.014 * H, 0.665 * H),
                  "neck": (0, 0.014 * H, 0.838 * H), "head": (0, -0.008 * H, H - 0.63 * self.measure("head_height")),
                  "clavicle": (0.014 * H, -0.014 * H, 0.812 * H), "shoulder": (half, 0.004 * H, 0.793 * H),
                  "hip": (0.052 * H * self.hip_width, 0, leg), "knee": (0.052 * H * self.hip_width, 0, leg - self.length("thigh"))}
        reach = np.cumsum([self.length("upper_arm"), self.length("forearm"), HAND_POINT * self.length("hand")])
        for name, along in zip(("elbow", "wrist", "hand"), reach):
            points[name] = (half + along, 0.004 * H, 0.793 * H)
        points["ankle"] = (points["hip"][0], 0.012 * H, self.length("ankle"))
        centre = ("pelvis", "lumbar", "thoracic", "neck", "head")
        rest = {name: np.array(points[name], float) for name in centre}
        for side, sign in (("left", 1), ("right", -1)):
            rest |= {f"{side}_{name}": np.array(p, float) * (sign, 1, 1) for name, p in points.items() if name not in centre}
        return rest


def _within(name: str, value: float, low: float, high: float) -> float:
    """The value. Raises `SettingsError` if it is not between `low` and `high`."""
    if not low <= value <= high:
        raise SettingsError(f"{name}: found {value:g}, expected {low:.3g} to {high:.3g}")
    return float(value)
