"""From a film to poses: a long film tracked in a process of its own, its speed and its memory.

`python -m shadowpuppet.evaluation.bench.chain RECORDING RUN [CORES]` does it and prints JSON.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from itertools import chain, cycle, islice
from pathlib import Path
from typing import Any

import numpy as np

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.pipeline.options import make_options
from shadowpuppet.pipeline.track import Listener, track_recording
from shadowpuppet.synthetic import Gesture, Scene, Spec, synthesize
from shadowpuppet.video import open_frames, write_frames

EARLY = 0.2
"""Share of the film after which memory should grow no more."""
ONE_EACH = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")


def long_recording(folder: Path, frames: int, seconds: float = 2.0) -> Path:
    """A made recording whose film (H.264) goes to and fro until it has so many frames."""
    gestures = tuple(Gesture(motion=name, seconds=seconds) for name in ("wave_hands", "reach"))
    spec = Spec(name="bench", motion=gestures, scene=Scene(empty_seconds=1.0))
    recording = synthesize(spec, folder, np.random.default_rng(1))
    for name in ("masks", "truth.csv", "truth.trc"):  # of the short film
        shutil.rmtree(path) if (path := recording / name).is_dir() else path.unlink()
    film = next((recording / "video").iterdir())
    images = [frame.image for frame in open_frames(film)]
    with write_frames(film, spec.rate) as longer:
        for image in islice(cycle(chain(images, images[::-1])), frames):
            longer.write(image)
    return recording


def measure_chain(folder: Path, frames: int) -> dict[str, Any]:
    """What `track_long` tells of one camera's film; the recording is made in `folder`. Raises `ShadowPuppetError` where it fails."""
    return apart(long_recording(folder / "recording", frames), folder / "run")


def apart(recording: Path, run: Path, cores: int = 1) -> dict[str, Any]:
    """What `track_long` tells, from a new process. Raises `ShadowPuppetError` where it fails."""
    done = subprocess.run([sys.executable, "-m", "shadowpuppet.evaluation.bench.chain", str(recording), str(run), str(cores)],
                          capture_output=True, text=True, env=os.environ | ONE_EACH)
    if done.returncode:
        raise ShadowPuppetError(f"bench: tracking the made film failed: {(done.stderr.strip().splitlines() or ['no reason'])[-1]}")
    return json.loads(done.stdout.splitlines()[-1])


class _Memory(Listener):
    """Notes what the process holds after every frame."""

    def __init__(self) -> None:
        self.held: list[float] = []

    def advance(self, frames: int) -> None:
        from shadowpuppet.evaluation.bench.machine import resident_mb

        self.held.append(resident_mb() or np.nan)


def track_long(recording: str, run: str, cores: str = "1") -> dict[str, Any]:
    """Frames/s of the whole chain with the default preset, ms a frame by stage, peak memory and its growth (10^6 bytes), and how so many
    cores were kept to."""
    from shadowpuppet.evaluation.bench.machine import peak_mb, use_cores

    how, memory = use_cores(int(cores)), _Memory()
    metrics = track_recording(recording, run, make_options({"seed": 1}), memory).metrics
    early = memory.held[round(EARLY * len(memory.held))]
    growth = memory.held[-1] - early
    return {"frames": metrics["frames"], "fps": metrics["frames_per_s"], "ms": metrics["ms_per_frame"], "status": metrics["status"],
            "peak_mb": peak_mb(), "growth_mb": growth if np.isfinite(growth) else None, "cores": how}


if __name__ == "__main__":
    print(json.dumps(track_long(*sys.argv[1:4])))
