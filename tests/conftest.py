"""Fixtures shared by all tests."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest


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
