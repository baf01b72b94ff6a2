"""A whole person before one camera: found from what the upper body told, tracked with legs, on masks that a whole body drew."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from legs import bent, over_floor
from people import camera

from shadowpuppet.body.anthropometry import sizes_from_height
from shadowpuppet.body.models import WHOLE, average_sizes, make_body, whole_from_upper
from shadowpuppet.body.segments import keep_limb_directions
from shadowpuppet.camera.rasterize import Picture, place
from shadowpuppet.errors import SettingsError
from shadowpuppet.geometry import inverse
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.person_rig import check_body
from shadowpuppet.tracking.monocular.initialization import SizeFit, as_whole, find_person
from shadowpuppet.tracking.monocular.settings import InitializationSettings, make_settings
from shadowpuppet.tracking.monocular.size_search import PersonEstimate
from shadowpuppet.tracking.monocular.tracker import GROWN, SEARCHED_AFTER, MonocularTracker
from shadowpuppet.tracking.monocular.whole_body import whole_from_estimate
from shadowpuppet.tracking.silhouette_cost import Observation

CAMERA = camera((200, 240), focal=1.0)
HEIGHT, FAR = 1.7, 2.1
ARMS = {"anatomical": {"left_shoulder_x": 1.2, "right_shoulder_x": -0.5},
        "cylinders": {"left_shoulder_abduction": 1.2, "right_shoulder_abduction": 0.5}}  # fmt: skip


def picture(name: str, far: float = FAR, up: float = -0.1, **widths: float) -> Picture:
    return Picture(make_body(name, average_sizes(name, HEIGHT).with_values(**widths)), CAMERA, place(CAMERA, far, up))


def upper_of(view: Picture, far: float = FAR) -> PersonEstimate:
    """What an upper body of the same person would be found like: its neck at the same place, if it is found so far away."""
    sizes = sizes_from_height(HEIGHT)
    neck = view.points(view.body.skeleton.pose()[None], names=["neck"])[0, 0]
    height = -neck[1] / neck[2] * far
    return PersonEstimate(sizes, HEIGHT, far, height - sizes.torso_height)


@pytest.mark.parametrize("name", WHOLE)
def test_sizes_of_an_upper_body_become_those_of_a_whole_one(name):
    average = sizes_from_height(HEIGHT)
    same = whole_from_upper(name, average, HEIGHT)
    for size in ("upper_arm_length", "thigh_length", "shank_length", "head_height"):
        assert getattr(same, size) == pytest.approx(getattr(average_sizes(name, HEIGHT), size), rel=0.03)
    long = whole_from_upper(name, average.with_values(upper_arm_length=0.4, shoulder_width=0.5), HEIGHT)
    assert long.upper_arm_length == 0.4
    assert long.shoulder_distance == pytest.approx(0.5 - 2 * average.shoulder_inset)


@pytest.mark.parametrize("told", [0.85, 1.0, 1.25])
@pytest.mark.parametrize("name", WHOLE)
def test_the_soles_tell_the_distance(name, told):
    view = picture(name)
    mask = view.mask(view.body.skeleton.pose(**ARMS[name]))
    assert not mask[-2:].any()
    found = whole_from_estimate(CAMERA, [mask], upper_of(view, told * FAR), name)
    assert found.distance == pytest.approx(FAR, rel=0.08)  # the toes of who is near are seen under the ankles
    given = whole_from_estimate(CAMERA, [mask], upper_of(view, told * FAR), name, distance=told * FAR)
    assert given.distance == told * FAR


@pytest.mark.parametrize("name", WHOLE)
def test_whose_feet_are_cut_off_stays_where_the_upper_body_was(name):
    view = picture(name)
    mask = view.mask(view.body.skeleton.pose(**ARMS[name]))
    cut = np.concatenate([np.zeros((80, 200), bool), mask[:-80]])
    assert cut[-1].any()
    assert whole_from_estimate(CAMERA, [cut], upper_of(view, 3.0), name).distance == 3.0


@pytest.mark.parametrize("name", WHOLE)
def test_who_kneels_is_not_taken_for_far_away(name):
    """The toes of whoever kneels are nearer to the crown than standing: a standing person would be farther away."""
    view = picture(name)
    skeleton = view.body.skeleton
    pose = skeleton.pose(left_knee_flexion=1.6, right_knee_flexion=1.6)
    mask = view.mask(pose)
    assert not mask[-2:].any()
    seated, standing = (whole_from_estimate(CAMERA, [mask], upper_of(view), name, standing=known) for known in (False, True))
    assert seated.distance == pytest.approx(FAR, rel=0.08)
    assert standing.distance > 1.1 * FAR
    upright = whole_from_estimate(CAMERA, [mask, view.mask(skeleton.pose())], upper_of(view, 1.05 * FAR), name, standing=False)
    assert upright.distance == pytest.approx(FAR, rel=0.08)  # by the moment in which they stand


@pytest.mark.parametrize("name", WHOLE)
def test_widths_follow_the_clothes_and_given_sizes_are_kept(name):
    wide = {size: 1.4 * getattr(average_sizes(name, HEIGHT), size) for size in ("thigh_width", "calf_width", "knee_width", "shank_width")
            if size in average_sizes(name, HEIGHT).names()}  # fmt: skip
    view = picture(name, **wide)
    mask = view.mask(view.body.skeleton.pose(**ARMS[name]))
    found = whole_from_estimate(CAMERA, [mask], upper_of(view), name)
    assert found.sizes.thigh_width > 1.1 * average_sizes(name, HEIGHT).thigh_width
    given = average_sizes(name, HEIGHT)
    assert whole_from_estimate(CAMERA, [mask], upper_of(view), name, given).sizes is given


def test_thighs_of_who_squats_are_as_wide_as_in_whole_poses():
    """Coarse poses have few bends of hips and knees and leave the thighs too thin."""
    average, view = average_sizes("anatomical", HEIGHT), over_floor("anatomical", hips=0.66)
    wide = {size: 1.2 * getattr(average, size) for size in ("thigh_width", "knee_width", "calf_width", "ankle_width")}
    pose = bent(view.body.skeleton, 68, 60)
    pose[view.body.skeleton.dof_names.index("left_shoulder_x")] = 1.0
    masks = [replace(view, body=make_body("anatomical", average.with_values(**wide))).mask(pose)] * 2
    up = (inverse(place(view.camera, 2.5, 0.0)) @ view.T_camera_base)[2, 3]
    neck, upper = view.body.points(view.body.skeleton.pose()[None], names=["neck"])[0, 0, 2], sizes_from_height(HEIGHT)
    there = PersonEstimate(upper, HEIGHT, 2.5, float(up + neck) - upper.torso_height)
    found, coarse = (whole_from_estimate(view.camera, masks, there, "anatomical", distance=2.5, standing=standing).sizes.thigh_width
                     for standing in (False, True))  # fmt: skip
    assert abs(found / average.thigh_width - 1.2) < 0.11
    assert coarse < 0.97 * found


@pytest.mark.parametrize("name", WHOLE)
def test_a_fit_of_the_upper_body_is_carried_over(name):
    view = picture(name)
    mask = view.mask(view.body.skeleton.pose(**ARMS[name]))
    fit = as_whole(CAMERA, [mask], SizeFit(upper_of(view), {"O1": ()}, {"0": 0.9}, np.zeros((1, 12))), name)
    assert (fit.curves, fit.overlaps) == ({"O1": ()}, {"0": 0.9})
    drawn = fit.guess.picture(CAMERA, name).draw(fit.poses[0])
    assert Observation.of(mask).cost_and_overlap(drawn)[1] > 0.75


@pytest.mark.parametrize("name", WHOLE)
def test_who_moves_arms_and_legs_is_followed(name):
    view = picture(name)
    step = {"anatomical": {"left_hip_x": 0.3, "right_hip_x": -0.1},
            "cylinders": {"left_hip_abduction": 0.3, "right_hip_abduction": 0.1}}[name]  # fmt: skip
    masks = []
    for t in np.linspace(0, 1, 12):
        pose = view.body.skeleton.pose(root_y=0.1 * t, **{dof: t * value for dof, value in {**ARMS[name], **step}.items()})
        masks.append(view.mask(pose))
    tracker = MonocularTracker(view, make_settings(overrides={"body": name}))
    assert [stage.parts[0] for stage in tracker.stages] == ["torso", "left_arm", "right_arm", "left_leg", "right_leg"]
    rng = np.random.default_rng(1)
    state = tracker.start(rng, masks[0])
    for mask in masks[1:]:
        state = tracker.step(rng, state, mask)
    assert state.status == "tracked"
    assert state.overlap > 0.8
    shown = view.points(np.stack([pose, state.pose]), names=["left_knee", "left_ankle", "left_elbow"])
    seen = shown[..., :2] / shown[..., 2:]
    assert np.abs(seen[0] - seen[1]).max() * CAMERA.matrix[0, 0] < 15  # pixels, of 170 that the person is tall
    assert abs(state.pose[view.body.skeleton.dof_names.index("root_x")]) < 0.05 * FAR


@pytest.mark.parametrize(("overrides", "again"), [({}, True), ({"turned": False}, False)])
def test_who_sat_down_unnoticed_is_found_when_searched_for_again(overrides, again):
    view = over_floor("anatomical", hips=0.5)
    seated = view.mask(bent(view.body.skeleton, 85, 88))
    tracker = MonocularTracker(view, make_settings(overrides={"body": "anatomical", **overrides}))
    wrong = tracker.judge(view.body.skeleton.pose(), [], tracker.observe(seated, view.body.skeleton.pose()))
    fitted = tracker.misfit(wrong) / (1.1 * GROWN)  # before they sat down
    for early in (wrong._replace(followed=SEARCHED_AFTER - 1, least=fitted), wrong._replace(followed=SEARCHED_AFTER)):
        assert tracker.searched_again(np.random.default_rng(1), early, seated).pose is wrong.pose
    found = tracker.searched_again(np.random.default_rng(1), wrong._replace(followed=SEARCHED_AFTER, least=fitted), seated)
    assert (found.pose is not wrong.pose) == again
    if not again:
        return
    assert found.followed == 0
    assert tracker.misfit(found) < 0.5 * tracker.misfit(wrong)
    knees = view.body.skeleton.dof_indices(["left_knee_flexion", "right_knee_flexion"])
    np.testing.assert_allclose(np.degrees(found.pose[knees]), 88, atol=25)
    again_due = found._replace(followed=SEARCHED_AFTER, least=tracker.misfit(found) / 2)
    kept = tracker.searched_again(np.random.default_rng(2), again_due, seated)
    assert kept.followed == 0  # the search is due again after as many frames, whichever pose is kept
    assert tracker.misfit(kept) <= tracker.misfit(found)


@pytest.mark.parametrize("name", WHOLE)
def test_legs_stand_while_the_torso_turns(name, rng):
    skeleton = picture(name).body.skeleton
    before = skeleton.pose(**swung(name), root_heading=0.2)
    poses = np.repeat(before[None], 5, axis=0)
    poses[:, 3:6] += 0.3 * rng.standard_normal((5, 3))
    legs = [skeleton.joint_index(f"{side}_{joint}") for side in ("left", "right") for joint in ("hip", "knee")]
    stood = skeleton.forward(keep_limb_directions(skeleton, before, poses, ["left_leg", "right_leg"]))[:, legs, :, :3]
    np.testing.assert_allclose(stood, np.repeat(skeleton.forward(before[None])[:, legs, :, :3], 5, axis=0), atol=1e-9)
    np.testing.assert_array_equal(keep_limb_directions(skeleton, before, poses, []), poses)


def swung(name: str) -> dict[str, float]:
    """A leg forward and aside, knees bent."""
    hip = {"anatomical": {"left_hip_x": 0.3, "left_hip_y": -0.5}, "cylinders": {"left_hip_abduction": 0.3, "left_hip_flexion": 0.5}}[name]
    return hip | {"left_knee_flexion": 0.6, "right_knee_flexion": 0.2}


def test_legs_that_a_stage_names_have_no_stage_more():
    view = picture("cylinders")
    of = make_settings(overrides={"body": "cylinders", "stages": ("torso", "left_leg+right_leg", "left_arm")})
    assert [stage.parts for stage in MonocularTracker(view, of).stages] == [("torso",), ("left_leg", "right_leg"), ("left_arm",)]
    with pytest.raises(SettingsError, match="unknown part 'tail' in 'tail'; there are: left_arm, left_leg, right_arm, right_leg, torso"):
        _ = MonocularTracker(view, make_settings(overrides={"body": "cylinders", "stages": ("tail",)})).stages


@pytest.mark.parametrize("sizes", [None, average_sizes("cylinders", HEIGHT)], ids=["unknown", "given"])
def test_a_person_is_found_by_silhouettes_alone(sizes):
    view = picture("cylinders")
    poses = [view.body.skeleton.pose(**{dof: share * value for dof, value in ARMS["cylinders"].items()}) for share in (0.6, 1.0, 1.3)]
    quick, height = replace(InitializationSettings(), rounds=15, patience=5, sweeps=1), None if sizes else HEIGHT
    fit = find_person(np.random.default_rng(1), CAMERA, [view.mask(pose) for pose in poses], height=height, sizes=sizes, body="cylinders",
                      settings=quick)
    assert fit.guess.distance == pytest.approx(FAR, rel=0.08)
    assert fit.poses.shape == (3, 25)
    if sizes:
        assert fit.guess.sizes is sizes


def test_an_upper_body_for_several_cameras_is_refused():
    with pytest.raises(SettingsError, match="body: found 'rounded', an upper body, for several cameras; expected one of anatomical"):
        check_body(Options(body="rounded"))
