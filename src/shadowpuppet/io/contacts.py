"""Writes and reads contacts of the feet with the floor: a run's contacts.csv, and the columns of contacts in a truth.

A row a frame: `time`, `floor` (its height, m), and for each heel and toe `<point>_contact`, 0 or 1, and `<point>_probability`, empty
where the point is unknown.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.errors import FormatError
from shadowpuppet.geometry import Array
from shadowpuppet.io.files.table import cells, csv_line, read_table
from shadowpuppet.io.files.text import write_whole
from shadowpuppet.motion.contact.contact import SOLES, Contacts

CONTACT, PROBABILITY = "_contact", "_probability"
"""Suffixes of the columns."""


class ContactTable(NamedTuple):
    """Contacts over time."""

    times: Array
    """Seconds, of shape (T,)."""
    names: tuple[str, ...]
    """P of `SOLES`."""
    touching: NDArray[np.bool_]
    """Of shape (T, P)."""


def write_contacts(path: str | Path, times: Array, contacts: Contacts) -> None:
    """Write contacts.csv. Raises `ShadowPuppetError` if that fails."""
    header = ["time", "floor", *(name + suffix for name in contacts.names for suffix in (CONTACT, PROBABILITY))]
    lines = [csv_line(header)]
    for time, touching, probability in zip(times.tolist(), contacts.touching.tolist(), contacts.probability.tolist()):
        pairs = [cell for flag, p in zip(touching, probability) for cell in (str(int(flag)), *cells([p], 3))]
        lines.append(csv_line([*cells([time]), *cells([contacts.floor], 4), *pairs]))
    write_whole(Path(path), "".join(lines))


def read_contacts(path: str | Path) -> ContactTable | None:
    """The contacts in a table: a run's contacts.csv or a truth; None for a table without any, or no table (.csv). Raises `FormatError`,
    naming file and line."""
    path = Path(path)
    if path.suffix.lower() != ".csv":
        return None
    table = read_table(path)
    names = tuple(name for name in SOLES if name + CONTACT in table.columns)
    if not names:
        return None
    flags = table.numbers([name + CONTACT for name in names])
    if not np.isin(flags, (0, 1)).all():
        raise FormatError(f"{path}: found a contact other than 0 and 1")
    return ContactTable(table.times(), names, flags == 1)
