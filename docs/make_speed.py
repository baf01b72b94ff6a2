"""Make the table of docs/speed.md and its picture: python docs/make_speed.py [FIGURES.json]; without figures, they are measured first."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from typing import Any

from shadowpuppet.bench.mono import run_bench
from shadowpuppet.plots import plot_curves
from shadowpuppet.tables import BENCHED

PAGE = Path(__file__).parent / "speed.md"
PICTURE = PAGE.parent / "assets" / "speed.png"
PLACE = re.compile(r"(<!-- figures -->\n).*?(<!-- end of figures -->)", re.DOTALL)
KEYS = {
    "ratio_opencv_full": ("OpenCV's time over ours, all cards", ".1f"),
    "ratio_opencv_arm": ("OpenCV's time over ours, an arm's stage", ".1f"),
    "ratio_naive_frame": ("the naive filter's time over ours, a frame", ".0f"),
    "ratio_boxes": ("boxes' time over cardbox's", ".2f"),
    "step_fps": ("frames/s of the filter, Table I", ".0f"),
    "default_fps": ("frames/s of the filter, default preset", ".0f"),
    "chain_fps": ("frames/s from film to pose, default preset, one core", ".0f"),
    "decode_ms": ("of which decoding, ms a frame", ".2f"),
    "segment_ms": ("segmentation, ms a frame", ".2f"),
    "track_ms": ("filter, ms a frame", ".2f"),
    "write_ms": ("writing, ms a frame", ".2f"),
    "peak_mb": ("memory at most, MB", ".0f"),
    "growth_mb": ("memory's growth over the film, MB", ".1f"),
    "compile_s": ("start to first pose, all kernels compiled anew, s", ".1f"),
    "start_s": ("start to first pose, kernels there, s", ".1f"),
}


def tables(found: dict[str, Any]) -> str:
    """What was found, as tables in Markdown."""
    here, raw = found["environment"], found["raw"]
    lines = [f"{here['cpu']} ({here['llvm_cpu']}), {here['cores']} cores, {here['vectors']}; Python {here['python']}, "
             f"NumPy {here['numpy']}, Numba {here['numba']}, OpenCV {here['opencv-python-headless']}.",
             "", "| | median | least | |", "|---|---:|---:|---|"]
    for key, name, scale, unit, _ in BENCHED:
        lines.append(f"| {name.strip()} | {scale * raw[key]['median']:.3g} | {scale * raw[key]['least']:.3g} | {unit} |")
    lines += ["", "| key | what | |", "|---|---|---:|"]
    for key, (what, form) in KEYS.items():
        if (value := found.get(f"mono.{key}")) is not None:
            lines.append(f"| `mono.{key}` | {what} | {value:{form}} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Write the tables into the page, and the picture beside it."""
    found = json.loads(Path(sys.argv[1]).read_text("utf-8")) if len(sys.argv) > 1 else run_bench()
    text, number = PLACE.subn(lambda match: match[1] + tables(found) + match[2], PAGE.read_text("utf-8"))
    if number != 1:
        sys.exit(f"{PAGE}: found no place for the figures")
    PAGE.write_text(text, encoding="utf-8")
    plot_curves(found["curves"], PICTURE)


if __name__ == "__main__":
    main()
