"""A body, a cost and a resampling scheme of a user's own go wherever ours do, and change nothing where they are ours."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import actor
import numpy as np
import pytest
from people import SIZES, camera, picture

from shadowpuppet.body.shapes import Hulls, Quads
from shadowpuppet.body.upper_body import cardbox, rounded
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.tracking.monocular.initialization import find_person, fit_references
from shadowpuppet.tracking.monocular.settings import InitializationSettings, make_settings
from shadowpuppet.tracking.monocular.size_search import LinearBodies, PersonEstimate
from shadowpuppet.tracking.monocular.tracker import MonocularTracker, State
from shadowpuppet.tracking.multiview.settings import make_multiview_settings
from shadowpuppet.tracking.multiview.tracker import MultiviewTracker
from shadowpuppet.tracking.resampling import SCHEMES

BRIEF = InitializationSettings(rounds=3, sweeps=1)
HAND = "left_hand"


def nothing(poses: np.ndarray) -> np.ndarray:
    return np.zeros(len(poses))


@cache
def masks() -> list[np.ndarray]:
    """Someone whose left arm hangs, then is raised."""
    view = picture()
    poses = [view.body.skeleton.pose(left_shoulder_abduction=0.3 + 0.15 * n, right_shoulder_abduction=0.4) for n in range(5)]
    return [view.mask(pose) for pose in poses]


def tracked(also=None, scheme=None, seed: int = 0, **settings) -> list[State]:
    of, rng = MonocularTracker(picture(), make_settings("liu2011", settings), scheme=scheme), np.random.default_rng(seed)
    states = [of.start(rng, masks()[0], also)]
    for mask in masks()[1:]:
        states.append(of.step(rng, states[-1], mask, also))
    return states


def poses_of(states) -> np.ndarray:
    return np.array([state.pose for state in states])


# A cost ---------------------------------------------------------------------------------------------------------------


def test_a_cost_of_nothing_changes_nothing():
    np.testing.assert_array_equal(poses_of(tracked(nothing)), poses_of(tracked()))


@pytest.mark.parametrize("settings", [{}, {"rank_by": "new"}, {"estimate": "mean", "cycles": 2}])
def test_what_a_cost_asks_for_is_done_from_the_first_frame_on(settings):
    """The right elbow is to be bent, of which the silhouette of a hanging arm tells little, and tells against it."""
    skeleton = picture().body.skeleton
    elbow = skeleton.dof_names.index("right_elbow_flexion")
    asked = poses_of(tracked(lambda poses: 20_000 * (poses[:, elbow] - 1.2) ** 2, **settings))[:, elbow]
    assert np.abs(asked - 1.2).max() < 0.15
    assert np.abs(poses_of(tracked(**settings))[:, elbow] - 1.2).min() > 0.3


def test_costs_get_whole_poses_and_what_is_reported_stays_that_of_the_silhouette():
    shapes: set[tuple[int, ...]] = set()

    def much(poses):
        shapes.add(poses.shape[1:])
        return np.full(len(poses), 1e6)

    told, plain = tracked(much), tracked()
    assert shapes == {(12,)}
    assert [state.cost for state in told] == [state.cost for state in plain]
    assert min(particles.costs.min() for particles in told[-1].particles) > 1e6


def test_who_was_lost_or_comes_back_is_searched_for_with_the_cost():
    view, empty, calls = picture(), np.zeros_like(masks()[0]), []
    of, rng = MonocularTracker(view, make_settings("liu2011", {"recover": True})), np.random.default_rng(0)
    away = of.step(rng, of.start(rng, masks()[0]), empty, nothing)
    assert away.status == "absent"

    def counted(poses):
        calls.append(len(poses))
        return nothing(poses)

    assert of.step(rng, away, masks()[0], counted).status == "tracked"
    assert len(calls) > 3


def test_several_cameras_take_a_cost_too():
    poses, seen = actor.filmed()
    knee = actor.body().skeleton.dof_names.index("left_knee_flexion")
    of = MultiviewTracker(actor.body(), actor.cameras(), make_multiview_settings(overrides={"particles": 8, "method": "particle_filter"}))

    def found(also) -> np.ndarray:
        rng = np.random.default_rng(0)
        states = [of.start(rng, *seen[0], also)]
        for points, mask in seen[1:4]:
            states.append(of.step(rng, states[-1], points, mask, also))
        return poses_of(states)

    np.testing.assert_array_equal(found(nothing), found(None))
    bent = found(lambda poses: (poses[:, knee] - 1.0) ** 2)[:, knee]
    assert np.abs(bent - 1.0).mean() < 0.5 * np.abs(found(None)[:, knee] - 1.0).mean()
    assert poses[:4, knee].max() < 0.6


# A scheme -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["stratified", "systematic"])
def test_a_scheme_of_ours_given_as_ones_own_is_the_setting(name):
    np.testing.assert_array_equal(poses_of(tracked(scheme=SCHEMES[name])), poses_of(tracked(resampling=name)))


def test_several_cameras_take_a_scheme_too():
    _, seen = actor.filmed()
    asked: list[int] = []

    def counting(rng, log_weights, number):
        asked.append(number)
        return SCHEMES["multinomial"](rng, log_weights, number)

    def found(scheme, **settings) -> np.ndarray:
        settings = make_multiview_settings(overrides={"particles": 8, **settings})
        of, rng = MultiviewTracker(actor.body(), actor.cameras(), settings, scheme=scheme), np.random.default_rng(0)
        return of.step(rng, of.start(rng, *seen[0]), *seen[1]).pose

    np.testing.assert_array_equal(found(counting), found(None, resampling="multinomial"))
    assert set(asked) == {7}  # the best stays as it is


# A body ---------------------------------------------------------------------------------------------------------------


def hat(sizes):
    """The rounded body with a hat, two heads wide and one high."""
    body = rounded(sizes)
    assert isinstance(body.shapes, Hulls)
    top = sizes.torso_height + sizes.neck_gap + 1.1 * sizes.head_height
    most, joint = body.shapes.joints.shape[1], body.skeleton.joint_index("torso")
    shapes = Hulls(np.concatenate([body.shapes.joints, np.full((1, most), joint)]),
                   np.concatenate([body.shapes.centres, np.full((1, most, 3), (0.0, 0.0, top))]),
                   np.concatenate([body.shapes.radii, np.full((1, most, 3), sizes.head_width * np.array([1.0, 1.0, 0.6]))]))  # fmt: skip
    return replace(body, name="hat", shapes=shapes, parts=(*body.parts, "hat"))


@pytest.mark.parametrize("body", ["rounded", "cardbox"])
def test_a_body_of_ours_given_as_a_function_is_the_named_one(body):
    make = {"rounded": rounded, "cardbox": cardbox}[body]
    known = {"height": 1.75, "distance": 2.5, "settings": BRIEF}
    named, own = (find_person(np.random.default_rng(0), camera(), masks()[:2], body=each, **known) for each in (body, make))
    assert vars(own.guess) == vars(named.guess)
    assert own.overlaps == named.overlaps
    view = named.guess.picture(camera(), make)
    np.testing.assert_array_equal(view.mask(named.poses[0]), named.guess.picture(camera(), body).mask(named.poses[0]))


def test_who_wears_a_hat_is_found_and_followed_by_a_body_with_one():
    guess = PersonEstimate(SIZES, 1.75, 2.5, -0.1)
    view = guess.picture(camera(), hat)
    pose = view.body.skeleton.pose(left_shoulder_abduction=np.pi / 2, right_shoulder_abduction=np.pi / 2)
    mask = view.mask(pose)
    assert mask.sum() > guess.picture(camera()).mask(pose).sum() + 50
    known = {"height": 1.75, "distance": 2.5, "settings": InitializationSettings(rounds=10, sweeps=1)}
    fits = [fit_references(np.random.default_rng(0), camera(), {"front_t_pose": mask}, body=body, **known) for body in ("rounded", hat)]
    assert fits[1].overlaps["front_t_pose"] > max(fits[0].overlaps["front_t_pose"] + 0.02, 0.9)
    of, rng = MonocularTracker(view, make_settings()), np.random.default_rng(0)
    state = of.step(rng, of.start(rng, mask), mask)
    assert state.overlap > 0.93


@pytest.mark.parametrize("change", [lambda corners, sizes: corners + 0.01, lambda corners, sizes: corners * (1 + sizes.head_width)])
def test_a_body_that_is_not_linear_in_the_sizes_is_refused(change):
    """Else people of other sizes would be drawn wrongly, and nobody would be told."""
    def bent(sizes):
        body = cardbox(sizes)
        assert isinstance(body.shapes, Quads)
        return replace(body, name="bent", shapes=Quads(body.shapes.joints, change(body.shapes.corners, sizes)))

    with pytest.raises(ShadowPuppetError, match="body 'bent': its offsets and shapes must be sums of multiples of the sizes"):
        LinearBodies(bent)
    with pytest.raises(ShadowPuppetError, match="body 'bent'"):
        find_person(np.random.default_rng(0), camera(), masks()[:1], height=1.75, body=bent, settings=BRIEF)
