"""What the command line shows: looks, errors, sizes, in words and tables of 80 columns."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from shadowpuppet.body.sizes import CardboxSizes, Sizes
from shadowpuppet.io.humaneva import HumanEva
from shadowpuppet.io.recording import Recording
from shadowpuppet.motion.metrics import FAR, LOST
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.motion.prior.training import Trained
from shadowpuppet.pipeline.look import Look
from shadowpuppet.pipeline.person import MonocularSubject
from shadowpuppet.synthetic.spec import Spec

BARS = "▁▂▃▄▅▆▇█"


def look_table(look: Look) -> RenderableType:
    """What was found before the run."""
    said = [("recording", look.recording), ("camera", _camera(look)), ("film", _film(look)), ("scale", look.scale),
            ("background", look.background), *([("key", look.key)] if look.key != "none" else []), ("silhouettes", _areas(look))]
    if look.exact_overlap is not None:
        said.append(("exact masks", _exact(look)))
    if look.refusal is None:
        said.append(("quality", _quality(look)))
    if look.person is not None:
        said.append(("person", _person(look.person)))
    return pairs(said)


def pairs(rows: Iterable[tuple[str, str]]) -> RenderableType:
    """Names beside what they are."""
    table = Table.grid(padding=(0, 2))
    table.add_column(no_wrap=True, style="bold")
    table.add_column(overflow="fold")
    for name, value in rows:
        table.add_row(Text(name), Text(value))
    return table


def error_table(errors: Mapping[str, Any]) -> RenderableType:
    """Joint errors, a row a joint."""
    keys = [key for key in ("mean_mm", "rmse_mm", "plane_mm", "depth_mm", "p95_mm", "max_mm") if key in errors]
    table = plain_table("joint errors, mm", ("joint", *(key.removesuffix("_mm") for key in keys), f"over {1000 * FAR:.0f}"))
    rows = [*errors["joints"].items(), ("all", errors)]
    for name, row in rows:
        if name == "all":
            table.add_section()
        table.add_row(name, *(f"{row[key]:.1f}" for key in keys), f"{100 * row['far']:.1f} %")
    return table


def angle_table(angles: Mapping[str, float]) -> RenderableType:
    """Errors of angles, a row a joint."""
    table = plain_table("", ("turned at", "by degrees, rmse"))
    for name, value in angles.items():
        if name == "all":
            table.add_section()
        table.add_row(name, f"{value:.1f}")
    return table


def measures_table(metrics: Mapping[str, Any]) -> RenderableType:
    """What is known without a truth, and beside it."""
    several = "cost_m2" in metrics
    fit, cost = metrics["overlap"], metrics["cost_m2" if several else "cost_px"]
    frames = ", ".join(f"{count} {status}" for status, count in metrics["status"].items())
    rows = [("frames", f"{metrics['frames']}: {frames}" if frames else "none")]
    if fit["count"]:
        rows.append(("overlap", f"{fit['mean']:.3f} (5 % of frames under {fit['p5']:.3f})"))
    if cost["count"]:
        scale, unit, digits = (1e4, "cm2", 1) if several else (1, "pixels", 0)
        rows.append(("cost", f"{scale * cost['mean']:.{digits}f} {unit} (5 % of frames over {scale * cost['p95']:.{digits}f})"))
    truth = metrics.get("truth_jitter_m_s2")
    rows.append(("jitter", f"{_number(metrics['jitter_m_s2'])} m/s2" + (f", the truth's {_number(truth)}" if truth is not None else "")))
    errors = metrics.get("errors")
    if errors:
        parts = f"rmse {errors['rmse_mm']:.1f}" if several else f"plane {errors['plane_mm']:.1f}, depth {errors['depth_mm']:.1f}"
        rows.append(("error", f"{errors['mean_mm']:.1f} mm ({parts}); aligned "
                              f"{errors['aligned_mean_mm']:.1f} mm; {100 * errors['far']:.1f} % off by over {1000 * FAR:.0f} mm"))
        lost, known, frames = errors["lost"], errors["frames"], metrics["frames"]
        rows += [("lost", f"{lost} of the truth's {known} frames have no pose: {1000 * LOST:.0f} mm off each")] if lost else []
        if known != frames and "clock" not in metrics:
            rows.append(("compared", f"the truth has {known} frames, the run {frames}: is it this recording's?"))
    return pairs(rows)


def live_rows(live: Mapping[str, Any]) -> list[tuple[str, str]]:
    """How a live session kept up."""
    late, frames = live["latency_ms"], live["latency_frames"]
    rows = [("latency", f"{late['median']:.0f} ms from capture to pose ({frames['median']:.2f} of a frame's time); 5 % of frames over "
                        f"{late['p95']:.0f} ms ({frames['p95']:.2f})"),
            ("speed", f"{live['frames_per_s']:.1f} frames/s of {1000 / live['interval_ms']:.1f}; {live['dropped']} dropped")]
    return rows + ([("breaks", f"{live['breaks']} times no pictures came")] if live["breaks"] else [])


def sizes_table(sizes: Sizes) -> RenderableType:
    """The named sizes: a1..a18 of an upper body, or a whole body's."""
    table = plain_table("sizes, mm", ("", "size", "mm", "", "size", "mm"), right=(2, 5))
    numbers = [f"a{n}" if isinstance(sizes, CardboxSizes) else "" for n in range(1, len(sizes.names()) + 1)]
    rows = [(number, name, f"{1000 * value:.0f}") for number, name, value in zip(numbers, sizes.names(), sizes.to_array())]
    half = (len(rows) + 1) // 2
    for i in range(half):
        table.add_row(*rows[i], *(rows[half + i] if half + i < len(rows) else ("", "", "")))
    return table


def curves_table(curves: Mapping[str, Sequence[Sequence[float]]]) -> RenderableType:
    """Cost over the rounds of Algorithm 1, a line a search of a subset."""
    table = plain_table("cost by round, pixels", ("sizes", "search", "rounds", "first", "last", "curve"), right=(1, 2, 3, 4))
    for name, searches in curves.items():
        for n, curve in enumerate(searches, 1):
            table.add_row(name if n == 1 else "", str(n), str(len(curve)), f"{curve[0]:.0f}", f"{curve[-1]:.0f}", sparkline(curve))
    return table


def fit_table(found: MonocularSubject, saved: Path) -> RenderableType:
    """How well sizes fit, and where they were saved."""
    overlaps = ", ".join(f"{name} {value:.2f}" for name, value in found.fit.overlaps.items())
    return pairs([("overlap", f"{overlaps}; film {found.summary['start_overlap']:.2f}"), ("height", f"{found.fit.guess.height:.2f} m"),
                  ("source", found.person.source), ("saved", str(saved))])


def measured_table(told: Mapping[str, Any], saved: Path) -> RenderableType:
    """How well the sizes fit that several cameras told, and where they were saved."""
    off = told["residual"]
    return pairs([("overlap", f"{told['overlap']:.2f} of body and silhouettes, in {told['frames']} frames"),
                  *([("surface", f"{1000 * off:.1f} mm (rms) from the points of the hulls")] if np.isfinite(off) else []),
                  ("source", told["source"]), ("saved", str(saved))])


def specs_table(specs: Mapping[str, Spec]) -> RenderableType:
    """Named specs, a row each."""
    rows = []
    for name, spec in specs.items():
        views = spec.views()
        first = views[0]
        place = f"{len(views)} cameras around" if len(views) > 1 else f"at {first.distance:g} m, {first.fov_deg:g} degrees"
        rows.append((name, f"{spec.body.stature:.2f} m, {place}: {_motions(spec)}"))
    return pairs(rows)


def made_table(spec: Spec, made: Recording) -> RenderableType:
    """What a made recording has in it, and what can be done with it."""
    views, seconds = spec.views(), sum(gesture.seconds for gesture in spec.motion)
    first, cameras = views[0], f"{len(views)} cameras" if len(views) > 1 else "1 camera"
    extras = [thing.kind for thing in spec.scene.obstacles] + ["another person"] * len(spec.scene.bystanders)
    rows = [("recording", str(made.path)),
            ("person", f"{spec.body.stature:.2f} m: {_motions(spec)}" + (f"; in the scene: {', '.join(extras)}" if extras else "")),
            ("films", f"{cameras}, {first.size[0]} x {first.size[1]} pixels, {spec.rate:g} frames/s, {seconds:g} s of motion"),
            ("truth", "truth.csv, truth.trc, masks/" + (", people/" if spec.scene.bystanders else "")
             + (", training.csv, training.trc" if made.training else "") + (", references/" if made.references else "")),
            ("again", f"shadowpuppet synthesize {made.path}/spec.toml -o FOLDER"),
            ("look", f"shadowpuppet info {made.path}" + (f" --camera {first.name}" if len(views) > 1 else "")),
            ("track", f"shadowpuppet track {made.path} --overlay" + (f" --camera {first.name}" if len(views) > 1 else ""))]
    return pairs(rows)


def trial_table(found: HumanEva, folder: Path) -> RenderableType:
    """What a trial of HumanEva has in it, and what can be done with it."""
    recording = found.recording
    names = ", ".join(view.camera.name for view in recording.views)
    told = {"truth": found.truth, "training": found.training}
    rows = [("recording", str(folder)), ("films", f"{len(recording.views)} cameras: {names}, {recording.duration:.2f} s")]
    rows += [(what, f"{len(table.times)} frames of {len(table.names)} joints, {_known(table):.0f} % known" if table else "none there")
             for what, table in told.items()]
    rows += [("track", f"shadowpuppet track {folder} -o RUN --overlay"), ("measure", "shadowpuppet evaluate RUN --joints humaneva")]
    return pairs(rows)


def prior_tables(trained: Trained, file: Path) -> list[RenderableType]:
    """What a motion prior was learnt from, how well it follows that, and where it lies."""
    clips = plain_table("learnt from; joints off the body in mm", ("motion", "frames", "parts", "joints", "worst frame"))
    for clip in trained.clips:
        frames = clip.fitted.by_frame[np.isfinite(clip.fitted.by_frame)]
        figures = (str(clip.frames), str(len(clip.parts)), f"{1000 * clip.fitted.residual:.1f}", f"{1000 * frames.max():.1f}")
        clips.add_row("/".join(Path(clip.name).parts[-2:])[-48:], *figures)
    prior, parts = trained.prior, [clips]
    if trained.choice is not None:
        tried = plain_table("error in degrees of motion", ("regions", "learnt from", "left out"))
        for number, *errors in zip(trained.choice.candidates, trained.choice.training_errors, trained.choice.held_out_errors):
            tried.add_row(str(number), *(f"{np.degrees(error):.2f}" for error in errors))
        parts.append(tried)
    rows = [("prior", f"{len(prior.subspaces)} regions of {prior.subspaces.dimensions} dimensions; {len(prior.names)} degrees of freedom, "
                      f"{prior.rate:g} frames/s"),
            ("loses", f"{np.degrees(trained.error):.2f} degrees, {1000 * trained.joint_error:.1f} mm at the joints"),
            ("saved", str(file)), ("track", f"shadowpuppet track RECORDING --prior {file}")]
    return [*parts, pairs(rows)]


def _known(table: JointTable) -> float:
    return 100 * float(np.isfinite(table.positions).all(2).mean())


def _motions(spec: Spec) -> str:
    return ", ".join(f"{Path(gesture.file).name if gesture.file else gesture.motion} {gesture.seconds:g}" for gesture in spec.motion)


def bench_tables(found: Mapping[str, Any]) -> list[RenderableType]:
    """How fast it is here."""
    here, tables = found["environment"], []
    for title, rows_of in (("one camera, 320 x 240", BENCHED), ("seven cameras, 640 x 480", BENCHED_SEVERAL)):
        table = plain_table(f"time, {title}", ("", "median", "least", "", "times"), right=(1, 2, 4))
        for key, name, scale, unit, ratio in rows_of:
            times = (f"{scale * found['raw'][key][which]:.4g}" for which in ("median", "least"))
            table.add_row(name, *times, unit, f"{found[ratio]:.3g}" if ratio else "")
        tables.append(table)
    stages = ", ".join(f"{name} {found[f'mono.{stage}_ms']:.1f}" for stage, name in CHAIN.items())
    rows = [("filter", f"{found['mono.step_fps']:.0f} frames/s at Table I, {found['mono.default_fps']:.0f} with the default preset"),
            ("film to pose", f"{found['mono.chain_fps']:.0f} frames/s, {found['mono.one_core']} (ms a frame: {stages})"),
            ("memory", f"{_megabytes(found['mono.peak_mb'])} at most, grown by {_megabytes(found['mono.growth_mb'])} over "
                       f"{found['mono.chain_frames']} frames")]
    rows += [("several", f"{found['multi.fps']:.0f} frames/s with the default preset, {found['multi.forces_fps']:.0f} with ni2008"),
             ("films to pose", f"{found['multi.chain_fps']:.0f} frames/s from seven films, {found['multi.cores']}; "
                               f"{_megabytes(found['multi.peak_mb'])} at most")]
    if "mono.compile_s" in found:
        rows.append(("first pose", f"{found['mono.start_s']:.1f} s after the start of a new process, {found['mono.compile_s']:.1f} s where "
                                   "all kernels must be compiled"))
    rows.append(("machine", f"{here['cpu']}, {here['cores']} cores, {here['vectors']}, Python {here['python']}, Numba {here['numba']}, "
                            f"OpenCV {here['opencv-python-headless']}"))
    return [*tables, pairs(rows)]


BENCHED = (
    # what was timed, its name, factor to the unit, unit, and what tells how many times longer than the one above it takes
    ("particle", "a particle of cardbox, pose to cost", 1e6, "us", ""),
    ("opencv", "  OpenCV, its polygons ready-made", 1e6, "us", "mono.ratio_opencv_full"),
    ("boxes", "  boxes instead of cardbox", 1e6, "us", "mono.ratio_boxes"),
    ("arm", "a particle of an arm's stage", 1e6, "us", ""),
    ("opencv_arm", "  OpenCV, its polygons ready-made", 1e6, "us", "mono.ratio_opencv_arm"),
    ("step", "a frame of the filter at Table I", 1e3, "ms", ""),
    ("naive_frame", "  plain NumPy and Python", 1e3, "ms", "mono.ratio_naive_frame"),
    ("default", "a frame of the default filter", 1e3, "ms", ""),
)
BENCHED_SEVERAL = (
    ("hull", "silhouettes to surface points", 1e3, "ms", ""),
    ("forces", "simulated forces, a particle and iteration", 1e6, "us", ""),
    ("naive_forces", "  plain NumPy", 1e6, "us", "multi.ratio_naive"),
    ("gauss_newton", "Gauss-Newton, a particle and iteration", 1e6, "us", ""),
    ("naive_gauss_newton", "  plain NumPy", 1e6, "us", "multi.ratio_naive_gauss_newton"),
    ("forces_frame", "a frame of ni2008, silhouettes to pose", 1e3, "ms", ""),
    ("default_frame", "a frame of the default preset", 1e3, "ms", ""),
)
CHAIN = {"decode": "decoding", "segment": "segmentation", "track": "filter", "write": "writing"}


def _megabytes(value: float | None) -> str:
    return "not told here" if value is None else f"{value:.1f} MB"


def sparkline(values: Sequence[float], width: int = 30) -> str:
    """Numbers as a line of bars."""
    chosen = np.asarray(values, float)[np.unique(np.linspace(0, len(values) - 1, width).astype(int))]
    span = float(np.ptp(chosen)) or 1.0
    return "".join(BARS[int((value - chosen.min()) / span * (len(BARS) - 1))] for value in chosen)


def plain_table(title: str, columns: Sequence[str], right: Sequence[int] | None = None) -> Table:
    """An empty table without lines; numbers stand `right`."""
    table = Table(title=title, title_justify="left", title_style="bold", box=None, padding=(0, 2, 0, 0), header_style="dim")
    for i, column in enumerate(columns):
        table.add_column(column, justify="right" if (i in right if right is not None else i) else "left", no_wrap=True)
    return table


def _camera(look: Look) -> str:
    scaled = "" if look.worked_size == look.size else f", scaled to {look.worked_size[0]} x {look.worked_size[1]}"
    how = "calibrated" if look.calibrated else "not calibrated"
    return f"{look.camera}, {look.size[0]} x {look.size[1]} pixels{scaled}, {look.fov:.0f} degrees wide, {how}"


def _film(look: Look) -> str:
    count = f"{look.frames} frames" if look.frames else "frames not counted"
    rate = f"{look.rate:.4g} frames/s" if np.isfinite(look.rate) else "rate unknown"
    steady = f", times uneven by {1000 * look.jitter:.1f} ms" if look.jitter * look.rate > 0.01 else ""
    return f"{count}, {rate}{steady}"


def _areas(look: Look) -> str:
    plain = f"; by the plain rule of eq. 1 {100 * look.plain_area:.1f} %" if look.plain_area is not None else ""
    return f"{100 * look.area:.1f} % of the picture, in {look.quality.frames} frames{plain}"


def _exact(look: Look) -> str:
    plain = f"; those of the plain rule by {look.exact_overlap_plain:.3f}" if look.exact_overlap_plain is not None else ""
    return f"these silhouettes overlap the ready ones by {look.exact_overlap:.3f}{plain}"


def _quality(look: Look) -> str:
    q = look.quality
    sides = ", ".join(side for side, share in q.border.items() if share > 0.02) or "no side"
    return (f"area changes by {100 * q.area_change:.1f} % a frame, {100 * q.flicker:.1f} % flickers; {q.specks:.1f} specks and "
            f"{q.holes:.1f} holes a frame; touches {sides} of the picture")


def _person(person: Mapping[str, Any]) -> str:
    fits = ", ".join(f"{name} {value:.2f}" for name, value in person["overlaps"].items()) if person["source"] == "references" else ""
    clean = f"; all this in clean silhouettes by {person['silhouettes']}: plain ones show no posture" if person["silhouettes"] else ""
    return (f"height {person['height']:.2f} m at {person['distance']:.2f} m; sizes from {person['source']}"
            + (f" (overlap: {fits})" if fits else "") + f"; overlaps the film's first silhouette by {person['start_overlap']:.2f}{clean}")


def _number(value: float) -> str:
    return "unknown" if value is None or not np.isfinite(value) else f"{value:.2f}"
