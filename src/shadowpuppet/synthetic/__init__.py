"""Synthetic recordings with known truth: body, motions, cameras and noise are data."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from shadowpuppet.synthetic.collection import (
    around,
    demo_ring_spec,
    demo_spec,
    named_specs,
    proving_ground,
    proving_rings,
    resting,
)
from shadowpuppet.synthetic.faults.fault import Fault
from shadowpuppet.synthetic.furniture import Obstacle
from shadowpuppet.synthetic.movement.script import Gesture
from shadowpuppet.synthetic.person.mannequin import Mannequin
from shadowpuppet.synthetic.spec import Bystander, Scene, Spec, spec_from
from shadowpuppet.synthetic.spec_file import read_spec, spec_text
from shadowpuppet.synthetic.viewpoint import Ring, Viewpoint

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np

__all__ = ["Bystander", "Fault", "Gesture", "Mannequin", "Obstacle", "Ring", "Scene", "Spec", "Viewpoint", "around", "demo_ring_spec",
           "demo_spec", "named_specs", "proving_ground", "proving_rings", "read_spec", "resting", "spec_from", "spec_text",
           "synthesize"]


def synthesize(
    spec: Spec, folder: str | Path, rng: np.random.Generator | None = None, tell: Callable[[int, int], None] | None = None
) -> Path:
    """Write the recording that `spec` describes into `folder` (see `recording.synthesize`)."""
    from shadowpuppet.synthetic.recording import synthesize as write

    return write(spec, folder, rng, tell)
