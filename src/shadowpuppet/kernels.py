"""How the core's kernels are compiled, and how many poses they take at once."""

from __future__ import annotations

import numba

BLOCK = 32
"""Poses side by side in memory, so that one instruction works on eight (AVX-512) or four (AVX2) of them."""
kernel = numba.njit(cache=True, _nrt=False, error_model="numpy")
"""It gets all its arrays and makes none, so that Numba counts no references: where arrays are sliced in inner loops, that took more time
than the work. Nor are divisions checked, which would keep loops from being vectorised: no kernel divides by zero."""
joined = numba.njit(cache=True, _nrt=False, error_model="numpy", forceinline=True)
"""A kernel that others call so often that the call itself would take time: LLVM puts it in its place."""
part = numba.njit(inline="always")
"""A part of one or two kernels, compiled with them only."""
