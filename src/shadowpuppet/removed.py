"""Commands, settings and files of earlier versions, each with its replacement: one sentence in place of "unknown".

A removal adds one line here. The command line and `make_options` look it up.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from shadowpuppet.errors import SettingsError, ShadowPuppetError

COMMANDS = {
    "bench": "bench has moved: python -m benchmarks.bench in the source repository",
    "humaneva": "humaneva has moved: python -m papers.humaneva in the source repository",
}
"""By the command's name."""
SETTINGS = {
    "silhouette.maintain": "the background no longer follows lasting changes: leave them out with --region, or take masks of another "
                           "program (shadowpuppet masks)",
    "multiview.forces.robust": "the bound of forces is rho: multiview.forces.rho = \"none\", \"linear\" or \"quadratic\"",
    "multiview.gauss_newton.finalists": "with five cameras and more the best eight poses are refined to the end",
    "silhouette.method = knn": "found knn, which is gone; mog2 does the same as well, and auto better",
    **{f"like = humaneva_{motion}": f"humaneva_{motion} has moved: papers/ni2008/recordings.py in the source repository makes its spec"
       for motion in ("walking", "jogging", "boxing")},
    "joints = humaneva": "found humaneva, which is gone: its 15 joints are pelvis,neck,head,limbs",
}
"""By the setting's name with dots, or by its name and a value."""
BOUGUET = ("found a calibration of Bouguet's toolbox, which is not read any more, expected calibration.toml or OpenCV's YAML; a trial of "
           "HumanEva becomes a recording by python -m papers.humaneva in the source repository")
FILES = dict.fromkeys((".cal", ".m", ".mat"), BOUGUET)
"""By the ending of a calibration file."""
IDLE: dict[str, object] = {"silhouette.maintain": False, "multiview.forces.robust": True, "multiview.gauss_newton.finalists": 0.3,
                           "multiview.keypoints": 0.25}  # fmt: skip
"""By the name of a removed setting: the value that changed nothing; of one in another unit: its default before. Files of earlier versions
hold it, and it is left out."""


def refuse_tokens(tokens: Sequence[str]) -> None:
    """Raise `ShadowPuppetError` for a command line with a removed command, flag, or value of a flag."""
    if tokens and tokens[0] in COMMANDS:
        raise ShadowPuppetError(COMMANDS[tokens[0]])
    for token, following in zip(tokens, [*tokens[1:], ""]):
        if token.startswith("--"):
            name, _, value = token[2:].partition("=")
            refuse_setting(name.replace("-", "_"), value or following, token.partition("=")[0])


def without_removed(values: Mapping[str, Any], source: str) -> dict[str, Any]:
    """Settings, tables in tables, without removed ones that changed nothing. Raises `SettingsError` for others; `source` names the file."""
    return dict(_kept(values, "", source))


def of_earlier_run(values: Mapping[str, Any]) -> dict[str, Any]:
    """The settings of a finished run without all that is removed: the run is shown and measured, not repeated."""
    return dict(_kept(values, "", None))


def _kept(values: Mapping[str, Any], table: str, source: str | None) -> Iterator[tuple[str, Any]]:
    for key, value in values.items():
        name = f"{table}{key}"
        if (name in IDLE and value == IDLE[name]) or (source is None and _replacement(name, value) is not None):
            continue
        refuse_setting(name, value, f"{source}: {name}")
        yield key, dict(_kept(value, f"{name}.", source)) if isinstance(value, Mapping) else value


def refuse_setting(name: str, value: object, place: str) -> None:
    """Raise `SettingsError` for a removed setting or value; `place` is where it stands."""
    if (replacement := _replacement(name, value)) is not None:
        raise SettingsError(f"{place}: {replacement}")


def _replacement(name: str, value: object) -> str | None:
    return SETTINGS.get(f"{name} = {value}", SETTINGS.get(name))
