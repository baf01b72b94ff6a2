"""The commands about recordings: `info` describes one; `synthesize` and `masks` make one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from shadowpuppet.cli.calibration import explain as calibration
from shadowpuppet.cli.flags import (
    CAMERAS,
    PERSON,
    PICTURES,
    SCENE,
    AsJson,
    Config,
    LookFlags,
    Quiet,
    Verbose,
    flag,
    flags_of,
    given,
    options_from,
    output,
    switch,
    unpacked,
)
from shadowpuppet.cli.tables import pairs, show, show_json, show_next
from shadowpuppet.errors import SettingsError, ShadowPuppetError, choices, reason, typed
from shadowpuppet.output import say_text
from shadowpuppet.settings import validate
from shadowpuppet.synthetic.collection import named_specs
from shadowpuppet.synthetic.spec import Spec, spec_from, spec_values
from shadowpuppet.synthetic.spec_changes import SpecChanges, apply_changes
from shadowpuppet.synthetic.spec_file import read_spec

if TYPE_CHECKING:
    from shadowpuppet.io.masks.segmentation import MadeMasks
    from shadowpuppet.io.recording import Recording

    SpecFlags = Any
else:
    SPEC_GROUPS = {
        **dict.fromkeys(("motion", "seconds", "posture", "body", "height"), PERSON),
        **dict.fromkeys(("cameras", "ring_radius", "distance", "camera_height", "fov", "fisheye"), CAMERAS),
        **dict.fromkeys(("background", "room", "clothing", "camouflage", "shadow", "occluder", "chair", "second_person", "people",
                         "together"), SCENE),
        **dict.fromkeys(("empty_seconds",), SCENE),
        **dict.fromkeys(("size", "rate", "noise", "flicker", "drift", "crf", "faults"), PICTURES),
    }
    SpecFlags = unpacked(flags_of(SpecChanges, groups=SPEC_GROUPS))


def info(recording: Annotated[Path, Parameter(help="Folder of a recording, film, folder of pictures; or a calibration or motion "
                                                      "file of any kind.")], /, *,
         to: Annotated[Path | None, flag("Write the calibration there: NAME.toml for Pose2Sim, Anipose and this program, or a folder for "
                                         "EasyMocap's intri.yml and extri.yml.", CAMERAS)] = None,
         unit: Annotated[str | None, flag("Unit of the calibration's lengths, if the file does not say: m, cm or mm.", CAMERAS)] = None,
         up: Annotated[str | None, flag("Up axis of the calibration's world: z, y, x, -z, -y, -x, or cameras (the average of the "
                                        "pictures' up).", CAMERAS, allow_leading_hyphen=True)] = None,
         config: Config = None, verbose: Verbose = False, as_json: AsJson = False, flags: LookFlags = None) -> None:  # fmt: skip
    """Look at a recording, as `track` does before it starts: cameras, scale, background, silhouettes, the person. Or explain a calibration:
    where its cameras stand, what they look at and see together, from above; and write it in another format. Or explain a file of motion."""
    from shadowpuppet.cli.motion import explain_motion
    from shadowpuppet.io.motion import READABLE

    if calibration.is_explained(recording):
        return calibration.explain(recording, to, unit, up, as_json)
    calibration.refuse_for_recordings(recording, to, unit, up)
    if recording.suffix.lower() in READABLE and recording.is_file():
        return explain_motion(recording, as_json)
    calibration.refuse_other_files(recording)
    from shadowpuppet.cli.terminal import terminal
    from shadowpuppet.pipeline.prepare import look_at

    with terminal(quiet=as_json, verbose=verbose) as listener:
        look = look_at(recording, options_from(flags, config), listener)
        listener.look(look)
    if as_json:
        show_json(look)
    if look.refusal:
        raise ShadowPuppetError(f"{recording}: {look.refusal}")


def synthesize(spec: Annotated[Path | None, Parameter(help="Spec file, TOML, as --show-spec prints it, or the spec.toml of a synthetic "
                                                           "recording.")] = None, /, *,
               folder: Annotated[Path | None, output("Folder of the recording. [default: the spec's name]")] = None,
               like: Annotated[str | None, flag("Start from a named spec; --list names them.")] = None,
               seed: Annotated[int | None, flag("Seed of the random numbers: the same seed makes the same recording.")] = None,
               list_specs: Annotated[bool, switch("List the named specs and stop.", name="--list")] = False,
               show_spec: Annotated[bool, switch("Print the resulting spec and stop.")] = False,
               force: Annotated[bool, switch("Write into a folder that has other files in it.")] = False,
               quiet: Quiet = False, flags: SpecFlags = None) -> None:  # fmt: skip
    """Make a recording with known truth (films, exact masks, joints, calibration) from a spec file or a few flags."""
    from shadowpuppet.cli.terminal import terminal
    from shadowpuppet.synthetic import spec_text

    if list_specs:
        return show(pairs((name, _spec_line(known)) for name, known in named_specs().items()))
    chosen = spec_of(spec, like, seed, flags)
    if show_spec:
        return say_text(spec_text(chosen).removesuffix("\n"))
    from shadowpuppet.pipeline.synthesize import make_recording

    folder = folder or Path(chosen.name)
    with terminal(quiet, folder, f"no frame was made yet, and what {folder} has is no whole recording; make it again") as listener:
        recording = make_recording(chosen, folder, listener, force)
    if not quiet:
        show(_recording_table(chosen, recording))
        show_next(typed("info", recording.path), typed("track", recording.path, "--overlay"),
                  typed("synthesize", recording.path / "spec.toml", "-o", "FOLDER"))


def masks(source: Annotated[Path | None, Parameter(help="Folder with video/, or a film or folder of pictures.")] = None, /, *,
          script: Annotated[str, flag("What makes the masks: a shipped script's name (--list), or the path of one of yours "
                                      "(--template).", name="--with")] = "mediapipe",
          folder: Annotated[Path | None, output("Folder of the new recording, or the recording's own. [default: its name and -masks]")]
          = None,
          calibration: Annotated[Path | None, flag("Calibration, if the recording has none or another.", CAMERAS)] = None,
          camera: Annotated[str | None, flag("Cameras, by name, with commas between; all by default.", CAMERAS)] = None,
          list_scripts: Annotated[bool, switch("List the shipped scripts and stop.", name="--list")] = False,
          template: Annotated[Path | None, flag("Write a script to start from into this file and stop.")] = None,
          force: Annotated[bool, switch("Replace masks that are there.")] = False, quiet: Quiet = False) -> None:  # fmt: skip
    """Let another program make the silhouettes, such as a neural network, in an environment of its own; then `track` them with --masks.

    The script is code of others that you choose: it runs with your rights. Its packages are installed into an environment of their own when
    it is first used (by uv if that is there), and kept.
    """
    from shadowpuppet.cli.terminal import terminal
    from shadowpuppet.pipeline.footage import chosen_views
    from shadowpuppet.silhouette.external.script import TEMPLATE, find_script, shipped_scripts

    if list_scripts:
        return show(pairs(shipped_scripts().items()))
    if template is not None:
        return _write_new(template, TEMPLATE.read_text("utf-8"))
    if source is None:
        raise SettingsError("masks: found no recording, expected its folder, a film or a folder of pictures; or --list or --template")
    from shadowpuppet.io.masks.masked_recording import check_room, readable_recording
    from shadowpuppet.io.masks.segmentation import make_masks

    chosen = find_script(script)
    recording, calibrated = readable_recording(source, calibration)
    recording = replace(recording, views=chosen_views(recording, camera))
    folder = folder or Path(f"{recording.name}-masks")
    check_room(folder, recording, force)
    with terminal(quiet) as listener:
        made = make_masks(recording, chosen, folder, listener, listener.note, calibrated=calibrated, replaced=force)
    if not quiet:
        show(_masks_table(recording, chosen.name, folder, made))
        flags = ("--masks", *(() if calibrated else ("--fov", "DEGREES")))
        show_next(typed("info", folder, *flags), typed("track", folder, *flags, "--overlay"))


def spec_of(path: Path | None, like: str | None, seed: int | None, flags: Any) -> Spec:
    """Spec of a synthetic recording: a file or a named spec, changed by flags. Raises `SettingsError`."""
    if path is not None and like is not None:
        raise SettingsError(f"flags: found a file ({path}) and --like {like}, expected one of them")
    named = named_specs()
    if like is not None and like not in named:
        raise SettingsError(f"flags: like: found {like!r}, which names no spec; there are: {choices(named)}")
    spec = read_spec(path) if path is not None else named[like] if like is not None else Spec()
    if seed is not None:
        spec = spec_from(spec_values(spec) | {"seed": seed}, "flags")
    return apply_changes(validate(SpecChanges, given(flags), "flags"), spec)


def _spec_line(spec: Spec) -> str:
    first, *others = spec.views()
    place = f"{1 + len(others)} cameras around" if others else f"at {first.distance:g} m, {first.fov_deg:g} degrees"
    return f"{spec.body.stature:.2f} m, {place}: {_gestures(spec)}"


def _recording_table(spec: Spec, recording: Recording) -> Any:
    """Table of the contents of a synthetic recording."""
    views, seconds, path = spec.views(), sum(gesture.seconds for gesture in spec.motion), recording.path
    first, cameras = views[0], f"{len(views)} cameras" if len(views) > 1 else "1 camera"
    extras = [thing.kind for thing in spec.scene.obstacles] + ["another person"] * len(spec.scene.bystanders)
    also = {"people/, truth_1.csv, ...": spec.scene.bystanders, "training.csv, training.trc": recording.training,
            "references/": recording.references}
    return pairs([
        ("recording", str(path)),
        ("person", f"{spec.body.stature:.2f} m: {_gestures(spec)}" + (f"; in the scene: {', '.join(extras)}" if extras else "")),
        ("films", f"{cameras}, {first.size[0]} x {first.size[1]} pixels, {spec.rate:g} frames/s, {seconds:g} s of motion"),
        *([("faults", ", ".join(dict.fromkeys(fault.kind for fault in spec.faults)))] if spec.faults else []),
        ("truth", ", ".join(["truth.csv, truth.trc, masks/", *(name for name, there in also.items() if there)])),
    ])  # fmt: skip


def _masks_table(recording: Recording, script: str, folder: Path, made: Sequence[MadeMasks]) -> Any:
    """Table of the masks that were made."""
    frames, seconds = sum(one.frames for one in made), sum(one.seconds for one in made)
    return pairs([
        ("recording", str(folder)), ("masks", f"by {script}: {frames} frames, {frames / max(seconds, 1e-9):.1f} a second"),
        *((one.camera, f"person found in {100 * (1 - one.empty / max(one.frames, 1)):.0f} % of {one.frames} frames") for one in made),
    ])  # fmt: skip


def _write_new(path: Path, text: str) -> None:
    """Write a file that is not there yet. Raises `SettingsError`."""
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise SettingsError(f"{path}: found a file there, expected a new name") from None
    except OSError as error:
        raise SettingsError(f"{path}: cannot be written ({reason(error)})") from None


def _gestures(spec: Spec) -> str:
    return ", ".join(f"{Path(gesture.file).name if gesture.file else gesture.motion} {gesture.seconds:g}" for gesture in spec.motion)
