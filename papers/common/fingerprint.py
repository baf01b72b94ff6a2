"""Fingerprints of what an experiment's results depend on: the film, and a short run of the methods.

A page of results carries them, and a test compares them with today's. Source text does not count: it changes without changing results.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from shadowpuppet.io.files.text import read_text
from shadowpuppet.synthetic import Spec, spec_text

Fingerprint = dict[str, list[float]]
"""Sums by the name of what they are of."""
TOLERANCE = 1e-3
"""Greatest relative difference of sums that are taken for the same: processors differ in the last digits."""
WARNING = "These results are older than today's code"
"""Words of a page whose results are not made again yet."""
FRAMES = 20
"""Number of frames of the short runs."""


def sums(*values: Any) -> list[float]:
    """Three sums of all values with random weights, to six digits."""
    row = np.nan_to_num(np.concatenate([np.ravel(value).astype(float) for value in values]))
    found = np.random.default_rng(7).normal(size=(3, len(row))) @ row / np.sqrt(max(len(row), 1))
    return [float(f"{value:.6g}") for value in found]


def sums_of_spec(spec: Spec) -> list[float]:
    """A number of a recording's spec, whose own numbers count to six digits."""
    text = re.sub(r"\d+\.\d+", lambda number: f"{float(number[0]):.6g}", spec_text(spec))
    return [float(int(hashlib.sha256(text.encode()).hexdigest()[:8], 16))]


def comment(paper: str, found: Mapping[str, list[float]]) -> str:
    """The line of a page that holds a paper's fingerprint."""
    return f"<!-- fingerprint of {paper}: {json.dumps(dict(found))} -->"


def of_page(path: Path, paper: str) -> Fingerprint | None:
    """The fingerprint in a page; None if it has none."""
    held = re.search(rf"<!-- fingerprint of {paper}: (.*?) -->", read_text(path))
    return json.loads(held[1]) if held else None


def stale(page: Path, paper: str, today: Mapping[str, list[float]]) -> str:
    """Why a paper's results in a page are not those of today's code, and what makes them again; empty if they are, or if the page warns its
    readers and so claims nothing."""
    held = of_page(page, paper)
    if held is None:
        return "" if WARNING in read_text(page) else f"{page.name}: the results of {paper} have no fingerprint, and no warning '{WARNING}'"
    other = differences(held, today)
    if not other:
        return ""
    return (f"{page.name}: the results of {paper} are of other films or programs ({', '.join(other)}); make them again: python -m "
            f"papers.{paper} all -o FOLDER, python -m papers.common.reproduction FOLDER; or remove the fingerprint, and warn: '{WARNING}'")


def differences(held: Mapping[str, list[float]], today: Mapping[str, list[float]]) -> list[str]:
    """Names of what is not the same in both."""
    return [name for name in dict.fromkeys([*held, *today])
            if name not in held or name not in today or len(held[name]) != len(today[name])
            or not np.allclose(held[name], today[name], rtol=TOLERANCE, atol=TOLERANCE)]  # fmt: skip
