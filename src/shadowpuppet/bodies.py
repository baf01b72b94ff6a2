"""Every body by name: what it is made from, and of what average."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from shadowpuppet.anthropometry import sizes_from_height, whole_sizes_from_height
from shadowpuppet.body import BODIES, Body
from shadowpuppet.errors import ShadowPuppetError, choices
from shadowpuppet.sizes import CardboxSizes, Sizes
from shadowpuppet.whole_body import anatomical, cylinders
from shadowpuppet.whole_sizes import AnatomicalSizes, CylinderSizes

ALL: dict[str, tuple[Callable[[Any], Body], type[Sizes]]] = {
    **{name: (make, CardboxSizes) for name, make in BODIES.items()},
    "anatomical": (anatomical, AnatomicalSizes),
    "cylinders": (cylinders, CylinderSizes),
}
"""How each body is made, and the sizes that it is made from."""
WHOLE = ("anatomical", "cylinders")
"""Bodies of the whole person, which stand in the world."""


def sizes_kind(name: str) -> type[Sizes]:
    """The sizes that a body is made from. Raises `ShadowPuppetError` with the names there are."""
    if name not in ALL:
        raise ShadowPuppetError(f"unknown body {name!r}; there are: {choices(ALL)}")
    return ALL[name][1]


def kind_of(sizes: Sizes) -> str:
    """Name of a body that is made from such sizes; of several the first."""
    return next(name for name, (_, kind) in ALL.items() if isinstance(sizes, kind))


def make_body(name: str, sizes: Sizes) -> Body:
    """A body by name. Raises `ShadowPuppetError` with the names there are, or for sizes of another kind of body."""
    kind = sizes_kind(name)
    if not isinstance(sizes, kind):
        raise ShadowPuppetError(f"body {name!r}: found {type(sizes).__name__}, expected {kind.__name__}")
    return ALL[name][0](sizes)


def average_sizes(name: str, height: float) -> Sizes:
    """Sizes of the average person of a height (m, shoes on), of the kind that a body is made from."""
    kind = sizes_kind(name)
    return sizes_from_height(height) if kind is CardboxSizes else whole_sizes_from_height(kind, height)  # pyright: ignore[reportArgumentType]
