"""The command line: parse, call one function, show."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import App, CycloptsError, Parameter

from shadowpuppet.cli import batch, calibration, evaluation, machine, motion, viewer
from shadowpuppet.cli.flags import (
    CAMERAS,
    OTHER,
    RUN,
    AsJson,
    DemoFlags,
    Flags,
    LiveFlags,
    LookFlags,
    OutletFlags,
    Quiet,
    SessionFlags,
    SpecFlags,
    given,
    options_from,
    output,
    spec_of,
)
from shadowpuppet.errors import INTERRUPTED, MISTAKE, ShadowPuppetError


def _version() -> str:
    from importlib.metadata import version

    return version("shadowpuppet")


app = App(name="shadowpuppet", version=_version, help_format="plaintext", suppress_keyboard_interrupt=False,
          help="Markerless motion capture from silhouettes.")
Config = Annotated[Path | None, Parameter(group=OTHER, help="File of settings, TOML, as `shadowpuppet settings` prints it, or an earlier "
                                                            "run's run.toml. Flags go before it.")]
Recording = Annotated[Path, Parameter(help="Folder with video/, calibration.toml, ...; or a film or folder of pictures (then with --fov).")]
All = Annotated[Flags | None, Parameter(name="*")]
ForLook = Annotated[LookFlags | None, Parameter(name="*")]
ForSession = Annotated[SessionFlags | None, Parameter(name="*")]
ForLive = Annotated[LiveFlags | None, Parameter(name="*")]
ForOutlets = Annotated[OutletFlags | None, Parameter(name="*")]
ForDemo = Annotated[DemoFlags | None, Parameter(name="*")]
ForSpec = Annotated[SpecFlags | None, Parameter(name="*")]
To = Annotated[Path | None, Parameter(group=CAMERAS, help="Write the calibration there: NAME.toml for Pose2Sim, Anipose and this program, "
                                                          "or a folder for EasyMocap's intri.yml and extri.yml.")]
Unit = Annotated[str | None, Parameter(group=CAMERAS, help="What the calibration's lengths are in, where it does not say: m, cm or mm.")]
Up = Annotated[str | None, Parameter(group=CAMERAS, allow_leading_hyphen=True,
                                     help="What is up in the calibration's world: z, y, x, -z, -y, -x, or cameras (as their pictures say, "
                                          "on the whole).")]
SpecPath = Annotated[Path | None, Parameter(help="File that describes it, TOML, as --show-spec prints it, or the spec.toml of a made "
                                                 "recording.")]
Like = Annotated[str | None, Parameter(group=RUN, help="Begin with a named spec; --list names them.")]
Seed = Annotated[int | None, Parameter(group=RUN, help="Seed of all chance: the same seed makes the same recording.")]


def switch(help: str, name: str | None = None) -> Parameter:
    """A flag that is there or not."""
    return Parameter(name=name, group=RUN, negative=(), show_default=False, help=help)


@app.command
def track(recording: Recording, /, *, folder: Annotated[Path | None, output("Folder of the run. [default: run-<recording>]")] = None,
          config: Config = None, quiet: Quiet = False, flags: All = None) -> None:
    """Track a person: from video to joints.csv, angles.csv, motion.npz, run.toml and metrics.json.

    First prints what it found, as `info` does.
    More settings are listed by `shadowpuppet settings`; each is a flag, such as --tracker.arm.particles 300.
    """
    from shadowpuppet.cli.terminal import terminal
    from shadowpuppet.pipeline.track import track_recording

    options = options_from(flags, config)
    folder = folder or Path(f"run-{recording.resolve().name.removesuffix(recording.suffix if recording.is_file() else '')}")
    with terminal(quiet, folder) as shown:
        summary = track_recording(recording, folder, options, shown)
    if not quiet:
        _show_run(folder, summary.metrics)


@app.command
def live(*, folder: Annotated[Path | None, output("Folder of the run. [default: live-<date>-<time>]")] = None, config: Config = None,
         quiet: Quiet = False, flags: ForSession = None, settings: ForLive = None, outlets: ForOutlets = None) -> None:
    """Track a person before a camera as it happens, shown in a window or on a page for a browser; Ctrl-C ends it.

    Step out of the picture while the empty scene is learnt, then stand still in it until you are found.
    No picture is kept unless --record is given. Joints go to no other program unless --osc, --websocket or --lsl is.
    """
    from time import strftime

    from shadowpuppet.cli.terminal import terminal
    from shadowpuppet.live.display.choice import open_display
    from shadowpuppet.live.run import run_live
    from shadowpuppet.live.settings import LiveSettings
    from shadowpuppet.live.stream.choice import open_outlets
    from shadowpuppet.live.stream.settings import OutletSettings
    from shadowpuppet.settings import validate

    options, chosen = options_from(flags, config), validate(LiveSettings, given(settings), "flags")
    folder = folder or Path(strftime("live-%Y%m%d-%H%M%S"))
    with terminal(quiet, folder) as shown:
        told = open_outlets(validate(OutletSettings, given(outlets), "flags"))
        if chosen.show == "viewer":
            from shadowpuppet.viewer.web.live import open_viewer

            display = open_viewer(chosen.listen, chosen.port, chosen.record)
        else:
            display = open_display(chosen.show, chosen.listen, chosen.port, chosen.record)
        metrics = run_live(folder, options, chosen, shown, display, outlets=told)
    if metrics is None:
        print("nobody was tracked: nothing was written", file=sys.stderr)
    elif not quiet:
        _show_live(folder, metrics)


@app.command
def info(recording: Annotated[Path, Parameter(help="Folder of a recording, film, folder of pictures; or a calibration of any kind.")], /, *,
         to: To = None, unit: Unit = None, up: Up = None, config: Config = None, as_json: AsJson = False,
         flags: ForLook = None) -> None:  # fmt: skip
    """Look at a recording, as `track` does before it begins: cameras, scale, background, silhouettes, the person; or explain a calibration:
    where its cameras stand, what they look at and see together, from above; and write it as another kind of file."""
    if calibration.is_explained(recording):
        return calibration.explain(recording, to, unit, up, as_json)
    calibration.refuse_for_recordings(recording, to, unit, up)
    from shadowpuppet.cli.terminal import show_json, terminal
    from shadowpuppet.pipeline.track import look_at

    with terminal(quiet=as_json) as shown:
        shown.begin("looking")
        look = look_at(recording, options_from(flags, config))
        shown.look(look)
    if as_json:
        show_json(look)
    if look.refusal:
        raise ShadowPuppetError(f"{recording}: {look.refusal}")


@app.command
def demo(*, folder: Annotated[Path, output("Folder that gets the recordings and runs.")] = Path("shadowpuppet-demo"),
         config: Config = None, quiet: Quiet = False, flags: ForDemo = None) -> None:
    """Make two sample recordings with known truth, of one camera and of four around a person, track them, and name the pictures to open.

    Needs no data and no network.
    """
    from dataclasses import replace

    from shadowpuppet.cli.terminal import terminal
    from shadowpuppet.pipeline.synthesize import run_demo

    options = replace(options_from(flags, config), overlay=True)
    with terminal(quiet, folder) as shown:
        summaries = run_demo(folder, options, shown)
    for summary in () if quiet else summaries:
        print(f"\n{'several cameras' if summary.metrics.get('cameras', 1) > 1 else 'one camera'}")
        _show_run(summary.folder, summary.metrics, "overlay.png")


@app.command(name="fit-person")
def measure_person(recording: Recording, /, *, file: Annotated[Path, output("File that gets the sizes.")] = Path("person.toml"),
                   config: Config = None, quiet: Quiet = False, flags: ForLook = None) -> None:
    """Measure a person once, from reference pictures or the film, or from several cameras' first seconds; `track --person` uses the sizes
    again."""
    from shadowpuppet.cli.tables import curves_table, fit_table, measured_table, sizes_table
    from shadowpuppet.cli.terminal import show, terminal
    from shadowpuppet.pipeline.person import MonocularSubject
    from shadowpuppet.pipeline.track import fit_person

    with terminal(quiet) as shown:
        shown.begin("looking")
        found, look = fit_person(recording, file, options_from(flags, config))
        shown.doubt(look)
    if quiet:
        return
    if isinstance(found, MonocularSubject):
        show(sizes_table(found.person.sizes), curves_table(found.fit.curves), fit_table(found, file))
    else:
        show(sizes_table(found.person.sizes), measured_table(found.summary, file))


@app.command
def synthesize(spec: SpecPath = None, /, *,
               folder: Annotated[Path | None, output("Folder of the recording. [default: the spec's name]")] = None,
               like: Like = None, seed: Seed = None,
               list_specs: Annotated[bool, switch("List the named specs, make nothing.", "--list")] = False,
               show_spec: Annotated[bool, switch("Print the spec that all this amounts to, make nothing.")] = False,
               force: Annotated[bool, switch("Write into a folder that has other files in it.")] = False,
               quiet: Quiet = False, flags: ForSpec = None) -> None:  # fmt: skip
    """Make a recording with known truth: films, exact masks, joints, calibration, from a spec file or a few flags."""
    from shadowpuppet.cli.terminal import show, terminal
    from shadowpuppet.synthetic import named_specs, spec_text

    if list_specs:
        from shadowpuppet.cli.tables import specs_table

        return show(specs_table(named_specs()))
    made = spec_of(spec, like, seed, flags)
    if show_spec:
        return print(spec_text(made), end="")
    from shadowpuppet.cli.tables import made_table
    from shadowpuppet.pipeline.synthesize import make_recording

    folder = folder or Path(made.name)
    with terminal(quiet, folder, f"no frame was made yet, and what {folder} has is no whole recording; make it again") as shown:
        recording = make_recording(made, folder, shown, force)
    if not quiet:
        show(made_table(made, recording))


@app.command
def settings(*, preset: str = "default") -> None:
    """Print every setting with its explanation: a file for --config, and the names of the flags.

    Parameters
    ----------
    preset
        Settings to begin with: default, liu2011 or ni2008.
    """
    from shadowpuppet.pipeline.options import make_options, options_text

    print("# Settings of `shadowpuppet track`; a setting particles in the table [tracker.arm] is the flag --tracker.arm.particles.\n")
    print(options_text(make_options({"preset": preset})))


@app.command
def completion(shell: Literal["bash", "zsh", "fish", "powershell"], /) -> None:
    """Print a script that lets a shell complete commands, flags and files by the Tab key.

    In ~/.bashrc: eval "$(shadowpuppet completion bash)"; in ~/.zshrc the same with zsh, after compinit; in config.fish:
    shadowpuppet completion fish | source.

    Parameters
    ----------
    shell
        Which shell: bash, zsh, fish or powershell.
    """
    script = app.generate_completion(prog_name="shadowpuppet", shell=shell)
    made = re.search(r"^(_\w+)\(\)", script, re.MULTILINE)
    if shell == "zsh" and made is not None:  # by itself it is a file for zsh's own folders, and evaluated it would do nothing
        script += f"\ncompdef {made[1]} shadowpuppet"
    print(script)


@app.command
def bench(*, json: Path | None = None,
          quick: Annotated[bool, Parameter(negative=(), show_default=False)] = False, quiet: Quiet = False) -> None:
    """Measure how fast it is here: particles and frames beside OpenCV and plain NumPy, the whole chain, memory, start. Some minutes.

    Parameters
    ----------
    json
        File that gets all figures, by flat keys such as "mono.particle_us".
    quick
        Fewer rounds, a shorter film, nothing compiled anew.
    """
    from shadowpuppet.cli.tables import bench_tables
    from shadowpuppet.cli.terminal import show, terminal
    from shadowpuppet.evaluation.bench.run import check_writable, run_bench, write_figures

    if json is not None:
        check_writable(json)
    with terminal(quiet) as shown:
        found = run_bench(quick, shown)
    if json is not None:
        write_figures(json, found)
    if not quiet:
        show(*bench_tables(found))


app.command(evaluation.evaluate)
app.command(calibration.check)
app.command(motion.fit_prior, name="fit-prior")
app.command(motion.humaneva)
app.command(motion.export)
app.command(motion.convert)
app.command(motion.play)
app.command(batch.batch)
app.command(machine.doctor)
app.command(viewer.view)


def _show_run(folder: Path, metrics: Mapping[str, Any], *pictures: str) -> None:
    """What came out, and where it lies."""
    from shadowpuppet.cli.tables import error_table, measures_table, pairs
    from shadowpuppet.cli.terminal import show

    stages = ", ".join(f"{stage} {value:.1f}" for stage, value in metrics["ms_per_frame"].items())
    names = [*pictures, *(name for name in ("overlay.mp4", "joints.csv", "angles.csv") if (folder / name).exists())]
    errors = [error_table(metrics["errors"])] if "errors" in metrics else []
    show(measures_table(metrics), *errors, pairs([("speed", f"{metrics['frames_per_s']:.0f} frames/s (ms a frame: {stages})"),
                                                 ("made", "\n".join(str(folder / name) for name in names))]))


def _show_live(folder: Path, metrics: Mapping[str, Any]) -> None:
    from shadowpuppet.cli.tables import live_rows, measures_table, pairs
    from shadowpuppet.cli.terminal import show

    names = [name for name in ("joints.csv", "angles.csv", "recording") if (folder / name).exists()]
    show(measures_table(metrics), pairs([*live_rows(metrics["live"]), ("made", "\n".join(str(folder / name) for name in names))]))


def run(tokens: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code: 0, or 2 for a user's mistake; 1 and 3 are a command's own.

    Ctrl-C is told here, and leaves with 130.
    """
    try:
        code = app(list(tokens) if tokens is not None else None, exit_on_error=False, print_error=False, result_action="return_value")
        sys.stdout.flush()
    except (ShadowPuppetError, CycloptsError) as error:
        return _fail(error)
    except KeyboardInterrupt as interrupt:
        print(f"interrupted{': ' if interrupt.args else ''}{' '.join(map(str, interrupt.args))}", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:  # as of `| head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    return code if isinstance(code, int) else 0


def _fail(error: Exception) -> int:
    print(f"error: {' '.join(str(error).split())}", file=sys.stderr)
    return MISTAKE
