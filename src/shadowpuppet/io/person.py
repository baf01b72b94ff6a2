"""Reads and writes a person's sizes (person.toml)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from shadowpuppet.body.models import MODELS, kind_of, sizes_kind
from shadowpuppet.body.sizes import HEIGHTS, CardboxSizes, Sizes, expected_metres, is_within
from shadowpuppet.errors import FormatError, ShadowPuppetError, choices, shown
from shadowpuppet.io.files.text import errors_named, read_toml, write_whole

KEYS = ("body", "height", "source", "notes", "sizes")
DEFAULT_BODY = "rounded"
"""Body model of a file without one; all upper bodies have the same sizes."""


@dataclass(frozen=True)
class Person:
    """A person's sizes and height. Raises `ShadowPuppetError` for an impossible height."""

    sizes: Sizes
    """Sizes of an upper or a whole body."""
    height: float | None = None
    """Metres, with shoes; None if unknown."""
    source: str = ""
    """Source of the sizes, such as `references` or `proportions`."""
    notes: str = ""
    """Any text."""

    def __post_init__(self) -> None:
        """Check height, source and notes."""
        if self.height is not None and not is_within(self.height, HEIGHTS):
            raise ShadowPuppetError(f"height: found {shown(self.height)}, {expected_metres(self.height, HEIGHTS)}")
        for key in ("source", "notes"):
            if not isinstance(getattr(self, key), str):
                raise ShadowPuppetError(f"{key}: found {getattr(self, key)!r}, expected text in quotes")


def read_person(path: str | Path, body: str | None = None) -> Person:
    """Read a person's sizes.

    Raises `FormatError`, naming file and field, if a key is unknown, a size missing or impossible, or the sizes do not fit `body`.
    """
    path, wanted = Path(path), body
    data = read_toml(path, FormatError)
    unknown = set(data) - set(KEYS)
    if unknown:
        raise FormatError(f"{path}: found the key {min(unknown)!r}; keys known: {choices(KEYS)}")
    sizes, body = data.pop("sizes", None), data.pop("body", DEFAULT_BODY)
    if not isinstance(body, str) or body not in MODELS:
        raise FormatError(f"{path}: body: found {body!r}, expected one of {choices(MODELS)}")
    kind = sizes_kind(body)
    if not isinstance(sizes, dict):
        raise FormatError(f"{path}: sizes: found {sizes!r}, expected a table [sizes] with {choices(kind.names())}")
    with errors_named(path):
        person = Person(kind.from_mapping(sizes), **data)
    if wanted is not None and kind is not sizes_kind(wanted):
        raise FormatError(f"{path}: sizes: found those of the body {body!r}, expected those of {wanted!r}: choose that body, or measure "
                          "the person again")
    return person


def write_person(path: str | Path, person: Person) -> None:
    """Write a person for `read_person`. Raises `ShadowPuppetError` if that fails."""
    import tomli_w

    upper = isinstance(person.sizes, CardboxSizes)
    known: dict[str, Any] = {} if upper else {"body": kind_of(person.sizes)}
    known |= {} if person.height is None else {"height": float(person.height)}
    sizes = dict(zip(person.sizes.names(), person.sizes.to_array().tolist()))
    head = "# Lengths in metres" + ("; the sizes are a1..a18 of Liu 2011, Fig. 2.\n" if upper else ".\n")
    write_whole(Path(path), head + tomli_w.dumps({**known, "source": person.source, "notes": person.notes, "sizes": sizes}))
