"""Make the tables of docs/speed.md: python docs/make_speed.py [FIGURES.json]; without a file of figures, they are measured first."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.bench import FACTORS, MONO_ROWS, MULTI_ROWS, run_bench

PAGE = Path(__file__).parent / "speed.md"
PLACE = re.compile(r"(<!-- figures -->\n).*?(<!-- end of figures -->)", re.DOTALL)
KEYS = {
    "mono.ratio_opencv_full": ("OpenCV's time over ours, all cards", ".1f"),
    "mono.ratio_opencv_arm": ("OpenCV's time over ours, an arm's stage", ".1f"),
    "mono.ratio_naive_frame": ("the naive filter's time over ours, a frame", ".0f"),
    "mono.ratio_boxes": ("boxes' time over cardbox's", ".2f"),
    "mono.ratio_naive_correction": ("plain correction's time over ours, clean film", ".0f"),
    "mono.step_fps": ("frames/s of the filter, Table I", ".0f"),
    "mono.default_fps": ("frames/s of the filter, default preset", ".0f"),
    "mono.chain_fps": ("frames/s from film to pose, default preset, one core", ".0f"),
    "mono.decode_ms": ("of which decoding, ms a frame", ".2f"),
    "mono.segment_ms": ("segmentation, ms a frame", ".2f"),
    "mono.track_ms": ("filter, ms a frame", ".2f"),
    "mono.write_ms": ("writing, ms a frame", ".2f"),
    "mono.peak_mb": ("peak memory, MB", ".0f"),
    "mono.growth_mb": ("memory growth over the film, MB", ".1f"),
    "mono.compile_s": ("start to first pose, empty kernel cache, s", ".1f"),
    "mono.start_s": ("start to first pose, kernels cached, s", ".1f"),
    "multi.points": ("seven cameras: surface points of a frame", ".0f"),
    "multi.hull_ms": ("visual hull, ms a frame", ".1f"),
    "multi.force_us": ("forces, us a particle and iteration", ".1f"),
    "multi.gauss_newton_us": ("Gauss-Newton, us a particle and iteration", ".1f"),
    "multi.ratio_naive": ("plain NumPy's time over ours, forces", ".0f"),
    "multi.ratio_naive_gauss_newton": ("the same, Gauss-Newton", ".0f"),
    "multi.forces_fps": ("frames/s from masks, `ni2008`, one core", ".0f"),
    "multi.fps": ("frames/s from masks, default preset, one core", ".0f"),
    "multi.chain_fps": ("frames/s from film to pose, default preset, two cores", ".0f"),
    "multi.peak_mb": ("peak memory, MB", ".0f"),
}


def tables(found: dict[str, Any]) -> str:
    """The results as Markdown tables."""
    here, raw = found["environment"], found["raw"]
    lines = [f"{here['cpu']} ({here['llvm_cpu']}), {here['cores']} cores, {here['vectors']}; Python {here['python']}, "
             f"NumPy {here['numpy']}, Numba {here['numba']}, OpenCV {here['opencv-python-headless']}.",
             "", "| | median | least | |", "|---|---:|---:|---|"]
    for key, name, unit, _ in (*MONO_ROWS, *MULTI_ROWS):
        lines.append(f"| {name.strip()} | {FACTORS[unit] * raw[key]['median']:.3g} | {FACTORS[unit] * raw[key]['least']:.3g} | {unit} |")
    lines += ["", "| key | what | |", "|---|---|---:|"]
    for key, (what, form) in KEYS.items():
        if (value := found.get(key)) is not None:
            lines.append(f"| `{key}` | {what} | {value:{form}} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Write the tables into the page."""
    found = json.loads(Path(sys.argv[1]).read_text("utf-8")) if len(sys.argv) > 1 else run_bench()
    text, number = PLACE.subn(lambda match: match[1] + tables(found) + match[2], PAGE.read_text("utf-8"))
    if number != 1:
        sys.exit(f"{PAGE}: found no place for the figures")
    PAGE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
