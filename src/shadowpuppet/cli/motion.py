"""The commands about motion: `fit-prior` learns a motion prior, `export` and `convert` write motion for other programs."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from shadowpuppet.body.models import WHOLE, WholeBodyName
from shadowpuppet.cli.flags import LEARNING, Quiet, Switch, flags_of, given, output, unpacked
from shadowpuppet.cli.tables import pairs, show, show_json, table
from shadowpuppet.errors import SettingsError, choices, extra_command, typed
from shadowpuppet.io.motion import EXPORTS, READABLE
from shadowpuppet.motion.prior.settings import PriorSettings
from shadowpuppet.settings import settings_of, validate

if TYPE_CHECKING:
    from shadowpuppet.io.motion.overview import MotionLook
    from shadowpuppet.motion.prior.training import TrainedPrior

    PriorFlags = Any
else:
    PriorFlags = unpacked(flags_of(PriorSettings, without=("regions",), groups={s.name: LEARNING for s in settings_of(PriorSettings)}))

MOST_NAMES = 40
"""Greatest number of names that are listed."""


def fit_prior(motions: Annotated[list[Path], Parameter(help=f"Files of motion: {choices(READABLE)}; .amc with its .asf beside it.")], /, *,
              file: Annotated[Path, output("File that gets the prior.")] = Path("prior.npz"), regions: str = "20",
              rate: float = 60.0, body: WholeBodyName = "anatomical", seed: int = 0,
              quiet: Quiet = False, flags: PriorFlags = None) -> None:  # fmt: skip
    """Learn a motion prior from motion capture; `track --prior` uses it. Clips may differ in frame rate, person and format.

    Parameters
    ----------
    regions
        Number of regions of poses, M; or choose, for the smallest number that is good for motion left out.
    rate
        Frame rate of the films to be tracked, frames/s.
    body
        Body model whose poses are learnt.
    seed
        Seed of the random numbers.
    """
    from shadowpuppet.cli.terminal import terminal
    from shadowpuppet.pipeline.learn_prior import prior_from_files

    if not (regions == "choose" or (regions.isdecimal() and len(regions) < 10)):
        raise SettingsError(f"flags: regions: found {regions!r}, expected a number or choose")
    values = given(flags) | ({"regions": int(regions)} if regions.isdecimal() else {})
    with terminal(quiet) as listener:
        listener.begin("learning")
        trained = prior_from_files(motions, file, validate(PriorSettings, values, "flags"), seed=seed, body=body, rate=rate,
                                   choose=regions == "choose")
    if not quiet:
        show(*_prior_tables(trained, file))


def export(run: Annotated[Path, Parameter(help="Folder that `track` or `live` made.")], /, *,
           to: Annotated[str, Parameter(help=f"Formats, separated by commas: {choices(EXPORTS)}; or all.")] = "bvh,c3d,trc,mot,csv,glb,npz",
           folder: Annotated[Path | None, output("Folder of the files. [default: export/ in the run's]")] = None,
           unit: Literal["m", "cm", "mm"] | None = None, missing: Literal["nan", "drop", "fill"] = "nan",
           model: Literal["rajagopal", "gait2392", "pose2sim", "own"] | None = None, weight: float | None = None,
           rest: Literal["t", "a", "hang"] = "hang", names: Literal["mixamo", "humanik", "unreal", "vrm"] | None = None,
           quiet: Quiet = False) -> None:  # fmt: skip
    """Write a run's motion for other programs: Blender, OpenSim, C3D viewers, game engines, pandas.

    Parameters
    ----------
    unit
        Unit of lengths in .bvh and .trc files. BVH files do not state it; Blender expects m. [default: m in BVH, mm in TRC]
    missing
        Unknown positions in .trc files: the text NaN, no frame that has one, or positions filled in between known frames.
    model
        OpenSim model whose coordinates .mot files have: Rajagopal 2016, gait2392, Pose2Sim's, or the .osim file of this command (own).
        [default: own where osim is among the formats, else rajagopal]
    weight
        Of the person, kilograms, for the masses in .osim files. [default: average build]
    rest
        Rest pose of the skeleton in .bvh, .glb and .usda files: arms aside, half down, or hanging.
    names
        Program whose names its bones have: Mixamo, HumanIK, Unreal 5 or VRM 1.0. [default: our joints' names]
    """
    from importlib.util import find_spec

    from shadowpuppet.cli.terminal import terminal
    from shadowpuppet.io.export import export_run
    from shadowpuppet.io.people import person_folders
    from shadowpuppet.io.run import read_run, resuming
    from shadowpuppet.pipeline.findings.verdict import Verdict

    formats = list(EXPORTS) if to == "all" else [name.strip().lower() for name in to.split(",")]
    with terminal(quiet) as listener:
        runs = [(f" of person {number}", read_run(folder)) for number, folder in person_folders(run).items()] or [("", read_run(run))]
        _, one = runs[0]
        if to == "all" and find_spec("pyarrow") is None:
            formats.remove("parquet")
            listener.warn(f"parquet is left out: it needs pyarrow; {extra_command('formats')}")
        if to == "all" and one.motion.body_name not in WHOLE:
            formats.remove("osim")
            listener.warn("osim is left out: only whole bodies have bones of constant lengths, as an OpenSim model needs")
        listener.begin("exporting")
        written = export_run(run, formats, folder, unit, missing, model, weight, rest, names)
        for of, each in runs:
            if not each.complete:
                listener.warn(f"the run{of} was broken off: {len(each.motion)} frames of it are exported, as tracked, not smoothed; "
                              f"{resuming(each)}")
            verdict = each.metrics.get("verdict", {})
            if "bad" in (verdict.get("word"), verdict.get("depth")):
                why = "; ".join(verdict["reasons"])
                listener.warn(f"the verdict on this run{of} is {Verdict.of(verdict).words} ({why}): look at its overlay before you use the "
                              "motion")
    if not quiet:
        level, whole = one.floor, one.motion.body_name in WHOLE
        side = "below" if level < 0 else "above"
        where = "the lowest foot over the film is" if whole else "the feet are by the person's height"
        floor = f"{abs(level):.2f} m {side} the camera, where {where}; at 0 in these files"
        show(pairs([("made", [*map(str, written)]), ("floor", floor if level else None)]))


def convert(source: Annotated[Path, Parameter(help=f"File of motion: {choices(READABLE)}; .amc with its .asf beside it.")],
            target: Annotated[Path, Parameter(help=f"File to be written: {choices(f'.{name}' for name in EXPORTS)}.")], /, *,
            all: Switch = False, names: Path | None = None, rate: float | None = None,
            source_unit: Literal["m", "cm", "mm", "in"] | None = None, unit: Literal["m", "cm", "mm"] | None = None,
            missing: Literal["nan", "drop", "fill"] = "nan",
            quiet: Quiet = False) -> None:  # fmt: skip
    """Convert a file of motion into another format: joints in metres, Z up, or as the other format requires.

    A skeleton (.bvh, .amc) stays one in .bvh, .glb and .usda; a body is fitted to joints alone if the target needs one.

    Parameters
    ----------
    all
        Keep every point under its own name, not only the joints that have one of our names.
    names
        TOML file with the source's names of our joints, if they are not known: lines such as left_shoulder = "Bone_17".
    rate
        Frame rate of an .amc file, frames/s, which it does not state. [default: 120]
    source_unit
        Unit of a .bvh file to be read. [default: found from the length of the legs]
    unit
        Unit of a .bvh or .trc file to be written. [default: m in BVH, mm in TRC]
    missing
        Unknown positions in a .trc file to be written: the text NaN, no frame that has one, or positions filled in between known frames.
    """
    from shadowpuppet.cli.terminal import terminal
    from shadowpuppet.io.export import BVH_UNITS, convert_motion

    if rate is not None and not 0 < rate < 1e6:
        raise SettingsError(f"flags: rate: found {rate}, expected frames a second, more than 0")
    with terminal(quiet) as listener:
        listener.begin("converting")
        content = convert_motion(source, target, own_names=all, rate=rate, unit=source_unit and BVH_UNITS[source_unit], target_unit=unit,
                                 missing=missing, names=names)
    if not quiet:
        show(pairs([("made", str(target)), ("of", content)]))


def explain_motion(path: Path, as_json: bool) -> None:
    """Explain a motion file, for `info`."""
    from shadowpuppet.cli.terminal import terminal
    from shadowpuppet.io.motion.overview import look_at_motion

    with terminal(quiet=as_json):
        look = look_at_motion(path)
    if as_json:
        return show_json(look)
    show(pairs(_motion_rows(look)))


def _motion_rows(look: MotionLook) -> Iterator[tuple[str, str | tuple[str, ...] | None]]:
    rate = f", {look.rate:.4g} frames/s" if look.rate else ""
    ours = ", ".join(name if name == theirs else f"{name} ({theirs})" for name, theirs in look.known.items())
    others = ", ".join(look.others[:MOST_NAMES]) + (", ..." if len(look.others) > MOST_NAMES else "")
    yield "motion", look.path
    yield "format", look.format
    yield "frames", f"{look.frames}{rate}, from {look.start:.2f} to {look.end:.2f} s"
    yield "joints", f"{len(look.known)} of known names{': ' if ours else ''}{ours}"
    yield "others", f"{len(look.others)}: {others}" if others else None
    yield "unknown", f"{100 * look.unknown:.1f} % of the positions" if look.unknown else None
    yield "legs", f"{look.leg:.2f} m from hip to ankle" if look.leg else None
    yield "analog", f"{len(look.channels)}, not read: {', '.join(look.channels[:MOST_NAMES])}" if look.channels else None
    yield "read", look.notes or None


def _prior_tables(trained: TrainedPrior, file: Path) -> Iterator[Any]:
    """The clips that a motion prior was learnt from, how well it fits them, and where it is."""
    import numpy as np

    def clip_row(clip: Any) -> tuple[str, ...]:
        worst = np.max(clip.fitted.by_frame[np.isfinite(clip.fitted.by_frame)])
        return ("/".join(Path(clip.name).parts[-2:])[-48:], str(clip.frames), str(len(clip.parts)), f"{1000 * clip.fitted.residual:.1f}",
                f"{1000 * worst:.1f}")

    yield table("learnt from; joints off the body in mm", ("motion", "frames", "parts", "joints", "worst frame"),
                map(clip_row, trained.clips))
    if (choice := trained.choice) is not None:
        tried = zip(choice.candidates, choice.training_errors, choice.held_out_errors)
        yield table("error in degrees of motion", ("regions", "learnt from", "left out"),
                    ((str(number), *(f"{np.degrees(error):.2f}" for error in errors)) for number, *errors in tried))
    prior = trained.prior
    yield pairs([("prior", f"{len(prior.subspaces)} regions of {prior.subspaces.dimensions} dimensions; {len(prior.names)} degrees of "
                           f"freedom, {prior.rate:g} frames/s"),
                 ("loses", f"{np.degrees(trained.error):.2f} degrees, {1000 * trained.joint_error:.1f} mm at the joints"),
                 ("saved", str(file)), ("track", typed("track", "RECORDING", "--prior", file))])  # fmt: skip
