"""Bodies of the upper body, made from 18 named sizes on one skeleton; each shape's silhouette is one convex polygon.

`cardbox` is Liu 2011's model (III-A): two or three crossed rectangles a part; `cardbox_bends` has other angles at the elbows. `boxes` is
the volumetric model of its Fig. 1: a closed box a part. `rounded` is ours: hulls of ellipsoids, whose outline does not change as a limb
rolls.

The body's frame is Liu 2011's: X toward the camera, Y to the image's right (the left of a person facing the camera), Z up.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from shadowpuppet.body.shapes import Body, Hulls, Quads
from shadowpuppet.body.sizes import CardboxSizes
from shadowpuppet.body.skeleton import SIDES, Coupling, Dof, Joint, Skeleton
from shadowpuppet.geometry import Array

TWIST, BEND, BOW = "torso_twist", "torso_bend", "torso_bow"
"""Degrees of freedom of the trunk: its turn about the vertical, to the side, and forward."""


def _arm(side: str, sizes: CardboxSizes, bends: bool) -> tuple[list[Joint], list[Dof]]:
    """Joints and DOF of an arm, which hangs straight down, thumb forward, when all angles are zero.

    Abduction turns the arm in the frontal plane, forward out of that plane toward the front: every direction is reachable, and the
    singular one is straight ahead, far from usual initial postures. The elbow is a hinge: roll turns it about the upper arm: 0 bends the
    forearm forward, +90 degrees bends it up when the arm is level. While the arm is straight, roll is undetermined. With `bends` the elbow
    bends aside and then forward, as the shoulder does: the same directions of the forearm, but for some at flexions beyond 135 degrees,
    and a straight arm is regular.
    """
    out, turn = ("x", "z") if side == "left" else ("-x", "-z")
    y = (sizes.shoulder_width / 2 - sizes.shoulder_inset) * (1 if side == "left" else -1)
    z = sizes.torso_height - sizes.upper_arm_width / 2  # a level arm's upper edge lies on the torso's
    shoulder, elbow = f"{side}_shoulder", f"{side}_elbow"
    joints = [Joint(shoulder, "torso", (0.0, y, z)), Joint(elbow, shoulder, (0.0, 0.0, -sizes.upper_arm_length))]
    hinge = [Dof(f"{side}_elbow_roll", elbow, turn, *np.radians([-95, 95]), spread=(1.0, 1.0)),
             Dof(f"{side}_elbow_flexion", elbow, "-y", *np.radians([0, 150]), spread=(1.2, 1.2))]
    both = [Dof(f"{side}_elbow_aside", elbow, out, *np.radians([-150, 150]), spread=(1.2, 1.2)),
            Dof(f"{side}_elbow_forward", elbow, "-y", *np.radians([-5, 150]), spread=(1.2, 1.2))]
    dofs = [
        Dof(f"{side}_shoulder_abduction", shoulder, out, *np.radians([-40, 190]), rest=0.8, spread=(2.0, 2.0)),
        Dof(f"{side}_shoulder_forward", shoulder, "-y", *np.radians([-30, 100]), spread=(0.3, 0.7)),
        *(both if bends else hinge),
    ]
    return joints, dofs


SHOULDER_RISE = 0.012
"""Rise, or forward shift, of a shoulder per radian of its arm (m): about 2 cm for a level arm, from the clavicle's elevation of some 8
degrees (Ludewig et al. 2009)."""


def upper_body_skeleton(sizes: CardboxSizes, clavicles: bool = False, bends: bool = False) -> Skeleton:
    """The skeleton of Liu 2011 (III-A): 12 DOF d1..d12, four of the torso and four of each arm. The pelvis shifts along Y and twists;
    the torso turns on it about the middle of its lower edge. The paper does not say which two rotations an elbow has: a hinge that rolls,
    or two `bends`. With `clavicles` the shoulders follow the arms a little, which is not in the paper."""
    joints = [Joint("pelvis", None), Joint("torso", "pelvis")]
    dofs = [
        Dof("torso_y", "pelvis", "y", kind="translation"),
        Dof(TWIST, "pelvis", "z", *np.radians([-90, 90]), spread=(0.7, 0.7)),
        Dof(BOW, "torso", "y", *np.radians([-10, 90]), spread=(0.06, 0.06)),
        Dof(BEND, "torso", "x", *np.radians([-50, 50]), spread=(0.25, 0.25)),
    ]
    for side in SIDES:
        arm_joints, arm_dofs = _arm(side, sizes, bends)
        joints += arm_joints
        dofs += arm_dofs
    couplings = [coupling for side in SIDES for coupling in (
        Coupling(f"{side}_shoulder", f"{side}_shoulder_abduction", (0.0, 0.0, SHOULDER_RISE)),
        Coupling(f"{side}_shoulder", f"{side}_shoulder_forward", (SHOULDER_RISE, 0.0, 0.0)),
    )]
    return Skeleton(tuple(joints), tuple(dofs), tuple(couplings) if clavicles else ())


FOREARM, TO_TIP, HAND_POINT = 0.1535, 0.254, 0.019
"""Fractions of the stature: elbow to wrist (de Leva 1996, table 4, mean of women and men); elbow to the card's end in a silhouette;
wrist to the base of the fingers as in CMU's mocap skeletons (the bone `lhand`)."""
WRIST_SHARE, HAND_SHARE = FOREARM / TO_TIP, (FOREARM + HAND_POINT) / TO_TIP
"""Positions of the wrist and the base of the fingers along the forearm's card."""
HALF_BREADTH = 0.0248
"""Half the breadth of a hand, fraction of the stature (ANSUR II; Gordon et al. 2014)."""


def _landmarks(sizes: CardboxSizes) -> dict[str, tuple[str, tuple[float, float, float]]]:
    top = sizes.torso_height
    points = {
        "pelvis": ("pelvis", (0.0, 0.0, 0.0)),
        "neck": ("torso", (0.0, 0.0, top)),
        "head": ("torso", (0.0, 0.0, top + sizes.neck_gap)),
    }
    for side in SIDES:
        points[f"{side}_shoulder"] = (f"{side}_shoulder", (0.0, 0.0, 0.0))
        points[f"{side}_elbow"] = (f"{side}_elbow", (0.0, 0.0, 0.0))
        points[f"{side}_wrist"] = (f"{side}_elbow", (0.0, 0.0, -WRIST_SHARE * sizes.forearm_length))
        points[f"{side}_hand"] = (f"{side}_elbow", (0.0, 0.0, -HAND_SHARE * sizes.forearm_length))
        points[f"{side}_fist"] = (f"{side}_elbow", (0.0, 0.0, -sizes.forearm_length))
    return points


@dataclass(frozen=True)
class _Card:
    """A body part as a frustum along Z: widths (Y) and depths (X) at its top and bottom."""

    name: str
    joint: str
    top: float
    bottom: float
    width: tuple[float, float]
    depth: tuple[float, float]

    def corner(self, x: int, y: int, end: int) -> tuple[float, float, float]:
        z = (self.top, self.bottom)[end]
        return x * self.depth[end] / 2, y * self.width[end] / 2, z

    def front_card(self) -> list[tuple[float, float, float]]:
        return [self.corner(0, y, end) for y, end in ((-1, 0), (1, 0), (1, 1), (-1, 1))]

    def side_card(self) -> list[tuple[float, float, float]]:
        return [self.corner(x, 0, end) for x, end in ((-1, 0), (1, 0), (1, 1), (-1, 1))]

    def level_card(self, share: float = 0.5) -> list[tuple[float, float, float]]:
        """A card across the part, `share` of the way down."""
        x, y = ((1 - share) * a + share * b for a, b in (self.depth, self.width))
        z = (1 - share) * self.top + share * self.bottom
        return [(i * x / 2, j * y / 2, z) for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]

    def faces(self) -> list[list[tuple[float, float, float]]]:
        """The six faces of the closed box."""
        sides = [[self.corner(x, y, 0), self.corner(u, v, 0), self.corner(u, v, 1), self.corner(x, y, 1)]
                 for x, y, u, v in ((-1, -1, 1, -1), (1, -1, 1, 1), (1, 1, -1, 1), (-1, 1, -1, -1))]
        return [*sides, self.level_card(0.0), self.level_card(1.0)]


def _parts(sizes: CardboxSizes) -> list[_Card]:
    s, neck = sizes, sizes.torso_height + sizes.neck_gap
    parts = [
        _Card("head", "torso", neck + s.head_height, neck, (s.head_width, s.head_width), (s.head_depth, s.head_depth)),
        _Card("torso", "torso", s.torso_height, 0.0, (s.shoulder_width, s.torso_bottom_width), (s.torso_top_depth, s.torso_bottom_depth)),
        _Card("waist", "pelvis", 0.0, -s.waist_height, (s.waist_width, s.waist_width), (s.waist_depth, s.waist_depth)),
    ]
    upper, lower = (s.upper_arm_width, s.upper_arm_width), (s.elbow_width, s.hand_width)
    for side in SIDES:
        parts += [_Card(f"{side}_upper_arm", f"{side}_shoulder", 0.0, -s.upper_arm_length, upper, upper),
                  _Card(f"{side}_forearm", f"{side}_elbow", 0.0, -s.forearm_length, lower, lower)]
    return parts


def _hem(sizes: CardboxSizes) -> Array:
    return np.array([[0.0, -sizes.waist_width / 2, -sizes.waist_height], [0.0, sizes.waist_width / 2, -sizes.waist_height]])


def _of_quads(name: str, sizes: CardboxSizes, shapes: Mapping[str, list], bends: bool = False) -> Body:
    skeleton = upper_body_skeleton(sizes, bends=bends)
    joint_of = {part.name: part.joint for part in _parts(sizes)}
    quads = [(part, quad) for part, part_quads in shapes.items() for quad in part_quads]
    joints = np.array([[skeleton.joint_index(joint_of[part])] for part, _ in quads], np.int64)
    corners = np.array([quad for _, quad in quads], float)
    return Body(name, skeleton, Quads(joints, corners), tuple(part for part, _ in quads), _landmarks(sizes), _hem(sizes))


def cardbox(sizes: CardboxSizes) -> Body:
    """Liu 2011's cardbox model: 15 cards (III-A). The torso's third card lies across it at mid-height."""
    return _of_quads("cardbox", sizes, _cards(sizes))


def cardbox_bends(sizes: CardboxSizes) -> Body:
    """The cardbox model with elbows of two bends in place of roll and flexion."""
    return _of_quads("cardbox_bends", sizes, _cards(sizes), bends=True)


def _cards(sizes: CardboxSizes) -> dict[str, list]:
    return {p.name: [p.front_card(), p.side_card()] + ([p.level_card()] if p.name == "torso" else []) for p in _parts(sizes)}


def boxes(sizes: CardboxSizes) -> Body:
    """The volumetric model of Liu 2011, Fig. 1, for comparison: a closed box for each of the seven parts."""
    return _of_quads("boxes", sizes, {part.name: part.faces() for part in _parts(sizes)})


def rounded(sizes: CardboxSizes) -> Body:
    """Hulls of ellipsoids, with neck, sloping shoulders and flat open hands, from the same 18 sizes. Not in the paper. Two crossed cards
    look 0.7 times as wide when a limb has rolled by 45 degrees; a hull does not, so its width shows the distance. A hand's breadth lies
    along the forearm's X, thumb up where a bent forearm points forward; `hand_width` is its thickness, which level arms, palms down, show.
    The shares were fitted to made people in known poses."""
    s, skeleton = sizes, upper_body_skeleton(sizes, clavicles=True)
    crown = s.torso_height + s.neck_gap + s.head_height
    neck, arm, fore, palm = 0.335 * s.head_width, s.upper_arm_width / 2, s.elbow_width / 2, s.hand_width / 2
    wrist, breadth, tip = 0.3 * s.elbow_width, HALF_BREADTH / TO_TIP * s.forearm_length, 0.45 * palm

    def ellipsoid(joint: str, z: float, depth: float, width: float, height: float):
        return skeleton.joint_index(joint), (0.0, 0.0, z), (depth, width, height)

    def ball(joint: str, z: float, radius: float):
        return ellipsoid(joint, z, radius, radius, radius)

    def loin(joint: str):
        return ellipsoid(joint, 0.1 * s.torso_height, s.torso_bottom_depth / 2, s.torso_bottom_width / 2, 0.1 * s.torso_height)

    parts = {
        "head": [ellipsoid("torso", crown - s.head_height / 2, s.head_depth / 2, s.head_width / 2, s.head_height / 2)],
        "neck": [ball("torso", crown - 0.6 * s.head_height, neck), ball("torso", s.torso_height, neck)],
        "shoulders": [*(ball(f"{side}_shoulder", 0, arm) for side in SIDES), ball("torso", s.torso_height + neck / 3, neck)],
        "torso": [ellipsoid("torso", 0.72 * s.torso_height, s.torso_top_depth / 2, 0.44 * s.shoulder_width, 0.3 * s.torso_height),
                  loin("torso")],
        "waist": [loin("pelvis"), ellipsoid("pelvis", -0.9 * s.waist_height, s.waist_depth / 2, s.waist_width / 2, 0.1 * s.waist_height)],
    }
    for side in SIDES:
        shoulder, elbow = f"{side}_shoulder", f"{side}_elbow"
        parts[f"{side}_upper_arm"] = [ball(shoulder, 0, arm), ball(elbow, 0, fore)]
        parts[f"{side}_forearm"] = [ball(elbow, -0.06 * s.forearm_length, fore), ball(elbow, -WRIST_SHARE * s.forearm_length, wrist)]
        parts[f"{side}_hand"] = [ellipsoid(elbow, -0.65 * s.forearm_length, breadth, palm, 0.07 * s.forearm_length),
                                 ellipsoid(elbow, tip - s.forearm_length, breadth, tip, tip)]
    most = max(map(len, parts.values()))
    shapes = [part + [part[-1]] * (most - len(part)) for part in parts.values()]  # a repeated ellipsoid does not change a hull
    joints, centres, radii = (np.array([[ellipsoid[i] for ellipsoid in shape] for shape in shapes]) for i in range(3))
    return Body("rounded", skeleton, Hulls(joints.astype(np.int64), centres.astype(float), radii.astype(float)), tuple(parts),
                _landmarks(sizes), _hem(sizes))


