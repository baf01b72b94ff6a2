"""Grids of settings: a file of settings with lists of values, and named cases.

    seeds = "0:10"                                           # or a list of numbers
    preset = "liu2011"                                       # settings of all runs, as in any file of settings

    [grid]                                                   # every combination of these values
    "tracker.arm.particles" = [100, 200, 400]

    [case.drs]                                               # and each of these cases
    tracker.resampling = "deterministic"
    [case.srs]
    tracker.resampling = "stratified"
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

from shadowpuppet.errors import SettingsError, shown
from shadowpuppet.io.files.text import read_toml
from shadowpuppet.pipeline.options import PATHS, make_options, settings_in
from shadowpuppet.settings import merged

MAX_CASES, MAX_RUNS = 10_000, 100_000
"""Greatest number of combinations, and of seeds; more are taken for a mistake."""
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.+-]{0,59}")
"""Name of a case; it becomes part of a folder's name."""
DEFAULT_CASE = "default"
"""Name of the only case of a grid without cases."""


class Case(NamedTuple):
    """One combination of settings."""

    name: str
    values: dict[str, Any]
    """Plain values for `make_options`."""
    varied: dict[str, Any]
    """Settings of the case or the grid, by dotted name."""
    tried: tuple[str, ...] = ()
    """Names of the grid's settings."""

    @property
    def label(self) -> str:
        """The case's name, if it has one, and the grid's values."""
        values = (f"{name.rpartition('.')[2]} {short(self.varied[name])}" for name in self.tried)
        return ", ".join([*([self.name] if self.name != DEFAULT_CASE else []), *values])


class Grid(NamedTuple):
    """All combinations of settings, and the file's seeds; None if it has none."""

    cases: tuple[Case, ...]
    seeds: tuple[int, ...] | None = None


def read_grid(path: str | Path, flags: Mapping[str, Any] | None = None) -> Grid:
    """A grid from a TOML file; `flags`: settings in place of the file's. Raises `SettingsError`, naming file and field."""
    path = Path(path)
    values = read_toml(path, SettingsError)
    plus = {key: values.pop(key) for key in ("seeds", "grid", "case") if key in values}
    cases = {name: settings_in(table, path, f"{path}: case.{name}") if isinstance(table, Mapping) else table
             for name, table in _table(plus.get("case", {}), f"{path}: case").items()}
    lists = {name: [_beside(path, name, value) for value in listed] if isinstance(listed, list) else listed
             for name, listed in _table(plus.get("grid", {}), f"{path}: grid").items()}
    return make_grid(settings_in(values, path), cases=cases, grid=lists, seeds=plus.get("seeds"), flags=flags, source=str(path))


def make_grid(settings: Mapping[str, Any] | None = None, *, cases: Mapping[str, Any] | None = None, grid: Mapping[str, Any] | None = None,
              seeds: object = None, flags: Mapping[str, Any] | None = None, source: str = "grid") -> Grid:
    """A grid from plain values: settings of all runs, named `cases` of settings, and `grid`, lists of values by dotted name.

    Values of the grid override those of a case, which override the settings. `flags` override the settings and may not be varied.
    Raises `SettingsError`.
    """
    make_options(dict(settings or {}), source)
    common = merged(settings or {}, flags or {})
    seed = common.pop("seed", None)
    make_options(common, "flags")
    chosen_seeds = seeds if seeds is not None else seed
    named = _table(cases or {}, f"{source}: case") or {DEFAULT_CASE: {}}
    lists = [list(_choices(f"{source}: grid.{name}", name, listed)) for name, listed in _flat(_table(grid or {}, f"{source}: grid"))]
    if (count := math.prod(map(len, lists)) * len(named)) > MAX_CASES:
        raise SettingsError(f"{source}: grid: found {count} combinations, expected at most {MAX_CASES}")
    made = [_case(source, name, table, common, chosen) for name, table in named.items() for chosen in product(*lists)]
    _check_flags(dict(_flat(flags or {})), made)
    return Grid(tuple(made), None if chosen_seeds is None else seeds_of(chosen_seeds, f"{source}: seeds"))


def seeds_of(said: object, source: str = "seeds") -> tuple[int, ...]:
    """Seeds from `0:10` (0 to 9), `0:10:2`, `1,5,9`, a number, or a list of numbers. Raises `SettingsError`."""
    expected = "expected numbers from 0 on: 0:10 (which is 0 to 9), 1,5,9, or a list, each once"
    if isinstance(said, str):
        parts = [_numbers(part) for part in said.split(",")]
        found = [number for part in parts if part is not None for number in part] if None not in parts else []
    elif isinstance(said, (list, tuple, range)):
        found = list(said)
    else:
        found = [said]
    if not found or len(found) > MAX_RUNS or not all(type(n) is int and n >= 0 for n in found) or len(set(found)) < len(found):
        raise SettingsError(f"{source}: found {shown(said)[:80]}, {expected}")
    return tuple(found)  # pyright: ignore[reportReturnType]


def _numbers(part: str) -> range | None:
    """The numbers of `4`, `0:10` or `0:10:2`; None for any other text."""
    match = re.fullmatch(r"\s*(\d{1,18})(?::(\d{1,18})(?::(\d{1,9}))?)?\s*", part)
    if match is None or match[3] == "0" or (match[3] and not int(match[3])):
        return None
    first = int(match[1])
    found = range(first, int(match[2]) if match[2] else first + 1, int(match[3] or 1))
    return found if len(found) <= MAX_RUNS else None


def _table(found: object, place: str) -> dict[str, Any]:
    if not isinstance(found, Mapping):
        raise SettingsError(f"{place}: found {shown(found)[:80]}, expected a table [{place.rpartition(' ')[2]}]")
    return dict(found)


def _beside(path: Path, name: str, value: object) -> object:
    """A value of the grid; paths are relative to the grid's folder, as elsewhere."""
    return str(path.parent / value) if name in PATHS and isinstance(value, str) else value


def _choices(place: str, name: str, listed: object) -> Iterator[tuple[str, Any]]:
    """Pairs of a setting's name and each of its values in the grid."""
    if not isinstance(listed, list) or not 0 < len(listed) <= MAX_CASES:
        raise SettingsError(f"{place}: found {shown(listed)[:80]}, expected a list of values to be tried")
    if name == "seed":
        raise SettingsError(f"{place}: found {shown(listed)[:80]}, expected seeds = ... at the top of the file")
    for n, value in enumerate(listed):
        if value in listed[:n]:
            raise SettingsError(f"{place}: found {shown(value)} twice, expected every value once")
        make_options(_nested({name: value}), place)
        yield name, value


def _case(source: str, name: str, table: object, common: Mapping[str, Any], chosen: Sequence[tuple[str, Any]]) -> Case:
    place = f"{source}: case.{name}"
    if not NAME.fullmatch(name):
        raise SettingsError(f"{source}: case: found the name {name!r}, expected letters, digits, - _ . +, at most 60")
    if not isinstance(table, Mapping) or "seed" in table:
        found = "a seed in it" if isinstance(table, Mapping) else shown(table)[:80]
        raise SettingsError(f"{place}: found {found}, expected a table of settings; seeds = ... belongs at the top of the file")
    make_options(merged(common, table), place)
    values = merged(merged(common, table), _nested(dict(chosen)))
    make_options(values, f"{source}: grid" if chosen else place)
    return Case(name, values, dict(_flat(table)) | dict(chosen), tuple(name for name, _ in chosen))


def short(value: Any) -> str:
    """A value as text for a label; only the file name of a path."""
    return Path(value).name if isinstance(value, str) else "-".join(map(str, value)) if isinstance(value, list) else str(value)


def _check_flags(flags: Mapping[str, Any], cases: Sequence[Case]) -> None:
    """Raises `SettingsError` if a flag sets what the grid varies."""
    for case in cases:
        for name in set(flags) & set(case.varied):
            raise SettingsError(f"flags: {name}: found {shown(flags[name])}, but the grid varies it; expected one of them")


def _nested(flat: Mapping[str, Any]) -> dict[str, Any]:
    """Convert dotted names to nested tables."""
    made: dict[str, Any] = {}
    for name, value in flat.items():
        *outer, last = name.split(".")
        inner = value if not outer else _nested({".".join([*outer[1:], last]): value})
        made = merged(made, {(outer or [last])[0]: inner})
    return made


def _flat(values: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Convert nested tables to pairs of dotted names and values."""
    for name, value in values.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{before}{name}.")
        else:
            yield before + name, value
