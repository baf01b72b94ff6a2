"""Fig. 5: how DRS resamples, as a diagram of 20 particles; and, of a real frame, where the particles of an arm have its hand."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from papers.common.experiment import Experiment, Outcome, Request, Table
from papers.common.plotting import COLOURS, new_figure
from papers.liu2011.material import Case, cases
from papers.liu2011.shown import stem, told
from shadowpuppet.camera.drawing import in_colour
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.monocular.tracker import MonocularTracker
from shadowpuppet.tracking.resampling import deterministic

if TYPE_CHECKING:
    from matplotlib.axes import Axes

NUMBER, SURVIVAL = 20, 0.4
HAND = "left_hand"
FRAME = 0.6
"""Which frame is shown, as a share of the first motion."""


def make(request: Request) -> Outcome:
    """The diagram beside a real frame."""
    outcome = Outcome()
    for case in cases(request):
        name = stem("figure_5", request, case)
        figure, panels = new_figure(1, 2, 11, 3.6, gridspec_kw={"width_ratios": [1.25, 1]})
        ancestors = diagram(panels[0, 0], np.random.default_rng(request.seed))
        n, kinds, hands = real(case, np.random.default_rng(request.seed))
        show_hands(panels[0, 1], case, n, kinds, hands)
        outcome.pictures[name] = figure
        outcome.tables[name] = Table(("particle", "drawn_from_rank"), [[i + 1, int(a) + 1] for i, a in enumerate(ancestors)])
        outcome.settings |= told(case)
        outcome.said.append(f"Left: of {NUMBER} particles, ranked by cost, the best is kept unchanged, the best {SURVIVAL:g} N "
                            "survive with noise, the rest are copies of the best with noise. Right: "
                            "the left hands of the left arm's particles in one frame.")
    return outcome


def diagram(axes: Axes, rng: np.random.Generator) -> np.ndarray:
    """Particles above in the order of their cost, below the new ones, each under the one that it comes from; ancestors (N,), by rank."""
    costs = np.sort(rng.gamma(3.0, 1.0, NUMBER))
    ancestors = deterministic(rng, -costs, NUMBER, SURVIVAL)
    survivors = int(SURVIVAL * NUMBER)
    for i in range(NUMBER):
        lives = i < survivors
        axes.bar(i, costs[i] / costs.max() * 0.8, 0.7, bottom=2.1, color=COLOURS[0] if lives else "0.8")
        colour = "black" if i == 0 else COLOURS[0] if lives else COLOURS[1]
        drift = 0.0 if i == 0 else 0.12 * rng.standard_normal()
        axes.annotate("", (i, 0.55), (ancestors[i], 2.05), arrowprops={"arrowstyle": "->", "color": colour, "linewidth": 0.7})
        axes.plot(i, 0.35 + drift, "o", color=colour, markersize=6)
    texts = ((survivors / 2, "survive: + noise", COLOURS[0]), ((survivors + NUMBER) / 2, "the best particle + noise", COLOURS[1]))
    for x, text, colour in texts:
        axes.text(x, -0.25, text, ha="center", fontsize=8, color=colour)
    axes.text(NUMBER - 0.5, 2.95, "cost of the ranked particles, cycle k - 1", ha="right", fontsize=8, color="0.3")
    axes.text(-0.2, -0.25, "kept", ha="center", fontsize=8)
    axes.set_xlim(-1.2, NUMBER)
    axes.set_ylim(-0.4, 3.2)
    axes.set_axis_off()
    axes.set_title("Fig. 5: sampling and resampling with DRS", fontsize=9)
    return ancestors


def real(case: Case, rng: np.random.Generator) -> tuple[int, np.ndarray, Array]:
    """A frame's number; what each of the left arm's new particles is (0 the best, 1 survivors, 2 redrawn); its hand's pixel (N, 2)."""
    tracker = MonocularTracker(case.picture, case.tracker)
    part = case.parts[0]
    n = int(np.abs(case.times - (part.start + FRAME * (part.end - part.start))).argmin())
    state = tracker.start(rng, case.masks[0])
    for mask in case.masks[1 : n + 1]:
        state = tracker.cycle(rng, state, mask)
    stage = next(stage for stage in tracker.stages if stage.parts == ("left_arm",))
    particles = state.particles[tracker.stages.index(stage)]
    ancestors = stage.resample(rng, particles.log_weights, stage.number)
    poses = stage.put(state.pose, stage.propose(0)(rng, particles.poses[ancestors]))
    names = case.picture.body.landmark_names
    hands = case.camera.project(case.picture.points_world(poses)[:, names.index(HAND)])
    survivors = int(case.tracker.arm.survival * stage.number)
    return n, np.where(np.arange(len(poses)) == 0, 0, np.where(np.arange(len(poses)) < survivors, 1, 2)), hands


def show_hands(axes: Axes, case: Case, n: int, kinds: np.ndarray, hands: Array) -> None:
    """Dots over the picture."""
    grey = in_colour(case.frames([n])[0]).mean(-1)
    axes.imshow(grey, cmap="gray", vmin=-60, vmax=300, interpolation="bilinear")
    for kind, text, colour in ((2, "the best, redrawn", COLOURS[1]), (1, "survivors", COLOURS[0]), (0, "the best", "black")):
        axes.plot(*hands[kinds == kind].T, "o", color=colour, markersize=6 if kind == 0 else 2.5, label=text)
    height, width = grey.shape
    axes.set_xlim(0.35 * width, width)
    axes.set_ylim(0.85 * height, 0)
    axes.set_axis_off()
    axes.legend(fontsize=7, loc="lower left")
    axes.set_title(f"left hand of the {len(kinds)} particles of the left arm, {case.times[n]:.1f} s", fontsize=9)


EXPERIMENT = Experiment("figure_5", "Fig. 5: how DRS resamples, drawn and in a real frame", "some seconds", make)
