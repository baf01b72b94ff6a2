"""Pages and pieces of HTML; text from files and names is escaped."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from html import escape
from importlib.resources import files

POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'"
"""Content security policy: the browser fetches nothing."""


def document(title: str, parts: Iterable[str]) -> str:
    """A page that is complete in itself and makes no requests."""
    css = files("shadowpuppet.evaluation.report").joinpath("page.css").read_text("utf-8")
    return (f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><meta http-equiv="Content-Security-Policy" content="{POLICY}">\n'
            f'<meta name="viewport" content="width=device-width, initial-scale=1"><title>{plain(title)}</title>\n'
            f"<style>\n{css}</style></head>\n<body><main>\n" + "\n".join(parts) + "\n</main></body></html>\n")


def plain(text: object) -> str:
    """Escaped text."""
    return escape(str(text))


def figure(svg: str, caption: str) -> str:
    """A plot with a caption, which is also its description for screen readers."""
    said = plain(re.sub(r"<[^>]*>", "", caption).partition(". ")[0])
    named = svg if "aria-label" in svg else svg.replace('role="img"', f'role="img" aria-label="{said}"', 1)
    return f"<figure>{scrolled(named, said)}<figcaption>{caption}</figcaption></figure>"


def scrolled(content: str, name: str) -> str:
    """Content that scrolls sideways on narrow screens, also by keys. `name`: escaped."""
    return f'<div class="scroll" role="region" aria-label="{name}" tabindex="0">{content}</div>'


def rows(cells: Iterable[Sequence[str]], sums: int = 0) -> str:
    """Rows of a table, the last `sums` set off."""
    made = ["<td>" + "</td><td>".join(map(plain, row)) + "</td>" for row in cells]
    first = len(made) - sums
    return "".join(f"<tr{' class=sum' if n >= first else ''}>{row}</tr>" for n, row in enumerate(made))


def table(head: Sequence[str], body: str) -> str:
    """A table with a head."""
    cells = "".join(f"<th>{plain(name)}</th>" if name else "<td></td>" for name in head)
    name = plain(", ".join(filter(None, head)))
    return scrolled(f"<table><thead><tr>{cells}</tr></thead><tbody>{body}</tbody></table>", f"Table: {name}")


def definitions(pairs: Iterable[tuple[str, str]]) -> str:
    """A list of names and values; values may be markup."""
    return "<dl>" + "".join(f"<dt>{plain(name)}</dt><dd>{text}</dd>" for name, text in pairs) + "</dl>"
