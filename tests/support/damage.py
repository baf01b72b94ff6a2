"""Check for damaged files: reading succeeds, or fails with one sentence that names the file."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.motion.motion import JointTable


def told_or_read(read: Callable[[], JointTable], name: str) -> bool:
    """Assert that `read` returns a table of positions, or raises an error of one line that names the file; other errors are not caught."""
    try:
        table = read()
    except ShadowPuppetError as error:
        return name in str(error) and "\n" not in str(error)
    return table.positions.shape == (len(table.times), len(table.names), 3) and not np.isinf(table.positions).any()
