"""Detects a person who stands still, whole in the picture."""

from __future__ import annotations

from collections import deque

import numpy as np

from shadowpuppet.camera.mask import Mask
from shadowpuppet.silhouette.quality import MIN_CONTACT, NEARLY_ALL

NOBODY, TOO_NEAR = 0.015, 0.6
"""Share of the picture under which a silhouette is no person, and from which on a person is too near."""
STILL = 0.1
"""Largest share of a silhouette's pixels that differ from an earlier one while a person stands still..."""
APART = 0.25
"""... this many seconds before."""
MEASURED = 6
"""Number of silhouettes in which a person is measured."""


class StandStillDetector:
    """Looks at silhouettes until a person has stood still for long enough to be measured."""

    def __init__(self, seconds: float) -> None:
        """`seconds`: how long a person must stand still."""
        self.seconds, self.message = seconds, "step into the picture, facing the camera"
        self._seen: deque[tuple[float, Mask]] = deque()
        self._since = np.nan

    def see(self, now: float, mask: Mask) -> list[Mask] | None:
        """Take a silhouette (H, W) at a time (s); returns those of the person who stood still, once there is one, else None."""
        while len(self._seen) > 1 and self._seen[0][0] < now - max(self.seconds, APART) - 0.5:
            self._seen.popleft()
        hint = unfit(mask)
        moves = not hint and self._moves(now, mask)
        self._seen.append((now, mask))
        if hint or moves:
            self._since, self.message = np.nan, hint or "stand still a moment, facing the camera"
            return None
        self._since = now if np.isnan(self._since) else self._since
        self.message = "stand still a moment, facing the camera"
        if now - self._since < self.seconds:
            return None
        still = [seen for time, seen in self._seen if time >= self._since]
        return [still[k] for k in np.unique(np.linspace(0, len(still) - 1, MEASURED).astype(int))]

    def wait(self) -> None:
        """No pictures came for a while: start again."""
        self._seen.clear()
        self._since = np.nan

    def _moves(self, now: float, mask: Mask) -> bool:
        """Whether the silhouette differs from that of a quarter of a second ago, or from the last where there is none."""
        earlier = [seen for time, seen in self._seen if time <= now - APART] or [seen for _, seen in self._seen]
        return not earlier or bool(np.count_nonzero(mask ^ earlier[-1]) > STILL * np.count_nonzero(mask))


def unfit(mask: Mask) -> str:
    """Advice for a person who cannot be measured in a silhouette (H, W); empty if they can."""
    share = float(mask.mean())
    if share >= NEARLY_ALL:
        return "nearly all of the picture has changed: let the background be learnt anew"
    if share < NOBODY:
        return "step into the picture, facing the camera"
    if share > TOO_NEAR or int(mask[0].sum()) >= MIN_CONTACT:
        return "step back: the head must be in the picture"
    if max(int(mask[:, 0].sum()), int(mask[:, -1].sum())) >= MIN_CONTACT:
        return "move to the middle of the picture"
    return ""
