"""The run that a folder already holds."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from shadowpuppet.errors import FormatError, ShadowPuppetError
from shadowpuppet.io.files.lock import LOCK
from shadowpuppet.io.files.table import shorten
from shadowpuppet.io.files.text import read_toml, write_whole
from shadowpuppet.io.people import PEOPLE
from shadowpuppet.io.run import TABLES


def check_folder(folder: Path) -> bool:
    """Whether a folder holds an earlier run. Raises `ShadowPuppetError` if it holds other files."""
    names = sorted(path.name for path in folder.iterdir() if path.name != LOCK)
    if not names:
        return False
    info = folder / "run.toml"
    if not info.exists() or not {"complete", "versions"} <= set(read_toml(info, FormatError)):
        raise ShadowPuppetError(f"{folder}: found {shorten(names, 60)} in it but no run.toml of a run, expected a new or empty "
                                "folder, or that of an earlier run")
    return True


def earlier_run(folder: str | Path) -> dict[str, Any] | None:
    """The contents of run.toml of the run in a folder, None if there is no run with frames. Raises `FormatError` if it is malformed."""
    folder = Path(folder)
    if not (folder / "run.toml").exists() or not any((folder / name).exists() for name in (TABLES[0], PEOPLE)):
        return None
    info = read_toml(folder / "run.toml", FormatError)
    return info if {"complete", "versions"} <= set(info) else None


def unmark(folder: Path) -> None:
    """Note in a run's run.toml that it is not complete."""
    import tomli_w

    info = read_toml(folder / "run.toml", FormatError)
    if info["complete"]:
        write_whole(folder / "run.toml", tomli_w.dumps(info | {"complete": False}))
