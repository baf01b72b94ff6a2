"""Limbs: tapered elliptic cylinders fixed to joints, to which points of a visual hull are compared (Ni 2008, II)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.geometry import Array


@dataclass(frozen=True, eq=False)
class Limbs:
    """Tapered elliptic cylinders, each fixed to a joint; their cross-sections lie across one axis of their own frame."""

    joints: NDArray[np.int64]
    """Joint that each is fixed to, of shape (S,)."""
    rotations: Array
    """Columns: a part's axes in its joint's frame, of shape (S, 3, 3); its z runs along the limb from start to end."""
    starts: Array
    """Middle of the first cross-section, joint's frame, of shape (S, 3), metres."""
    lengths: Array
    """Along the part's z, of shape (S,), metres."""
    shears: Array
    """How far along the part's x and y the last cross-section's middle lies off the first's, of shape (S, 2), metres."""
    radii: Array
    """Of the ellipses at start and end, along the part's x and y, of shape (S, 2, 2), metres."""
    caps: Array
    """Heights of the ellipsoidal domes over the start and the end, of shape (S, 2), metres; 0: flat."""
    parts: tuple[str, ...]
    """Name of each, S names."""

    @property
    def arrays(self) -> tuple[Array, ...]:
        """What depends on a person's sizes, and linearly so: starts, lengths, shears, radii, caps."""
        return self.starts, self.lengths, self.shears, self.radii, self.caps

    @property
    def ends(self) -> Array:
        """Middle of the last cross-section, joint's frame, of shape (S, 3), metres."""
        along = np.concatenate([self.shears, self.lengths[:, None]], 1)
        return self.starts + (self.rotations @ along[:, :, None])[..., 0]
