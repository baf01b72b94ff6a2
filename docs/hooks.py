"""Parts of the documentation that are generated from the code when it is built.

A line of one of these forms is replaced in a page:

    <!-- settings: TABLE -->   a table of `Options` ([tracker.torso]), one row per setting; without TABLE the settings outside tables
    <!-- spec: TABLE -->       the same for the spec of a synthetic recording
    <!-- help: COMMAND -->     the output of `shadowpuppet COMMAND --help`
    <!-- presets -->           the settings that each preset changes
    <!-- example: FILE -->     the code of examples/FILE
    <!-- gallery -->           every example: what it is, its picture, its code
"""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
import types
from collections.abc import Iterator
from dataclasses import MISSING, is_dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import tomli_w

from shadowpuppet.pipeline.options import Options
from shadowpuppet.settings import settings_of
from shadowpuppet.synthetic.spec import TABLES, Spec
from shadowpuppet.tracking.monocular.settings import INITIALIZATION_PRESETS, PRESETS
from shadowpuppet.tracking.multiview.settings import MULTIVIEW_PRESETS

MARKER = re.compile(r"^<!-- (settings|spec|help|presets|example|gallery)(?:: (.*?))? -->$", re.MULTILINE)
BUNDLE = '<script src="assets/javascripts/bundle'
FROM_DISK = "assets/search_from_disk.js"
QUOTES = '"""'
SIGNS = {"ge": "from", "gt": "over", "le": "to", "lt": "under"}
WORDS = {bool: "true, false", int: "whole number", float: "number", str: "text"}


def on_page_markdown(markdown: str, **_: Any) -> str:
    """The page with all markers replaced; called by MkDocs for every page."""
    return MARKER.sub(lambda found: MAKERS[found[1]](*(found[2] or "").split()), markdown)


def on_post_page(output: str, **_: Any) -> str:
    """The page with the script that lets search work from the disk, before Material's own; called by MkDocs for every page."""
    if BUNDLE not in output:
        raise RuntimeError("found no script of Material's in a page: search from the disk would not work")
    return output.replace(BUNDLE, f'<script src="{FROM_DISK}"></script>{BUNDLE}', 1)


def on_post_build(config: Any, **_: Any) -> None:
    """Keep the search index as a script too, which pages opened from the disk may load; called by MkDocs at the end."""
    index = Path(config["site_dir"]) / "search" / "search_index.json"
    index.with_suffix(".js").write_text(f"var __index = {index.read_text('utf-8')}", encoding="utf-8")


def settings_table(table: str = "") -> str:
    """Markdown table of the settings of a table of options, `tracker` or `tracker.torso`, with the default preset's values."""
    of = Options()
    for name in table.split(".") if table else ():
        of = getattr(of, name)
    rows = ["| setting | default | possible | what it does |", "|---|---|---|---|"]
    for name, kind, _, told in settings_of(type(of)):
        default = getattr(of, name)
        if is_dataclass(default):
            place = f"{table}.{name}".lstrip(".")
            rows.append(f"| [`[{place}]`](#{place.replace('.', '')}) | | | {told} |")
        else:
            cells = (f"`{name}`", "" if default is None else f"`{_plain(default)}`", _possible(kind), told)
            rows.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(rows)


def spec_table(table: str = "") -> str:
    """Markdown table of the settings of a spec, or of one of its tables."""
    rows = ["| setting | default | possible | what it is |", "|---|---|---|---|"]
    for name, kind, default, told in settings_of(TABLES[table] if table else Spec):
        if name in TABLES and name != table:
            rows.append(f"| [`{name}`](#{name}) | | | {told} |")
        else:
            shown = "" if default is None or default is MISSING else f"`{_plain(default)}`"
            rows.append("| " + " | ".join(cell.replace("|", "\\|") for cell in (f"`{name}`", shown, _possible(kind), told)) + " |")
    return "\n".join(rows)


def help_text(*command: str) -> str:
    """The help of a command in a terminal of 80 columns, as a code block."""
    environment = os.environ | {"COLUMNS": "80", "NO_COLOR": "1", "TERM": "dumb"}
    shown = subprocess.run([sys.executable, "-m", "shadowpuppet", *command, "--help"], capture_output=True, text=True, env=environment)
    if shown.returncode:
        raise RuntimeError(f"shadowpuppet {' '.join(command)} --help: {shown.stderr}")
    return "```text\n" + "\n".join(line.rstrip() for line in shown.stdout.strip("\n").splitlines()) + "\n```"


def presets() -> str:
    """The settings that each preset changes, as TOML."""
    tables = {"tracker": PRESETS, "multiview": MULTIVIEW_PRESETS, "initialization": INITIALIZATION_PRESETS}
    parts = ["**`default`**: the defaults above."]
    for name in dict.fromkeys(name for known in tables.values() for name in known):
        changed = {table: known[name] for table, known in tables.items() if known.get(name)}
        parts += [f"**`{name}`**", "```toml\n" + tomli_w.dumps(changed).strip() + "\n```"] if changed else []
    return "\n\n".join(parts)


def example(name: str) -> str:
    """The code of an example without its docstring."""
    code = (Path(__file__).parents[1] / "examples" / name).read_text("utf-8")
    return f"```python\n{code.split(QUOTES, 2)[2].strip()}\n```"


def gallery() -> str:
    """A section for every example: its docstring, its picture where it leaves one, and its code, folded."""
    parts = []
    for path in sorted((Path(__file__).parents[1] / "examples").glob("*.py")):
        title = path.stem[3:].replace("_", " ")
        told = (ast.get_docstring(ast.parse(path.read_text("utf-8"))) or "").split("\n\n")
        picture = f"assets/example_{path.name[:2]}.webp"
        shown = [f"![What {path.name} leaves]({picture})"] if (Path(__file__).parent / picture).exists() else []
        code = example(path.name).replace("\n", "\n    ")
        folded = f'??? note "examples/{path.name}"\n\n    {code}'
        parts += [f"## {int(path.name[:2])}. {title[0].upper()}{title[1:]}", *told, *shown, folded]
    return "\n\n".join(parts)


MAKERS = {"settings": settings_table, "spec": spec_table, "help": help_text, "presets": presets, "example": example, "gallery": gallery}


def _plain(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return "[" + ", ".join(_plain(item) for item in value) + "]"
    return f'"{value}"' if isinstance(value, str) else _number(value) if isinstance(value, float) else str(value)


def _number(value: float) -> str:
    return str(int(value)) if value == int(value) else f"{value:g}"


def _possible(kind: Any) -> str:
    """Description of the values that a type allows."""
    return ", ".join(dict.fromkeys(_words(kind)))


def _words(kind: Any) -> Iterator[str]:
    origin, arguments = get_origin(kind), get_args(kind)
    if origin is Annotated:
        bounds = [f"{SIGNS[sign]} {_number(value)}" for item in arguments[1:] for bound in getattr(item, "metadata", ())
                  for sign in SIGNS if (value := getattr(bound, sign, None)) is not None]
        yield " ".join(bounds) or _possible(arguments[0])
    elif origin is Literal:
        yield from (f"`{_plain(value)}`" for value in arguments)
    elif origin in (Union, types.UnionType):
        for argument in arguments:
            yield from () if argument is type(None) else _words(argument)
    elif origin is tuple:
        yield "list" if Ellipsis in arguments else f"{len(arguments)} numbers"
    else:
        yield WORDS.get(kind, "path" if getattr(kind, "__name__", "") == "Path" else str(getattr(kind, "__name__", kind)))
