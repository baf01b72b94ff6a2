"""From nothing to the first pose, in a process of its own: `python -m shadowpuppet.evaluation.bench.startup`."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time

from shadowpuppet.errors import ShadowPuppetError


def start_times() -> tuple[float, float]:
    """Seconds that a new process takes to the first pose: with all kernels compiled anew, and with those that it finds compiled."""
    with tempfile.TemporaryDirectory() as cache:
        return _start(cache), _start(cache)


def _start(cache: str) -> float:
    begin = time.perf_counter()
    done = subprocess.run([sys.executable, "-m", "shadowpuppet.evaluation.bench.startup"], capture_output=True, text=True,
                          env=os.environ | {"NUMBA_CACHE_DIR": cache})
    if done.returncode:
        raise ShadowPuppetError(f"bench: the process that starts anew failed: {(done.stderr.strip().splitlines() or ['no reason'])[-1]}")
    return time.perf_counter() - begin


if __name__ == "__main__":
    from shadowpuppet.evaluation.bench.mono_cases import Follower

    Follower("default").run(1)
