"""Fixtures shared by all tests."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import made
import made_rig
import numpy as np
import pytest
from hypothesis import settings

from shadowpuppet.camera.camera import Camera
from shadowpuppet.cli import app as cli

settings.register_profile("no deadline", settings.default, deadline=None)  # a loaded machine is no failure
settings.load_profile("no deadline")


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20110914)


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of shared recordings beside the checkout (or SHADOWPUPPET_SHARED); tests that use it are skipped if it is missing."""
    path = Path(os.environ.get("SHADOWPUPPET_SHARED", Path(__file__).resolve().parents[2] / "shared"))
    if not (path / "recordings").is_dir():
        pytest.skip("the shared recordings are not here")
    return path


@pytest.fixture(scope="session")
def recording(tmp_path_factory) -> Path:
    """A small synthetic recording of one camera (`made.SPEC`); not to be changed."""
    return made.make(tmp_path_factory.mktemp("made") / "tiny")


@pytest.fixture(scope="session")
def rig_recording(tmp_path_factory) -> Path:
    """A small synthetic recording of four cameras (`made_rig`); not to be changed."""
    return made_rig.write(tmp_path_factory.mktemp("made") / "rig")


@pytest.fixture
def spoilt(recording, tmp_path) -> Path:
    """A copy of the module's recording, to be changed."""
    return made.copied(recording, tmp_path / "spoilt")


@pytest.fixture(scope="session")
def cameras() -> list[Camera]:
    """The four cameras of `rig_recording`."""
    return made_rig.cameras()


class Said(NamedTuple):
    """Exit code and output of a command."""

    code: int
    out: str
    err: str


@pytest.fixture
def columns() -> int:
    """Width of `shell`'s terminal."""
    return 80


@pytest.fixture
def home(tmp_path) -> Path:
    """Working directory of `shell`."""
    return tmp_path


@pytest.fixture
def shell(capsys, monkeypatch, home, columns) -> Callable[..., Said]:
    """Runs a command line; returns exit code, standard output, and standard error without lines of progress."""
    from shadowpuppet.cli.terminal import PROGRESS

    monkeypatch.chdir(home)
    monkeypatch.setenv("COLUMNS", str(columns))

    def call(*tokens: object) -> Said:
        capsys.readouterr()
        code = cli.run([str(token) for token in tokens])
        out, err = capsys.readouterr()
        return Said(code, out, "".join(line for line in err.splitlines(keepends=True) if not line.startswith(PROGRESS)))

    return call
