"""Examines a recording whose person is tracked by keypoints alone: no picture is segmented, none need be empty."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from shadowpuppet.body.anthropometry import AVERAGE_HEIGHT
from shadowpuppet.body.models import average_body
from shadowpuppet.body.sizes import HEIGHTS
from shadowpuppet.calibration.agreement import MAX_DISAGREEMENT, Agreement
from shadowpuppet.camera.keypoints import Keypoints, cameras_with_persons
from shadowpuppet.errors import RUINOUS, Finding
from shadowpuppet.geometry import evenly_spread
from shadowpuppet.pipeline.findings.camera import known_scale, unknown_scale
from shadowpuppet.pipeline.findings.cautions import film_cautions
from shadowpuppet.pipeline.findings.keypoints import look_at_keypoints
from shadowpuppet.pipeline.findings.look import CameraLook, RigLook, Survey
from shadowpuppet.pipeline.findings.opening import OPENING, opening_of, read_sets
from shadowpuppet.pipeline.findings.scale import PEOPLE, WRONG, ScaleError
from shadowpuppet.pipeline.footage import Footage
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.people.census import census_by_keypoints, people_finding
from shadowpuppet.pipeline.progress import Listener, Steps
from shadowpuppet.pipeline.rig import Rig
from shadowpuppet.silhouette.quality import mask_quality
from shadowpuppet.tracking.keypoints.definitions import landmarks_of
from shadowpuppet.tracking.keypoints.sights import NEAR
from shadowpuppet.tracking.keypoints.stature import height_by_bones
from shadowpuppet.tracking.multiview.height_estimation import DEVIATION

FRAMES = 10
"""Number of frame sets in which bones are measured."""


def survey_keypoints(rig: Rig, options: Options, listener: Listener | None = None) -> Survey:
    """Examine what detectors found in the first seconds of all films together. Raises a `ShadowPuppetError` if something cannot be used."""
    steps = Steps(listener, rig.names)
    steps("keypoints of all films")
    first, found = read_sets(rig, (), opening_of(rig), ready=False), look_at_keypoints(rig.footage)
    look = RigLook(recording=str(rig.recording.path), cameras=tuple(map(_camera_look, rig.footage)), rate=rig.rate, frames=rig.count,
                   agreement=Agreement(names=rig.names, apart=(None,) * len(rig.names), pairs=(), limit=MAX_DISAGREEMENT, height=None),
                   keypoints=found)
    least = min(2, len(rig.footage))
    seen = [each for each in first.keypoints if cameras_with_persons(each) >= least]
    if not seen:
        where = "in two cameras at the same time" if least > 1 else "in the film"
        refusal = (f"the detector found no person {where} within the first {OPENING:g} s: do films and keypoints "
                   "belong together, and begin together? say in [start] of recording.toml when each film began")
        return Survey(rig, (), (), first, replace(look, refusal=refusal))
    scale = _scale(rig, seen, options)
    refusal = scale.caution().words if scale is not None and not HEIGHTS[0] < scale.height < HEIGHTS[1] else None
    findings = [each.about(f"camera {footage.camera.name!r}") for footage in rig.footage for each in film_cautions(footage)]
    if len(rig.footage) == 1 and rig.recording.subject.height is None and rig.recording.subject.distance is None:
        findings.insert(0, unknown_scale(known_scale(rig.footage[0])))
    if scale is not None:
        findings.insert(0, scale.caution())
    elif found is not None and found.apart is not None and found.apart > NEAR:
        findings.insert(0, Finding.of("the rays of the cameras' keypoints pass each other by {mm:.0f} mm: does the calibration belong to "
                                      "these films, and were they begun together? calibrate again, or say in [start] of recording.toml "
                                      "when each began", "cameras and calibration do not fit: calibrate again", RUINOUS,
                                      mm=1000 * found.apart))
    census = census_by_keypoints(rig) if rig.is_multiview and options.people != 1 else None
    if census is not None and options.people is not None:
        census = replace(census, number=options.people)
    if census is not None and census.number > 1:
        findings.insert(0, people_finding(census.number))
    return Survey(rig, (), (), first, replace(look, refusal=refusal, findings=() if refusal else tuple(findings)), census)


def _scale(rig: Rig, seen: Sequence[Sequence[Keypoints | None]], options: Options) -> ScaleError | None:
    """The calibration's error of scale by the lengths of bones; None if there is none."""
    chosen = [seen[n] for n in evenly_spread(len(seen), FRAMES)]
    found = height_by_bones(rig.cameras, chosen, landmarks_of(average_body(options.multiview.body)))
    known = rig.recording.subject.height
    if found is None or (PEOPLE[0] < found < PEOPLE[1] if known is None else 1 / np.sqrt(WRONG) < found / known < np.sqrt(WRONG)):
        return None
    return ScaleError(height=found, expected=known or AVERAGE_HEIGHT, is_known=known is not None, doubt=DEVIATION / AVERAGE_HEIGHT)


def _camera_look(footage: Footage) -> CameraLook:
    camera = footage.camera
    x, y, z = footage.view.camera.centre.tolist()
    return CameraLook(name=camera.name, place=(x, y, z), start=footage.view.start, size=footage.view.camera.size, worked_size=camera.size,
                      fov=float(np.degrees(camera.fov)), frames=footage.count,
                      rate=footage.film.rate, background="none, keypoints alone", key="none", exact_overlap=None, quality=mask_quality(()))
