"""What is tracked: recordings given, made ones, HumanEva's; or silhouettes that are drawn. Each is read once into a `Case` on the disk.

Decoding, silhouettes, surface points, the person's sizes and the poses that stand for the truth are the same for all methods, as in Ni 2008
(VII: "the system inputs are the same 3D reconstructions").
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from papers.common.experiment import Request
from papers.common.sources import digest
from papers.ni2008.recordings import humaneva
from shadowpuppet.body.models import make_body, sizes_kind
from shadowpuppet.body.shapes import Body
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask
from shadowpuppet.geometry import Array
from shadowpuppet.io.calibration.calibration_files import read_calibration, write_calibration
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.synthetic import Spec, synthesize
from shadowpuppet.tracking.multiview.surface.visual_hull import SurfacePoints

BODY = "cylinders"
"""The paper's body (II)."""
ACTIONS = {"walking": "Walking", "jogging": "Jog", "boxing": "Box"}
"""The paper's motions, and what HumanEva calls them."""
SHORT = {"factor": 0.25, "frames": 12, "training": 60}
"""The short version: pictures of this share of the size, so many frames to track and to learn from."""


class Source(NamedTuple):
    """A recording before it is read."""

    name: str
    path: Path | None
    """Its folder; None: it is drawn, of `spec`."""
    spec: Spec | None = None
    masks: bool = False
    """Whether its ready silhouettes are taken, not those of its films."""
    factor: float = 1.0
    """By how much the pictures of what is drawn are smaller."""

    @property
    def key(self) -> str:
        """Of all that what is read of it depends on: its files, and the programs that read them."""
        parts: list[Any] = [self.name, str(self.spec), self.masks, self.factor, digest("papers.ni2008.reading")]
        if self.path is not None:
            files = sorted(path for path in self.path.rglob("*") if path.is_file())
            parts += [(str(path), path.stat().st_size, path.stat().st_mtime_ns) for path in files]
        return hashlib.sha256(repr(parts).encode()).hexdigest()[:16]


@dataclass(frozen=True, eq=False)
class Case:
    """A recording as the trackers get it. `arrays` are those of its file."""

    name: str
    path: Path
    cameras: tuple[Camera, ...]
    arrays: dict[str, NDArray[Any]]

    @cached_property
    def times(self) -> Array:
        """Seconds, of shape (T,)."""
        return self.arrays["times"]

    @property
    def rate(self) -> float:
        """Frames/s."""
        return float(self.arrays["rate"])

    @property
    def frames(self) -> int:
        """T."""
        return len(self.times)

    @property
    def motion(self) -> str:
        """Which of the paper's motions it is, or its own name."""
        return motion_of(self.name) or self.name

    @cached_property
    def body(self) -> Body:
        """The person's, with their sizes."""
        return make_body(BODY, sizes_kind(BODY).from_array(self.arrays["sizes"]))

    @cached_property
    def truth(self) -> JointTable:
        """True joints at `times`."""
        return JointTable(self.times, tuple(self.arrays["joint_names"].tolist()), self.arrays["truth"])

    @cached_property
    def true_poses(self) -> Array:
        """Poses (T, D) of the body that stand for the true joints best."""
        return self.arrays["true_poses"]

    @cached_property
    def training(self) -> Array:
        """Poses (F, D) to learn from, in order of time."""
        return self.arrays["training"]

    def points(self, frame: int) -> SurfacePoints:
        """A frame's surface points."""
        rows = slice(*self.arrays["ends"][frame : frame + 2])
        return SurfacePoints(*(self.arrays[name][rows] for name in ("points", "normals", "weights", "seen_by")))

    def masks(self, frame: int) -> list[Mask | None]:
        """A frame's silhouettes (H, W), one a camera, None where it has no picture."""
        given, bits = self.arrays["given"][frame], self.arrays["bits"][frame]
        return [np.unpackbits(row[: camera.size[1]], axis=1, count=camera.size[0]).astype(bool) if there else None
                for there, row, camera in zip(given, bits, self.cameras, strict=True)]

    @property
    def around(self) -> float:
        """Median number of surface points in a frame."""
        return float(np.median(np.diff(self.arrays["ends"])))


def motion_of(name: str) -> str | None:
    """Which of the paper's motions a recording's name tells of."""
    return next((motion for motion, action in ACTIONS.items() if motion in name.lower() or action.lower() in name.lower()), None)


def cases(request: Request) -> list[Case]:
    """What was asked for, read already or read now. Raises a `ShadowPuppetError` where it cannot be used."""
    return [load(request, source) for source in sources(request)]


def sources(request: Request) -> list[Source]:
    """The recordings of a request: given, HumanEva's, drawn, or made, in this order of what is asked."""
    exact = bool(request.more.get("masks"))
    if request.recordings:
        return [Source(path.resolve().name, path, masks=exact) for path in request.recordings]
    if (data := request.more.get("humaneva")) is not None:
        return [_of_humaneva(request, Path(data), action) for action in ACTIONS.values()]
    if request.short:
        return [Source(spec.name, None, replace(spec, frames=SHORT["frames"], training_frames=SHORT["training"]), factor=SHORT["factor"])
                for spec in humaneva()]
    if request.more.get("drawn"):
        return [Source(spec.name, None, spec) for spec in humaneva()]
    return [Source(spec.name, _made(request, spec), masks=exact) for spec in humaneva()]


def load(request: Request, source: Source) -> Case:
    """A recording's case, from the folder `seen` of the request's, where it is read already."""
    folder = request.output / "seen" / f"{source.name}-{source.key}"
    if not (folder / "case.npz").exists():
        request.tell(f"reading {source.path or f'{source.name}: its silhouettes are drawn'}")
        folder.mkdir(parents=True, exist_ok=True)
        from papers.ni2008 import reading

        cameras, arrays = reading.read(source) if source.path is not None else reading.drawn(source)
        write_calibration(folder / "calibration.toml", cameras)
        part = folder / "part.npz"
        np.savez_compressed(part, **arrays)  # pyright: ignore[reportArgumentType]
        part.replace(folder / "case.npz")
    return opened(folder, source.name)


@lru_cache(maxsize=1)
def opened(folder: Path, name: str) -> Case:
    """A case that was read; the last one is kept: it is large, and runs of it follow one another."""
    with np.load(folder / "case.npz", allow_pickle=False) as file:
        return Case(name, folder, read_calibration(folder / "calibration.toml"), {key: file[key] for key in file.files})


def _made(request: Request, spec: Spec) -> Path:
    """A made recording's folder, rendered where it is missing."""
    folder = Path(request.more.get("made") or request.output / "made") / spec.name
    if not (folder / "truth.csv").exists() or not _complete(folder, spec):
        request.tell(f"making {folder}: some ten minutes, once (--drawn does without films)")
        synthesize(spec, folder)
    return folder


def _complete(folder: Path, spec: Spec) -> bool:
    return all((folder / "masks" / f"{view.name}.mkv").exists() for view in spec.views())


def _of_humaneva(request: Request, data: Path, action: str) -> Source:
    """A trial of HumanEva as a recording folder in the request's."""
    from papers.humaneva.trials import read_humaneva, write_humaneva

    found = read_humaneva(data, request.more.get("subject") or "S2", action)
    folder = request.output / "humaneva" / found.recording.name
    write_humaneva(found, folder)
    return Source(found.recording.name, folder)


def key_of(values: Any, *modules: str) -> str:
    """A short name, for a file, of plain values and of the source files that `modules` depend on."""
    return hashlib.sha256(json.dumps([values, digest(*modules)], sort_keys=True).encode()).hexdigest()[:16]
