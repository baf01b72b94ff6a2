"""All measurements of `shadowpuppet bench`, one tracker after the other, and the file of its figures."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from shadowpuppet.errors import ShadowPuppetError, reason
from shadowpuppet.evaluation.bench.machine import environment
from shadowpuppet.evaluation.bench.mono import run_mono
from shadowpuppet.evaluation.bench.multi import run_multi
from shadowpuppet.io.files.text import write_whole
from shadowpuppet.pipeline.track import Listener
from shadowpuppet.threads import one_blas_thread


def run_bench(quick: bool = False, listener: Listener | None = None) -> dict[str, Any]:
    """All figures by flat keys, with `environment` and `raw` (median and least seconds per unit, and rounds, of each timed function).

    `quick`: fewer rounds, shorter films, no times with compilation. Raises `ShadowPuppetError` if a part of it fails.
    """
    listener = listener or Listener()
    with one_blas_thread():
        (mono, mono_raw), (multi, multi_raw) = run_mono(quick, listener), run_multi(quick, listener)
    raw = {name: times._asdict() for name, times in (mono_raw | multi_raw).items()}
    return {**mono, **multi, "quick": quick, "environment": environment(), "raw": raw}


def check_writable(path: Path) -> None:
    """Raise `ShadowPuppetError` if a file cannot be written; called before minutes of work."""
    missing = not path.exists()
    try:
        with path.open("ab"):
            pass
        if missing:
            path.unlink()
    except OSError as error:
        raise ShadowPuppetError(f"{path}: cannot be written ({reason(error)})") from None


def write_figures(path: Path, figures: Mapping[str, Any]) -> None:
    """Write all figures as JSON, null for those not known. Raises `ShadowPuppetError` if the file cannot be written."""
    write_whole(path, json.dumps(figures, indent=1, allow_nan=False) + "\n")
