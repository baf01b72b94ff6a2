"""Fixtures of the command line's tests."""

from __future__ import annotations

import numpy as np
import pytest

from shadowpuppet.camera.camera import Camera
from shadowpuppet.cli.tables import show
from shadowpuppet.io.calibration.calibration_files import write_calibration
from shadowpuppet.video import write_frames


@pytest.fixture
def printed(capsys, monkeypatch):
    """The lines that a table is printed as, with single blanks."""
    monkeypatch.setenv("COLUMNS", "300")

    def lines(*parts) -> list[str]:
        show(*parts)
        return [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]

    return lines


@pytest.fixture
def alone(monkeypatch, home):
    """No uv on the path, and an empty cache."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(home / "cache"))
    monkeypatch.setenv("PATH", str(home / "bin"))


@pytest.fixture
def two(home):
    """A recording of two cameras, five frames each that become brighter."""
    folder = home / "lab"
    for name in ("left", "right"):
        (folder / "video").mkdir(parents=True, exist_ok=True)
        with write_frames(folder / "video" / f"{name}.mp4", 10) as writer:
            for n in range(5):
                writer.write(np.full((24, 32, 3), 40 * n, np.uint8))
    write_calibration(folder / "calibration.toml", [Camera.from_fov((32, 24), 1.0, name) for name in ("left", "right")])
    return folder
