"""Gestures of arms and trunk: key postures over time, interpolated smoothly, plus involuntary motion.

A gesture is a function of a length (s) and a random generator. It returns key postures `(time, {channel: value})`; channels not named
are as in standing. Time is continuous: the same spec at another frame rate is the same motion.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from shadowpuppet.geometry import Array
from shadowpuppet.synthetic.person.kinematics import CHANNELS, pose
from shadowpuppet.synthetic.person.mannequin import JOINTS, Mannequin

RESTLESSNESS = {"sway_x": (0.006, 0.35), "sway_y": (0.006, 0.35), "spine_bow": (0.8, 0.4), "spine_side": (0.8, 0.4),
                "spine_twist": (1.0, 0.4), "head_nod": (2.5, 0.4), "head_tilt": (2.0, 0.4), "head_turn": (4.0, 0.35), "side": (1.2, 0.7),
                "front": (1.2, 0.7), "roll": (1.5, 0.7), "elbow": (1.8, 0.7), "supination": (4.0, 0.5), "wrist_flex": (4.0, 0.6),
                "wrist_side": (2.0, 0.6), "shrug": (1.0, 0.3), "protract": (1.5, 0.3), "curl": (5.0, 0.4)}
"""Standard deviation (degrees; sway in metres) and highest frequency (Hz) of involuntary motion by channel."""
TREMOR = {"side": 0.25, "front": 0.25, "elbow": 0.35, "wrist_flex": 0.5, "head_nod": 0.15, "spine_side": 0.08}
"""Standard deviation, degrees, of the faster part, up to 5 Hz."""


def band_noise(t: Array, highest: float, rng: np.random.Generator, terms: int = 14) -> Array:
    """Smooth noise of unit variance at times `t` (s) with frequencies up to `highest` (Hz): a random Fourier series."""
    frequency, phase = rng.uniform(0.12, 1, terms) * highest, rng.uniform(0, 2 * np.pi, terms)
    return np.sqrt(2 / terms) * np.cos(2 * np.pi * np.multiply.outer(t, frequency) + phase).sum(-1)


def involuntary_motion(t: Array, rng: np.random.Generator) -> Array:
    """Sway, breathing, restlessness and tremor at times `t` (T,), of shape (T, `CHANNELS`)."""
    total = np.zeros((len(t), len(CHANNELS)))
    for column, channel in enumerate(CHANNELS):
        name = without_side(channel)
        size, highest = RESTLESSNESS.get(name, (0.0, 1.0))
        size = size if name.startswith("sway") else np.radians(size)
        total[:, column] = size * band_noise(t, highest, rng) + np.radians(TREMOR.get(name, 0.0)) * band_noise(t, 5.0, rng)
        total[:, column] += np.radians(0.4) * np.sin(2 * np.pi * 0.25 * t) if name in ("shrug", "spine_bow") else 0.0
    return total


def without_side(channel: str) -> str:
    """A channel's name without its side."""
    return channel.removeprefix("left_").removeprefix("right_")


Posture = dict[str, float]
Keys = list[tuple[float, Posture]]

PAUSE_SECONDS = 0.8
"""Seconds of standing before the first gesture, and for lowering the arms after the last."""


def both(**degrees: float) -> Posture:
    """The same arm channels on both sides, degrees."""
    return left(**degrees) | right(**degrees)


def left(**degrees: float) -> Posture:
    """Channels of the left arm, degrees."""
    return {f"left_{name}": float(np.radians(value)) for name, value in degrees.items()}


def right(**degrees: float) -> Posture:
    """Channels of the right arm, degrees."""
    return {f"right_{name}": float(np.radians(value)) for name, value in degrees.items()}


def trunk(**degrees: float) -> Posture:
    """Channels of pelvis, spine and head, degrees."""
    return {name: float(np.radians(value)) for name, value in degrees.items()}


STANDING = both(side=9, front=2, elbow=14, supination=8, wrist_flex=4, curl=20)
LEVEL = both(side=90)
T_POSE = both(side=90, elbow=3, curl=3)
HANGING_ARMS = both(side=7, elbow=5, curl=12)


def stand(seconds: float, rng: np.random.Generator) -> Keys:
    """Standing with the arms hanging."""
    return [(seconds / 2, {})]


def wave_hands(seconds: float, rng: np.random.Generator) -> Keys:
    """'Wave hands' of Liu 2011, Fig. 10: upper arms level, forearms up, waving to the sides in the frontal plane."""
    period, keys = rng.uniform(0.95, 1.25), [(0.9, both(side=84, roll=84, elbow=86))]
    phase = rng.uniform(0.2, 0.5)
    for n, t in enumerate(np.arange(0.9 + period / 2, seconds - 0.3, period / 2)):
        out, back = rng.uniform(35, 52), rng.uniform(92, 112)
        bends = (out, back) if n % 2 else (back, out)
        keys.append(
            (
                float(t),
                left(side=rng.uniform(80, 96), roll=rng.uniform(76, 92), elbow=bends[0])
                | right(side=rng.uniform(80, 96), roll=rng.uniform(76, 92), elbow=bends[1] * (1 - phase) + bends[0] * phase),
            )
        )
    return keys


def _swings(seconds: float, rng: np.random.Generator, ends: Sequence[Posture], between: Posture, period: float) -> Keys:
    """Swings from end to end through `between`, as often as the time allows."""
    keys = [(0.8, between)]
    count = max(1, round((seconds - 1.2) / period)) * len(ends)
    each = (seconds - 1.2) / count
    for n in range(count):
        vary = rng.uniform(0.85, 1.1)
        end = {name: between.get(name, 0.0) + vary * (value - between.get(name, 0.0)) for name, value in ends[n % len(ends)].items()}
        keys.append((0.8 + (n + rng.uniform(0.45, 0.6)) * each, between | end))
    return [*keys, (seconds - 0.3, between)]


def bend_aside(seconds: float, rng: np.random.Generator) -> Keys:
    """'Bend aside' of Liu 2011, Fig. 11: arms level, the trunk bends to one side and the other."""
    ends = [trunk(spine_side=sign * 26, pelvis_side=sign * 5, head_tilt=sign * 4) | {"sway_x": -0.03 * sign} for sign in (1, -1)]
    return _swings(seconds, rng, ends, T_POSE, 3.2)


def bow_forward(seconds: float, rng: np.random.Generator) -> Keys:
    """'Bow forward' of Liu 2011, Fig. 12: arms level, the trunk bows toward the camera."""
    return _swings(seconds, rng, [trunk(spine_bow=30, pelvis_bow=24, head_nod=10) | {"sway_y": 0.06}], T_POSE, 3.0)


def twist(seconds: float, rng: np.random.Generator) -> Keys:
    """Arms level, the trunk turns to the left and the right."""
    ends = [trunk(spine_twist=sign * 32, pelvis_twist=sign * 14, head_turn=sign * 6) for sign in (1, -1)]
    return _swings(seconds, rng, ends, T_POSE, 3.2)


def reach(seconds: float, rng: np.random.Generator) -> Keys:
    """The left hand toward the camera, then the right, then both; fewer if there is no time (some 2 s each)."""
    arms = (left, right, both)[-int(np.clip(seconds / 1.9, 1, 3)) :]
    each, keys = seconds / len(arms), []
    for n, chosen in enumerate(arms):
        aim = chosen(front=rng.uniform(74, 90), side=rng.uniform(-4, 14), elbow=rng.uniform(4, 22), supination=rng.uniform(0, 40), curl=15)
        turn = trunk(spine_twist={left: -8, right: 8, both: 0}[chosen], spine_bow=3)
        keys += [(each * (n + 0.44), aim | turn), (each * (n + 0.62), {**aim, **turn}), (each * (n + 0.98), {})]
    return keys


def forearms_up(seconds: float, rng: np.random.Generator) -> Keys:
    """Elbows beside the body, forearms raised and lowered, hands toward the shoulders."""
    up, down = both(side=18, front=12, elbow=120, supination=60), both(side=14, front=14, elbow=70, supination=50)
    return _swings(seconds, rng, [up], down, 1.8)


def overhead(seconds: float, rng: np.random.Generator) -> Keys:
    """Arms raised sideways above the head and lowered again."""
    return _swings(seconds, rng, [both(side=152, elbow=14, roll=20)], both(side=60, elbow=10), 2.4)


def shake_hands(seconds: float, rng: np.random.Generator) -> Keys:
    """The right hand held out to another person at arm's length, shaken up and down, and lowered; again after a while."""
    keys: Keys = []
    for begin in np.arange(0.0, max(seconds - 3.4, 0.1), 4.2):
        keys.append((float(begin) + 0.2, {}))
        for n, t in enumerate(np.arange(begin + 0.9, min(begin + 2.9, seconds - 0.4), 0.3)):
            up = (-1) ** n * rng.uniform(2, 4)
            keys.append((float(t), right(front=34 + up, side=4, roll=0, elbow=52 + up, supination=0, curl=30) | trunk(spine_bow=6)))
        keys.append((float(min(begin + 3.5, seconds - 0.1)), {}))
    return keys


RANDOM_LIMITS = {"spine_bow": (-5, 24), "spine_side": (-17, 17), "spine_twist": (-26, 26), "pelvis_bow": (-2, 12),
                 "pelvis_twist": (-10, 10), "head_nod": (-15, 22), "head_tilt": (-10, 10), "head_turn": (-35, 35), "side": (2, 130),
                 "front": (-18, 100), "roll": (-25, 75), "elbow": (6, 125), "supination": (-30, 70), "wrist_flex": (-30, 35),
                 "wrist_side": (-12, 15), "curl": (0, 40)}
"""Ranges of `random` motion, degrees: inside what healthy adults reach (Boone & Azen 1979)."""


def random(seconds: float, rng: np.random.Generator) -> Keys:
    """Smooth random motion of the upper body within `RANDOM_LIMITS`, below about 0.5 Hz, with pauses."""
    step = 0.16
    t = np.arange(0.7, max(seconds - 0.3, 0.9), step)
    pace = np.clip(1.4 + 1.6 * band_noise(t, 0.25, rng), 0.0, 1.6)
    own = np.cumsum(pace) * step
    table = np.zeros((len(t), len(CHANNELS)))
    for column, channel in enumerate(CHANNELS):
        low, high = np.radians(RANDOM_LIMITS.get(without_side(channel), (0, 0)))
        table[:, column] = low + (high - low) * (0.5 + 0.5 * np.tanh(0.9 * band_noise(own, 0.3, rng)))
    for side in ("left", "right"):
        swing = [CHANNELS.index(f"{side}_side"), CHANNELS.index(f"{side}_front")]
        size = np.hypot(*table[:, swing].T)
        table[:, swing] *= np.minimum(1, np.radians(140) / np.maximum(size, 1e-6))[:, None]
    table = clear_of_trunk(table)
    return [(float(when), dict(zip(CHANNELS, map(float, row)))) for when, row in zip(t, table)]


def clear_of_trunk(table: Array) -> Array:
    """Key postures (n, `CHANNELS`) with the arms moved outward and straightened if forearm or hand would enter trunk or head.

    Tested on the mean body with trunk and head as round sticks; the change is spread over neighbouring keys to keep the motion smooth.
    """
    table, body = table.copy(), Mannequin()
    for _ in range(12):
        figure = pose(body, table)
        joint = dict(zip(JOINTS, figure.joints.swapaxes(0, 1)))
        crown = joint["head"] + 0.6 * (joint["head"] - joint["neck"])
        for side in ("left", "right"):
            elbow, wrist, hand = (joint[f"{side}_{name}"] for name in ("elbow", "wrist", "hand"))
            points = [elbow + 0.5 * (wrist - elbow), wrist, wrist + 4.0 * (hand - wrist)]
            inside = [np.maximum(0.21 - _off(p, joint["pelvis"], joint["neck"]), 0.15 - _off(p, joint["head"], crown)) for p in points]
            excess = np.maximum(np.max(inside, 0), 0)
            push = np.maximum(excess, np.convolve(np.pad(excess, 2, "edge"), [0.1, 0.25, 0.3, 0.25, 0.1], "valid"))
            table[:, CHANNELS.index(f"{side}_side")] += 1.0 * push
            table[:, CHANNELS.index(f"{side}_roll")] += 1.5 * push
            table[:, CHANNELS.index(f"{side}_elbow")] *= 1 - 1.5 * np.minimum(push, 0.2)
    return table


def _off(points: Array, start: Array, end: Array) -> Array:
    """Distances (n,) of points (n, 3) from the line segments between `start` and `end`, (n, 3) each."""
    along = end - start
    t = np.clip(((points - start) * along).sum(1) / (along**2).sum(1), 0, 1)
    return np.linalg.norm(points - start - t[:, None] * along, axis=1)


GESTURES: dict[str, Callable[[float, np.random.Generator], Keys]] = {
    f.__name__: f for f in (stand, wave_hands, bend_aside, bow_forward, twist, reach, forearms_up, overhead, random, shake_hands)
}
"""All gestures by name."""

def gesture_postures(gestures: Sequence[tuple[str, float]], t: Array, rng: np.random.Generator, still: float = 1.0) -> Array:
    """Postures (T, `CHANNELS`) at times `t` (s) of gestures `(name, seconds)` one after another.

    Key postures are joined by shape-preserving cubics and smoothed. The person stands `PAUSE_SECONDS` before the first gesture and lowers
    the arms in the `PAUSE_SECONDS` after the last. still: factor on involuntary motion.
    """
    return clamp_joints(interpolate_keys(key_postures(gestures, rng), t) + still * involuntary_motion(t, rng))


def key_postures(gestures: Sequence[tuple[str, float]], rng: np.random.Generator) -> Keys:
    """Key postures of gestures `(name, seconds)` one after another, standing before and after."""
    begin, keys = PAUSE_SECONDS, [(0.0, {}), (0.5 * PAUSE_SECONDS, {})]
    for name, seconds in gestures:
        keys += [(begin + when, posture) for when, posture in GESTURES[name](seconds, rng)]
        begin += seconds
    return [*keys, (begin + PAUSE_SECONDS, {}), (begin + PAUSE_SECONDS + 1, {})]


def interpolate_keys(keys: Keys, t: Array, names: Sequence[str] = CHANNELS, rounding: float = 0.16) -> Array:
    """Values (T, names) at times `t` (s) interpolated through `keys`; channels that a key does not name are as in standing, or 0.

    rounding: seconds before and after a time that are averaged.
    """
    from scipy.interpolate import PchipInterpolator

    table = np.zeros((len(keys), len(names)))
    for row, (_, posture) in zip(table, keys):
        for name, value in (STANDING | posture).items():
            if name in names:
                row[names.index(name)] = value
    path = PchipInterpolator([when for when, _ in keys], table)
    return time_average(lambda when: path(np.clip(when, 0, None)), t, rounding)


def time_average(values: Callable[[Array], Array], t: Array, rounding: float) -> Array:
    """`values` about times `t` (T,), s, averaged over `rounding` seconds before and after."""
    window = np.linspace(-1, 1, 9)
    weight = np.exp(-2 * window**2) / np.exp(-2 * window**2).sum()
    return np.sum([w * values(t + rounding * x) for w, x in zip(weight, window)], 0)


def clamp_joints(postures: Array) -> Array:
    """Postures (T, `CHANNELS`) with elbows and fingers kept from bending backward."""
    postures = postures.copy()
    for side in ("left", "right"):
        for name, (low, high) in {"curl": (0.0, 1.5), "elbow": (0.02, 2.5)}.items():
            column = CHANNELS.index(f"{side}_{name}")
            postures[:, column] = np.clip(postures[:, column], low, high)
    return postures


def duration(gestures: Sequence[tuple[str, float]]) -> float:
    """Seconds from the first to the last frame of gestures `(name, seconds)`."""
    return PAUSE_SECONDS + sum(seconds for _, seconds in gestures) + PAUSE_SECONDS


def posture(**named: float) -> Array:
    """One posture (1, `CHANNELS`) of named channels, rad; all others 0, without involuntary motion."""
    q = np.zeros((1, len(CHANNELS)))
    for name, value in named.items():
        q[0, CHANNELS.index(name)] = value
    return q
