"""People whom the first seconds do not show apart are measured while they are tracked, on their share of what later frames show."""

from __future__ import annotations

from functools import partial

import numpy as np

from shadowpuppet.body.models import make_body
from shadowpuppet.body.sizes import BoneSizes
from shadowpuppet.pipeline.people.state import Measured, PersonState, Shown
from shadowpuppet.pipeline.person_rig import MultiviewSubject
from shadowpuppet.tracking.people.evidence import draw_person
from shadowpuppet.tracking.people.front import SETTLING
from shadowpuppet.tracking.people.shared_sizes import Measure, measure, shows
from shadowpuppet.tracking.people.tracker import at_pose, follow_turned, shows_side
from shadowpuppet.tracking.status import PER_OVERLAP

SETS, SECONDS = 8, 1.4
"""Number of frames in which a person is measured, and the least time from the first to the last of them."""
ATTEMPTS = 2
"""Number of attempts after which average sizes stay."""


def measured_later(person: PersonState, subject: MultiviewSubject, rng: np.random.Generator, time: float) -> PersonState:
    """The person after what a frame shows of one of average sizes was noted; with enough frames, measured, to go on with that body. Of an
    unknown front both ways are measured: each with the sizes that suit it they do not fit alike."""
    share, front = person.share, person.front
    if person.measured.is_measured or person.attempts >= ATTEMPTS or share is None or person.lost_since is not None or not shows(share):
        return person
    if not front.is_known and (front.other is None or time - front.since < SETTLING or not shows_side(subject.tracker, share)):
        return person
    kept = share._replace(masks=tuple(share.masks), ignored=tuple(share.ignored), keypoints=())
    frames = [*person.shown, Shown(time, kept, None if front.is_known or front.other is None else front.other.pose)]
    frames = [each for each in frames if front.is_known or each.turned is not None][-SETS:]
    if len(frames) < SETS or frames[-1].time - frames[0].time < SECONDS - 1e-6:
        return person._replace(shown=tuple(frames))
    return _measured(person._replace(shown=(), attempts=person.attempts + 1), subject, rng, frames)


def _measured(person: PersonState, subject: MultiviewSubject, rng: np.random.Generator, frames: list[Shown]) -> PersonState:
    shares, sizes, front = [frame.share for frame in frames], subject.person.sizes, person.front
    assert isinstance(sizes, BoneSizes)
    measured = partial(measure, rng, partial(make_body, subject.tracker.settings.body), sizes, subject.tracker, shares)
    found, is_wrong = measured(np.array([frame.share.state.pose for frame in frames])), False
    if not front.is_known:
        other = measured(np.array([frame.turned for frame in frames]))
        odds = front.odds + PER_OVERLAP * (_mean(found.overlaps) - _mean(other.overlaps))
        front, is_wrong = front._replace(odds=odds, other=None), odds < 0
        found = other if is_wrong else found
    if _mean(found.overlaps) < _mean(np.array([share.state.overlap for share in shares])):
        return person  # no better than the average sizes
    state = follow_turned(found.tracker, rng, at_pose(found.tracker, shares[-1].state, found.poses[-1]), shares[-1])
    share = shares[-1]._replace(state=state, drawn=draw_person(found.tracker, state.pose))
    return person._replace(measured=_of(found, person.measured, len(frames)), earlier=person.measured, measured_at=frames[-1].time,
                           state=state, share=share, before=None, front=front if front.is_known else front.found(is_wrong))


def _mean(overlaps: np.ndarray) -> float:
    return float(np.nan_to_num(overlaps).mean())


def _of(found: Measure, before: Measured, frames: int) -> Measured:
    source = f"a height of {before.height or 0:.2f} m as seen, and the person's share of {frames} frames among others"
    sizes = dict(zip(found.sizes.names(), map(float, found.sizes.to_array()), strict=True))
    summary = {"source": source, "overlap": round(float(np.nanmean(found.overlaps)), 3), "residual": found.residual, "frames": frames,
               "sizes": sizes}
    return Measured(found.sizes.to_array(), before.height, source, summary, True)
