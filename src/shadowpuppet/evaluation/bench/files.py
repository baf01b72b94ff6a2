"""Where figures go: what cannot be written is said before the minute's work."""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from shadowpuppet.errors import ShadowPuppetError, reason
from shadowpuppet.io.files.text import write_whole

PICTURES = (".pdf", ".png", ".svg")


def check_plans(figures: Path | None, picture: Path | None) -> None:
    """Raises `ShadowPuppetError` where a file cannot be written, or a picture not be drawn."""
    if picture is not None and picture.suffix not in PICTURES:
        raise ShadowPuppetError(f"{picture}: found the ending {picture.suffix!r}, a picture is written to {', '.join(PICTURES)}")
    if picture is not None and importlib.util.find_spec("matplotlib") is None:
        raise ShadowPuppetError(f"{picture}: a picture needs matplotlib: pip install 'shadowpuppet[report]'")
    for path in (figures, picture):
        if path is None:
            continue
        there = path.exists()
        try:
            with path.open("ab"):
                pass
            if not there:
                path.unlink()
        except OSError as error:
            raise ShadowPuppetError(f"{path}: cannot be written ({reason(error)})") from None


def write_figures(path: Path, found: Mapping[str, Any]) -> None:
    """All figures as JSON, null for what is not known. Raises `ShadowPuppetError` where it cannot be written."""
    write_whole(path, json.dumps(found, indent=1, allow_nan=False) + "\n")
