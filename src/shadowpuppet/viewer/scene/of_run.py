"""The scene of a run: its puppet, the truth, the cameras' films, errors and angles over time, and particles."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from shadowpuppet.body.models import make_body
from shadowpuppet.body.shapes import Body
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.evaluation.evaluation import Evaluation, measure_run
from shadowpuppet.geometry import Array
from shadowpuppet.io.calibration.calibration_files import read_calibration
from shadowpuppet.io.motion.table import dof_unit
from shadowpuppet.io.person import read_person
from shadowpuppet.io.run import Run, read_run
from shadowpuppet.motion.body_animation import motion_animation
from shadowpuppet.motion.mesh import body_mesh
from shadowpuppet.motion.motion import Motion
from shadowpuppet.pipeline.footage import open_recording
from shadowpuppet.pipeline.options import Options, make_options
from shadowpuppet.removed import of_earlier_run
from shadowpuppet.viewer.scene.figures import LimbStatuses, animation_figure, joint_figure
from shadowpuppet.viewer.scene.film_images import hull_function
from shadowpuppet.viewer.scene.of_recording import cameras_of
from shadowpuppet.viewer.scene.particles import ParticleRerun
from shadowpuppet.viewer.scene.scene import Chart, SceneCamera, SceneFigure, Stage

LIMBS = ("left_arm", "right_arm", "left_leg", "right_leg")
OF_LIMBS = {"arm": ("shoulder", "elbow", "wrist", "arm", "forearm", "hand"), "leg": ("hip", "knee", "ankle", "leg")}
"""Words in the names of a limb's degrees of freedom."""
UNSTATED = "This run states no standard deviations: no intervals are shown."


def run_scene(folder: str | Path, truth: str | Path | None = None, recording: str | Path | None = None, *, films: bool = True) -> Stage:
    """The scene of a run folder; `truth` and `recording` replace the ones that it names; without `films` the cameras are the folder's
    own. Raises a `ShadowPuppetError`.

    Files that it names and that are gone are left out and named in `problems`.
    """
    return _Run(read_run(folder), truth, recording, films).scene()


@dataclass(frozen=True, eq=False)
class _Run:
    """A run and its parts, each loaded or computed once."""

    run: Run
    truth: str | Path | None
    recording: str | Path | None
    with_films: bool = True

    def scene(self) -> Stage:
        motion, problems = self.run.motion, list[str]()
        if not len(motion):
            raise ShadowPuppetError(f"{self.run.folder}: found no frame in it, expected one at least")
        body = self._tried(problems, "the body's shape is not shown, its joints are", lambda: self.body)
        estimate = self._tried(problems, "the body's shape is not shown, its joints are", lambda: self.puppet) if body else None
        estimate = estimate or joint_figure(self.name, motion.table, **self.known)
        measured = self.measured() if self.truth else self._tried(problems, "no truth is shown", self.measured)
        figures = [estimate]
        if measured is not None and measured.truth is not None:
            figures.append(joint_figure("truth", measured.truth, "truth"))
        filmed = self.film_cameras if self.recording else self._tried(problems, "the films are not shown", lambda: self.film_cameras)
        again = filmed is not None and self.options.uses_silhouettes
        cameras = filmed if filmed is not None else self.kept_cameras
        cloud = self._tried(problems, "particles are not shown", lambda: self.rerun(cameras)) if again and body is not None else None
        charts = [*(errors_of(measured) if measured is not None else ()), *fit_of(motion), *angles_of(motion)]
        return Stage(title=self.name, times=motion.times, figures=tuple(figures), cameras=cameras, charts=tuple(charts), facts=self.facts,
                    hull=hull_function(cameras, self.options) if again else None, cloud=cloud, problems=tuple(problems),
                    notes=() if np.isfinite(motion.joint_sd).any() else (UNSTATED,))

    @property
    def name(self) -> str:
        """Name of the folder."""
        return self.run.folder.resolve().name

    @property
    def facts(self) -> dict[str, str]:
        """Facts about the run."""
        info = {key: str(self.run.info[key]) for key in ("recording", "method", "camera") if key in self.run.info}
        counts = ", ".join(f"{count} {status}" for status, count in self.run.motion.status_counts.items())
        return {"run": str(self.run.folder), **info, "body": self.run.motion.body_name, "frames": counts} | (
            {} if self.run.complete else {"ended": "before its end"})

    @property
    def known(self) -> dict:
        """Arguments of `animation_figure` for the estimate: statuses, overlap, joints and their standard deviations."""
        motion = self.run.motion
        return {"statuses": LimbStatuses(motion.limbs, motion.limb_status),
                "status": motion.status, "overlap": motion.overlap, "joints": motion.joints, "joint_names": motion.joint_names,
                "joint_sd": motion.joint_sd}

    @cached_property
    def options(self) -> Options:
        """The settings of the run."""
        return make_options(of_earlier_run(self.run.settings), str(self.run.folder / "run.toml")) if self.run.settings else Options()

    @cached_property
    def body(self) -> Body:
        """The body with the sizes in person.toml."""
        name, path = self.run.motion.body_name, self.run.folder / "person.toml"
        body = make_body(name, read_person(path, name).sizes)
        if self.run.motion.dof_names != body.skeleton.dof_names:
            raise ShadowPuppetError(f"{self.run.folder}: found degrees of freedom that are not those of the body {name!r}")
        return body

    @cached_property
    def puppet(self) -> SceneFigure:
        """The body in its poses."""
        animation, _ = motion_animation(self.body, self.run.motion)
        return animation_figure(self.name, animation, body_mesh(self.body), **self.known)

    def measured(self) -> Evaluation | None:
        """The run compared with its truth; None without a truth."""
        found = measure_run(self.run.folder, self.truth)
        return found if found.truth is not None else None

    @cached_property
    def film_cameras(self) -> tuple[SceneCamera, ...] | None:
        """The cameras that were used, with their films; None if these are not wanted, or the run names no recording."""
        if not self.with_films:
            return None
        kept = self.run.folder / "recording"  # of a live run with --record
        path = self.recording or self.run.info.get("recording") or (kept if kept.exists() else None)
        if path is None:
            return None
        if not Path(path).exists():
            raise ShadowPuppetError(f"the recording {path} is not there")
        return cameras_of(open_recording(path, self.options), self.options, self.options.masks)[0]

    @cached_property
    def kept_cameras(self) -> tuple[SceneCamera, ...]:
        """The cameras without films, from the run folder."""
        path = self.run.folder / "calibration.toml"
        return tuple(SceneCamera(camera) for camera in read_calibration(path)) if path.exists() else ()

    def rerun(self, cameras: tuple[SceneCamera, ...]) -> ParticleRerun:
        """The particle filter, to be run again on single frames."""
        return ParticleRerun(self.body, self.run.motion, self.options, cameras)

    @staticmethod
    def _tried(problems: list[str], what: str, make):
        """The result of `make()`; if it fails, None, and a sentence is added to `problems`."""
        try:
            return make()
        except ShadowPuppetError as error:
            problem = f"{what}: {error}"
            if problem not in problems:
                problems.append(problem)
            return None


def errors_of(measured: Evaluation) -> Iterator[Chart]:
    """Chart of mean and greatest joint error over time, millimetres."""
    if measured.errors is None or measured.table is None:
        return
    errors = 1000 * np.where(measured.errors.known & ~measured.errors.lost, measured.errors.distance, np.nan)
    known = np.isfinite(errors).any(1)
    mean, worst = np.full(len(errors), np.nan), np.full(len(errors), np.nan)
    mean[known], worst[known] = np.nanmean(errors[known], 1), np.nanmax(errors[known], 1)
    yield Chart("error", "mm", measured.table.times, {"mean": mean, "worst joint": worst})


def fit_of(motion: Motion) -> Iterator[Chart]:
    """Chart of the overlap of the drawn body and the silhouettes."""
    if np.isfinite(motion.overlap).any():
        yield Chart("overlap", "of 1", motion.times, {"overlap": motion.overlap})


def angles_of(motion: Motion) -> Iterator[Chart]:
    """Charts of the degrees of freedom and their standard deviations over time, degrees or metres: one each for limbs, trunk and head,
    and position."""
    groups: dict[tuple[str, str], dict[str, tuple[Array, Array]]] = {}
    for name, values, sd in zip(motion.dof_names, motion.poses.T, motion.pose_sd.T):
        unit = "m" if dof_unit(name) == "m" else "°"
        group, scale = ("place", 1.0) if unit == "m" else (_limb(name), np.degrees(1.0))
        groups.setdefault((group, unit), {})[name.replace("_", " ")] = scale * values, scale * sd
    for (group, unit), curves in groups.items():
        stated = {name: sd for name, (_, sd) in curves.items() if np.isfinite(sd).any()}
        yield Chart(f"angles: {group}" if unit != "m" else group, unit, motion.times, {name: each[0] for name, each in curves.items()},
                    stated)


def _limb(name: str) -> str:
    """The limb of a degree of freedom, or trunk and head."""
    for limb in LIMBS:
        side, kind = limb.split("_")
        if name.startswith(side) and any(word in name for word in OF_LIMBS[kind]):
            return limb.replace("_", " ")
    return "trunk and head"


def side_by_side(left: Stage, right: Stage, apart: float = 1.5) -> Stage:
    """Two scenes as one; the figures of the second are moved `apart` metres to the side, its curves are added to the first's charts."""
    moved = tuple(float(value) for value in apart * _rightward(left))
    others = tuple(replace(figure, name=f"{figure.name}, beside", kind="other" if figure.kind == "estimate" else figure.kind, shift=moved)
                   for figure in right.figures)  # fmt: skip
    charts = {chart.name: chart for chart in left.charts}
    both = [_joined(charts.get(chart.name), chart) for chart in right.charts]
    kept = [chart for name, chart in charts.items() if name not in {chart.name for chart in right.charts}]
    times = left.times if len(left.times) >= len(right.times) else right.times
    facts = {**left.facts, **{f"{key}, beside": value for key, value in right.facts.items()}}
    return replace(left, title=f"{left.title} and {right.title}", times=times, figures=(*left.figures, *others),
                   charts=(*both, *kept), facts=facts, labels=(*left.labels, *right.labels),
                   notes=tuple(dict.fromkeys((*left.notes, *right.notes))),
                   problems=tuple(dict.fromkeys((*left.problems, *right.problems))))


def _joined(one: Chart | None, other: Chart) -> Chart:
    """The curves of two charts, at the times of the first."""
    curves, sd = ({f"{name}, beside": values for name, values in each.items()} for each in (other.curves, other.sd))
    if one is None:
        return replace(other, curves=curves, sd=sd)

    def resampled(named: Mapping[str, Array]) -> dict[str, Array]:
        return {name: np.interp(one.times, other.times, values, left=np.nan, right=np.nan) for name, values in named.items()}

    return replace(one, curves={**one.curves, **resampled(curves)}, sd={**one.sd, **resampled(sd)})


def _rightward(scene: Stage) -> Array:
    """Horizontal unit vector (3,) to the right in the first view."""
    ahead = scene.middle - scene.viewpoint
    right = np.array([ahead[1], -ahead[0], 0.0])
    length = float(np.linalg.norm(right))
    return right / length if length > 1e-9 else np.array([0.0, 1.0, 0.0])
