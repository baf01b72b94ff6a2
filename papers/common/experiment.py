"""An experiment: what is asked of it, what it is, what comes out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from papers.common.claims import Verdict


@dataclass(frozen=True)
class Request:
    """What was asked on the command line."""

    output: Path
    """Folder for all that is written."""
    recordings: tuple[Path, ...] = ()
    """Recordings to be used instead of made ones; none: they are made, in the folder."""
    runs: int = 1
    """How often what has chance in it is repeated; the runs' seeds are `seed`, `seed` + 1, ..."""
    seed: int = 0
    short: bool = False
    """A small version, to see that it works: smaller pictures, fewer frames, runs and settings. Its figures mean little."""
    workers: int = 1
    """Processes; 1: all is done in this one."""
    tell: Callable[[str], None] = print
    """Is told what is being done, a line each."""
    more: Mapping[str, Any] = field(default_factory=dict)
    """What the paper's own options are set to."""
    flags: tuple[str, ...] = ()
    """Those that are not as they would be, as on the command line."""

    @property
    def seeds(self) -> range:
        """A seed for each run."""
        return range(self.seed, self.seed + self.runs)


@dataclass(frozen=True)
class Table:
    """Rows under names; kept as CSV, and shown where it is short."""

    columns: Sequence[str]
    rows: Sequence[Sequence[Any]]
    """Numbers, text, or None where there is none."""
    shown: bool = False
    """Whether it is printed, and stands in the documentation."""


@dataclass
class Outcome:
    """What an experiment found."""

    settings: dict[str, Any] = field(default_factory=dict)
    """What it was done with: plain values."""
    pictures: dict[str, Any] = field(default_factory=dict)
    """Figures of Matplotlib, or images (H, W, 3), blue green red, by the name of their file without ending."""
    tables: dict[str, Table] = field(default_factory=dict)
    """By the name of their file without ending."""
    verdicts: list[Verdict] = field(default_factory=list)
    said: list[str] = field(default_factory=list)
    """Sentences for whoever looks at the pictures, made from the figures where they have any."""


@dataclass(frozen=True)
class Experiment:
    """A figure or table of a paper, or something that it says without showing it."""

    name: str
    """On the command line, and of the files."""
    title: str
    """What it is in the paper, and what it shows."""
    takes: str
    """How long it takes as it is, on two cores, all recordings made already."""
    make: Callable[[Request], Outcome]
    runs: int = 1
    """Repetitions as in the paper."""
    short_runs: int = 1
    """Repetitions of the short version."""
