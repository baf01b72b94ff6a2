"""Which body one camera's film asks for: the whole person who does not stay in one place.

An upper body stays where it was measured. Of a person who stands it is the more accurate one.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from shadowpuppet.body.models import BodyName
from shadowpuppet.camera.mask import Mask
from shadowpuppet.errors import HARMFUL, NOTED, Finding
from shadowpuppet.pipeline.findings.cautions import AT_TIMES, MOSTLY
from shadowpuppet.tracking.monocular.standing_place import soles_row
from shadowpuppet.tracking.silhouette_cost import Soles

LOW = 0.05
"""Share of the silhouette's height, from below, that shows whether feet are seen."""
FEET = 0.5
"""Greatest width of that part, over the root of the silhouette's area: that of feet is 0.1 to 0.4, of a cut off trunk 0.6 to 0.8."""
MOVES = 0.155
"""Least way of a person who does not stay in one place, over the silhouette's height, between the 20th and the 80th per cent of the masks:
what is in the picture for a moment moves nobody. On 58 made films in which people stand 0.15 at most, an intruder beside them among these;
0.16 at least on 20 in which they walk, squat, kneel or sit down. Of walkers whose feet are never seen the whole body is no better."""


def body_for(masks: Sequence[Mask]) -> BodyName:
    """The body for a film with masks (H, W) of moments that are spread over it: whole if feet are seen, at least at times, of a person who
    moves. Where they are mostly seen, soles and crown tell, too, who comes nearer, sits down or squats; else the lower end is the picture's
    or a table's, and the upper one may be hands."""
    shown = [mask for mask in masks if mask.any()]
    soles = [found.row for mask in shown if (found := _feet(mask)) is not None]
    if not soles or len(soles) < AT_TIMES * len(shown):
        return "rounded"
    rows = [soles, [mask.any(1).argmax() for mask in shown]] if len(soles) >= (1 - MOSTLY) * len(shown) else []
    return "anatomical" if _goes_about(shown) or any(_is_way(each, shown) for each in rows) else "rounded"


def walking_cautions(masks: Sequence[Mask]) -> list[Finding]:
    """That a person whose upper body is tracked goes about, by masks (H, W) as in `body_for`."""
    shown = [mask for mask in masks if mask.any()]
    if not shown or not _goes_about(shown):
        return []
    return [Finding("the person goes about in the picture, whose feet are not seen: an upper body stays at the distance where it was "
                    "measured, and all depths are as wrong as that changes; step back until the feet are seen",
                    "person goes about, feet unseen: distance unknown; step back", HARMFUL)]


def _goes_about(shown: Sequence[Mask]) -> bool:
    """Whether the middle of a person's silhouettes (H, W) moves."""
    return _is_way([float(np.median(np.nonzero(mask)[1])) for mask in shown], shown)


def _is_way(places: Sequence[float], shown: Sequence[Mask]) -> bool:
    """Whether places in a picture, pixels, are those of a person who moves, whose silhouettes (H, W) are `shown`."""
    heights = [len(mask) - mask[::-1].any(1).argmax() - mask.any(1).argmax() for mask in shown]
    return bool(np.diff(np.percentile(places, [20, 80])).item() > MOVES * np.median(heights))


def whole_person() -> Finding:
    """The finding that the whole person is tracked because of the film: no option gave the body."""
    return Finding("the person walks, sits down or squats: the whole person is tracked (--body anatomical), with more doubt about the arms "
                   "than an upper body (--body rounded), which stays where it was measured",
                   "the whole person is tracked: they walk, or sit down", NOTED)


def _feet(mask: Mask) -> Soles | None:
    """Where the feet end in a mask (H, W); None if it shows none."""
    soles = soles_row(mask)
    if soles is None or soles.cut:
        return None
    top, end = int(mask.any(1).argmax()), int(soles.row + 0.5)
    low = mask[end - max(round(LOW * (end - top)), 1) : end]
    return None if np.count_nonzero(low) > FEET * len(low) * np.count_nonzero(mask) ** 0.5 else soles
