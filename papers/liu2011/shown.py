"""What the figures have in common."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from papers.common.experiment import Request
from papers.liu2011.material import Case

if TYPE_CHECKING:
    from matplotlib.axes import Axes

STYLES = {"DRS": "-", "SRS": ":"}
"""Lines of the two methods."""


def stem(name: str, request: Request, case: Case) -> str:
    """A file's name, without its ending: with the recording's, where several were given."""
    return f"{name}_{case.name}" if len(request.recordings) > 1 else name


def told(case: Case) -> dict[str, Any]:
    """What a case was tracked with."""
    return {case.name: {"silhouettes": case.silhouettes.source, "person": check_source(case), "frames": len(case.times),
                        "size": list(case.camera.size), "tracker": case.tracker}}


def check_source(case: Case) -> str:
    """Where the person's sizes come from."""
    return case.subject.person.source


def mark_parts(axes: Axes, case: Case, by_frame: bool = True, named: bool = True) -> None:
    """Name the motions above a plot over frames (or seconds), with a line between them."""
    rate = (len(case.times) - 1) / (case.times[-1] - case.times[0]) if by_frame else 1.0
    for n, part in enumerate(case.parts):
        if n:
            axes.axvline(part.start * rate, color="0.6", linewidth=0.7)
        if named:
            axes.annotate(part.name, ((part.start + part.end) / 2 * rate, 0.99), xycoords=("data", "axes fraction"), ha="center", va="top",
                          fontsize=7, color="0.35")
