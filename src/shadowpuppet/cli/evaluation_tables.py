"""What `evaluate` shows beside the errors of joints, in words and tables of 80 columns."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from rich.console import RenderableType

from shadowpuppet.cli.tables import angle_table, error_table, measures_table, pairs, plain_table
from shadowpuppet.evaluation.summary_text import WAYS, bones_words, clock_words, coverage_words, losses_words, said_root, world_words

FEW = 2
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
