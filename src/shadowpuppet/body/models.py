"""Every body by name: the function that makes it, the sizes that it is made from, and the average person's.

A new body is one entry in `MODELS`: settings, flags, messages and person files follow.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, TypeVar

from shadowpuppet.body.anthropometry import ANATOMICAL_SHARES, AVERAGE_HEIGHT, CYLINDER_SHARES, PROPORTIONS, SOLE, stature_of
from shadowpuppet.body.shapes import Body
from shadowpuppet.body.sizes import AnatomicalSizes, BoneSizes, CardboxSizes, CylinderSizes, Sizes
from shadowpuppet.body.upper_body import HAND_SHARE, WRIST_SHARE, boxes, cardbox, cardbox_bends, rounded
from shadowpuppet.body.whole_body import anatomical, cylinders
from shadowpuppet.errors import ShadowPuppetError, choices

Make = Callable[[Any], Body]
"""Function from sizes to a body."""
Whole = TypeVar("Whole", bound=BoneSizes)


class BodyModel(NamedTuple):
    """A kind of body."""

    make: Make
    """Makes a body of the sizes."""
    sizes: type[Sizes]
    """The class of its sizes; for a whole body, which stands in the world, a subclass of `BoneSizes`."""
    shares: Mapping[str, tuple[float, float]]
    """The average person's sizes as fractions of the stature, and their deviations."""
    independent_points: float = 10.0
    """Effective number of independent surface points a frame, by which several cameras measure sizes."""


MODELS: dict[str, BodyModel] = {
    "cardbox": BodyModel(cardbox, CardboxSizes, PROPORTIONS),
    "cardbox_bends": BodyModel(cardbox_bends, CardboxSizes, PROPORTIONS),
    "boxes": BodyModel(boxes, CardboxSizes, PROPORTIONS),
    "rounded": BodyModel(rounded, CardboxSizes, PROPORTIONS),
    "anatomical": BodyModel(anatomical, AnatomicalSizes, ANATOMICAL_SHARES),
    "cylinders": BodyModel(cylinders, CylinderSizes, CYLINDER_SHARES, 0.2),  # which fit nobody well: more would distort the bones
}
WHOLE = tuple(name for name, model in MODELS.items() if issubclass(model.sizes, BoneSizes))
"""Bodies of the whole person."""
if TYPE_CHECKING:
    BodyName = WholeBodyName = str
else:
    BodyName, WholeBodyName = Literal[tuple(MODELS)], Literal[WHOLE]
"""Types of settings and flags that name a body."""


def sizes_kind(name: str) -> type[Sizes]:
    """The class of the sizes that a body is made from. Raises `ShadowPuppetError` with the valid names."""
    if name not in MODELS:
        raise ShadowPuppetError(f"unknown body {name!r}; there are: {choices(MODELS)}")
    return MODELS[name].sizes


def kind_of(sizes: Sizes) -> str:
    """The name of a body that is made from these sizes; the first if there are several."""
    return next(name for name, model in MODELS.items() if isinstance(sizes, model.sizes))


def make_body(body: str | Make, sizes: Sizes) -> Body:
    """A body by name, or by a function of the sizes. Raises `ShadowPuppetError` for an unknown name or another body's sizes."""
    if not isinstance(body, str):
        return body(sizes)
    kind = sizes_kind(body)
    if not isinstance(sizes, kind):
        raise ShadowPuppetError(f"body {body!r}: found {type(sizes).__name__}, expected {kind.__name__}")
    return MODELS[body].make(sizes)


def average_sizes(name: str, height: float) -> Sizes:
    """The average person's sizes for a body, from the height (m, shoes on)."""
    return sizes_kind(name)(**{size: share * (height - SOLE) for size, (share, _) in MODELS[name].shares.items()})


def shares_of(kind: type[BoneSizes]) -> Mapping[str, tuple[float, float]]:
    """Sizes of a whole body as fractions of the stature, and their deviations."""
    return next(model.shares for model in MODELS.values() if issubclass(kind, model.sizes))


def whole_sizes_from_bones(kind: type[Whole], lengths: Mapping[str, float], stature: float | None = None) -> Whole:
    """Sizes of a whole body from known lengths (m); the others are average for the stature, by default the likeliest (`stature_of`)."""
    stature = stature_of(lengths) if stature is None else stature
    return kind(**{name: lengths.get(name, share * stature) for name, (share, _) in shares_of(kind).items()})


WIDTHS_FROM_UPPER = {
    ("pelvis_width",): "waist_width", ("pelvis_depth",): "waist_depth", ("waist_width", "trunk_width"): "torso_bottom_width",
    ("waist_depth", "trunk_depth"): "torso_bottom_depth", ("chest_width",): "shoulder_width", ("chest_depth",): "torso_top_depth",
    ("head_width",): "head_width", ("head_depth",): "head_depth", ("upper_arm_width",): "upper_arm_width",
    ("elbow_width", "forearm_width", "wrist_width"): "elbow_width",
}  # fmt: skip
"""Widths of whole bodies, and the size of an upper body that they are scaled by."""
MIN_STOUTNESS, MAX_STOUTNESS = 0.75, 1.35
"""Bounds of that scale, relative to the average person's width."""


def whole_from_upper(name: str, sizes: CardboxSizes, height: float) -> BoneSizes:
    """Sizes of a whole body from those of an upper body and the height (m, shoes on). Arms and shoulders are taken over; trunk and head
    are as much wider than average as the upper body's; the rest is average."""
    kind, stature, fore = sizes_kind(name), height - SOLE, sizes.forearm_length
    assert issubclass(kind, BoneSizes)
    known = {"shoulder_distance": sizes.shoulder_width - 2 * sizes.shoulder_inset, "upper_arm_length": sizes.upper_arm_length,
             "forearm_length": WRIST_SHARE * fore, "hand_length": (1 - WRIST_SHARE) * fore,
             "hand_point": (HAND_SHARE - WRIST_SHARE) * fore}  # fmt: skip
    for widths, upper in WIDTHS_FROM_UPPER.items():
        ratio = min(max(getattr(sizes, upper) / (PROPORTIONS[upper][0] * stature), MIN_STOUTNESS), MAX_STOUTNESS)
        known |= {width: ratio * shares_of(kind)[width][0] * stature for width in widths if width in kind.names()}
    return whole_sizes_from_bones(kind, known, stature)


def average_body(name: str) -> Body:
    """A body model of average sizes, used before the person's sizes are known."""
    return make_body(name, average_sizes(name, AVERAGE_HEIGHT))
