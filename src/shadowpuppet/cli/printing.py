"""Tables on standard output."""

from __future__ import annotations

import sys

from rich.console import Console, RenderableType


def show(*parts: RenderableType) -> None:
    """Print tables to standard output, with an empty line between them."""
    console = Console(file=sys.stdout, highlight=False)
    for n, part in enumerate(parts):
        with console.capture() as shown:
            console.print(part)
        lines = [line.rstrip() for line in shown.get().splitlines()]  # rich fills columns with blanks, which files need not keep
        print("\n" * bool(n) + "\n".join(lines))
