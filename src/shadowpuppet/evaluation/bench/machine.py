"""Properties of this machine that matter for speed."""

from __future__ import annotations

import os
import platform
from importlib.metadata import version
from pathlib import Path
from typing import Any

PACKAGES = ("shadowpuppet", "numpy", "numba", "llvmlite", "opencv-python-headless", "av")
LEVELS = (("avx512f", "AVX-512"), ("avx2", "AVX2"), ("avx", "AVX"), ("neon", "NEON"))


def environment() -> dict[str, Any]:
    """Processor, cores, vector instructions, system and versions."""
    import llvmlite.binding as llvm

    features = llvm.get_host_cpu_features()
    level = next((name for feature, name in LEVELS if features.get(feature)), "none known")
    return {"cpu": _model(), "llvm_cpu": llvm.get_host_cpu_name(), "cores": os.cpu_count(), "vectors": level, "system": platform.platform(),
            "python": platform.python_version(), **{name: version(name) for name in PACKAGES}}


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


def _model() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text("utf-8").splitlines()
    except OSError:
        return platform.processor() or "unknown"
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), platform.machine())
