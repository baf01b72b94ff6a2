"""What to know of silhouettes before a run, with one camera or several."""

from __future__ import annotations

from collections.abc import Sequence

from shadowpuppet.errors import HARMFUL, NOTED, RUINOUS, Caution
from shadowpuppet.pipeline.silhouettes import Silhouettes
from shadowpuppet.silhouette.correction.condition import FilmCondition

GOOD = 0.9
"""Overlap with ready silhouettes below which the segmentation is in doubt."""


def clutter_cautions(left_out: Sequence[str]) -> list[Caution]:
    """What was left out of the silhouettes as clutter; nothing if nothing was."""
    if not left_out:
        return []
    return [Caution(f"{'; '.join(left_out)}: taken for clutter, not for the person, and left out of the silhouettes",
                    "clutter beside the person was left out: see the overlay", NOTED)]


def recovery_doubt(silhouettes: Silhouettes) -> str | None:
    """Why the scene cannot be recovered from the film; None if it can be, or need not."""
    return None if silhouettes.recovered is None else silhouettes.recovered.doubt


def recovery_cautions(names: Sequence[str], silhouettes: Sequence[Silhouettes]) -> list[Caution]:
    """What to know of scenes that were recovered from the films of the cameras `names`."""
    found = {name: each.recovered for name, each in zip(names, silhouettes) if each.recovered is not None}
    said = [Caution(f"camera {name!r}: {scene.doubt}", f"camera {name!r}: empty scene not recovered; film it", RUINOUS)
            for name, scene in found.items() if scene.doubt]
    said += [Caution(f"camera {name!r}: the head never moves in the film, so it cannot be told from the scene: the place above the "
                     "shoulders where it must be is taken for it; film the empty scene", "head never moves: film the empty scene", HARMFUL)
             for name, scene in found.items() if scene.head_still]
    hidden = {name: float(scene.covered.mean()) for name, scene in found.items() if not scene.doubt}
    if not hidden:
        return said
    of = f" of {', '.join(hidden)}" if len(names) > 1 else ""
    never = (f"up to {100 * max(hidden.values()):.1f} % of the picture was never seen without the person, and counts as person in every "
             "frame; ") if any(hidden.values()) else ""  # fmt: skip
    return [*said, Caution(f"no picture of the empty scene{of}: it was recovered from the film; {never}what touches the person and has "
                           "like colours may be taken for it; look at the silhouettes, or give background/<camera>.mp4 or --background",
                           "no picture of the empty scene: film one, give --background", NOTED)]


def unlike_ready(overlap: float) -> Caution:
    """Silhouettes that overlap the ready ones by too little."""
    return Caution(f"the silhouettes overlap the ready ones in masks/ by {overlap:.2f} only: try another --silhouette.method, or --masks",
                   "silhouettes differ from those in masks/: use --masks", HARMFUL)


def condition_cautions(condition: FilmCondition | None, recovered: bool) -> tuple[Caution, ...]:
    """What the film's condition may do to a run; `recovered`: its empty scene was recovered from the film."""
    return () if condition is None else condition.warnings(recovered)
