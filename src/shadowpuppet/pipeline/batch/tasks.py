"""Tasks of a batch: one for every recording, combination of settings, and seed, identified by a hash of all that it depends on."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from shadowpuppet.errors import SettingsError
from shadowpuppet.io.files.plain import plain
from shadowpuppet.io.inputs.inputs import fingerprint
from shadowpuppet.pipeline.batch.grid import MAX_RUNS, Case
from shadowpuppet.pipeline.options import PATHS, make_options, plain_options
from shadowpuppet.pipeline.silhouette_cache import film_of

Track = Callable[..., Any]
"""A function that makes a run folder, as `track_recording` does. Arguments: recording, folder, `Options`, `Listener` and `SilhouetteCache`;
the last two may be None."""
TRACK = "shadowpuppet.pipeline.track:track_recording"
"""The default `Track`, by name."""


@dataclass(frozen=True)
class Task:
    """One run, in plain values that can be sent to a worker."""

    id: str
    """Hash of the recording's name and content, the settings and the seed."""
    recording: str
    """Its absolute path."""
    name: str
    """Name of the recording's folder, with names of parent folders if two have the same name."""
    case: str
    seed: int
    settings: dict[str, Any]
    """All settings, with the seed."""
    varied: dict[str, Any]
    """Settings that differ between tasks, by dotted name."""
    film: str
    """Hash of recording and options that determine the silhouettes; tasks with the same hash can share these."""

    choice: str
    """Label of case and grid values; empty if nothing varies."""
    label: str
    """Recording, case, grid values and seed, for people."""
    folder: str
    """Name of the run's folder: label and id."""
    track: str
    """Name of the `Track` function, `module:function`."""

    def wire(self) -> dict[str, Any]:
        """The fields, for JSON."""
        return asdict(self)


def make_tasks(recordings: Sequence[str | Path], cases: Sequence[Case], seeds: Sequence[int], track: Track | None = None) -> list[Task]:
    """A task for each recording, case and seed, in this order. Raises `SettingsError` if two would be the same run, or if workers
    cannot import `track`."""
    if not recordings:
        raise SettingsError("recordings: found none, expected one or more")
    if len(recordings) * len(cases) * len(seeds) > MAX_RUNS:
        raise SettingsError(f"batch: found {len(recordings)} recordings x {len(cases)} choices of settings x {len(seeds)} seeds, "
                            f"expected at most {MAX_RUNS} runs")
    paths = [Path(recording).resolve() for recording in recordings]
    for n, path in enumerate(paths):
        if path in paths[:n]:
            raise SettingsError(f"recordings: found {recordings[n]} twice, expected each once")
    names = _names(paths)
    varied = sorted({name for case in cases for name in case.varied})
    chosen = [_Chosen(case, varied, name_of(track)) for case in cases]
    _check_different(chosen)
    prints = [fingerprint(path) for path in paths]
    return [choice.task(str(path), name, print_, seed) for path, name, print_ in zip(paths, names, prints) for choice in chosen
            for seed in seeds]  # fmt: skip


def name_of(track: Track | None) -> str:
    """The `module:function` by which workers import a function; `TRACK` for None. Raises `SettingsError` if they cannot."""
    if track is None:
        return TRACK
    module, name = getattr(track, "__module__", "__main__"), getattr(track, "__qualname__", "")
    if module == "__main__" or not name.isidentifier():
        raise SettingsError(f"track: found {name or track!r} of {module}, expected a function of a module that workers can import")
    return f"{module}:{name}"


def named(name: str) -> Track:
    """The function of a name `module:function`. Raises `SettingsError` if there is none."""
    module, _, function = name.partition(":")
    try:
        return getattr(import_module(module), function)
    except (ImportError, AttributeError) as error:
        raise SettingsError(f"track: found {name!r}, which cannot be imported ({error}); expected a function of a module that every worker "
                            "has") from None


class _Chosen:
    """A case with all of its settings."""

    def __init__(self, case: Case, varied: Sequence[str], track: str) -> None:
        self.case, self.track = case, track
        self.settings = plain(plain_options(make_options(case.values)), "settings")
        self.varied = {name: _found(self.settings, name) for name in varied}
        files = {name: fingerprint(Path(self.settings[name])) for name in PATHS if name in self.settings}
        other = {} if track == TRACK else {"track": track}
        self.said = {key: value for key, value in (self.settings | files | other).items() if key != "seed"}

    def task(self, recording: str, name: str, content: str, seed: int) -> Task:
        said = json.dumps([name, content, self.said, seed], sort_keys=True)
        film = json.dumps(film_of(recording, self.settings), sort_keys=True)
        label, id = ", ".join(filter(None, [name, self.case.label, f"seed {seed}"])), _hash(said)
        words = re.sub(r"[^A-Za-z0-9.+_-]+", "-", label.replace(", ", "_")).strip("-.")
        return Task(id, recording, name, self.case.name, seed, self.settings | {"seed": seed}, self.varied, _hash(film), self.case.label,
                    label, f"{words[:80]}_{id}", self.track)


def _check_different(chosen: Sequence[_Chosen]) -> None:
    known: dict[str, Case] = {}
    for choice in chosen:
        other = known.setdefault(json.dumps(choice.said, sort_keys=True), choice.case)
        if other is not choice.case:
            raise SettingsError(f"grid: found {choice.case.label!r} and {other.label!r}, which are the same settings; expected each once")


def _names(paths: Sequence[Path]) -> list[str]:
    """Short unique names of recordings at absolute paths, with as many parent folders as that needs."""
    inside = [path.parts[1:] for path in paths]
    for depth in range(1, max(map(len, inside)) + 1):
        names = ["-".join(parts[-depth:]) for parts in inside]
        if len(set(names)) == len(names):
            return names
    return ["-".join([*parts, str(n)]) for n, parts in enumerate(inside)]  # such as a-b/c and a/b-c


def _found(settings: Mapping[str, Any], name: str) -> Any:
    """A setting by its dotted name; None if it is not set."""
    value: Any = settings
    for part in name.split("."):
        value = value.get(part) if isinstance(value, Mapping) else None
    return value


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:12]
