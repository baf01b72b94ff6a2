"""Checked settings: frozen dataclasses. Each field is a flag of the command line and a line of TOML; the docstring below it is its help."""

from __future__ import annotations

import ast
import inspect
import re
import textwrap
from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass
from functools import cache, wraps
from typing import Annotated, Any, NamedTuple, TypeVar, dataclass_transform, get_type_hints

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass

from shadowpuppet.errors import SettingsError, choices, did_you_mean, shown

Settings = TypeVar("Settings")
STRICT = ConfigDict(extra="forbid", allow_inf_nan=False)
Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]
Share = Annotated[float, Field(ge=0, le=1)]


@dataclass_transform(kw_only_default=True, frozen_default=True)
def checked(kind: type[Settings]) -> type[Settings]:
    """Class decorator: a frozen dataclass that checks its values.

    `Kind(name=value)` raises `SettingsError` for an unknown name or an impossible value, as `validate` does.
    """
    made: Any = dataclass(frozen=True, kw_only=True, config=STRICT)(kind)
    check = made.__init__

    @wraps(check)
    def __init__(self: Any, *args: Any, **values: Any) -> None:
        try:
            check(self, *args, **values)
        except ValidationError as error:
            raise _settings_error(error, made, made.__name__) from None

    made.__init__ = __init__
    return made


def validate(kind: type[Settings], values: Mapping[str, Any], source: str = "settings") -> Settings:
    """Settings of a class from plain values. Raises `SettingsError` with the first bad value and what is possible."""
    try:
        return TypeAdapter(kind).validate_python(dict(values))
    except ValidationError as error:
        raise _settings_error(error, kind, source) from None


def from_preset(kind: type[Settings], presets: Mapping[str, Mapping[str, Any]], preset: str, overrides: Mapping[str, Any] | None,
                source: str) -> Settings:
    """Settings of a `kind` by a named preset, with some values replaced; inner tables may be given in part.

    Raises `SettingsError` for an unknown preset, an unknown name or an impossible value, with what is possible.
    """
    if preset not in presets:
        raise SettingsError(f"{source}: unknown preset {preset!r}; there are: {choices(presets)}")
    return validate(kind, merged(plain_values(kind()), presets[preset], overrides or {}), source)


def _settings_error(error: ValidationError, kind: Any, source: str) -> SettingsError:
    """A `SettingsError` that states the first mistake in one sentence."""
    first = error.errors()[0]
    place = ".".join(str(key) for key in first["loc"])
    if first["type"] in ("unexpected_keyword_argument", "extra_forbidden"):
        for key in first["loc"][:-1]:
            kind = type(getattr(kind(), str(key)))
        return SettingsError(f"{source}: unknown setting {place!r}; there are: {choices(f.name for f in fields(kind))}")
    message = first["msg"].removeprefix("Value error, ")
    return SettingsError(f"{source}: {place}: found {shown(first['input'])}; {message[:1].lower()}{message[1:]}{nearly(first)}")


def nearly(problem: Mapping[str, Any]) -> str:
    """The possible word that is nearly the one found, as the end of the message about a problem of pydantic's; empty if there is none."""
    return did_you_mean(problem["input"], re.findall(r"'([^']+)'", str(problem.get("ctx", {}).get("expected", ""))))


class Setting(NamedTuple):
    """One field of a settings class."""

    name: str
    kind: Any
    """Its type, with limits."""
    default: Any
    """`dataclasses.MISSING` if it must be given."""
    help: str
    """Its docstring on one line."""


@cache
def settings_of(kind: type) -> tuple[Setting, ...]:
    """The settings of a class, in order."""
    hints, docs = get_type_hints(kind, include_extras=True), _field_docstrings(kind)
    return tuple(Setting(field.name, hints[field.name], _default(field), docs.get(field.name, "")) for field in fields(kind))


def plain_values(settings: Any) -> dict[str, Any]:
    """Settings as plain values; tables of settings become dictionaries."""
    return {f.name: plain_values(value) if is_dataclass(value := getattr(settings, f.name)) else value for f in fields(settings)}


def merged(*tables: Mapping[str, Any]) -> dict[str, Any]:
    """One dictionary of several tables, in which later values replace earlier ones; inner tables are merged too."""
    out: dict[str, Any] = {}
    for table in tables:
        for key, value in table.items():
            out[key] = merged(out[key], value) if isinstance(value, Mapping) and isinstance(out.get(key), Mapping) else value
    return out


def _default(field: Any) -> Any:
    default = getattr(field.default, "default", field.default)  # pydantic wraps some defaults
    return field.default_factory() if default is MISSING and field.default_factory is not MISSING else default


def _field_docstrings(kind: type) -> dict[str, str]:
    """The string below each field of a class, by the field's name."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(kind))).body[0]
    assert isinstance(tree, ast.ClassDef)
    return {field.target.id: " ".join(str(ast.literal_eval(below.value)).split()) for field, below in zip(tree.body, tree.body[1:])
            if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name) and isinstance(below, ast.Expr)}
