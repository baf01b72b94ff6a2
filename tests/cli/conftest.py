"""Fixtures of the command line's tests."""

from __future__ import annotations

import pytest

from shadowpuppet.cli.tables import show


@pytest.fixture
def printed(capsys, monkeypatch):
    """The lines that a table is printed as, with single blanks."""
    monkeypatch.setenv("COLUMNS", "300")

    def lines(*parts) -> list[str]:
        show(*parts)
        return [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]

    return lines
