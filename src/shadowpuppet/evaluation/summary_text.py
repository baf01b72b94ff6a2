"""Sentences about an evaluation, for tables and pages."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from shadowpuppet.evaluation.interval_coverage import LEVELS
from shadowpuppet.motion.limbs import DOUBTFUL
from shadowpuppet.motion.motion import BLANK

WAYS = {"none": "as they stand", "whole": "the whole run moved and turned once", "frame_offset": "each frame moved",
        "root": "from the {root}", "rigid": "each frame moved and turned", "similar": "each frame moved, turned and scaled (PA-MPJPE)"}
"""The alignments of `error_metrics.aligned_errors`, in words."""
OVERLAPS = {"good": 0.85, "fair": 0.7}
"""Least overlap of body and silhouette for each word; below that it is poor."""


def root_text(aligned: Mapping[str, Any]) -> str:
    """The root joint in words."""
    return "middle of both " + aligned["root_joint"].split("_")[-1] + "s" if " and " in aligned["root_joint"] else aligned["root_joint"]


def coverage_text(coverage: Mapping[str, Any] | None) -> str:
    """Coverage of the stated intervals, and a verdict."""
    if coverage is None:
        return "none stated: the run has no standard deviations, so no intervals can be checked"
    shares = ", ".join(f"{100 * coverage[f'within_{level}']:.0f} % within those of {level} %" for level in LEVELS)
    verdict = "too narrow" if coverage["rms_z"] > 1.1 else "too wide" if coverage["rms_z"] < 0.9 else "right"
    return f"{shares}; errors are {coverage['rms_z']:.2f} of the stated deviations (rms): {verdict}"


def overlap_sense(overlap: float) -> str:
    """An overlap of body and silhouette in a word."""
    return next((word for word, least in OVERLAPS.items() if overlap >= least), "poor")


def doubt_text(metrics: Mapping[str, Any]) -> str | None:
    """Share of frames in which each limb is doubtful; None if unknown or without frames."""
    limbs = metrics.get("limb_status")
    if not limbs or not metrics["frames"]:
        return None
    shares = {limb.replace("_", " "): sum(counts.get(status, 0) for status in DOUBTFUL) / max(_placed(counts), 1)
              for limb, counts in limbs.items()}
    doubtful = ", ".join(f"{limb} in {_percent(share)}" for limb, share in shares.items() if share).replace(" in ", " doubtful in ", 1)
    return doubtful or "no limb doubtful"


def _placed(counts: Mapping[str, int]) -> int:
    """Number of frames in which a limb has a place."""
    return sum(count for status, count in counts.items() if status not in BLANK)


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %" if share >= 0.01 else "under 1 %"


def losses_text(losses: Mapping[str, Any]) -> str | None:
    """Number of frames without a pose, and the longest gap; None without such frames."""
    if not losses["frames"]:
        return None
    return (f"{losses['frames']} frames ({100 * losses['share']:.1f} %) in {losses['gaps']} gaps; the longest {losses['longest_frames']} "
            f"frames, {losses['longest_s']:.2f} s, from {losses['longest_from_s']:.2f} s")


def world_text(world: Mapping[str, Any]) -> str:
    """The rigid motion between run and truth."""
    return (f"as a whole the run is turned by {world['rotation_deg']:.1f} degrees and {np.linalg.norm(world['moved_mm']):.0f} mm off"
            + ("; all errors are stated after that" if world["moved"] else ""))


def clock_text(clock: Mapping[str, Any]) -> str:
    """Frame rates, offset, and the number of times compared."""
    rates = f"run {clock['run_hz']:.4g}, truth {clock['truth_hz']:.4g} frames/s, compared at {clock['frames_compared']} times"
    if "speed_error_m_s" not in clock:
        return rates + (f"; {clock['offset_s']:+.3f} s added to the truth's times" if clock["offset_s"] else "")
    before = clock["speed_error_before_m_s"]
    was = f", {before:.2f} before" if np.isfinite(before) else ""
    return (f"{rates}; {clock['offset_s']:+.3f} s found and added to the truth's times (speeds differ by "
            f"{clock['speed_error_m_s']:.2f} m/s{was})")


def bones_text(bones: Mapping[str, Mapping[str, float]]) -> str:
    """Errors of bone lengths, and their change over time."""
    worst = max(bones, key=lambda name: abs(bones[name]["longer_mm"]))
    change = max(bone["run_sd_mm"] for bone in bones.values())
    off = np.mean([abs(bone["longer_mm"]) for bone in bones.values()])
    return (f"{off:.1f} mm from the truth's in the mean, worst {worst} by {bones[worst]['longer_mm']:+.1f}; lengths change by "
            f"{change:.2f} mm (sd) at most, the truth's by {max(bone['truth_sd_mm'] for bone in bones.values()):.2f}")


def exchanges_text(found: Mapping[str, Mapping[str, float]] | None) -> str | None:
    """Share of the frames in which arms or legs are nearer to the other side's; None if unknown."""
    if not found:
        return None
    if not any(pair["frames"] for pair in found.values()):
        return "never"
    return "; ".join(f"{name} in {_percent(pair['share'])} of the frames, for {pair['longest_s']:.2f} s at most" if pair["frames"]
                     else f"{name} never" for name, pair in found.items())


def feet_text(feet: Mapping[str, Any]) -> str | None:
    """How the feet stand, in words; None for a run without soles."""
    if not feet:
        return None
    true = feet.get("true_stance")
    shown = true or feet
    beside = "" if true is None else f" (the truth's points {_plain(true['truth_slide_mm_s'])})"
    contacts = ""
    if true is not None and np.isfinite([true["precision"], true["recall"]]).all():
        contacts = (f"; contacts found are right in {_percent(true['precision'])}, {_percent(true['recall'])} of the true ones are "
                    "found")
    below = f", {shown['depth_mm']['mean']:.1f} mm below the floor in the mean" if shown["depth_mm"] else ""
    return f"in stance they slide by {_plain(shown['slide_mm_s'])} mm/s{beside}{below}{contacts}; floor at {feet['floor_m']:.3f} m"


def gait_text(gait: Mapping[str, Any]) -> str | None:
    """The gait in words; None for a run without contacts of feet."""
    if not gait:
        return None
    if not gait["figures"]:
        return gait["no_gait"]
    cadence, length, width, stance, speed = (gait["figures"][name]["both"]["mean"] for name in (
        "cadence", "step length", "step width", "stance", "speed"))
    strides, steps = (f"{gait[what]} {what.removesuffix('s') if gait[what] == 1 else what}" for what in ("strides", "steps"))
    return (f"{strides}, {steps}: {cadence:.1f} steps/min, {length:.3f} m long, {width:.3f} m wide, "
            f"{speed:.2f} m/s, stance {stance:.1f} %")


def _plain(value: float) -> str:
    return f"{value:.0f}" if np.isfinite(value) else "unknown"
