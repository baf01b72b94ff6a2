"""Which cameras are set aside, or blind, while a recording or a live session is tracked."""

from __future__ import annotations

import operator
from collections.abc import Sequence

from shadowpuppet.camera.bits import Bits
from shadowpuppet.camera.mask import Seen
from shadowpuppet.tracking.frozen import CameraWatch, Interval, is_blind
from shadowpuppet.tracking.multiview.watch.out_of_step import StepWatch


class RigWatch:
    """Sets cameras aside that are frozen, blind or out of step, and takes them back: `watch(seconds, seen)` has None in place of their
    masks. `tracked` follows for each frame set, in the same order. Of one camera it notes when it is blind."""

    def __init__(self, number: int, short: Sequence[bool] = ()) -> None:
        """For a number of cameras; `short`: those whose films have fewer frames than others."""
        self._watch, self._steps = CameraWatch(number), StepWatch(number, short)
        self._many = number > 1

    def __call__(self, seconds: float, seen: Seen) -> Seen:
        """What is seen in a frame set at a time (s), without masks and keypoints of cameras that are set aside. A single camera is
        never set aside: when it is blind is only noted."""
        if not self._many:
            self._watch.aside.note(seconds, ["blind" if is_blind(mask) else "" for mask in seen.masks])
            return seen
        kept = self._steps(seconds, self._watch(seconds, seen.masks))
        found = (None if aside else each for aside, each in zip(map(operator.is_not, kept, seen.masks), seen.keypoints))
        return seen._replace(masks=kept, keypoints=tuple(found))

    def tracked(self, drawn: Sequence[Bits]) -> None:
        """The body of the first frame set that has none yet, as `StepWatch.tracked` expects it."""
        if self._many:
            self._steps.tracked(drawn)

    @property
    def intervals(self) -> list[Interval]:
        """When cameras were set aside, or the only one was blind."""
        return self._watch.aside.intervals + self._steps.aside.intervals

    @property
    def present(self) -> dict[int, str]:
        """Why cameras are set aside in the last frame set, by index."""
        return self._watch.aside.present | self._steps.aside.present
