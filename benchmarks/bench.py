"""How fast this machine is: particles and frames against OpenCV and plain NumPy, the whole chain, memory, start (docs/speed.md).

    python -m benchmarks.bench [--json FIGURES.json]

Some minutes; ends with tables. The file gets all figures by flat keys: `mono.*` with one camera, `multi.*` with several.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent))  # as for a script of this folder

import smallest
from speed.extent import FULL, SMALLEST, Extent
from speed.mono import run_mono
from speed.multi import run_multi

from shadowpuppet.cli.doctor import environment
from shadowpuppet.cli.tables import pairs, show, table
from shadowpuppet.threads import one_blas_thread

FACTORS = {"us": 1e6, "ms": 1e3}
"""Units of time, a second."""
# key of the time, name, unit, and key of its ratio to the row above
MONO_ROWS = (
    ("particle", "a particle of cardbox, pose to cost", "us", ""),
    ("opencv", "  OpenCV, its polygons ready-made", "us", "mono.ratio_opencv_full"),
    ("boxes", "  boxes instead of cardbox", "us", "mono.ratio_boxes"),
    ("arm", "a particle of an arm's stage", "us", ""),
    ("opencv_arm", "  OpenCV, its polygons ready-made", "us", "mono.ratio_opencv_arm"),
    ("step", "a frame of the filter at Table I", "ms", ""),
    ("naive_frame", "  plain NumPy and Python", "ms", "mono.ratio_naive_frame"),
    ("default", "a frame of the default filter", "ms", ""),
    ("silhouette", "a frame's silhouette, 640 x 480", "ms", ""),
    ("correct", "  of this, light and movement looked for", "ms", "mono.ratio_correction"),
    ("naive_correct", "  plain OpenCV and NumPy: one shift, one gain", "ms", "mono.ratio_naive_correction"),
    ("correct_moved", "  a nudged camera's frame shifted back", "ms", "mono.ratio_correction_moved"),
    ("correct_uneven", "  an uneven change of light undone", "ms", "mono.ratio_correction_uneven"),
)
MULTI_ROWS = (
    ("hull", "silhouettes to surface points", "ms", ""),
    ("forces", "simulated forces, a particle and iteration", "us", ""),
    ("naive_forces", "  plain NumPy", "us", "multi.ratio_naive"),
    ("gauss_newton", "Gauss-Newton, a particle and iteration", "us", ""),
    ("naive_gauss_newton", "  plain NumPy", "us", "multi.ratio_naive_gauss_newton"),
    ("forces_frame", "a frame of ni2008, silhouettes to pose", "ms", ""),
    ("default_frame", "a frame of the default preset", "ms", ""),
)
CHAIN = {"decode": "decoding", "segment": "segmentation", "track": "filter", "doubt": "doubt", "write": "writing"}


def main() -> None:
    """Measure, write the figures, show the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, help="file that gets all figures")
    arguments = smallest.parse(parser, lambda folder: ["--json", folder / "bench.json"])
    if arguments.json is not None:
        arguments.json.touch()  # fails now rather than after minutes of work
    found = run_bench(SMALLEST if "--smallest" in sys.argv else FULL)
    if arguments.json is not None:
        arguments.json.write_text(json.dumps(found, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    show(*tables(found))


def run_bench(extent: Extent = FULL) -> dict[str, Any]:
    """All figures by flat keys, with `environment` and `raw` (median and least seconds per unit, and rounds, of each timed function)."""
    with one_blas_thread():
        (mono, mono_raw), (multi, multi_raw) = run_mono(extent), run_multi(extent)
    raw = {name: times._asdict() for name, times in (mono_raw | multi_raw).items()}
    return {**mono, **multi, "environment": environment(), "raw": raw}


def tables(found: Mapping[str, Any]) -> Iterator[Any]:
    """The figures for the terminal."""
    for title, rows in (("one camera, 320 x 240", MONO_ROWS), ("seven cameras, 640 x 480", MULTI_ROWS)):
        cells = ((name, *(f"{FACTORS[unit] * found['raw'][key][which]:.4g}" for which in ("median", "least")), unit,
                  f"{found[ratio]:.3g}" if ratio else "") for key, name, unit, ratio in rows)  # fmt: skip
        yield table(f"time, {title}", ("", "median", "least", "", "times"), cells, right=(1, 2, 4))
    here = found["environment"]
    stages = ", ".join(f"{name} {found[f'mono.{stage}_ms']:.1f}" for stage, name in CHAIN.items())
    yield pairs([
        ("filter", f"{found['mono.step_fps']:.0f} frames/s at Table I, {found['mono.default_fps']:.0f} with the default preset"),
        ("film to pose", f"{found['mono.chain_fps']:.0f} frames/s, {found['mono.one_core']} (ms a frame: {stages})"),
        ("memory", f"{_megabytes(found['mono.peak_mb'])} at most, grown by {_megabytes(found['mono.growth_mb'])} over "
                   f"{found['mono.chain_frames']} frames"),
        ("several", f"{found['multi.fps']:.0f} frames/s with the default preset, {found['multi.forces_fps']:.0f} with ni2008"),
        ("films to pose", f"{found['multi.chain_fps']:.0f} frames/s from seven films, {found['multi.cores']}; "
                          f"{_megabytes(found['multi.peak_mb'])} at most"),
        ("first pose", f"{found['mono.start_s']:.1f} s after the start of a new process, {found['mono.compile_s']:.1f} s where all kernels "
                       "must be compiled" if "mono.compile_s" in found else None),
        ("machine", f"{here['cpu']}, {here['cores']} cores, {here['vectors']}, Python {here['python']}, Numba {here['numba']}, "
                    f"OpenCV {here['opencv-python-headless']}"),
    ])  # fmt: skip


def _megabytes(value: float | None) -> str:
    return "not known here" if value is None else f"{value:.1f} MB"


if __name__ == "__main__":
    main()
