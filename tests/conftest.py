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
import workers
from hypothesis import settings

from shadowpuppet.camera.camera import Camera
from shadowpuppet.cli import app as cli

settings.register_profile("full", settings.default, deadline=None)  # a loaded machine is no failure
settings.register_profile("quick", settings.get_profile("full"), max_examples=25)
NAMED = pytest.StashKey[set[Path]]()
"""Test files that the command line names: of these everything runs, marked `whole` or not."""


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--whole", action="store_true", help="run also what is marked `whole`, and more examples of each property")


def pytest_configure(config: pytest.Config) -> None:
    settings.load_profile("full" if config.getoption("--whole") or "CI" in os.environ else "quick")
    config.stash[NAMED] = {Path(argument.partition("::")[0]).resolve() for argument in config.args}
    if "PYTEST_XDIST_WORKER" in os.environ:
        workers.compile_one_at_a_time()


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    if item.get_closest_marker("whole") and not item.config.getoption("--whole") and item.path not in item.config.stash[NAMED]:
        pytest.skip("whole")


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
def once(tmp_path_factory) -> Callable[[str, Callable[[Path], object]], Path]:
    """Gives the folder of a name that a function makes: once in a session, whichever worker needs it first. It is not to be changed."""
    base = tmp_path_factory.getbasetemp()
    base = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    return lambda name, make: workers.made_once(base / "made" / name, make)


@pytest.fixture(scope="session")
def recording(once) -> Path:
    """A small synthetic recording of one camera (`made.SPEC`); not to be changed."""
    return once("tiny", made.make)


@pytest.fixture(scope="session")
def rig_recording(once) -> Path:
    """A small synthetic recording of four cameras (`made_rig`); not to be changed."""
    return once("rig", made_rig.write)


@pytest.fixture
def spoilt(recording, tmp_path) -> Path:
    """A copy of the module's recording, to be changed."""
    return made.copied(recording, tmp_path / "spoilt")


@pytest.fixture(scope="session")
def cameras() -> list[Camera]:
    """The four cameras of `rig_recording`."""
    return made_rig.cameras()


@pytest.fixture
def scale_unfitted(monkeypatch) -> None:
    """A look at several cameras fits no bodies to tell a wrong scale, most of its time: tests/pipeline/findings/test_scale.py has that."""
    monkeypatch.setattr("shadowpuppet.pipeline.findings.scale.fitted_heights", lambda *given: iter(()))


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
