"""Whether an earlier run in a folder is the one that wants to go on: the same inputs, settings and versions."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from shadowpuppet.errors import FormatError, ShadowPuppetError, shown
from shadowpuppet.io.files.text import JSON_LIMIT, read_limited, write_whole
from shadowpuppet.io.inputs.inputs import MOST_NAMED, Inputs

INPUTS = "checkpoint.json"
"""File beside a checkpoint with the content of each of the run's inputs (`Inputs.contents`)."""
NOT_COMPARED = {"complete", "frames", "smoothing", "floor", "people"}
"""Entries of run.toml that a run gets at its end."""
PLACES = {"recording", "truth"}
"""Entries that name places: where contents are compared, a recording may have been moved."""


def write_inputs(folder: Path, inputs: Inputs) -> None:
    """Keep what a run's inputs hold, for `check_same`. Raises `ShadowPuppetError` if that cannot be written."""
    write_whole(folder / INPUTS, json.dumps({"inputs": inputs.contents}, indent=1) + "\n")


def read_inputs(folder: Path) -> dict[str, str]:
    """What a run's inputs held when it began, by name. Raises `FormatError` if that is not there, or damaged."""
    path = folder / INPUTS
    if not path.exists():
        raise FormatError(f"{folder}: found a checkpoint without {INPUTS}, as earlier versions wrote it: it does not say with which "
                          "films and calibration the run began; expected --force, which starts over")
    try:
        found = json.loads(read_limited(path, JSON_LIMIT, FormatError, "a JSON file"))["inputs"]
        if not all(isinstance(text, str) for text in found.values()):
            raise TypeError("found a value that is no text")
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise FormatError(f"{path}: not what a run's inputs held ({error})") from None
    return found


def check_same(folder: Path, earlier: Mapping[str, Any], ours: Mapping[str, Any], inputs: Inputs, has_state: bool) -> None:
    """Raise `ShadowPuppetError`, which names what differs, if the run of run.toml `earlier` is another one than that of `ours`.

    `has_state`: whether it has a checkpoint; then inputs are compared by content, and may lie in another place."""
    kept = read_inputs(folder) if has_state else None
    if kept is not None:
        files = {name.removeprefix("--") for name in (*kept, *inputs.parts) if name.startswith("--")}
        earlier, ours = _without_places(earlier, files), _without_places(ours, files)
    for key in sorted((earlier.keys() | ours.keys()) - NOT_COMPARED):
        if difference := _difference(key, earlier.get(key), ours.get(key)):
            raise ShadowPuppetError(f"{folder}: the run there cannot go on as another one: {difference}")
    if found := [] if kept is None else list(_other_contents(kept, inputs)):
        more = f"; and {len(found) - MOST_NAMED} more" if len(found) > MOST_NAMED else ""
        raise ShadowPuppetError(f"{folder}: the run there cannot go on: {'; '.join(found[:MOST_NAMED])}{more}; expected the files with "
                                "which it began, or --force, which starts over")


def _without_places(info: Mapping[str, Any], files: set[str]) -> dict[str, Any]:
    """Entries of run.toml without those that name places; `files`: settings that name files."""
    settings = {key: value for key, value in info.get("settings", {}).items() if key not in files}
    return {key: value for key, value in info.items() if key not in PLACES} | ({"settings": settings} if "settings" in info else {})


def _other_contents(kept: Mapping[str, str], inputs: Inputs) -> Iterator[str]:
    """Each input that differs, in words."""
    now = inputs.contents
    for name in sorted(kept.keys() | now.keys()):
        if name not in now:
            yield f"{inputs.named(name)} was there, and is missing now"
        elif name not in kept:
            yield f"{inputs.named(name)} was not there when it began"
        elif kept[name] != now[name]:
            yield f"{inputs.named(name)} has changed since"


def _difference(where: str, before: Any, now: Any) -> str:
    """The first difference of two plain values in words; empty if they are equal."""
    if isinstance(before, dict) and isinstance(now, dict):
        return next(filter(None, (_difference(f"{where}.{key}", before.get(key), now.get(key)) for key in sorted(before | now))), "")
    was, found = ("not given" if value is None else shown(value) for value in (before, now))
    return "" if before == now else f"{where} was {was}, and is {found}"
