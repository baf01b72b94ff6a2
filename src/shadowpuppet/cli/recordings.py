"""The commands about recordings: `info` describes one; `synthesize` makes one."""

from __future__ import annotations

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
from shadowpuppet.errors import SettingsError, ShadowPuppetError, choices, typed
from shadowpuppet.output import say_text
from shadowpuppet.settings import validate
from shadowpuppet.synthetic.collection import named_specs
from shadowpuppet.synthetic.spec import Spec, spec_from, spec_values
from shadowpuppet.synthetic.spec_changes import SpecChanges, apply_changes
from shadowpuppet.synthetic.spec_file import read_spec

if TYPE_CHECKING:
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
               force: Annotated[bool, switch("Replace another made recording, or write into a folder that has other files in it.")] = False,
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


def _gestures(spec: Spec) -> str:
    return ", ".join(f"{Path(gesture.file).name if gesture.file else gesture.motion} {gesture.seconds:g}" for gesture in spec.motion)
