"""What is tracked: recordings given, made ones, HumanEva's; or silhouettes that are drawn. Each is read once into a `Case` on the disk.

Decoding, silhouettes, surface points, the person's sizes and the poses that stand for the truth are the same for all methods, as in Ni 2008
(VII: "the system inputs are the same 3D reconstructions").
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import shadowpuppet
from papers.common.experiment import Request
from shadowpuppet.bodies import make_body
from shadowpuppet.body import Body
from shadowpuppet.camera import Camera
from shadowpuppet.errors import RecordingError
from shadowpuppet.geometry import Array
from shadowpuppet.inverse_kinematics import fit_poses
from shadowpuppet.io.calibration import read_calibration, write_calibration
from shadowpuppet.io.joints import read_joints
from shadowpuppet.io.motion_files import read_motion
from shadowpuppet.io.recording import read_recording
from shadowpuppet.masks import Mask
from shadowpuppet.measuring import measure, spread_of
from shadowpuppet.motion import JointTable
from shadowpuppet.options import make_options
from shadowpuppet.rig import follow, open_rig
from shadowpuppet.rig_look import check_rig, look_at_rig
from shadowpuppet.settings import make_multiview_settings
from shadowpuppet.synthetic import Spec, humaneva, synthesize
from shadowpuppet.visual_hull import SurfacePoints, VisualHull
from shadowpuppet.whole_sizes import sizes_kind

BODY = "cylinders"
"""The paper's body (II)."""
ACTIONS = {"walking": "Walking", "jogging": "Jog", "boxing": "Box"}
"""The paper's motions, and what HumanEva calls them."""
OPENING, OPENED = 2.0, 24
"""The first seconds in which the person is measured, and how many frames of them are taken."""
SHORT = {"factor": 0.25, "frames": 12, "training": 60}
"""The short version: pictures of this share of the size, so many frames to track and to learn from."""
FEW = 5
"""Frames in which the person is measured then."""


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
    def digest(self) -> str:
        """Of all that what is read of it depends on: its files, and the programs that read them."""
        parts: list[Any] = [self.name, str(self.spec), self.masks, self.factor, _program()]
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


class _Seen(NamedTuple):
    """One set of silhouettes."""

    time: float
    masks: list[Mask | None]


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
    folder = request.output / "seen" / f"{source.name}-{source.digest}"
    if not (folder / "case.npz").exists():
        request.tell(f"reading {source.path or f'{source.name}: its silhouettes are drawn'}")
        folder.mkdir(parents=True, exist_ok=True)
        cameras, arrays = _read(source) if source.path is not None else _drawn(source)
        write_calibration(folder / "calibration.toml", cameras)
        part = folder / "part.npz"
        np.savez_compressed(part, **arrays)  # pyright: ignore[reportArgumentType]
        part.replace(folder / "case.npz")
    return opened(folder, source.name)


def opened(folder: Path, name: str) -> Case:
    """A case that was read."""
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
    from shadowpuppet.io.humaneva import read_humaneva, write_humaneva

    found = read_humaneva(data, request.more.get("subject") or "S2", action)
    folder = request.output / "humaneva" / found.recording.name
    write_humaneva(found, folder)
    return Source(found.recording.name, folder)


# Reading -----------------------------------------------------------------------------------------------------------------


def _read(source: Source) -> tuple[tuple[Camera, ...], dict[str, NDArray[Any]]]:
    """A recording's cameras and arrays, as `shadowpuppet track` would see it."""
    assert source.path is not None
    recording, options = read_recording(source.path), make_options({"preset": "ni2008", "masks": source.masks})
    for what, path in (("truth", recording.truth), ("training motion", recording.training)):
        if path is None:
            raise RecordingError(f"{source.path}: found no {what}, which the experiments of Ni 2008 need: truth.csv and training.csv")
    assert recording.truth is not None
    assert recording.training is not None
    rig = open_rig(source.path, options)
    prepared = look_at_rig(rig, options)
    check_rig(prepared)
    sets = follow(rig, prepared.silhouettes, ready=source.masks)
    seen = (_Seen(each.time, list(each.masks)) for each in sets)
    return rig.cameras, _arrays(rig.cameras, rig.rate, seen, read_joints(recording.truth), read_motion(recording.training), OPENED)


def _drawn(source: Source) -> tuple[tuple[Camera, ...], dict[str, NDArray[Any]]]:
    """A spec's motion by the anatomical body, whose silhouettes are drawn: seconds in place of minutes, and no model is tracked with its
    own shape."""
    from shadowpuppet.rasterize import Picture
    from shadowpuppet.synthetic.mannequin import JOINTS
    from shadowpuppet.synthetic.recording import perform

    spec = source.spec
    assert spec is not None
    for_motion, for_training = np.random.default_rng(spec.seed).spawn(2)
    tables = []
    for chance, frames in ((for_motion, spec.frames), (for_training, spec.training_frames)):
        times, figure = perform(replace(spec, frames=frames), chance)
        tables.append(JointTable(times, JOINTS, figure.joints))
    film = fit_poses(tables[0], "anatomical")
    again = fit_poses(tables[1], "anatomical", film.sizes)
    cameras = tuple(_smaller(view.camera(), source.factor) for view in spec.views())
    pictures = [Picture(film.body, camera, camera.T_camera_world) for camera in cameras]
    seen = (_Seen(float(time), [picture.mask(pose) for picture in pictures]) for time, pose in zip(film.times, film.poses))
    truth, training = (JointTable(fit.times, fit.body.landmark_names, fit.body.points(fit.poses)) for fit in (film, again))
    return cameras, _arrays(cameras, spec.rate, seen, truth, training, OPENED if source.factor == 1 else FEW)


def _smaller(camera: Camera, factor: float) -> Camera:
    return camera if factor == 1 else camera.resized((round(camera.size[0] * factor), round(camera.size[1] * factor)))


def _arrays(cameras: tuple[Camera, ...], rate: float, seen: Iterator[_Seen], truth: JointTable, training: JointTable,
            measured: int) -> dict[str, Any]:
    """All that a case keeps, of sets of silhouettes; frames after the truth's last are left out. `measured`: frames for the sizes."""
    hull, times, bits, given, surface = VisualHull(cameras), [], [], [], list[SurfacePoints]()
    for each in seen:
        if each.time > truth.times[-1] + 0.5 / rate:
            break
        times.append(each.time)
        given.append([mask is not None for mask in each.masks])
        bits.append([np.packbits(np.zeros(camera.size[::-1], bool) if mask is None else mask, axis=1)
                     for mask, camera in zip(each.masks, cameras, strict=True)])
        surface.append(hull.points(each.masks))
    learnt = fit_poses(training, BODY, source="training")
    known = learnt.poses[np.isfinite(learnt.poses).all(1)]
    sizes = _measured(cameras, np.array(times), bits, surface, learnt.sizes, known, measured)
    chosen = np.abs(truth.times[:, None] - np.array(times)).argmin(0)
    true = JointTable(np.array(times), truth.names, truth.positions[chosen])
    return {
        "times": np.array(times), "rate": np.array(rate), "bits": _stacked(bits), "given": np.array(given),
        "ends": np.cumsum([0, *(len(each.points) for each in surface)]),
        "points": np.concatenate([each.points for each in surface]), "normals": np.concatenate([each.normals for each in surface]),
        "weights": np.concatenate([each.weights for each in surface]), "seen_by": np.concatenate([each.cameras for each in surface]),
        "sizes": sizes.to_array(), "joint_names": np.array(truth.names), "truth": true.positions,
        "true_poses": fit_poses(true, BODY, sizes, source="truth").poses, "training": fit_poses(training, BODY, sizes).poses,
    }  # fmt: skip


def _stacked(bits: list[list[NDArray[np.uint8]]]) -> NDArray[np.uint8]:
    """Packed masks (T, C, H, W / 8), of cameras whose pictures differ in size those of the largest."""
    height, width = (max(row.shape[axis] for row in bits[0]) for axis in (0, 1))
    out = np.zeros((len(bits), len(bits[0]), height, width), np.uint8)
    for t, rows in enumerate(bits):
        for c, row in enumerate(rows):
            out[t, c, : row.shape[0], : row.shape[1]] = row
    return out


def _measured(cameras: tuple[Camera, ...], times: Array, bits: list[list[NDArray[np.uint8]]], surface: list[SurfacePoints], sizes: Any,
              library: Array, frames: int) -> Any:
    """The person's sizes, bones as in the training motion, widths as the first seconds' silhouettes have them."""
    last = int(np.searchsorted(times, times[0] + OPENING))
    chosen = np.unique(np.linspace(0, max(last - 1, 0), frames).astype(int))
    first = [(surface[n], [np.unpackbits(row, axis=1, count=camera.size[0]).astype(bool) for row, camera in zip(bits[n], cameras)])
             for n in chosen]
    settings = make_multiview_settings("ni2008")
    return measure(np.random.default_rng(0), partial(make_body, BODY), sizes, spread_of(sizes, shown=True), cameras, first, settings,
                   library).sizes


def _program() -> str:
    """What the programs are that read recordings and track: a digest of their text."""
    text = hashlib.sha256()
    package = Path(shadowpuppet.__file__).parent
    for path in [*sorted(package.rglob("*.py")), *sorted(Path(__file__).parent.glob("*.py"))]:
        if path.name in ("inputs.py", "tracks.py") or package in path.parents:
            text.update(path.read_bytes())
    return text.hexdigest()


def key_of(values: Any) -> str:
    """A short name of plain values, for a file."""
    return hashlib.sha256(json.dumps([values, _program()], sort_keys=True).encode()).hexdigest()[:16]
