"""Options of a run, from flags and files of settings."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, ValidationError, WrapValidator
from pydantic_core import PydanticCustomError

from shadowpuppet.body.models import WHOLE, BodyName
from shadowpuppet.body.sizes import DISTANCES, HEIGHTS, expected_metres
from shadowpuppet.errors import SettingsError, choices, warn
from shadowpuppet.io.files.text import read_toml
from shadowpuppet.motion.prior.settings import PriorSettings
from shadowpuppet.removed import without_removed
from shadowpuppet.settings import checked, plain_values, settings_of, validate
from shadowpuppet.silhouette.settings import SilhouetteSettings
from shadowpuppet.tracking.monocular.settings import (
    INITIALIZATION_PRESETS,
    PRESETS,
    InitializationSettings,
    MonocularSettings,
    make_initialization,
    make_settings,
)
from shadowpuppet.tracking.multiview.settings import MULTIVIEW_PRESETS, MultiviewSettings, make_multiview_settings
from shadowpuppet.tracking.smoothing.method import Method
from shadowpuppet.video.moments import moment_text

TABLES = ("tracker", "multiview", "silhouette", "initialization", "training")
"""Options that are tables of settings."""
WITH_PRESETS: dict[str, tuple[Mapping[str, Any], Callable[..., Any]]] = {
    "tracker": (PRESETS, make_settings), "multiview": (MULTIVIEW_PRESETS, make_multiview_settings),
    "initialization": (INITIALIZATION_PRESETS, make_initialization)}  # fmt: skip
"""For each table of settings that has presets: these, and the function that makes the settings."""
OF_ONE, OF_SEVERAL = ("distance", "facing", "tracker", "initialization"), ("prior", "appearance", "multiview", "training")
"""Options that matter with one camera only, and with several only."""
OF_SILHOUETTES = ("background", "masks", "region", "silhouette")
"""Options that matter only where silhouettes are evidence."""
PATHS = ("calibration", "background", "person", "prior")
"""Options that are file names, relative to the folder of the settings file that contains them."""


def _corners(value: object) -> object:
    value = value.split(",") if isinstance(value, str) else value
    if isinstance(value, (list, tuple)) and len(value) != 4:
        raise ValueError(f"expected four numbers x0,y0,x1,y1, found {len(value)}")
    return value


def _metres(limits: tuple[float, float]) -> WrapValidator:
    """A validator of lengths; its error states the limits in metres."""

    def check(value: object, handler: Callable[[object], object]) -> object:
        try:
            return handler(value)
        except ValidationError:
            raise PydanticCustomError("metres", "{expected}", {"expected": expected_metres(value, limits)}) from None

    return WrapValidator(check)


@checked
class Options:
    """Settings of a run; each is a flag of the command line and a line of TOML."""

    preset: str = "default"
    """Settings to start from: default (best results), liu2011 (the paper's, one camera; liu2011_printed with its measuring of the person,
    too, from reference pictures) or ni2008 (the paper's, several cameras)."""
    seed: Annotated[int, Field(ge=0)] = 0
    """Seed of the random numbers; the same seed gives the same run."""
    height: Annotated[float, Field(ge=HEIGHTS[0], le=HEIGHTS[1]), _metres(HEIGHTS)] | None = None
    """Height of the person with shoes, metres. Overrides recording.toml."""
    distance: Annotated[float, Field(ge=DISTANCES[0], le=DISTANCES[1]), _metres(DISTANCES)] | None = None
    """Distance from the camera to the middle of the body at the start, metres; one camera only. Overrides recording.toml."""
    body: BodyName | None = None
    """Body model in place of the tracker's own: an upper body (cardbox, cardbox_bends, boxes or rounded; one camera only) or a whole body
    (anatomical or cylinders). By default anatomical with several cameras, and with one where the person walks, squats or sits down and feet
    are seen, unless sizes are given; else rounded; the paper's with the preset of a paper."""
    person: Path | None = None
    """Sizes of the person, saved by an earlier run or by `fit-person` (person.toml)."""
    prior: Path | None = None
    """Motion prior saved by `fit-prior` (.npz), for several cameras. By default it is learnt from the recording's training motion, if there
    is any."""
    fov: Annotated[float, Field(gt=0, lt=180)] | None = None
    """Horizontal field of view, degrees, of a camera without calibration; one camera only."""
    calibration: Path | None = None
    """Calibration file in place of the recording's own."""
    camera: str | None = None
    """Name of the one camera to track with, if the recording has several; or several names, separated by commas."""
    background: Path | None = None
    """Picture or film of the empty scene in place of the recording's own; one camera only."""
    masks: bool = False
    """Use the recording's ready silhouettes (masks/) instead of segmenting the film."""
    evidence: Literal["silhouettes", "keypoints", "silhouettes,keypoints"] | None = None
    """What a person is tracked by: silhouettes; a detector's keypoints (keypoints/), which need no empty scene; or both. By default by
    both where there are keypoints, with the papers' presets by silhouettes."""
    people: Annotated[int, Field(ge=1, le=6)] | None = None
    """Number of people to follow, 1 to 6, with one camera or live 1; by default they are counted. Anybody else is ignored."""
    label: Annotated[int, Field(ge=0)] | None = None
    """The person's label where ready silhouettes are label images, such as PNG with a palette; by default the only one."""
    region: Annotated[tuple[int, int, int, int], BeforeValidator(_corners)] | None = None
    """Region of interest x0,y0,x1,y1, pixels of the film; everything outside is background. One camera only."""
    start: Annotated[str, BeforeValidator(moment_text)] | None = None
    """Where to begin, on the recording's clock: 3.5 (seconds) or 120f (frames). Times in the results stay the recording's."""
    end: Annotated[str, BeforeValidator(moment_text)] | None = None
    """Where to end, likewise; the frame at that moment is left out."""
    max_size: Annotated[int, Field(ge=64, le=8192)] = 640
    """Longest side of a frame, pixels; larger frames are scaled down."""
    every: Annotated[int, Field(ge=1, le=1000)] = 1
    """Only every Nth frame is tracked, which saves time with films of a high frame rate."""
    anyway: bool = False
    """Track even where the examination of the recording says that it cannot work."""
    overlay: bool = False
    """Also write overlay.mp4: model, matching result and raw picture, one below the other."""
    smooth: Literal["off", "tracker", "butterworth"] | None = None
    """Smoothing of the tracked motion over time, when the film is over: tracker (by the doubt of every frame, with people's accelerations),
    butterworth (a low-pass filter, fourth order, without lag), off. By default tracker, and off with the papers' presets."""
    facing: Literal["camera", "away"] = "camera"
    """Where the person looks in the first frame: to the camera, or away from it, which one camera's silhouettes do not tell. One camera
    only; no effect with `smooth = "off"`."""
    cutoff: Annotated[float, Field(gt=0, le=1000)] = 6.0
    """Cut-off frequency of the Butterworth filter, Hz."""
    gaps: Annotated[float, Field(ge=0, le=10)] | None = None
    """Longest gap in the motion that is bridged, seconds; its frames are `predicted`. By default 0.5, and 0 with the papers' presets."""
    appearance: bool = True
    """Whether several people are told apart by the colours of their clothes (not of their heads), where there are pictures."""
    tracker: MonocularSettings = MonocularSettings()
    """Tracker for one camera."""
    multiview: MultiviewSettings = MultiviewSettings()
    """Tracker for several cameras."""
    silhouette: SilhouetteSettings = SilhouetteSettings()
    """Segmentation of the person from the background."""
    initialization: InitializationSettings = InitializationSettings()
    """Estimation of the person's sizes."""
    training: PriorSettings = PriorSettings()
    """Learning a motion prior, from the recording's training motion or by `fit-prior`."""

    @property
    def uses_silhouettes(self) -> bool:
        """Whether silhouettes are used."""
        return self.evidence != "keypoints"

    @property
    def uses_keypoints(self) -> bool:
        """Whether keypoints are used where there are any."""
        return "keypoints" in self.evidence if self.evidence is not None else self.preset == "default"

    @property
    def body_is_known(self) -> bool:
        """Whether one camera's body does not depend on the film: it is said, a paper's, or that of given sizes."""
        usual = MonocularSettings().body
        return self.body is not None or self.preset != "default" or self.person is not None or self.tracker.body != usual

    def with_body(self, body: BodyName) -> Options:
        """The options with another body for one camera."""
        return self if body == self.tracker.body else replace(self, body=body, tracker=replace(self.tracker, body=body))

    @property
    def smoothing(self) -> tuple[Method, float]:
        """How the motion is smoothed, and the longest gap that is bridged, seconds."""
        method, gaps = ("tracker", 0.5) if self.preset == "default" else ("off", 0.0)
        return self.smooth or method, gaps if self.gaps is None else self.gaps


def make_options(values: Mapping[str, Any] | None = None, source: str = "settings") -> Options:
    """Options from plain values, as in TOML; tables may be partial and override the preset. Raises `SettingsError`."""
    values = without_removed(values or {}, source)
    for table in TABLES:
        if not isinstance(values.get(table, {}), Mapping):
            raise SettingsError(f"{source}: {table}: found {values[table]!r}, expected a table [{table}]")
    preset = values.get("preset", "default")
    if not isinstance(preset, str):
        raise SettingsError(f"{source}: preset: found {preset!r}, expected a name in quotes")
    known = [*dict.fromkeys(name for presets, _ in WITH_PRESETS.values() for name in presets)]
    if preset not in known:
        raise SettingsError(f"{source}: unknown preset {preset!r}; there are: {choices(known)}")
    if values.get("body") is not None:
        tables = ("tracker", "multiview") if values["body"] in WHOLE else ("tracker",)
        values |= {table: {**values.get(table, {}), "body": values["body"]} for table in tables}
    for table, (presets, make) in WITH_PRESETS.items():
        values[table] = make(preset if preset in presets else "default", values.get(table, {}), f"{source}: {table}")
    return validate(Options, values, source)


def read_options(path: str | Path) -> dict[str, Any]:
    """Plain values from a TOML file of settings or from the run.toml of an earlier run. Raises `SettingsError`."""
    path = Path(path)
    return settings_in(read_toml(path, SettingsError), path)


def settings_in(data: Mapping[str, Any], path: Path, source: str | None = None) -> dict[str, Any]:
    """Plain values from the contents of the TOML file at `path`, with file names relative to its folder. Raises `SettingsError`."""
    data = dict(data["settings"] if isinstance(data.get("settings"), dict) and "versions" in data else data)
    names = {f.name for f in fields(Options)}
    if source is None and {"case", "grid", "seeds"} & set(data):
        raise SettingsError(f"{path}: found a file for `shadowpuppet batch`, expected settings of one run")
    if unknown := set(data) - names:
        raise SettingsError(f"{source or path}: unknown setting {min(unknown)!r}; there are: {choices(names)}")
    return data | {key: str(path.parent / data[key]) for key in PATHS if isinstance(data.get(key), str)}


def check_used(options: Options, several: bool) -> None:
    """Warn of options that were changed and have no effect with one camera, or with `several`. Raises `SettingsError` for the preset of a
    paper about the other."""
    presets, cameras = (MULTIVIEW_PRESETS, "several cameras") if several else (PRESETS, "one camera")
    if options.preset not in presets:
        instead = ", or one camera (--camera)" if several else ""
        other = "one camera" if several else "several cameras"
        raise SettingsError(f"preset: found {options.preset!r}, a method for {other}; expected with {cameras} one of {choices(presets)}"
                            f"{instead}")
    if options.uses_keypoints and options.preset != "default":
        raise SettingsError(f"evidence: found {options.evidence!r} with the preset {options.preset}, expected silhouettes: the papers have "
                            "no keypoints")
    given = {name: getattr(options, name) for name in ("preset", "body") if getattr(options, name) is not None}
    usual, now = plain_values(make_options(given)), plain_values(options)
    without = () if options.uses_silhouettes else OF_SILHOUETTES
    for keys, where in ((OF_ONE if several else OF_SEVERAL, cameras), (without, "keypoints alone")):
        idle = [name for key in keys for name in _changed(key, usual[key], now[key])]
        if idle:
            warn(f"no effect with {where}: {', '.join(idle)}")
    if options.label is not None and not options.masks:
        warn("no effect without ready silhouettes (--masks): label")


def _changed(name: str, usual: Any, now: Any) -> Iterator[str]:
    """Names of the settings that differ, with those of the tables in which they stand."""
    if isinstance(now, dict):
        for key in now:
            yield from _changed(f"{name}.{key}", usual[key], now[key])
    elif now != usual:
        yield name


def plain_options(options: Options) -> dict[str, Any]:
    """Options as plain values for `make_options` or TOML; those that are None are left out, file names are absolute."""
    values = {key: value for key, value in plain_values(options).items() if value is not None}
    return values | {key: str(Path(values[key]).resolve()) for key in PATHS if key in values}


def options_text(options: Options) -> str:
    """Every option with its explanation, as a TOML file of settings."""
    return "\n".join(_lines(options, ""))


def _toml(value: object) -> str:
    """A value as TOML, on one line."""
    import tomli_w

    return f"[{', '.join(map(_toml, value))}]" if isinstance(value, tuple) else tomli_w.dumps({"x": value}).strip()[4:]


def _lines(settings: Any, title: str) -> Iterator[str]:
    tables = []
    for name, _, _, text in settings_of(type(settings)):
        value = getattr(settings, name)
        if is_dataclass(value):
            tables += ["", f"# {text}", f"[{title}{name}]", *_lines(value, f"{title}{name}.")]
        else:
            yield from textwrap.wrap(text, 100, initial_indent="# ", subsequent_indent="# ")
            yield f"# {name} =" if value is None else f"{name} = {_toml(value)}"
    yield from tables
