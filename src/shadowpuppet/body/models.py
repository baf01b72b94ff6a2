"""Every body by name: what it is made from, and of what average."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from shadowpuppet.body.anthropometry import PROPORTIONS, SOLE, shares_of, sizes_from_height, whole_sizes_from_bones, whole_sizes_from_height
from shadowpuppet.body.shapes import Body
from shadowpuppet.body.sizes import BoneSizes, CardboxSizes, Sizes, sizes_kind
from shadowpuppet.body.upper_body import BODIES, HAND_SHARE, WRIST_SHARE
from shadowpuppet.body.whole_body import anatomical, cylinders
from shadowpuppet.errors import ShadowPuppetError

Make = Callable[[Any], Body]
"""Sizes to a body."""
ALL: dict[str, Make] = {**BODIES, "anatomical": anatomical, "cylinders": cylinders}
"""How each body is made from its sizes."""


def make_body(body: str | Make, sizes: Sizes) -> Body:
    """A body by name, or by a function of your own that makes one of sizes. Raises `ShadowPuppetError` with the names there are, or for
    sizes of another kind of body."""
    if not isinstance(body, str):
        return body(sizes)
    kind = sizes_kind(body)
    if not isinstance(sizes, kind):
        raise ShadowPuppetError(f"body {body!r}: found {type(sizes).__name__}, expected {kind.__name__}")
    return ALL[body](sizes)


def average_sizes(name: str, height: float) -> Sizes:
    """Sizes of the average person of a height (m, shoes on), of the kind that a body is made from."""
    kind = sizes_kind(name)
    return sizes_from_height(height) if kind is CardboxSizes else whole_sizes_from_height(kind, height)  # pyright: ignore[reportArgumentType]


def whole_from_upper(name: str, sizes: CardboxSizes, height: float) -> BoneSizes:
    """Sizes of a whole body of someone whose height (m, shoes on) and sizes of an upper body are known: arms and shoulders as they are,
    trunk and head as much wider than the average person's, all else by proportions.
    """
    kind, stature, fore = sizes_kind(name), height - SOLE, sizes.forearm_length
    assert issubclass(kind, BoneSizes)
    known = {"shoulder_distance": sizes.shoulder_width - 2 * sizes.shoulder_inset, "upper_arm_length": sizes.upper_arm_length}
    known |= {"forearm_length": WRIST_SHARE * fore, "hand_length": (1 - WRIST_SHARE) * fore,
              "hand_point": (HAND_SHARE - WRIST_SHARE) * fore}  # fmt: skip
    for widths, upper in WIDER.items():
        ratio = getattr(sizes, upper) / (PROPORTIONS[upper][0] * stature)
        known |= {width: min(max(ratio, 0.75), 1.35) * shares_of(kind)[width][0] * stature for width in widths if width in kind.names()}
    return whole_sizes_from_bones(kind, known, stature)


WIDER = {
    ("pelvis_width",): "waist_width", ("pelvis_depth",): "waist_depth", ("waist_width", "trunk_width"): "torso_bottom_width",
    ("waist_depth", "trunk_depth"): "torso_bottom_depth", ("chest_width",): "shoulder_width", ("chest_depth",): "torso_top_depth",
    ("head_width",): "head_width", ("head_depth",): "head_depth", ("upper_arm_width",): "upper_arm_width",
    ("elbow_width", "forearm_width", "wrist_width"): "elbow_width",
}  # fmt: skip
"""Widths of whole bodies, and the size of an upper body that tells how stout someone is there."""
