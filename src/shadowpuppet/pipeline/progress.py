"""What every run has, of one camera or several: who is told, the time each stage takes, measures at the end."""

from __future__ import annotations

import contextlib
import json
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar
from warnings import warn

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import ShadowPuppetError, ShadowPuppetWarning
from shadowpuppet.io.files.plain import for_json, plain
from shadowpuppet.io.motion.motion_files import read_truth
from shadowpuppet.io.recording import Recording
from shadowpuppet.motion.metrics import evaluate
from shadowpuppet.motion.motion import Motion
from shadowpuppet.pipeline.look import Look
from shadowpuppet.pipeline.look_rig import RigLook
from shadowpuppet.pipeline.options import Options

Item = TypeVar("Item")
STAGES = ("decode", "segment", "track", "write")
"""What a frame's time is spent on, with one camera."""
RIG_STAGES = ("decode", "segment", "wait", "hull", "track", "write")
"""The same with several; their films are decoded and segmented side by side, and what this takes altogether is not waited for."""
FALLBACK_RATE = 25.0
"""Frames/s of an overlay whose film does not tell its own."""
MANY_LOST = 0.1
"""Share of frames from which on a run that lost the person is said to be in doubt."""


class Listener:
    """Is told how a run goes, and does nothing: derive from it."""

    def begin(self, what: str, total: int | None = None) -> None:
        """Something begins: `looking` or `tracking`; `total`: frames, where that is known."""

    def advance(self, frames: int) -> None:
        """So many frames are tracked."""

    def look(self, look: Look | RigLook) -> None:
        """What was found, before the tracking begins."""


@dataclass(frozen=True, eq=False)
class Summary:
    """A run that came to its end."""

    folder: Path
    motion: Motion
    metrics: dict[str, Any]
    """What is in metrics.json."""
    look: Look | RigLook


@dataclass
class Watch:
    """Seconds by stage."""

    seconds: dict[str, float] = field(default_factory=lambda: dict.fromkeys(STAGES, 0.0))

    @classmethod
    def of(cls, stages: Iterable[str]) -> Watch:
        """One for other stages than those of one camera."""
        return cls(dict.fromkeys(stages, 0.0))

    def add(self, stage: str, seconds: float) -> None:
        """Count what was measured elsewhere."""
        self.seconds[stage] += seconds

    @contextlib.contextmanager
    def time(self, stage: str) -> Iterator[None]:
        """Count what is done in the `with` block."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[stage] += time.perf_counter() - start

    def each(self, stage: str, items: Iterable[Item]) -> Iterator[Item]:
        """Count the making of the items."""
        source = iter(items)
        while True:
            with self.time(stage):
                item = next(source, None)
            if item is None:
                return
            yield item


def json_text(value: Any) -> str:
    """Plain values, arrays and dataclasses as JSON; null for what is not finite."""
    return json.dumps(for_json(plain(value, "value")), indent=1, ensure_ascii=False, allow_nan=False)


def generators(options: Options) -> list[np.random.Generator]:
    """One for the look, one for the tracking, so that neither's use of chance changes the other."""
    return np.random.default_rng(options.seed).spawn(2)


def tracked(frames: int | None, every: int) -> int | None:
    """How many of a film's frames are tracked; None where their number is not known."""
    return None if frames is None else -(-frames // every)


def timings(watch: Watch, frames: int, wall: float) -> dict[str, Any]:
    """Seconds in all, frames/s, and milliseconds a frame by stage, for metrics.json."""
    milliseconds = {stage: round(1000 * seconds / max(frames, 1), 3) for stage, seconds in watch.seconds.items()}
    return {"track_s": round(wall, 3), "frames_per_s": round(frames / max(wall, 1e-9), 2), "ms_per_frame": milliseconds}


def warn_of_losses(motion: Motion) -> None:
    """Warn where much of the run is nothing."""
    lost = np.flatnonzero(motion.status == "lost")
    present = np.count_nonzero(motion.status != "absent")
    if len(lost) > MANY_LOST * present:
        warn(f"the person is lost in {100 * len(lost) / present:.0f} % of the frames, first at {motion.times[lost[0]]:.2f} s: do their "
             "silhouettes show them, and them alone? --overlay shows it; give a picture of the empty scene, a --region, or better light",
             ShadowPuppetWarning, stacklevel=3)


def evaluated(recording: Recording, motion: Motion, camera: Camera | None = None, cameras: int = 1) -> dict[str, Any]:
    """Measures, against the truth where there is one that fits; `camera` says what is depth, where it is not one of several `cameras`."""
    try:
        truth = read_truth(recording.truth, motion.joint_names) if recording.truth is not None else None
        return evaluate(motion, truth, camera=camera, cameras=cameras)
    except ShadowPuppetError as error:  # the run is done: it is not to be lost over this
        warn(f"no errors are told: {error}", ShadowPuppetWarning, stacklevel=2)
        return evaluate(motion, camera=camera, cameras=cameras)
