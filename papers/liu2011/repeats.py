"""The same film tracked many times, as a batch: the paper's 100 repetitions, kept so that the next figure need not make them again."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from papers.common.experiment import Request
from papers.common.many import shown_progress
from papers.common.sources import digest
from papers.liu2011.material import Case, seen
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array
from shadowpuppet.io.run_writer import write_metrics
from shadowpuppet.pipeline.batch import BatchListener, make_grid, run_batch
from shadowpuppet.pipeline.options import Options, plain_options
from shadowpuppet.pipeline.progress import Listener
from shadowpuppet.threads import one_blas_thread
from shadowpuppet.tracking.monocular.settings import MonocularSettings
from shadowpuppet.tracking.monocular.tracker import MonocularTracker

METHODS = {"DRS": "deterministic", "SRS": "stratified"}
"""The two ways to resample that the paper compares."""
FAR, LOST = 0.3, 0.5
"""A joint this far off (m) is far; a drawn body that overlaps the silhouette by less is lost (as `metrics` and `tracking` have them)."""
ESTIMATES = "estimates.npz"
"""In a run's folder: what `estimates` gives."""


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
    every: int = 1
    """Of so many frames one was seen."""

    @property
    def times(self) -> Array:
        """Seconds, (T,)."""
        return self.case.times[:: self.every]

    def places(self, names: tuple[str, ...]) -> Array:
        """Where joints of the body are, (R, T, J, 3), metres, in the world."""
        body = self.case.picture.body
        points = self.case.picture.points_world(self.poses.reshape(-1, self.poses.shape[2]))
        return points[:, [body.landmark_names.index(name) for name in names]].reshape(*self.poses.shape[:2], len(names), 3)

    def errors(self, names: tuple[str, ...], truth: tuple[str, ...] = ()) -> Array:
        """3D errors (R, T, J), metres: the body's joints against the truth's of the same, or other, names."""
        return np.linalg.norm(self.places(names) - self.case.true_places(truth or names)[:: self.every], axis=3)


def repeat(request: Request, case: Case, settings: MonocularSettings, every: int = 1, runs: int | None = None) -> Runs:
    """A run for each seed, the same whatever the number of workers; those that are there already, made by the same code, are taken."""
    options, seeds = replace(case.options, tracker=settings, every=every), request.seeds[:runs]
    code = digest(__name__)[:8]
    folder = request.output / "runs" / f"{case.name}-{code}"
    workers = request.workers if request.workers > 1 else 0
    bar = _Bar(f"{len(seeds)} runs, {settings.resampling}")
    batch = run_batch([case.folder], folder, make_grid(plain_options(options)), seeds, workers=workers, listener=bar, track=follow)
    for run in batch.failed:
        raise ShadowPuppetError(run.message)
    found = [_read(run.folder / ESTIMATES) for run in batch.runs if run.folder is not None]
    return Runs(case, settings, **{name: np.array([each[name] for each in found]) for name in found[0]}, every=every)


def both(request: Request, case: Case) -> dict[str, Runs]:
    """The paper's comparison: the same filter with either resampling."""
    return {name: repeat(request, case, with_method(case.tracker, name)) for name in METHODS}


def with_method(settings: MonocularSettings, method: str, **changes: Any) -> MonocularSettings:
    """Settings with DRS or SRS; `changes` go into the settings of torso and arms alike."""
    torso, arm = replace(settings.torso, **changes), replace(settings.arm, **changes)
    return replace(settings, resampling=METHODS[method], torso=torso, arm=arm)


@one_blas_thread()
def follow(recording: str, folder: Path, options: Options, listener: Listener | None = None, _: object = None) -> None:
    """In place of `shadowpuppet.track_recording`: one run, from sizes that are measured once for all seeds, all its estimates kept."""
    case, listener = seen(Path(recording), options), listener or Listener()
    listener.begin("tracking", len(case.masks))
    found = estimates(case, options.tracker, options.seed, options.every)
    folder.mkdir(parents=True)
    np.savez(folder / ESTIMATES, allow_pickle=False, **found)
    write_metrics(folder, {"cost_px": found["costs"].mean(), "overlap": found["overlaps"].mean()})


def estimates(case: Case, settings: MonocularSettings, seed: int, every: int = 1) -> dict[str, Array]:
    """`poses`, `costs` and `overlaps` (as in `Runs`, of one) by Algorithm 2 as it is printed, from the first frame on: a person who is lost
    is not searched for, as `track` would, and what is estimated then counts."""
    tracker, rng, masks = MonocularTracker(case.picture, settings), np.random.default_rng([2011, seed]), case.masks[::every]
    states = [tracker.start(rng, masks[0])]
    for mask in masks[1:]:
        states.append(tracker.cycle(rng, states[-1], mask))
    return {"poses": np.array([state.pose for state in states]), "costs": np.array([state.cost for state in states]),
            "overlaps": np.array([state.overlap for state in states])}


class _Bar(BatchListener):
    """A bar while a batch goes on."""

    def __init__(self, what: str) -> None:
        self._what, self._progress = what, shown_progress()

    def begin(self, total: int, before: int) -> None:
        self._progress.start()
        self._bar = self._progress.add_task(self._what, total=total, completed=before)

    def ended(self, task: object, outcome: object, again: bool) -> None:
        self._progress.advance(self._bar, not again)
        if self._progress.finished:
            self._progress.stop()


def _read(path: Path) -> dict[str, Array]:
    try:
        with np.load(path, allow_pickle=False) as kept:
            return {name: kept[name] for name in ("poses", "costs", "overlaps")}
    except (OSError, ValueError, KeyError, EOFError, BadZipFile):
        raise ShadowPuppetError(f"{path}: cannot be read; remove its folder, and the run is made again") from None
