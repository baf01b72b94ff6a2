"""The command `check`: a calibration tested against silhouettes."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter
from rich.console import Group, RenderableType

from shadowpuppet.cli.calibration.explain import is_explained
from shadowpuppet.cli.flags import OF_TRACKING, AsJson, Config, Switch, flags_of, options_from, unpacked
from shadowpuppet.cli.tables import pairs, seen_height, show, show_json, table
from shadowpuppet.errors import RecordingError
from shadowpuppet.pipeline.options import Options

if TYPE_CHECKING:
    from shadowpuppet.pipeline.repair.check import CalibrationCheck
    from shadowpuppet.pipeline.repair.fix import Fix

    CheckFlags = Any
else:
    NOT_ASKED = ("anyway", "body", "prior", "distance", "fov", "background", "region")
    CheckFlags = unpacked(flags_of(Options, without=(*OF_TRACKING, *NOT_ASKED)))
    """Options of what is looked at in films of several cameras, without tracking."""


def check(recording: Annotated[Path, Parameter(help="Folder with video/ and a calibration, of two cameras or more.")], /, *,
          fix: Switch = False, config: Config = None, as_json: AsJson = False, flags: CheckFlags = None) -> None:
    """Test a calibration against the silhouettes of a recording: which camera disagrees with the others, by how many pixels, how far it was
    turned; and by how many frames each film is late.

    Parameters
    ----------
    fix
        Write what is certain: films' delays into [start] of recording.toml;
        turned cameras, and a wrong scale if --height is given, into a new calibration.toml; the old files are kept beside them.
        Shows the disagreement in pixels before and after.
    """
    from shadowpuppet.cli.terminal import terminal
    from shadowpuppet.pipeline.repair.films import check_films
    from shadowpuppet.pipeline.repair.fix import fix_recording
    from shadowpuppet.pipeline.rig import open_rig

    if recording.is_file() and is_explained(recording):
        raise RecordingError(f"{recording}: is a calibration, expected a recording with films to test it on; `info` explains it")
    if recording.is_file():
        raise RecordingError(f"{recording}: found one film, expected the folder of a recording of two cameras or more")
    options = options_from(flags, config)
    with terminal(quiet=as_json) as listener:
        rig = open_rig(recording, options)
        checked = check_films(rig, options, listener)
        found = checked.check
        mended = fix_recording(rig, checked) if fix else None
    if as_json:
        show_json(found if mended is None else {"check": found, "fix": mended})
    else:
        show(check_table(found), *([fix_table(mended)] if mended is not None else []))


def check_table(check: CalibrationCheck) -> RenderableType:
    """Disagreement of each camera with the others, and the verdict."""
    found = check.agreement
    columns = ("camera", "disagrees by", "with", "late by", "90 % within", "")
    clock = "clock" if check.clock is None else check.clock.by
    rows: list[tuple[str, str | None]] = [
        ("recording", check.recording),
        ("compared", f"{check.sets} sets of silhouettes, {check.rate:.4g} a second, of {check.frame_rate:.4g} frames/s"),
        ("limit", f"{found.limit:.1f} px; cameras that fit are apart by about one"),
        ("seen", seen_height(found.height)),
        ("time", f"by the films' {clock}" if check.by_clock else "cannot tell: nobody moves enough" if check.still else None),
        (clock, _stated(check)),
    ]
    verdict = "all cameras agree" if check.good else check.doubts
    return Group(pairs(rows), "", table("", columns, _agreement_rows(check), right=(1, 3, 4)), "", pairs([("verdict", verdict)]))


def _stated(check: CalibrationCheck) -> str | None:
    """Offsets by the films' clocks, in frames."""
    if check.clock is None:
        return None
    stated = [f"{name} {seconds * check.frame_rate:+.1f}" for name, seconds in zip(check.clock.names, check.clock.seconds)
             if seconds is not None]
    return f"late by {', '.join(stated)} frames" if stated else "the films share no sound that stands out"


def _agreement_rows(check: CalibrationCheck) -> Iterator[tuple[Any, ...]]:
    found, late = check.agreement, check.lateness
    for n, name in enumerate(found.names):
        apart, others = found.apart[n], sum(pair is not None for pair in found.pairs[n])
        frames, spread = (None, None) if late is None else (late.frames[n], late.spread[n])
        wrong = [word for word, bad in (("place", name in found.wrong or name in check.turns), ("time", name in check.late)) if bad]
        yield (name, "unknown" if apart is None else f"{apart:.1f} px", f"{others} others",
               "cannot tell" if frames is None else f"{round(frames, 1) + 0.0:.1f} frames", "" if spread is None else f"± {spread:.1f}",
               f"wrong: {' and '.join(wrong)}" if wrong else "")


def fix_table(fix: Fix) -> RenderableType:
    """What `--fix` wrote, with the disagreement before and after."""
    rows = [(name, f"{before:.1f} px" if before is not None else "unknown", f"{after:.1f} px" if after is not None else "unknown")
            for name, before, after in fix.pixels]
    parts: list[RenderableType] = [pairs([("fix", fix.done or "nothing is certain enough to be changed")])]
    if fix.done:
        parts += ["", table("", ("camera", "before", "after"), rows)]
    return Group(*parts)
