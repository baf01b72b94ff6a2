"""Converts values to the types of TOML and JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from shadowpuppet.errors import ShadowPuppetError


def plain(value: Any, where: str) -> Any:
    """Dataclasses and mappings as dictionaries, arrays and tuples as lists, paths as text. Raises `ShadowPuppetError` for other types."""
    if is_dataclass(value) and not isinstance(value, type):
        value = asdict(value)
    if isinstance(value, (np.ndarray, np.generic)):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(key): plain(item, f"{where}.{key}") for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item, f"{where}[{i}]") for i, item in enumerate(value)]
    if isinstance(value, Path):
        return str(value)
    if value is not None and not isinstance(value, (str, bool, int, float)):
        raise ShadowPuppetError(f"{where}: found {value!r}, expected text, numbers, lists or tables")
    return value


def for_toml(value: Any) -> Any:
    """Plain values without None, which TOML does not have."""
    if isinstance(value, dict):
        return {key: for_toml(item) for key, item in value.items() if item is not None}
    return [for_toml(item) for item in value if item is not None] if isinstance(value, list) else value


def for_json(value: Any) -> Any:
    """Plain values with None for numbers that are not finite, which JSON does not have."""
    if isinstance(value, dict):
        return {key: for_json(item) for key, item in value.items()}
    if isinstance(value, list):
        return [for_json(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def json_text(value: Any, where: str = "value") -> str:
    """Plain values, arrays and dataclasses as JSON; null for numbers that are not finite. Raises `ShadowPuppetError` as `plain` does."""
    return json.dumps(for_json(plain(value, where)), indent=1, ensure_ascii=False, allow_nan=False)
