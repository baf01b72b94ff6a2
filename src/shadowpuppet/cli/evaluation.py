"""The command `evaluate`: how good a run is, as a table, as figures in a file, as a page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from shadowpuppet.cli.flags import RUN, AsJson, Quiet

Switch = Annotated[bool, Parameter(negative=(), show_default=False)]


def evaluate(run: Path, truth: Path | None = None, /, *, joints: str | None = None, start: int = 0, end: int | None = None,
             offset: float = 0.0, sync: Switch = False, align: Switch = False, angles: Switch = False,
             file: Annotated[Path | None, Parameter(name=["--output", "-o"], group=RUN, help="File that gets all figures (.json).")] = None,
             report: Annotated[Path | None, Parameter(group=RUN, help="File that gets a page with plots and pictures (.html); needs "
                                                                      "matplotlib.")] = None,
             update: Annotated[bool, Parameter(group=RUN, negative=(), show_default=False, help="Put the figures into the run's own "
                                                                                                "metrics.json, too.")] = False,
             quiet: Quiet = False, as_json: AsJson = False) -> None:  # fmt: skip
    """Measure a run: errors of joints and motion against a truth, overlap, cost, jitter, what was lost.

    Parameters
    ----------
    run
        Folder that `track` made.
    truth
        Joints to compare with: .csv, .trc, .c3d, .bvh or .amc. [default: the recording's truth]
    joints
        Those compared, separated by commas; or upper, limbs, or humaneva (its 15). [default: upper; limbs where there are legs]
    start
        First frame of the truth that counts.
    end
        Last frame of the truth that counts. [default: its last]
    offset
        Seconds to be added to the truth's times.
    sync
        Find that offset, by the joints' speeds.
    align
        Move and turn the whole truth into the run's world first.
    angles
        Compare the angles of a whole body's joints, too, with those of the poses that fit the truth's joints best.
    """
    from shadowpuppet.cli.evaluation_tables import evaluation_tables
    from shadowpuppet.cli.terminal import show, show_json, terminal
    from shadowpuppet.evaluation.evaluation import Comparison, check_output, measure_run, update_metrics, write_evaluation
    from shadowpuppet.evaluation.report.page import check_report, write_report

    names = [name.strip() for name in joints.split(",")] if joints else None
    if file is not None:
        check_output(file, run, ".json")
    if report is not None:
        check_report(report, run)
    written = {}
    with terminal(quiet or as_json) as shown:
        shown.begin("measuring")
        found = measure_run(run, truth, Comparison(names, start, end, offset, sync, align, angles))
        if file is not None:
            write_evaluation(file, found.measured, run)
            written["figures"] = file
        if update:
            written["updated"] = update_metrics(found)
        if report is not None:
            shown.begin("drawing")
            write_report(report, found)
            written["report"] = report
    if as_json:
        show_json(found.measured)
    elif not quiet:
        show(*evaluation_tables(found.measured, written))
