"""Arms before the trunk, found by the colours of this person's hands, and of their forearms if these are bare. In neither paper.

A silhouette does not show where an arm is before the trunk; its colours do, be they a skin's or a glove's. They are counted where hands and
forearms are beside the trunk, in the tracked poses, and compared with those of trunk and legs. If they differ, the pixels that have the
arms' colours are a second silhouette, of these parts alone, and eq. 2 compares it with them as the first with the whole body. It does not
count beside the trunk: there it repeats what the silhouette shows, and an arm whose dark fingertips it lacks would be taken for one that
points to the camera.

No picture is kept, only how often each of 4096 coarse colours was seen.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.skeleton import SIDES
from shadowpuppet.camera.bits import Bits, count, pack, unpack
from shadowpuppet.camera.colour_codes import NUMBER, ColourCode, step_of, thinned
from shadowpuppet.camera.mask import Mask, grown
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.silhouette_cost import Observation, PartObservation

ENOUGH, ENOUGH_REST = 150, 2000
"""Least number of pixels that hands or forearms, and trunk and legs, have been seen in before they are compared."""
LIKELIER = 2.0
"""How much more frequent on arms than on trunk and legs the colours of an arm's pixels are, at least."""
FOUND, MISTAKEN = 0.6, 0.1
"""Least share of a part's pixels with such colours, and greatest share of the trunk's and legs', if the part differs from these."""
OVER_TRUNK, ABOUT_FOUND = 10, 20
"""Number of pixels, at 320 x 240, by which a part with the arms' colours reaches over the trunk, and distance (pixels) about it in which
pixels count."""
WELL = 0.8
"""Least overlap of body and silhouette at which colours are learnt."""
RARE = 1e-5
"""Added to every colour's frequency: one that is hardly seen says nothing."""
EDGE = 1
"""Bodies do not fit to the pixel: within this distance (pixels) of parts' edges no colour is learnt."""


class ColourCounts(NamedTuple):
    """Number of pixels of each colour that have been seen on hands, on forearms and on trunk and legs, each (4096,)."""

    hand: NDArray[np.int64]
    forearm: NDArray[np.int64]
    rest: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class ArmColours:
    """Learns the colours of a body's arms in a camera's picture, and finds them there."""

    picture: Picture

    def learnt(self, counts: ColourCounts | None, codes: ColourCode, mask: Mask, pose: Array) -> ColourCounts:
        """The counts with those of one more frame, of its mask (H, W) and the pose (D,) found in it."""
        last = ColourCounts(*np.zeros((3, NUMBER), np.int64)) if counts is None else counts
        hand, forearm, upper, head, rest = (thinned(self.drawn(pose, kind)) for kind in KINDS)
        others, arms = rest | head | upper, hand | forearm | upper
        shown = (hand & ~others, grown(forearm, -EDGE) & ~grown(others, EDGE), grown(rest, -EDGE) & ~grown(arms, EDGE) & ~head)
        own = thinned(mask)
        return ColourCounts(*(each + np.bincount(codes[pixels & own], minlength=NUMBER) for each, pixels in zip(last, shown)))

    def seen(self, counts: ColourCounts | None, codes: ColourCode, mask: Mask, pose: Array, ignore: Bits) -> PartObservation | None:
        """The pixels of a mask (H, W) that have the arms' colours, and the parts that these are; None if the colours are not known, or do
        not differ from those of trunk and legs. Only what is before the trunk counts; not the head, nor where an upper body's legs may be,
        all as in the last frame's `pose` (D,); nor pixels in `ignore`."""
        if counts is None:
            return None
        kinds, of_arms = distinct(counts, "hand" if len(self._shapes["hand"]) else "forearm")
        if not kinds:
            return None
        step, found = step_of(self.picture.camera.size), coloured(of_arms, codes, thinned(mask))
        found = found.repeat(step, 0).repeat(step, 1)[: mask.shape[0], : mask.shape[1]] & mask
        apart = self.drawn(pose, "head") | ~self._before_trunk(found, pose, step)
        ignored = ignore | pack(apart) | self.picture.leg_bits(pose)
        return PartObservation(Observation(pack(found) | ignored, ignored), tuple(self.parts_of(kinds)))

    def _before_trunk(self, found: Mask, pose: Array, step: int) -> Mask:
        """The trunk of a pose (D,), and what is about the parts of a mask (H, W) that reach over it."""
        import cv2

        trunk = self.drawn(pose, "rest")
        number, parts = cv2.connectedComponents(found.view(np.uint8))
        labels = np.asarray(parts, np.intp)
        over = np.bincount(labels[trunk & found], minlength=number) >= OVER_TRUNK * step**2
        return trunk | grown(over[labels], ABOUT_FOUND * step)

    def mismatch(self, seen: PartObservation, pose: Array) -> dict[str, float]:
        """Of each arm in a pose (D,), the pixels of its parts that have other colours, and those of the arms' colours that neither arm
        covers, over the first's number, at most 1; without arms whose parts do not count."""
        counted, parts = ~seen.observation.ignore, self.picture.body.parts
        which = {side: np.flatnonzero([part in seen.parts and part.startswith(side) for part in parts]) for side in SIDES}
        drawn = {f"{side}_arm": self.picture.draw(pose, own) & counted for side, own in which.items()}
        left, right = drawn.values()
        found = seen.observation.silhouette & counted
        over = count(found & ~(left | right))
        areas = {arm: count(own) for arm, own in drawn.items()}
        return {arm: min((count(own & ~found) + over) / areas[arm], 1.0) for arm, own in drawn.items() if areas[arm]}

    def drawn(self, pose: Array, kind: str) -> Mask:
        """The parts of a kind in a pose (D,), as a mask (H, W)."""
        return unpack(self.picture.draw(pose, self._shapes[kind]), self.picture.camera.size[0])

    @cached_property
    def _shapes(self) -> dict[str, NDArray[np.int64]]:
        """Indices of the body's shapes of each kind."""
        kinds = [kind_of(part) for part in self.picture.body.parts]
        return {kind: np.flatnonzero([each == kind for each in kinds]) for kind in KINDS}

    def shapes_of(self, kinds: Iterable[str]) -> NDArray[np.int64]:
        """Indices of the body's shapes of some kinds."""
        return np.concatenate([self._shapes[kind] for kind in kinds])

    def parts_of(self, kinds: Iterable[str]) -> list[str]:
        """Names of the parts of some kinds."""
        return [part for part in dict.fromkeys(self.picture.body.parts) if kind_of(part) in kinds]


KINDS = ("hand", "forearm", "upper_arm", "head", "rest")
"""Kinds of parts whose colours may differ; `rest`: trunk and legs."""


def coloured(of_arms: NDArray[np.bool_], codes: ColourCode, mask: Mask) -> Mask:
    """The pixels of a mask (h, w) whose colours (h, w) are those of arms, (4096,), without single pixels."""
    return grown(grown(of_arms[codes] & mask, -1), 1)


def kind_of(part: str) -> str:
    """The kind of a body's part."""
    name = part.partition("_")[2] if part.partition("_")[0] in SIDES else part
    name = {"lower_arm": "forearm", "neck": "head"}.get(name, name)
    return name if name in KINDS else "rest"


def distinct(counts: ColourCounts, outermost: str = "hand") -> tuple[tuple[str, ...], NDArray[np.bool_]]:
    """The kinds of parts whose colours differ from those of trunk and legs, and whether each colour (4096,) is theirs. No kinds if the
    arm's `outermost` does not differ: an arm's place is known by its end."""
    if counts.rest.sum() < ENOUGH_REST:
        return (), np.zeros(0, bool)
    rest, kinds, sum_of_kinds = _frequencies(counts.rest), list[str](), np.zeros(NUMBER)
    for kind in ("hand", "forearm"):
        number = getattr(counts, kind)
        if number.sum() < ENOUGH:
            continue
        own = _frequencies(number)
        likelier = own + RARE > LIKELIER * (rest + RARE)
        if own[likelier].sum() > FOUND and rest[likelier].sum() < MISTAKEN:
            kinds.append(kind)
            sum_of_kinds += own
    if outermost not in kinds:
        return (), np.zeros(0, bool)
    return tuple(kinds), sum_of_kinds / len(kinds) + RARE > LIKELIER * (rest + RARE)


def _frequencies(numbers: NDArray[np.int64]) -> Array:
    """Frequencies (4096,) of colours seen in numbers of pixels."""
    return numbers / max(numbers.sum(), 1)
