"""Whether a demo left what it promises, and errors that a working tracker has: python .ci/check_demo.py FOLDER."""

from __future__ import annotations

import csv
import json
import sys
import tomllib
from pathlib import Path

EXPECTED = ("joints.csv", "angles.csv", "motion.npz", "run.toml", "metrics.json", "look.json", "person.toml", "calibration.toml",
            "overlay.mp4", "overlay.png")
LOST = 0.05
"""Share of lost frames from which on something is broken; no measure of quality, as the limits below."""
RUNS = {"run": ("plane_mm", 100.0, 0.8), "run-ring": ("rmse_mm", 150.0, 0.75)}
"""By folder: the error and its limit (mm), and the least mean overlap. With several cameras one arm astray is 100 mm."""


def checked(folder: Path, error: str, most: float, least: float) -> dict[str, bool]:
    """What a run must have, and whether it has."""
    missing = [name for name in EXPECTED if not (folder / name).is_file() or not (folder / name).stat().st_size]
    if missing:
        sys.exit(f"{folder}: missing or empty: {', '.join(missing)}")
    metrics = json.loads((folder / "metrics.json").read_text("utf-8"))
    errors, frames = metrics["errors"], metrics["frames"]
    with (folder / "joints.csv").open(encoding="utf-8") as file:
        rows = sum(1 for _ in csv.DictReader(file))
    return {
        "run.toml says complete": tomllib.loads((folder / "run.toml").read_text("utf-8"))["complete"],
        "a row a frame": rows == frames > 80,
        f"under {LOST:.0%} of the frames lost": errors["lost"] <= LOST * frames,
        f"{error} {errors[error]:.1f}, under {most:.0f}": errors[error] < most,
        f"overlap {metrics['overlap']['mean']:.3f}, over {least}": metrics["overlap"]["mean"] > least,
    }


checks = {f"{name}: {what}": good for name, limits in RUNS.items() for what, good in checked(Path(sys.argv[1]) / name, *limits).items()}
for what, good in checks.items():
    print(f"{'ok    ' if good else 'FAILED'}  {what}")
sys.exit(0 if all(checks.values()) else 1)
