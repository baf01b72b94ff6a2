"""All that can be set about a run, from flags and files."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, ValidationError, WrapValidator
from pydantic_core import PydanticCustomError

from shadowpuppet.body.sizes import DISTANCES, HEIGHTS, WHOLE, expected_metres
from shadowpuppet.errors import SettingsError, choices
from shadowpuppet.io.calibration.calibration_files import read_toml
from shadowpuppet.motion.prior.settings import PriorSettings
from shadowpuppet.settings import checked, settings_of, validate
from shadowpuppet.silhouette.settings import SilhouetteSettings
from shadowpuppet.tracking.monocular.settings import PRESETS, InitializationSettings, MonocularSettings, make_settings
from shadowpuppet.tracking.multiview.settings import MULTIVIEW_PRESETS, MultiviewSettings, make_multiview_settings

TABLES = ("tracker", "multiview", "silhouette", "initialization", "training")
"""Options that are tables of settings."""
TRACKERS: dict[str, tuple[Mapping[str, Any], Callable[..., Any]]] = {
    "tracker": (PRESETS, make_settings), "multiview": (MULTIVIEW_PRESETS, make_multiview_settings)}  # fmt: skip
"""Tables of the trackers' settings, with their presets and what makes them."""
PATHS = ("calibration", "background", "person", "prior")
"""Options that are files; in a file of settings they are relative to it."""


def _corners(value: object) -> object:
    value = value.split(",") if isinstance(value, str) else value
    if isinstance(value, (list, tuple)) and len(value) != 4:
        raise ValueError(f"expected four numbers x0,y0,x1,y1, found {len(value)}")
    return value


def _metres(limits: tuple[float, float]) -> WrapValidator:
    """Says of a length that cannot be what can, in metres."""

    def check(value: Any, handler: Callable[[Any], Any]) -> Any:
        try:
            return handler(value)
        except ValidationError:
            raise PydanticCustomError("metres", "{expected}", {"expected": expected_metres(value, limits)}) from None

    return WrapValidator(check)


@checked
class Options:
    """What a run can be told; each is a flag of the command line and a line of TOML."""

    preset: str = "default"
    """Settings to begin with: default (the best we know), liu2011 (the paper's, of one camera) or ni2008 (the paper's, of several)."""
    seed: Annotated[int, Field(ge=0)] = 0
    """Seed of all randomness: the same seed gives the same run."""
    height: Annotated[float, Field(ge=HEIGHTS[0], le=HEIGHTS[1]), _metres(HEIGHTS)] | None = None
    """Height of the person, metres, shoes on. Replaces what recording.toml says."""
    distance: Annotated[float, Field(ge=DISTANCES[0], le=DISTANCES[1]), _metres(DISTANCES)] | None = None
    """Distance from the camera to the middle of the body at the start, metres. Replaces what recording.toml says."""
    body: Literal["cardbox", "boxes", "rounded", "anatomical", "cylinders"] | None = None
    """The body's model, in place of the tracker's own: of the upper body (the first three), or of the whole person."""
    person: Path | None = None
    """Sizes of the person, as an earlier run or `fit-person` saved them (person.toml)."""
    prior: Path | None = None
    """What the motion is like, as `fit-prior` saved it (.npz), for several cameras. Left out, it is learnt from the recording's training
    motion, where it has some."""
    fov: Annotated[float, Field(gt=0, lt=180)] | None = None
    """Horizontal field of view, degrees, of a camera without calibration."""
    calibration: Path | None = None
    """Calibration in place of the recording's own."""
    camera: str | None = None
    """The camera whose film is tracked alone, where the recording has several; or some of them, with commas between, together."""
    background: Path | None = None
    """Picture or film of the empty scene in place of the recording's own."""
    masks: bool = False
    """Take the recording's ready silhouettes (masks/) instead of making them."""
    region: Annotated[tuple[int, int, int, int], BeforeValidator(_corners)] | None = None
    """Region of interest x0,y0,x1,y1, pixels of the film: what is outside counts as background."""
    max_size: Annotated[int, Field(ge=64, le=8192)] = 640
    """Pixels that the longer side of a frame may have; larger frames are scaled down."""
    every: Annotated[int, Field(ge=1, le=1000)] = 1
    """Of so many pictures of a film one is tracked: less work for films of many frames/s."""
    overlay: bool = False
    """Write overlay.mp4 too: model, matching result and raw picture, one below the other."""
    tracker: MonocularSettings = MonocularSettings()
    """The tracker of one camera."""
    multiview: MultiviewSettings = MultiviewSettings()
    """The tracker of several cameras."""
    silhouette: SilhouetteSettings = SilhouetteSettings()
    """How the person is told from the background."""
    initialization: InitializationSettings = InitializationSettings()
    """How the person's sizes are found."""
    training: PriorSettings = PriorSettings()
    """How a motion prior is learnt from the recording's training motion, or by `fit-prior`."""


def make_options(values: Mapping[str, Any] | None = None, source: str = "settings") -> Options:
    """Options from plain values, as TOML has them; tables may be given in part, on top of the preset.

    Raises `SettingsError` for an unknown name or an impossible value, with what is possible.
    """
    values = dict(values or {})
    for table in TABLES:
        if not isinstance(values.get(table, {}), Mapping):
            raise SettingsError(f"{source}: {table}: found {values[table]!r}, expected a table [{table}]")
    preset = values.get("preset", "default")
    if not isinstance(preset, str):
        raise SettingsError(f"{source}: preset: found {preset!r}, expected a name in quotes")
    known = [*dict.fromkeys(name for presets, _ in TRACKERS.values() for name in presets)]
    if preset not in known:
        raise SettingsError(f"{source}: unknown preset {preset!r}; there are: {choices(known)}")
    if values.get("body") is not None:
        values |= {table: {**values.get(table, {}), "body": values["body"]} for table in TRACKERS
                   if table == "tracker" or values["body"] in WHOLE}
    for table, (presets, make) in TRACKERS.items():
        values[table] = make(preset if preset in presets else "default", values.get(table, {}), f"{source}: {table}")
    return validate(Options, values, source)


def read_options(path: str | Path) -> dict[str, Any]:
    """Plain values from a TOML file of settings, or from the run.toml of an earlier run. Raises `SettingsError`."""
    path = Path(path)
    return settings_in(read_toml(path, SettingsError), path)


def settings_in(data: Mapping[str, Any], path: Path, source: str | None = None) -> dict[str, Any]:
    """Plain values from what a TOML file says, or a table of it; files are told from its folder on. Raises `SettingsError`."""
    data = dict(data["settings"] if isinstance(data.get("settings"), dict) and "versions" in data else data)
    unknown = set(data) - {f.name for f in fields(Options)}
    if unknown:
        names = choices(f.name for f in fields(Options))
        raise SettingsError(f"{source or path}: unknown setting {min(unknown)!r}; there are: {names}")
    return data | {key: str(path.parent / data[key]) for key in PATHS if isinstance(data.get(key), str)}


def over(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """Plain values with others in their place, tables within tables."""
    both = {key: over(below[key], value) for key, value in above.items()
            if isinstance(value, Mapping) and isinstance(below.get(key), Mapping)}  # fmt: skip
    return {**below, **above, **both}


def plain_options(options: Options) -> dict[str, Any]:
    """Options as `make_options` and TOML take them; what is not set is left out, and files are told by their whole path."""
    values = {key: value for key, value in _plain(options).items() if value is not None}
    return values | {key: str(Path(values[key]).resolve()) for key in PATHS if key in values}


def options_text(options: Options) -> str:
    """Every option with its explanation, as a TOML file of settings."""
    return "\n".join(_lines(options, ""))


def _plain(value: Any) -> Any:
    return {f.name: _plain(getattr(value, f.name)) for f in fields(value)} if is_dataclass(value) else value


def _toml(value: Any) -> str:
    """A value as TOML, on one line."""
    import tomli_w

    return f"[{', '.join(map(_toml, value))}]" if isinstance(value, tuple) else tomli_w.dumps({"x": value}).strip()[4:]


def _lines(settings: Any, title: str) -> Iterator[str]:
    inner = []
    for field, _, told in settings_of(type(settings)):
        value = getattr(settings, field.name)
        if is_dataclass(value):
            inner.append((field.name, value, told))
            continue
        yield from textwrap.wrap(told, 100, initial_indent="# ", subsequent_indent="# ")
        if value is None:
            yield f"# {field.name} ="
        else:
            yield f"{field.name} = {_toml(value)}"
    for name, value, told in inner:
        place = f"{title}.{name}" if title else name
        yield from ("", f"# {told}", f"[{place}]")
        yield from _lines(value, place)
