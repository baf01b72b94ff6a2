"""Which body one camera's film asks for: the whole person where the feet are seen and do not stay in one place, or the person sits down.

An upper body stays where it was measured. Of a person who stands it is the more accurate one.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from shadowpuppet.body.models import BodyName
from shadowpuppet.camera.mask import Mask
from shadowpuppet.errors import NOTED, Finding
from shadowpuppet.geometry import Array
from shadowpuppet.pipeline.findings.cautions import MOSTLY
from shadowpuppet.tracking.monocular.standing_place import soles_row

LOW = 0.05
"""Share of the silhouette's height, from below, that shows whether feet are seen."""
FEET = 0.5
"""Greatest width of that part, over the root of the silhouette's area: that of feet is 0.1 to 0.4, of a cut off trunk 0.6 to 0.8."""
WALKS = 0.2
"""Least way of the feet in the picture, over the silhouette's height, between the tenth and the ninetieth per cent of the masks."""


def body_for(masks: Sequence[Mask], sits: bool) -> BodyName:
    """The body for a film with masks (H, W) of moments that are spread over it; `sits`: whether the person sits down or kneels in it."""
    feet = [found for mask in masks if (found := _feet(mask)) is not None]
    if len(feet) < (1 - MOSTLY) * max(sum(mask.any() for mask in masks), 1):
        return "rounded"
    x, y, height = np.array(feet).T
    way = max(float(np.diff(np.percentile(each, [10, 90]))[0]) for each in (x, y))
    return "anatomical" if sits or way > WALKS * np.median(height) else "rounded"


def whole_person() -> Finding:
    """The finding that the whole person is tracked because of the film: no option gave the body."""
    return Finding("the person walks, or sits down, and the feet are seen: the whole person is tracked (--body anatomical), with more "
                   "doubt about the arms than an upper body (--body rounded), which stays where it was measured",
                   "the whole person is tracked: they walk, or sit down", NOTED)


def _feet(mask: Mask) -> Array | None:
    """Where the feet are in a mask (H, W), column and row, and the height of the mask, pixels; None if it shows none."""
    soles = soles_row(mask)
    if soles is None or soles.cut:
        return None
    top, end = int(mask.any(1).argmax()), int(soles.row + 0.5)
    height = end - top
    low = mask[end - max(round(LOW * height), 1) : end]
    if np.count_nonzero(low) > FEET * len(low) * np.count_nonzero(mask) ** 0.5:
        return None
    return np.array([np.median(np.nonzero(low)[1]), soles.row, height], float)
