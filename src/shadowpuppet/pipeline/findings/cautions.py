"""What to know of silhouettes before a run, with one camera or several."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from shadowpuppet.camera.mask import Mask
from shadowpuppet.errors import HARMFUL, NOTED, RUINOUS, Finding
from shadowpuppet.geometry import Array
from shadowpuppet.pipeline.footage import Footage
from shadowpuppet.pipeline.silhouettes import Silhouettes
from shadowpuppet.silhouette.correction.condition import FilmCondition

GOOD = 0.9
"""Overlap with ready silhouettes below which the segmentation is in doubt."""
AT_TIMES, MOSTLY = 0.1, 0.5
"""Shares of a camera's frames from which on it is worth a word that feet are cut off, or that the person sits, and that it does not show
the feet."""
SHAPE = 0.03
"""Relative difference in the shapes of pixels, width over height, from which on a calibration is not the film's."""
LOWER, SMALLER = 0.25, 0.75
"""How much lower the silhouette's top is, over the root of its area, and how large that area at most, over those while the person stands,
where they sit. Who bows keeps the area, who turns the height."""


def added_cautions(added: str | None) -> list[Finding]:
    """What was added to the empty scene, and left out of the silhouettes; nothing if nothing was."""
    if added is None:
        return []
    return [Finding.of("{added}: it is left out of the silhouettes", "something beside the person was left out: see the overlay", NOTED,
                       added=added)]


def recovery_doubt(silhouettes: Silhouettes) -> str | None:
    """Why the scene cannot be recovered from the film; None if it can be, or need not."""
    return None if silhouettes.recovered is None else silhouettes.recovered.doubt


def recovery_cautions(names: Sequence[str], silhouettes: Sequence[Silhouettes]) -> list[Finding]:
    """What to know of scenes that were recovered from the films of the cameras `names`."""
    found = {name: each.recovered for name, each in zip(names, silhouettes) if each.recovered is not None}
    said = [Finding(scene.doubt, "empty scene not recovered; film it", RUINOUS).about(f"camera {name!r}")
            for name, scene in found.items() if scene.doubt]
    said += [Finding.of("camera {camera!r}: the head never moves in the film, so it cannot be told from the scene: the place above the "
                        "shoulders where it must be is taken for it; film the empty scene",
                        "head never moves: film the empty scene", HARMFUL, camera=name)
             for name, scene in found.items() if scene.head_still]
    hidden = {name: float(scene.covered.mean()) for name, scene in found.items() if not scene.doubt}
    if not hidden:
        return said
    never = ("up to {percent:.1f} % of the picture was never seen without the person, and counts as person in every frame; "
             if any(hidden.values()) else "")  # fmt: skip
    of = f" of {', '.join(hidden)}" if len(names) > 1 else ""
    return [*said, Finding.of(f"no picture of the empty scene{{of}}: it was recovered from the film; {never}what touches the person and "
                              "has like colours may be taken for it; look at the silhouettes, or give background/<camera>.mp4 or "
                              "--background",
                              "no picture of the empty scene: film one, give --background", NOTED, of=of,
                              percent=100 * max(hidden.values()))]


def feet_cautions(bottom: Mapping[str, float]) -> list[Finding]:
    """Feet that are cut off, by the share of each camera's frames in which the person touches the bottom of the picture."""
    cut = {name: share for name, share in bottom.items() if share > AT_TIMES}
    if not cut:
        return []
    if len(bottom) == 1:
        return [Finding.of("the feet are cut off at the bottom of the picture in {percent:.0f} % of the frames, where they are guessed; "
                           "step back, or tilt the camera", "feet are cut off: step back, or tilt the camera", HARMFUL,
                           percent=100 * max(cut.values()))]
    where = ", ".join(f"camera {name!r} in {100 * share:.0f} % of the frames" for name, share in cut.items())
    named = " and ".join(map(repr, cut)) if len(cut) < 3 else f"{len(cut)} cameras"
    shown = sum(share < MOSTLY for share in bottom.values())
    return [Finding(f"the feet are cut off at the bottom of the picture ({where}): where fewer than two cameras show them they are "
                    "guessed; step back, or tilt the cameras", f"feet cut off in {named}: step back or tilt",
                    NOTED if shown > 1 else HARMFUL, cut)]


def sitting_cautions(masks: Sequence[Mask], times: Sequence[float]) -> list[Finding]:
    """That a person whose upper body one camera shows sits down or kneels, by the masks (H, W) of frames with these times (s)."""
    seen = [n for n, mask in enumerate(masks) if mask.any()]
    if not seen:
        return []
    tops: Array = np.array([masks[n].any(1).argmax() for n in seen], float)
    areas = np.array([np.count_nonzero(masks[n]) for n in seen], float)
    standing = tops <= np.percentile(tops, 50)
    top, area = np.median(tops[standing]), np.median(areas[standing])
    low = np.flatnonzero((tops > top + LOWER * area**0.5) & (areas < SMALLER * area))
    if len(low) < max(AT_TIMES * len(seen), 1):
        return []
    return [Finding.of("in {percent:.0f} % of the frames, first at {seconds:.1f} s, the person is lower and smaller in the picture: they "
                       "sit down, kneel or go away, which an upper body cannot follow; cut the film with --start and --end, or track the "
                       "whole body with --body anatomical, its feet in the picture",
                       "person sits or kneels at {seconds:.1f} s: cut, or --body anatomical", HARMFUL,
                       percent=100 * len(low) / len(seen), seconds=times[seen[low[0]]])]


def film_cautions(footage: Footage) -> list[Finding]:
    """What to know of how a camera's film was stored: rows of two moments, and pixels of another shape than the calibration's."""
    film, matrix, said, path = footage.film, footage.view.camera.matrix, list[Finding](), str(footage.view.video)
    if film.interlaced:
        said.append(Finding.of("{film}: the film is interlaced: every other row of a frame is of another moment, which frays the outline "
                               "of what moves; deinterlace it (ffmpeg -vf bwdif)", "film is interlaced: deinterlace it", NOTED, film=path))
    calibrated = float(matrix[1, 1] / matrix[0, 0])
    if abs(film.pixel - 1) > SHAPE and abs(calibrated / film.pixel - 1) > SHAPE:
        said.append(Finding.of("{film}: the film says that its pixels are {pixel:.3g} times as wide as high, the calibration takes them "
                               "for {calibrated:.3g} times: calibrate with pictures of this film, or give it with square pixels (ffmpeg "
                               "-vf scale=iw*sar:ih,setsar=1)", "pixels of film and calibration differ in shape", HARMFUL,
                               film=path, pixel=film.pixel, calibrated=calibrated))
    return said


def unlike_ready(overlap: float | None) -> list[Finding]:
    """Silhouettes that overlap the ready ones by too little."""
    if overlap is None or overlap >= GOOD:
        return []
    return [Finding.of("the silhouettes overlap the ready ones in masks/ by {overlap:.2f} only: try another --silhouette.method, or "
                       "--masks",
                      "silhouettes differ from those in masks/: use --masks", HARMFUL, overlap=overlap)]


def condition_cautions(condition: FilmCondition | None, recovered: bool) -> tuple[Finding, ...]:
    """What the film's condition may do to a run; `recovered`: its empty scene was recovered from the film."""
    return () if condition is None else condition.warnings(recovered)
