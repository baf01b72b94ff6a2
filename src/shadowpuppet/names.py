"""Names of cameras, joints and files are the same if they look the same: `é` is one sign of Unicode or two, and macOS takes two."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TypeVar
from unicodedata import normalize

T = TypeVar("T")


def composed(name: str) -> str:
    """A name in the form in which names are compared (NFC); written names keep their own."""
    return normalize("NFC", name)


def spelled_as(by_name: Mapping[str, T], known: Iterable[str]) -> dict[str, T]:
    """Values by names, where `known` names are spelled as there."""
    spelling = {composed(name): name for name in known}
    return {spelling.get(composed(name), name): value for name, value in by_name.items()}
