"""From joints to a prior: whatever the rate, the gaps and the number of clips, it knows the poses that were made."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from motions import prior as made_prior
from movers import walk

from shadowpuppet.body.models import average_sizes, make_body
from shadowpuppet.body.skeleton import Skeleton
from shadowpuppet.errors import ShadowPuppetError, ShadowPuppetWarning
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.motion.prior.settings import PriorSettings
from shadowpuppet.motion.prior.training import GLOBAL_DOFS, matched, modelled, train_prior

FEW = PriorSettings(regions=6, starts=1)


def train(*tables: JointTable, settings: PriorSettings = FEW, **more):
    return train_prior(np.random.default_rng(0), {f"clip {n}": table for n, table in enumerate(tables)}, settings, **more)


@pytest.fixture(scope="module")
def learnt():
    return train(walk(90)[0], settings=PriorSettings(regions=15))


def test_a_made_gait_is_known_afterwards(learnt):
    _, poses = walk(60, start=0.4, turn=2.0)
    skeleton = make_body("anatomical", average_sizes("anatomical", 1.75)).skeleton
    prior = learnt.prior
    assert prior.names == tuple(name for name in skeleton.dof_names if name not in GLOBAL_DOFS)
    assert (len(prior.names), prior.rate, len(prior.subspaces)) == (28, 60.0, 15)
    mine = poses[:, skeleton.dof_indices(prior.names)]
    swinging = mine.std(0) > 0.02
    lost = (prior.reconstruct(prior.encode(mine)) - mine)[:, swinging]
    assert np.degrees(np.sqrt((lost**2).mean())) < 2.0  # what the joints do not show, such as a straight limb's twist, is not the made one
    assert learnt.clips[0].fitted.residual < 0.002
    assert learnt.joint_error < 0.005


def test_errors_are_those_of_the_poses_that_were_learnt(learnt):
    prior, (clip,) = learnt.prior, learnt.clips
    columns = clip.fitted.body.skeleton.dof_indices(prior.names)
    lost = prior.reconstruct(prior.encode(clip.parts[0][:, columns])) - clip.parts[0][:, columns]
    assert learnt.error == pytest.approx(float(np.sqrt((lost**2).mean())))
    assert learnt.error <= learnt.fit.errors[-1] + 1e-9  # rad
    coarse = train(walk(90)[0], settings=PriorSettings(regions=2, dimensions=1))
    assert coarse.error > 2 * learnt.error
    assert coarse.joint_error > 2 * learnt.joint_error


@pytest.mark.parametrize("rate", [30.0, 60.0, 120.0])
def test_clips_of_any_rate_are_brought_to_one(rate):
    trained = train(walk(int(rate) + 1, rate)[0])
    clip, = trained.clips
    assert len(clip.parts[0]) == 61
    assert len(clip.fitted.times) == min(int(rate), 60) + 1
    reference = train(walk(61, 60.0)[0]).clips[0].parts[0]
    off = clip.fitted.body.points(clip.parts[0]) - clip.fitted.body.points(reference)
    assert np.sqrt((off**2).sum(2).mean()) < 0.006


def test_gaps_are_cut_and_joints_that_nobody_saw_are_left_out():
    table, _ = walk(60)
    places = table.positions.copy()
    places[20:24, table.names.index("left_wrist")] = np.nan
    places[50:52] = np.nan
    places[:, table.names.index("right_hand")] = np.nan
    trained = train(JointTable(table.times, table.names, places))
    clip, = trained.clips
    assert [len(part) for part in clip.parts] == [20, 26, 8]
    assert clip.frames == 54
    assert "right_hand" not in clip.fitted.joints.names
    assert np.isfinite(np.concatenate(clip.parts)).all()
    moves = trained.prior.transitions @ np.ones(6)
    np.testing.assert_allclose(moves, 1)


def test_mirror_images_are_learnt_from_too():
    table, _ = walk(60)
    one, both = train(table), train(table, settings=replace(FEW, mirrored=True))
    assert [clip.name for clip in both.clips] == ["clip 0", "clip 0, mirrored"]
    skeleton = both.clips[0].fitted.body.skeleton
    (plain,), (mirror,) = (clip.parts for clip in both.clips)
    left, right = (skeleton.dof_names.index(f"{side}_knee_flexion") for side in ("left", "right"))
    np.testing.assert_allclose(mirror[:, left], plain[:, right], atol=0.02)
    assert np.abs(plain[:, left] - plain[:, right]).max() > 0.3
    assert one.clips[0].frames * 2 == sum(clip.frames for clip in both.clips)


def test_the_paper_s_reading_has_place_and_heading_without_whole_turns():
    table, _ = walk(30, turn=3.0)
    turned, _ = walk(30, turn=-3.0)
    trained = train(table, turned, settings=replace(FEW, dofs="all"))
    skeleton = trained.clips[0].fitted.body.skeleton
    assert trained.prior.names == skeleton.dof_names == modelled(skeleton, "all")
    headings = trained.prior.subspaces.centres[:, skeleton.dof_names.index("root_heading")]
    assert np.ptp(headings) < 0.5  # 2 pi - 6, not 6


def test_the_paper_s_body_is_learnt_too():
    trained = train(walk(40)[0], body="cylinders")
    assert len(trained.prior.names) == 21
    assert {"left_shoulder_flexion", "head_twist"} <= set(trained.prior.names)


def test_the_number_of_regions_is_chosen_among_candidates():
    trained = train(walk(60)[0], candidates=(2, 4))
    assert trained.choice is not None
    assert len(trained.prior.subspaces) == trained.choice.regions
    assert trained.choice.candidates == (2, 4)


def test_the_same_seed_learns_the_same(learnt):
    again = train(walk(90)[0], settings=PriorSettings(regions=15))
    np.testing.assert_array_equal(again.prior.transitions, learnt.prior.transitions)
    np.testing.assert_array_equal(again.prior.subspaces.centres, learnt.prior.subspaces.centres)


def test_what_cannot_be_learnt_from_is_said(rng):
    table, _ = walk(30)
    with pytest.raises(ShadowPuppetError, match="clips: found none"):
        train()
    with pytest.raises(ShadowPuppetError, match="found 30 different poses in 30 frames, expected 40 or more for 40 regions; learn fewer"):
        train(table, settings=PriorSettings(regions=40))
    with pytest.raises(ShadowPuppetError, match="clip 0: no joint left_elbow; needed are"):
        train(table.select(["pelvis", "left_shoulder", "right_shoulder"]))
    with pytest.raises(ShadowPuppetError, match=r"clip 0: found .* from hips to shoulders, expected .* metres"):
        train(replace(table, positions=1000 * table.positions))
    every = table.positions.copy()
    every[::2, 3] = np.nan
    with pytest.raises(ShadowPuppetError, match="clip 0: found no two frames in a row with all joints, expected a motion"):
        train(replace(table, positions=every))


def test_joints_of_another_body_are_doubted_or_refused(rng):
    table, _ = walk(30)
    for size, said in ((0.08, None), (0.25, "joints lie .* mm off the body on average, .* expected a person with the body's joints")):
        shifted = table.positions.copy()
        for joint in ("left_wrist", "right_ankle", "neck", "left_knee"):
            shifted[:, table.names.index(joint)] += size * rng.standard_normal((30, 3))
        odd = replace(table, positions=shifted)
        if said is None:
            with pytest.warns(ShadowPuppetWarning, match=r"clip 0: joints lie .* mm off the body on average, .*: are its joints those"):
                train(odd)
        else:
            with pytest.raises(ShadowPuppetError, match=said):
                train(odd)


def test_who_does_not_move_is_reported(rng):
    table, _ = walk(1)
    places = np.repeat(table.positions, 40, 0)
    still = JointTable(np.arange(40) / 60, table.names, places + 2e-4 * rng.standard_normal(places.shape))
    with pytest.warns(ShadowPuppetWarning, match="clip 0: nobody moves there") as warned:
        train(still)
    line = train.__code__.co_firstlineno + 1
    assert {(warning.filename, warning.lineno) for warning in warned} == {(__file__, line)}  # the caller's line, not ours


@settings(max_examples=30, deadline=None)
@example(seed=0, rate=30.0, film=60.0)
@example(seed=0, rate=120.0, film=60.0)
@example(seed=0, rate=60.0, film=60.0)
@given(seed=st.integers(0, 99), rate=st.sampled_from([30.0, 59.94, 60.0, 120.0]), film=st.sampled_from([15.0, 30.0, 60.0, 100.0]))
def test_a_prior_for_films_of_another_rate_keeps_its_laws(seed, rate, film):
    skeleton = _skeleton(6)
    before = made_prior(np.random.default_rng(seed), names=skeleton.dof_names, rate=rate)
    after = matched(before, skeleton, film)
    np.testing.assert_allclose(after.transitions.sum(1), 1)
    assert (after.transitions >= 0).all()
    assert after.rate == film
    if film == rate:
        np.testing.assert_allclose(after.transitions, before.transitions)
    if rate == 2 * film:
        np.testing.assert_allclose(after.transitions, before.transitions @ before.transitions)
    if 2 * rate == film:  # two steps of half the time go about as far as one
        np.testing.assert_allclose(np.diag(after.transitions), (1 + np.diag(before.transitions)) / 2)
    stationary = np.linalg.matrix_power(before.transitions, 4096)[0]
    np.testing.assert_allclose(stationary @ after.transitions, stationary, atol=1e-9)


def test_a_prior_of_another_body_is_refused(learnt):
    with pytest.raises(ShadowPuppetError, match=r"prior: found 'chest_x' among what it models, expected degrees of freedom of the body"):
        matched(learnt.prior, make_body("cylinders", average_sizes("cylinders", 1.7)).skeleton, 60.0)
    with pytest.raises(ShadowPuppetError, match="prior: found 'no names'"):
        matched(made_prior(np.random.default_rng(0)), _skeleton(6), 60.0)


def _skeleton(dofs: int) -> Skeleton:
    from shadowpuppet.body.skeleton import Dof, Joint

    return Skeleton((Joint("a", None),), tuple(Dof(f"a_{n}", "a", "x") for n in range(dofs)))
