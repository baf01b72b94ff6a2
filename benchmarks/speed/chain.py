"""Measurements of the whole chain from film to poses, each in its own process: speed and memory on a long film, time to a first pose.

As a program, `speed.chain track RECORDING RUN CORES` prints JSON, and `speed.chain start` tracks one frame.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from itertools import chain, cycle, islice
from pathlib import Path
from typing import Any

import numpy as np

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.pipeline.options import make_options
from shadowpuppet.pipeline.track import Listener, track_recording
from shadowpuppet.synthetic import Gesture, Mannequin, Ring, Scene, Spec, synthesize
from shadowpuppet.threads import child_environment
from shadowpuppet.video import open_frames, write_frames

WARM_UP = 0.2
"""Share of the film after which memory should not grow any more."""
ONE_THREAD_EACH: dict[str, str] = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")


def walking(size: tuple[int, int] = (640, 480), cameras: int = 7, frames: int = 12) -> Spec:
    """Recording of a walking person by a ring of cameras: a few frames from the middle of a stride, and training motion."""
    ring = Ring(count=cameras, radius=4.5, jitter=0.5, size=size, distortion=(-0.09, 0.05, 0.0, 0.0))
    return Spec(name="bench", body=Mannequin(), motion=(Gesture(motion="walk", seconds=2.5),), begin=1.2, frames=frames, ring=ring,
                scene=Scene(clothing=8, room=3, empty_seconds=0.2), rate=60)  # fmt: skip


def long_recording(spec: Spec, folder: Path, frames: int) -> Path:
    """A synthetic recording; its films (H.264) run forward and backward until they have `frames` frames. It has no exact masks or truth."""
    recording = synthesize(spec, folder, np.random.default_rng(1))
    for name in ("masks", "truth.csv", "truth.trc"):  # of the short film
        shutil.rmtree(path) if (path := recording / name).is_dir() else path.unlink()
    for film in (recording / "video").iterdir():
        images = [frame.image for frame in open_frames(film)]
        with write_frames(film, spec.rate) as longer:
            for image in islice(cycle(chain(images, images[::-1])), frames):
                longer.write(image)
    return recording


def measure_chain(spec: Spec, frames: int, cores: int = 1) -> dict[str, Any]:
    """The figures of `track_long` on a long recording, in a new process. Raises `ShadowPuppetError` if it fails."""
    with tempfile.TemporaryDirectory() as folder:
        recording = long_recording(spec, Path(folder) / "recording", frames)
        out = _child("tracking the made film failed", ONE_THREAD_EACH, "track", str(recording), str(Path(folder) / "run"), str(cores))
    return json.loads(out.splitlines()[-1])


def chain_figures(prefix: str, found: Mapping[str, Any], cores: str) -> dict[str, Any]:
    """The figures of `measure_chain` by flat keys; `cores`: the key for the number of cores."""
    named = {f"{stage}_ms": spent for stage, spent in found["ms"].items()}
    named |= {"chain_fps": found["fps"], "chain_frames": found["frames"], "peak_mb": found["peak_mb"], "growth_mb": found["growth_mb"],
              cores: found["cores"]}
    return {f"{prefix}.{name}": value for name, value in named.items()}


class _Memory(Listener):
    """Notes the resident memory after every frame."""

    def __init__(self) -> None:
        self.megabytes: list[float] = []

    def advance(self, frames: int) -> None:
        from .machine import resident_mb

        self.megabytes.append(resident_mb() or np.nan)


def track_long(recording: str, run: str, cores: str) -> dict[str, Any]:
    """Track a recording with the default preset: frames/s, ms a frame by stage, peak memory and its growth (10^6 bytes), and how the
    process was held to `cores`."""
    from .machine import peak_mb, use_cores

    how, memory = use_cores(int(cores)), _Memory()
    metrics = track_recording(recording, run, make_options({"seed": 1}), memory).metrics
    growth = memory.megabytes[-1] - memory.megabytes[round(WARM_UP * len(memory.megabytes))]
    return {"frames": metrics["frames"], "fps": metrics["frames_per_s"], "ms": metrics["ms_per_frame"], "status": metrics["status"],
            "peak_mb": peak_mb(), "growth_mb": growth if np.isfinite(growth) else None, "cores": how}


def start_times() -> tuple[float, float]:
    """Seconds from the start of a process to its first pose: when it has to compile all kernels, and with compiled kernels in the cache."""
    with tempfile.TemporaryDirectory() as cache:
        return _start(cache), _start(cache)


def _start(cache: str) -> float:
    begin = time.perf_counter()
    _child("the process that starts again failed", {"NUMBA_CACHE_DIR": cache}, "start")
    return time.perf_counter() - begin


def _child(failure: str, variables: Mapping[str, str], *arguments: str) -> str:
    """Standard output of this module as a program. Raises `ShadowPuppetError` with the last line of its errors."""
    done = subprocess.run([sys.executable, "-m", "speed.chain", *arguments], cwd=Path(__file__).resolve().parents[1], capture_output=True,
                          text=True, encoding="utf-8", env=child_environment(variables))
    if done.returncode:
        raise ShadowPuppetError(f"bench: {failure}: {(done.stderr.strip().splitlines() or ['no reason'])[-1]}")
    return done.stdout


if __name__ == "__main__":
    if sys.argv[1] == "track":
        print(json.dumps(track_long(*sys.argv[2:5])))
    else:
        from .mono_cases import MonoFollower

        MonoFollower("default").run(1)
