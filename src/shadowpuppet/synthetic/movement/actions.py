"""Whole-body actions: boxing, lifting, squatting, jumping and others, each some seconds long."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from shadowpuppet.synthetic.movement.gait_cycle import Sole
from shadowpuppet.synthetic.movement.gestures import Keys, Posture, band_noise, both, left, right, trunk
from shadowpuppet.synthetic.movement.gestures import random as random_keys
from shadowpuppet.synthetic.movement.keyframes import HALF_STANCE, FootStep, Hop, KeyframeMotion
from shadowpuppet.synthetic.movement.resting import BACKWARD, kneeling_knee, seated_pelvis
from shadowpuppet.synthetic.person.mannequin import Mannequin

GUARD = both(front=38, side=12, roll=6, elbow=122, supination=10, curl=85, wrist_flex=0)
"""Guard of a boxer: fists in front of the chin, elbows in."""


def box(body: Mannequin, seconds: float, rng: np.random.Generator) -> KeyframeMotion:
    """Boxing: guard with the left foot forward, then jabs, crosses, hooks and uppercuts, weight shifts and a few steps."""
    begin, end = 0.9, seconds - 0.9
    stand: Posture = GUARD | trunk(turn=-22, spine_twist=-8, pelvis_bow=4, spine_bow=8, head_turn=24, head_nod=4)
    stand |= {"drop": 0.045, "right_heel": np.radians(12), "ahead": 0.03}
    steps = [FootStep(0, 0.12, 0.36, 0.15, 0.24, -0.12), FootStep(1, 0.5, 0.36, -0.16, -0.18, -0.62)]
    keys: Keys = [(begin, stand)]
    t, shift = begin + 0.2, np.zeros(2)
    while t < end - 0.75:
        if rng.uniform() < 0.22 and t < end - 1.6:
            shift = np.clip(shift + rng.uniform(-0.12, 0.12, 2), -0.15, 0.15)
            steps += [FootStep(0, t, 0.25, 0.15 + shift[0], 0.24 + shift[1], -0.12, 0.03)]
            steps += [FootStep(1, t + 0.26, 0.25, -0.16 + shift[0], -0.18 + shift[1], -0.62, 0.03)]
            t += 0.6
            keys.append((t, stand | {"aside": shift[0], "ahead": 0.03 + shift[1]}))
        name = str(rng.choice(["jab", "jab", "cross", "left_hook", "right_hook", "uppercut"]))
        strike = stand | PUNCHES[name] | {"aside": shift[0]}
        strike["ahead"] = PUNCHES[name].get("ahead", 0.05) + shift[1]
        reach = rng.uniform(0.14, 0.2)
        keys += [(t + reach, strike), (t + 2.1 * reach, stand | {"aside": shift[0], "ahead": 0.03 + shift[1]})]
        t += 2.1 * reach + rng.uniform(0.08, 0.45)
    steps += [FootStep(1, end, 0.36, -HALF_STANCE, 0.0), FootStep(0, end + 0.38, 0.36, HALF_STANCE, 0.0)]
    return KeyframeMotion(body, seconds, [*keys, (end, keys[-1][1])], steps, rounding=0.06)


PUNCHES: dict[str, Posture] = {
    "jab": left(front=86, side=4, roll=0, elbow=8, supination=-30, curl=85, protract=6) | trunk(spine_twist=-16, turn=-26, head_turn=36)
    | {"ahead": 0.09, "drop": 0.05},
    "cross": right(front=86, side=4, roll=0, elbow=8, supination=-30, curl=85, protract=8)
    | trunk(spine_twist=28, pelvis_twist=16, turn=-12, head_turn=-22) | {"ahead": 0.10, "drop": 0.055, "right_heel": np.radians(32)},
    "left_hook": left(side=62, front=44, roll=10, elbow=88, supination=-10, curl=85)
    | trunk(spine_twist=-34, pelvis_twist=-12, head_turn=50) | {"left_heel": np.radians(18), "drop": 0.06},
    "right_hook": right(side=62, front=44, roll=10, elbow=88, supination=-10, curl=85)
    | trunk(spine_twist=30, pelvis_twist=16, head_turn=-22) | {"right_heel": np.radians(30), "drop": 0.06, "ahead": 0.06},
    "uppercut": right(front=48, side=6, roll=0, elbow=96, supination=60, curl=85)
    | trunk(spine_twist=22, pelvis_twist=14, spine_bow=-2, head_turn=-14) | {"right_heel": np.radians(28), "drop": 0.02, "ahead": 0.07},
}  # fmt: skip
"""Changes of the guard at the far end of each punch."""


def lift(body: Mannequin, seconds: float, rng: np.random.Generator) -> KeyframeMotion:
    """Lifting something from the floor with bent knees and back, holding it, and putting it back."""
    deep, bow = rng.uniform(0.3, 0.42), rng.uniform(-6, 6)
    down = both(front=74, side=6, roll=-8, elbow=12, supination=20, curl=30) | trunk(pelvis_bow=46 + bow, spine_bow=36, head_nod=-20)
    down |= {"drop": deep, "ahead": -0.10}
    hold = both(front=28, side=8, roll=-18, elbow=72, supination=50, curl=30) | trunk(spine_bow=-4)
    touch = down | {name: down[name] - np.radians(6) for name in ("left_front", "right_front")}
    share = seconds / 6.0
    return KeyframeMotion(body, seconds, [(0.25 * seconds, down), (0.25 * seconds + 0.3 * share, touch), (0.46 * seconds, hold),
                               (0.58 * seconds, hold | trunk(spine_twist=rng.uniform(-15, 15))), (0.78 * seconds, down),
                               (0.78 * seconds + 0.25 * share, touch)])  # fmt: skip


def squat(body: Mannequin, seconds: float, rng: np.random.Generator) -> KeyframeMotion:
    """Knee bends with the arms forward, about 2.4 s each."""
    count = max(1, round((seconds - 0.6) / 2.4))
    each, keys = (seconds - 0.6) / count, []
    for n in range(count):
        low = both(front=82, side=4, elbow=10, curl=10) | trunk(pelvis_bow=26, spine_bow=14, head_nod=-16)
        low |= {"drop": rng.uniform(0.3, 0.46), "ahead": -0.09}
        keys += [(0.3 + (n + 0.45) * each, low), (0.3 + (n + 0.52) * each, low), (0.3 + (n + 0.98) * each, {})]
    return KeyframeMotion(body, seconds, keys)


def sit(body: Mannequin, seconds: float, rng: np.random.Generator) -> KeyframeMotion:
    """Sitting down on an invisible seat, the hands on the thighs, and standing up again."""
    lean = both(front=22, side=10, elbow=45, curl=15, supination=-10) | trunk(pelvis_bow=40, spine_bow=16, head_nod=-14)
    seat = both(front=20, side=10, elbow=62, curl=15, supination=-20) | trunk(pelvis_bow=-4, spine_bow=8)
    return _seated(body, seconds, lean, seat | {"drop": rng.uniform(0.40, 0.46), "ahead": -0.42})


def sit_down(body: Mannequin, seconds: float, rng: np.random.Generator) -> KeyframeMotion:
    """Sitting down on a chair that stands behind the person, and standing up again; a spec's obstacle with `seat` is this chair."""
    lean = both(front=22, side=10, elbow=45, curl=15, supination=-10) | trunk(pelvis_bow=38, spine_bow=16, head_nod=-14)
    seat = both(front=rng.uniform(18, 24), side=11, roll=-30, elbow=52, supination=-57, curl=20) | trunk(pelvis_bow=-4, spine_bow=8)
    leg = body.length("thigh") + body.length("shank")
    deep = (leg + Sole.of(body).ankle + 0.02 - seated_pelvis(body)) / leg
    return _seated(body, seconds, lean, seat | {"drop": deep, "ahead": -BACKWARD})


def _seated(body: Mannequin, seconds: float, lean: Posture, low: Posture) -> KeyframeMotion:
    """Down to the posture `low` and up again, leaning on both ways."""
    half, pace = lean | {"drop": 0.6 * low["drop"], "ahead": -0.30}, min(seconds / 4.0, 1.0)
    return KeyframeMotion(body, seconds, [(1.0 * pace, half), (1.5 * pace, low), (seconds - 1.5 * pace, low), (seconds - 1.0 * pace, half)])


def kneel(body: Mannequin, seconds: float, rng: np.random.Generator) -> KeyframeMotion:
    """Going down on both knees over the tips of the toes, kneeling, and standing up again."""
    leg, sole, tucked = body.length("thigh") + body.length("shank"), Sole.of(body), np.radians(50)
    knee = kneeling_knee(body)
    forward, rise = (float(part) for part in sole.rolled(np.array(-tucked)))
    ahead = forward + np.sqrt(body.length("shank") ** 2 - (rise - knee) ** 2)
    deep = (leg + sole.ankle + 0.02 - knee - body.length("thigh")) / leg
    bend = trunk(pelvis_bow=rng.uniform(14, 20), spine_bow=10, head_nod=-10) | both(front=24, side=14, elbow=30)
    rest = trunk(pelvis_bow=2, spine_bow=3)

    def down(share: float, forward: float, heels: float) -> Posture:
        return {"drop": share * deep, "ahead": forward * ahead / leg, "left_heel": heels * tucked, "right_heel": heels * tucked}

    pace = min(seconds / 5.0, 1.0)
    way = [(0.5, bend | down(0.45, 0.12, 0.55)), (1.1, bend | down(0.93, 0.62, 1.0)), (1.6, rest | down(1.0, 1.0, 1.0))]
    back = [(seconds - when * pace, posture) for when, posture in reversed(way)]
    return KeyframeMotion(body, seconds, [*((0.3 * pace + when * pace, posture) for when, posture in way), *back])


def march(body: Mannequin, seconds: float, rng: np.random.Generator) -> KeyframeMotion:
    """Stepping on the spot, knees raised, arms swinging against the legs."""
    period = rng.uniform(0.95, 1.15)
    high, keys, steps = rng.uniform(0.24, 0.42), [], []
    for n in range(int((seconds - 0.8) / (period / 2))):
        foot, begin = n % 2, 0.35 + n * period / 2
        sign = 1 - 2 * foot
        steps.append(FootStep(foot, begin, 0.46 * period, sign * HALF_STANCE, 0.0, 0.0, high))
        fore, back = (right, left) if foot == 0 else (left, right)
        swing = fore(front=30, elbow=62, side=9) | back(front=-16, elbow=30, side=9)
        keys.append((begin + 0.23 * period, swing | trunk(spine_twist=5 * sign, pelvis_side=-3 * sign, spine_side=3 * sign)
                     | {"aside": -0.05 * sign, "drop": 0.01}))  # fmt: skip
    return KeyframeMotion(body, seconds, keys, steps)


def jump(body: Mannequin, seconds: float, rng: np.random.Generator) -> KeyframeMotion:
    """Jumps on the spot from bent knees, the arms swinging up, about 2.2 s each."""
    count = max(1, int((seconds - 0.2) / 2.1))
    each, keys, hops = seconds / count, [], []
    crouch = both(front=-34, side=14, elbow=20, curl=30) | trunk(pelvis_bow=24, spine_bow=18, head_nod=-12) | {"ahead": -0.05}
    up = both(front=118, side=20, elbow=24, curl=20) | trunk(pelvis_bow=0, spine_bow=-3)
    land = both(front=40, side=18, elbow=40, curl=20) | trunk(pelvis_bow=20, spine_bow=14, head_nod=-8) | {"ahead": -0.04}
    for n in range(count):
        air, leaves = rng.uniform(0.36, 0.48), n * each + 0.42 * each
        heels: Posture = {name: np.radians(38) for name in ("left_heel", "right_heel")}
        keys += [(leaves - 0.34, crouch | {"drop": rng.uniform(0.2, 0.28)}), (leaves, up | heels),
                 (leaves + 0.6 * air, up | heels), (leaves + air, land | {"drop": 0.02} | {k: v / 2 for k, v in heels.items()}),
                 (leaves + air + 0.18, land | {"drop": 0.2}), (n * each + 0.97 * each, {})]  # fmt: skip
        hops.append(Hop(leaves, air))
    return KeyframeMotion(body, seconds, keys, hops=hops, rounding=0.1)


def turn_around(body: Mannequin, seconds: float, rng: np.random.Generator) -> KeyframeMotion:
    """Turning round on the spot in small steps, by about half a turn to one side."""
    count = max(2, int((seconds - 0.8) / 0.55))
    whole = float(rng.choice([-1, 1]) * np.pi * rng.uniform(0.9, 1.1))
    each, keys, steps = (seconds - 0.8) / count, [], []
    for n in range(count + 1):
        # the foot on the inside of the turn goes first
        foot = (n + (whole < 0)) % 2
        to, sign = whole * min(n + 1, count) / count, 1 - 2 * foot
        aside, ahead = HALF_STANCE * sign * np.cos(to), -HALF_STANCE * sign * np.sin(to)
        begin = 0.25 + n * (seconds - 0.8) / (count + 1)
        steps.append(FootStep(foot, begin, 0.75 * each, aside, ahead, to, 0.05))
        keys.append((begin + 0.5 * each, {"turn": to - 0.3 * whole / count, "head_turn": 0.15 * np.sign(whole)}))
    return KeyframeMotion(body, seconds, keys, steps)


def random_body(body: Mannequin, seconds: float, rng: np.random.Generator) -> KeyframeMotion:
    """Smooth random motion of the whole body over planted feet: arms and trunk as in `random`, knees bending, weight shifting."""
    keys = random_keys(seconds, rng)
    t = np.array([when for when, _ in keys])
    drop, aside, ahead, turn = (band_noise(t, highest, rng) for highest in (0.35, 0.3, 0.3, 0.25))
    own = {"drop": 0.11 * (1 + np.tanh(drop)), "aside": 0.10 * np.tanh(aside), "ahead": 0.05 * np.tanh(ahead),
           "turn": np.radians(18) * np.tanh(turn)}
    return KeyframeMotion(body, seconds, [(when, posture | {name: float(values[n]) for name, values in own.items()})
                               for n, (when, posture) in enumerate(keys)])  # fmt: skip


ACTIONS: dict[str, Callable[[Mannequin, float, np.random.Generator], KeyframeMotion]] = {
    f.__name__: f for f in (box, lift, squat, sit, sit_down, kneel, march, jump, turn_around, random_body)
}
"""All actions by name."""
