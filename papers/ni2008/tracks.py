"""The three methods of Ni 2008 (VII) over a case, frame by frame; every run stays in a file, so that figures share them.

The loop is the paper's: search for the first pose, then `MultiviewTracker.cycle` alone. What `shadowpuppet track` does beyond it, finding
somebody again who was lost, is left out: whether a method loses the person is what is asked.
"""

from __future__ import annotations

import json
import time
from collections.abc import Iterable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from papers.common.experiment import Request
from papers.common.many import run_all
from papers.ni2008.inputs import BODY, Case, key_of, opened
from shadowpuppet.geometry import Array
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.motion.prior.settings import PriorSettings
from shadowpuppet.motion.prior.training import modelled
from shadowpuppet.motion.prior.vqpca import PriorFit, fit_prior
from shadowpuppet.tracking.multiview.observation import MultiviewObservation
from shadowpuppet.tracking.multiview.settings import make_multiview_settings
from shadowpuppet.tracking.multiview.tracker import MultiviewState, MultiviewTracker
from shadowpuppet.tracking.particle_filter import Particles

METHODS = ("shadowpuppet.tracking.multiview.tracker", "shadowpuppet.motion.prior.vqpca", "shadowpuppet.motion.prior.training")
"""What runs depend on beside this file and the case, whose name has a key of its own: a change elsewhere leaves them as they are."""
REGIONS, DIMENSIONS = 20, 3
"""M and m of Table II's hybrid."""
START_ROTATION, START_TRANSLATION = 0.05, 0.01
"""Noise (rad, m) of the pose that the search finds in the first frame: a method without chance has distinct runs then."""


@dataclass(frozen=True)
class Way:
    """A method with its settings."""

    name: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    """Beside the preset's, `ni2008`."""
    regions: int = REGIONS
    """M of the motion prior, where there is one."""
    from_truth: bool = False
    """Whether every frame begins at the true pose: no tracker, but what the method makes of the best start."""

    @property
    def plain(self) -> dict[str, Any]:
        """For files."""
        return {"settings": dict(self.settings), "regions": self.regions} | ({"from_truth": True} if self.from_truth else {})


HYBRID = Way("hybrid")
ONE = {"method": "image_force", "velocity": 0.0}
ICP = {"modulated": False, "rho": "none", "iterations": 160, "balance": 0.0}
"""Forces as those of ref. [11]: no normals, no bound. Its dynamics, too, pass a force on along the limbs, which here are the sums over what
hangs on a joint; with these left out each joint feels its own part alone. Iterations: in Table II the image force's frame takes an eighth
to a fifth of the hybrid's, with a fortieth of the particles."""
IMAGE_FORCES = (
    Way("image force, ICP", {**ONE, "forces": ICP}),
    *(Way(f"image force, {n} iterations", {**ONE, "forces": {"iterations": n}}) for n in (12, 40)),
    Way("image force, balanced", ONE),
)
"""Readings of "an image force/ICP based method similar to [11]" (VII): plain ICP, or the paper's own forces, with 12 or 40 iterations or
until they balance."""
ALONE = Way("image force, each joint alone", {**ONE, "forces": ICP | {"hierarchical": False}})
FORCES_FROM_TRUTH = Way("forces from the true pose", ONE, from_truth=True)
"""What the forces make of true poses: where they leave them, body and forces are right."""


def particle_filter(particles: int = 1000, sigma: float = 0.035) -> Way:
    """The plain one: noise in all degrees of freedom, `sigma` rad in angles, neither prior nor refinement. The paper does not say how much
    noise: `choices` does."""
    noise = {"sigma_rotation": sigma, "sigma_heading": sigma, "sigma_translation": 0.3 * sigma}
    return Way("particle filter", {"method": "particle_filter", "particles": particles, **noise})


CYCLES, COOLING = 10, 0.7
"""Of the annealed filter (Deutscher et al. 2000, the paper's ref. [14], has ten layers). Ten times a tenth of the particles are as many
weighings as the plain filter's."""


def annealed(particles: int = 1000, sigma: float = 0.1) -> Way:
    """The same with the particles spent over cycles of less and less noise; `sigma` of the first."""
    settings = particle_filter(particles, sigma).settings
    return Way("particle filter, annealed", {**settings, "particles": particles // CYCLES, "cycles": CYCLES, "cooling": COOLING})


def hybrid(regions: int = REGIONS, particles: int = 40) -> Way:
    """The paper's method with another M or N."""
    return Way("hybrid", {} if particles == 40 else {"particles": particles}, regions)


class Track(NamedTuple):
    """A run over a case."""

    poses: Array
    """The estimates, of shape (T, D)."""
    seconds: Array
    """Of the processor for each frame, of shape (T,); silhouettes, surface points and the search are not in them."""
    overlap: Array
    """Of the drawn body and the silhouettes, of shape (T,)."""

    def joints(self, case: Case) -> JointTable:
        """Where the body's joints are."""
        return JointTable(case.times, case.body.landmark_names, case.body.points(self.poses))

    @property
    def pace(self) -> float:
        """Median seconds a frame."""
        return float(np.median(self.seconds[1:]))


class Job(NamedTuple):
    """A run that is to be done."""

    folder: Path
    """Of the case."""
    name: str
    way: Way
    seed: int
    file: Path


def tracks(request: Request, cases: Iterable[Case], ways: Sequence[Way],
           seeds: Sequence[int] | None = None) -> dict[tuple[str, str], list[Track]]:
    """Runs of every case, way and seed, by case and way, in the order of the seeds; those that are not there yet are done now."""
    wanted = list(request.seeds) if seeds is None else list(seeds)
    jobs = {(case.name, _key(way)): [_job(request, case, way, seed) for seed in wanted] for case in cases for way in ways}
    missing = [job for some in jobs.values() for job in some if not job.file.exists()]
    if missing:
        run_all("runs", run, missing, request.workers)
    return {key: [read_track(job.file) for job in some] for key, some in jobs.items()}


def of(found: Mapping[tuple[str, str], list[Track]], case: Case, way: Way) -> list[Track]:
    """Those of a case and way."""
    return found[case.name, _key(way)]


def run(job: Job) -> None:
    """Track, and write the file."""
    track = follow(opened(job.folder, job.name), job.way, job.seed)
    job.file.parent.mkdir(parents=True, exist_ok=True)
    part = job.file.with_name(f"{job.file.stem}.part.npz")
    np.savez_compressed(part, **track._asdict())
    part.replace(job.file)


def read_track(file: Path) -> Track:
    """A run that was written."""
    with np.load(file, allow_pickle=False) as arrays:
        return Track(**{name: arrays[name] for name in Track._fields})


def follow(case: Case, way: Way, seed: int) -> Track:
    """The method over all frames of a case."""
    settings = make_multiview_settings("ni2008", way.settings)
    prior = learn(case, way.regions, seed).prior if settings.method == "hybrid" else None
    tracker = MultiviewTracker(case.body, case.cameras, settings, prior, case.training)
    rng, state, poses, seconds, overlap = *begun(case, seed), [], [], []
    for frame in range(case.frames):
        points, masks = case.points(frame), case.masks(frame)
        start = time.process_time()
        if frame == 0:
            state = disturbed(rng, tracker, state)
        elif len(points.points):
            state = placed(state, case.true_poses[frame]) if way.from_truth else state
            state = tracker.cycle(rng, state, MultiviewObservation(tracker.views, points, masks))
        seconds.append(time.process_time() - start)
        poses.append(state.pose)
        overlap.append(state.overlap)
    return Track(np.array(poses), np.array(seconds), np.array(overlap))


def begun(case: Case, seed: int) -> tuple[np.random.Generator, MultiviewState]:
    """The state that the search finds in the first frame, the same for all methods, and the random numbers that follow it. The search takes
    as long as ten frames: a case keeps what it found, by seed."""
    kept = BEGUN.setdefault(case, {})
    if seed not in kept:
        rng = np.random.default_rng([seed, 1])
        tracker = MultiviewTracker(case.body, case.cameras, make_multiview_settings("ni2008"), None, case.training)
        kept[seed] = rng, tracker.start(rng, case.points(0), case.masks(0))
    return deepcopy(kept[seed])


BEGUN = WeakKeyDictionary[Case, dict[int, tuple[np.random.Generator, MultiviewState]]]()
"""What `begun` found, as long as a case is there."""


def disturbed(rng: np.random.Generator, tracker: MultiviewTracker, state: MultiviewState) -> MultiviewState:
    """The first state with all poses moved by one and the same noise."""
    skeleton = tracker.body.skeleton
    sigma = np.array([START_TRANSLATION if dof.kind == "translation" else START_ROTATION for dof in skeleton.dofs])
    noise, particles = sigma * rng.standard_normal(len(sigma)), state.particles
    return state._replace(pose=skeleton.clamp(state.pose[None] + noise)[0],
                          particles=particles._replace(poses=skeleton.clamp(particles.poses + noise)))


def placed(state: MultiviewState, pose: Array) -> MultiviewState:
    """The state with one particle, at a pose (D,); as it is where the pose is not known."""
    if not np.isfinite(pose).all():
        return state
    return state._replace(pose=pose, particles=Particles(pose[None], np.zeros(1), np.zeros(1)))


def learn(case: Case, regions: int, seed: int) -> PriorFit:
    """The motion prior of a case's training poses."""
    names = modelled(case.body.skeleton)
    poses = case.training[:, case.body.skeleton.dof_indices(names)]
    return fit_prior(np.random.default_rng([seed, 0]), [poses], PriorSettings(regions=regions, dimensions=DIMENSIONS), names=names,
                     rate=case.rate)


def most_regions(case: Case) -> int:
    """How many regions the training poses allow."""
    return len(np.unique(case.training, axis=0))


def _key(way: Way) -> str:
    return json.dumps(way.plain, sort_keys=True)


def _job(request: Request, case: Case, way: Way, seed: int) -> Job:
    key = key_of([case.path.name, way.plain, seed, BODY, Path(__file__).read_text("utf-8")], *METHODS)
    file = request.output / "runs" / case.name / f"{key}.npz"
    return Job(case.path, case.name, way, seed, file)
