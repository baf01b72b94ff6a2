"""The commands about motion capture: what a motion is like, learnt from files of it, HumanEva as a recording, motion for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from shadowpuppet.cli.flags import OutletFlags, PriorFlags, Quiet, given, output
from shadowpuppet.errors import choices
from shadowpuppet.io.motion import EXPORTS, READABLE

ForOutlets = Annotated[OutletFlags | None, Parameter(name="*")]
ForPrior = Annotated[PriorFlags | None, Parameter(name="*")]


def fit_prior(motions: Annotated[list[Path], Parameter(help=f"Files of motion: {choices(READABLE)}; .amc with its .asf beside it.")], /, *,
              file: Annotated[Path, output("File that gets the prior.")] = Path("prior.npz"), regions: str = "20",
              rate: float = 60.0, body: Literal["anatomical", "cylinders"] = "anatomical", seed: int = 0,
              quiet: Quiet = False, flags: ForPrior = None) -> None:  # fmt: skip
    """Learn what a motion is like from motion capture; `track --prior` uses it. Clips may differ in frame rate, person and format.

    Parameters
    ----------
    regions
        Regions of poses, M; or choose, which finds the least number that is good for motion left out.
    rate
        Frames/s of the films that it is for.
    body
        The body whose poses are learnt.
    seed
        Seed of all chance.
    """
    from shadowpuppet.cli.tables import prior_tables
    from shadowpuppet.cli.terminal import show, terminal
    from shadowpuppet.errors import SettingsError
    from shadowpuppet.motion.prior.settings import PriorSettings
    from shadowpuppet.pipeline.learn_prior import prior_from_files
    from shadowpuppet.settings import validate

    if not (regions == "choose" or (regions.isdecimal() and len(regions) < 10)):
        raise SettingsError(f"flags: regions: found {regions!r}, expected a number or choose")
    values = given(flags) | ({"regions": int(regions)} if regions.isdecimal() else {})
    with terminal(quiet) as shown:
        shown.begin("learning")
        trained = prior_from_files(motions, file, validate(PriorSettings, values, "flags"), seed=seed, body=body, rate=rate,
                                   choose=regions == "choose")
    if not quiet:
        show(*prior_tables(trained, file))


def humaneva(data: Annotated[Path, Parameter(help="Folder of HumanEva-I or II, with S1, S2, ...")], /, *,
             folder: Annotated[Path | None, output("Folder of the recording. [default: the trial's name]")] = None,
             subject: str = "S2", action: str = "Walking", trial: int = 1, part: Literal["validation", "training", "all"] = "validation",
             training_frames: int = 100, quiet: Quiet = False) -> None:  # fmt: skip
    """Make a recording of a trial of HumanEva, which needs a licence: calibration, timing, truth and training; films stay in their place.

    Parameters
    ----------
    subject
        S1 to S4.
    action
        Walking, Jog, Box, Gestures, ThrowCatch or Combo.
    trial
        Its number.
    part
        Frames of the owners' own partition, or all; validation of S2 is what Ni 2008 tracks.
    training_frames
        Frames in a row that training.csv gets, of the training part of the same action; 0 for all.
    """
    from shadowpuppet.cli.tables import trial_table
    from shadowpuppet.cli.terminal import show, terminal
    from shadowpuppet.io.humaneva import read_humaneva, write_humaneva

    with terminal(quiet) as shown:
        shown.begin("reading")
        found = read_humaneva(data, subject, action, trial, part, training_frames)
        folder = folder or Path(found.recording.name)
        write_humaneva(found, folder)
    if not quiet:
        show(trial_table(found, folder))


def export(run: Annotated[Path, Parameter(help="Folder that `track` or `live` made.")], /, *,
           to: Annotated[str, Parameter(help=f"Formats, separated by commas: {choices(EXPORTS)}; or all.")] = "bvh,c3d,trc,mot,csv,glb,npz",
           folder: Annotated[Path | None, output("Folder of the files. [default: export/ in the run's]")] = None,
           unit: Literal["m", "cm", "mm"] = "m", quiet: Quiet = False) -> None:  # fmt: skip
    """Write a run's motion for other programs: Blender, OpenSim, C3D viewers, game engines, pandas.

    Parameters
    ----------
    unit
        Of BVH files, which do not tell it; Blender takes m.
    """
    from shadowpuppet.cli.tables import pairs
    from shadowpuppet.cli.terminal import show, terminal
    from shadowpuppet.io.export import export_run

    names = list(EXPORTS) if to == "all" else [name.strip().lower() for name in to.split(",")]
    with terminal(quiet) as shown:
        shown.begin("exporting")
        written = export_run(run, names, folder, unit)
    if not quiet:
        show(pairs([("made", "\n".join(map(str, written)))]))


def convert(source: Annotated[Path, Parameter(help=f"File of motion: {choices(READABLE)}; .amc with its .asf beside it.")],
            target: Annotated[Path, Parameter(help=f"File to be written: {choices(f'.{name}' for name in EXPORTS)}.")], /, *,
            all: Annotated[bool, Parameter(negative=(), show_default=False)] = False, rate: float | None = None,
            source_unit: Literal["m", "cm", "mm", "in"] | None = None, unit: Literal["m", "cm", "mm"] = "m",
            quiet: Quiet = False) -> None:  # fmt: skip
    """Turn a file of motion into another: joints in metres, Z up, or as the other format wants them.

    A skeleton (.bvh, .amc) stays one in .bvh and .glb; to joints alone, a body is fitted where the target needs one.

    Parameters
    ----------
    all
        Keep every point under its own name, not the joints that are known by ours alone.
    rate
        Frames/s of an .amc file, which tells none. [default: 120]
    source_unit
        Of a .bvh file that is read. [default: found from the length of the legs]
    unit
        Of a .bvh file that is written.
    """
    from shadowpuppet.cli.tables import pairs
    from shadowpuppet.cli.terminal import show, terminal
    from shadowpuppet.errors import SettingsError
    from shadowpuppet.io.export import BVH_UNITS, convert_motion

    if rate is not None and not 0 < rate < 1e6:
        raise SettingsError(f"flags: rate: found {rate}, expected frames a second, more than 0")
    with terminal(quiet) as shown:
        shown.begin("converting")
        told = convert_motion(source, target, own_names=all, rate=rate, unit=source_unit and BVH_UNITS[source_unit], target_unit=unit)
    if not quiet:
        show(pairs([("made", str(target)), ("of", told)]))


def play(run: Annotated[Path, Parameter(help="Folder that `track` or `live` made.")], /, *, speed: float = 1.0,
         loop: Annotated[bool, Parameter(negative=(), show_default=False)] = False,
         quiet: Quiet = False, outlets: ForOutlets = None) -> None:  # fmt: skip
    """Give a run's motion to other programs at its own pace, as `live` does while it tracks: to try what receives it. Ctrl-C ends it.

    Parameters
    ----------
    speed
        How many times as fast.
    loop
        Begin again at the end, until Ctrl-C.
    """
    from shadowpuppet.cli.terminal import terminal
    from shadowpuppet.errors import SettingsError
    from shadowpuppet.live.play import play_run
    from shadowpuppet.live.stream.choice import open_outlets
    from shadowpuppet.live.stream.settings import OutletSettings
    from shadowpuppet.settings import validate

    if not 0 < speed <= 100:
        raise SettingsError(f"flags: speed: found {speed}, expected more than 0, up to 100")
    chosen = validate(OutletSettings, given(outlets), "flags")
    if chosen == OutletSettings():
        raise SettingsError("flags: found nobody to give the motion to, expected one of --osc, --websocket and --lsl")
    with terminal(quiet) as shown:
        play_run(run, open_outlets(chosen), shown, speed=speed, loop=loop)
