"""Settings as flags of the command line, made from the classes that document them; and flags that several commands share."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass, make_dataclass
from pathlib import Path
from types import UnionType
from typing import TYPE_CHECKING, Annotated, Any, Union, get_args, get_origin

from cyclopts import Group, Parameter
from pydantic import BeforeValidator

from shadowpuppet.live.stream.settings import OutletSettings
from shadowpuppet.pipeline.options import Options, make_options, read_options
from shadowpuppet.settings import Setting, merged, settings_of

HEADINGS = ("Run", "Person", "Cameras", "Scene", "Pictures", "Live", "Other programs", "Learning", "Other")
RUN, PERSON, CAMERAS, SCENE, PICTURES, LIVE, PROGRAMS, LEARNING, OTHER = (Group(title, sort_key=n) for n, title in enumerate(HEADINGS))
"""Headings of `--help`."""
GROUPS = {
    **dict.fromkeys(("preset", "seed", "smooth", "cutoff", "gaps", "overlay", "anyway"), RUN),
    **dict.fromkeys(("height", "distance", "facing", "body", "person", "prior", "people", "appearance"), PERSON),
    **dict.fromkeys(("rate", "delay", "speed", "countdown", "learn", "still", "show", "listen", "port", "lag", "record"), LIVE),
    **dict.fromkeys(("osc", "websocket", "origin", "lsl", "lsl_scope"), PROGRAMS),
    **dict.fromkeys(("fov", "calibration", "camera", "background", "masks", "label", "region", "start", "end", "max_size", "every"),
                    PICTURES),
}


def flag(help: str, group: Group = RUN, name: str | None = None, **more: Any) -> Parameter:
    """A flag with a value."""
    return Parameter(name=name, group=group, help=help, **more)


def switch(help: str, group: Group = RUN, name: str | None = None) -> Parameter:
    """A flag without a value."""
    return Parameter(name=name, group=group, help=help, negative=(), show_default=False)


def output(help: str) -> Parameter:
    """The flag -o."""
    return Parameter(name=["--output", "-o"], group=RUN, help=help)


Switch = Annotated[bool, Parameter(negative=(), show_default=False)]
"""A flag without a value that the command's docstring explains."""
Config = Annotated[Path | None, flag("Settings file, TOML, as `shadowpuppet settings` prints it, or an earlier run's run.toml. Flags "
                                     "override it.", OTHER)]
Quiet = Annotated[bool, switch("Show only warnings and errors.", OTHER)]
Verbose = Annotated[bool, switch("Show all that was found, and all warnings.", OTHER)]
AsJson = Annotated[bool, switch("Print JSON.", OTHER, "--json")]
RecordingPath = Annotated[Path, Parameter(help="Folder with video/, calibration.toml, ...; a project of Pose2Sim, FreeMoCap or OpenCap; "
                                           "or a film or folder of pictures (then with --fov).")]


def flags_of(kind: type, without: tuple[str, ...] = (), visible: bool = True, groups: Mapping[str, Group] = GROUPS) -> Any:
    """A dataclass with the settings of `kind` as optional flags, None if not given; tables of settings become dotted flags.

    The flags of tables are hidden in `--help`: they are many, and `shadowpuppet settings` prints them.
    """
    made = []
    for setting in settings_of(kind):
        if setting.name in without:
            continue
        if isinstance(setting.kind, type) and is_dataclass(setting.kind):
            hint = Annotated[flags_of(setting.kind, visible=False) | None, Parameter(show=False)]
        else:
            hint = Annotated[_bare(setting.kind) | None, _parameter(setting, visible, groups)]
        made.append((setting.name, hint, None))
    # cyclopts treats classes of the standard library, such as this one without its `__module__`, as single values.
    return make_dataclass(f"{kind.__name__}Flags", made, kw_only=True, namespace={"__module__": __name__})


def unpacked(flags: Any) -> Any:
    """The annotation of a command's parameter that takes all `flags`."""
    return Annotated[flags | None, Parameter(name="*")]


def given(flags: Any) -> dict[str, Any]:
    """Flags that were given, as plain values."""
    values = {f.name: getattr(flags, f.name) for f in fields(flags)} if flags is not None else {}
    tables = {key: given(value) if is_dataclass(value) else value for key, value in values.items()}
    return {key: str(value) if isinstance(value, Path) else value for key, value in tables.items() if value is not None}


def options_from(flags: Any, config: Path | None) -> Options:
    """Options from flags; others from the file `config`, if given; others by default. Raises `SettingsError`."""
    read = read_options(config) if config is not None else {}
    make_options(read, str(config))  # so that an error in the file names the file
    return make_options(merged(read, given(flags)), "flags")


def _bare(hint: Any) -> Any:
    """A setting's type as the type of its flag: without limits, which `make_options` checks; str if the setting is parsed from text."""
    if get_origin(hint) is Annotated:
        read = any(isinstance(item, BeforeValidator) for item in get_args(hint)[1:])
        return str if read else _bare(get_args(hint)[0])
    if get_origin(hint) in (Union, UnionType):
        return Union[tuple(_bare(part) for part in get_args(hint))]  # noqa: UP007 - a tuple of types
    return hint


def _parameter(setting: Setting, visible: bool, groups: Mapping[str, Group]) -> Parameter:
    default = setting.default
    end = "" if default in (None, ()) or isinstance(default, bool) else f" [default: {default}]"
    return Parameter(help=setting.help + end, show=visible, group=groups.get(setting.name, OTHER))


OF_TRACKING = ("every", "smooth", "facing", "appearance", "cutoff", "gaps", "overlay")
"""Options that only tracking has."""
if TYPE_CHECKING:
    Flags = RunFlags = LookFlags = OutletFlags = Any
else:
    Flags = flags_of(Options)
    RunFlags = unpacked(Flags)
    """All options."""
    LookFlags = unpacked(flags_of(Options, without=OF_TRACKING))
    """Options of commands that do not track."""
    OutletFlags = unpacked(flags_of(OutletSettings))
    """Programs that receive the motion."""
