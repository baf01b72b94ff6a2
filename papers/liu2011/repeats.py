"""The same film tracked many times: the paper's 100 repetitions, kept so that the next figure need not make them again."""

from __future__ import annotations

import contextlib
import hashlib
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

import shadowpuppet
from papers.common.experiment import Request
from papers.common.many import run_all
from papers.liu2011.material import Case
from shadowpuppet.camera import Camera
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array
from shadowpuppet.initialization import Guess
from shadowpuppet.io._files import reason
from shadowpuppet.settings import MonocularSettings
from shadowpuppet.threads import one_blas_thread
from shadowpuppet.tracking import MonocularTracker

METHODS = {"DRS": "deterministic", "SRS": "stratified"}
"""The two ways to resample that the paper compares."""
TOGETHER = 5
"""Runs of one job: a process reads the silhouettes once for all that it does."""
FAR, LOST = 0.3, 0.5
"""A joint this far off (m) is far; a drawn body that overlaps the silhouette by less is lost (as `metrics` and `tracking` have them)."""


class Job(NamedTuple):
    """Some runs of one film with one choice of settings."""

    masks: Path
    """Where the silhouettes are (`_write_masks`)."""
    camera: Camera
    guess: Guess
    settings: MonocularSettings
    seeds: tuple[int, ...]
    stride: int
    """Every so manieth frame is seen."""


@dataclass(frozen=True, eq=False)
class Runs:
    """R runs of T frames of a case."""

    case: Case
    settings: MonocularSettings
    poses: Array
    """Estimates, (R, T, D)."""
    costs: Array
    """Eq. 2 of them, pixels, (R, T): the paper's 2D error."""
    overlaps: Array
    """Intersection over union of the drawn body and the silhouette, (R, T)."""
    stride: int = 1

    @property
    def times(self) -> Array:
        """Seconds, (T,)."""
        return self.case.times[:: self.stride]

    def places(self, names: tuple[str, ...]) -> Array:
        """Where joints of the body are, (R, T, J, 3), metres, in the world."""
        body = self.case.picture.body
        points = self.case.picture.points_world(self.poses.reshape(-1, self.poses.shape[2]))
        return points[:, [body.landmark_names.index(name) for name in names]].reshape(*self.poses.shape[:2], len(names), 3)

    def errors(self, names: tuple[str, ...], truth: tuple[str, ...] = ()) -> Array:
        """3D errors (R, T, J), metres: the body's joints against the truth's of the same, or other, names."""
        return np.linalg.norm(self.places(names) - self.case.true_places(truth or names)[:: self.stride], axis=3)


def repeat(request: Request, case: Case, settings: MonocularSettings, stride: int = 1, runs: int | None = None) -> Runs:
    """A run for each seed, the same whatever the number of workers. Those that were made before are read back, if nothing has changed
    since that they depend on: silhouettes, sizes, settings, seeds, and the code."""
    seeds = tuple(request.seeds[:runs])
    kept = request.output / "runs" / f"{case.name}-{_key(case, settings, seeds, stride)}.npz"
    found = _read(kept)
    if found is None:
        masks = _write_masks(request.output / "runs", case)
        jobs = [Job(masks, case.camera, case.guess, settings, seeds[n : n + TOGETHER], stride) for n in range(0, len(seeds), TOGETHER)]
        done = run_all(f"{len(seeds)} runs, {settings.resampling}", follow, jobs, request.workers)
        found = {name: np.concatenate([each[name] for each in done]) for name in done[0]}
        _write(kept, found)
    return Runs(case, settings, **found, stride=stride)


def both(request: Request, case: Case) -> dict[str, Runs]:
    """The paper's comparison: the same filter with either resampling."""
    return {name: repeat(request, case, with_method(case.tracker, name)) for name in METHODS}


def with_method(settings: MonocularSettings, method: str, **changes: Any) -> MonocularSettings:
    """Settings with DRS or SRS; `changes` go into the settings of torso and arms alike."""
    torso, arm = replace(settings.torso, **changes), replace(settings.arm, **changes)
    return replace(settings, resampling=METHODS[method], torso=torso, arm=arm)


@one_blas_thread()
def follow(job: Job) -> dict[str, Array]:
    """Algorithm 2 as it is printed, from the first frame on: a person who is lost is not searched for, as `track` would."""
    masks = _read_masks(job.masks)[:: job.stride]
    tracker = MonocularTracker(job.guess.picture(job.camera, job.settings.body), job.settings)
    found: dict[str, list[Array]] = {"poses": [], "costs": [], "overlaps": []}
    for seed in job.seeds:
        rng = np.random.default_rng([2011, seed])
        states = [tracker.start(rng, masks[0])]
        for mask in masks[1:]:
            states.append(tracker.cycle(rng, states[-1], mask))
        found["poses"].append(np.array([state.pose for state in states]))
        found["costs"].append(np.array([state.cost for state in states]))
        found["overlaps"].append(np.array([state.overlap for state in states]))
    return {name: np.array(values) for name, values in found.items()}


def _key(case: Case, settings: MonocularSettings, seeds: tuple[int, ...], stride: int) -> str:
    """What tells runs from others."""
    guess = case.guess
    camera = [array.tolist() for array in (case.camera.matrix, case.camera.distortion, case.camera.T_camera_world)]
    told = (settings, seeds, stride, guess.sizes, guess.distance, guess.elevation, case.masks.shape, camera, case.camera.fisheye)
    return hashlib.sha256(repr(told).encode() + case.masks.tobytes() + _code()).hexdigest()[:16]


@lru_cache(maxsize=1)
def _code() -> bytes:
    """A digest of the package's code."""
    folder = Path(str(shadowpuppet.__file__)).parent
    return hashlib.sha256(b"".join(path.read_bytes() for path in sorted(folder.rglob("*.py")))).digest()


def _write_masks(folder: Path, case: Case) -> Path:
    path = folder / f"{case.name}-{hashlib.sha256(case.masks.tobytes()).hexdigest()[:16]}-masks.npz"
    if not path.exists():
        _write(path, {"bits": np.packbits(case.masks), "shape": np.array(case.masks.shape)})
    return path


@lru_cache(maxsize=2)
def _read_masks(path: Path) -> NDArray[np.bool_]:
    with np.load(path, allow_pickle=False) as kept:
        shape = kept["shape"]
        return np.unpackbits(kept["bits"], count=int(shape.prod())).astype(bool).reshape(shape)


def _write(path: Path, arrays: dict[str, Any]) -> None:
    part = path.with_name(f"{path.stem}.part.npz")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        np.savez(part, **arrays)
        part.replace(path)
    except OSError as error:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)
        raise ShadowPuppetError(f"{path}: cannot be written ({reason(error)})") from None


def _read(path: Path) -> dict[str, Array] | None:
    """What was kept; None where there is nothing that can be read."""
    try:
        with np.load(path, allow_pickle=False) as kept:
            return {name: kept[name] for name in ("poses", "costs", "overlaps")}
    except (OSError, ValueError, KeyError, EOFError, BadZipFile):
        return None
