"""The tracker on masks that its own model drew: follows, repeats, looks at no later frame, says when it is lost, finds again."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from people import camera, picture

from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.errors import SettingsError, TrackingError
from shadowpuppet.tracking.monocular.pose_search import search_pose
from shadowpuppet.tracking.monocular.settings import MonocularSettings, make_settings
from shadowpuppet.tracking.monocular.stages import FilterStage
from shadowpuppet.tracking.monocular.tracker import MonocularTracker, State
from shadowpuppet.tracking.resampling import SCHEMES
from shadowpuppet.tracking.silhouette_cost import Observation, silhouette_costs

FLAT = ("torso+left_arm+right_arm",)
ARMS = ("left_shoulder", "left_elbow", "left_hand", "right_shoulder", "right_elbow", "right_hand")


@cache
def view(body: str = "cardbox") -> Picture:
    return picture(body)


def wave(frames: int, body: str = "cardbox", y: float = 0.0, speed: float = 0.15) -> tuple[np.ndarray, list[np.ndarray]]:
    """Poses (T, D) of someone who waves with the left arm, leans a little and lets the right one hang; and their masks."""
    s, skeleton = speed * np.arange(frames), view(body).body.skeleton
    right = {"right_shoulder_abduction": 0.4, "right_elbow_flexion": 0.2}
    moving = {
        "torso_y": y + 0.05 * np.sin(s), "torso_bend": 0.08 * np.sin(s), "left_shoulder_abduction": 1.3 + 0.3 * np.sin(2 * s),
        "left_elbow_roll": 1.4 + 0 * s, "left_elbow_flexion": 0.7 + 0.4 * np.cos(s),
    }  # fmt: skip
    poses = np.array([skeleton.pose(**right, **dict(zip(moving, values))) for values in zip(*moving.values())])
    return poses, [view(body).mask(pose) for pose in poses]


def tracker(preset: str = "liu2011", body: str = "cardbox", **overrides) -> MonocularTracker:
    return MonocularTracker(view(body), make_settings(preset, overrides))


def track(of: MonocularTracker, masks: Iterable[np.ndarray], seed: int = 0) -> list[State]:
    """One state a mask."""
    rng, states = np.random.default_rng(seed), []
    for mask in masks:
        states.append(of.step(rng, states[-1], mask) if states else of.start(rng, mask))
    return states


def same(one: State, other: State) -> bool:
    return all(np.array_equal(a, b) for p, q in zip(one.particles, other.particles, strict=True) for a, b in zip(p, q, strict=True)) and (
        np.array_equal(one.pose, other.pose) and one[2:-1] == other[2:-1]
    )


# It follows -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("preset", "body"), [("liu2011", "cardbox"), ("liu2011", "boxes"), ("default", "rounded")])
def test_a_wave_is_followed(preset, body):
    poses, masks = wave(40, body)
    states = track(tracker(preset, body), masks)
    assert {state.status for state in states} == {"tracked"}
    assert min(state.overlap for state in states) > 0.85
    found = view(body).points(np.array([state.pose for state in states]), ARMS)
    across = np.linalg.norm((found - view(body).points(poses, ARMS))[..., :2], axis=-1)  # depth is what one camera sees least
    assert np.median(across) < 0.05
    assert across.max() < 0.35


@pytest.mark.parametrize("preset", ["liu2011", "default"])
def test_the_start_settles_on_what_the_search_found_roughly(preset):
    mask = wave(1)[1][0]
    of = tracker(preset)
    found = search_pose(of.picture, mask)
    rough = of.observe(mask, found.pose).cost_and_overlap(of.picture.draw(found.pose))[0]
    assert of.start(np.random.default_rng(0), mask).cost < 0.6 * rough


def test_a_state_says_what_its_pose_costs():
    poses, masks = wave(6)
    for ignore in (True, False):
        of = tracker(ignore_legs=ignore)
        states = track(of, masks)
        for before, state, mask in zip(states, states[1:], masks[1:]):
            observation = of.observe(mask, before.pose)
            assert state.cost == silhouette_costs(of.picture, observation, state.pose[None])[0]
            assert (state.cost, state.overlap) == observation.cost_and_overlap(of.picture.draw(state.pose))
        assert (of.observe(masks[0], poses[0]).ignore != 0).any() == (ignore and view().legs(poses[0])[masks[0]].any())


def test_a_tracker_without_settings_is_the_default():
    assert MonocularTracker(view()).settings == MonocularSettings() == make_settings()


# It repeats, and looks at no later frame ------------------------------------------------------------------------------


@pytest.mark.parametrize("preset", ["liu2011", "default"])
def test_same_seed_same_particles_another_seed_others(preset):
    masks = wave(5)[1]
    one, again, other = (track(tracker(preset), masks, seed) for seed in (0, 0, 1))
    assert all(same(a, b) for a, b in zip(one, again))
    assert not any(np.array_equal(a.pose, b.pose) for a, b in zip(one[1:], other[1:]))


def test_later_masks_change_no_earlier_pose():
    masks = wave(8)[1]
    other = [*masks[:5], np.zeros_like(masks[0]), ~masks[0], masks[2]]
    whole, changed = track(tracker("default"), masks), track(tracker("default"), other)
    assert all(same(a, b) for a, b in zip(whole[:5], changed[:5]))
    assert not same(whole[5], changed[5])


def test_a_step_needs_the_state_and_changes_neither_it_nor_the_mask():
    masks = wave(3)[1]
    of = tracker("default")
    state = track(of, masks[:2])[-1]
    kept = [array.copy() for particles in state.particles for array in particles] + [state.pose.copy(), masks[2].copy()]
    after = [of.step(np.random.default_rng(9), state, masks[2]) for _ in range(2)]
    assert same(*after)
    assert same(after[0], MonocularTracker(view(), of.settings).step(np.random.default_rng(9), state, masks[2]))
    now = [array for particles in state.particles for array in particles] + [state.pose, masks[2]]
    assert all(np.array_equal(a, b) for a, b in zip(kept, now, strict=True))


# What a cycle does ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("preset", ["liu2011", "default"])
def test_the_first_particle_of_every_stage_is_the_best_of_before(preset):
    masks = wave(4)[1]
    of = tracker(preset, cycles=1, resampling="deterministic")
    states = track(of, masks)
    for before, after in pairwise(states):
        for old, new in zip(before.particles, after.particles):
            np.testing.assert_array_equal(new.poses[0], old.best)


@pytest.mark.parametrize("stages", [FLAT, ("torso",), ("left_arm",)])
@pytest.mark.parametrize("cycles", [1, 3])
def test_best_cost_never_rises_on_a_constant_picture(stages, cycles):
    """With one stage, whose other DOF stand still, and DRS; costs are Liu 2011's, eq. 2."""
    mask = wave(8, speed=0.5)[1][-1]
    of = tracker(stages=stages, cycles=cycles, ignore_legs=False, torso_arms="last")
    rng = np.random.default_rng(0)
    state = of.start(rng, wave(1)[1][0])
    costs = []
    for _ in range(15):
        state = of.cycle(rng, state, mask)
        costs.append(state.cost)
        assert state.cost == min(particles.costs.min() for particles in state.particles)
    assert (np.diff(costs) <= 0).all()
    assert costs[-1] < costs[0]


def test_an_arm_s_stage_sees_the_new_torso_and_the_other_arm_as_it_was(monkeypatch):
    seen = []
    original = FilterStage.weigh

    def weigh(stage, observation, around, last):
        seen.append((stage.parts, around.copy()))
        return original(stage, observation, around, last)

    masks = wave(2, speed=1.0)[1]
    of = tracker()
    rng = np.random.default_rng(0)
    before = of.start(rng, masks[0])
    monkeypatch.setattr(FilterStage, "weigh", weigh)
    after = of.cycle(rng, before, masks[1])
    names = np.array(view().body.skeleton.dof_names)
    torso, left, right = (np.array([name.startswith(start) for name in names]) for start in ("torso", "left", "right"))
    assert [parts for parts, _ in seen] == [("torso",), ("left_arm",), ("right_arm",)]
    np.testing.assert_array_equal(seen[0][1], before.pose)
    assert (after.pose[left] != before.pose[left]).any()
    for _, around in seen[1:]:
        np.testing.assert_array_equal(around[torso], after.pose[torso])
        np.testing.assert_array_equal(around[left | right], before.pose[left | right])


@pytest.mark.parametrize(("overrides", "evaluations"), [
    ({}, 600), ({"rank_by": "new"}, 1200), ({"rank_by": "best_new"}, 1200), ({"cycles": 3}, 1800),
    ({"cycles": 2, "explore": 10}, 1230), ({"stages": ("torso",)}, 200),
])  # fmt: skip
def test_how_many_particles_a_frame_evaluates(monkeypatch, overrides, evaluations):
    """Ranked by known costs, or evaluated again in the new picture (eq. 8 as printed), which doubles the work."""
    counted = []
    original = Picture.added
    masks = wave(3)[1]
    of = tracker(**overrides)
    state = track(of, masks[:2])[-1]

    def added(view, transforms, *rest):
        counted.append(len(transforms))
        return original(view, transforms, *rest)

    monkeypatch.setattr(Picture, "added", added)
    of.step(np.random.default_rng(0), state, masks[2])
    assert sum(counted) == evaluations


@pytest.mark.parametrize("resampling", SCHEMES)
def test_every_resampling_follows(resampling):
    sharp = {"torso": {"sigma_cost": 1000}, "arm": {"sigma_cost": 500}}  # Table I's hardly select
    states = track(tracker("default", resampling=resampling, cycles=2, **sharp), wave(12)[1])
    assert {state.status for state in states} == {"tracked"}


@pytest.mark.parametrize("overrides", [
    {"stages": FLAT}, {"stages": ("torso", "left_arm+right_arm")}, {"stages": ("torso",)}, {"stages": ("right_arm", "torso", "left_arm")},
    {"torso": {"particles": 2}, "arm": {"particles": 3}}, {"torso": {"particles": 31}, "arm": {"particles": 500}}, {"cycles": 7},
    {"explore": 0}, {"explore": 1}, {"rank_by": "new"}, {"rank_by": "best_new"}, {"torso_arms": "last"},
    {"estimate": "mean"}, {"estimate": "best"},
    {"limits": False}, {"ignore_legs": False}, {"arm": {"survival": 0.0}}, {"arm": {"survival": 1.0}}, {"motion_weight": 0.0},
])  # fmt: skip
@pytest.mark.parametrize("preset", ["liu2011", "default"])
def test_every_setting_runs(preset, overrides):
    of = tracker(preset, **overrides)
    states = track(of, wave(4)[1])
    for state in states:
        assert len(state.particles) == len(of.stages)
        for stage, particles in zip(of.stages, state.particles):
            assert particles.poses.shape[1] == len(stage.dofs)
            assert len(particles.poses) in (stage.number, stage.number + of.settings.explore)
            assert particles.costs.shape == particles.log_weights.shape == (len(particles.poses),)
        assert np.isfinite(state.pose).all()
    if of.settings.limits:
        np.testing.assert_allclose(states[-1].pose, of.picture.body.skeleton.clamp(states[-1].pose), atol=1e-12)
    assert states[-1].overlap > 0.6


def test_unknown_stages_are_said_with_the_parts_there_are():
    with pytest.raises(SettingsError, match="stages: unknown part 'legs' in 'torso\\+legs'; there are: left_arm, right_arm, torso"):
        track(tracker(stages=("torso+legs",)), wave(1)[1])


# Status ---------------------------------------------------------------------------------------------------------------


def block(share: float = 0.03) -> np.ndarray:
    """A mask of something that is no person, in a corner."""
    mask = np.zeros((120, 160), bool)
    side = int(np.sqrt(share * mask.size))
    mask[-side:, -side:] = True
    return mask


def test_nobody_is_absent_and_the_pose_waits():
    masks = wave(3)[1]
    of, rng = tracker(), np.random.default_rng(0)
    state = of.start(rng, masks[0])
    for mask in (np.zeros_like(masks[0]), block(0.002), np.zeros_like(masks[0])):
        gone = of.step(rng, state, mask)
        assert gone.status == "absent"
        assert np.isnan(gone.cost)
        assert gone.overlap == 0
        np.testing.assert_array_equal(gone.pose, state.pose)


@pytest.mark.parametrize("preset", ["liu2011", "default"])
def test_who_is_not_there_at_the_start_is_absent_and_found_when_they_come(preset):
    masks = wave(3)[1]
    for nobody in (np.zeros_like(masks[0]), block(0.002)):
        states = track(tracker(preset, recover=True), [nobody, nobody, *masks])
        assert [state.status for state in states] == ["absent"] * 2 + ["tracked"] * 3
        assert np.isnan(states[0].cost)
        assert states[0].overlap == 0
        assert np.isfinite(states[0].pose).all()


@pytest.mark.parametrize("shape", [(160, 120), (240, 320), (120, 160, 3), (120,), ()])
def test_masks_of_another_shape_are_said_with_both(shape):
    of, rng = tracker(), np.random.default_rng(0)
    state = of.start(rng, wave(1)[1][0])
    for attempt in (lambda: of.start(rng, np.ones(shape, bool)), lambda: of.step(rng, state, np.ones(shape, bool))):
        with pytest.raises(TrackingError) as error:
            attempt()
        assert str(error.value) == f"mask: found shape {shape}, expected (120, 160), the camera's rows and columns"


def test_masks_may_be_of_numbers_too():
    masks = wave(3)[1]
    of = tracker("default")
    assert all(same(a, b) for a, b in zip(track(of, masks), track(of, [255 * mask.astype(np.uint8) for mask in masks])))


@pytest.mark.parametrize("preset", ["liu2011", "default"])
def test_who_comes_back_elsewhere_is_found(preset):
    masks, nobody = wave(4)[1], np.zeros((120, 160), bool)
    poses, back = wave(6, y=0.45)
    states = track(tracker(preset, recover=True), [*masks, nobody, nobody, *back])
    assert [state.status for state in states] == ["tracked"] * 4 + ["absent"] * 2 + ["tracked"] * 6
    assert abs(states[-1].pose[0] - poses[-1][0]) < 0.06


def test_something_else_in_the_picture_is_not_tracked():
    masks = wave(3)[1]
    for wrong in (block(0.05), np.ones_like(masks[0]), np.random.default_rng(0).random(masks[0].shape) < 0.3):
        states = track(tracker(), [*masks, wrong, wrong])
        assert {state.status for state in states[-2:]} <= {"lost", "uncertain"}
        assert "lost" in {state.status for state in states[-2:]}
        assert states[-1].overlap < 0.5


def test_who_was_lost_is_found_again():
    masks, back = wave(3)[1], wave(4, y=-0.4)[1]
    states = track(tracker(recover=True), [*masks, block(0.05), *back])
    assert states[3].status == "lost"
    assert {state.status for state in states[4:]} == {"tracked"}


@pytest.mark.parametrize("between", [[block(0.05)], []], ids=["lost", "moved"])
def test_as_in_the_paper_nobody_is_searched_for_again(between, monkeypatch):
    masks, back = wave(3)[1], wave(4, y=-0.4)[1]
    of = tracker(recover=False)
    state, rng = track(of, masks)[-1], np.random.default_rng(0)
    monkeypatch.setattr(type(of), "start", lambda *_: pytest.fail("searched for"))
    for mask in [*between, np.zeros_like(masks[0]), *back]:
        state = of.step(rng, state, mask)
    assert state.status == "lost"


def test_half_a_person_is_doubted():
    masks = wave(3)[1]
    cut = masks[-1] & (np.arange(120)[:, None] > np.flatnonzero(masks[-1].any(1))[0] + 22)  # from the shoulders down
    state = track(tracker(), [*masks, cut])[-1]
    assert state.status in ("uncertain", "lost")
    assert state.overlap < 0.7


@pytest.mark.parametrize(("overlap", "status"), [(0.49, "lost"), (0.51, "uncertain"), (0.69, "uncertain"), (0.71, "tracked")])
def test_overlap_decides(overlap, status, monkeypatch):
    monkeypatch.setattr(Observation, "cost_and_overlap", lambda *_: (1.0, overlap))
    of = tracker()
    assert of.judge(np.zeros(12), [], Observation.of(np.zeros((120, 160), bool))).status == status


def test_legs_of_the_person_change_little():
    poses = wave(5, "rounded", speed=0.3)[0]
    low = picture("rounded", camera((160, 120)), elevation=0.4)
    of = MonocularTracker(low, make_settings("default"))
    masks = [low.mask(pose) | low.legs(pose, spread=np.radians(8)) for pose in poses]
    states = track(of, masks)
    assert {state.status for state in states} == {"tracked"}
    assert np.median([abs(state.pose[0] - pose[0]) for state, pose in zip(states, poses)]) < 0.02
    # What counts them is worse off.
    counting = track(MonocularTracker(low, make_settings("default", {"ignore_legs": False})), masks)
    assert np.mean([s.overlap for s in counting]) < np.mean([s.overlap for s in states]) - 0.05


def test_in_a_film_blurred_by_motion_what_is_covered_since_this_frame_does_not_count():
    poses, masks = wave(8)
    blurred = [masks[0], *(now | before for before, now in pairwise(masks))]
    plain = tracker()
    wiser = replace(plain, blurred=True)
    states = track(wiser, blurred)
    assert all(state.mask is not None for state in states[1:])
    assert all(state.mask is None for state in track(plain, blurred))
    state = states[-2]
    observation = plain.observe(blurred[-1], state.pose).ignoring(blurred[-1] & ~blurred[-2])
    assert observation.area == int((blurred[-1] & blurred[-2]).sum())
    drawn = view().draw(poses[-1])
    assert observation.cost_and_overlap(drawn)[0] <= plain.observe(blurred[-1], state.pose).cost_and_overlap(drawn)[0]


@pytest.mark.parametrize(("degrees", "follows"), [(14, True), (0, False)])
def test_a_quick_turn_is_followed_to_the_profile(degrees, follows):
    """14 degrees a frame are 210 degrees/s at 15 frames/s: more than the noise of a frame reaches."""
    twists = np.radians(np.minimum(degrees * np.arange(8), 85))
    poses = [view("rounded").body.skeleton.pose(torso_twist=twist, left_shoulder_abduction=0.1, right_shoulder_abduction=0.1)
             for twist in twists]
    turned = MonocularTracker(view("rounded"), make_settings("default"))
    states = track(turned, [view("rounded").mask(pose) for pose in poses])
    found = abs(states[-1].pose[view("rounded").body.skeleton.dof_names.index("torso_twist")])
    assert (found > np.radians(60)) == follows
    assert any(turned.is_narrow(view("rounded").mask(now), before.pose) for before, now in zip(states, poses[1:])) == follows
