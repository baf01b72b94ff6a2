"""Whether a demo left what it promises, and errors that a working tracker has: python .ci/check_demo.py FOLDER."""

from __future__ import annotations

import csv
import json
import sys
import tomllib
from pathlib import Path

EXPECTED = ("joints.csv", "angles.csv", "motion.npz", "run.toml", "metrics.json", "look.json", "person.toml", "calibration.toml",
            "overlay.mp4", "overlay.png")
PLANE, LOST = 100.0, 0.05
"""Mean error across the camera's axis (mm) and share of lost frames from which on something is broken; no measure of quality."""

folder = Path(sys.argv[1]) / "run"
missing = [name for name in EXPECTED if not (folder / name).is_file() or not (folder / name).stat().st_size]
if missing:
    sys.exit(f"{folder}: missing or empty: {', '.join(missing)}")
metrics = json.loads((folder / "metrics.json").read_text("utf-8"))
errors, frames = metrics["errors"], metrics["frames"]
with (folder / "joints.csv").open(encoding="utf-8") as file:
    rows = sum(1 for _ in csv.DictReader(file))
checks = {
    "run.toml says complete": tomllib.loads((folder / "run.toml").read_text("utf-8"))["complete"],
    "a row a frame": rows == frames > 100,
    f"under {LOST:.0%} of the frames lost": errors["lost"] <= LOST * frames,
    f"plane error under {PLANE:.0f} mm": errors["plane_mm"] < PLANE,
    "overlap over 0.8": metrics["overlap"]["mean"] > 0.8,
}
for what, good in checks.items():
    print(f"{'ok    ' if good else 'FAILED'}  {what}")
sys.exit(0 if all(checks.values()) else 1)
