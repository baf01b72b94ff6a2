"""The mannequin's kinematics: from postures (rotation vectors of ball joints) to joints and segment frames."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from shadowpuppet.geometry import Array
from shadowpuppet.synthetic.person.mannequin import HAND_POINT, JOINTS, KNUCKLES, Mannequin

ARM = ("side", "front", "roll", "elbow", "supination", "wrist_flex", "wrist_side", "shrug", "protract", "curl")
CHANNELS = ("turn", "sway_x", "sway_y", "pelvis_bow", "pelvis_side", "pelvis_twist", "spine_bow", "spine_side", "spine_twist", "head_nod",
            "head_tilt", "head_turn", *(f"{side}_{name}" for side in ("left", "right") for name in ARM))
"""Columns of a posture array, rad (sway: m; curl: 0 open, 1 fist).

`*_bow`, `*_side`, `*_twist` are components of a joint's rotation vector: forward, to the person's left, turning left. An upper
arm starts hanging; (`front`, `side`) is its swing as a rotation vector, `roll` turns it about itself (positive outward),
`elbow` bends it, `supination` turns the palm up. `turn` rotates the whole figure to its left.
"""
SEGMENTS = (
    "pelvis",
    "abdomen",
    "thorax",
    "neck",
    "head",
    *(f"{side}_{name}" for side in ("left", "right") for name in ("clavicle", "upper_arm", "forearm", "hand", "thigh", "shank", "foot")),
    "left_toes",
    "right_toes",
    "left_fingers",
    "right_fingers",
)
SIDES = ("left", "right")
TOE_OUT = 0.12
"""Outward angle of a standing person's feet, rad."""
MAX_LEG_SPAN = 0.999
"""Greatest extension of a leg over its length: knees are never quite straight."""
FIST_CURL = (1.0, 1.5)
"""Curl (rad) at which fingers begin to close, and at which they form a fist."""
MIRROR = np.array([1.0, -1.0, -1.0])
HANGING = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
"""The left upper arm's frame when it hangs, in the thorax' frame: its bone (x) points down."""


class PosedBody(NamedTuple):
    """A mannequin in T postures."""

    joints: Array
    """Joint centres in the order of `JOINTS`, of shape (T, 17, 3), metres, world."""
    rotation: Array
    """Segment frames in the order of `SEGMENTS`, of shape (T, S, 3, 3), segment to world; identity in the T-pose."""
    origin: Array
    """Proximal joint of each segment, of shape (T, S, 3), metres, world."""
    curl: Array
    """Curl of the left and right fingers, of shape (T, 2), 0 to 1."""


class LegPlacement(NamedTuple):
    """Pelvis and feet in T postures; the legs follow by two-bone inverse kinematics."""

    pelvis: Array
    """Centre of the pelvis, of shape (T, 3), metres, world; lowered if a leg would not reach its ankle."""
    ankles: Array
    """Left and right ankle, of shape (T, 2, 3), metres, world."""
    feet: Array
    """Left and right foot to world, of shape (T, 2, 3, 3); identity stands flat, facing -Y."""
    toes: Array
    """Upward bend of the left and right toes against the foot, of shape (T, 2), rad."""
    ahead: Array
    """Directions in which left and right knee point, of shape (T, 2, 3)."""


def rotations(*vector: Array) -> Array:
    """Rotation matrices (T, 3, 3) of rotation vectors given by their components (T,)."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_rotvec(np.stack(np.broadcast_arrays(*vector), -1)).as_matrix()


def pose(body: Mannequin, postures: Array, stance: float = 0.13) -> PosedBody:
    """The figure of `body` in `postures` (T, `CHANNELS`), its feet planted about the world's origin.

    stance: half the distance between the ankles over the leg's length. The feet stay in place: the pelvis sinks as far as both legs
    need, and hips and knees follow.
    """
    return pose_over(body, postures, planted_stance(body, postures, stance))


def planted_stance(body: Mannequin, postures: Array, stance: float = 0.13) -> LegPlacement:
    """The `LegPlacement` of `pose`: feet side by side about the origin, the pelvis as high as the legs allow."""
    q = dict(zip(CHANNELS, np.asarray(postures, float).T))
    yaw = _yaw(q)
    half, height = stance * (body.length("thigh") + body.length("shank")), body.rest()["left_ankle"][2]
    sway = (yaw @ np.stack([q["sway_x"], q["sway_y"], 0 * q["sway_x"]], -1)[..., None])[..., 0]
    ankles = np.stack([yaw @ np.array([sign * half, 0, height]) for sign in (1, -1)], 1)
    feet = np.stack([yaw @ rotations(*np.zeros((2, 1)), np.array([out])) for out in (TOE_OUT, -TOE_OUT)], 1)
    ahead = np.repeat((yaw @ np.array([0.0, -1.0, 0.0]))[:, None], 2, 1)
    return LegPlacement(sway + np.array([0, 0, np.inf]), ankles, feet, np.zeros((len(yaw), 2)), ahead)


def pose_over(body: Mannequin, postures: Array, stance: LegPlacement, soft: float = 0.0) -> PosedBody:
    """The figure of `body` in `postures` (T, `CHANNELS`); `stance` gives pelvis and feet, in place of the postures' `sway`.

    soft: metres below its limit from which on the pelvis is held down smoothly; 0 for a hard limit.
    """
    q = dict(zip(CHANNELS, np.asarray(postures, float).T))
    parts = Assembly(body.rest())
    pelvis = _yaw(q) @ rotations(q["pelvis_bow"], q["pelvis_side"], q["pelvis_twist"])
    half = rotations(q["spine_bow"] / 2, q["spine_side"] / 2, q["spine_twist"] / 2)
    thorax = pelvis @ half @ half
    nod = rotations(q["head_nod"] / 2, q["head_tilt"] / 2, q["head_turn"] / 2)
    parts.add_trunk(_add_legs(parts, body, pelvis, stance, soft), pelvis, pelvis @ half, thorax, thorax @ nod, thorax @ nod @ nod)
    for side in SIDES:
        _add_arm(parts, q, side)
    return parts.figure(np.stack([q["left_curl"], q["right_curl"]], 1))


class Assembly:
    """Joints (T, 3) and segment frames (T, 3, 3) of a mannequin, added part by part from the pelvis on."""

    def __init__(self, rest: dict[str, Array]) -> None:
        """rest: `Mannequin.rest`."""
        self.rest = rest
        self.joint: dict[str, Array] = {}
        self.frame: dict[str, tuple[Array, Array]] = {}

    def add_trunk(self, centre: Array, pelvis: Array, abdomen: Array, thorax: Array, neck: Array, head: Array) -> None:
        """Add pelvis, trunk and head by their frames; centre: of the pelvis, of shape (T, 3), metres, world."""
        rest = self.rest
        lumbar = centre + pelvis @ (rest["lumbar"] - rest["pelvis"])
        thoracic = lumbar + abdomen @ (rest["thoracic"] - rest["lumbar"])
        nape = thoracic + thorax @ (rest["neck"] - rest["thoracic"])
        self.joint |= {"pelvis": centre, "neck": nape, "head": nape + neck @ (rest["head"] - rest["neck"])}
        self.frame |= {"pelvis": (pelvis, centre), "abdomen": (abdomen, lumbar), "thorax": (thorax, thoracic), "neck": (neck, nape),
                       "head": (head, self.joint["head"])}

    def add_arm(self, side: str, clavicle: Array, upper: Array, fore: Array, forearm: Array, hand: Array, curl: Array) -> None:
        """Add an arm by its frames, after the trunk; fore: the frame that carries the wrist, forearm: the surface's; curl: (T,)."""
        at = {name: self.rest[f"{side}_{name}"] for name in ("clavicle", "shoulder", "elbow", "wrist", "hand")}
        thorax, thoracic = self.frame["thorax"]
        sternum = thoracic + thorax @ (at["clavicle"] - self.rest["thoracic"])
        shoulder = sternum + clavicle @ (at["shoulder"] - at["clavicle"])
        elbow = shoulder + upper @ (at["elbow"] - at["shoulder"])
        wrist = elbow + fore @ (at["wrist"] - at["elbow"])
        base = at["hand"] - at["wrist"]
        self.joint |= {f"{side}_shoulder": shoulder, f"{side}_elbow": elbow, f"{side}_wrist": wrist, f"{side}_hand": wrist + hand @ base}
        self.frame |= {f"{side}_clavicle": (clavicle, sternum), f"{side}_upper_arm": (upper, shoulder), f"{side}_forearm": (forearm, elbow),
                       f"{side}_hand": (hand, wrist), f"{side}_fingers": _fingers(hand, wrist, base, curl)}

    def figure(self, curl: Array) -> PosedBody:
        """The figure with the fingers bent by `curl` (T, 2)."""
        rotation, origin = zip(*(self.frame[name] for name in SEGMENTS))
        return PosedBody(np.stack([self.joint[name] for name in JOINTS], 1), np.stack(rotation, 1), np.stack(origin, 1), curl)


def _yaw(q: dict[str, Array]) -> Array:
    """The figure's heading, of shape (T, 3, 3)."""
    return rotations(0 * q["turn"], 0 * q["turn"], q["turn"])


def _add_arm(parts: Assembly, q: dict[str, Array], side: str) -> None:
    """Add the arm of one side.

    The clavicle rises by 0.13 of the arm's elevation beyond 25 degrees and protracts by 0.12 of its forward swing (after Ludewig et al.
    2009).
    """
    mirror, thorax = np.ones(3) if side == "left" else MIRROR, parts.frame["thorax"][0]

    def about(x: Array | float, y: Array | float, z: Array | float) -> Array:
        return rotations(*(m * np.asarray(v) + 0 * q["turn"] for m, v in zip(mirror, (x, y, z))))

    arm = {name: q[f"{side}_{name}"] for name in ARM}
    raised = np.hypot(arm["side"], arm["front"])
    soft = 0.15 * np.logaddexp(0, (raised - 0.44) / 0.15)
    clavicle = thorax @ about(0, -(0.13 * soft + arm["shrug"]), -(0.12 * np.maximum(arm["front"], 0) + arm["protract"]))
    hanging = HANGING if side == "left" else HANGING.T
    upper = thorax @ about(-arm["front"], -arm["side"], 0) @ hanging @ about(-arm["roll"], 0, 0)
    fore = upper @ about(0, 0, -arm["elbow"])
    half, full = (fore @ about(-arm["supination"] * share, 0, 0) for share in (0.5, 1.0))
    hand = full @ about(0, arm["wrist_flex"], 0) @ about(0, 0, -arm["wrist_side"])
    parts.add_arm(side, clavicle, upper, fore, half, hand, arm["curl"])


def _fingers(hand: Array, wrist: Array, base: Array, curl: Array) -> tuple[Array, Array]:
    """Frame (T, 3, 3) of the fingers and place (T, 3) of the knuckles; base: the joint `hand` from the wrist in the hand's frame."""
    close = np.clip((curl - FIST_CURL[0]) / (FIST_CURL[1] - FIST_CURL[0]), 0, 1)
    bend = np.radians(115) * np.sign(base[0]) * close
    return hand @ rotations(0 * bend, bend, 0 * bend), wrist + hand @ (KNUCKLES / HAND_POINT * base)


def _add_legs(parts: Assembly, body: Mannequin, pelvis: Array, stance: LegPlacement, soft: float) -> Array:
    """Add the legs; returns the centre of the pelvis (T, 3), no higher than both legs reach."""
    thigh, shank, rest = body.length("thigh"), body.length("shank"), parts.rest
    hips = [pelvis @ (rest[f"{side}_hip"] - rest["pelvis"]) for side in SIDES]
    ankles = [stance.ankles[:, n] for n in (0, 1)]
    sway, span = np.where([True, True, False], stance.pelvis, 0.0), MAX_LEG_SPAN * (thigh + shank)
    heights = [
        ankle[:, 2] - hip[:, 2] + np.sqrt(np.maximum(span**2 - ((sway + hip - ankle)[:, :2] ** 2).sum(1), 0))
        for hip, ankle in zip(hips, ankles)
    ]
    centre = sway + soft_minimum(soft_minimum(heights[0], heights[1], soft), stance.pelvis[:, 2], soft)[:, None] * [0, 0, 1]
    for n, side in enumerate(SIDES):
        hip, ankle, ahead, foot = centre + hips[n], ankles[n], stance.ahead[:, n], stance.feet[:, n]
        knee, ahead = _bent(hip, ankle, ahead, thigh, shank)
        toes = foot @ rotations(-stance.toes[:, n], np.zeros(1), np.zeros(1))
        parts.joint |= {f"{side}_hip": hip, f"{side}_knee": knee, f"{side}_ankle": ankle}
        parts.frame |= {f"{side}_thigh": (_upright(hip - knee, ahead), hip), f"{side}_shank": (_upright(knee - ankle, ahead), knee),
                        f"{side}_foot": (foot, ankle), f"{side}_toes": (toes, ankle + foot @ body.ball())}
    return centre


def _bent(hip: Array, ankle: Array, ahead: Array, thigh: float, shank: float) -> tuple[Array, Array]:
    """The knee (T, 3) between hip and ankle (T, 3), and the part of `ahead` square to the leg."""
    down = ankle - hip
    reach = np.linalg.norm(down, axis=1, keepdims=True)
    down /= reach
    ahead = ahead - (ahead * down).sum(1, keepdims=True) * down
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    cosine = np.clip((thigh**2 + reach**2 - shank**2) / (2 * thigh * reach), -1, 1)
    return hip + thigh * (cosine * down + np.sqrt(1 - cosine**2) * ahead), ahead


def soft_minimum(a: Array, b: Array, soft: float) -> Array:
    """The smaller of `a` and `b`, smoothed if they are closer than `soft`."""
    if soft == 0:
        return np.minimum(a, b)
    return np.minimum(a, b) - np.maximum(soft - np.abs(np.where(np.isinf(b), a + soft, b) - a), 0) ** 2 / (4 * soft)


def _upright(up: Array, ahead: Array) -> Array:
    """Frames (T, 3, 3) with z along `up` and -y as near to `ahead` as possible, both (T, 3)."""
    z = up / np.linalg.norm(up, axis=1, keepdims=True)
    x = np.cross(-ahead, z)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return np.stack([x, np.cross(z, x), z], -1)
