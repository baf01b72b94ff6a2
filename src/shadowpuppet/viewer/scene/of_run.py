"""A run to be shown: its puppet, the truth beside it, what the cameras saw, errors and angles over time, and particles."""

from __future__ import annotations

from collections.abc import Iterator
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
from shadowpuppet.io.motion.motion_table import dof_unit
from shadowpuppet.io.person import read_person
from shadowpuppet.io.run import Run, read_run
from shadowpuppet.motion.body_animation import motion_animation
from shadowpuppet.motion.mesh import body_mesh
from shadowpuppet.motion.motion import Motion
from shadowpuppet.pipeline.footage import open_recording
from shadowpuppet.pipeline.options import Options, make_options
from shadowpuppet.viewer.scene.figures import of_animation, of_table
from shadowpuppet.viewer.scene.footage import hull_of
from shadowpuppet.viewer.scene.of_recording import eyes_of
from shadowpuppet.viewer.scene.particles import Rerun
from shadowpuppet.viewer.scene.show import Chart, Eye, Figure, Show

LIMBS = ("left_arm", "right_arm", "left_leg", "right_leg")
OF_LIMBS = {"arm": ("shoulder", "elbow", "wrist", "arm", "forearm", "hand"), "leg": ("hip", "knee", "ankle", "leg")}
"""Words in the names of a limb's degrees of freedom."""
UNSTATED = ("This run states no standard deviations. For “particles” and “uncertainty” its filter is run again on the frame that is shown, "
            "from the pose before it; the ellipsoids tell how far those particles are spread, no measure of how far off the pose is.")


def show_run(folder: str | Path, truth: str | Path | None = None, recording: str | Path | None = None) -> Show:
    """A run folder; `truth` and `recording` in place of those that it names. Raises a `ShadowPuppetError` for one that cannot be read.

    What it names and is not there any more is left out, which is said in `notes`.
    """
    return _Run(read_run(folder), truth, recording).show()


@dataclass(frozen=True, eq=False)
class _Run:
    """A run, and what is made of it once."""

    run: Run
    truth: str | Path | None
    recording: str | Path | None

    def show(self) -> Show:
        motion, lacks = self.run.motion, list[str]()
        if not len(motion):
            raise ShadowPuppetError(f"{self.run.folder}: found no frame in it, expected one at least")
        body = self._told(lacks, "the body's shape is not shown, its joints are", lambda: self.body)
        estimate = self._told(lacks, "the body's shape is not shown, its joints are", lambda: self.puppet) if body else None
        estimate = estimate or of_table(self.name, motion.table, **self.known)
        measured = self.measured() if self.truth else self._told(lacks, "no truth is shown", self.measured)
        figures = [estimate, *([of_table("truth", measured.truth, "truth")] if measured is not None and measured.truth is not None else [])]
        eyes = self.eyes if self.recording else self._told(lacks, "the films are not shown", lambda: self.eyes)
        films = eyes is not None
        eyes = eyes if eyes is not None else self.cameras
        cloud = self._told(lacks, "particles are not shown", lambda: self.rerun(eyes)) if films and body is not None else None
        charts = [*(errors_of(measured) if measured is not None else ()), *fit_of(motion), *angles_of(motion)]
        return Show(title=self.name, times=motion.times, figures=tuple(figures), eyes=eyes, charts=tuple(charts), facts=self.facts,
                    hull=hull_of(eyes, self.options) if films else None, cloud=cloud, lacks=tuple(lacks),
                    notes=() if np.isfinite(motion.joint_sd).any() else (UNSTATED,))

    @property
    def name(self) -> str:
        """The folder's."""
        return self.run.folder.resolve().name

    @property
    def facts(self) -> dict[str, str]:
        """What the run says of itself."""
        told = {key: str(self.run.info[key]) for key in ("recording", "method", "camera") if key in self.run.info}
        counts = ", ".join(f"{count} {status}" for status, count in self.run.motion.status_counts.items())
        return {"run": str(self.run.folder), **told, "body": self.run.motion.body_name, "frames": counts} | (
            {} if self.run.complete else {"ended": "before its end"})

    @property
    def known(self) -> dict:
        """Fields of the estimate's figure."""
        motion = self.run.motion
        return {"status": motion.status, "overlap": motion.overlap, "joints": motion.joints, "joint_sd": motion.joint_sd}

    @cached_property
    def options(self) -> Options:
        """The settings it was made with."""
        return make_options(self.run.settings, str(self.run.folder / "run.toml")) if self.run.settings else Options()

    @cached_property
    def body(self) -> Body:
        """Of the sizes in person.toml."""
        name, path = self.run.motion.body_name, self.run.folder / "person.toml"
        body = make_body(name, read_person(path, name).sizes)
        if self.run.motion.dof_names != body.skeleton.dof_names:
            raise ShadowPuppetError(f"{self.run.folder}: found degrees of freedom that are not those of the body {name!r}")
        return body

    @cached_property
    def puppet(self) -> Figure:
        """The body's shapes, carried by its poses."""
        animation, _ = motion_animation(self.body, self.run.motion)
        return of_animation(self.name, animation, body_mesh(self.body), **self.known)

    def measured(self) -> Evaluation | None:
        """The run beside its truth; None where none is named."""
        found = measure_run(self.run.folder, self.truth)
        return found if found.truth is not None else None

    @cached_property
    def eyes(self) -> tuple[Eye, ...] | None:
        """The cameras that were tracked, with their films; None where the run names no recording."""
        kept = self.run.folder / "recording"  # of a live run that was to keep its pictures
        path = self.recording or self.run.info.get("recording") or (kept if kept.exists() else None)
        if path is None:
            return None
        if not Path(path).exists():
            raise ShadowPuppetError(f"the recording {path} is not there")
        return eyes_of(open_recording(path, self.options), self.options, self.options.masks)[0]

    @cached_property
    def cameras(self) -> tuple[Eye, ...]:
        """The cameras alone, as the run folder keeps them."""
        path = self.run.folder / "calibration.toml"
        return tuple(Eye(camera) for camera in read_calibration(path)) if path.exists() else ()

    def rerun(self, eyes: tuple[Eye, ...]) -> Rerun:
        """The filter, to be run again on one frame."""
        return Rerun(self.body, self.run.motion, self.options, eyes)

    @staticmethod
    def _told(lacks: list[str], what: str, make):
        """What is made; None, and a note, where that cannot be."""
        try:
            return make()
        except ShadowPuppetError as error:
            lack = f"{what}: {error}"
            if lack not in lacks:
                lacks.append(lack)
            return None


def errors_of(measured: Evaluation) -> Iterator[Chart]:
    """Distances of joints to the truth over time, millimetres: the mean, and the worst."""
    if measured.errors is None or measured.table is None:
        return
    off = 1000 * np.where(measured.errors.known & ~measured.errors.lost, measured.errors.distance, np.nan)
    some = np.isfinite(off).any(1)
    mean, worst = np.full(len(off), np.nan), np.full(len(off), np.nan)
    mean[some], worst[some] = np.nanmean(off[some], 1), np.nanmax(off[some], 1)
    yield Chart("error", "mm", measured.table.times, {"mean": mean, "worst joint": worst})


def fit_of(motion: Motion) -> Iterator[Chart]:
    """How well the drawn body fits the silhouettes."""
    if np.isfinite(motion.overlap).any():
        yield Chart("overlap", "of 1", motion.times, {"overlap": motion.overlap})


def angles_of(motion: Motion) -> Iterator[Chart]:
    """Degrees of freedom over time, by limb; those of trunk and head, and places, by themselves. Degrees and metres."""
    groups: dict[tuple[str, str], dict[str, Array]] = {}
    for name, values in zip(motion.dof_names, motion.poses.T):
        unit = "m" if dof_unit(name) == "m" else "°"
        group = "place" if unit == "m" else _limb(name)
        groups.setdefault((group, unit), {})[name.replace("_", " ")] = values if unit == "m" else np.degrees(values)
    for (group, unit), curves in groups.items():
        yield Chart(f"angles: {group}" if unit != "m" else group, unit, motion.times, curves)


def _limb(name: str) -> str:
    """The limb that a degree of freedom moves, or trunk and head."""
    for limb in LIMBS:
        side, kind = limb.split("_")
        if name.startswith(side) and any(word in name for word in OF_LIMBS[kind]):
            return limb.replace("_", " ")
    return "trunk and head"


def beside(left: Show, right: Show, apart: float = 1.5) -> Show:
    """Two shows as one: the second's figures moved aside by `apart` metres (0: over the first's), its curves beside the first's."""
    across = _across(left) * apart
    moved = tuple(float(value) for value in across)
    others = tuple(replace(figure, name=f"{figure.name}, beside", kind="other" if figure.kind == "estimate" else figure.kind, shift=moved)
                   for figure in right.figures)  # fmt: skip
    charts = {chart.name: chart for chart in left.charts}
    both = [_both(charts.get(chart.name), chart) for chart in right.charts]
    kept = [chart for name, chart in charts.items() if name not in {chart.name for chart in right.charts}]
    times = left.times if len(left.times) >= len(right.times) else right.times
    facts = {**left.facts, **{f"{key}, beside": value for key, value in right.facts.items()}}
    return replace(left, title=f"{left.title} and {right.title}", times=times, figures=(*left.figures, *others),
                   charts=(*both, *kept), facts=facts, labels=(*left.labels, *right.labels),
                   notes=tuple(dict.fromkeys((*left.notes, *right.notes))), lacks=tuple(dict.fromkeys((*left.lacks, *right.lacks))))


def _both(one: Chart | None, other: Chart) -> Chart:
    """Curves of two charts at the times of the first."""
    named = {f"{name}, beside": values for name, values in other.curves.items()}
    if one is None:
        return replace(other, curves=named)
    there = {name: np.interp(one.times, other.times, values, left=np.nan, right=np.nan) for name, values in named.items()}
    return replace(one, curves={**one.curves, **there})


def _across(show: Show) -> Array:
    """The level direction that points to the right of who looks first, a unit vector (3,)."""
    ahead = show.middle - show.viewpoint
    right = np.array([ahead[1], -ahead[0], 0.0])
    length = float(np.linalg.norm(right))
    return right / length if length > 1e-9 else np.array([0.0, 1.0, 0.0])
