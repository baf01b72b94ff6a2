"""Settings of the motion prior (Ni 2008, IV)."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from shadowpuppet.settings import NonNegative, Positive, checked


@checked
class PriorSettings:
    """How a motion is learnt (Ni 2008, IV). The values here are the paper's where it has any."""

    regions: Annotated[int, Field(ge=1, le=10_000)] = 20
    """Regions of poses, M. More follow the motion more closely, and less of what differs from it; 10 to 20 suit most."""
    dimensions: Annotated[int, Field(ge=1)] = 3
    """Dimensions of each region's subspace, m."""
    starts: Annotated[int, Field(ge=1, le=1000)] = 4
    """How often regions are learnt, from other centres each time; those that reconstruct best are kept. The paper learns once."""
    iterations: Annotated[int, Field(ge=1)] = 100
    """Rounds at most, of the regions and of the transitions."""
    tolerance: NonNegative = 1e-4
    """A round that gains less than this share of the error, or than this log likelihood a frame, is the last."""
    noise: Positive = 1e-3
    """Least variance in any direction, as a share of the training poses' mean variance: a region of few frames has none in most."""
    leave: Annotated[float, Field(ge=0, lt=1)] = 0.01
    """Share of the transitions from each region that goes to all alike, at least, so that the filter is never caught in one."""
    dofs: Literal["articulation", "all"] = "articulation"
    """What is learnt of a body's poses: all angles but the heading, so that it serves any place and direction; or all, as in the paper."""
    mirrored: bool = False
    """Learn from every motion's mirror image, too."""
