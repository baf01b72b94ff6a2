"""Files of motion and of calibrations to be shown."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from shadowpuppet.calibration.overview import look_at_calibration
from shadowpuppet.errors import FormatError, ShadowPuppetError
from shadowpuppet.io.motion.motion_files import read_motion
from shadowpuppet.io.motion.skeletons import ENDINGS as SKELETONS
from shadowpuppet.io.motion.skeletons import read_animation
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.viewer.scene.figures import of_animation, of_table
from shadowpuppet.viewer.scene.show import Eye, Show


def show_motion(path: Path, rate: float | None = None) -> Show:
    """A file of motion of any kind that `convert` reads; `rate`: frames/s of an .amc file. Raises `FormatError`."""
    if path.suffix.lower() in SKELETONS:
        animation = read_animation(path, rate)
        figures, count = (of_animation(path.name, animation),), len(animation.names)
        times = animation.times
    else:
        table = _joints(path, rate)
        figures, count = (of_table(path.name, table),), len(table.names)
        times = table.times
    if not len(times):
        raise FormatError(f"{path}: found no frame in it, expected one at least")
    facts = {"file": str(path), "joints": str(count), "frames": str(len(times))}
    return Show(title=path.name, times=times, figures=figures, facts=facts)


def _joints(path: Path, rate: float | None) -> JointTable:
    """The joints that are known by our names; where none is, all points of the file."""
    try:
        return read_motion(path, rate)
    except FormatError:
        return read_motion(path, rate, own_names=True)


def show_calibration(path: Path) -> Show:
    """A calibration of any kind that is read. Raises `CalibrationError`."""
    look, found = look_at_calibration(path, None, None)
    eyes = tuple(Eye(camera) for camera in found.cameras)
    if not any(eye.camera.oriented for eye in eyes):
        raise ShadowPuppetError(f"{path}: found no camera of which it tells where it stands, expected one at least")
    labels = () if look.middle is None else (("what all look at", look.middle),)
    facts = {"file": str(path), "kind": look.format, "cameras": ", ".join(eye.camera.name for eye in eyes), "unit": look.unit}
    return Show(title=path.name, times=np.zeros(1), eyes=tuple(eye for eye in eyes if eye.camera.oriented), labels=labels, facts=facts,
                notes=look.notes, lacks=look.doubts)
