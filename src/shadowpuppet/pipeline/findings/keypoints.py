"""What detectors found in a recording's films, and whether calibrated cameras agree on it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.keypoints import Keypoints
from shadowpuppet.geometry import Array, unit
from shadowpuppet.pipeline.footage import SPREAD, Footage


@dataclass(frozen=True)
class FilmKeypointsLook:
    """What a detector found in one camera's film; plain values."""

    camera: str
    detector: str
    landmarks: int
    frames: int
    """Number of frames with persons."""
    persons: int
    """Largest number of persons in a frame."""


@dataclass(frozen=True)
class KeypointsLook:
    """What detectors found in a recording's films; plain values."""

    films: tuple[FilmKeypointsLook, ...]
    apart: float | None = None
    """Median distance (m) of landmarks that several cameras see from their rays; None without such landmarks."""
    apart_pixels: float | None = None
    """The same in the pictures, pixels."""


def look_at_keypoints(footage: Sequence[Footage]) -> KeypointsLook | None:
    """What detectors found in films; None if there are no keypoints. Raises `FormatError`."""
    with_any = [(each, film) for each in footage if (film := each.keypoints) is not None]
    if not with_any:
        return None
    looks = tuple(FilmKeypointsLook(each.view.camera.name, film.detector, len(film.names), len(film.persons),
                                    int(film.persons.max(initial=0))) for each, film in with_any)
    found = [part for sets in _moments([each for each, _ in with_any]) for part in distances_from_rays(sets)]
    if not found:
        return KeypointsLook(looks)
    apart, pixels = np.median(found, axis=0)
    return KeypointsLook(looks, float(apart), float(pixels))


def _moments(footage: Sequence[Footage]) -> Iterator[list[tuple[Camera, Keypoints]]]:
    """Cameras and keypoints of moments at which several cameras show one person."""
    whole = [each for each in footage if each.view.camera.oriented and np.isfinite(each.film.rate)]
    ends = [film.frame[-1] / each.film.rate - each.view.start for each in whole if (film := each.keypoints) is not None and len(film.frame)]
    for time in np.linspace(0, max(ends, default=0.0), SPREAD):
        sets = [(each.view.camera, film.at(round((float(time) + each.view.start) * each.film.rate)))
                for each in whole if (film := each.keypoints) is not None]
        alone = [(camera, seen) for camera, seen in sets if len(seen.person) == 1]
        if len(alone) > 1:
            yield alone


def distances_from_rays(sets: Sequence[tuple[Camera, Keypoints]]) -> Iterator[tuple[float, float]]:
    """Distances (m, and pixels) of each camera's ray of a landmark of the only person from the point that is nearest to all its rays."""
    for name in sorted(set[str]().union(*(seen.names for _, seen in sets))):
        seeing = [(camera, seen.xy[0, seen.names.index(name)]) for camera, seen in sets if name in seen.names]
        seeing = [(camera, xy) for camera, xy in seeing if np.isfinite(xy).all()]
        if len(seeing) < 2:
            continue
        centres = np.array([camera.centre for camera, _ in seeing])
        across = np.array([_across(camera, xy) for camera, xy in seeing])
        point = np.linalg.lstsq(across.sum(0), (across @ centres[..., None]).sum(0)[:, 0], rcond=None)[0]
        for (camera, xy), matrix, centre in zip(seeing, across, centres):
            in_picture = np.linalg.norm(camera.project(point) - xy)
            if np.isfinite(in_picture):
                yield float(np.linalg.norm(matrix @ (point - centre))), float(in_picture)


def _across(camera: Camera, xy: Array) -> Array:
    """Projection (3, 3) onto the plane across the ray of a pixel (2,), in the world."""
    d = unit(camera.T_camera_world[:3, :3].T @ camera.rays(xy))
    return np.eye(3) - np.outer(d, d)
