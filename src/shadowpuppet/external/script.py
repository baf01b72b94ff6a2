"""Scripts that make masks or keypoints: the shipped ones by name, a user's by path, and what their inline metadata (PEP 723) ask for."""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from shadowpuppet.errors import FILE_MEMORY, SilhouetteError, check_regular, choices, reason

SHIPPED = Path(__file__).parent / "scripts"
"""Folder of the scripts that come with the package, in a folder for each kind: masks, keypoints."""
BLOCK = re.compile(r"(?m)^# /// (?P<type>[a-zA-Z0-9-]+)$\s(?P<content>(^#(| .*)$\s)+)^# ///$")
"""A block of inline metadata, as PEP 723 defines it."""
CLAUSE = re.compile(r"\s*(?P<relation>~=|==|!=|<=|>=|<|>)\s*(?P<numbers>\d+(\.\d+)*)(?P<any>\.\*)?\s*")
"""A clause of a version specifier, such as `>=3.11`."""


@dataclass(frozen=True)
class Script:
    """A script that makes masks or keypoints."""

    name: str
    """Name of a shipped script, or the file's name."""
    path: Path
    requirements: tuple[str, ...] = ()
    """Packages that it needs, as pip takes them."""
    pythons: str = ""
    """Versions of Python that it runs on, such as `>=3.11,<3.13`; empty for all."""


def template(kind: str) -> Path:
    """A script of a kind to start from."""
    return SHIPPED / kind / "template.py"


def shipped_scripts(kind: str) -> dict[str, str]:
    """What each shipped script of a kind is, its docstring's first line, by name."""
    paths = sorted(path for path in (SHIPPED / kind).glob("*.py") if path != template(kind))
    documented = {path.stem: ast.get_docstring(ast.parse(path.read_text("utf-8"))) or "" for path in paths}
    return {name: text.split("\n")[0] for name, text in documented.items()}


def find_script(name: str, kind: str) -> Script:
    """The shipped script `name` of a kind, or the one in the file `name`. Raises `SilhouetteError` if there is none or its metadata are
    wrong."""
    known = shipped_scripts(kind)
    path = SHIPPED / kind / f"{name}.py" if name in known else Path(name)
    if not path.is_file():
        raise SilhouetteError(f"--with: found {name!r}, which is no file and no shipped script; expected a script's path, or one of "
                              f"{choices(known)}")
    return read_script(path, name if name in known else path.name)


def read_script(path: Path, name: str) -> Script:
    """The script in a file. Raises `SilhouetteError` if it cannot be read or its inline metadata are wrong."""
    try:
        check_regular(path)
        if path.stat().st_size > FILE_MEMORY:
            raise SilhouetteError(f"{path}: found {path.stat().st_size} bytes, expected a Python script of at most {FILE_MEMORY}")
        text = path.read_bytes().decode("utf-8-sig").replace("\r\n", "\n")
    except OSError as error:
        raise SilhouetteError(f"{path}: the script cannot be read ({reason(error)})") from None
    except UnicodeDecodeError as error:
        raise SilhouetteError(f"{path}: found bytes that are no text at position {error.start}, expected a Python script") from None
    values = _metadata(path, text)
    requirements, pythons = values.get("dependencies", []), values.get("requires-python", "")
    if not isinstance(requirements, list) or not all(isinstance(one, str) and not one.startswith("-") for one in requirements):
        raise SilhouetteError(f"{path}: dependencies: found {requirements!r}, expected a list of packages such as [\"numpy>=2\"]")
    if not isinstance(pythons, str) or not _is_specifier(pythons):
        raise SilhouetteError(f"{path}: requires-python: found {pythons!r}, expected versions such as \">=3.11,<3.13\"")
    return Script(name, path.resolve(), tuple(requirements), pythons)


def _metadata(path: Path, text: str) -> Mapping[str, Any]:
    """The tables of the script's metadata; empty without any."""
    blocks = [match for match in BLOCK.finditer(f"{text}\n") if match["type"] == "script"]
    if len(blocks) > 1:
        raise SilhouetteError(f"{path}: found {len(blocks)} blocks of inline metadata (# /// script), expected one")
    if not blocks:
        return {}
    lines = blocks[0]["content"].splitlines()
    try:
        return tomllib.loads("\n".join(line.removeprefix("#").removeprefix(" ") for line in lines))
    except (ValueError, RecursionError) as error:
        raise SilhouetteError(f"{path}: its inline metadata are not valid TOML: {error}") from None


# Versions of Python


def _is_specifier(text: str) -> bool:
    return all(CLAUSE.fullmatch(clause) for clause in text.split(",") if clause.strip())


def accepts(pythons: str, version: tuple[int, ...]) -> bool:
    """Whether a version of Python, such as (3, 12, 1), meets a specifier such as `>=3.11,<3.13`."""
    return all(_meets(clause, version) for clause in pythons.split(",") if clause.strip())


def _meets(clause: str, version: tuple[int, ...]) -> bool:
    match = CLAUSE.fullmatch(clause)
    assert match is not None, "was checked when the script was read"
    numbers = tuple(map(int, match["numbers"].split(".")))
    length = max(len(numbers), len(version))
    wanted, found = (one + (0,) * (length - len(one)) for one in (numbers, version))
    same = version[: len(numbers)] == numbers if match["any"] else found == wanted
    return {"==": same, "!=": not same, ">=": found >= wanted, "<=": found <= wanted, ">": found > wanted, "<": found < wanted,
            "~=": found >= wanted and version[: len(numbers) - 1] == numbers[:-1]}[match["relation"]]  # fmt: skip
