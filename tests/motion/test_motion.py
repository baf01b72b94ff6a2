"""Motion: what is collected is what was given, parts are parts, and what does not fit is said."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.motion.limbs import doubtful_joints, limbs_of
from shadowpuppet.motion.motion import BLANK, PER_FRAME, STATUSES, JointTable, Motion, MotionBuilder, MotionFrame

DOFS, JOINTS = ("torso_y", "torso_bow"), ("neck", "left_hand", "right_hand")


def a_frame(seed: int, time: float, status: str = "tracked", **without) -> MotionFrame:
    rng = np.random.default_rng(seed)
    values = {"pose": rng.normal(size=2), "joints": rng.normal(size=(3, 3)), "pose_sd": rng.random(2),
              "joint_sd": rng.random((3, 3)), "cost": rng.random() * 100, "overlap": rng.random()}
    return MotionFrame(time, status, **values | without)


def a_motion(statuses=("tracked", "uncertain", "lost", "predicted", "absent")) -> Motion:
    builder = MotionBuilder("cardbox", DOFS, JOINTS)
    for i, status in enumerate(statuses):
        builder.append(a_frame(i, i / 15, status))
    return builder.build()


def assert_same(a: Motion, b: Motion) -> None:
    for field in dataclasses.fields(Motion):
        np.testing.assert_array_equal(getattr(a, field.name), getattr(b, field.name))


statuses = st.lists(st.sampled_from(STATUSES), max_size=8)


@given(statuses)
def test_a_motion_has_what_was_appended_and_blanks_where_nobody_is_seen(words):
    motion = a_motion(words)
    assert len(motion) == len(words)
    assert motion.status.tolist() == words
    for i, status in enumerate(words):
        frame = a_frame(i, i / 15)
        assert (motion.times[i], motion.cost[i], motion.overlap[i]) == (frame.time, frame.cost, frame.overlap)
        given_values = {"poses": frame.pose, "pose_sd": frame.pose_sd, "joints": frame.joints, "joint_sd": frame.joint_sd}
        for name, value in given_values.items():
            kept = getattr(motion, name)[i]
            np.testing.assert_array_equal(kept, np.full_like(kept, np.nan) if status in BLANK else value)


@given(statuses, st.slices(8))
def test_a_part_is_the_motion_of_its_frames(words, part):
    whole = a_motion(words)
    if part.step is not None and part.step < 0:
        part = slice(part.start, part.stop, -part.step)
    some = whole[part]
    for name in PER_FRAME:
        np.testing.assert_array_equal(getattr(some, name), getattr(whole, name)[part])
    assert (some.dof_names, some.joint_names, some.body_name) == (DOFS, JOINTS, "cardbox")


def test_a_part_by_a_mask_and_the_joints_alone():
    motion = a_motion()
    seen = motion[~np.isin(motion.status, BLANK)]
    assert seen.status_counts == {"tracked": 1, "uncertain": 1, "predicted": 1}
    np.testing.assert_array_equal(seen.table.select(["left_hand"]).positions[:, 0], seen.joints[:, 1])


@given(st.lists(st.sampled_from(STATUSES), min_size=1, max_size=6), st.data())
def test_limbs_have_statuses_of_their_own_or_their_frames(words, data):
    builder, wanted = MotionBuilder("cardbox", DOFS, JOINTS), []
    for i, status in enumerate(words):
        own = data.draw(st.none() | st.tuples(*[st.sampled_from(STATUSES)] * 3))
        builder.append(a_frame(i, i / 15)._replace(status=status, limb_status=own))
        wanted.append((status,) * 3 if own is None or status in BLANK else own)
    motion = builder.build()
    assert motion.limbs == ("trunk", "left_arm", "right_arm")
    assert list(map(tuple, motion.limb_status.tolist())) == wanted
    unvouched = [word == "tracked" and "tracked" not in own for word, own in zip(words, wanted, strict=True)]
    assert motion.status.tolist() == ["uncertain" if unvouched[i] else word for i, word in enumerate(words)]
    vouched_for_nothing = dataclasses.replace(motion, limb_status=np.full((len(words), 3), "predicted"))
    assert "tracked" not in vouched_for_nothing.status
    for k, limb in enumerate(motion.limbs):
        counts = motion.limb_status_counts[limb]
        assert sum(counts.values()) == len(words)
        assert all(count == sum(row[k] == status for row in wanted) for status, count in counts.items())


@pytest.mark.parametrize(("limbs", "said"), [
    (("tracked",), r"limb_status: found shape \(1,\), expected \(3,\)"),
    (("tracked", "tracked", "asleep"), "status: found 'asleep', expected one of"),
])
def test_malformed_limb_statuses_are_refused_and_nothing_added(limbs, said):
    builder = MotionBuilder("cardbox", DOFS, JOINTS)
    with pytest.raises(ShadowPuppetError, match=said):
        builder.append(a_frame(0, 0.0)._replace(limb_status=limbs))
    assert len(builder.build()) == 0


def test_doubtful_joints_are_those_of_doubtful_limbs():
    joints = ("neck", "left_hand", "right_hand", "right_elbow", "left_ankle")
    assert limbs_of(joints) == ("trunk", "left_arm", "right_arm", "left_leg")
    assert doubtful_joints(joints, ("tracked", "lost", "uncertain", "predicted")) == {"right_hand", "right_elbow", "left_ankle"}
    assert doubtful_joints(joints, None) == frozenset()


def test_what_is_left_out_is_not_a_number():
    builder = MotionBuilder("cardbox", DOFS, JOINTS)
    kept = builder.append(MotionFrame(0.0, "tracked", pose=[0.1, 0.2]))
    assert np.isnan(kept.joints).all()
    motion = builder.build()
    np.testing.assert_array_equal(motion.poses, [[0.1, 0.2]])
    assert all(np.isnan(getattr(motion, name)).all() for name in ("pose_sd", "joints", "joint_sd", "cost", "overlap"))


def test_collecting_goes_on_after_a_look():
    builder = MotionBuilder("cardbox", DOFS, JOINTS)
    builder.append(a_frame(0, 0.0))
    early = builder.build()
    builder.append(a_frame(1, 1.0))
    assert_same(early, builder.build()[:1])


@pytest.mark.parametrize(("frame", "said"), [
    (MotionFrame(0.5, "tracked"), r"frame 1: time: found 0.5 s, expected more than 0.5"),
    (MotionFrame(np.nan, "tracked"), "time: found nan"),
    (MotionFrame(1.0, "asleep"), "status: found 'asleep', expected one of absent, lost, predicted, tracked, uncertain"),
    (MotionFrame(1.0, "uncertainly"), "status: found 'uncertainly'"),
    (MotionFrame(1.0, "tracked", pose=np.zeros(3)), r"pose: found shape \(3,\), expected \(2,\)"),
    (MotionFrame(1.0, "tracked", joints=np.zeros((2, 3))), r"joints: found shape \(2, 3\), expected \(3, 3\)"),
    (MotionFrame(1.0, "tracked", joint_sd=np.full((3, 3), np.inf)), "joint_sd: found infinity"),
    (MotionFrame(1.0, "tracked", cost=np.inf), "cost: found infinity"),
])
def test_a_frame_that_does_not_fit_is_said_and_not_kept(frame, said):
    builder = MotionBuilder("cardbox", DOFS, JOINTS)
    builder.append(a_frame(0, 0.5))
    before = builder.build()
    with pytest.raises(ShadowPuppetError, match=said):
        builder.append(frame)
    assert_same(before, builder.build())


def test_an_interrupt_within_a_frame_loses_that_frame_only():
    builder = MotionBuilder("cardbox", DOFS, JOINTS)
    builder.append(a_frame(0, 0.0))
    builder._rows.extend([1.0, 2.0])  # what an interrupt in the middle of `append` leaves
    assert len(builder.build()) == 1


@pytest.mark.parametrize("name", [name for name in PER_FRAME if name != "times"])
def test_a_shape_that_does_not_fit_is_said(name):
    motion = a_motion()
    with pytest.raises(ShadowPuppetError, match=rf"{name}: found shape .*, expected \(5"):
        dataclasses.replace(motion, **{name: getattr(motion, name)[:4]})


@pytest.mark.parametrize("name", ["poses", "joints", "joint_sd", "pose_sd"])
def test_a_value_where_nobody_is_seen_is_said(name):
    motion = a_motion()
    values = getattr(motion, name).copy()
    values[4] = 0.0
    with pytest.raises(ShadowPuppetError, match=f"{name}: found values in frame 4, which is absent"):
        dataclasses.replace(motion, **{name: values})


@pytest.mark.parametrize("times", [[0, 1, 1, 2, 3], [0, 1, np.nan, 2, 3], [0, 1, 2, 3, np.inf], [[0, 1, 2, 3, 4]]])
def test_times_that_do_not_increase_are_said(times):
    with pytest.raises(ShadowPuppetError, match="times: found"):
        dataclasses.replace(a_motion(), times=np.array(times, float))


@pytest.mark.parametrize("names", [("a", "a"), ("a", ""), ("a", " b"), ("a", "b_sd")])
def test_names_that_no_table_can_have_are_said(names):
    with pytest.raises(ShadowPuppetError, match="names of degrees of freedom: found"):
        MotionBuilder("cardbox", names, JOINTS)
    with pytest.raises(ShadowPuppetError, match="names of joints: found"):
        JointTable(np.zeros(1), names, np.zeros((1, 2, 3)))


def test_an_unknown_joint_is_said():
    with pytest.raises(ShadowPuppetError, match="unknown joint 'toe'; there are: left_hand, neck, right_hand"):
        a_motion().table.select(["neck", "toe"])


@pytest.mark.parametrize("shape", [(2, 3), (3, 3, 3), (2, 2, 3), (2, 3, 2), (2, 9)])
def test_a_table_of_another_shape_is_said(shape):
    with pytest.raises(ShadowPuppetError, match=r"positions: found shape .*, expected \(2, 3, 3\)"):
        JointTable(np.arange(2.0), JOINTS, np.zeros(shape))
