"""Sections of the page: cards, notes, tables."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from shadowpuppet.evaluation.evaluation import Evaluation
from shadowpuppet.evaluation.report.html import definitions, plain, rows, table
from shadowpuppet.evaluation.summary_text import WAYS, bones_text, clock_text, doubt_text, feet_text, losses_text, root_text, world_text
from shadowpuppet.motion.metrics import FAR_ERROR, LOST_ERROR
from shadowpuppet.pipeline.findings.verdict import Verdict


def cards(of: Evaluation) -> str:
    """Cards with the main figures."""
    made = "".join(f'<div class="card"><span class="name">{name}</span><b>{value} <small>{unit}</small></b><span>{items}</span></div>'
                   for name, value, unit, items in _cards(of))
    return f'<div class="cards">{made}</div>'


def _cards(of: Evaluation) -> Iterator[tuple[str, str, str, str]]:
    measured = of.measured
    if (verdict := of.run.metrics.get("verdict")) is not None:
        reasons = "; ".join(verdict["reasons"]) or "nothing speaks against it"
        yield "The run's own verdict", plain(Verdict.of(verdict).words), "", plain(reasons)
    if of.errors is not None:
        errors, aligned, moves = (measured[key] for key in ("errors", "aligned_mm", "acceleration"))
        yield "Joint error", f"{errors['mean_mm']:.1f}", "mm", f"mean of {len(errors['joints'])} joints; rmse {errors['rmse_mm']:.1f}"
        yield "Posture alone", f"{aligned['rigid']:.1f}", "mm", "each frame moved and turned onto the truth"
        if "depth_mm" in errors:
            yield "Depth", f"{errors['depth_mm']:.1f}", "mm", f"along the camera's axis; {errors['plane_mm']:.1f} across it"
        yield "Far off", f"{100 * errors['far']:.1f}", "%", (
                f"of joints are over {1000 * FAR_ERROR:.0f} mm off; worst {errors['max_mm']:.0f} mm")
        if moves:
            yield "Acceleration", f"{moves['run_m_s2']:.1f}", "m/s²", f"the truth's {moves['truth_m_s2']:.1f}: more is jitter"
    if measured["overlap"]["count"]:
        fit = measured["overlap"]
        yield "Overlap", f"{fit['mean']:.3f}", "", f"with the silhouettes; p5 {fit['p5']:.3f}"
    lost = measured["losses"]
    yield "Without a pose", str(lost["frames"]), "frames", (f"{100 * lost['share']:.1f} %, the longest {lost['longest_s']:.2f} s"
                                                            if lost["frames"] else "none was lost")


def notes(of: Evaluation, no_pictures: str) -> str:
    """Remarks needed to read the figures."""
    made = "".join(f'<li{"" if grave else " class=fine"}>{plain(text)}</li>' for grave, text in _notes(of, no_pictures))
    return f'<ul class="notes">{made}</ul>' if made else ""


def _notes(of: Evaluation, no_pictures: str) -> Iterator[tuple[bool, str]]:
    measured = of.measured
    if not measured["complete"]:
        yield True, "The run did not come to its end: what it had by then is measured."
    if of.errors is None:
        yield True, "There is no truth to compare with: what follows tells how well the silhouettes are matched, not where the joints were."
    else:
        world, clock, errors = measured["world"], measured["clock"], measured["errors"]
        if world.get("moved"):
            yield False, world_text(world)[0].upper() + world_text(world)[1:] + "."
        elif world.get("apart"):
            yield True, (f"The run's joints are {world['mean_mm']:.0f} mm from the truth's, but {world['aligned_mm']:.0f} mm once the run "
                         "is moved and turned as a whole: are they in two worlds, or is the distance wrong? (--align)")
        if errors["lost"]:
            yield True, (f"{errors['lost']} of {errors['frames']} frames of the truth have no pose of the run; each joint counts "
                         f"{1000 * LOST_ERROR:.0f} mm there.")
        if clock["offset_s"]:
            yield False, "Clock: " + clock_text(clock) + "."
        if clock.get("rival_s") is not None:
            yield True, f"An offset of {clock['rival_s']:.3f} s fits nearly as well: the motion repeats itself."
    if no_pictures:
        yield False, no_pictures[0].upper() + no_pictures[1:] + "."


def joint_table(of: Evaluation) -> str:
    """Table of errors of every joint and of all."""
    errors = of.measured["errors"]
    keys = [key for key in ("mean_mm", "rmse_mm", "p50_mm", "p90_mm", "p95_mm", "max_mm", "plane_mm", "depth_mm") if key in errors]
    names = {"p50_mm": "median", "p90_mm": "90 %", "p95_mm": "95 %"}
    made = rows(((name.replace("_", " "), *(f"{row[key]:.1f}" for key in keys), f"{100 * row['far']:.1f} %")
                 for name, row in [*errors["joints"].items(), ("all", errors)]), sums=1)
    return table(["mm", *(names.get(key, key.removesuffix("_mm")) for key in keys), f"over {1000 * FAR_ERROR:.0f}"], made)


def alignments_table(of: Evaluation) -> str:
    """Table of mean errors after each alignment."""
    aligned = of.measured["aligned_mm"]
    items = ((words.format(root=root_text(aligned)), f"{aligned[way]:.1f}") for way, words in WAYS.items() if way in aligned)
    return table(["", "mean, mm"], rows(items))


def axes_table(of: Evaluation) -> str:
    """Table of errors along the axes."""
    axes = of.measured["axes_mm"]
    if not axes:
        return "<p>No joint is known in both.</p>"
    items = ((axis, f"{axes[axis]['mean']:+.1f}", f"{axes[axis]['sd']:.1f}", f"{axes[axis]['rmse']:.1f}") for axis in "xyz")
    return table(["", "mean, mm", "sd", "rmse"], rows(items))


def body_tables(of: Evaluation) -> str:
    """Tables of bones, hinges and angles."""
    measured = of.measured
    parts = []
    if measured["bone_errors"]:
        bones = rows((name.replace("_", " ").replace("-", " to "), f"{b['run_mm']:.1f}", f"{b['truth_mm']:.1f}", f"{b['longer_mm']:+.1f}",
                      f"{b['run_sd_mm']:.2f}", f"{b['truth_sd_mm']:.2f}") for name, b in measured["bone_errors"].items())
        words = bones_text(measured["bone_errors"])
        parts.append(f"<h3>Bones, mm</h3><p class=said>{plain(words[0].upper() + words[1:])}.</p>"
                     + table(["", "run", "truth", "longer", "run's sd", "truth's sd"], bones))
    if measured["bends_deg"]:
        parts.append("<h3>How far elbows and knees are bent, degrees</h3>" + _angles(measured["bends_deg"]))
    if "angles_deg" in measured:
        aligned = measured["angles_aligned_deg"]
        turns = rows(((name.replace("_", " "), f"{value:.1f}", f"{aligned[name]:.1f}") for name, value in measured["angles_deg"].items()),
                     sums=1)
        joints = table(["", "rmse", "frames aligned"], turns)
        parts.append(f'<div class="pair"><div><h3>Turns of joints, degrees</h3>{joints}</div><div><h3>Single angles, degrees</h3>'
                     f'{_angles(measured["dofs_deg"])}</div></div>')
    return "<h2>Body</h2>" + "".join(parts) if parts else ""


def _angles(angles: Mapping[str, Mapping[str, float]]) -> str:
    """Table of errors of angles."""
    items = ((name.replace("_", " "), f"{off['bias']:+.1f}", f"{off['mean']:.1f}", f"{off['rmse']:.1f}", f"{off['aligned']:.1f}")
             for name, off in angles.items())
    return table(["", "run less truth", "mean size", "rmse", "without the mean"], rows(items))


def definitions_section(of: Evaluation) -> str:
    """Definitions of the figures."""
    items = [("Overlap", "Intersection over union of drawn body and silhouette, from 0 to 1, as recorded by the run."),
            ("Cost", "The area in which drawn body and silhouette differ (XOR), as recorded by the run.")]
    if of.errors is not None:
        root = plain(root_text(of.measured["aligned_mm"]))
        items = [
            ("Joint error", "Distance between a joint and its truth. The mean is over all frames and joints of the truth; where the run "
                            f"has no pose, each joint counts {1000 * LOST_ERROR:.0f} mm, so that leaving out bad frames never helps. "
                            "<span class=formula>rmse = √(mean of d²)</span>."),
            ("Laid over each other", "Run and truth compared after ever freer alignments: one rigid motion of the whole; each "
                                     f"frame's mean offset; distances from the {root}; the best rigid motion of each frame (Procrustes); "
                                     "that with a scale, which papers call PA-MPJPE. The first alone says where the person was."),
            ("Acceleration", "Root mean square of second differences of the joints' places, of run and truth at the same times."),
            ("Bent", "The angle between the bones before and after an elbow or knee; 0 is straight."),
            ("Times", "Run and truth are compared at the times of the slower one; the other is interpolated between frames at most one and "
                      "a half steps apart, and never beyond its ends."),
            *items,
        ]
    return "<h2>What the figures mean</h2>" + definitions(items)


def run_facts(of: Evaluation) -> str:
    """Facts about the run."""
    info, measured = of.run.info, of.measured
    settings = of.run.settings
    items = [("Recording", info.get("recording")), ("Truth", measured["truth"]), ("Method", info.get("method")),
            ("Body", of.run.motion.body_name),
            ("Preset and seed", f"{settings.get('preset', 'default')}, {settings.get('seed', 'unknown')}" if settings else None),
            ("Frames", ", ".join(f"{count} {status}" for status, count in measured["status"].items())),
            ("Doubt", doubt_text(measured)),
            ("No pose", losses_text(measured["losses"])),
            ("Feet", feet_text(measured["feet"])),
            ("Clock", clock_text(measured["clock"]) if "clock" in measured else None),
            ("World", world_text(measured["world"]) if measured.get("world") else None),
            ("Made with", ", ".join(f"{name} {version}" for name, version in info.get("versions", {}).items()))]
    joints = f"; joints compared: {', '.join(of.errors.names)}" if of.errors is not None else ""
    return ("<h2>The run</h2>" + definitions((name, plain(text)) for name, text in items if text)
            + f"<footer>Made by shadowpuppet evaluate. All of it is in this file{plain(joints.replace('_', ' '))}.</footer>")

