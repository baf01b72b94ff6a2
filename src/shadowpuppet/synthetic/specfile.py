"""Specs as TOML files, with the seed that made a recording."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from shadowpuppet.errors import SettingsError
from shadowpuppet.synthetic.spec import Spec, spec_from, spec_values

SPEC_FILE = "spec.toml"
"""What a made recording was made of; it is there from the beginning."""
HEAD = "# What this recording was made of; the same again: shadowpuppet synthesize spec.toml -o FOLDER\n"
UNSEEDED = "# The generator that was given had no seed that could be kept: the seed below gives other chance.\n"


def read_spec(path: str | Path) -> Spec:
    """The spec in a TOML file. Raises `SettingsError`: one sentence with file and field."""
    from shadowpuppet.io.calibration import read_toml

    return spec_from(read_toml(path, SettingsError), str(path))


def spec_text(spec: Spec) -> str:
    """A spec as TOML that `read_spec` reads back: every setting."""
    import tomli_w

    text = tomli_w.dumps(spec_values(spec))
    return re.sub(r"\[\n((?: {4}[^\s{}\[\]]+,\n)+)\]", lambda found: f"[{', '.join(found[1].replace(',', '').split())}]", text)


def write_spec(path: Path, spec: Spec, seed: int | tuple[int, ...] | None) -> None:
    """Write a spec with the seed that it was made with. Raises `ShadowPuppetError` where it cannot be written."""
    from shadowpuppet.io._files import write_whole

    known = spec if seed is None else replace(spec, seed=seed)
    write_whole(path, HEAD + ("" if seed is not None else UNSEEDED) + spec_text(known))


def seed_of(rng: np.random.Generator) -> int | tuple[int, ...] | None:
    """The seed of a generator of `numpy.random.default_rng(seed)` that has spawned nothing yet; None where there is none."""
    source = rng.bit_generator.seed_seq
    if not isinstance(source, np.random.SeedSequence) or source.spawn_key or source.n_children_spawned or source.entropy is None:
        return None
    return int(source.entropy) if isinstance(source.entropy, (int, np.integer)) else tuple(int(n) for n in source.entropy)
