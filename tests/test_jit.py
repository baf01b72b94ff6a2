"""How kernels are compiled."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numba
import pytest
from numba.core import caching

from shadowpuppet.jit import compiled

ROOT = Path(__file__).resolve().parents[1]
FIRST_RUN = """
from benchmarks.speed.multi_cases import MultiCase
around = MultiCase(cameras=3, points=300, particles=4, size=(160, 120))
print(around.run_forces(3).tobytes().hex(), around.run_gauss_newton(2).tobytes().hex())
"""


@pytest.mark.whole
def test_what_is_compiled_now_and_what_is_loaded_from_the_cache_agree_to_the_last_bit(tmp_path):
    """Numba optimises the two apart: sums that may be taken in any order come out different."""
    surroundings = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    first, second = (subprocess.run([sys.executable, "-c", FIRST_RUN], cwd=ROOT, env=surroundings, capture_output=True, text=True,
                                    check=True).stdout for _ in range(2))
    assert list(tmp_path.rglob("*.nbc"))
    assert len(first) > 1000
    assert first == second


def test_where_there_is_no_folder_for_it_kernels_are_compiled_all_the_same(monkeypatch):
    """As in an installation that can only be read, of somebody without a home."""
    monkeypatch.setattr(getattr(caching, "CacheImpl", None) or caching._CacheImpl, "_locator_classes", [])  # the latter of older Numba
    with pytest.raises(RuntimeError, match="no locator available"):
        numba.njit(cache=True)(plus_one)
    assert compiled(nogil=True)(plus_one)(4) == 5


def plus_one(x):
    return x + 1
