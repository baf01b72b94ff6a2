"""Numba decorators of the kernels, and the number of poses that a kernel processes at once."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba

BLOCK = 32
"""Poses side by side in memory, so that one instruction works on eight (AVX-512) or four (AVX2) of them."""
KERNEL_OPTIONS: dict[str, Any] = {"nogil": True, "_nrt": False, "error_model": "numpy"}
"""Kernels get all arrays from their caller and allocate none, so Numba's reference counts are off: where arrays are sliced in inner loops,
counting took longer than the work. Division checks are off, which would prevent vectorisation: no kernel divides by zero. The GIL is
released, so several cameras are processed at once; a caller that reuses work arrays must lock them.

Numba's cache only notices changes of a kernel's own file: after a change in a file that the kernel calls into, remove `__pycache__`."""


def compiled(**options: Any) -> Callable[[Any], Any]:
    """Numba's `njit` with its cache on disk, or without a cache if the folder cannot be written."""

    def made(function: Any) -> Any:
        try:
            return numba.njit(cache=True, **options)(function)
        except RuntimeError as error:
            if "no locator available" not in str(error):
                raise
            return numba.njit(**options)(function)

    return made


kernel = compiled(**KERNEL_OPTIONS)
inline_kernel = compiled(**KERNEL_OPTIONS, forceinline=True)
"""Always-inlined kernel: for those called so often that the call itself takes time (LLVM inlines it)."""
device = numba.njit(inline="always")
"""A function inside kernels; compiled with its callers only."""
REDUCTION_MATH = {"contract", "nsz", "arcp", "nnan"}
"""Fast-math flags that let loops over lanes vectorise; infinities keep their meaning, NaN must not come in. Sums are not reordered: the
compiled and the cached version are optimised separately and would differ in the last bit."""
reduction_kernel = compiled(**KERNEL_OPTIONS, fastmath=REDUCTION_MATH)
"""Kernel of sums over finite numbers, lane by lane."""


def is_compiled() -> bool:
    """Whether kernels of the package were compiled before, and kept on disk; the first time takes a minute or more."""
    place = Path(os.environ.get("NUMBA_CACHE_DIR") or Path(__file__).parent)
    return next(place.rglob("*.nbi"), None) is not None
