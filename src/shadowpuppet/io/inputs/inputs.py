"""The files that a run depends on, by name. They must be the same at its end as at its beginning, and where it goes on."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import BinaryIO, NamedTuple

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.io.calibration.formats import ENDINGS, find_calibration
from shadowpuppet.io.files.text import read_toml
from shadowpuppet.io.projects import LEVELS, films_in, find_project
from shadowpuppet.video import FILM_SUFFIXES, IMAGE_SUFFIXES

FOLDERS = ("video", "background", "masks", "references", "keypoints")
"""Folders of a recording with a film, a picture, a folder of pictures or keypoints for each camera or posture."""
PATTERNS = ("calibration.toml", "recording.toml", "truth.*", "truth_*.csv", "training.*")
"""Its other files."""
READ = {*FILM_SUFFIXES, *IMAGE_SUFFIXES, *ENDINGS, ".csv"}
"""Endings of files that are read in a folder of pictures, calibrations or keypoints; programs that show folders put other files there."""
MOST_NAMED = 3
"""Greatest number of files that a sentence names."""

State = tuple[tuple[str, int, int], ...]
"""Of the files of a part: name, size (bytes) and time of the last change (ns)."""


@dataclass(frozen=True, eq=False)
class Inputs:
    """The files that a run depends on, as they were when it began."""

    parts: Mapping[str, Path]
    """Files, and folders of pictures, by name: the path in the recording's folder; empty for a recording that is itself a film or a folder
    of pictures; `--person` for one that the setting `person` names."""
    began: Mapping[str, State]
    """Their state, by name."""

    @cached_property
    def contents(self) -> dict[str, str]:
        """A hash of the content of each part, by name: the same for a copy in another place."""
        return {name: content_of(list(_files(path))) for name, path in self.parts.items()}

    def without(self, paths: Iterable[Path | int | str | None]) -> Inputs:
        """The same without some parts, such as the films of cameras that are not used."""
        left_out = {str(path) for path in paths}
        parts = {name: path for name, path in self.parts.items() if str(path) not in left_out}
        return Inputs(parts, {name: self.began[name] for name in parts})

    def changed(self) -> str:
        """The files whose size or time of change differs from what it was when the run began, in words; empty if there are none."""
        return _listed(self.named(name) for name, path in self.parts.items() if state_of(path) != self.began[name])

    def named(self, name: str) -> str:
        """A part's name in messages."""
        path = self.parts.get(name)
        if name.startswith("--"):
            return name if path is None else f"{path.name} ({name})"
        return name or ("the film" if path is None else path.name)


class Resuming(NamedTuple):
    """How a run that keeps checkpoints begins."""

    goes_on: bool
    """Whether an earlier run of the same kind goes on from its checkpoint."""
    inputs: Inputs


NO_INPUTS = Inputs({}, {})


def inputs_of(recording: str | Path | Sequence[Path], settings: Mapping[str, Path | None]) -> Inputs:
    """The files that a run of a recording, or of films, depends on, as they are now. `settings`: files that settings name, by the setting's
    name."""
    sources = [Path(recording)] if isinstance(recording, str | Path) else recording
    parts = parts_of(sources[0]) if len(sources) == 1 else {str(source): source for source in sources}
    parts |= {f"--{name}": Path(path) for name, path in settings.items() if path is not None}
    return Inputs(parts, {name: state_of(path) for name, path in parts.items()})


def fingerprint(path: Path) -> str:
    """A hash of all that a recording, or a file that a setting names, holds for a run. It does not change if that is moved or copied."""
    contents = {name: content_of(list(_files(part))) for name, part in parts_of(path).items()}
    return sha256(json.dumps(contents, sort_keys=True).encode()).hexdigest()


def parts_of(path: Path) -> dict[str, Path]:
    """The parts of a recording that a run depends on, as `Inputs.parts`; none if there is no such recording."""
    if os.path.isfile(path):
        return {"": path}
    found = dict[str, Path]()
    for part in _parts(path):
        if not os.path.exists(part) or part in found.values():
            continue
        name = part.relative_to(path).as_posix() if part.is_relative_to(path) and ".." not in part.parts else part.name
        found[name if name not in found else f"{part.parent.name}/{part.name}"] = part
    return found if found or not os.path.isdir(path) else {"": path}


def _parts(folder: Path) -> Iterator[Path]:
    """Parts of a recording's folder; some may be missing, or come twice."""
    if os.path.isdir(folder):
        for kind in FOLDERS:
            yield from sorted(path for path in folder.glob(f"{kind}/*") if path.name[0] != ".")
        yield from sorted(path for pattern in PATTERNS for path in folder.glob(pattern))
        yield from _elsewhere(folder)
        if not (folder / "video").is_dir():
            yield from (film for films in films_in(folder).values() for film in films)
    try:
        project = find_project(folder)
        calibration = project.calibration if project else find_calibration(folder) if os.path.isdir(folder) else None
    except (ShadowPuppetError, OSError):
        return  # the run reports the error
    if calibration is not None:
        yield calibration
    if project is not None:
        yield from (*project.films.values(), *project.keypoints.values())
        yield from (level / "Config.toml" for level in (project.folder, *list(project.folder.resolve().parents)[:LEVELS]))
        yield project.folder / "sessionMetadata.yaml"


def _elsewhere(folder: Path) -> Iterator[Path]:
    """Files and folders that recording.toml names."""
    try:
        said = read_toml(folder / "recording.toml", ShadowPuppetError) if (folder / "recording.toml").exists() else {}
    except ShadowPuppetError:
        return  # the run reports the error
    texts = [value for of in (said, *(t for t in said.values() if isinstance(t, dict))) for value in of.values() if isinstance(value, str)]
    yield from (path for text in texts if text and os.path.exists(path := folder / text) and path != folder)


def state_of(path: Path) -> State:
    """Names, sizes and times of change of a file, or of the files that are read in a folder; empty if it is missing."""
    found = list[tuple[str, int, int]]()
    for name, file in _files(path):
        try:
            stat = file.stat()
        except OSError:
            continue
        found.append((name, stat.st_size, stat.st_mtime_ns))
    return tuple(found)


def _files(path: Path) -> Iterator[tuple[str, Path]]:
    """A file, without a name, or the files that are read in a folder, with theirs."""
    if os.path.isfile(path):
        yield "", path
    elif os.path.isdir(path):
        yield from sorted((file.name, file) for file in path.iterdir() if file.suffix.lower() in READ and file.name[0] != ".")


def _listed(names: Iterable[str]) -> str:
    """Names in words, with their verb: `a and b have changed`; empty for none."""
    found = list(names)
    if not found:
        return ""
    more = [f"{len(found) - MOST_NAMED} more"] if len(found) > MOST_NAMED else []
    said = [*found[:MOST_NAMED], *more]
    *first, last = said
    return f"{', '.join(first)} and {last} have changed" if first else f"{last} has changed"


WHOLE, LEAST = 1 << 24, 1 << 17
"""Bytes that are hashed of one film or folder at most, and of each file of a folder at most where these are many."""
BLOCKS = 16
"""Number of blocks, spread evenly from a long file's first byte to its last, that stand for all of it: films are too long to be read whole.
Another encoding of a film changes its size and each block, and other pictures in an uncompressed one change all blocks that they reach."""


def content_of(files: Sequence[tuple[str, Path]]) -> str:
    """A hash of files: of each its name, its size, and all of its bytes or `BLOCKS` blocks of them; that of no files is the hash of no
    data."""
    digest, most = hashlib.sha256(), max(WHOLE // max(len(files), 1), LEAST)
    for name, file in files:
        try:
            with file.open("rb") as data:
                size = file.stat().st_size
                digest.update(f"{name}\0{size}\0".encode("utf-8", "surrogateescape"))
                for block in _blocks(data, size, most):
                    digest.update(block)
        except OSError:
            digest.update(f"{name}\0unreadable\0".encode("utf-8", "surrogateescape"))
    return digest.hexdigest()


def _blocks(data: BinaryIO, size: int, most: int) -> Iterator[bytes]:
    """All of a file of this size, or blocks of `most` bytes together."""
    if size <= most:
        yield data.read(size)
        return
    length = most // BLOCKS
    for n in range(BLOCKS):
        data.seek((size - length) * n // (BLOCKS - 1))
        yield data.read(length)
