"""Reading a recording into the arrays of a `Case`: silhouettes, surface points, sizes, and the poses that stand for truth and training."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from papers.ni2008.inputs import BODY, Source
from shadowpuppet.body.models import make_body
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask
from shadowpuppet.errors import RecordingError, TrackingError
from shadowpuppet.geometry import Array
from shadowpuppet.io.motion.motion_files import read_motion
from shadowpuppet.io.motion.table import read_joints
from shadowpuppet.io.recording import read_recording
from shadowpuppet.motion.inverse_kinematics import fit_poses
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.pipeline.findings.rig import survey_rig
from shadowpuppet.pipeline.options import make_options
from shadowpuppet.pipeline.rig import open_rig, read_frames
from shadowpuppet.synthetic.person.clothes import Clothes
from shadowpuppet.synthetic.person.mannequin import JOINTS
from shadowpuppet.synthetic.person_renderer import PersonRenderer
from shadowpuppet.synthetic.recording import perform
from shadowpuppet.synthetic.scene_renderer import dressed
from shadowpuppet.tracking.multiview.settings import make_multiview_settings
from shadowpuppet.tracking.multiview.size_estimation import estimate_sizes, size_deviations
from shadowpuppet.tracking.multiview.surface.visual_hull import SurfacePoints, VisualHull

OPENING, OPENED, FEW = 2.0, 24, 5
"""The first seconds in which the person is measured; how many frames of them are taken; and of small pictures."""


class Seen(NamedTuple):
    """One set of silhouettes."""

    time: float
    masks: list[Mask | None]


def read(source: Source) -> tuple[tuple[Camera, ...], dict[str, NDArray[Any]]]:
    """A recording's cameras and arrays, as `shadowpuppet track` would see it."""
    assert source.path is not None
    recording, options = read_recording(source.path), make_options({"preset": "ni2008", "masks": source.masks})
    for what, path in (("truth", recording.truth), ("training motion", recording.training)):
        if path is None:
            raise RecordingError(f"{source.path}: found no {what}, which the experiments of Ni 2008 need: truth.csv and training.csv")
    assert recording.truth is not None
    assert recording.training is not None
    rig = open_rig(source.path, options)
    survey = survey_rig(rig, options)
    if survey.look.refusal is not None:
        raise TrackingError(f"{survey.look.recording}: {survey.look.refusal}")
    sets = read_frames(rig, [each.segmented for each in survey.silhouettes], ready=source.masks)
    seen = (Seen(each.time, list(each.seen.masks)) for each in sets)
    return rig.cameras, _arrays(rig.cameras, rig.rate, seen, read_joints(recording.truth), read_motion(recording.training), OPENED)


def drawn(source: Source) -> tuple[tuple[Camera, ...], dict[str, NDArray[Any]]]:
    """A spec's made person as exact silhouettes, without films: a minute in place of several."""
    spec = source.spec
    assert spec is not None
    for_motion, for_training = np.random.default_rng(spec.seed).spawn(2)
    times, figure = perform(spec, for_motion)
    own = spec.motion if spec.training is None else spec.training
    again, rehearsal = perform(replace(spec, motion=own, frames=spec.training_frames), for_training)
    cameras = tuple(_smaller(view.camera(), source.factor) for view in spec.views())
    clothes = Clothes.draw(np.random.default_rng(spec.scene.clothing))
    people = [PersonRenderer(camera, dressed(spec.body, clothes), clothes, np.zeros((3, 4))) for camera in cameras]
    seen = (Seen(float(time), [person.mask(figure, n) for person in people]) for n, time in enumerate(times))
    truth, training = JointTable(times, JOINTS, figure.joints), JointTable(again, JOINTS, rehearsal.joints)
    return cameras, _arrays(cameras, spec.rate, seen, truth, training, OPENED if source.factor == 1 else FEW)


def _smaller(camera: Camera, factor: float) -> Camera:
    return camera if factor == 1 else camera.resized((round(camera.size[0] * factor), round(camera.size[1] * factor)))


def _arrays(cameras: tuple[Camera, ...], rate: float, seen: Iterator[Seen], truth: JointTable, training: JointTable,
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
    deviations = size_deviations(sizes, shown=True)
    return estimate_sizes(np.random.default_rng(0), partial(make_body, BODY), sizes, deviations, cameras, first, settings,
                          library).sizes
