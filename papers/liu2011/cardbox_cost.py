"""Cardbox against closed boxes (Fig. 1): what a posture's cost takes to compute, and what tracking is worth with either."""

from __future__ import annotations

import numpy as np

from benchmarks.speed.mono_cases import MonoCase as Drawn
from benchmarks.speed.opencv import OpenCV
from benchmarks.speed.timing import Contender, in_turns
from papers.common.claims import Verdict, difference
from papers.common.experiment import Experiment, Outcome, Request, Table
from papers.common.plotting import COLOURS, label, new_figure
from papers.liu2011.material import case, made_recording
from papers.liu2011.repeats import repeat
from papers.liu2011.shown import told
from papers.liu2011.sweeps import Measured, measured
from shadowpuppet.threads import one_blas_thread, one_opencv_thread

BODIES = {"cardbox": "cardbox", "boxes": "volumetric (boxes)"}
SIZES, FEW = ((160, 120), (320, 240), (640, 480), (1280, 960)), ((160, 120), (320, 240))
PAPER = (320, 240)
ROUNDS = 25

Times = dict[tuple[str, str, tuple[int, int]], float]
"""Microseconds a posture by body, who draws, and size."""


def make(request: Request) -> Outcome:
    """Times in turns, in one thread; then both bodies tracked."""
    sizes = FEW if request.short else SIZES
    times = drawn(sizes, 3 if request.short else ROUNDS)
    found: dict[str, Measured] = {}
    outcome = Outcome()
    folder = request.recordings[0] if request.recordings else made_recording(request, "three_motions")
    for body in BODIES:
        one = case(request, folder, (("body", body),))
        found[body] = measured(repeat(request, one, one.tracker))
        outcome.settings |= {body: told(one)}
    outcome.pictures["cardbox_cost"] = draw(times, sizes)
    outcome.tables["cardbox_cost"] = Table(("body", "drawn_by", "width", "height", "us_a_posture"),
                                           [[body, who, *size, us] for (body, who, size), us in times.items()])
    outcome.tables["cardbox_cost_tracking"] = table(times, found)
    outcome.verdicts = verdicts(times, found)
    return outcome


def drawn(sizes: tuple[tuple[int, int], ...], rounds: int) -> Times:
    """Eq. 2 of 200 postures of the whole body, by our kernels and by OpenCV: all in turns."""
    runs: dict[tuple[str, str, tuple[int, int]], Contender] = {}
    for size in sizes:
        for body in BODIES:
            what = Drawn(body, size=size)
            runs[body, "ours", size] = Contender(what.run, what.particles)
            runs[body, "OpenCV", size] = Contender(OpenCV(what).run, what.particles)
    names = {repr(key): key for key in runs}
    with one_blas_thread(), one_opencv_thread():
        timed = in_turns({name: runs[key] for name, key in names.items()}, rounds)
    return {names[name]: 1e6 * each.least for name, each in timed.items()}


def draw(times: Times, sizes: tuple[tuple[int, int], ...]) -> object:
    """Time against picture width, and as a ratio."""
    figure, panels = new_figure(1, 2, 10, 3.2)
    widths = [size[0] for size in sizes]
    for n, who in enumerate(("ours", "OpenCV")):
        for body, style in zip(BODIES, ("-", "--")):
            panels[0, 0].plot(widths, [times[body, who, size] for size in sizes], f".{style}", color=COLOURS[n], linewidth=1,
                              label=f"{BODIES[body]}, drawn by {'our kernels' if who == 'ours' else who}")
        ratios = [times["boxes", who, size] / times["cardbox", who, size] for size in sizes]
        panels[0, 1].plot(widths, ratios, ".-", color=COLOURS[n], linewidth=1, label="our kernels" if who == "ours" else who)
    panels[0, 1].axhline(1, color="0.6", linewidth=0.7)
    for axes in panels[0]:
        axes.set_xscale("log")
        axes.minorticks_off()
        axes.set_xticks(widths, [f"{width} x {height}" for width, height in sizes], fontsize=7)
    panels[0, 0].set_yscale("log")
    panels[0, 1].set_ylim(bottom=0)
    label(panels[0, 0], "picture", "microseconds a posture")
    label(panels[0, 1], "picture", "boxes' time over cardbox's")
    return figure


def planes(body: str) -> int:
    """How many are drawn."""
    return len(Drawn(body).picture.body.parts)


def table(times: Times, found: dict[str, Measured]) -> Table:
    """A row a body."""
    columns = ("body", "planes", "us a posture, ours", "us a posture, OpenCV", "3D error, mm", "2D error, px")
    return Table(columns, [[BODIES[body], planes(body), *(f"{times[body, who, PAPER]:.2f}" for who in ("ours", "OpenCV")),
                            f"{each.error.mean():.0f}", f"{each.cost.mean():.0f}"] for body, each in found.items()], shown=True)


def verdicts(times: Times, found: dict[str, Measured]) -> list[Verdict]:
    """The paper's III-A and VI."""
    ratios = {who: times["boxes", who, PAPER] / times["cardbox", who, PAPER] for who in ("ours", "OpenCV")}
    apart = difference(found["cardbox"].error, found["boxes"].error)
    worse = {True: "the cards' is greater", False: "the cards' is less", None: "not significant"}[apart.greater]
    return [
        Verdict("The cardbox has fewer planes to project than a volumetric model, and so costs less to draw", "III-A, Fig. 1, VI",
                f"{planes('cardbox')} and {planes('boxes')} planes; boxes take {ratios['ours']:.2f} times as long drawn by our kernels, "
                f"{ratios['OpenCV']:.2f} times by OpenCV", bool(min(ratios.values()) > 1), "cardbox_cost.png"),
        Verdict("The cardbox works for tracking (here: no worse than the volumetric model)", "abstract, VI",
                f"3D error with DRS: cardbox {found['cardbox'].error.mean():.0f} mm, boxes {found['boxes'].error.mean():.0f} mm "
                f"({np.abs(apart.value):.0f} ± {apart.error:.0f}; {worse})", apart.greater is not True, "cardbox_cost.png"),
    ]  # fmt: skip


EXPERIMENT = Experiment("cardbox_cost", "Fig. 1, VI: drawing cost and tracking error of cards and closed boxes", "a minute", make,
                        runs=20, short_runs=2)
