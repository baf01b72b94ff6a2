"""Reports of a run: progress, the time of each stage, the metrics at its end."""

from __future__ import annotations

import contextlib
import json
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple, TypedDict, TypeVar

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask, bounding_window
from shadowpuppet.errors import ShadowPuppetError, warn
from shadowpuppet.io.calibration.calibration_files import write_calibration
from shadowpuppet.io.files.plain import json_text
from shadowpuppet.io.files.text import write_whole
from shadowpuppet.io.motion.motion_files import check_unit, read_truth
from shadowpuppet.io.person import Person, write_person
from shadowpuppet.io.run import read_run
from shadowpuppet.io.run_writer import RunWriter
from shadowpuppet.motion.metrics import evaluate
from shadowpuppet.motion.motion import Motion
from shadowpuppet.pipeline.findings.look import Look, RigLook
from shadowpuppet.pipeline.findings.verdict import SetAside, verdict_of_run
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.rig import Rig
from shadowpuppet.pipeline.subject import floor_entry
from shadowpuppet.tracking.frozen import Interval

Item = TypeVar("Item")
STAGES = ("decode", "segment", "wait", "hull", "track", "doubt", "write")
"""Stages of a frame. Several cameras' films are decoded and segmented in parallel: their sum is not what the tracker waits for, `wait`."""
FALLBACK_RATE = 25.0
"""Frames/s of an overlay if the film does not state its rate."""
FEW_CAMERAS = 3
"""Number of cameras up to which a line of progress names them."""
MANY_LOST = 0.1
"""Share of lost frames above which a warning is given."""


class Listener:
    """Receives a run's progress. Every method does nothing: override those of interest."""

    def begin(self, what: str, total: int | None = None) -> None:
        """A phase begins, such as `tracking`; `total`: its number of frames, if known."""

    def advance(self, frames: int) -> None:
        """`frames` frames are tracked."""

    def look(self, look: Look | RigLook) -> None:
        """The examination of the recording is done; tracking follows."""


class Steps:
    """Names, for a listener, what a look is doing: with each of the cameras that are looked at in parallel. For several threads."""

    def __init__(self, listener: Listener | None, names: Sequence[str], again: bool = False) -> None:
        """`names`: of all cameras; `again`: whether they are looked at a second time, knowing where the person is."""
        self.looking = "looking again" if again else "looking"
        self.listener, self.names, self.now, self.lock = listener or Listener(), tuple(names), dict[str, str](), threading.Lock()

    def __call__(self, what: str, camera: str | None = None) -> None:
        """A step begins, of a `camera` or of all; no words: a camera's last one is done."""
        with self.lock:
            self.now = self.now if camera else {}
            self.now[camera or ""] = what
            doing = dict[str, list[str]]()
            for name, step in self.now.items():
                if step:
                    doing.setdefault(step, []).append(name)
            told = "; ".join(f"{_listed(cameras)}: {step}" if all(cameras) else step for step, cameras in doing.items())
            done = sum(not step for step in self.now.values())
            films = f", {done}/{len(self.names)} films" if camera and len(self.names) > 1 else ""
            self.listener.begin(f"{self.looking}{films}: {told}" if told else f"{self.looking}{films}")


def _listed(cameras: Sequence[str]) -> str:
    """The names of cameras, or their number: a line of progress should fit in a terminal."""
    return ", ".join(cameras) if len(cameras) <= FEW_CAMERAS else f"{len(cameras)} cameras"


@dataclass(frozen=True, eq=False)
class Summary:
    """A finished run."""

    folder: Path
    motion: Motion
    metrics: dict[str, Any]
    """The contents of metrics.json."""
    look: Look | RigLook


@dataclass
class StageTimer:
    """Adds up seconds by stage."""

    seconds: dict[str, float] = field(default_factory=lambda: dict.fromkeys(STAGES, 0.0))

    def add(self, **seconds: float) -> None:
        """Add seconds that were measured elsewhere."""
        for stage, value in seconds.items():
            self.seconds[stage] += value

    @contextlib.contextmanager
    def time(self, stage: str) -> Iterator[None]:
        """Add the time of a `with` block to a stage."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[stage] += time.perf_counter() - start

    def each(self, stage: str, items: Iterable[Item]) -> Iterator[Item]:
        """Pass items on, and add the time of making them to a stage."""
        source = iter(items)
        while True:
            with self.time(stage):
                item = next(source, None)
            if item is None:
                return
            yield item


CHECKPOINT_SECONDS, CHECKPOINT_COST = 1.0, 50.0
"""Least time from one checkpoint to the next: in seconds, and over the time that it takes to write one."""


class Checkpoints:
    """Writes checkpoints as often as they cost little."""

    def __init__(self) -> None:
        """The first one is due at once."""
        self._due = 0.0

    def keep(self, write: Callable[[], None]) -> None:
        """Write one, if it is due."""
        if (now := time.perf_counter()) >= self._due:
            write()
            self._due = time.perf_counter() + max(CHECKPOINT_SECONDS, CHECKPOINT_COST * (time.perf_counter() - now))


class LeftOut(NamedTuple):
    """What a run leaves out of a camera's silhouettes because the body does not explain it."""

    frames: int
    first: float
    """Seconds."""
    last: float
    """Seconds."""
    where: Mask
    """Pixels (H, W) that are left out in any of the frames, in a mask of any size."""


class LeftOutEntry(TypedDict):
    """What was left out of one camera's silhouettes, in metrics.json."""

    camera: str
    frames: int
    from_s: float
    to_s: float
    box: list[int]
    """Left, top, right and bottom, the film's pixels."""


def add_left_out(before: Sequence[LeftOut | None], time: float, masks: Sequence[Mask | None]) -> tuple[LeftOut | None, ...]:
    """What is left out, by camera, with one more frame: its time (s), and for each camera the pixels (H, W) that are left out, or None;
    no masks for none. `before`: at first empty."""
    found = list[LeftOut | None]()
    for n, mask in enumerate(masks):
        last = before[n] if before else None
        found.append(last if mask is None else LeftOut(1, time, time, mask) if last is None
                     else LeftOut(last.frames + 1, last.first, time, last.where | mask))
    return tuple(found) or tuple(before)


def left_out_metrics(found: Sequence[LeftOut | None], cameras: Sequence[Camera]) -> dict[str, list[LeftOutEntry]]:
    """The entry `left_out` of metrics.json, none if nothing was left out: for each camera, of the films' size, the number of frames, the
    times of the first and the last, seconds, and left, top, right and bottom of the place, the film's pixels."""
    entries: list[LeftOutEntry] = [
        {"camera": camera.name, "frames": each.frames, "from_s": round(each.first, 3), "to_s": round(each.last, 3),
         "box": _box(each.where, camera.size)} for camera, each in zip(cameras, found) if each is not None]  # fmt: skip
    return {"left_out": entries} if entries else {}


def _box(mask: Mask, size: tuple[int, int]) -> list[int]:
    """Left, top, right and bottom of a mask (H, W), pixels of a picture of another size (width, height)."""
    (height, width), (rows, columns) = mask.shape, bounding_window(mask.view(np.uint8), 0)
    (x0, x1), (y0, y1) = (columns.start, columns.stop), (rows.start, rows.stop)
    return [round(x0 * size[0] / width), round(y0 * size[1] / height), round(x1 * size[0] / width), round(y1 * size[1] / height)]


def write_beside(folder: Path, look: Look | RigLook, rig: Rig, person: Person | None = None) -> None:
    """Write what stands in a run folder beside its tables: look.json, calibration.toml and, of a measured person, person.toml."""
    write_whole(folder / "look.json", json_text(look) + "\n")
    write_calibration(folder / "calibration.toml", [footage.view.camera for footage in rig.footage])
    if person is not None:
        write_person(folder / "person.toml", person)


def is_same_look(before: str, now: str) -> bool:
    """Whether two texts of look.json say the same of a recording, which may lie in another place."""
    one, other = json.loads(before), json.loads(now)
    places = str(one.pop("recording", "")), str(other.pop("recording", ""))

    def equal(a: object, b: object) -> bool:
        if isinstance(a, dict) and isinstance(b, dict):
            return a.keys() == b.keys() and all(equal(a[key], b[key]) for key in a)
        if isinstance(a, list) and isinstance(b, list):
            return len(a) == len(b) and all(map(equal, a, b))
        return a == b or (isinstance(a, str) and places[0] != "" and a.replace(*places) == b)

    return equal(one, other)


def generators(options: Options) -> list[np.random.Generator]:
    """Two random generators, for the look and for the tracking, so that neither depends on what the other draws."""
    return np.random.default_rng(options.seed).spawn(2)


def tracked(frames: int | None, every: int) -> int | None:
    """Number of tracked frames of a film with `frames` frames; None if that is unknown."""
    return None if frames is None else -(-frames // every)


def timings(timer: StageTimer, stages: Iterable[str], frames: int, wall: float) -> dict[str, float | dict[str, float]]:
    """Seconds in total, frames/s, and milliseconds per frame of the `stages`, for metrics.json."""
    milliseconds = {stage: round(1000 * timer.seconds[stage] / max(frames, 1), 3) for stage in stages}
    return {"track_s": round(wall, 3), "frames_per_s": round(frames / max(wall, 1e-9), 2), "ms_per_frame": milliseconds}


def warn_of_losses(motion: Motion) -> None:
    """Warn if many frames are lost."""
    lost = np.flatnonzero(motion.status == "lost")
    present = np.count_nonzero(motion.status != "absent")
    if len(lost) > MANY_LOST * present:
        warn(f"the person is lost in {100 * len(lost) / present:.0f} % of the frames, first at {motion.times[lost[0]]:.2f} s: do their "
             "silhouettes show them, and them alone? --overlay shows it; give a picture of the empty scene, a --region, or better light")


def warn_of_left_out(found: Sequence[LeftOutEntry]) -> None:
    """Warn of parts of the silhouettes that were left out; `found`: the entry of metrics.json."""
    if found:
        places = "; ".join(f"camera {one['camera']!r}, {one['frames']} frames from {one['from_s']:.1f} to {one['to_s']:.1f} s, within "
                           "x {} to {}, y {} to {}".format(one["box"][0], one["box"][2], one["box"][1], one["box"][3]) for one in found)
        warn(f"parts of the silhouettes that stayed, and that no pose of the body explains, were left out ({places}): a thing, a shadow or "
             "another person; if it was the person, give --tracker.patience 0 (with several cameras --multiview.patience 0)")


def set_aside(intervals: Iterable[Interval], names: Sequence[str]) -> dict[str, list[SetAside]]:
    """The entry `set_aside` of metrics.json, none if no camera was: camera, why, number of frames, times of the first and last (s)."""
    found: list[SetAside] = [{"camera": names[each.camera], "why": each.why, "frames": each.frames, "from_s": round(each.begin, 3),
              "to_s": round(each.end, 3)} for each in sorted(intervals, key=lambda each: each.begin)]
    return {"set_aside": found} if found else {}


def warn_of_set_aside(found: Sequence[SetAside]) -> None:
    """Warn of cameras that were set aside, or of the only one that was blind; `found`: the entry of metrics.json."""
    if found:
        when = "; ".join(f"camera {one['camera']!r}, {one['why']} from {one['from_s']:.1f} to {one['to_s']:.1f} s" for one in found)
        warn(f"cameras were left out for a time ({when}): frozen is a picture that does not change while the person moves in others, "
             "blind one of which nearly all is silhouette, as when it turns black; late or early one that shows what the others showed, or "
             "will show, at another time: are its frames complete, and is its start in recording.toml right?")


def evaluated(rig: Rig, motion: Motion) -> dict[str, Any]:
    """Metrics of a motion, with errors if the recording has a matching ground truth; a single camera defines the depth direction."""
    camera, cameras = None if rig.is_multiview else rig.cameras[0], len(rig.cameras)
    try:
        truth, path = None, rig.recording.truth
        if path is not None:
            truth = read_truth(path, motion.joint_names)
            check_unit(motion.table, truth, path)
            truth = truth.between(rig.recording.begin, np.inf if rig.recording.duration is None else rig.recording.duration)
        return evaluate(motion, truth, camera=camera, cameras=cameras)
    except ShadowPuppetError as error:  # the run is complete: a bad truth file must not discard it
        warn(f"no errors are computed: {error}")
        return evaluate(motion, camera=camera, cameras=cameras)


def judge(writer: RunWriter, rig: Rig, look: Look | RigLook, person: Person, options: Options) -> dict[str, Any]:
    """Complete the run's entries: its floor, its errors and the verdict on it. Returns the errors and other metrics of the motion."""
    writer.info |= floor_entry(writer.motion, rig.cameras, person)
    writer.check()
    found, frames = evaluated(rig, writer.motion), (len(writer.motion), tracked(look.frames, options.every))
    verdict = verdict_of_run(look, writer.motion, writer.metrics.get("set_aside", ()), frames,
                             camera=None if rig.is_multiview else rig.cameras[0])
    writer.metrics |= found | {"verdict": verdict.plain()}
    return found


def summary(folder: str | Path, found: dict[str, Any], look: Look | RigLook) -> Summary:
    """The finished run in a folder, with warnings of what was lost and left out; `found`: metrics of its motion."""
    written = read_run(folder)
    metrics = written.metrics | found
    warn_of_losses(written.motion)
    warn_of_left_out(metrics.get("left_out", []))
    warn_of_set_aside(metrics.get("set_aside", []))
    return Summary(Path(folder), written.motion, metrics, look)
