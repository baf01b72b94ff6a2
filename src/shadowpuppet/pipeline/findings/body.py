"""Which body one camera's film asks for: the whole person who does not stay in one place.

An upper body stays where it was measured. Of a person who stands it is the more accurate one.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from shadowpuppet.body.models import BodyName
from shadowpuppet.camera.mask import Mask
from shadowpuppet.errors import NOTED, Finding
from shadowpuppet.pipeline.findings.cautions import MOSTLY
from shadowpuppet.tracking.monocular.standing_place import soles_row
from shadowpuppet.tracking.silhouette_cost import Soles

LOW = 0.05
"""Share of the silhouette's height, from below, that shows whether feet are seen."""
FEET = 0.5
"""Greatest width of that part, over the root of the silhouette's area: that of feet is 0.1 to 0.4, of a cut off trunk 0.6 to 0.8."""
MOVES = 0.155
"""Least way of a person who does not stay in one place, over the silhouette's height, between the 20th and the 80th per cent of the masks:
what is in the picture for a moment moves nobody. On 58 made films in which people stand 0.15 at most, an intruder beside them among these;
0.16 at least on 20 in which they walk, squat, kneel or sit down."""


def body_for(masks: Sequence[Mask]) -> BodyName:
    """The body for a film with masks (H, W) of moments that are spread over it. The outline's middle tells who walks; soles and crown who
    comes nearer, sits down or squats, where feet are seen: without them the lower end is a table's, and the upper one may be hands."""
    shown = [mask for mask in masks if mask.any()]
    if not shown:
        return "rounded"
    soles = [found.row for mask in shown if (found := _feet(mask)) is not None]
    tops = [mask.any(1).argmax() for mask in shown]
    heights = [len(mask) - mask[::-1].any(1).argmax() - top for mask, top in zip(shown, tops, strict=True)]
    rows = [soles, tops] if len(soles) >= (1 - MOSTLY) * len(shown) else []
    ways = [np.diff(np.percentile(each, [20, 80])).item() for each in ([np.median(np.nonzero(mask)[1]) for mask in shown], *rows)]
    return "anatomical" if max(ways) > MOVES * np.median(heights) else "rounded"


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
