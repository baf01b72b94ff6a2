"""What `evaluate` shows beside the errors of joints, in words and tables of 80 columns."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import RenderableType

from shadowpuppet.intervals import LEVELS
from shadowpuppet.tables import angle_table, error_table, measures_table, pairs, plain_table

WAYS = {"none": "as they stand", "whole": "the whole run moved and turned once", "frame_offset": "each frame moved",
        "root": "from the {root}", "rigid": "each frame moved and turned", "similar": "each frame moved, turned and scaled"}
"""The ways in which runs are laid over truths (`measures.aligned_errors`), in words."""
FEW = 3
"""Degrees of freedom in a row of a list of them."""


def evaluation_tables(measured: Mapping[str, Any], written: Mapping[str, Path] | None = None) -> list[RenderableType]:
    """All that `evaluate` shows; `written`: files by what is in them."""
    parts = [measures_table(measured)]
    if "errors" in measured:
        parts += [error_table(measured["errors"]), ways_table(measured["aligned_mm"])]
    if "angles_deg" in measured:
        parts += [angle_table(measured["angles_deg"])]
    parts += [pairs([*_rows(measured), *((what, str(path)) for what, path in (written or {}).items())])]
    return parts


def ways_table(aligned: Mapping[str, Any]) -> RenderableType:
    """Mean errors after run and truth are laid over each other in more and more ways."""
    table = plain_table("mean error, mm, run and truth laid over each other", ("", "mm"))
    for way, words in WAYS.items():
        if way in aligned:
            table.add_row(words.format(root=said_root(aligned)), f"{aligned[way]:.1f}")
    return table


def said_root(aligned: Mapping[str, Any]) -> str:
    """The root in words."""
    return "middle of both " + aligned["root_joint"].split("_")[-1] + "s" if " and " in aligned["root_joint"] else aligned["root_joint"]


def coverage_words(coverage: Mapping[str, Any] | None) -> str:
    """Whether stated intervals are honest."""
    if coverage is None:
        return "none stated: the run has no standard deviations, so no intervals can be checked"
    shares = ", ".join(f"{100 * coverage[f'within_{level}']:.0f} % within those of {level} %" for level in LEVELS)
    verdict = "too narrow" if coverage["rms_z"] > 1.1 else "too wide" if coverage["rms_z"] < 0.9 else "right"
    return f"{shares}; errors are {coverage['rms_z']:.2f} of the stated deviations (rms): {verdict}"


def losses_words(losses: Mapping[str, Any]) -> str:
    """How many frames have no pose, and how long that lasted."""
    if not losses["frames"]:
        return "no frame"
    return (f"{losses['frames']} frames ({100 * losses['share']:.1f} %) in {losses['gaps']} gaps; the longest {losses['longest_frames']} "
            f"frames, {losses['longest_s']:.2f} s, from {losses['longest_from_s']:.2f} s")


def world_words(world: Mapping[str, Any]) -> str:
    """What one rigid motion of the whole makes good."""
    return (f"as a whole the run is turned by {world['rotation_deg']:.1f} degrees and {np.linalg.norm(world['moved_mm']):.0f} mm off"
            + ("; all errors are told after that" if world["moved"] else ""))


def clock_words(clock: Mapping[str, Any]) -> str:
    """How the clocks stand and at how many times run and truth were compared."""
    rates = f"run {clock['run_hz']:.4g}, truth {clock['truth_hz']:.4g} frames/s, compared at {clock['frames_compared']} times"
    if "speed_error_m_s" not in clock:
        return rates + (f"; {clock['offset_s']:+.3f} s added to the truth's times" if clock["offset_s"] else "")
    before = clock["speed_error_before_m_s"]
    was = f", {before:.2f} before" if np.isfinite(before) else ""
    return (f"{rates}; {clock['offset_s']:+.3f} s found and added to the truth's times (speeds differ by "
            f"{clock['speed_error_m_s']:.2f} m/s{was})")


def _rows(measured: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    yield "no pose", losses_words(measured["losses"])
    if "errors" not in measured:
        return
    yield "clock", clock_words(measured["clock"])
    if measured["world"]:
        yield "world", world_words(measured["world"])
    axes = measured["axes_mm"]
    if axes:
        said = (f"{axis} {axes[axis]['mean']:+.1f} (rmse {axes[axis]['rmse']:.1f})" for axis in "xyz")
        yield "axes", ", ".join(said) + " mm, run less truth"
    human = measured["humaneva"]
    if "mean_mm" in human:
        yield "HumanEva", f"{human['mean_mm']:.1f} mm (sd {human['sd_mm']:.1f}) over its 15 joints"
    if measured["bends_deg"]:
        yield "bends", ", ".join(f"{joint} {value['rmse']:.1f}" for joint, value in measured["bends_deg"].items()) + " degrees (rmse)"
    moves = measured["acceleration"]
    if moves:
        yield "moves", (f"accelerations of {moves['run_m_s2']:.1f} m/s2, the truth's {moves['truth_m_s2']:.1f}; they differ by "
                        f"{moves['difference_m_s2']:.1f} in the mean")
    if measured["bone_errors"]:
        yield "bones", bones_words(measured["bone_errors"])
    yield "intervals", coverage_words(measured["coverage"])
    if "dofs_deg" in measured:
        dofs = list(measured["dofs_deg"].items())
        yield "angles", "\n".join(", ".join(f"{name} {value['rmse']:.1f}" for name, value in dofs[n : n + FEW])
                                  for n in range(0, len(dofs), FEW)) + "\n(rmse, degrees)"


def bones_words(bones: Mapping[str, Mapping[str, float]]) -> str:
    """How far bones are from the truth's lengths, and how much they change."""
    worst = max(bones, key=lambda name: abs(bones[name]["longer_mm"]))
    change = max(bone["run_sd_mm"] for bone in bones.values())
    off = np.mean([abs(bone["longer_mm"]) for bone in bones.values()])
    return (f"{off:.1f} mm from the truth's in the mean, worst {worst} by {bones[worst]['longer_mm']:+.1f}; lengths change by "
            f"{change:.2f} mm (sd) at most, the truth's by {max(bone['truth_sd_mm'] for bone in bones.values()):.2f}")
