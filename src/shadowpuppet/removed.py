"""Commands, settings and files of earlier versions, each with its replacement: one sentence in place of "unknown".

A removal adds one line here. The command line and `make_options` look it up.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from shadowpuppet.errors import SettingsError, ShadowPuppetError

COMMANDS = {
    "bench": "bench has moved: python -m benchmarks.bench in the source repository",
}
"""By the command's name."""
SETTINGS: dict[str, str] = {}
"""By the setting's name with dots, or by name and value: `silhouette.method = knn`."""
IDLE: dict[str, object] = {}
"""By the name of a removed setting: the value that changed nothing. Files of earlier versions hold it, and it is left out."""


def refuse_tokens(tokens: Sequence[str]) -> None:
    """Raise `ShadowPuppetError` for a command line with a removed command, flag, or value of a flag."""
    if tokens and tokens[0] in COMMANDS:
        raise ShadowPuppetError(COMMANDS[tokens[0]])
    for token, following in zip(tokens, [*tokens[1:], ""]):
        if token.startswith("--"):
            name, _, value = token[2:].partition("=")
            refuse_setting(name.replace("-", "_"), value or following, token.partition("=")[0])


def without_removed(values: Mapping[str, Any], source: str) -> dict[str, Any]:
    """Settings of a file, tables in tables, without removed ones that changed nothing. Raises `SettingsError` for others."""
    return dict(_kept(values, "", source))


def _kept(values: Mapping[str, Any], table: str, source: str) -> Iterator[tuple[str, Any]]:
    for key, value in values.items():
        name = f"{table}{key}"
        if name in IDLE and value == IDLE[name]:
            continue
        refuse_setting(name, value, f"{source}: {name}")
        yield key, dict(_kept(value, f"{name}.", source)) if isinstance(value, Mapping) else value


def refuse_setting(name: str, value: object, place: str) -> None:
    """Raise `SettingsError` for a removed setting or value; `place` is where it stands."""
    if (replacement := SETTINGS.get(f"{name} = {value}", SETTINGS.get(name))) is not None:
        raise SettingsError(f"{place}: {replacement}")
