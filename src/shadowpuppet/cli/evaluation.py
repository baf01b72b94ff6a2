"""The command `evaluate`: errors and other measures of a run, as tables, as numbers in a file, as a page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

from shadowpuppet.cli.flags import AsJson, Quiet, Switch, flag, output, switch
from shadowpuppet.cli.tables import error_table, metrics_table, pairs, people_table, show, show_json, table


def evaluate(run: Path, truth: Path | None = None, /, *, joints: str | None = None, start: str = "0", end: str | None = None,
             offset: float = 0.0, sync: Switch = False, align: Switch = False, angles: Switch = False,
             file: Annotated[Path | None, output("File that gets all figures (.json).")] = None,
             report: Annotated[Path | None, flag("File that gets a page with plots and pictures (.html); needs matplotlib.")] = None,
             movement: Annotated[Path | None, flag("File that gets steps, and angles over the gait cycle or their ranges (.csv).")] = None,
             update: Annotated[bool, switch("Also put the figures into the run's own metrics.json.")] = False,
             quiet: Quiet = False, as_json: AsJson = False) -> None:  # fmt: skip
    """Evaluate a run: errors of joints and motion against a truth, overlap, cost, jitter, frames without a pose.

    Parameters
    ----------
    run
        Folder that `track` made.
    truth
        Joints to compare with: .csv, .trc, .c3d, .bvh, .amc, .npz or .parquet. [default: the recording's truth]
    joints
        Joints to compare, separated by commas; or upper, or limbs. [default: upper; limbs where there are legs]
    start
        First frame of the truth to compare: its number (120 or 120f), or its time (3.5s).
    end
        Last frame of the truth to compare, likewise. [default: its last]
    offset
        Seconds to add to the truth's times.
    sync
        Find that offset, by the joints' speeds.
    align
        Move and turn the whole truth into the run's world first.
    angles
        Also compare joint angles of a whole body, with those of the poses that fit the truth's joints best.
    """
    from shadowpuppet.cli.terminal import terminal
    from shadowpuppet.evaluation.evaluation import Comparison, check_output, measure_run, update_metrics, write_evaluation
    from shadowpuppet.evaluation.movement.movement import movement_of, write_movement
    from shadowpuppet.evaluation.report.page import check_report, write_report
    from shadowpuppet.io.people import person_folders

    names = [name.strip() for name in joints.split(",")] if joints else None
    if file is not None:
        check_output(file, run, ".json")
    if report is not None:
        check_report(report, run)
    if movement is not None:
        check_output(movement, run, ".csv")
    if person_folders(run):
        of_one = {"TRUTH": truth, "--report": report, "--movement": movement, "--update": update}
        return _of_people(run, file, [name for name, given in of_one.items() if given], quiet, as_json)
    written = {}
    with terminal(quiet or as_json) as listener:
        listener.begin("measuring")
        found = measure_run(run, truth, Comparison(names, start, end, offset, sync, align, angles))
        if file is not None:
            write_evaluation(file, found.measured, run)
            written["figures"] = file
        if movement is not None:
            write_movement(movement, movement_of(found.run))
            written["movement"] = movement
        if update:
            written["updated"] = update_metrics(found)
        if report is not None:
            listener.begin("drawing")
            write_report(report, found)
            written["report"] = report
    if as_json:
        show_json(found.measured)
    elif not quiet:
        show(*_tables(found.measured), pairs([*_rows(found.measured), *((name, str(path)) for name, path in written.items())]))


def _of_people(run: Path, file: Path | None, refused: Sequence[str], quiet: bool, as_json: bool) -> None:
    """Evaluate a run of several people; `refused`: given flags that need the run of one person."""
    from shadowpuppet.cli.terminal import terminal
    from shadowpuppet.errors import SettingsError
    from shadowpuppet.evaluation.evaluation import write_evaluation
    from shadowpuppet.evaluation.people import measure_people

    if refused:
        raise SettingsError(f"{refused[0]}: found it for a run of several people, expected it for one of them, such as {run / 'person-1'}")
    with terminal(quiet or as_json) as listener:
        listener.begin("measuring")
        measured = measure_people(run)
        if file is not None:
            write_evaluation(file, measured, run)
    if as_json:
        show_json(measured)
    elif not quiet:
        show(people_table(measured["person"]), pairs(_people_rows(measured)))


def _people_rows(measured: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    yield "people", str(measured["people"])
    if who := measured.get("identities"):
        yield "who is who", f"MOTA {who['mota']:.3f}, IDF1 {who['idf1']:.3f}, {who['swaps']} swaps"
        yield "count", (f"right in {100 * who['count_right']:.1f} % of {who['frames']} frames; {who['misses']} misses, "
                        f"{who['false_positives']} false positives")
    if measured.get("mean_mm") is not None:
        yield "mean error", f"{measured['mean_mm']:.1f} mm of matched people (MPJPE)"


def _tables(measured: Mapping[str, Any]) -> Iterator[Any]:
    from shadowpuppet.evaluation.summary_text import WAYS, root_text

    yield metrics_table(measured)
    if "errors" in measured:
        aligned = measured["aligned_mm"]
        yield error_table(measured["errors"])
        yield table("mean error (MPJPE), mm, after alignment", ("", "mm"),
                    ((text.format(root=root_text(aligned)), f"{aligned[way]:.1f}") for way, text in WAYS.items() if way in aligned))
        if max(aligned[way] for way in WAYS if way in aligned) > aligned["none"]:
            yield "An alignment lessens the squared errors: where a few joints are far off, the mean of the others may grow."
    if "angles_deg" in measured:
        aligned = measured["angles_aligned_deg"]
        yield table("", ("turned at", "by degrees, rmse", "frames aligned"),
                    ((name, f"{value:.1f}", f"{aligned[name]:.1f}") for name, value in measured["angles_deg"].items()))


def _rows(measured: Mapping[str, Any]) -> Iterator[tuple[str, str | list[str]]]:
    from shadowpuppet.evaluation.summary_text import (
        bones_text,
        clock_text,
        coverage_text,
        exchanges_text,
        feet_text,
        gait_text,
        losses_text,
        world_text,
    )

    if losses := losses_text(measured["losses"]):
        yield "no pose", losses
    if feet := feet_text(measured["feet"]):
        yield "feet", feet
    if gait := gait_text(measured["gait"]):
        yield "gait", gait
    if "errors" not in measured:
        yield "truth", "none is known: nothing is compared; name a file of joints, .csv, .trc, .c3d, .bvh, .amc, .npz or .parquet"
        return
    yield "clock", clock_text(measured["clock"])
    if measured["world"]:
        yield "world", world_text(measured["world"])
    if axes := measured["axes_mm"]:
        yield "axes", ", ".join(f"{x} {axes[x]['mean']:+.1f} (rmse {axes[x]['rmse']:.1f})" for x in "xyz") + " mm, run less truth"
    if measured["bends_deg"]:
        yield "bends", ", ".join(f"{joint} {value['rmse']:.1f}" for joint, value in measured["bends_deg"].items()) + " degrees (rmse)"
    if moves := measured["acceleration"]:
        yield "moves", (f"accelerations of {moves['run_m_s2']:.1f} m/s2, the truth's {moves['truth_m_s2']:.1f}; they differ by "
                        f"{moves['difference_m_s2']:.1f} in the mean")
    if measured["bone_errors"]:
        yield "bones", bones_text(measured["bone_errors"])
    if sides := exchanges_text(measured["exchanges"]):
        yield "sides", f"exchanged {sides}" if sides == "never" else f"exchanged: {sides}"
    yield "intervals", coverage_text(measured["coverage"])
    if "dofs_deg" in measured:
        dofs = [f"{name} {value['rmse']:.1f}" for name, value in measured["dofs_deg"].items()]
        lines = [", ".join(dofs[n : n + 2]) for n in range(0, len(dofs), 2)]
        yield "angles", [*lines, "(rmse, degrees)"]
