"""All that `shadowpuppet bench` measures: a tracker after the other, in one run."""

from __future__ import annotations

from typing import Any

from shadowpuppet.evaluation.bench.machine import environment
from shadowpuppet.evaluation.bench.mono import run_mono
from shadowpuppet.evaluation.bench.multi import run_multi
from shadowpuppet.pipeline.track import Listener
from shadowpuppet.threads import one_blas_thread


def run_bench(quick: bool = False, listener: Listener | None = None) -> dict[str, Any]:
    """All figures by flat keys, with `environment`, `raw` (median, least and rounds of all that was timed, seconds a unit) and `curves`,
    those of several cameras under `multi`.

    `quick`: fewer rounds, shorter films, nothing compiled anew. Raises `ShadowPuppetError` where a part of it fails.
    """
    with one_blas_thread():
        mono, multi = run_mono(quick, listener), run_multi(quick, listener)
    raw, drawn = mono.pop("raw") | multi.pop("raw"), mono.pop("curves") | {"multi": multi.pop("curves")}
    return {**mono, **multi, "quick": quick, "environment": environment(), "raw": raw, "curves": drawn}
