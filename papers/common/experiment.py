"""An experiment, its request and its outcome."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from papers.common.claims import Verdict


@dataclass(frozen=True)
class Request:
    """What the command line asks for."""

    output: Path
    """Folder of all output."""
    recordings: tuple[Path, ...] = ()
    """Recordings in place of made ones, which are made in the folder."""
    runs: int = 1
    """Repetitions of what is random, with the seeds `seed`, `seed` + 1, ..."""
    seed: int = 0
    short: bool = False
    """A small version, to see that it works: smaller pictures, fewer frames, runs and settings."""
    workers: int = 1
    """Processes; 1 for this one alone."""
    tell: Callable[[str], None] = print
    """Called with a line for each step."""
    more: Mapping[str, Any] = field(default_factory=dict)
    """Values of the paper's own options."""
    flags: tuple[str, ...] = ()
    """Those that differ from their defaults, as on the command line."""
    fingerprint: Mapping[str, list[float]] = field(default_factory=dict)
    """What the results depend on (`papers.common.fingerprint`); empty for a short version, and for recordings that are given."""

    @property
    def seeds(self) -> range:
        """A seed for each run."""
        return range(self.seed, self.seed + self.runs)


@dataclass(frozen=True)
class Table:
    """A table, kept as CSV."""

    columns: Sequence[str]
    rows: Sequence[Sequence[Any]]
    """Numbers, text, or None."""
    shown: bool = False
    """Whether it is printed, and part of the documentation."""


@dataclass
class Outcome:
    """Results of an experiment."""

    settings: dict[str, Any] = field(default_factory=dict)
    """Settings of its runs, plain values."""
    pictures: dict[str, Any] = field(default_factory=dict)
    """Figures of Matplotlib, or images (H, W, 3), blue green red, by file name without ending."""
    tables: dict[str, Table] = field(default_factory=dict)
    """By file name without ending."""
    verdicts: list[Verdict] = field(default_factory=list)
    said: list[str] = field(default_factory=list)
    """Sentences that explain the pictures."""


@dataclass(frozen=True)
class Experiment:
    """A figure or table of a paper, or another claim of it."""

    name: str
    """Name on the command line, and of the files."""
    title: str
    """Its place in the paper, and what it shows."""
    takes: str
    """Time in full, on two cores, with all recordings at hand."""
    make: Callable[[Request], Outcome]
    runs: int = 1
    """Repetitions as in the paper."""
    short_runs: int = 1
    """Repetitions of the short version."""
