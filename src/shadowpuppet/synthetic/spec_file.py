"""Read and write specs as TOML files."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from shadowpuppet.errors import SettingsError
from shadowpuppet.synthetic.spec import Spec, spec_from, spec_values

SPEC_FILE = "spec.toml"
"""The spec in a recording's folder; written first."""
SPEC_HEADER = "# What this recording was made of; the same again: shadowpuppet synthesize spec.toml -o FOLDER\n"
UNSEEDED_HEADER = "# The generator that was given had no seed that could be kept: the seed below gives other chance.\n"


def read_spec(path: str | Path) -> Spec:
    """The spec in a TOML file; files that it names are relative to it. Raises `SettingsError`: one sentence with file and field."""
    from shadowpuppet.io.files.text import read_toml

    values = read_toml(path, SettingsError)
    for gesture in _gestures(values):
        if isinstance(gesture.get("file"), str):
            gesture["file"] = str(Path(path).parent / gesture["file"])
    return spec_from(values, str(path))


def _gestures(values: dict[str, Any]) -> list[dict[str, Any]]:
    """The tables of gestures in a spec's plain values, also those of bystanders; other types are left to the validation."""
    scene = values.get("scene")
    others = scene.get("bystanders") if isinstance(scene, dict) else None
    theirs = [one.get("motion") for one in others if isinstance(one, dict)] if isinstance(others, list) else None
    listed = [values.get("motion"), values.get("training"), theirs]
    return [gesture for some in listed if isinstance(some, list) for gesture in some if isinstance(gesture, dict)]


def spec_text(spec: Spec) -> str:
    """A spec as TOML, with every setting; the inverse of `read_spec`."""
    return _text(spec_values(spec))


def _text(values: dict[str, Any]) -> str:
    import tomli_w

    text = tomli_w.dumps(values)
    return re.sub(r"\[\n((?: {4}[^\s{}\[\]]+,\n)+)\]", lambda found: f"[{', '.join(found[1].replace(',', '').split())}]", text)


def write_spec(path: Path, spec: Spec, seed: int | tuple[int, ...] | None) -> None:
    """Write a spec with the seed of its recording. Raises `ShadowPuppetError` if it cannot be written."""
    from shadowpuppet.io.files.text import write_whole

    known = spec if seed is None else replace(spec, seed=seed)
    values = spec_values(known)
    for gesture in _gestures(values):
        if "file" in gesture:
            gesture["file"] = str(Path(gesture["file"]).resolve())
    write_whole(path, SPEC_HEADER + ("" if seed is not None else UNSEEDED_HEADER) + _text(values))


def seed_of(rng: np.random.Generator) -> int | tuple[int, ...] | None:
    """The seed of a generator made by `numpy.random.default_rng(seed)` that has not spawned yet; None if there is none."""
    source = rng.bit_generator.seed_seq
    if not isinstance(source, np.random.SeedSequence) or source.spawn_key or source.n_children_spawned or source.entropy is None:
        return None
    return int(source.entropy) if isinstance(source.entropy, (int, np.integer)) else tuple(int(n) for n in source.entropy)
