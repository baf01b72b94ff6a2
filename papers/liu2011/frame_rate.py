"""15 frames/s with 600 particles at 320 x 240 on one core: where a frame's time goes, and how it grows with N."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from benchmarks.speed.timing import Contender
from papers.common.claims import Verdict
from papers.common.experiment import Experiment, Outcome, Request, Table
from papers.common.plotting import COLOURS, label, new_figure
from papers.liu2011.material import Case, cases
from papers.liu2011.repeats import with_method
from papers.liu2011.shown import stem, told
from shadowpuppet.silhouette import SilhouetteSettings, learn_background
from shadowpuppet.threads import one_blas_thread, one_opencv_thread
from shadowpuppet.tracking.monocular.tracker import MonocularTracker
from shadowpuppet.video import Image

PAPER = 15.0
"""Frames/s."""
NUMBERS, FEW = (25, 50, 100, 200, 400, 800, 1600, 3200), (50, 200)
FRAMES, ROUNDS = 30, 9
"""Frames of a turn, and turns."""


def make(request: Request) -> Outcome:
    """Each recording, one thread."""
    outcome = Outcome()
    with one_blas_thread(), one_opencv_thread():
        for case in cases(request):
            name, numbers = stem("frame_rate", request, case), FEW if request.short else NUMBERS
            rounds = 2 if request.short else ROUNDS
            stages = spent(chain(case), rounds)
            growth = list(spent({str(n): tracking(case, n) for n in numbers}, max(rounds // 3, 1)).values())
            outcome.pictures[name] = draw(stages, numbers, growth)
            outcome.tables[name] = table(stages)
            outcome.tables[f"{name}_particles"] = Table(("N", "ms_a_frame"), list(zip(numbers, growth)))
            outcome.verdicts.append(verdict(case, stages, f"{name}.png"))
            outcome.settings |= told(case)
    outcome.said.append("Processor time, so that other work on the machine does not count: the least of some rounds. The paper's processor "
                        "is of 2009.")
    return outcome


def spent(contenders: dict[str, Contender], rounds: int) -> dict[str, float]:
    """Processor time of a unit of each, milliseconds, the least of some rounds in turns; each is run once before."""
    least = dict.fromkeys(contenders, np.inf)
    for n in range(rounds + 1):
        for what, (run, units) in contenders.items():
            start = time.process_time()
            run()
            least[what] = min(least[what], 1000 * (time.process_time() - start) / units) if n else np.inf
    return least


def chain(case: Case) -> dict[str, Contender]:
    """What a frame goes through."""
    images = case.frames(range(min(FRAMES + 1, len(case.times))))
    return {"decode": Contender(lambda: decode(case), FRAMES),
            "silhouette, eq. 1": Contender(segment(case, images, SilhouetteSettings(method="averaging")), len(images)),
            "silhouette, as `track`": Contender(segment(case, images, SilhouetteSettings()), len(images)),
            "filter, 600 particles": tracking(case, 200)}  # fmt: skip


def decode(case: Case) -> None:
    """Read some frames of the film."""
    for _ in zip(range(FRAMES), case.footage.film):
        pass


def segment(case: Case, images: list[Image], settings: SilhouetteSettings) -> Callable[[], None]:
    """Masks of pictures, by a background that is learnt before; where there is no film of the empty scene, by these pictures' median."""
    background, footage = case.footage.view.background, case.footage
    empty = list(footage.pictures(background, "the empty scene")) if background is not None else [np.median(images, 0).astype(np.uint8)] * 2
    segmenter = learn_background(empty, settings, film=images[::8])

    def run() -> None:
        for image in images:
            segmenter(image)

    return run


def tracking(case: Case, particles: int) -> Contender:
    """Some frames of the filter with so many particles a stage, again and again."""
    tracker = MonocularTracker(case.picture, with_method(case.tracker, "DRS", particles=particles))
    rng = np.random.default_rng(0)
    start, masks = tracker.start(rng, case.masks[0]), case.masks[1 : FRAMES + 1]

    def run() -> None:
        state = start
        for mask in masks:
            state = tracker.cycle(rng, state, mask)

    return Contender(run, len(masks))


def table(stages: dict[str, float]) -> Table:
    """Milliseconds a frame of each stage, and frames/s of the whole with either silhouette."""
    rows = [[what, f"{ms:.2f}"] for what, ms in stages.items()]
    rows += [[f"film to pose, {what}: frames/s", f"{rate:.0f}"] for what, rate in rates(stages).items()]
    return Table(("of a frame", "ms"), rows, shown=True)


def rates(stages: dict[str, float]) -> dict[str, float]:
    """Frames/s from film to pose."""
    both = stages["decode"] + stages["filter, 600 particles"]
    return {what: 1000 / (both + stages[what]) for what in stages if what.startswith("silhouette")}


def draw(stages: dict[str, float], numbers: tuple[int, ...], growth: list[float]) -> object:
    """Stages as bars; a frame's time against N."""
    figure, panels = new_figure(1, 2, 10, 3.2)
    panels[0, 0].barh(list(stages)[::-1], list(stages.values())[::-1], color=COLOURS[0])
    label(panels[0, 0], "milliseconds a frame, one core", "", legend=False)
    axes = panels[0, 1]
    axes.plot(numbers, growth, ".-", color=COLOURS[0], linewidth=1, label="the filter")
    axes.axhline(1000 / PAPER, color=COLOURS[1], linestyle="--", linewidth=0.8, label=f"{PAPER:.0f} frames/s")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.minorticks_off()
    axes.set_xticks(numbers, [str(n) for n in numbers], fontsize=7)
    label(axes, "particles of each stage, N", "milliseconds a frame")
    return figure


def verdict(case: Case, stages: dict[str, float], shown: str) -> Verdict:
    """The paper's V."""
    rate = rates(stages)["silhouette, eq. 1"]
    width, height = case.camera.size
    return Verdict(f"{PAPER:.0f} frames/s with 600 particles at 320 x 240, single-threaded", "V, VI",
                   f"{rate:.0f} frames/s at {width} x {height} from film to pose, on one core of today "
                   f"({1000 / stages['filter, 600 particles']:.0f} of the filter alone)", rate >= PAPER, shown)


EXPERIMENT = Experiment("frame_rate", "V: frames/s with 600 particles, stage by stage, and against N", "half a minute", make)
