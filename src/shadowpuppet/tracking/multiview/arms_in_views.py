"""Arms found by their colours in the pictures of several cameras (not in Ni 2008).

Where an arm hangs beside the trunk, or comes before it, the visual hull of a few cameras has no surface between the two. What each camera
sees of the colours of hands, and of forearms if these are bare, must be covered by the arms of a pose. The opposite is not asked: a camera
does not see an arm that the trunk hides.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.shapes import Body
from shadowpuppet.camera.bits import Bits, count, pack
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.colour_codes import ColourCode, step_of, thinned
from shadowpuppet.camera.mask import Mask, grown, may_be_person
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.arm_colours import ENOUGH, KINDS, ArmColours, ColourCounts, coloured, distinct
from shadowpuppet.tracking.silhouette_cost import Cost

PLENTY = 5000
"""Number of pixels of hands after which a camera learns no more."""
ARM = ("hand", "forearm", "upper_arm")
MOST = 1.5
"""Greatest area with the hands' colours, over that of both arms as drawn last: more is something else, too."""
SLEEVE = 0.2
"""Share of a forearm's pixels with the arms' colours below which it is covered by a sleeve."""
Counts = tuple[ColourCounts | None, ...]
"""The colours seen by each camera; empty: by none so far."""
ABOUT_HEAD, ABOUT_ARMS = 12, 24
"""Distance (pixels) from the head's last place within which colours do not count, as its skin may have the hands'; and from the arms' last
places and the trunk beyond which they do not: a shadow on the floor may have them, too."""


class ArmsInViews:
    """Learns the colours of a body's arms in each camera's pictures, and compares poses with what has these colours."""

    def __init__(self, body: Body, cameras: Sequence[Camera]) -> None:
        """`cameras`: calibrated, with known poses in the world. Pictures are those that `thinned` leaves."""
        thin = [camera.thinned(step_of(camera.size)) for camera in cameras]
        self.views = tuple(ArmColours(Picture(body, camera, camera.T_camera_world)) for camera in thin)

    def learnt(self, counts: Counts, codes: Sequence[ColourCode | None], masks: Sequence[Mask | None], pose: Array) -> Counts:
        """The counts with those of one more frame, of its masks (H, W) and the pose (D,) found in it; as they are where enough is known."""
        found = list[ColourCounts | None]()
        for view, known, seen, mask in zip(self.views, counts or (None,) * len(self.views), codes, masks, strict=True):
            if seen is None or mask is None or not may_be_person(mask) or (known is not None and known.hand.sum() >= PLENTY):
                found.append(known)
            else:
                found.append(view.learnt(known, seen, thinned(mask), pose))
        return tuple(found)

    def uncovered(self, counts: Counts, codes: Sequence[ColourCode | None], masks: Sequence[Mask | None], last: Array) -> Cost | None:
        """The pixels of a frame's masks (H, W) that have the colours of arms and that the arms of poses (N, D) do not cover, as shares (N,)
        of the silhouettes' area; None if nothing has these colours. `last`: the pose (D,) in the frame before."""
        seen, area = list[tuple[Picture, NDArray[np.int64], Bits]](), 0
        for view, known, colours, mask in zip(self.views, counts, codes, masks):
            if mask is None or not may_be_person(mask):
                continue
            small = thinned(mask)
            area += int(np.count_nonzero(small))
            if known is None or colours is None or (of_hands := _of_hands(known)) is None:
                continue
            drawn = {kind: view.drawn(last, kind) for kind in KINDS}
            found = coloured(of_hands, colours, small) & _where_arms_may_be(drawn)
            if 0 < np.count_nonzero(found) <= MOST * sum(np.count_nonzero(drawn[kind]) for kind in ARM):
                seen.append((view.picture, view.shapes_of(_covering(known, of_hands)), pack(found)))

        def uncovered(poses: Array) -> Array:
            left = np.zeros(len(poses))
            for picture, shapes, found in seen:
                everywhere = ~np.zeros_like(found)
                left += count(found) + picture.added(poses, shapes, everywhere, ~found)  # less the pixels found that a pose covers
            return left / area

        return uncovered if seen else None


def _where_arms_may_be(drawn: Mapping[str, Mask]) -> Mask:
    """Pixels (h, w) in which the hands may be in the next frame; `drawn`: the body's parts in this one (h, w), by kind."""
    return (grown(drawn["hand"] | drawn["forearm"], ABOUT_ARMS) | drawn["rest"]) & ~grown(drawn["head"], ABOUT_HEAD)


def _of_hands(counts: ColourCounts) -> NDArray[np.bool_] | None:
    """Whether each colour (4096,) is one of the hands, and of bare forearms, which are alike; None if hands do not differ from the clothes.
    The colours of forearms themselves are not used: under a long sleeve they are the shirt's, and may seem rare on the trunk while a camera
    has seen little of it."""
    kinds, found = distinct(counts._replace(forearm=np.zeros_like(counts.forearm)))
    return found if kinds else None


def _covering(counts: ColourCounts, of_hands: NDArray[np.bool_]) -> tuple[str, ...]:
    """The kinds of parts that may have the hands' colours, (4096,): the whole arm, as short sleeves end above the elbow, or the hand alone
    if the forearm is seen to have a sleeve."""
    number = int(counts.forearm.sum())
    return ("hand",) if number >= ENOUGH and counts.forearm[of_hands].sum() < SLEEVE * number else ARM
