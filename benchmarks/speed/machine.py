"""Memory and cores of a process that is measured."""

from __future__ import annotations

import os
import platform
from pathlib import Path


def resident_mb() -> float | None:
    """Resident memory of this process, 10^6 bytes; None if the system does not report it."""
    try:
        pages = int(Path("/proc/self/statm").read_text("ascii").split()[1])
    except (OSError, ValueError, IndexError):
        return None
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def peak_mb() -> float | None:
    """Peak resident memory of this process, 10^6 bytes; None if the system does not report it."""
    try:
        import resource
    except ImportError:  # Windows
        return None
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return most * (1 if platform.system() == "Darwin" else 1024) / 1e6


def use_cores(count: int = 1) -> str:
    """Restrict this process to `count` cores if the system can; returns what was done, in words. Call it before anything counts cores."""
    import cv2

    cv2.setNumThreads(1)
    if hasattr(os, "sched_setaffinity"):
        cores = sorted(os.sched_getaffinity(0))[-count:]
        os.sched_setaffinity(0, cores)
        return f"the process kept to {'one core' if len(cores) == 1 else f'{len(cores)} cores'}"
    return "one thread each for OpenCV, Numba and BLAS"
