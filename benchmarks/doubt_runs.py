"""Runs for `calibrate_doubt.py`: recordings tracked with faults in their silhouettes, and the components of doubt beside the errors."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import combinations, islice
from pathlib import Path

import numpy as np
import postures
import whole_people
from cases import Case
from keypoints import with_keypoints
from numpy.typing import NDArray
from postures import HERE as POSTURES
from proving_ground import HERE as GROUND
from proving_ground import made as made_ground
from spoiled import SPOILS
from whole_people import HERE as WHOLE

from shadowpuppet.body.skeleton import Skeleton
from shadowpuppet.camera.mask import Mask, Seen
from shadowpuppet.evaluation.joint_angles import wrapped
from shadowpuppet.geometry import Array, unit
from shadowpuppet.io.motion.table import read_joints
from shadowpuppet.motion.motion import BLANK, JointTable, Mode, MotionBuilder, MotionFrame
from shadowpuppet.motion.synchronization import at_times
from shadowpuppet.pipeline.findings.rig import survey_rig
from shadowpuppet.pipeline.options import Options, make_options
from shadowpuppet.pipeline.person_rig import fit_multiview
from shadowpuppet.pipeline.rig import open_rig, read_frames
from shadowpuppet.pipeline.silhouettes import segments_of
from shadowpuppet.synthetic import proving_rings, synthesize
from shadowpuppet.tracking.doubt.doubt import Points, pose_deviations, state_doubt
from shadowpuppet.tracking.doubt.monocular import MonocularDoubt
from shadowpuppet.tracking.doubt.multiview import MultiviewDoubt, kind_of
from shadowpuppet.tracking.doubt.variance import ModeWeights, variance_model
from shadowpuppet.tracking.monocular.tracker import MonocularTracker
from shadowpuppet.tracking.smoothing.deviations import moving_deviations
from shadowpuppet.tracking.smoothing.smoothing import MotionSmoother

RINGS, RING_SECONDS, RING_RATE = GROUND.parent / "rings_short", 2.0, 30.0
BUILD = GROUND.parent / "doubt"
SECONDS = 2.0
"""Length of a fault with a beginning and an end."""
Fault = Callable[[np.random.Generator, list[Mask], float], list[Mask]]
"""Masks of a film, one (H, W) a frame, and its rate, to spoiled ones."""


def _all(name: str) -> Fault:
    spoil = SPOILS[name]

    def spoiled(rng: np.random.Generator, masks: list[Mask], rate: float) -> list[Mask]:
        size = float(np.sqrt(np.median([mask.sum() for mask in masks])))
        return [spoil(rng, mask, size) for mask in masks]

    return spoiled


def _during(change: Callable[[Mask, list[Mask], float], Mask]) -> Fault:
    """A fault from the film's third on; `change`: of a mask, all masks and the share of the fault's time that has passed."""

    def spoiled(rng: np.random.Generator, masks: list[Mask], rate: float) -> list[Mask]:
        first, count = len(masks) // 3, max(1, min(round(SECONDS * rate), len(masks) // 3))
        return [change(mask, masks, (n - first) / count) if first <= n < first + count else mask for n, mask in enumerate(masks)]

    return spoiled


def _second(mask: Mask, masks: list[Mask], passed: float) -> Mask:
    """A second person, the first's silhouette at another time, passes from right to left."""
    other, width = masks[round(passed * (len(masks) - 1)) // 2], mask.shape[1]
    shift = round(width * (0.9 - 1.7 * passed))
    moved = np.zeros_like(other)
    if shift >= 0:
        moved[:, shift:] = other[:, : width - shift]
    else:
        moved[:, :shift] = other[:, -shift:]
    return mask | moved


def _obstacle(mask: Mask, masks: list[Mask], passed: float) -> Mask:
    """The left 30 % of the person are hidden."""
    out, columns = mask.copy(), np.flatnonzero(mask.any(0))
    if len(columns):
        out[:, : int(columns[0] + 0.3 * (columns[-1] - columns[0]))] = False
    return out


def _thing(mask: Mask, masks: list[Mask], passed: float) -> Mask:
    """Something beside the person belongs to the silhouette."""
    out, (height, width) = mask.copy(), mask.shape
    out[int(0.3 * height) : int(0.8 * height), int(0.6 * width) : int(0.75 * width)] = True
    return out


FAULTS: dict[str, Fault] = {
    "clean": lambda rng, masks, rate: masks,
    **{name: _all(name) for name in ("grown", "eroded", "holes", "flicker")},
    "frozen": _during(lambda mask, masks, passed: masks[len(masks) // 3]),
    "second person": _during(_second),
    "obstacle": _during(_obstacle),
    "thing": _during(_thing),
}
OTHER_MOMENTS = ("frozen", "second person")
"""Faults that put silhouettes of other moments into a frame, which its colours do not fit."""


@dataclass(frozen=True, eq=False)
class Tracked:
    """A run's components of doubt and errors, along the evidence's axes."""

    recording: str
    fault: str
    joints: tuple[str, ...]
    components: dict[str, Array]
    """Of shape (T, L, 3), metres."""
    errors: Array
    """Truth less estimate (T, L, 3), metres; not a number where there is none."""
    modes: Array
    """Of every place of an arm in every frame, the estimate and its modes (N, 2): the stated weight, and 1 if the truth is nearest."""
    dofs: tuple[str, ...] = ()
    """Names of the D degrees of freedom."""
    pose_errors: Array = field(default_factory=lambda: np.empty((0, 0)))
    """True poses less the estimates (T, D), rad or m; not a number where there is none."""
    pose_sd: Array = field(default_factory=lambda: np.empty((0, 0)))
    """Standard deviations (T, D) of the degrees of freedom before calibration, rad or m."""
    statuses: NDArray[np.str_] = field(default_factory=lambda: np.empty(0, "<U9"))
    """The frames' (T,)."""
    weighting: ModeWeights | None = None
    """Which weights `modes` states."""


def mode_rows(modes: Sequence[Mode], points: Array, truth: Array, names: Sequence[str]) -> list[tuple[float, float]]:
    """Rows of `Tracked.modes` of a frame with landmarks `points` (L, 3), all in the world, by true elbow and wrist, `truth` (L, 3). Arms
    with a single place have none."""
    found = []
    for limb in dict.fromkeys(mode.limb for mode in modes):
        own = [mode for mode in modes if mode.limb == limb]
        ends = [names.index(limb.replace("arm", joint)) for joint in ("elbow", "wrist")]
        places = np.stack([points[ends], *(np.where(np.isfinite(mode.joints[ends]), mode.joints[ends], points[ends]) for mode in own)])
        far = np.linalg.norm(places - truth[ends], axis=2).max(1)
        if np.isfinite(far).all():
            weights = [1 - sum(mode.weight for mode in own), *(mode.weight for mode in own)]
            found += [(weight, float(n == far.argmin())) for n, weight in enumerate(weights)]
    return found


def true_poses(skeleton: Skeleton, points: Points, truth: Array) -> Array:
    """Poses (T, D) whose landmarks are nearest to the true ones (T, L, 3), by damped Gauss-Newton steps within the joints' limits, each
    frame from the one before. `points`: from poses to landmarks. Landmarks without truth do not count."""
    (low, high), pose, found = skeleton.limits, np.zeros(len(skeleton.dofs)), []
    for n, target in enumerate(truth):
        known = np.isfinite(target)
        for _ in range(FIRST_FITS if n == 0 else FITS):
            moved = points(np.concatenate([pose[None], pose + FIT_STEP * np.eye(len(pose))]))[:, known]
            J = (moved[1:] - moved[0]) / FIT_STEP
            step = np.linalg.solve(J @ J.T + FIT_DAMPING * np.eye(len(pose)), J @ (target[known] - moved[0]))
            pose = np.clip(pose + np.clip(step, -0.5, 0.5), low, high)
        found.append(pose)
    return np.array(found)


FIRST_FITS, FITS, FIT_STEP, FIT_DAMPING = 60, 8, 1e-4, 1e-4
"""Steps of the first frame and of every other, step of the derivatives (rad or m), and damping (m^2)."""


def track_monocular(path: Path, kind: str = "monocular") -> Iterator[Tracked]:
    """A recording of one camera with every fault, or beside keypoints with some of them; a `whole` kind: tracked as a whole body."""
    if kind in ("monocular", "monocular_whole"):
        yield from followed(path, kind, FAULTS)
        return
    for detector, faults in (("mediapipe", ("clean", *BESIDE)), ("poor", ("clean",))):
        for run in followed(with_keypoints(path, detector), kind, {name: FAULTS[name] for name in faults}):
            yield replace(run, recording=path.name, fault=run.fault if detector == "mediapipe" else f"{detector}, {run.fault}")


def followed(path: Path, kind: str, faults: Mapping[str, Fault]) -> Iterator[Tracked]:
    """A recording of one camera tracked with some faults."""
    case, options = Case.read(path), make_options({"body": "anatomical"} if kind.endswith("whole") else {})
    picture = case.person(options, np.random.default_rng(0)).picture(case.camera, options.tracker.body)
    skeleton, names, rate = picture.body.skeleton, picture.body.landmark_names, 1 / float(np.median(np.diff(case.times)))
    turn, truth = case.camera.T_camera_world[:3, :3], _places(case.truth, names)
    right = true_poses(skeleton, picture.points_world, truth)
    model, angles = variance_model(kind), np.array([dof.kind == "rotation" for dof in skeleton.dofs])
    for n, (fault, spoil) in enumerate(faults.items()):
        masks, rng = spoil(np.random.default_rng(n), case.masks, rate), np.random.default_rng(1)
        codes = [None] * len(masks) if fault in OTHER_MOMENTS else case.codes
        tracker = MonocularTracker(picture, options.tracker)
        doubt, state, before, rows, poses, deviations, statuses = MonocularDoubt(tracker), None, None, [], [], [], list[str]()
        modes = list[tuple[float, float]]()
        for n, (seconds, mask, seen, keypoints) in enumerate(zip(case.times.tolist(), masks, codes, case.keypoints)):
            state = (tracker.start(rng, mask, keypoints=keypoints) if state is None
                     else tracker.step(rng, state, mask, codes=seen, keypoints=keypoints))
            found, before = doubt.evidence(state, mask, seconds, before)
            rows.append(found.components)
            poses.append(np.full_like(state.pose, np.nan) if state.status in BLANK else state.pose)
            deviations.append(pose_deviations(skeleton, picture.points, state.pose, model.sd(names, found.components)))
            statuses.append(state.status)
            modes += mode_rows(found.modes, picture.points_world(poses[-1][None])[0], truth[n], names)
        errors = (truth[: len(poses)] - picture.points_world(np.array(poses))) @ turn.T
        off = right[: len(poses)] - np.array(poses)
        off[:, angles] = wrapped(off[:, angles])
        every = max(rows, key=len)
        errors[[len(row) < len(every) for row in rows]] = np.nan  # no keypoints in this frame: another kind of doubt
        components = {name: np.array([row.get(name, np.zeros_like(every[name])) for row in rows]) for name in every}
        yield Tracked(path.name, fault, names, components, errors, np.array(modes).reshape(-1, 2), tuple(dof.name for dof in skeleton.dofs),
                      off, np.array(deviations), np.array(statuses), model.modes)


SIGHTINGS = {"keypoints": (("mediapipe", 0), ("mediapipe", 2), ("poor", 0), ("poor", 2)), "keypoints_one": (("mediapipe", 1), ("poor", 1)),
             "both": (("mediapipe", 0), ("poor", 0))}  # fmt: skip
"""For each kind of doubt detectors, and the number of cameras; 0: all."""
BESIDE = ("second person", "obstacle", "thing", "grown")
"""Faults of silhouettes that are tried beside keypoints."""
ONE_CAMERA = ("frozen", "obstacle", "thing", "late")
"""Faults that, of several cameras, only the first has."""
LATE = 5
"""Frames by which the camera is late."""


def track_multiview(path: Path, kind: str = "multiview") -> Iterator[Tracked]:
    """A recording of several cameras with every fault, or each of `SIGHTINGS` if keypoints are evidence. Errors are those of the smoothed
    motion, which is what a run's deviations are stated of: the backward pass keeps feet on the floor. So are components, where a run
    restates its deviations (`FittedPerson.limits`)."""
    late: Fault = lambda rng, masks, rate: [masks[max(n - LATE, 0)] for n in range(len(masks))]  # noqa: E731
    if kind in ("multiview", "pair"):
        yield from tracked_with(path, make_options({"evidence": "silhouettes"}), FAULTS | {"late": late})
    for detector, cameras in SIGHTINGS.get(kind, ()):
        known = with_keypoints(path, detector)
        options = {"evidence": "silhouettes,keypoints" if kind == "both" else "keypoints"}
        options |= {"camera": ",".join(across(known)[:cameras])} if cameras and path.parent != POSTURES else {}
        faults = {name: FAULTS[name] for name in ("clean", *(BESIDE if kind == "both" and detector == "mediapipe" else ()))}
        for run in tracked_with(known, make_options(options), faults):
            is_clean = detector == "mediapipe" and cameras < 2 and run.fault == "clean"
            yield replace(run, recording=path.name, fault="clean" if is_clean else f"{detector}, {cameras or 'all'} cameras, {run.fault}")


def tracked_with(path: Path, options: Options, faults: Mapping[str, Fault]) -> Iterator[Tracked]:
    """A recording of several cameras tracked with some faults."""
    survey = survey_rig(open_rig(path, options), options)
    subject = fit_multiview(np.random.default_rng(0), survey, options)
    truth, rate = read_joints(path / "truth.csv"), survey.rig.rate
    frames = [(each.time, each.seen) for each in read_frames(survey.rig, segments_of(survey.rig, survey.silhouettes))]
    empty = [np.zeros(camera.size[::-1], bool) for camera in subject.tracker.cameras] if survey.silhouettes else []
    films = [[none if (mask := seen.masks[n]) is None else mask for _, seen in frames] for n, none in enumerate(empty)]
    times, body, names = [time for time, _ in frames], subject.body, subject.body.landmark_names
    smoother = MotionSmoother(body.skeleton, subject.joints, gaps=0)
    for n, (fault, spoil) in enumerate(faults.items()):
        spoiled = [spoil(np.random.default_rng([n, m]), film, rate) if m == 0 or fault not in ONE_CAMERA else film
                   for m, film in enumerate(films)]
        sets = zip(*spoiled, strict=True) if films else (seen.masks for _, seen in frames)
        rng, doubt, state, before, rows = np.random.default_rng(1), MultiviewDoubt(subject.tracker), None, None, []
        motion = MotionBuilder("", [dof.name for dof in body.skeleton.dofs], [names[column] for column in subject.joint_columns])
        for (seconds, seen), masks in zip(frames, sets, strict=True):
            observation = subject.observe(Seen(masks, keypoints=seen.keypoints))
            state = subject.next_state(rng, state, observation)
            if state is None:
                motion.append(MotionFrame(seconds, "absent"))
                rows.append(None)
                continue
            shown = subject.tracker.shown(observation.points, masks, seen.keypoints, state.pose)
            found, before = doubt.evidence(state, observation.points, masks, seconds, before, shown)
            rows.append(found.components)
            stated = state_doubt(kind_of(masks, shown), found, names, body.skeleton, body.points, state.pose, state.status, np.eye(3))
            motion.append(MotionFrame(seconds, state.status, state.pose, subject.joints(state.pose[None])[0], stated.pose_sd,
                                      stated.joint_sd[subject.joint_columns], state.cost, state.overlap))
        poses = smoother(motion.build()).motion.poses
        errors = _places(at_times(truth, np.array(times)), names) - body.points(poses)
        some = next(row for row in rows if row is not None)
        components = {name: np.array([np.zeros((len(names), 3)) if row is None else row[name] for row in rows]) for name in some}
        if subject.limits is not None:
            components = {name: moving_deviations(np.array(times), each) for name, each in components.items()}
        yield Tracked(path.name, fault, names, components, errors, np.empty((0, 2)))


def across(path: Path) -> tuple[str, str]:
    """The two cameras of a recording whose views of the person are nearest to a right angle."""
    rig, truth = open_rig(path, make_options({})), read_joints(path / "truth.csv")
    rays = unit(np.array([camera.centre for camera in rig.cameras]) - truth.positions[0].mean(0))
    pairs = list(combinations(range(len(rays)), 2))
    first, second = min(pairs, key=lambda pair: abs(float(rays[pair[0]] @ rays[pair[1]])))
    return rig.names[first], rig.names[second]


def make_ring(path: Path) -> None:
    """Make a recording of the proving ground of several cameras, its first `RING_SECONDS` at `RING_RATE`, where it is missing."""
    number, spec = next((n, spec) for n, spec in enumerate(proving_rings()) if spec.name == path.name)
    if not (done := path / "made").exists():
        rate = min(spec.rate, RING_RATE)
        synthesize(replace(spec, rate=rate, frames=round(RING_SECONDS * rate)), path, np.random.default_rng([2, number]))
        done.touch()


def _places(truth: JointTable, names: Sequence[str]) -> Array:
    """True places (T, L, 3) of the landmarks; not a number for those without."""
    nowhere = np.full((len(truth.times), 3), np.nan)
    return np.stack([truth.positions[:, truth.names.index(name)] if name in truth.names else nowhere for name in names], 1)


def collect(kind: str, path: Path, build: Path, again: bool, clean: bool = False) -> list[Path]:
    """Files with the runs of a recording, one a fault, in a folder of `build`; `clean`: of the one without a fault."""
    folder = build / kind / path.name
    if path.parent == RINGS:
        make_ring(path)
    elif path.parent == WHOLE:
        films = (*whole_people.films(), *whole_people.pairs())
        whole_people.made(next(film for film in films if film.spec.name == path.name), WHOLE)
    elif path.parent == POSTURES:
        postures.made(next(film for film in _whole() if film.spec.name == path.name), POSTURES)
    if again or not (folder / "done").exists():
        folder.mkdir(parents=True, exist_ok=True)
        for run in islice(TRACK[kind](path), 1 if clean else None):
            np.savez_compressed(folder / f"{run.fault.replace(' ', '_')}.npz", joints=run.joints, errors=run.errors,
                                modes=run.modes, names=list(run.components), dofs=run.dofs, pose_errors=run.pose_errors,
                                pose_sd=run.pose_sd, statuses=run.statuses, weighting=run.weighting or (),
                                components=np.stack(list(run.components.values()), 3).astype(np.float32))
        (folder / "done").touch()
    return sorted(folder.glob("*.npz"))


def _rings() -> list[Path]:
    return [RINGS / spec.name for spec in proving_rings()]


def _whole() -> list[postures.Film]:
    """Films of one camera that show a whole person, who stands, sits, squats or kneels."""
    return [film for film in postures.films() if film.body is not None]


ONE = ("monocular", "monocular_whole", "both_one", "both_whole")
TRACK = {**{kind: partial(track_monocular, kind=kind) for kind in ONE},
         **{kind: partial(track_multiview, kind=kind) for kind in ("multiview", "pair", *SIGHTINGS)}}  # fmt: skip
MADE: dict[str, Callable[[], list[Path]]] = {
    **dict.fromkeys(("monocular", "both_one"), lambda: made_ground(GROUND)),
    **dict.fromkeys(("monocular_whole", "both_whole"), lambda: [WHOLE / film.spec.name for film in whole_people.films()]),
    **dict.fromkeys(("multiview", *SIGHTINGS), _rings), "pair": lambda: [WHOLE / film.spec.name for film in whole_people.pairs()],
    "keypoints_one": lambda: [*_rings(), *(POSTURES / film.spec.name for film in _whole())],
}  # fmt: skip


def read_runs(files: Iterable[Path]) -> list[Tracked]:
    """Runs from their files."""
    found = []
    for file in files:
        data = np.load(file, allow_pickle=False)
        components = dict(zip(data["names"].tolist(), np.moveaxis(data["components"].astype(float), 3, 0)))
        found.append(Tracked(file.parent.name, file.stem, tuple(data["joints"].tolist()), components, data["errors"], data["modes"],
                             tuple(data["dofs"].tolist()), data["pose_errors"], data["pose_sd"], data["statuses"],
                             ModeWeights(*data["weighting"].tolist()) if data["weighting"].size else None))
    return found
