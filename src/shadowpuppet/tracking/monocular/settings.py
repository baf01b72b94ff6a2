"""Settings and presets of the one-camera tracker (Liu 2011)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field

from shadowpuppet.body.models import BodyName
from shadowpuppet.settings import NonNegative, Positive, Share, checked, from_preset


def pixel_scale(size: tuple[int, int]) -> float:
    """Factor that converts settings in pixels, given for 320 x 240, to another width and height."""
    return size[0] * size[1] / (320 * 240)


@checked
class PartSettings:
    """Sampling and weighting of one stage (a column of Liu 2011, Table I)."""

    particles: Annotated[int, Field(ge=2, le=1_000_000)] = 200
    """Number of particles, N."""
    survival: Share = 0.2
    """Share e of particles that survive deterministic resampling."""
    sigma_rotation: Positive = 0.1
    """Noise of angles, sigma_beta (rad)."""
    sigma_translation: Positive = 0.02
    """Noise of positions, sigma_beta (m)."""
    sigma_cost: Positive = 8000.0
    """sigma_gamma of eq. 6 (pixels at 320 x 240; scaled with the number of pixels)."""


@checked
class MonocularSettings:
    """Settings of the one-camera tracker (Liu 2011). The values here are the default preset; `PRESETS` has the paper's."""

    body: BodyName = "rounded"
    """The body's model: of the upper body (cardbox, cardbox_bends, boxes, rounded) or of the whole person."""
    resampling: Literal["deterministic", "stratified", "systematic", "multinomial", "residual"] = "deterministic"
    """DRS (Algorithm 4), SRS (Algorithm 3), or another scheme in SRS's place."""
    torso: PartSettings = PartSettings(particles=500)
    """The torso's stage."""
    arm: PartSettings = PartSettings(particles=500, survival=0.4, sigma_rotation=0.25, sigma_cost=4000.0)
    """Each arm's stage."""
    stages: Annotated[tuple[str, ...], Field(min_length=1)] = ("torso", "left_arm", "right_arm")
    """The filter's stages, in order; parts joined by + are estimated together ("torso+left_arm+right_arm" is a flat filter). Legs of a
    whole body that are not listed are added at the end."""
    cycles: Annotated[int, Field(ge=1, le=100)] = 1
    """Estimation cycles per frame. More cycles fit the silhouette better, but not the person; more particles in one cycle are better."""
    cooling: Annotated[float, Field(gt=0, le=1)] = 0.6
    """Factor of the noise from one cycle to the next."""
    explore: Annotated[int, Field(ge=0, le=100_000)] = 500
    """Candidates from a part's whole range, added to the particles in each frame's first cycle."""
    rank_by: Literal["last", "new", "best_new"] = "last"
    """Costs that rank and weigh the particles before resampling: those in the last picture; computed again in the new one, as eq. 8 prints,
    which doubles the evaluations; or again for the choice of the best only, as Algorithm 3 prints."""
    torso_arms: Literal["last", "hidden"] = "hidden"
    """How the torso's stage draws the arms: as last estimated, moving with the torso, or not at all."""
    estimate: Literal["best", "mean"] = "mean"
    """A cycle's estimate: the particle of least cost, or the weighted mean of all."""
    motion_weight: NonNegative = 200.0
    """Pull of shoulders, elbows and hands to their last positions (pixels per m^2, at 320 x 240). It determines what the picture does
    not show, above all an arm's depth."""
    motion_reach: Positive = 0.3
    """Distance (m) from which the pull no longer grows, so that a clear movement is followed."""
    posture_weight: NonNegative = 20.0
    """Pull to usual postures (pixels per squared deviation, at 320 x 240; see `Skeleton.posture_penalty`)."""
    limits: bool = True
    """Keep joint limits."""
    arm_colours: bool = True
    """Learn the colours of the person's hands, and of forearms if these are bare, and find arms before the trunk by them, where they are
    unlike those of the clothes."""
    recover: bool = True
    """Search for the person again after a loss or an absence. The papers' filters continue from their last particles."""
    motion_blur: bool = True
    """Whether a film may be found to be blurred by motion; what its silhouettes cover since this frame only then does not count."""
    turned: bool = True
    """Search for a person who is turned, and with a whole body sits, kneels or squats, where one who faces the camera fits badly."""
    patience: NonNegative = 1.0
    """Seconds after which a part of the silhouette that the body does not explain, such as a chair, is left out; 0: never."""
    both_ways: bool = True
    """Track a film backward, too, and take the likelier pass, where the run is smoothed and the body is an upper one. Takes the time of
    tracking once more, but not that of the silhouettes."""
    ignore_legs: bool = True
    """Leave the silhouette below the waist, where the model has no legs, out of the cost; no effect for a whole body."""


PRESETS: dict[str, dict] = {
    "default": {},
    "liu2011": {
        "body": "cardbox",
        "resampling": "deterministic",
        "torso": {"particles": 200, "survival": 0.2, "sigma_rotation": 0.1, "sigma_translation": 0.02, "sigma_cost": 8000.0},
        "arm": {"particles": 200, "survival": 0.4, "sigma_rotation": 0.25, "sigma_cost": 4000.0},
        "cycles": 1,
        "cooling": 1.0,
        "explore": 0,
        "torso_arms": "hidden",
        "estimate": "best",
        "motion_weight": 0.0,
        "posture_weight": 0.0,
        "arm_colours": False,
        "recover": False,
        "motion_blur": False,
        "turned": False,
        "patience": 0.0,
        "both_ways": False,
    },
}
PRESETS["liu2011_printed"] = PRESETS["liu2011"]
"""Named settings: "default", the best known, and "liu2011", the filter of Table I; values that a preset leaves out are the default's.
"liu2011_printed" differs in `INITIALIZATION_PRESETS`."""


def make_settings(preset: str = "default", overrides: Mapping[str, Any] | None = None, source: str = "settings") -> MonocularSettings:
    """A preset of the one-camera tracker with some values replaced, as `from_preset`."""
    return from_preset(MonocularSettings, PRESETS, preset, overrides, source)


@checked
class InitializationSettings:
    """Search of a person's sizes (Liu 2011, Algorithm 1). The paper draws with sigma = 0.05 throughout and has no prior."""

    hypotheses: Annotated[int, Field(ge=2, le=100_000)] = 200
    """Number of hypotheses per round, M."""
    sigma: Positive = 0.05
    """Noise of the sizes, sigma_alpha (m)."""
    share: Annotated[float, Field(gt=0, le=1)] = 0.4
    """Probability that a hypothesis changes a size; 1 in the paper."""
    shrink: Annotated[float, Field(gt=0, le=1)] = 0.9
    """Factor of the noise from one round to the next."""
    prior_weight: NonNegative = 15.0
    """Pull of the sizes to published proportions (pixels per squared deviation, at 320 x 240)."""
    posture_weight: NonNegative = 10.0
    """Pull to usual postures (pixels per squared deviation, at 320 x 240), if the postures are unknown."""
    tolerance: Share = 0.005
    """A subset is done when its cost has not improved by this share within `patience` rounds."""
    patience: Annotated[int, Field(ge=1)] = 15
    """Number of rounds without improvement after which a subset is done (see `tolerance`)."""
    rounds: Annotated[int, Field(ge=1)] = 40
    """Largest number of rounds for each subset."""
    sweeps: Annotated[int, Field(ge=1)] = 3
    """Number of passes through the three subsets. From the second on, the first subset's search varies the third's sizes, too."""
    memory: bool = True
    """Whether a round begins with the best hypothesis of all rounds; in the paper it is the best of the last round, better or worse."""
    place: bool = True
    """Whether the person's place is searched for with the sizes; the paper's is known."""
    accuracy: Share = 0.0
    """A subset is done when its cost is less than this share of the silhouette's area: the paper's end, to which it gives no value."""


INITIALIZATION_PRESETS: dict[str, dict] = {
    "default": {},
    "liu2011_printed": {"share": 1.0, "shrink": 1.0, "prior_weight": 0.0, "posture_weight": 0.0, "sweeps": 1, "memory": False,
                        "place": False, "accuracy": 0.1},
}
"""Named settings of the sizes' search, as `PRESETS`: "liu2011_printed" is Algorithm 1 as the paper prints it. It needs reference pictures:
without a prior of the sizes, other pictures do not determine them."""


def make_initialization(preset: str = "default", overrides: Mapping[str, Any] | None = None,
                        source: str = "settings") -> InitializationSettings:
    """A preset of the sizes' search with some values replaced, as `from_preset`."""
    return from_preset(InitializationSettings, INITIALIZATION_PRESETS, preset, overrides, source)
