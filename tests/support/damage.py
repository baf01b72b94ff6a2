"""What a damaged file may do: be read all the same, or end in one sentence that names it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.motion.motion import JointTable


def told_or_read(read: Callable[[], JointTable], name: str) -> bool:
    """Whether `read` gives a table of places, or says of the file `name` in one line what is wrong; nothing else is caught."""
    try:
        table = read()
    except ShadowPuppetError as error:
        return name in str(error) and "\n" not in str(error)
    return table.positions.shape == (len(table.times), len(table.names), 3) and not np.isinf(table.positions).any()
