"""How the core's kernels are compiled, and how many poses they take at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba

BLOCK = 32
"""Poses side by side in memory, so that one instruction works on eight (AVX-512) or four (AVX2) of them."""
KERNEL_OPTIONS: dict[str, Any] = {"nogil": True, "_nrt": False, "error_model": "numpy"}
"""A kernel gets all its arrays and makes none, so that Numba counts no references: where arrays are sliced in inner loops, that took more
time than the work. Nor are divisions checked, which would keep loops from being vectorised: no kernel divides by zero. Python's lock is let
go, so that several cameras are worked on at once: who keeps arrays for a kernel to work in keeps them from other threads meanwhile.

Numba keeps what it compiled until the kernel's own file changes: after a change in a file that it calls into, remove `__pycache__`."""


def compiled(**options: Any) -> Callable[[Any], Any]:
    """Numba's `njit`; what it compiled is kept for the next time, but where there is no folder for it, as where all can only be read."""

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
"""A kernel that another calls so often that the call itself would take time: LLVM puts it in its place."""
device = numba.njit(inline="always")
"""A part of one or two kernels, compiled with them only."""
REDUCTION_MATH = {"contract", "nsz", "arcp", "nnan"}
"""Freedom that lets a loop over lanes become one of vectors; infinities keep their meaning, what is not a number must not come in. Sums
keep their order: what is compiled now and what is loaded from the cache next time are optimised apart, and would differ in the last bit."""
reduction_kernel = compiled(**KERNEL_OPTIONS, fastmath=REDUCTION_MATH)
"""A kernel of sums over finite numbers, lane by lane."""
