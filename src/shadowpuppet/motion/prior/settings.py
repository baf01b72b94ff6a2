"""Settings of the motion prior (Ni 2008, IV)."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from shadowpuppet.settings import NonNegative, Positive, checked


@checked
class PriorSettings:
    """Settings for learning a motion prior (Ni 2008, IV). The values are the paper's, if it gives any."""

    regions: Annotated[int, Field(ge=1, le=10_000)] = 20
    """Number of regions of poses, M. More regions fit the training motion better and other motion worse; 10 to 20 suit most motions."""
    dimensions: Annotated[int, Field(ge=1)] = 3
    """Dimensions of each region's subspace, m."""
    starts: Annotated[int, Field(ge=1, le=1000)] = 4
    """Number of random starts; the regions that reconstruct best are kept. The paper starts once."""
    iterations: Annotated[int, Field(ge=1)] = 100
    """Largest number of rounds of learning, for the regions and for the transitions."""
    tolerance: NonNegative = 1e-4
    """Learning ends with a round that improves the error by less than this share, or the log likelihood per frame by less than this."""
    noise: Positive = 1e-3
    """Smallest variance in any direction, as a share of the training poses' mean variance: small regions have none in most directions."""
    leave: Annotated[float, Field(ge=0, lt=1)] = 0.01
    """Smallest share of the transitions from a region that is spread over all regions, so that the filter can leave any region."""
    dofs: Literal["articulation", "all"] = "articulation"
    """DOF that are learnt: all angles but the heading, so that the prior serves any place and direction; or all, as in the paper."""
    mirrored: bool = False
    """Learn from the mirror image of every motion too."""
