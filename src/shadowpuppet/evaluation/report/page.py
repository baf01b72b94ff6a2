"""The report page: one self-contained HTML file that makes no requests."""

from __future__ import annotations

import base64
import importlib.util
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from shadowpuppet.errors import ShadowPuppetError, extra_command
from shadowpuppet.evaluation.error_metrics import aligned_distances
from shadowpuppet.evaluation.evaluation import Evaluation, check_output
from shadowpuppet.evaluation.interval_coverage import LEVELS
from shadowpuppet.evaluation.movement.movement import movement_of
from shadowpuppet.evaluation.report import angle_charts, charts
from shadowpuppet.evaluation.report.html import document, figure, plain, rows, scrolled, table
from shadowpuppet.evaluation.report.movement_section import movement_section
from shadowpuppet.evaluation.report.pictures import ReportFrame, pictures, report_frames
from shadowpuppet.evaluation.report.sections import (
    alignments_table,
    axes_table,
    body_tables,
    cards,
    definitions_section,
    joint_table,
    notes,
    run_facts,
)
from shadowpuppet.evaluation.summary_text import coverage_text
from shadowpuppet.io.files.text import write_whole
from shadowpuppet.io.motion.table import dof_unit
from shadowpuppet.motion.limbs import doubtful_limbs, limbs_in_words


def check_report(path: str | Path, folder: str | Path) -> None:
    """Raise `ShadowPuppetError` if no page can be written there."""
    check_output(path, folder, ".html")
    if importlib.util.find_spec("matplotlib") is None:
        raise ShadowPuppetError(f"{path}: a report needs matplotlib: {extra_command('report')}")


def write_report(path: str | Path, of: Evaluation) -> None:
    """Write the page of an evaluation. Raises `ShadowPuppetError` if it cannot be written, or without matplotlib."""
    check_report(path, of.run.folder)
    write_whole(Path(path), page(of))


def page(of: Evaluation) -> str:
    """The page as HTML."""
    name = of.run.folder.resolve().name
    return document(f"{name}: evaluation", _parts(of, name))


def _parts(of: Evaluation, name: str) -> Iterator[str]:
    chosen = report_frames(of)
    shots, source = pictures(of, chosen)
    yield f"<header><h1>{plain(name)}</h1>{_under(of)}</header>"
    yield cards(of)
    yield notes(of, "" if shots else source)
    if of.errors is not None:
        yield from _errors(of, chosen)
    if shots:
        yield _frames(of, chosen, shots, source)
    if of.errors is not None:
        yield from _joints(of)
        yield from _motion(of)
        yield body_tables(of)
        if of.measured["bends_deg"]:
            note = ("Bland and Altman's plot of the bends: is the difference from the truth the same at every angle? Lines: its mean, and "
                    "1.96 standard deviations on both sides.")
            yield figure(angle_charts.bland_altman(of), note)
    if len(of.run.motion) and any(dof_unit(name) == "rad" for name in of.run.motion.dof_names):
        yield _angles(of)
        yield movement_section(movement_of(of.run))
    yield _silhouettes(of)
    if of.errors is not None:
        yield _intervals(of)
    yield definitions_section(of)
    yield run_facts(of)


def _angles(of: Evaluation) -> str:
    note = ("Degrees, as in angles.csv (there in radians); x, y and z are the components of a rotation vector about the axes forward, left "
            "and up. Bands hold 90 % by the run's own statement: a wide one is an angle that the "
            "silhouettes hardly show. A gap is a frame without a pose.")
    return f"<h2>Angles</h2>{figure(angle_charts.angles_over_time(of), note)}"


def _silhouettes(of: Evaluation) -> str:
    head = ("<h2>Silhouettes</h2><p class=said>How well the drawn body matches the silhouettes, as the run recorded it; for this no truth "
            "is needed.</p>")
    if not len(of.run.motion):
        return head + "<p>The run has no frames.</p>"
    note = "Above the overlap (intersection over union), below the cost: the area in which model and silhouette differ."
    return head + figure(charts.fit_over_time(of), note)


def _under(of: Evaluation) -> str:
    truth = of.measured["truth"]
    against = f" against <b>{plain('/'.join(Path(truth).parts[-2:]))}</b>" if truth else ", without a truth"
    return f'<p class="under">{plain(str(of.run.info.get("method", "a run")))}; {len(of.run.motion)} frames{against}</p>'


def _errors(of: Evaluation, chosen: Sequence[ReportFrame]) -> Iterator[str]:
    marks = {each.letter: each.time for each in chosen if not each.typical}
    yield "<h2>Error over time</h2>"
    note = ("Distance between each joint and its truth, frame by frame: the mean, the middle half of the joints, and all of them. Letters "
            "are the worst frames, shown below; the strip tells the run's own status.")
    yield figure(charts.over_time(of, marks), note)
    yield figure(charts.by_joint_and_time(of), "The same by joint, darker where it is farther off; grey where the run has no pose.")


def _frames(of: Evaluation, chosen: Sequence[ReportFrame], shots: Mapping[str, bytes], source: str) -> str:
    white = ", with the truth's bones in white" if of.truth is not None else ""
    wide = " wide" if len(of.cameras) > 1 or source == "overlay.mp4" else ""
    tiles = "".join(_shot(of, each, shots[each.letter]) for each in chosen if each.letter in shots)
    worst = "largest error" if of.errors is not None else "least overlap"
    usual = ", and two usual ones" if any(each.typical for each in chosen) else ""
    return (f'<h2>Worst frames</h2><p class="said">The frames of {worst}, some time apart{usual}. From {source}{white}.</p>'
            f'<div class="shots{wide}">{tiles}</div>')


def _shot(of: Evaluation, each: ReportFrame, image: bytes) -> str:
    motion = of.run.motion
    note = [f"{each.time:.2f} s", f"frame {each.frame}", str(motion.status[each.frame])]
    note += [f"overlap {motion.overlap[each.frame]:.2f}"] if motion.overlap[each.frame] == motion.overlap[each.frame] else []
    doubtful = doubtful_limbs(motion.joint_names, motion.limb_status[each.frame])
    note += [f"{limbs_in_words(doubtful)} doubtful"] if doubtful else []
    worst = ", ".join(f"{plain(name.replace('_', ' '))} {off:.0f}" for name, off in each.worst)
    error = f"<b>{each.error:.0f} mm</b> in the mean; farthest off: {worst}. " if each.error == each.error else ""
    data = base64.b64encode(image).decode()
    shot = scrolled(f'<img alt="frame {each.frame}" src="data:image/jpeg;base64,{data}">', f"Frame {each.frame}")
    return (f'<figure>{shot}<figcaption><span class="badge'
            f'{" usual" if each.typical else ""}">{each.letter}</span> {error}{", ".join(note)}{", a usual frame" if each.typical else ""}'
            "</figcaption></figure>")


def _joints(of: Evaluation) -> Iterator[str]:
    assert of.table is not None
    assert of.truth is not None
    assert of.errors is not None
    yield "<h2>Joints</h2>" + joint_table(of)
    distances = aligned_distances(of.errors, of.table, of.truth)
    left = figure(charts.by_joint(of), "Half of the frames lie in the box, nine tenths on the line; the stroke is the median, the ring the "
                                       "mean. Green is the person's left, pink the right.")
    right = figure(charts.shares(distances, of.errors.known), "Share of joints with less than each error, as they stand and in posture "
                                                              "alone.")
    yield f'<div class="pair">{left}{right}</div>'
    yield (f'<div class="pair"><div><h3>Laid over each other</h3>{alignments_table(of)}</div>'
           f"<div><h3>Along the world's axes, run less truth</h3>{axes_table(of)}</div></div>")


def _motion(of: Evaluation) -> Iterator[str]:
    assert of.errors is not None
    joints = of.measured["errors"]["joints"]
    worst = max(joints, key=lambda name: joints[name]["mean_mm"])
    yield "<h2>Motion</h2>"
    name = plain(worst.replace("_", " "))
    yield figure(charts.path_of(of, worst), f"Where the joint that is farthest off, {name}, was over time, run and truth.")
    moves = of.measured["acceleration"]
    if moves:
        text = (f"<p>The run's joints accelerate by {moves['run_m_s2']:.1f} m/s² (root mean square), the truth's by "
                f"{moves['truth_m_s2']:.1f}. More than the truth's is jitter, less is smoothed away. The difference between the two, "
                f"as vectors, is {moves['difference_m_s2']:.1f} m/s² in the mean. Compare runs of one film, at one frame rate.</p>")
        yield f'<div class="pair">{figure(charts.jitter_by_joint(of), "Accelerations by joint.")}<div>{text}</div></div>'


def _intervals(of: Evaluation) -> str:
    coverage = of.measured["coverage"]
    text = f"<h2>Stated uncertainty</h2><p>{plain(coverage_text(coverage)).capitalize()}.</p>"
    if coverage is None:
        return text
    cells = ((name.replace("_", " "), *(f"{100 * row[f'within_{level}']:.0f}" for level in LEVELS), f"{row['rms_z']:.2f}",
              f"{row['sd_mean_mm']:.1f}") for name, row in coverage["joints"].items())  # fmt: skip
    by_joint = table(["joint", *(f"{level} %" for level in LEVELS), "rms z", "mean sd, mm"], rows(cells))
    note = "Share of the truth within the run's intervals of a stated percentage; below the line they are too narrow."
    return f'{text}<div class="pair">{figure(charts.coverage_chart(coverage, list(LEVELS)), note)}<div>{by_joint}</div></div>'

