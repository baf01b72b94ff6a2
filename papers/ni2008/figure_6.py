"""Fig. 6: joint angles over time beside the true ones: left elbow walking, left knee jogging, right shoulder boxing."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from papers.common.claims import Share, Verdict, all_of
from papers.common.experiment import Outcome, Request, Table
from papers.common.plotting import COLOURS, label, new_figure
from papers.ni2008.inputs import Case, cases
from papers.ni2008.tracks import HYBRID, Track, of, tracks
from shadowpuppet.geometry import Array

SHOWN = {"walking": ("left_elbow_flexion",), "jogging": ("left_knee_flexion",),
         "boxing": ("right_shoulder_flexion", "right_shoulder_abduction", "right_shoulder_twist")}  # fmt: skip
"""Angles by motion; a recording of another motion shows the first of each."""
ALIKE, CLOSE = 0.9, 10.0
"""An estimate follows the truth that correlates with it by this, and differs by less than that (degrees, root mean square)."""


class Angle(NamedTuple):
    """One angle over the frames, degrees."""

    motion: str
    name: str
    true: Array
    found: Array

    @property
    def off(self) -> float:
        """Root mean square difference."""
        return float(np.sqrt(np.nanmean((self.found - self.true) ** 2)))

    @property
    def alike(self) -> float:
        """Correlation."""
        known = np.isfinite(self.true)
        return float(np.corrcoef(self.true[known], self.found[known])[0, 1])

    @property
    def told(self) -> str:
        """For people."""
        return f"{self.motion} {self.name.replace('_', ' ')}"


def make(request: Request) -> Outcome:
    """Track, and read the angles; those of the first run are shown."""
    some = cases(request)
    found = tracks(request, some, [HYBRID])
    runs = {case.motion: [shown(case, track) for track in of(found, case, HYBRID)] for case in some}
    angles = {motion: each[0] for motion, each in runs.items()}
    rows = [(motion, frame, one.name, one.true[frame], one.found[frame]) for motion, each in angles.items() for one in each
            for frame in range(len(one.true))]
    table = Table(("recording", "frame", "angle", "true_deg", "estimated_deg"), rows)
    every = [list(again) for each in runs.values() for again in zip(*each)]
    return Outcome({"seed": request.seed, **HYBRID.plain}, {"figure_6": picture(angles)}, {"figure_6": table}, [follows(every)])


def shown(case: Case, track: Track) -> list[Angle]:
    """The angles of a case's motion."""
    names = SHOWN.get(case.motion) or tuple(each[0] for each in SHOWN.values())
    columns = case.body.skeleton.dof_indices(names)
    true, found = case.true_poses[:, columns], track.poses[:, columns]
    near = true + (found - true + np.pi) % (2 * np.pi) - np.pi
    return [Angle(case.motion, name, *np.degrees([true[:, k], near[:, k]])) for k, name in enumerate(names)]


def picture(angles: dict[str, list[Angle]]):
    """A panel for each recording, as in the paper."""
    figure, panels = new_figure(len(angles), 1, width=10, height=2.2)
    for axes, (motion, each) in zip(panels[:, 0], angles.items()):
        for colour, one in zip(COLOURS, each):
            name = one.name.replace("_", " ")
            axes.plot(one.true, color=colour, linewidth=1.6, alpha=0.45, label=f"{name}, true")
            axes.plot(one.found, color=colour, linewidth=0.9, linestyle="--", label=f"{name}, estimated")
        label(axes, "frame", "degrees", motion, legend=False)
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, fontsize=7)
        axes.margins(x=0.01)
    return figure


def follows(angles: list[list[Angle]]) -> Verdict:
    """"The estimated joint angles accurately follow the ground truth data." `angles`: the runs of each."""
    shares = [Share(sum(one.off < CLOSE and one.alike > ALIKE for one in runs), len(runs)) for runs in angles]
    told = [f"{runs[0].told}: off by {np.mean([one.off for one in runs]):.1f}°, correlation {np.mean([one.alike for one in runs]):.2f}, "
            f"in {share}" for runs, share in zip(angles, shares)]
    return Verdict("The estimated joint angles accurately follow the true ones", "VI, Fig. 6",
                   "; ".join(told) + f" (follows: under {CLOSE:.0f}°, over {ALIKE:g}, in more than half of all runs)",
                   all_of([share.usual for share in shares]), "figure_6.png")
