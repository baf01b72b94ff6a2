"""Tables of the look at a recording before tracking, as `track` and `info` show it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
from rich.console import Group, RenderableType

from shadowpuppet.cli.tables import pairs, seen_height, table
from shadowpuppet.pipeline.findings.keypoints import KeypointsLook
from shadowpuppet.pipeline.findings.look import CameraLook, Look, RigLook


def look_table(look: Look | RigLook, everything: bool = True) -> RenderableType:
    """Table of the look at a recording; the recording, its scale and the person only, if not `everything`."""
    if isinstance(look, RigLook):
        return _rig_table(look) if everything else pairs([*_rig_rows(look), *_rig_scale(look)[1:]])
    if not everything:
        return pairs([("recording", look.recording), ("camera", _camera(look)), ("film", _film(look)), ("scale", look.scale),
                      ("keypoints", _keypoints(look.keypoints)),
                      ("person", _person(look.person) if look.person is not None else None)])
    return _camera_table(look)


def _camera_table(look: Look) -> RenderableType:
    exact_plain = f"; those of the plain rule by {look.exact_overlap_plain:.3f}" if look.exact_overlap_plain is not None else ""
    exact = f"these silhouettes overlap the ready ones by {look.exact_overlap:.3f}{exact_plain}" if look.exact_overlap is not None else None
    return pairs([
        ("recording", look.recording), ("camera", _camera(look)), ("film", _film(look)), ("scale", look.scale),
        ("background", look.background), ("told by", _told_by(look.key) if look.key != "none" else None), ("silhouettes", _areas(look)),
        ("exact masks", exact), ("keypoints", _keypoints(look.keypoints)), ("quality", _quality(look) if look.refusal is None else None),
        ("person", _person(look.person) if look.person is not None else None),
    ])  # fmt: skip


def _told_by(key: str) -> str:
    """The feature that separates persons from the scene, and the reason for its choice; `both` is a method's name."""
    return key.replace("both", "both brightness and colour", 1) if key.startswith("both") else key


def _camera(look: Look) -> str:
    scaled = "" if look.worked_size == look.size else f", scaled to {look.worked_size[0]} x {look.worked_size[1]}"
    how = "calibrated" if look.calibrated else "its lens calibrated, not its place" if look.lens_calibrated else "not calibrated"
    return f"{look.camera}, {look.size[0]} x {look.size[1]} pixels{scaled}, {look.fov:.0f} degrees wide, {how}"


def _film(look: Look) -> str:
    count = f"{look.frames} frames" if look.frames else "frames not counted"
    rate = f"{look.rate:.4g} frames/s" if np.isfinite(look.rate) else "rate unknown"
    uneven = f", times uneven by {1000 * look.jitter:.1f} ms" if look.jitter * look.rate > 0.01 else ""
    return f"{count}, {rate}{uneven}"


def _areas(look: Look) -> str:
    plain = f"; by the fixed threshold of Liu 2011, eq. 1, {100 * look.plain_area:.1f} %" if look.plain_area is not None else ""
    return f"{100 * look.area:.1f} % of the picture, in {look.quality.frames} frames{plain}"


def _quality(look: Look) -> str:
    quality = look.quality
    sides = ", ".join(side for side, share in quality.border.items() if share > 0.02) or "no side"
    return (f"area changes by {100 * quality.area_change:.1f} % a frame, {100 * quality.flicker:.1f} % flickers; {quality.specks:.1f} "
            f"specks and {quality.holes:.1f} holes a frame; touches {sides} of the picture")


def _keypoints(look: KeypointsLook | None) -> str | None:
    """What detectors found, and how well the rays of several cameras agree."""
    if look is None:
        return None
    films = (f"{film.camera}: {film.landmarks} landmarks by {film.detector}, persons in {film.frames} frames, up to {film.persons} in one"
             for film in look.films)
    apart = ("" if look.apart is None else
             f"; rays pass the points where they meet by {look.apart_pixels:.1f} px, {1000 * look.apart:.0f} mm (median)")
    return "; ".join(films) + apart


def _person(person: Mapping[str, Any]) -> str:
    fits = ", ".join(f"{name} {value:.2f}" for name, value in person["overlaps"].items()) if person["source"] == "references" else ""
    clean = f"; all this in clean silhouettes by {person['silhouettes']}: plain ones show no posture" if person["silhouettes"] else ""
    return (f"height {person['height']:.2f} m at {person['distance']:.2f} m; sizes from {person['source']}"
            + (f" (overlap: {fits})" if fits else "") + f"; overlaps the film's first silhouette by {person['start_overlap']:.2f}{clean}")


def _rig_rows(look: RigLook) -> list[tuple[str, str | None]]:
    count = f"{look.frames} sets" if look.frames else "sets not counted"
    return [("recording", look.recording), ("cameras", f"{len(look.cameras)}, {count} of pictures in step, {look.rate:.4g} a second"),
            ("keypoints", _keypoints(look.keypoints))]


def _rig_scale(look: RigLook) -> list[tuple[str, str | None]]:
    return [("seen", seen_height(look.agreement.height)),
            ("person", _rig_person(look.person) if look.person is not None else None)]


def _rig_table(look: RigLook) -> RenderableType:
    """A row for each camera."""
    cameras = ((camera.name, _pixels(camera), f"{camera.fov:.0f}°", " ".join(f"{value:.1f}" for value in camera.place),
                f"{100 * camera.quality.area:.1f} %" if camera.quality.frames else "",
                "" if camera.exact_overlap is None else f"{camera.exact_overlap:.3f}",
                "" if apart is None else f"{apart:.1f} px") for camera, apart in zip(look.cameras, look.agreement.apart))  # fmt: skip
    keys = sorted({camera.key.split(":")[0] for camera in look.cameras} - {"none"})
    below = [("background", "; ".join(sorted(set(map(_background, look.cameras))))),
             ("told by", ", ".join(map(_told_by, keys)) or None), *_rig_scale(look)]
    columns = ("camera", "pixels", "wide", "stands at, m", "person", "exact", "apart")
    if all(camera.exact_overlap is None for camera in look.cameras):
        columns, cameras = columns[:5] + columns[6:], (row[:5] + row[6:] for row in cameras)
    return Group(pairs(_rig_rows(look)), "", table("", columns, cameras, right=range(2, len(columns))), "", pairs(below))


def _background(camera: CameraLook) -> str:
    """Source of the silhouettes, the same for cameras that differ by name only; one named `a` is not every a of the text."""
    return re.sub(rf"(?<!\w){re.escape(camera.name)}(?!\w)", "<camera>", camera.background)


def _pixels(camera: CameraLook) -> str:
    size = f"{camera.size[0]} x {camera.size[1]}"
    return size if camera.worked_size == camera.size else f"{size}, as {camera.worked_size[0]} x {camera.worked_size[1]}"


def _rig_person(person: Mapping[str, Any]) -> str:
    parts = [f"sizes from {person['source']}"] if "source" in person else []
    parts += [f"overlaps the first silhouettes by {person['overlap']:.2f}"] if "overlap" in person else []
    residual = person.get("residual")
    parts += [f"{1000 * residual:.0f} mm from body to surface points (rms)"] if residual is not None and np.isfinite(residual) else []
    return "; ".join(parts) or "measured"
