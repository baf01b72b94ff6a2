"""Tables of 80 columns on standard output: the helpers, and the tables that several commands show.

Names and values in tables may come from anywhere: nothing in them is markup, and no control character is printed."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console, ConsoleOptions, Group, RenderableType
from rich.measure import Measurement
from rich.segment import Segment
from rich.table import Table

from shadowpuppet.errors import printable
from shadowpuppet.output import say, say_text, without_controls

if TYPE_CHECKING:
    from shadowpuppet.pipeline.findings.verdict import Verdict


SENSES = {"uncertain": " (the outline fits badly, or no limb is sure)", "predicted": " (bridged or unseen)", "lost": " (nothing fits)",
          "absent": " (nobody in the picture)"}
"""Meaning of a frame's status, beside it in a table; `tracked` needs no words."""


class PlainConsole(Console):
    """A console that takes no text for markup, and prints no control characters but its own."""

    def __init__(self, error: bool = False, quiet: bool = False) -> None:
        """On standard output, or standard error if `error`; prints nothing if `quiet`."""
        super().__init__(stderr=error, quiet=quiet, highlight=False, markup=False, emoji=False)

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """The segments that a renderable is printed as."""
        for segment in super().render(renderable, options):
            yield segment if segment.control else Segment(without_controls(segment.text), segment.style)


def show(*parts: RenderableType) -> None:
    """Print tables with an empty line between them; where there is no terminal, as wide as they need, so that nothing is cut off."""
    console = PlainConsole()
    usual = console.width
    for n, part in enumerate(parts):
        if not console.is_terminal:
            console.width = max(usual, _least_width(console, part))
        with console.capture() as captured:
            console.print(printable(part) if isinstance(part, str) else part)
        lines = [line.rstrip() for line in captured.get().splitlines()]  # rich pads columns with blanks
        print("\n" * bool(n) + "\n".join(lines))  # noqa: T201 - with the terminal's own colours


def _least_width(console: Console, part: RenderableType) -> int:
    """Columns below which a table cuts cells off; 0 for what folds them instead."""
    if isinstance(part, Group):
        return max((_least_width(console, each) for each in part.renderables), default=0)
    if not isinstance(part, Table) or not all(column.no_wrap for column in part.columns):
        return 0
    return Measurement.get(console, console.options.update(max_width=10_000), part).maximum


def show_next(*commands: str) -> None:
    """Print commands to try next, each on one line however long it is, so that it can be pasted."""
    say("")
    say("next")
    for command in commands:
        say(f"  {command}")


def show_json(value: Any) -> None:
    """Print a value as JSON; control characters in names are escaped."""
    from shadowpuppet.io.files.plain import json_text

    say_text("".join(sign if sign.isprintable() or sign == "\n" else json.dumps(sign)[1:-1] for sign in json_text(value)))


def pairs(rows: Iterable[tuple[str, str | Sequence[str] | None]]) -> Table:
    """Table of names and values, each a line or several; rows without a value (None) are left out."""
    grid = Table.grid(padding=(0, 2))
    grid.add_column(no_wrap=True, style="bold")
    grid.add_column(overflow="fold")
    for name, value in rows:
        if value is not None:
            grid.add_row(printable(name), printable(value) if isinstance(value, str) else "\n".join(map(printable, value)))
    return grid


def table(title: str, columns: Sequence[str], rows: Iterable[Sequence[str]], right: Sequence[int] | None = None) -> Table:
    """A table without lines, its columns `right` (default: all but the first) aligned to the right; a row "all" is set off."""
    out = Table(title=printable(title), title_justify="left", title_style="bold", box=None, padding=(0, 2, 0, 0), header_style="dim")
    for n, column in enumerate(columns):
        out.add_column(column, justify="right" if (n in right if right is not None else n) else "left", no_wrap=True)
    for row in rows:
        if row[0] == "all":
            out.add_section()
        out.add_row(*map(printable, row))
    return out


def seen_height(height: float | None) -> str | None:
    """What the silhouettes span where the cameras see the person (m), in words: a check of the calibration, not the person's height, which
    is given or measured."""
    return None if height is None else f"silhouettes span {height:.2f} m, raised hands, hair and shoes included"


def verdict_table(verdict: Verdict, title: str) -> RenderableType:
    """The verdict in a word, or two with depth, and the reasons below it."""
    joined = "but" if verdict.words == "good" else "because"
    return pairs([(title, verdict.words), *(("" if n else joined, reason) for n, reason in enumerate(verdict.reasons))])


def verdict_of(plain: Mapping[str, Any], title: str) -> RenderableType:
    """The table of a verdict as a run's metrics keep it."""
    from shadowpuppet.pipeline.findings.verdict import Verdict

    return verdict_table(Verdict.of(plain), title)


def files_in(folder: Path, *names: str) -> tuple[str, list[str]]:
    """The row that names those files of a folder that exist."""
    return "made", [str(folder / name) for name in names if (folder / name).exists()]


def error_table(errors: Mapping[str, Any]) -> RenderableType:
    """Joint errors, a row a joint."""
    from shadowpuppet.motion.metrics import FAR_ERROR

    keys = [key for key in ("mean_mm", "rmse_mm", "plane_mm", "depth_mm", "p95_mm", "max_mm") if key in errors]
    rows = ((name, *(f"{row[key]:.1f}" for key in keys), f"{100 * row['far']:.1f} %") for name, row in
            [*errors["joints"].items(), ("all", errors)])  # fmt: skip
    return table("joint errors, mm", ("joint", *(key.removesuffix("_mm") for key in keys), f"over {1000 * FAR_ERROR:.0f}"), rows)


def metrics_table(metrics: Mapping[str, Any]) -> RenderableType:
    """Metrics of a run, with and without a truth."""
    from shadowpuppet.evaluation.summary_text import doubt_text, overlap_sense
    from shadowpuppet.motion.metrics import FAR_ERROR, LOST_ERROR

    multiview, overlap = "cost_m2" in metrics, metrics["overlap"]
    statuses = ", ".join(f"{count} {status}{SENSES.get(status, '')}" for status, count in metrics["status"].items())
    jitter, truth_jitter = metrics["jitter_m_s2"], metrics.get("truth_jitter_m_s2")
    rows: list[tuple[str, str | None]] = [
        ("frames", f"{metrics['frames']}: {statuses}" if statuses else "none"),
        ("doubt", doubt_text(metrics)),
        ("legs", "not tracked; --body anatomical tracks them, with much doubt, if feet are seen" if _lacks_legs(metrics) else None),
        ("overlap", f"{overlap['mean']:.3f}, {overlap_sense(overlap['mean'])} (IoU of body and silhouette; p5 {overlap['p5']:.3f})"
                    if overlap["count"] else None),
        ("jitter", None if jitter is None or not isfinite(jitter) else f"{jitter:.2f} m/s2"
                   + (f", the truth's {_number(truth_jitter)}" if truth_jitter is not None else "")),
    ]  # fmt: skip
    if errors := metrics.get("errors"):
        parts = f"rmse {errors['rmse_mm']:.1f}" if multiview else f"plane {errors['plane_mm']:.1f}, depth {errors['depth_mm']:.1f}"
        lost, known, frames = errors["lost"], errors["frames"], metrics["frames"]
        rows += [
            ("error", f"{errors['mean_mm']:.1f} mm (MPJPE; {parts}); {errors['aligned_mean_mm']:.1f} mm with each frame moved to the "
                      f"truth's place; {100 * errors['far']:.1f} % off by over {1000 * FAR_ERROR:.0f} mm"),
            ("lost", f"{lost} of the truth's {known} frames have no pose: {1000 * LOST_ERROR:.0f} mm off each" if lost else None),
            ("compared", f"the truth has {known} frames, the run {frames}: is it this recording's?"
                         if known != frames and "clock" not in metrics else None),
        ]  # fmt: skip
    return pairs(rows)


def _lacks_legs(metrics: Mapping[str, Any]) -> bool:
    """Whether a run is of a body without legs."""
    limbs = metrics.get("limb_status")
    return bool(limbs) and not any(limb.endswith("leg") for limb in limbs)


def people_table(people: Mapping[Any, Mapping[str, Any]]) -> RenderableType:
    """A row for each of several people, from their metrics."""
    def row(number: Any, one: Mapping[str, Any]) -> tuple[str, ...]:
        overlap, errors = one["overlap"], one.get("errors")
        return (f"person {number}", str(one["frames"]), ", ".join(f"{count} {status}" for status, count in one["status"].items() if count),
                f"{overlap['mean']:.2f}" if overlap["count"] else "", "" if errors is None else f"{errors['mean_mm']:.1f}")

    return table("people", ("", "frames", "status", "overlap", "error, mm"), [row(*each) for each in people.items()], right=(1, 3, 4))


def _number(value: float | None) -> str:
    return "unknown" if value is None or not isfinite(value) else f"{value:.2f}"
