"""The commands `masks` and `keypoints`, which let a script make these of a recording's films."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from shadowpuppet.cli.flags import CAMERAS, OTHER, flag, output, switch, unpacked
from shadowpuppet.cli.tables import pairs, show, show_next
from shadowpuppet.errors import SettingsError, reason, typed

if TYPE_CHECKING:
    from shadowpuppet.io.made.making import Made


@dataclass(frozen=True)
class How:
    """Flags of both commands."""

    script: Annotated[str, flag("What makes them: a shipped script's name (--list), or the path of one of yours (--template).",
                                name="--with")] = "mediapipe"
    folder: Annotated[Path | None, output("Folder of the new recording, or the recording's own. [default: its name, and -masks or "
                                          "-keypoints]")] = None
    calibration: Annotated[Path | None, flag("Calibration, if the recording has none or another.", CAMERAS)] = None
    camera: Annotated[str | None, flag("Cameras, by name, with commas between; all by default.", CAMERAS)] = None
    list_scripts: Annotated[bool, switch("List the shipped scripts and stop.", name="--list")] = False
    template: Annotated[Path | None, flag("Write a script to start from into this file and stop.")] = None
    force: Annotated[bool, switch("Replace masks or keypoints that are there.")] = False
    quiet: Annotated[bool, switch("Show only warnings and errors.", OTHER)] = False


Source = Annotated[Path | None, Parameter(help="Folder with video/, or a film or folder of pictures.")]
if TYPE_CHECKING:
    Flags = Any
else:
    Flags = unpacked(How)


def masks(source: Source = None, /, *, flags: Flags = None) -> None:
    """Let another program make the silhouettes, such as a neural network, in an environment of its own; then `track` them with --masks.

    The script is code of others that you choose: it runs with your rights.
    Its packages are installed into an environment of their own when it is first used (by uv if that is there), and kept.
    """
    _make(("masks",), source, flags or How())


def keypoints(source: Source = None, /, *,
              masks: Annotated[bool, switch("Let the script make masks too, in the same pass.")] = False, flags: Flags = None) -> None:
    """Let another program find the keypoints, joints in the pictures, such as a neural network, in an environment of its own.

    The script is code of others that you choose: it runs with your rights.
    Its packages are installed into an environment of their own when it is first used (by uv if that is there), and kept.
    """
    _make(("keypoints", "masks") if masks else ("keypoints",), source, flags or How())


def _make(kinds: tuple[str, ...], source: Path | None, how: How) -> None:
    """Let a script make masks or keypoints, and say how to go on; or list scripts, or write one to start from."""
    from shadowpuppet.cli.terminal import terminal
    from shadowpuppet.external.script import find_script, shipped_scripts, template
    from shadowpuppet.io.made.made_recording import check_room, readable_recording
    from shadowpuppet.io.made.making import make
    from shadowpuppet.pipeline.footage import chosen_views

    kind = kinds[0]
    if how.list_scripts:
        return show(pairs(shipped_scripts(kind).items()))
    if how.template is not None:
        return _write_new(how.template, template(kind).read_text("utf-8"))
    if source is None:
        raise SettingsError(f"{kind}: found no recording, expected its folder, a film or a folder of pictures; or --list or --template")
    script = find_script(how.script, kind)
    recording, calibrated = readable_recording(source, how.calibration)
    recording = replace(recording, views=chosen_views(recording, how.camera))
    folder = how.folder or Path(f"{recording.name}-{kind}")
    check_room(kinds, folder, recording, how.force)
    with terminal(how.quiet) as listener:
        made = make(kinds, recording, script, folder, listener, calibrated=calibrated, replaced=how.force)
    if not how.quiet:
        show(_table(" and ".join(kinds), script.name, folder, made))
        flags = (*(("--masks",) if "masks" in kinds else ()), *(() if calibrated else ("--fov", "DEGREES")))
        show_next(typed("info", folder, *flags), typed("track", folder, *flags, "--overlay"))


def _table(what: str, script: str, folder: Path, made: list[Made]) -> Any:
    """Table of what was made."""
    frames, seconds = sum(one.frames for one in made), sum(one.seconds for one in made)
    return pairs([
        ("recording", str(folder)), (what, f"by {script}: {frames} frames, {frames / max(seconds, 1e-9):.1f} a second"),
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
