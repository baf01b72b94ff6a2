"""Motions of the whole body: gaits against published values, feet on the floor, laws that hold for every motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shadowpuppet.errors import SettingsError
from shadowpuppet.synthetic import Gesture, Mannequin, Spec, demo_spec, proving_ground, spec_from
from shadowpuppet.synthetic.movement.actions import ACTIONS
from shadowpuppet.synthetic.movement.gait import PathWalk
from shadowpuppet.synthetic.movement.gait_curves import KNEE_ZERO, RUN, STANDING_TILT, WALK, curve
from shadowpuppet.synthetic.movement.gait_cycle import JOGGING, WALKING, GaitCycle, Sole, stride_length
from shadowpuppet.synthetic.movement.gestures import LEVEL, posture
from shadowpuppet.synthetic.movement.paths import Path
from shadowpuppet.synthetic.movement.sequence import SOFT_LIMIT
from shadowpuppet.synthetic.person.kinematics import CHANNELS, SEGMENTS, SIDES, pose, pose_over, soft_minimum
from shadowpuppet.synthetic.person.mannequin import FRACTIONS, GROWTH, JOINTS
from shadowpuppet.synthetic.recording import perform

MAN = Mannequin()
WHOLE = sorted([*ACTIONS, "walk", "jog"])


def at(figure, name):
    return figure.joints[:, JOINTS.index(name)]


def spec(*motions, **changes) -> Spec:
    gestures = tuple(Gesture(**({"motion": m, "seconds": 6.0} if isinstance(m, str) else m)) for m in motions)
    return replace(Spec(motion=gestures, rate=60.0), **changes)


def go(*motions, seed=3, **changes):
    return perform(spec(*motions, **changes), np.random.default_rng(seed))


def soles(body, figure):
    """Heel, ball and toes' tips (T, 2, 3, 3) of both feet, metres over the floor where the shoe stands."""
    long, high = body.measure("foot_length"), body.length("ankle")
    points = {"foot": [(0, 0.14 * long, -high), (0, -0.48 * long, -high)], "toes": [(0, -0.24 * long, -0.02)]}
    found = []
    for side in SIDES:
        own = []
        for part, offsets in points.items():
            n = SEGMENTS.index(f"{side}_{part}")
            own += [figure.origin[:, n] + figure.rotation[:, n] @ np.array(offset) for offset in offsets]
        found.append(np.stack(own, 1))
    return np.stack(found, 1)


def bend(figure, a, b, c):
    """Angle (T,) at joint b, degrees; 0 is straight."""
    u, v = at(figure, b) - at(figure, a), at(figure, c) - at(figure, b)
    return np.degrees(np.arccos(np.clip((u * v).sum(1) / np.linalg.norm(u, axis=1) / np.linalg.norm(v, axis=1), -1, 1)))


def steady(jogging=False, speed=None, seconds=24.0, body=MAN, path="line", size=300.0, seed=5):
    """A gait far from its start and end: (walk, figure, phase of the left leg)."""
    walk = PathWalk(body, seconds, np.random.default_rng(seed), jogging, speed, path, size)
    t = np.arange(3.0, seconds - 3.0, 1 / 100)
    return walk, pose_over(body, *walk.at(t), SOFT_LIMIT), np.interp(t, walk.ticks, walk.phase)


def by_phase(values, phase, places):
    """Mean values (n,) within 1 % of the cycle about the places (n,)."""
    return np.array([values[np.abs((phase - place + 0.5) % 1 - 0.5) < 0.01].mean() for place in places])


# What there was stays


@pytest.mark.parametrize(("n", "frame", "joint", "wanted"), [
    (0, 30, "left_hand", (0.433904997, -0.030840211, 1.716025612)),
    (5, 75, "head", (-0.071125359, -0.136618846, 1.531173866)),
    (7, 155, "right_knee", (-0.0739088, -0.01525616, 0.367863766)),
    (10, 30, "left_hand", (0.482544258, -0.048766519, 1.70596337)),
    (14, 218, "right_knee", (-0.099492006, -0.014145491, 0.506843448)),
])  # fmt: skip
def test_the_motions_on_which_settings_were_chosen_stay_as_they_are(n, frame, joint, wanted):
    _, found = perform([*proving_ground()[:14], demo_spec()][n], np.random.default_rng([1, n]))
    np.testing.assert_allclose(at(found, joint)[frame], wanted, atol=2e-9)


@pytest.mark.parametrize(("name", "wanted"), [
    ("box", -135.122589), ("jog", -92.459863), ("jump", -85.543916), ("kneel", -34.084659), ("lift", -80.496554),
    ("march", -118.350827), ("random_body", -113.350090), ("sit", -119.987044), ("sit_down", -121.609135),
    ("squat", -93.096875), ("turn_around", -102.284140), ("walk", -227.746995)])  # fmt: skip
def test_the_actions_before_which_settings_were_chosen_stay_as_they_are(name, wanted):
    joints = go(name)[1].joints
    assert (joints * np.random.default_rng(1).standard_normal(joints.shape)).sum() == pytest.approx(wanted, abs=1e-5)


@pytest.mark.parametrize(("seed", "kind", "stature", "girth"), [
    (1, "man", 1.7798453, 1.0264350), (9, "child", 1.2516879, 0.7807431), (13, "woman", 1.7459124, 1.0766451)])  # fmt: skip
def test_the_people_on_whom_settings_were_chosen_stay_as_they_are(seed, kind, stature, girth):
    body = Mannequin.draw(np.random.default_rng(seed), kind)
    assert (body.stature, body.girth) == pytest.approx((stature, girth), abs=1e-6)
    assert body.leg_length == 1.0


# Published curves


def test_walking_has_the_published_key_values():
    """Perry & Burnfield (2010): knee 20 degrees in loading, 60 to 65 in swing; hip from 30 of flexion to 10 of extension."""
    phase = np.linspace(0, 1, 201)
    hip, knee, ankle = (curve(WALK[name], phase) for name in ("hip", "knee", "ankle"))
    assert hip[0] == pytest.approx(30, abs=2)
    assert -11 < hip.min() < -6
    assert 0.48 < phase[hip.argmin()] < 0.58
    assert 14 < (knee[:60] + KNEE_ZERO).max() < 21
    assert 60 < (knee + KNEE_ZERO).max() < 67
    assert 0.70 < phase[knee.argmax()] < 0.76
    assert -18 < ankle.min() < -10
    assert 0.60 < phase[ankle.argmin()] < 0.68


def test_running_has_the_published_key_values():
    """Novacheck (1998): knee some 40 to 45 degrees in stance, 90 in swing; the hip's flexion 45 to 50 against a tilted pelvis."""
    phase = np.linspace(0, 1, 201)
    hip, knee, ankle = (curve(RUN[name], phase) for name in ("hip", "knee", "ankle"))
    assert 36 < knee[:70].max() < 46
    assert 80 < knee.max() < 95
    assert 42 < hip.max() + STANDING_TILT < 50
    assert 18 < ankle[:70].max() < 28


def test_curves_are_smooth_and_periodic():
    for values in [*WALK.values(), *RUN.values()]:
        phase = np.linspace(-1, 2, 3001)
        found = curve(values, phase)
        np.testing.assert_allclose(found[:1000], found[1000:2000], atol=1e-9)
        np.testing.assert_allclose(curve(values, np.arange(len(values)) / len(values)), values, atol=1e-9)
        assert np.abs(np.diff(found, 2)).max() < 0.05


# Walking and jogging


@pytest.mark.parametrize(("jogging", "speed"), [(False, 0.9), (False, 1.3), (False, 1.7), (True, 2.2), (True, 2.6), (True, 3.4)])
def test_gaits_of_the_figure_follow_the_published_curves(jogging, speed):
    """Legs solved over feet that stay differ by a few degrees from the angles alone: most just before and after contact."""
    walk, found, phase = steady(jogging, speed)
    gait, places = walk.cycle.gait, np.arange(0, 1, 0.05)
    whole, more = np.arange(200) / 200, np.sqrt(walk.cycle.amplitude)
    knee = gait.knee(whole).min() + more * (gait.knee(places) - gait.knee(whole).min())
    off = by_phase(bend(found, "left_hip", "left_knee", "left_ankle"), phase, places) - knee
    assert np.sqrt((off**2).mean()) < 6.0
    assert np.abs(off).max() < 15.0
    down = at(found, "left_hip") - at(found, "left_knee")
    swing = np.degrees(np.arctan2(down[:, 1], down[:, 2]))
    mean = gait.thigh(whole).mean()
    thigh = mean + walk.cycle.amplitude * (gait.thigh(places) - mean)
    assert np.sqrt(((by_phase(swing, phase, places) - thigh) ** 2).mean()) < 9.0
    assert np.corrcoef(by_phase(swing, phase, places), thigh)[0, 1] > 0.9


def test_a_walking_person_bends_hip_and_knee_as_published():
    _, found, phase = steady(False, 1.3)
    knee = bend(found, "right_hip", "right_knee", "right_ankle")
    own = phase - 0.5
    assert 10 < by_phase(knee, own, np.linspace(0.1, 0.2, 5)).max() < 22
    assert 58 < by_phase(knee, own, np.linspace(0.65, 0.8, 9)).max() < 68
    assert by_phase(knee, own, [0.4])[0] < 14


@pytest.mark.parametrize(("jogging", "most"), [(False, (0.01, 0.03)), (True, (0.005, 0.02))])
def test_the_pelvis_sways_over_the_foot_that_stands(jogging, most):
    walk, found, phase = steady(jogging)
    side = at(found, "pelvis")[:, 0]
    stands = walk.cycle.middle + 0.08  # of the left leg, in the middle of its stance; to the left lies +X
    left, right = by_phase(side, phase, [stands, stands + 0.5]) - side.mean()
    assert most[0] < left < most[1]
    assert most[0] < -right < most[1]


def test_a_jogging_person_flies_and_a_walking_one_does_not():
    for jogging in (False, True):
        walk, found, phase = steady(jogging)
        low = soles(MAN, found)[..., 2].min(2)
        flying = (low > 0.006).all(1)
        if not jogging:
            assert not flying.any()
            double = (low < 0.004).all(1).mean()
            assert 0.12 < double < 0.42
            continue
        assert 0.08 < flying.mean() < 0.4
        between = by_phase(flying.astype(float), 2 * phase, [2 * walk.cycle.gait.carries + 0.12])  # after toe-off, before contact
        assert between[0] > 0.9


@pytest.mark.parametrize(("jogging", "elbow"), [(False, (10, 45)), (True, (75, 110))])
def test_arms_swing_against_the_legs(jogging, elbow):
    _, found, _ = steady(jogging)
    for side, other in (("left", "right"), ("right", "left")):
        hand = -(at(found, f"{side}_hand") - at(found, "neck"))[:, 1]
        ankle = -(at(found, f"{side}_ankle") - at(found, "pelvis"))[:, 1]
        across = -(at(found, f"{other}_ankle") - at(found, "pelvis"))[:, 1]
        assert np.corrcoef(hand, ankle)[0, 1] < -0.6
        assert np.corrcoef(hand, across)[0, 1] > 0.6
        angles = bend(found, f"{side}_shoulder", f"{side}_elbow", f"{side}_wrist")
        assert elbow[0] < angles.min()
        assert angles.max() < elbow[1]


def test_speed_stride_and_cadence_are_those_of_people():
    for jogging, speed, stride, cadence in ((False, 1.3, (1.25, 1.5), (105, 125)), (True, 2.8, (1.85, 2.2), (152, 180))):
        walk, found, phase = steady(jogging, speed)
        seconds, gone = (len(phase) - 1) / 100, np.linalg.norm(np.diff(at(found, "pelvis")[:, :2], axis=0), axis=1).sum()
        assert gone / seconds == pytest.approx(speed, rel=0.06)
        steps = 2 * (phase[-1] - phase[0]) / seconds * 60
        assert cadence[0] < steps < cadence[1]
        assert stride[0] < walk.cycle.stride < stride[1]
    small = Mannequin.draw(np.random.default_rng(1), "child", age=6)
    child, _, _ = steady(body=small)
    assert child.speed < 1.2
    assert child.cycle.stride / child.speed < 0.95  # quick short steps


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000), jogging=st.booleans(), share=st.floats(0, 1), path=st.sampled_from(["line", "circle", "ellipse"]),
       size=st.floats(1.0, 6.0), kind=st.sampled_from(["woman", "man", "child"]))  # fmt: skip
def test_feet_stay_where_they_stand_and_over_the_floor(seed, jogging, share, path, size, kind):
    rng = np.random.default_rng(seed)
    body = Mannequin.draw(rng, kind)
    low, high = ((1.7, 4.0) if jogging else (0.5, 1.8))
    speed = (low + share * (high - low)) * np.sqrt(body.stature / 1.75)
    gesture = Gesture(motion="jog" if jogging else "walk", seconds=6.0, speed=max(speed, 1.6 if jogging else 0.4), path=path, size=size)
    _, found = perform(Spec(body=body, motion=(gesture,), rate=100.0), rng)
    points, long = soles(body, found), body.measure("foot_length")
    assert points[..., 2].min() > -0.004
    for foot in range(2):
        flat = (points[:, foot, :, 2] < 0.002).all(1)
        assert flat.sum() > 50
        both = flat[1:] & flat[:-1]
        moved = np.linalg.norm(np.diff(points[:, foot], axis=0)[both], axis=-1)
        assert moved.max() < 0.0025  # a flat foot lies still: metres in 10 ms; the quickest pass through flat while rolling
        ball = points[:, foot, 1]
        down = ball[:, 2] < 0.001
        runs = np.split(np.arange(len(down)), np.flatnonzero(np.diff(down.astype(int))) + 1)
        slides = [np.linalg.norm(ball[run, :2] - ball[run[0], :2], axis=1).max() for run in runs if down[run[0]] and len(run) > 8]
        assert max(slides) < 0.08 * long
    lengths = np.linalg.norm(at(found, "left_knee") - at(found, "left_ankle"), axis=1)
    np.testing.assert_allclose(lengths, body.length("shank"), atol=1e-9)


def test_paths_are_what_they_are_called():
    s = np.arange(0, 40, 0.02)
    circle = Path("circle", 2.0, 40.0).place(s, 0 * s)
    assert np.ptp(np.linalg.norm(circle - [2.0, 0.0], axis=1)) < 1e-3  # to the left of -Y lies +X
    ellipse = Path("ellipse", 2.0, 40.0).place(s, 0 * s)
    middle = (ellipse.max(0) + ellipse.min(0)) / 2
    across, along = (ellipse - middle).T
    np.testing.assert_allclose((across / 1.2) ** 2 + (along / 2.0) ** 2, 1, atol=0.02)
    line = Path("line", 3.0, 40.0).place(s, 0 * s)
    assert np.ptp(line[:, 1]) < 4.2
    assert np.ptp(line[:, 0]) < 1.0
    assert (np.diff(line[:, 1]) < 0).any()
    assert (np.diff(line[:, 1]) > 0).any()
    for name in ("circle", "ellipse", "line"):
        path = Path(name, 2.5, 40.0)
        step = np.linalg.norm(np.diff(path.place(s, 0 * s), axis=0), axis=1)
        np.testing.assert_allclose(step, 0.02, rtol=1e-3)
        ahead = np.diff(path.place(s, 0 * s), axis=0) / 0.02
        turn = path.heading(s[:-1] + 0.01)
        np.testing.assert_allclose(ahead, np.column_stack([np.sin(turn), -np.cos(turn)]), atol=2e-3)


def test_who_turns_leans_inward_and_slows_down():
    walk, found, _ = steady(True, 2.6, path="circle", size=1.5)
    middle = np.array([1.5, 0.0])
    feet = (at(found, "left_ankle") + at(found, "right_ankle")) / 2
    inward = np.linalg.norm(feet[:, :2] - middle, axis=1) - np.linalg.norm(at(found, "neck")[:, :2] - middle, axis=1)
    lean = np.degrees(np.arctan2(inward, at(found, "neck")[:, 2]))
    assert 8 < np.median(lean) < 14
    gone = np.linalg.norm(np.diff(at(found, "pelvis")[:, :2], axis=0), axis=1).sum() * 100 / len(lean)
    assert gone < 0.95 * walk.speed
    _, straight, _ = steady(True, 2.6)
    upright = at(straight, "neck") - (at(straight, "left_ankle") + at(straight, "right_ankle")) / 2
    assert abs(np.median(upright[:, 0])) < 0.03


def test_walking_on_the_spot_stays_and_walking_goes_round_the_middle():
    _, still = go({"motion": "walk", "seconds": 10, "path": "spot"})
    assert np.ptp(at(still, "pelvis")[:, :2], axis=0).max() < 0.15
    _, round_ = go({"motion": "walk", "seconds": 14, "path": "circle", "size": 1.0})
    pelvis = at(round_, "pelvis")[:, :2]
    np.testing.assert_allclose(pelvis.max(0) + pelvis.min(0), 0, atol=0.05)
    assert np.linalg.norm(pelvis, axis=1).max() < 1.2


def test_the_cycle_fits_body_and_speed():
    for kind, jogging in (("man", False), ("child", False), ("woman", True)):
        body = Mannequin.draw(np.random.default_rng(4), kind)
        hip = body.rest()["pelvis"][2]
        for share in (0.8, 1.0, 1.25):
            speed = share * (2.6 if jogging else 1.3) * np.sqrt(hip / 0.93)
            cycle = GaitCycle(body, JOGGING if jogging else WALKING, speed, stride_length(speed, hip, jogging))
            phase = np.linspace(0, 0.999, 500)
            gone = cycle.progress(phase)
            assert (gone[phase <= cycle.gait.carries] == 0).all()
            assert gone.min() > -0.03
            assert gone.max() < 1.03
            assert cycle.lift(phase).min() > -0.002
            assert 0.6 < cycle.amplitude < 1.7


def test_soles_roll_without_slipping_or_sinking():
    sole = Sole.of(MAN)
    pitch = np.radians(np.linspace(-80, 30, 221))
    forward, up = sole.rolled(pitch)
    for lever, part in ((-sole.heel, pitch >= 0), (sole.ball, (pitch < 0) & (pitch > np.radians(-20)))):
        contact = forward + lever * np.cos(pitch) + sole.ankle * np.sin(pitch), up + lever * np.sin(pitch) - sole.ankle * np.cos(pitch)
        np.testing.assert_allclose(contact[0][part], lever, atol=1e-9)
        np.testing.assert_allclose(contact[1][part], 0, atol=1e-9)
    assert np.abs(np.diff(forward)).max() < 0.01
    assert forward[110 + 50] == pytest.approx(forward[160])
    assert (np.diff(up)[pitch[1:] < np.radians(-5)] < 0.0015).all()


# Every motion of the whole body


@pytest.mark.parametrize("name", WHOLE)
def test_whole_body_motions_are_smooth_upright_at_their_ends_and_whole(name):
    for seconds, kind in ((4.0, "child"), (7.0, "man")):
        body = Mannequin.draw(np.random.default_rng(2), kind)
        _, found = go({"motion": name, "seconds": seconds}, body=body, still=0.0)
        speed = np.diff(found.joints, axis=0) * 60
        assert np.linalg.norm(speed, axis=-1).max() < (14.0 if name in ("box", "jump") else 9.0)
        assert np.linalg.norm(np.diff(speed, axis=0) * 60, axis=-1).max() < 330.0
        assert np.linalg.norm(np.diff(speed, axis=0) * 60, axis=-1)[:, 0].max() < 70.0  # the pelvis
        assert soles(body, found)[..., 2].min() > -0.004
        for a, b, length in (("hip", "knee", body.length("thigh")), ("knee", "ankle", body.length("shank"))):
            for side in SIDES:
                np.testing.assert_allclose(np.linalg.norm(at(found, f"{side}_{a}") - at(found, f"{side}_{b}"), axis=1), length, atol=1e-9)
        for end in (0, -1):
            ankles = at(found, "left_ankle")[end] - at(found, "right_ankle")[end]
            assert np.linalg.norm(ankles) == pytest.approx(0.26 * (body.length("thigh") + body.length("shank")), rel=0.05)
            upright = at(found, "neck")[end] - at(found, "pelvis")[end]
            assert upright[2] / np.linalg.norm(upright) > 0.99
            assert np.abs(speed[end]).max() < 0.05


@settings(max_examples=40, deadline=None)
@given(name=st.sampled_from(WHOLE), seconds=st.floats(2, 12), seed=st.integers(0, 10_000))
def test_any_length_will_do(name, seconds, seed):
    body = Mannequin.draw(np.random.default_rng(seed))
    _, found = go({"motion": name, "seconds": seconds}, seed=seed, body=body)
    assert np.isfinite(found.joints).all()
    assert np.isfinite(found.rotation).all()
    assert np.linalg.norm(np.diff(at(found, "pelvis"), 2, axis=0) * 3600, axis=1).max() < 100.0
    assert soles(body, found)[..., 2].min() > -0.004


@pytest.mark.parametrize("name", WHOLE)
def test_knees_bend_backward_only_and_joints_stay_within_reach(name):
    _, found = go(name, still=0.0)
    for side in SIDES:
        hip, knee, ankle = (at(found, f"{side}_{joint}") for joint in ("hip", "knee", "ankle"))
        ahead = -found.rotation[:, SEGMENTS.index("pelvis"), :, 1]
        assert (((knee - (hip + ankle) / 2) * ahead).sum(1) > -0.02).all()
        assert bend(found, f"{side}_hip", f"{side}_knee", f"{side}_ankle").max() < 150
        assert bend(found, f"{side}_shoulder", f"{side}_elbow", f"{side}_wrist").max() < 145
        trunk = at(found, "neck") - at(found, "pelvis")
        thigh = np.degrees(np.arccos(np.clip(((knee - hip) * -trunk).sum(1) / np.linalg.norm(knee - hip, axis=1)
                                             / np.linalg.norm(trunk, axis=1), -1, 1)))  # fmt: skip
        assert thigh.max() < 135


@pytest.mark.parametrize("name", WHOLE)
def test_the_same_seed_is_the_same_motion_at_any_rate_and_another_seed_another(name):
    slow, fast = (go(name, rate=rate)[1] for rate in (5.0, 20.0))
    np.testing.assert_allclose(slow.joints, fast.joints[::4], atol=1e-9)
    other = go(name, rate=5.0, seed=4)[1]
    moved = np.linalg.norm(other.joints - slow.joints, axis=-1)
    assert moved.max() > 0.03


def test_a_performance_goes_on_where_the_last_part_ended():
    parts = ["wave_hands", {"motion": "walk", "seconds": 6, "path": "line", "size": 2.0}, "box", "turn_around", "jog", "reach", "jump"]
    times, found = go(*parts, seed=8)
    speed = np.diff(found.joints, axis=0) * 60
    change = np.linalg.norm(np.diff(speed, axis=0) * 60, axis=-1)
    ends = 0.8 + np.cumsum([6.0] * len(parts))
    for end in ends[:-1]:
        near = np.abs(times[1:-1] - end) < 0.3
        assert change[near].max() < 120
        now = np.abs(times[:-1] - end) < 0.02
        assert np.abs(speed[now][:, [JOINTS.index(f"{side}_ankle") for side in SIDES]]).max() < 0.02
        assert np.abs(speed[now][:, 0]).max() < 0.1
    assert (np.abs(times - 0.4) < 0.3).any()
    assert change.max() < 330


def test_turning_around_turns_around_and_the_next_walk_goes_the_other_way():
    _, found = go({"motion": "turn_around", "seconds": 4}, {"motion": "walk", "seconds": 5, "path": "line", "size": 9.0})
    pelvis = at(found, "pelvis")
    assert pelvis[-1, 1] - pelvis[0, 1] > 2.0  # at first the person faces -Y
    turned = -found.rotation[[0, -1], 0, :, 1]
    assert turned[0] @ turned[1] < -0.8


def test_heading_can_be_turned_at_the_beginning():
    walk = {"motion": "walk", "seconds": 5, "path": "line", "size": 9.0}
    plain, turned = (go(walk, turn_deg=degrees, still=0.0)[1] for degrees in (0, 90))
    R = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    np.testing.assert_allclose(turned.joints, plain.joints @ R.T, atol=1e-9)


def test_acts_do_what_they_are_called():
    still = {name: go(name, still=0.0)[1] for name in ACTIONS}
    knee = {name: bend(found, "left_hip", "left_knee", "left_ankle").max() for name, found in still.items()}
    assert at(still["lift"], "left_hand")[:, 2].min() < 0.3
    assert at(still["lift"], "right_hand")[:, 1].min() < -0.25
    assert knee["squat"] > 70
    assert knee["sit"] > 70
    assert at(still["sit"], "pelvis")[:, 1].max() > 0.25  # behind the feet
    assert np.ptp(at(still["sit"], "pelvis")[:, 2]) > 0.3
    assert soles(MAN, still["jump"])[..., 2].min((1, 2)).max() > 0.15
    assert np.maximum(*(at(still["march"], f"{side}_knee")[:, 2] for side in SIDES)).max() > 0.62
    reach = np.linalg.norm(at(still["box"], "right_hand") - at(still["box"], "right_shoulder"), axis=1)
    assert np.ptp(reach) > 0.25
    assert at(still["box"], "left_ankle")[200, 1] < at(still["box"], "right_ankle")[200, 1] - 0.2
    for side in SIDES:
        np.testing.assert_allclose(np.ptp(at(still["random_body"], f"{side}_ankle"), axis=0), 0, atol=1e-9)


@pytest.mark.parametrize(("values", "words"), [
    ({"motion": "walk", "speed": 3.0}, "speed: found 3, expected 0.4 to 2 for walk"),
    ({"motion": "jog", "speed": 1.0}, "speed: found 1, expected 1.6 to 5 for jog"),
    ({"motion": "walk", "path": "square"}, "motion.0.path: input should be 'line', 'circle', 'ellipse' or 'spot', found 'square'"),
    ({"motion": "walk", "size": 0.1}, "motion.0.size: input should be greater than or equal to 0.5"),
    ({"motion": "walks"}, "motion.0.motion: input should be 'stand'"),
    ({"motion": "walk", "pace": 1.0}, "motion.0.pace: no such setting; possible are file, file_rate, motion, path, seconds, size"),
])  # fmt: skip
def test_impossible_motions_are_reported(values, words):
    with pytest.raises(SettingsError, match=words):
        spec_from({"motion": [values]})


@given(a=st.floats(-2, 2), b=st.floats(-2, 2))
def test_the_lesser_of_two_is_rounded_off_only_where_they_meet(a, b):
    found = float(soft_minimum(np.array([a]), np.array([b]), 0.1)[0])
    assert min(a, b) - 0.1 / 4 - 1e-12 <= found <= min(a, b)
    if abs(a - b) > 0.1:
        assert found == min(a, b)
    assert float(soft_minimum(np.array([a]), np.array([np.inf]), 0.1)[0]) == a


# People


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10_000), kind=st.sampled_from(["woman", "man", "child"]), bmi=st.floats(16.5, 36))
def test_people_of_a_height_and_mass_are_drawn(seed, kind, bmi):
    height = {"woman": 1.7, "man": 1.7, "child": 1.3}[kind]
    person = Mannequin.draw(np.random.default_rng(seed), kind, stature=height, bmi=min(bmi, 24) if kind == "child" else bmi)
    slim = Mannequin.draw(np.random.default_rng(seed), kind, stature=height, bmi=15.0 if kind == "child" else 16.4)
    assert person.stature == height
    assert person.girth > slim.girth
    assert person.arm_length == slim.arm_length


def test_children_have_childrens_proportions():
    legs = []
    for age, stature in zip(GROWTH["age"], GROWTH["stature"]):
        child = Mannequin.draw(np.random.default_rng(11), "child", age=age)
        assert abs(child.stature / stature - 1) < 0.1
        legs.append(child.rest()["pelvis"][2] / child.stature)
        assert child.measure("head_height") / child.stature > 0.12
    assert (np.diff(legs) > 0).all()
    assert 0.47 < legs[0] < 0.50
    assert legs[-1] == pytest.approx(sum(FRACTIONS[name][0] for name in ("thigh", "shank", "ankle")))
    by_height = Mannequin.draw(np.random.default_rng(11), "child", stature=1.15)
    assert by_height.leg_length == pytest.approx(0.933)


@pytest.mark.parametrize(("kind", "wishes", "words"), [
    ("man", {"age": 8}, "age: found 8 for a man, expected 4 to 14 for a child"),
    ("child", {"age": 3}, "age: found 3 for a child"),
    ("woman", {"stature": 2.6}, "stature: found 2.6, expected 0.9 to 2.2"),
    ("man", {"bmi": 80}, "bmi: found 80, expected 1[0-9].* to 5"),
])  # fmt: skip
def test_impossible_people_are_reported(kind, wishes, words):
    with pytest.raises(SettingsError, match=words):
        Mannequin.draw(np.random.default_rng(1), kind, **wishes)


def test_a_fist_is_a_fist_and_an_open_hand_stays_as_it_was():
    def towards(curl, side):
        n, hand = (SEGMENTS.index(f"{side}_{part}") for part in ("fingers", "hand"))
        found = pose(MAN, posture(**(LEVEL | {f"{side}_curl": curl})))
        sign = 1.0 if side == "left" else -1.0
        return found.rotation[0, hand].T @ found.rotation[0, n] @ [sign, 0, 0], found, n

    for side, sign in (("left", 1.0), ("right", -1.0)):
        np.testing.assert_allclose(towards(0.9, side)[0], [sign, 0, 0], atol=1e-9)
        along, found, n = towards(1.5, side)
        assert along[2] < -0.85  # to the palm, which looks down
        assert along @ [sign, 0, 0] < -0.3
        wrist = at(found, f"{side}_wrist")[0]
        assert np.linalg.norm(found.origin[0, n] - wrist) == pytest.approx(0.46 * MAN.length("hand"))


def test_walks_are_made_of_all_channels():
    postures, stance = PathWalk(MAN, 5.0, np.random.default_rng(1)).at(np.arange(0, 5, 0.1))
    assert postures.shape == (50, len(CHANNELS))
    assert [np.shape(part) for part in stance] == [(50, 3), (50, 2, 3), (50, 2, 3, 3), (50, 2), (50, 2, 3)]


def test_the_mean_man_and_woman_have_the_mass_index_of_the_survey(rng):
    """Volume within the bare surface, by points on a grid, times the density of water."""
    from naive_surface import LIGHTS, naive_distance

    from shadowpuppet.synthetic import Viewpoint
    from shadowpuppet.synthetic.person.clothes import Clothes
    from shadowpuppet.synthetic.person_renderer import PersonRenderer
    from shadowpuppet.synthetic.scene_renderer import dressed

    bare = Clothes(looseness=0.0)
    for stature, build, wanted in ((1.629, 0.0, 25.6), (1.756, 1.0, 27.8)):
        body = Mannequin(stature=stature, build=build)
        shape = pose(body, posture(**LEVEL))
        surface = dressed(body, bare)
        R, o = shape.rotation[0, surface.segment], shape.origin[0, surface.segment]
        axes, origin = R @ surface.frame, o + (R @ surface.start[..., None])[..., 0]
        step = 0.03
        axis = [np.arange(low + step / 2, high, step) for low, high in ((-1.0, 1.0), (-0.3, 0.25), (0.0, stature + 0.03))]
        points = np.stack(np.meshgrid(*axis, indexing="ij"), -1).reshape(-1, 3)
        points = points[(np.abs(points[:, 0]) < 0.3) | (points[:, 2] > 0.7 * stature)] + rng.uniform(-0.5, 0.5, 3) * step
        joints = PersonRenderer(Viewpoint(size=(16, 16)).camera(), surface, bare, LIGHTS)._joins(shape, 0)
        with np.errstate(divide="ignore", invalid="ignore"):
            inside = naive_distance(points, surface, axes, origin, joints) < 0
        assert inside.sum() * step**3 * 1000 / stature**2 == pytest.approx(wanted, rel=0.1)
