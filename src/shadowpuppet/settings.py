"""Settings of the trackers, each documented here and nowhere else; the presets are data.

Every field is a flag of the command line and a line of TOML; unknown names are errors.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import ConfigDict, Field
from pydantic.dataclasses import dataclass

STRICT = ConfigDict(extra="forbid")
Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]
Share = Annotated[float, Field(ge=0, le=1)]


@dataclass(frozen=True, config=STRICT, kw_only=True)
class PartSettings:
    """How one stage of the filter draws and weighs (a column of Liu 2011, Table I)."""

    particles: Annotated[int, Field(ge=2, le=1_000_000)] = 200
    """Particles, N."""
    survival: Share = 0.2
    """Share e of particles that live on in deterministic resampling."""
    sigma_rotation: Positive = 0.1
    """Noise of angles, sigma_beta (rad)."""
    sigma_translation: Positive = 0.02
    """Noise of positions, sigma_beta (m)."""
    sigma_cost: Positive = 8000.0
    """sigma_gamma of eq. 6 (pixels at 320 x 240; scaled with the number of pixels)."""


@dataclass(frozen=True, config=STRICT, kw_only=True)
class MonocularSettings:
    """The one-camera tracker (Liu 2011). The values here are the default preset; `PRESETS` has the paper's."""

    body: Literal["cardbox", "boxes"] = "cardbox"
    """The body's model."""
    resampling: Literal["deterministic", "stratified", "systematic", "multinomial", "residual"] = "deterministic"
    """DRS (Algorithm 4), SRS (Algorithm 3), or another scheme in SRS's place."""
    torso: PartSettings = PartSettings()
    """The torso's stage."""
    arm: PartSettings = PartSettings(survival=0.4, sigma_rotation=0.25, sigma_cost=4000.0)
    """Each arm's stage."""
    stages: tuple[str, ...] = ("torso", "left_arm", "right_arm")
    """The filter's stages, in order; parts joined by + are moved at once ("torso+left_arm+right_arm" is a flat filter)."""
    cycles: Annotated[int, Field(ge=1, le=100)] = 1
    """Estimation cycles a frame."""
    cooling: Annotated[float, Field(gt=0, le=1)] = 1.0
    """The noise of each cycle is that of the last times this."""
    rank_by: Literal["last", "new"] = "last"
    """Costs that rank and weigh before resampling: as known from the last picture, or measured again in the new one (eq. 8 as it is
    printed), which doubles the evaluations."""
    limits: bool = True
    """Whether joint limits are kept."""
    torso_arms: Literal["last", "hidden"] = "last"
    """How the torso's stage draws the arms: as last estimated, carried along, or not at all."""
    estimate: Literal["best", "mean"] = "best"
    """A cycle's estimate: the particle of least cost, or the weighted mean of all."""
    depth_weight: NonNegative = 0.0
    """Pull of elbows and hands toward `depth_keep` times their last depth offset from the shoulder (pixels per m^2)."""
    depth_keep: Share = 0.9
    """See `depth_weight`."""
    explore: Annotated[int, Field(ge=0, le=100_000)] = 0
    """Poses from all over an arm's range that are tried beside the particles, in each frame's first cycle."""
    motion_weight: NonNegative = 0.0
    """Pull of elbows and hands to where they were (pixels per m^2)."""
    posture_weight: NonNegative = 0.0
    """Pull of the posture to rest (pixels per squared deviation)."""
    flat_noise: Positive = 0.5
    """x"""
    miss: Positive = 1.0
    """x"""
    jump: NonNegative = 0.0
    """x"""
    reach: NonNegative = 0.2
    """x"""
    temperature: Positive = 20.0
    """mean"""
    ignore_legs: bool = True
    """Leave out of the cost what lies below the waist, where the model has no legs."""


PRESETS: dict[str, dict] = {
    "default": {},
    "liu2011": {
        "torso": {"particles": 200, "survival": 0.2, "sigma_rotation": 0.1, "sigma_translation": 0.02, "sigma_cost": 8000.0},
        "arm": {"particles": 200, "survival": 0.4, "sigma_rotation": 0.25, "sigma_cost": 4000.0},
        "cycles": 1,
        "cooling": 1.0,
        "estimate": "best",
        "depth_weight": 0.0,
    },
}
"""Named settings; what a preset leaves out is the default's."""


@dataclass(frozen=True, config=STRICT, kw_only=True)
class InitializationSettings:
    """How a person's sizes are found (Liu 2011, Algorithm 1). The paper draws with sigma = 0.05 throughout and knows no prior."""

    hypotheses: Annotated[int, Field(ge=2, le=100_000)] = 200
    """Hypotheses a round, M."""
    sigma: Positive = 0.05
    """Noise of the sizes, sigma_alpha (m)."""
    share: Annotated[float, Field(gt=0, le=1)] = 0.4
    """Chance of each size to be drawn anew in a hypothesis; in the paper all are, always."""
    shrink: Annotated[float, Field(gt=0, le=1)] = 0.9
    """The noise of each round is that of the last times this."""
    prior_weight: NonNegative = 15.0
    """Pull of the sizes to published proportions (pixels per squared deviation, at 320 x 240)."""
    tolerance: Share = 0.005
    """A subset is done when its cost has not improved by this share within `patience` rounds."""
    patience: Annotated[int, Field(ge=1)] = 15
    """See `tolerance`."""
    rounds: Annotated[int, Field(ge=1)] = 40
    """Rounds at most, for each subset."""
    sweeps: Annotated[int, Field(ge=1)] = 3
    """How often the three subsets are gone through."""
