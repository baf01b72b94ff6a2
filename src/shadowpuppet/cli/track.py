"""The commands that track: `track`, `live`, `demo`; `play`, which replays a run; and `fit-person`."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from shadowpuppet.cli.flags import (
    Config,
    LookFlags,
    OutletFlags,
    Quiet,
    RecordingPath,
    RunFlags,
    Switch,
    Verbose,
    flags_of,
    given,
    options_from,
    output,
    switch,
    unpacked,
)
from shadowpuppet.cli.tables import error_table, files_in, metrics_table, pairs, people_table, show, show_next, table, verdict_of
from shadowpuppet.errors import PERSON_LOST, SettingsError, ShadowPuppetError, typed
from shadowpuppet.live.settings import LiveSettings
from shadowpuppet.live.stream.settings import OutletSettings
from shadowpuppet.output import say
from shadowpuppet.pipeline.options import PATHS, Options
from shadowpuppet.settings import validate

if TYPE_CHECKING:
    from shadowpuppet.pipeline.person import MonocularSubject

    DemoFlags = SessionFlags = LiveFlags = Any
else:
    KNOWN = (*PATHS, "height", "distance", "fov", "camera", "region", "start", "end", "max_size", "every", "overlay", "people",
             "appearance")
    DemoFlags = unpacked(flags_of(Options, without=KNOWN))
    """Options for recordings that are known."""
    SessionFlags = unpacked(flags_of(Options, without=("camera", "masks", "label", "every", "overlay", "facing", "appearance", "training")))
    """Options of a live session."""
    LiveFlags = unpacked(flags_of(LiveSettings))

BARS = "▁▂▃▄▅▆▇█"

KEEPS_UP = 0.6
"""Least share of the pictures that a live session tracks without a hint."""


def track(recording: RecordingPath, /, *, folder: Annotated[Path | None, output("Folder of the run. [default: run-<recording>]")] = None,
          resume: Annotated[bool, switch("Go on with a run that was broken off, to the same result.")] = False,
          force: Annotated[bool, switch("Replace an earlier run in the folder.")] = False,
          config: Config = None, quiet: Quiet = False, verbose: Verbose = False, flags: RunFlags = None) -> int:
    """Track a person: from video to joints.csv, angles.csv, motion.npz, run.toml and metrics.json.

    Prints what it found first, as `info` does. Ends with exit code 4 if the person is lost in most frames.
    `shadowpuppet settings` lists more settings; each is a flag, such as --tracker.arm.particles 300.
    """
    from shadowpuppet.cli.terminal import terminal
    from shadowpuppet.io.run import read_run
    from shadowpuppet.io.run_writer import CompleteRun
    from shadowpuppet.pipeline.findings.verdict import MOSTLY_LOST, lost_share
    from shadowpuppet.pipeline.track import track_recording

    options = options_from(flags, config)
    folder = folder or Path(f"run-{recording.resolve().name.removesuffix(recording.suffix if recording.is_file() else '')}")
    if not resume:
        _check_earlier(folder, force)
    try:
        nothing = f"{folder} is as it was" if resume else "nothing was written"
        with terminal(quiet, folder, nothing, verbose, "; the same command with --resume goes on with them") as listener:
            summary = track_recording(recording, folder, options, listener, resume=resume)
        motion, metrics = summary.motion, summary.metrics
    except CompleteRun as error:
        say(error, error=True)
        motion, metrics = read_run(folder).motion, read_run(folder).metrics
    if "people" in metrics:
        return _people_done(folder, metrics, quiet)
    if not quiet:
        _show_run(folder, metrics)
        _show_project(recording, folder)
        if metrics.get("verdict", {}).get("word") != "good":
            show_next(typed("view", folder))
            say("  `info` with the recording's own flags and --verbose says what to do about each reason on the film")
    if lost_share(motion) <= MOSTLY_LOST:
        return 0
    say(f"the person is lost: {'; '.join(metrics.get('verdict', {}).get('reasons', ()))}", error=True)
    return PERSON_LOST


def _show_project(recording: Path, folder: Path) -> None:
    """The command that puts the run's joints where the program that made the project looks for them."""
    from shadowpuppet.io.projects import find_project

    project = find_project(recording)
    if project is not None:
        formats, results = project.results
        say(f"for {project.program}: {typed('export', folder, '--to', formats, '-o', results)}")


def _people_done(folder: Path, metrics: Mapping[str, Any], quiet: bool) -> int:
    """Print the people of a run and its files; returns the exit code."""
    from shadowpuppet.pipeline.findings.verdict import MOSTLY_LOST

    def is_lost(status: Mapping[str, int], frames: int) -> bool:
        return status.get("lost", 0) > MOSTLY_LOST * (frames - status.get("absent", 0))

    people = metrics["people"]
    if not quiet:
        names = [f"person-{number}" for number in people]
        verdicts = [verdict_of(each["verdict"], f"person {number}") for number, each in people.items() if "verdict" in each]
        speed = f"{metrics['frames_per_s']:.3g} frame sets/s" if metrics["frames_per_s"] else None
        show(people_table(people), *verdicts, pairs([("speed", speed), files_in(folder, "people.csv", "overlay.mp4", *names)]))
    lost = [number for number, each in people.items() if is_lost(each["status"], each["frames"])]
    if len(lost) < len(people):
        return 0
    say("all people are lost in most frames", error=True)
    return PERSON_LOST


def _after_a_film(camera: str) -> str:
    """Advice for a film, played as if live, in which no person was tracked; empty for cameras."""
    if not Path(camera).exists():
        return ""
    return ("; the film ended before its scene was found and the person measured: give a shorter --learn, or --background with the empty "
            f"scene; `{typed('track', camera)}` follows the person in all of it")


def _check_earlier(folder: Path, force: bool, resumes: bool = True) -> None:
    """Ask at a terminal before an earlier run is replaced. Raises `ShadowPuppetError` if it is not to be.

    `resumes`: whether the command can go on with a run that was broken off.
    """
    from shadowpuppet.io.inputs.earlier_run import earlier_run

    earlier = None if force else earlier_run(folder)
    if earlier is None:
        return
    how = "--resume, which goes on with it, --force, which starts over" if resumes else "--force, which replaces it"
    said = f"{folder}: found a run that was broken off, expected {how}"
    if earlier["complete"]:
        said = f"{folder}: found a complete run, expected --force, which replaces it"
    if sys.stdin is not None and sys.stdin.isatty() and sys.stderr.isatty():
        say(f"{said.partition(', expected')[0]}; replace it? [y/N] ", error=True, end="")
        if sys.stdin.readline().strip().lower() in ("y", "yes"):
            return
    raise ShadowPuppetError(f"{said}, or another folder (-o)")


def live(camera: Annotated[str | None, Parameter(help="The camera, or a film to be played as if it were one, as --camera.")] = None, /, *,
         folder: Annotated[Path | None, output("Folder of the run. [default: live-<date>-<time>]")] = None,
         force: Annotated[bool, switch("Replace an earlier run in the folder.")] = False, config: Config = None,
         quiet: Quiet = False, flags: SessionFlags = None, settings: LiveFlags = None, outlets: OutletFlags = None) -> None:
    """Track a person in front of a camera as it happens, shown on a page for a browser; Ctrl-C ends it.

    Step out of the picture for the first seconds, then into it; or stay and move: the empty scene is found behind you.
    Pictures are kept only with --record. Joints are sent to other programs only with --osc, --websocket or --lsl.
    """
    from time import strftime

    from shadowpuppet.cli.terminal import terminal
    from shadowpuppet.live.display.view import open_display
    from shadowpuppet.live.run import check_number, run_live
    from shadowpuppet.live.stream.choice import open_outlets
    from shadowpuppet.viewer.web.live import SpaceDisplay

    asked = given(settings)
    if camera is not None and asked.setdefault("camera", camera) != camera:
        raise SettingsError(f"camera: found {camera} and --camera {asked['camera']}, expected one of them")
    options, chosen = options_from(flags, config), validate(LiveSettings, asked, "flags")
    check_number(options)  # before a display is opened
    folder = folder or Path(strftime("live-%Y%m%d-%H%M%S"))
    _check_earlier(folder, force, resumes=False)
    with terminal(quiet, folder) as listener:
        opened = open_outlets(validate(OutletSettings, given(outlets), "flags"))
        display = open_display(chosen.show, chosen.listen, chosen.port, chosen.record, SpaceDisplay)
        metrics = run_live(folder, options, chosen, listener, display, outlets=opened)
    if metrics is None:
        say(f"nobody was tracked: nothing was written{_after_a_film(chosen.camera)}", error=True)
    elif not quiet:
        show(metrics_table(metrics), pairs([*_live_rows(metrics["live"]), files_in(folder, "joints.csv", "angles.csv", "recording")]))


def play(run: Annotated[Path, Parameter(help="Folder that `track` or `live` made.")], /, *, speed: float = 1.0,
         loop: Switch = False, quiet: Quiet = False, outlets: OutletFlags = None) -> None:
    """Send a run's motion to other programs at its own pace, as `live` does, to test a receiver. Ctrl-C ends it.

    Parameters
    ----------
    speed
        Playback speed; 2 is twice as fast.
    loop
        Start again at the end, until Ctrl-C.
    """
    from shadowpuppet.cli.terminal import terminal
    from shadowpuppet.live.play import play_run
    from shadowpuppet.live.stream.choice import open_outlets

    if not 0 < speed <= 100:
        raise SettingsError(f"flags: speed: found {speed}, expected more than 0, up to 100")
    chosen = validate(OutletSettings, given(outlets), "flags")
    if chosen == OutletSettings():
        raise SettingsError("flags: found nobody to give the motion to, expected one of --osc, --websocket and --lsl")
    with terminal(quiet) as listener:
        play_run(run, open_outlets(chosen), listener, speed=speed, loop=loop)


PAGE = "view.html"
"""The page in the folder of the demo's second run."""


def demo(*, folder: Annotated[Path, output("Folder that gets the recordings and runs.")] = Path("shadowpuppet-demo"),
         config: Config = None, quiet: Quiet = False, flags: DemoFlags = None) -> None:
    """Make two sample recordings with known truth, with one camera and with four, track them, and name the pictures to open. A page shows
    the second run in space.

    Needs no data and no network.
    """
    from dataclasses import replace

    from shadowpuppet.cli.terminal import terminal
    from shadowpuppet.pipeline.synthesize import run_demo
    from shadowpuppet.viewer.scene.open_any import open_scene
    from shadowpuppet.viewer.web.page import write_page

    options = replace(options_from(flags, config), overlay=True)
    with terminal(quiet, folder) as listener:
        summaries = run_demo(folder, options, listener)
        write_page(summaries[-1].folder / PAGE, open_scene(summaries[-1].folder, Options()), True, listener)
    for summary in () if quiet else summaries:
        say("")
        say(f"{'several cameras' if summary.metrics.get('cameras', 1) > 1 else 'one camera'}")
        _show_run(summary.folder, summary.metrics, "overlay.png", *([PAGE] if summary is summaries[-1] else []))
    if not quiet:
        _show_next(folder)


def _show_next(folder: Path) -> None:
    """Commands to try after the demo."""
    run = folder / "run-ring"
    say("")
    say("A limb that is named above as doubtful is dashed in overlay.mp4, and has its own status in joints.csv.")
    say(f"{PAGE} shows the motion in space, in any browser. The sizes of these people come from reference pictures and training motion; "
        "without them errors are larger.")
    show_next(typed("view", run), typed("evaluate", run, "--report", folder / "run-ring.html"), typed("export", run, "--to", "bvh,trc"),
              typed("track", "YOUR-FILM.mp4", "--fov", "65", "--height", "1.75", "--overlay"))


def fit_person(recording: RecordingPath, /, *, file: Annotated[Path, output("File that gets the sizes.")] = Path("person.toml"),
               config: Config = None, quiet: Quiet = False, flags: LookFlags = None) -> None:
    """Measure a person once, from reference pictures or the film, or from the first seconds of several cameras; `track --person` uses the
    sizes."""
    from shadowpuppet.cli.terminal import terminal
    from shadowpuppet.pipeline.person import MonocularSubject
    from shadowpuppet.pipeline.prepare import fit_person

    with terminal(quiet) as listener:
        listener.begin("looking")
        found, look = fit_person(recording, file, options_from(flags, config), listener)
        listener.doubt(look)
    if not quiet:
        curves, rows = _fit_tables(found) if isinstance(found, MonocularSubject) else ((), _rig_fit_rows(found.summary))
        show(_sizes_table(found.person.sizes), *curves, pairs([*rows, ("saved", str(file))]))


def _show_run(folder: Path, metrics: Mapping[str, Any], *pictures: str) -> None:
    """Print the metrics and files of a run."""
    stages = ", ".join(f"{stage} {value:.1f}" for stage, value in metrics["ms_per_frame"].items())
    speed = f"{metrics['frames_per_s']:.3g} frames/s (ms a frame: {stages})" if metrics["frames_per_s"] else None
    errors = [error_table(metrics["errors"])] if "errors" in metrics else []
    files = files_in(folder, *pictures, "overlay.mp4", "joints.csv", "angles.csv", "intervals.csv")
    verdict = metrics.get("verdict")
    said = [verdict_of(verdict, "verdict on the run")] if verdict else []
    show(*said, metrics_table(metrics), *errors, pairs([("speed", speed), files]))


def _live_rows(live: Mapping[str, Any]) -> list[tuple[str, str | None]]:
    """Rows on the latency, speed and interruptions of a live session."""
    late, frames, smoothed = live["latency_ms"], live["latency_frames"], live.get("smoothed_latency_ms")
    share = live["frames_per_s"] * live["interval_ms"] / 1000
    return [("latency", f"{late['median']:.0f} ms from capture to pose ({frames['median']:.2f} of a frame's time); p95 "
                        f"{late['p95']:.0f} ms ({frames['p95']:.2f})"),
            ("smoothed", f"{smoothed['median']:.0f} ms from capture, for the display and other programs" if smoothed else None),
            ("speed", f"{live['frames_per_s']:.1f} frames/s of {1000 / live['interval_ms']:.1f}; {live['dropped']} dropped"),
            ("too slow", f"only one picture in {1 / share:.0f} is tracked: use a lower --rate or --max-size, or fewer cameras; play a film "
                         "slower, with --speed below 1" if 0 < share < KEEPS_UP else None),
            ("breaks", f"{live['breaks']} times no pictures came" if live["breaks"] else None)]


def _sizes_table(sizes: Any) -> Any:
    """Table of the named sizes in two columns: a1..a18 of an upper body, or those of a whole body."""
    from shadowpuppet.body.sizes import CardboxSizes

    names = sizes.names()
    rows = [(f"a{n}" if isinstance(sizes, CardboxSizes) else "", name, f"{1000 * value:.0f}")
            for n, (name, value) in enumerate(zip(names, sizes.to_array()), 1)]  # fmt: skip
    half = (len(rows) + 1) // 2
    both = ((*left, *right) for left, right in zip(rows[:half], [*rows[half:], ("", "", "")]))
    return table("sizes, mm", ("", "size", "mm", "", "size", "mm"), both, right=(2, 5))


def _fit_tables(found: MonocularSubject) -> tuple[list[Any], Sequence[tuple[str, str | None]]]:
    """Tables of a fit: cost over the rounds of Algorithm 1, one row per search of a subset of sizes; and rows on how well the sizes fit."""
    curves = [(name if n == 1 else "", str(n), str(len(curve)), f"{curve[0]:.0f}", f"{curve[-1]:.0f}", sparkline(curve))
              for name, searches in found.fit.curves.items() for n, curve in enumerate(searches, 1)]  # fmt: skip
    overlaps = ", ".join(f"{name} {value:.2f}" for name, value in found.fit.overlaps.items())
    rows = [("overlap", f"{overlaps}; film {found.summary['start_overlap']:.2f}"), ("height", f"{found.fit.guess.height:.2f} m"),
            ("source", found.person.source)]
    return [table("cost by round, pixels", ("sizes", "search", "rounds", "first", "last", "curve"), curves, right=(1, 2, 3, 4))], rows


def _rig_fit_rows(summary: Mapping[str, Any]) -> list[tuple[str, str | None]]:
    """Rows on how well sizes from several cameras fit."""
    residual = summary["residual"]
    return [("overlap", f"{summary['overlap']:.2f} of body and silhouettes, in {summary['frames']} frames"),
            ("surface", f"{1000 * residual:.1f} mm (rms) from the points of the hulls" if abs(residual) < float("inf") else None),
            ("source", summary["source"])]


def sparkline(values: Any, width: int = 30) -> str:
    """Numbers as a line of `width` bars at most, in characters."""
    import numpy as np

    chosen = np.asarray(values, float)[np.unique(np.linspace(0, len(values) - 1, width).astype(int))]
    span = float(np.ptp(chosen)) or 1.0
    return "".join(BARS[int((value - chosen.min()) / span * (len(BARS) - 1))] for value in chosen)
