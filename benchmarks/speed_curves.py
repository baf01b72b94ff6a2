"""How costs grow: of a particle with particles, picture size and cards; of refinement and hull with particles, points and cameras.

    python benchmarks/speed_curves.py [-o docs/assets/speed.png] [--quick]

Least times of some rounds in turns, on one core, as a picture (.png, .pdf or .svg); some minutes.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import smallest
from speed.mono_cases import MonoCase
from speed.multi_cases import MultiCase
from speed.timing import Contender, in_turns

from shadowpuppet.camera.bits import pack
from shadowpuppet.geometry import Array
from shadowpuppet.threads import one_blas_thread, one_opencv_thread

PICTURE = Path(__file__).resolve().parent.parent / "docs" / "assets" / "speed.png"
VALUES = {"particles": (10, 20, 50, 100, 200, 500, 1000, 2000, 5000), "width": (80, 160, 320, 640, 1280, 1920),
          "cards": (1, 2, 4, 6, 8, 10, 12, 15)}  # fmt: skip
LABELS = {"particles": "particles in a call", "width": "width of the picture, pixels (4:3)", "cards": "cards of cardbox that are drawn"}
VALUES_MULTI = {"particles": (5, 10, 20, 40, 80, 160), "points": (250, 500, 1000, 2000, 4000, 8000), "cameras": (2, 3, 4, 5, 6, 7, 8)}
LABELS_MULTI = {"particles": "particles", "points": "surface points", "cameras": "cameras"}
COLOURS = {"cardbox": "#1b6ca8", "boxes": "#d1495b", "rounded": "#3a7d44", "forces": "#d1495b", "Gauss-Newton": "#1b6ca8",
           "visual hull": "#3a7d44"}  # fmt: skip

Curves = dict[str, dict[str, list[float]]]
"""By axis and line: a time for each of the axis' values."""


def mono_curves(values: Mapping[str, Sequence[int]], rounds: int) -> Curves:
    """Microseconds a particle."""
    runs = {("cards", "cardbox", n): Contender(_some_cards(n), 200) for n in values["cards"]}
    for body in ("cardbox", "boxes", "rounded"):
        runs |= {("particles", body, n): Contender(MonoCase(body, particles=n).run, n) for n in values["particles"]}
        runs |= {("width", body, n): Contender(MonoCase(body, size=(n, n * 3 // 4)).run, 200) for n in values["width"]}
    return _measured(runs, rounds, 1e6)


def multi_curves(values: Mapping[str, Sequence[int]], rounds: int, **case: Any) -> Curves:
    """Milliseconds: of ten iterations of all particles, against particles and points; of the hull, against cameras."""
    runs = {("cameras", "visual hull", n): Contender(MultiCase(**case | {"cameras": n}).run_hull) for n in values["cameras"]}
    for axis in ("particles", "points"):
        for n in values[axis]:
            one = MultiCase(**case | {axis: n})
            runs |= {(axis, "forces", n): _ten(one.run_forces), (axis, "Gauss-Newton", n): _ten(one.run_gauss_newton)}
    return _measured(runs, rounds, 1e3)


def _ten(run: Callable[[int], Array]) -> Contender:
    return Contender(lambda: run(10))


def _measured(runs: Mapping[tuple[str, str, int], Contender], rounds: int, scale: float) -> Curves:
    names = {str(key): key for key in runs}
    curves: Curves = {}
    for name, times in in_turns({name: runs[key] for name, key in names.items()}, rounds).items():
        axis, line, _ = names[name]
        curves.setdefault(axis, {}).setdefault(line, []).append(scale * times.least)
    return curves


def _some_cards(number: int) -> Callable[[], Array]:
    """Costs of a cardbox with `number` cards drawn, evenly spread over its parts."""
    case = MonoCase()
    drawn = np.unique(np.linspace(0, len(case.picture.body.parts) - 1, number).round().astype(np.int64))
    silhouette, empty = pack(case.mask), case.picture.empty()
    return lambda: case.picture.added(case.poses, drawn, silhouette, empty)


def plot(rows: Sequence[tuple[Curves, Mapping[str, Sequence[int]], Mapping[str, str], str]], path: Path) -> None:
    """A row of panels for each of the curves, with values, labels and the unit."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 3.4 * len(rows)), layout="constrained")
    FigureCanvasAgg(figure)
    for panels, (curves, values, labels, unit) in zip(figure.subplots(len(rows), 3, squeeze=False), rows):
        for axes, (axis, label) in zip(panels, labels.items()):
            _panel(axes, values[axis], curves[axis], label, log=max(values[axis]) > 100 * min(values[axis]) or axis == "width")
        panels[0].set_ylabel(unit)
    figure.savefig(path, dpi=110)


def _panel(axes: Any, values: Sequence[int], lines: Mapping[str, Sequence[float]], label: str, log: bool) -> None:
    for name, times in lines.items():
        axes.plot(values, times, ".-", color=COLOURS[name], label=name)
    if log:
        axes.set_xscale("log")
        axes.minorticks_off()
    else:
        axes.set_xlim(left=0)
    axes.set_xticks(values, [str(value) for value in values], fontsize=7, rotation=0 if log or len(values) < 6 else 45)
    axes.set_xlabel(label)
    axes.set_ylim(bottom=0)
    axes.grid(alpha=0.3)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, fontsize=8)


def _smallest(folder: Path) -> list[object]:
    return ["--quick", "-o", folder / "speed.png"]


def main() -> None:
    """Measure and draw."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=PICTURE)
    parser.add_argument("--quick", action="store_true", help="two values an axis, one round, small pictures")
    args = smallest.parse(parser, _smallest)
    values, values_multi, case = VALUES, VALUES_MULTI, {}
    if args.quick:
        values, values_multi = ({axis: some[:2] for axis, some in every.items()} for every in (VALUES, VALUES_MULTI))
        case = {"points": 100, "particles": 3, "size": (160, 120)}
    with one_opencv_thread(), one_blas_thread():
        mono = mono_curves(values, 1 if args.quick else 9)
        multi = multi_curves(values_multi, 1 if args.quick else 5, **case)
    plot([(mono, values, LABELS, "microseconds a particle"),
          (multi, values_multi, LABELS_MULTI, "ms for ten iterations; hull: ms a frame")], args.output)
    print(f"{args.output}: {sum(map(len, mono.values()))} lines of one camera, {sum(map(len, multi.values()))} of several")


if __name__ == "__main__":
    main()
