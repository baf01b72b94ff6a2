"""Settings of the trackers, each documented here and nowhere else; the presets are data.

Every field is a flag of the command line and a line of TOML; unknown names are errors.
"""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, fields, is_dataclass
from dataclasses import Field as DataclassField
from functools import wraps
from typing import Annotated, Any, TypeVar, dataclass_transform, get_type_hints

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass

from shadowpuppet.errors import SettingsError, choices, shown

Settings = TypeVar("Settings")
STRICT = ConfigDict(extra="forbid", allow_inf_nan=False)


@dataclass_transform(kw_only_default=True, frozen_default=True)
def checked(kind: type[Settings]) -> type[Settings]:
    """Make a frozen dataclass of a class of settings: every value is checked whichever way it comes.

    `Kind(name=value)` raises `SettingsError` for an unknown name or an impossible value, as `validate` does.
    """
    made: Any = dataclass(frozen=True, kw_only=True, config=STRICT)(kind)
    check = made.__init__

    @wraps(check)
    def __init__(self: Any, *args: Any, **values: Any) -> None:
        try:
            check(self, *args, **values)
        except ValidationError as error:
            raise _told(error, made, made.__name__) from None

    made.__init__ = __init__
    return made


Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]
Share = Annotated[float, Field(ge=0, le=1)]


def validate(kind: type[Settings], values: Mapping[str, Any], source: str = "settings") -> Settings:
    """Settings of a kind from plain values; a `SettingsError` names the first bad one, what was found and what is possible."""
    try:
        return TypeAdapter(kind).validate_python(dict(values))
    except ValidationError as error:
        raise _told(error, kind, source) from None


def _told(error: ValidationError, kind: Any, source: str) -> SettingsError:
    """The first of the mistakes in settings of a kind, in a sentence."""
    first = error.errors()[0]
    place = ".".join(str(key) for key in first["loc"])
    if first["type"] in ("unexpected_keyword_argument", "extra_forbidden"):
        for key in first["loc"][:-1]:
            kind = type(getattr(kind(), str(key)))
        return SettingsError(f"{source}: unknown setting {place!r}; there are: {choices(f.name for f in fields(kind))}")
    said = first["msg"].removeprefix("Value error, ")
    return SettingsError(f"{source}: {place}: found {shown(first['input'])}; {said[:1].lower()}{said[1:]}")


def _plain(settings: Any) -> dict[str, Any]:
    return {f.name: _plain(value) if is_dataclass(value := getattr(settings, f.name)) else value for f in fields(settings)}


def _merge(*tables: Mapping[str, Any]) -> dict[str, Any]:
    """Tables laid over one another, the last on top, inner tables too."""
    out: dict[str, Any] = {}
    for table in tables:
        for key, value in table.items():
            out[key] = _merge(out[key], value) if isinstance(value, Mapping) and isinstance(out.get(key), Mapping) else value
    return out


def from_preset(kind: type[Settings], presets: Mapping[str, Mapping[str, Any]], preset: str, overrides: Mapping[str, Any] | None,
                source: str) -> Settings:
    """Settings of a `kind` by a named preset, with some values replaced; inner tables may be given in part.

    Raises `SettingsError` for an unknown preset, an unknown name or an impossible value, with what is possible.
    """
    if preset not in presets:
        raise SettingsError(f"{source}: unknown preset {preset!r}; there are: {choices(presets)}")
    return validate(kind, _merge(_plain(kind()), presets[preset], overrides or {}), source)


def settings_of(kind: type) -> Iterator[tuple[DataclassField, Any, str]]:
    """Every setting of a settings class: its field, its type, and what its docstring says."""
    hints, told = get_type_hints(kind, include_extras=True), _docstrings(kind)
    for field in fields(kind):
        yield field, hints[field.name], told.get(field.name, "")


def default_of(field: DataclassField) -> Any:
    """What a setting is when it is left out; pydantic wraps some defaults."""
    default = getattr(field.default, "default", field.default)
    return field.default_factory() if default is MISSING and field.default_factory is not MISSING else default


def _docstrings(kind: type) -> dict[str, str]:
    """What is written under each field of a class."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(kind))).body[0]
    assert isinstance(tree, ast.ClassDef)
    told = {}
    for field, below in zip(tree.body, tree.body[1:]):
        if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name) and isinstance(below, ast.Expr):
            told[field.target.id] = " ".join(str(ast.literal_eval(below.value)).split())
    return told
