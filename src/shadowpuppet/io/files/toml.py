"""TOML files read whole, and what is said where that fails."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from shadowpuppet.errors import ShadowPuppetError

FILE_LIMIT = 10_000_000
"""Bytes; no calibration or settings are longer, and a film given by mistake is not read."""


def read_toml(path: str | Path, error: type[ShadowPuppetError]) -> dict[str, Any]:
    """A TOML file's tables; a file that is missing, too large or no TOML raises `error` in a sentence."""
    path = Path(path)
    try:
        if path.stat().st_size > FILE_LIMIT:
            raise error(f"{path}: found {path.stat().st_size} bytes, expected a TOML file of at most {FILE_LIMIT}")
        return tomllib.loads(path.read_text("utf-8-sig"))
    except OSError as problem:
        raise error(f"{path}: cannot be read ({(problem.strerror or 'unknown reason').lower()})") from None
    except UnicodeDecodeError as problem:
        raise error(f"{path}: found bytes that are no text at position {problem.start}, expected a TOML file") from None
    except (ValueError, RecursionError) as problem:
        raise error(f"{path}: not valid TOML: {problem}") from None
