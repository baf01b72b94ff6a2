"""A person measured on their share of some frames: sizes, and the pixels that say nothing."""

from __future__ import annotations

import functools
from functools import partial

import actor
import numpy as np
import pytest

from shadowpuppet.body.models import make_body
from shadowpuppet.body.whole_body import anatomical
from shadowpuppet.tracking.multiview.settings import MultiviewSettings
from shadowpuppet.tracking.multiview.tracker import MultiviewState, MultiviewTracker
from shadowpuppet.tracking.people.evidence import draw_person
from shadowpuppet.tracking.people.shared_sizes import measure, shows
from shadowpuppet.tracking.people.tracker import Share, at_pose, shows_side

GIRTHS = {"thigh_width": 1.25, "waist_width": 1.25, "pelvis_width": 1.25, "chest_width": 1.15}
ALL = ~np.uint64(0)
SETTINGS = MultiviewSettings(particles=6)


@functools.cache
def stout():
    """A person of wide girths who walks, as shares of four frames; the poses, and a tracker with a body of average sizes."""
    true = actor.sizes(**GIRTHS)
    body = anatomical(true)
    poses = actor.walk(body.skeleton, 4, 5.0)
    tracker = MultiviewTracker(actor.body(), actor.cameras(), SETTINGS)
    shares = []
    for pose in poses:
        masks = actor.masks(body, pose)
        state = at_pose(tracker, MultiviewState(pose, 0 * pose, None, 0.0, 0.9, "tracked"), pose)
        drawn = draw_person(tracker, pose)
        shares.append(Share(state, actor.hull().points(masks), masks, drawn, tuple(map(np.zeros_like, drawn.bits))))
    return true, poses, shares, tracker


def test_sizes_come_nearer_to_the_person(rng):
    true, poses, shares, tracker = stout()
    found = measure(rng, partial(make_body, "anatomical"), actor.sizes(), tracker, shares, poses)
    before, after = (sum(abs(getattr(sizes, name) - getattr(true, name)) for name in GIRTHS) for sizes in (actor.sizes(), found.sizes))
    assert after < 0.75 * before
    assert found.tracker.body is not tracker.body
    assert found.overlaps.mean() > 0.85
    assert found.poses.shape == poses.shape


@pytest.mark.parametrize(("hidden", "status", "shown"), [
    (0, "tracked", True), (2, "tracked", True), (3, "tracked", False), (0, "lost", False)])
def test_who_is_hidden_in_most_views_is_not_measured(hidden, status, shown):
    share = stout()[2][0]
    ignored = [np.full_like(bits, ALL if n < hidden else 0) for n, bits in enumerate(share.ignored)]
    assert shows(share._replace(ignored=ignored, state=share.state._replace(status=status))) == shown


def test_a_body_outside_of_the_pictures_does_not_show():
    share = stout()[2][0]
    away = share.drawn._replace(bits=tuple(map(np.zeros_like, share.drawn.bits)))
    assert not shows(share._replace(drawn=away))


def test_a_side_is_seen_from_a_quarter_about_it():
    _, poses, shares, tracker = stout()
    share, skeleton = shares[0], tracker.body.skeleton
    seen = []
    for n, camera in enumerate(tracker.cameras):
        ignored = [np.full_like(bits, ALL if m != n else 0) for m, bits in enumerate(share.ignored)]
        way = camera.centre[:2] - poses[0][skeleton.dof_indices(["root_x", "root_y"])]
        for turn in (0.0, 40.0, 50.0, 90.0, 140.0, 180.0):
            pose = poses[0].copy()
            pose[skeleton.dof_indices(["root_heading"])] = np.arctan2(way[1], way[0]) + np.radians(turn)
            seen.append(shows_side(tracker, share._replace(state=share.state._replace(pose=pose), ignored=ignored)))
    assert seen == [False, False, True, True, False, False] * len(tracker.cameras)
