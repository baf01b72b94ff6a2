"""Fixtures shared by all tests."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from shadowpuppet.cli import app as cli


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20110914)


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of shared recordings beside the checkout (or SHADOWPUPPET_SHARED); its tests are skipped where it is missing."""
    path = Path(os.environ.get("SHADOWPUPPET_SHARED", Path(__file__).resolve().parents[2] / "shared"))
    if not (path / "recordings").is_dir():
        pytest.skip("the shared recordings are not here")
    return path


class Said(NamedTuple):
    """What a command said."""

    code: int
    out: str
    err: str


@pytest.fixture
def columns() -> int:
    """How wide the terminal of `shell` is."""
    return 80


@pytest.fixture
def home(tmp_path) -> Path:
    """The folder that `shell` is in."""
    return tmp_path


@pytest.fixture
def shell(capsys, monkeypatch, home, columns) -> Callable[..., Said]:
    """Runs a command as it is typed; gives exit code, standard output and standard error."""
    monkeypatch.chdir(home)
    monkeypatch.setenv("COLUMNS", str(columns))

    def call(*tokens: object) -> Said:
        capsys.readouterr()
        code = cli.run([str(token) for token in tokens])
        return Said(code, *capsys.readouterr())

    return call
