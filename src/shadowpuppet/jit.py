"""Numba decorators of the kernels, and the number of poses that a kernel processes at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba
from numba.core import event

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


class _Compiling(event.Listener):
    """Counts the kernels that are being compiled now; those that are read from the disk are not."""

    number = 0

    def on_start(self, event: Any) -> None:
        """One begins."""
        self.number += 1

    def on_end(self, event: Any) -> None:
        """One ends."""
        self.number -= 1


_COMPILING = _Compiling()
event.register("numba:compile", _COMPILING)


def is_compiling() -> bool:
    """Whether a kernel is being compiled now; the first time all of them take a minute or more, and are kept on disk."""
    return _COMPILING.number > 0
