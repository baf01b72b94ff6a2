"""What a run of several people needs to go on after it was killed: the group as plain values for a checkpoint, and the group from these."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from shadowpuppet.body.models import sizes_kind
from shadowpuppet.camera.camera import Camera
from shadowpuppet.geometry import Array
from shadowpuppet.io.person import Person
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.people.fitting import unsettled
from shadowpuppet.pipeline.people.group import Group
from shadowpuppet.pipeline.people.member import Look, Member, Shown
from shadowpuppet.pipeline.person_rig import MultiviewSubject, known_person
from shadowpuppet.tracking.multiview.surface.visual_hull import SurfacePoints
from shadowpuppet.tracking.people.evidence import Drawn
from shadowpuppet.tracking.people.facing import Doubted, Facing, Part, Trial
from shadowpuppet.tracking.people.figures import Figure
from shadowpuppet.tracking.people.identity import Clothes, Exchange, Question
from shadowpuppet.tracking.people.presence import Followed
from shadowpuppet.tracking.people.tracker import Share
from shadowpuppet.tracking.people.walking import Step

MEMBER = ("state", "height", "place", "lost_since", "before", "measured_at", "attempts")
"""Fields of a `Member` that are kept as they are."""


class KeptMember(NamedTuple):
    """A person of a group."""

    sizes: Array
    """As `Sizes.to_array` gives them."""
    person: tuple[Any, ...]
    """Height (m) of the measured person, and how the sizes were found."""
    summary: Mapping[str, Any]
    is_measured: bool
    generator: Mapping[str, Any]
    fields: tuple[Any, ...]
    """The values of `MEMBER`."""
    steps: tuple[Step, ...]
    trial: tuple[Any, ...] | None
    """When it began, its state and leads."""
    shown: tuple[Shown, ...]
    earlier: tuple[Any, ...] | None
    """Sizes, height (m), how they were found and summary of the person before they were measured while they were tracked."""
    facing: tuple[Any, ...]
    """Whether it is known, the parts, and for each frame that is doubted its time (s) and what it would be."""


class KeptGroup(NamedTuple):
    """A group after a frame."""

    generator: Mapping[str, Any]
    members: tuple[KeptMember, ...]
    coming: tuple[Any, ...]
    """Of each person who comes: times, numbers of the looks, and the figure's index in each."""
    seen: Mapping[str, Look]
    """By number."""
    looks: int
    due: float
    clothes: Mapping[str, tuple[Any, ...]]
    """By the person's number, what is known and what is recent."""
    questions: tuple[Any, ...]
    """Pairs and their questions."""
    exchanges: tuple[Exchange, ...]


TYPES = (*MultiviewSubject.state_types, Shown, Share, Drawn, SurfacePoints, KeptMember, KeptGroup, Look, Figure, Step, Part, Doubted,
         Question, Exchange)  # fmt: skip
"""The named tuples in a `KeptGroup`."""


def kept(group: Group) -> KeptGroup:
    """A group as plain values."""
    coming = tuple((tuple(each.times), tuple(each.sets), tuple(_index(figure, group.seen[n]) for n, figure in zip(each.sets, each.figures)))
                   for each in group.coming)  # fmt: skip
    seen = {str(n): Look(tuple(look.figures), tuple(look.masks), tuple(look.worn)) for n, look in group.seen.items()}
    clothes = {str(n): (each.known, tuple(each.recent)) for n, each in group.identity.clothes.items()}
    return KeptGroup(group.rng.bit_generator.state, tuple(map(_kept_member, group.members)), coming, seen, group.looks, float(group.due),
                     clothes, tuple(group.identity.questions.items()), tuple(group.exchanges))  # fmt: skip


def _kept_member(member: Member) -> KeptMember:
    subject, facing, trial = member.subject, member.facing, member.trial
    return KeptMember(subject.person.sizes.to_array(), (subject.person.height, subject.person.source), subject.summary, subject.is_measured,
                      member.rng.bit_generator.state, tuple(getattr(member, name) for name in MEMBER), tuple(member.walk.steps),
                      None if trial is None else (trial.begun, trial.state, tuple(trial.leads)), tuple(member.shown),
                      None if member.earlier is None else (member.earlier.person.sizes.to_array(), member.earlier.person.height,
                                                           member.earlier.person.source, member.earlier.summary),
                      (facing.is_known, tuple(facing.parts), tuple(facing.doubted.items())))  # fmt: skip


def _index(figure: Figure, look: Look) -> int:
    return next(n for n, other in enumerate(look.figures) if other is figure)


def restore(group: Group, held: KeptGroup, remake: Callable[[KeptMember], MultiviewSubject]) -> None:
    """Make a group without people that of a checkpoint; `remake`: makes a person of known sizes, and the tracker."""
    for each in held.members:
        _restore_member(group, each, remake(each))
        if each.earlier is not None:
            sizes, height, source, summary = each.earlier
            group.members[-1].earlier = remake(each._replace(sizes=sizes, person=(height, source), summary=summary, is_measured=False))
    group.rng.bit_generator.state = dict(held.generator)
    group.seen = {int(n): look for n, look in held.seen.items()}
    group.coming = [Followed(list(times), [group.seen[n].figures[k] for n, k in zip(sets, which)], list(sets))
                    for times, sets, which in held.coming]  # fmt: skip
    group.looks, group.due, group.exchanges = held.looks, held.due, list(held.exchanges)
    group.identity.clothes = {int(n): Clothes(known, list(recent)) for n, (known, recent) in held.clothes.items()}
    group.identity.questions = dict(held.questions)


def _restore_member(group: Group, held: KeptMember, subject: MultiviewSubject) -> None:
    member = group.add(subject, 0.0, np.zeros(2))  # spawns the same generator as at first
    for name, value in zip(MEMBER, held.fields):
        setattr(member, name, value)
    member.rng.bit_generator.state = dict(held.generator)
    member.walk.steps, member.shown = deque(held.steps), list(held.shown)
    if held.trial is not None:
        begun, state, leads = held.trial
        member.trial = Trial(begun, state)
        member.trial.leads = list(leads)
    known, parts, doubted = held.facing
    member.facing = Facing(list(parts), known, dict(doubted))


def remade(rng: np.random.Generator, cameras: Sequence[Camera], options: Options, rate: float, held: KeptMember) -> MultiviewSubject:
    """A person of a checkpoint, and the tracker for `rate` frames/s."""
    height, source = held.person
    person = Person(sizes_kind(options.multiview.body).from_array(held.sizes), height, source)
    return unsettled(known_person(rng, cameras, options, rate, person, dict(held.summary), held.is_measured))
