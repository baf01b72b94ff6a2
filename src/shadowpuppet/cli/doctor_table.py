"""What `doctor` found, as a table."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from shadowpuppet.cli.doctor import Finding, works

MARKS = {"works": ("yes", "green"), "missing": ("no", "yellow"), "broken": ("broken", "red")}


def doctor_table(found: Sequence[Finding]) -> list[RenderableType]:
    """A row each, with what would mend it below, and the outcome in a sentence."""
    table = Table.grid(padding=(0, 2))
    table.add_column(no_wrap=True, style="bold")
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    for finding in found:
        mark, colour = MARKS[finding.state]
        told = Text(finding.told)
        if finding.remedy:
            told.append(f"\n→ {finding.remedy}", "dim")
        table.add_row(Text(finding.name), Text(mark, colour), told)
    broken = [finding.name for finding in found if finding.needed and finding.state != "works"]
    said = f"tracking does not work here: {', '.join(broken)}" if broken else "tracking works here"
    assert works(list(found)) == (not broken)
    return [table, Text(said, "bold red" if broken else "bold green")]
