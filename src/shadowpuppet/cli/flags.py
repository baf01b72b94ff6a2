"""Every option as a flag of the command line, made from the one place where it is documented."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass, make_dataclass
from pathlib import Path
from types import UnionType
from typing import TYPE_CHECKING, Annotated, Any, Union, get_args, get_origin

from cyclopts import Group, Parameter
from pydantic import BeforeValidator

from shadowpuppet.errors import SettingsError, choices
from shadowpuppet.live.settings import LiveSettings
from shadowpuppet.live.stream.settings import OutletSettings
from shadowpuppet.motion.prior.settings import PriorSettings
from shadowpuppet.pipeline.options import PATHS, Options, make_options, over, read_options
from shadowpuppet.settings import default_of, settings_of, validate
from shadowpuppet.synthetic.collection import named_specs
from shadowpuppet.synthetic.shorthand import Shorthand, expanded
from shadowpuppet.synthetic.spec import Spec, spec_from, spec_values
from shadowpuppet.synthetic.spec_file import read_spec

HEADINGS = ("Run", "Person", "Cameras", "Scene", "Pictures", "Live", "Other programs", "Learning", "Other")
RUN, PERSON, CAMERAS, SCENE, PICTURES, LIVE, PROGRAMS, LEARNING, OTHER = (Group(title, sort_key=n) for n, title in enumerate(HEADINGS))
"""Headings of `--help`."""
GROUPS = {
    **dict.fromkeys(("preset", "seed", "overlay"), RUN),
    **dict.fromkeys(("height", "distance", "body", "person", "prior"), PERSON),
    **dict.fromkeys(("rate", "speed", "countdown", "learn", "still", "show", "listen", "port", "record"), LIVE),
    **dict.fromkeys(("osc", "websocket", "origin", "lsl", "lsl_scope"), PROGRAMS),
    **dict.fromkeys(("fov", "calibration", "camera", "background", "masks", "region", "max_size", "every"), PICTURES),
}
SPEC_GROUPS = {
    **dict.fromkeys(("motion", "seconds", "body", "height"), PERSON),
    **dict.fromkeys(("cameras", "ring_radius", "distance", "camera_height", "fov", "fisheye"), CAMERAS),
    **dict.fromkeys(("background", "room", "clothing", "camouflage", "shadow", "occluder", "second_person"), SCENE),
    **dict.fromkeys(("size", "rate", "noise", "flicker", "drift", "crf"), PICTURES),
}
Quiet = Annotated[bool, Parameter(group=OTHER, negative=(), show_default=False, help="Show nothing but warnings and errors.")]
AsJson = Annotated[bool, Parameter(name="--json", group=OTHER, negative=(), show_default=False, help="Print JSON.")]
HIDDEN = Parameter(show=False)
"""Flags of the tables: many, and shown by `shadowpuppet settings`."""


def flags_of(kind: type, without: tuple[str, ...] = (), shown: bool = True, groups: Mapping[str, Group] = GROUPS) -> type:
    """A dataclass with the settings of `kind`, all None as long as no flag is given; tables become dotted flags."""
    made = []
    for field, hint, told in settings_of(kind):
        if field.name in without:
            continue
        if isinstance(hint, type) and is_dataclass(hint):
            made.append((field.name, Annotated[flags_of(hint, shown=False) | None, HIDDEN], None))
        else:
            made.append((field.name, Annotated[_bare(hint) | None, _parameter(field, told, shown, groups)], None))
    # cyclopts takes classes of the standard library, as which it would see this one, for single values.
    return make_dataclass(f"{kind.__name__}Flags", made, kw_only=True, namespace={"__module__": __name__})


def output(help: str) -> Parameter:
    """The flag -o."""
    return Parameter(name=["--output", "-o"], group=RUN, help=help)


def given(flags: Any) -> dict[str, Any]:
    """What flags said, as plain values."""
    values = {f.name: getattr(flags, f.name) for f in fields(flags)} if flags is not None else {}
    tables = {key: given(value) if is_dataclass(value) else value for key, value in values.items()}
    return {key: str(value) if isinstance(value, Path) else value for key, value in tables.items() if value is not None}


def options_from(flags: Any, config: Path | None) -> Options:
    """Options from flags over a file over the defaults. Raises `SettingsError`."""
    read = read_options(config) if config is not None else {}
    make_options(read, str(config))  # so that what is wrong in the file is said with its name
    return make_options(over(read, given(flags)), "flags")


def _bare(hint: Any) -> Any:
    """A type without its limits, which `make_options` checks; text where it is read from text."""
    if get_origin(hint) is Annotated:
        read = any(isinstance(item, BeforeValidator) for item in get_args(hint)[1:])
        return str if read else _bare(get_args(hint)[0])
    if get_origin(hint) in (Union, UnionType):
        return Union[tuple(_bare(part) for part in get_args(hint))]  # noqa: UP007 - a tuple of types
    return hint


def _parameter(field: Any, told: str, shown: bool, groups: Mapping[str, Group]) -> Parameter:
    default = default_of(field)
    end = "" if default is None or isinstance(default, bool) else f" [default: {default}]"
    return Parameter(help=told + end, show=shown, group=groups.get(field.name), show_choices=False)


def spec_of(path: Path | None, like: str | None, seed: int | None, flags: Any) -> Spec:
    """A spec of a recording to be made: flags over a file or a named spec. Raises `SettingsError`."""
    if path is not None and like is not None:
        raise SettingsError(f"flags: found a file ({path}) and --like {like}, expected one of them")
    named = named_specs()
    if like is not None and like not in named:
        raise SettingsError(f"flags: like: found {like!r}, which names no spec; there are: {choices(named)}")
    spec = read_spec(path) if path is not None else named[like] if like is not None else Spec()
    if seed is not None:
        spec = spec_from(spec_values(spec) | {"seed": seed}, "flags")
    return expanded(validate(Shorthand, given(flags), "flags"), spec)


if TYPE_CHECKING:
    Flags = LookFlags = ViewFlags = DemoFlags = SessionFlags = BatchFlags = LiveFlags = OutletFlags = PriorFlags = SpecFlags = Any
else:
    Flags = flags_of(Options)
    """All of `Options`."""
    LookFlags = flags_of(Options, without=("every", "overlay"))
    """Those that matter where nothing is tracked."""
    ViewFlags = flags_of(Options, without=("preset", "seed", "height", "distance", "body", "person", "prior", "masks", "overlay"))
    """Those that matter where a recording is looked at."""
    BatchFlags = flags_of(Options, without=("seed",))
    """Those that many runs with seeds of their own may share."""
    DemoFlags = flags_of(Options, without=(*PATHS, "height", "distance", "fov", "camera", "region", "max_size", "every", "overlay"))
    """Those that matter where the recording is known."""
    SessionFlags = flags_of(Options, without=("camera", "masks", "every", "overlay", "training"))
    """Those that matter where a camera is tracked as it happens."""
    LiveFlags = flags_of(LiveSettings)
    """What can be set about that beside."""
    OutletFlags = flags_of(OutletSettings)
    """To whom motion is given."""
    PriorFlags = flags_of(PriorSettings, without=("regions",), groups={field.name: LEARNING for field, _, _ in settings_of(PriorSettings)})
    """How a motion prior is learnt."""
    SpecFlags = flags_of(Shorthand, groups=SPEC_GROUPS)
    """What is often wanted of a made recording."""
