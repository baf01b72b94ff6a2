"""What the benchmarks of accuracy share: recordings read and segmented once, persons fitted, trackers run and measured."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from shadowpuppet.body.upper_body import WRIST_SHARE
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.colour_codes import ColourCode, colour_codes
from shadowpuppet.camera.keypoints import Keypoints
from shadowpuppet.camera.mask import Mask
from shadowpuppet.geometry import Array
from shadowpuppet.io.motion.table import read_joints
from shadowpuppet.motion.metrics import UPPER_JOINTS, joint_errors
from shadowpuppet.motion.motion import JointTable, Motion, MotionBuilder, MotionFrame
from shadowpuppet.pipeline.findings.camera import survey_camera
from shadowpuppet.pipeline.findings.look import Survey
from shadowpuppet.pipeline.options import Options, make_options
from shadowpuppet.pipeline.person import ColouredMask, MonocularSubject, fit_monocular
from shadowpuppet.pipeline.rig import Rig, open_rig
from shadowpuppet.pipeline.subject import joint_names, motion_frame
from shadowpuppet.tracking.monocular.initialization import SizeFit
from shadowpuppet.tracking.monocular.settings import MonocularSettings
from shadowpuppet.tracking.monocular.size_search import PersonEstimate
from shadowpuppet.tracking.monocular.tracker import State

ALIGNED = [name.replace("hand", "wrist") for name in UPPER_JOINTS]
COLUMNS = ("mean", "sd", "plane", "depth", "far", "aligned", "shoulder", "elbow", "hand", "cost", "jitter", "ms")
"""Measures in the order of the tables; `sd` is the standard deviation of the mean error over seeds."""


@dataclass(frozen=True, eq=False)
class Case:
    """A recording with known truth, read and segmented once."""

    name: str
    survey: Survey
    """For the fit of the person."""
    times: Array
    masks: list[Mask]
    """For the tracker."""
    codes: list[ColourCode | None]
    """Their colours."""
    keypoints: list[Keypoints | None]
    """What a detector found in their frames."""
    truth: JointTable

    @classmethod
    def read(cls, path: Path, *, masks: bool = False, references: bool = True, silhouette: dict[str, Any] | None = None) -> Case:
        """masks: the ready ones instead of segmentation; silhouette: settings of the segmentation of the masks that are tracked."""
        options = make_options({"masks": masks, "silhouette": silhouette or {}})
        survey = survey_camera(open_rig(path, options), options)
        footage = survey.rig.footage[0]
        if footage.recording.truth is None:
            raise SystemExit(f"{path}: no truth")
        if not references:
            recording = replace(footage.recording, references=())
            survey = replace(survey, rig=Rig(recording, (replace(footage, recording=recording),)))
        frames = [(frame.time, survey.silhouettes[0].segmented(frame)) for frame in footage.frames(masks)]
        times, tracked = np.array([time for time, _ in frames]), [found.mask for _, found in frames]
        codes = [colour_codes(found.image) for _, found in frames]
        keypoints = [None if footage.keypoints is None else footage.keypoints_at(float(time)) for time in times]
        return cls(path.name, survey, times, tracked, codes, keypoints, read_joints(footage.recording.truth))

    @property
    def camera(self) -> Camera:
        """The recording's one camera."""
        return self.survey.rig.cameras[0]

    def person(self, options: Options, rng: np.random.Generator) -> PersonEstimate:
        """Sizes and place, as `shadowpuppet track` finds them."""
        return fit_monocular(rng, self.survey, options).fit.guess

    def with_true_arms(self, person: PersonEstimate) -> PersonEstimate:
        """An upper body's estimate with the truth's lengths of upper arms and forearms; hands in proportion."""
        table = self.truth

        def length(upper: str, lower: str) -> float:
            ends = (table.select([f"{side}_{joint}" for side in ("left", "right")]).positions for joint in (upper, lower))
            return float(np.nanmedian(np.linalg.norm(np.subtract(*ends), axis=2)))

        arms = {"upper_arm_length": length("shoulder", "elbow"), "forearm_length": length("elbow", "wrist") / WRIST_SHARE}
        return replace(person, sizes=replace(person.sizes, **arms))

    def track(self, person: PersonEstimate, settings: MonocularSettings, rng: np.random.Generator) -> dict[str, float]:
        """Run a tracker, both ways if the settings say so, and measure it: millimetres, percent, pixels, m/s^2 and milliseconds a
        frame."""
        rate = 1 / float(np.median(np.diff(self.times)))
        subject = MonocularSubject.of(SizeFit(person, {}, {}, np.zeros((0, 0))), self.camera, settings, "", rate)
        seen = [ColouredMask(*each) for each in zip(self.masks, self.codes, self.keypoints, strict=True)]
        frames, spent, last = _pass(subject, rng, self.times, seen)
        motion = _motion(subject, frames)
        if subject.both_ways:
            frames, more, _ = _pass(subject.turned_back(last), rng, -self.times[::-1], seen[::-1])
            motion, _ = subject.blended(motion, _motion(subject, reversed(frames)))
            spent += more
        costs, number = motion.cost[motion.known], max(len(motion) - 1, 1)
        return self.measure(motion.table) | {"cost": float(np.mean(costs)), "ms": 1000 * spent / number}

    def measure(self, table: JointTable) -> dict[str, float]:
        """Errors of joints against the truth, and how much the hands shake."""
        errors = joint_errors(table, self.truth, UPPER_JOINTS, camera=self.camera).summary()
        aligned = joint_errors(table, self.truth, ALIGNED, camera=self.camera).summary()
        per = {part: float(np.mean([errors["joints"][f"{side}_{part}"]["mean_mm"] for side in ("left", "right")]))
               for part in ("shoulder", "elbow", "hand")}
        hands = table.select(["left_hand", "right_hand"]).positions
        pace = float(np.median(np.diff(self.times)))
        jitter = float(np.sqrt((np.linalg.norm(np.diff(hands, 2, axis=0), axis=2) ** 2).mean()) / pace**2)
        return per | {"mean": errors["mean_mm"], "plane": errors["plane_mm"], "depth": errors["depth_mm"], "far": 100 * errors["far"],
                      "aligned": aligned["aligned_mean_mm"], "jitter": jitter}


def _pass(subject: MonocularSubject, rng: np.random.Generator, times: Array,
          seen: Sequence[ColouredMask]) -> tuple[list[MotionFrame], float, State | None]:
    """The motion of what is seen at some times, tracked in this order, the processor time (s) after the first frame, and the last state."""
    frames, spent = list[MotionFrame](), 0.0
    state = before = None
    for n, (seconds, each) in enumerate(zip(times, seen, strict=True)):
        start = time.process_time()  # what else the machine does is not counted
        state = subject.next_state(rng, state, each)
        spent += (time.process_time() - start) * (n > 0)
        found, before = motion_frame(subject, float(seconds), state, each, before)
        frames.append(found)
    return frames, spent, state


def _motion(subject: MonocularSubject, frames: Iterable[MotionFrame]) -> Motion:
    builder = MotionBuilder(subject.body.name, subject.body.skeleton.dof_names, joint_names(subject.body))
    for found in frames:
        builder.append(found._replace(time=abs(found.time)))
    return builder.build()


def means(runs: list[dict[str, float]]) -> dict[str, float]:
    """Means over seeds, and the standard deviation of the mean error."""
    return {key: float(np.mean([run[key] for run in runs])) for key in runs[0]} | {"sd": float(np.std([run["mean"] for run in runs]))}
