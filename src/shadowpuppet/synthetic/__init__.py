"""Made recordings with known truth: a person by published proportions, motions, cameras and noise as data."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from shadowpuppet.synthetic.collection import demo_spec, proving_ground
from shadowpuppet.synthetic.mannequin import Mannequin
from shadowpuppet.synthetic.spec import Gesture, Scene, Spec, Viewpoint, spec_from

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np

__all__ = ["Gesture", "Mannequin", "Scene", "Spec", "Viewpoint", "demo_spec", "proving_ground", "spec_from", "synthesize"]


def synthesize(spec: Spec, folder: str | Path, rng: np.random.Generator, tell: Callable[[int, int], None] | None = None) -> Path:
    """Write the recording that `spec` describes into `folder` (see `recording.synthesize`)."""
    from shadowpuppet.synthetic.recording import synthesize as write

    return write(spec, folder, rng, tell)
