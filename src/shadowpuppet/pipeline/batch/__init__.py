"""Many runs: grids of settings, tasks, worker pools, summaries."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from shadowpuppet.pipeline.batch.grid import Case, Grid, make_grid, read_grid
    from shadowpuppet.pipeline.batch.run import Batch, BatchListener, run_batch

__all__ = ["Batch", "BatchListener", "Case", "Grid", "make_grid", "read_grid", "run_batch"]
_HOMES = {"Batch": "run", "BatchListener": "run", "run_batch": "run", "Case": "grid", "Grid": "grid", "make_grid": "grid",
          "read_grid": "grid"}  # fmt: skip


def __getattr__(name: str) -> object:
    """Import a public name when it is first used (PEP 562): a worker needs none of them."""
    from importlib import import_module

    if name not in _HOMES:
        raise AttributeError(f"module 'shadowpuppet.pipeline.batch' has no attribute {name!r}")
    return getattr(import_module(f"shadowpuppet.pipeline.batch.{_HOMES[name]}"), name)
