"""The scene of a file of motion or of a calibration."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from shadowpuppet.calibration.overview import look_at_calibration
from shadowpuppet.errors import FormatError, ShadowPuppetError
from shadowpuppet.io.motion.motion_files import read_motion
from shadowpuppet.io.motion.skeletons import ENDINGS as SKELETONS
from shadowpuppet.io.motion.skeletons import read_animation
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.viewer.scene.figures import animation_figure, joint_figure
from shadowpuppet.viewer.scene.scene import SceneCamera, Stage


def motion_scene(path: Path, rate: float | None = None) -> Stage:
    """The scene of a file of motion that `convert` reads; `rate`: frames/s of an .amc file. Raises `FormatError`."""
    if path.suffix.lower() in SKELETONS:
        animation = read_animation(path, rate)
        figures, count = (animation_figure(path.name, animation),), len(animation.names)
        times = animation.times
    else:
        table = _joints(path, rate)
        figures, count = (joint_figure(path.name, table),), len(table.names)
        times = table.times
    if not len(times):
        raise FormatError(f"{path}: found no frame in it, expected one at least")
    facts = {"file": str(path), "joints": str(count), "frames": str(len(times))}
    return Stage(title=path.name, times=times, figures=figures, facts=facts)


def _joints(path: Path, rate: float | None) -> JointTable:
    """The joints with one of our names; if there are none, all points of the file."""
    try:
        return read_motion(path, rate)
    except FormatError:
        return read_motion(path, rate, own_names=True)


def calibration_scene(path: Path) -> Stage:
    """The scene of a calibration file. Raises `CalibrationError`."""
    look, found = look_at_calibration(path, None, None)
    cameras = tuple(SceneCamera(camera) for camera in found.cameras)
    oriented = tuple(each for each in cameras if each.camera.oriented)
    if not oriented:
        raise ShadowPuppetError(f"{path}: found no camera with a place, expected one at least")
    labels = () if look.middle is None else (("what all look at", look.middle),)
    facts = {"file": str(path), "kind": look.format, "cameras": ", ".join(each.camera.name for each in cameras), "unit": look.unit}
    return Stage(title=path.name, times=np.zeros(1), cameras=oriented, labels=labels, facts=facts, notes=look.notes, problems=look.doubts)
