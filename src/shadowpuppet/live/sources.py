"""Reads the inputs of a session with one camera: its calibration, the person, the empty scene."""

from __future__ import annotations

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import CalibrationError, RecordingError, choices, warn
from shadowpuppet.io.calibration.calibration_files import read_calibration
from shadowpuppet.io.person import Person, read_person
from shadowpuppet.live.phases import KEPT
from shadowpuppet.pipeline.footage import worked_size
from shadowpuppet.pipeline.options import Options
from shadowpuppet.silhouette.background import sample_frames
from shadowpuppet.video import Image, Size, fitted, open_untimed

USUAL_FOV = 65.0
"""Field of view (degrees) of a webcam or a phone along the longer side of its pictures, assumed if none is given."""


def _usual_fov(size: Size) -> float:
    """Horizontal field of view (degrees) that is assumed for pictures of `size` from an unknown camera."""
    width, height = size
    return USUAL_FOV if width >= height else float(np.degrees(2 * np.arctan(np.tan(np.radians(USUAL_FOV) / 2) * width / height)))


def lens(options: Options, size: Size) -> Camera:
    """The camera for pictures of `size`, from the options. Raises `CalibrationError` if the calibration does not fit."""
    if options.calibration is None:
        across = options.fov or _usual_fov(size)
        if options.fov is None:
            warn(f"no field of view is given: {across:.0f} degrees are assumed, and depths are as wrong as that; give --fov or "
                 "--calibration")
        return Camera.from_fov(size, float(np.radians(across)))
    if options.fov is not None:
        raise CalibrationError(f"{options.calibration}: found a field of view and a calibration, expected one of them")
    cameras = read_calibration(options.calibration)
    if len(cameras) > 1:
        raise CalibrationError(f"{options.calibration}: found the cameras {choices(c.name for c in cameras)}, expected one alone")
    camera = next(iter(cameras))
    if camera.size != size:
        (width, height), (w, h) = size, camera.size
        raise CalibrationError(f"{options.calibration}: size: found {w} x {h} pixels, expected {width} x {height} as the camera gives them")
    return camera


def known_person(options: Options) -> Person | None:
    """The person in the file `options.person`; None without it. Warns if neither height nor distance is known. Raises `FormatError`."""
    person = read_person(options.person, options.tracker.body) if options.person is not None else None
    if options.height is None and (person is None or person.height is None) and options.distance is None:
        warn("neither height nor distance is known: the average height is assumed, and all lengths are as wrong as that; give --height")
    return person


def empty_scene(options: Options, full: Camera) -> list[Image]:
    """Pictures of the empty scene from `options.background`, of the working size; empty without it. Raises `RecordingError`."""
    if options.background is None:
        return []
    scene = open_untimed(options.background)
    size = scene.size
    if size != full.size:
        raise RecordingError(f"{options.background}: found the empty scene of {size[0]} x {size[1]} pixels, expected {full.size[0]} x "
                             f"{full.size[1]} as the camera's: it must come from the same camera at the same setting")
    return sample_frames((frame.image for frame in fitted(scene, worked_size(size, options.max_size))), KEPT)
