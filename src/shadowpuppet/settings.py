"""Settings of the trackers, each documented here and nowhere else; the presets are data.

Every field is a flag of the command line and a line of TOML; unknown names are errors.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from functools import wraps
from typing import Annotated, Any, Literal, TypeVar, dataclass_transform

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass

from shadowpuppet.errors import SettingsError, choices, shown

Settings = TypeVar("Settings")
STRICT = ConfigDict(extra="forbid", allow_inf_nan=False)


@dataclass_transform(kw_only_default=True, frozen_default=True)
def checked(kind: type[Settings]) -> type[Settings]:
    """Make a frozen dataclass of a class of settings: every value is checked whichever way it comes.

    `Kind(name=value)` raises `SettingsError` for an unknown name or an impossible value, as `validate` does.
    """
    made: Any = dataclass(frozen=True, kw_only=True, config=STRICT)(kind)
    check = made.__init__

    @wraps(check)
    def __init__(self: Any, *args: Any, **values: Any) -> None:
        try:
            check(self, *args, **values)
        except ValidationError as error:
            raise _told(error, made, made.__name__) from None

    made.__init__ = __init__
    return made


Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]
Share = Annotated[float, Field(ge=0, le=1)]


def pixel_scale(size: tuple[int, int]) -> float:
    """What settings in pixels, which are for 320 x 240, are multiplied by for pictures of another width and height."""
    return size[0] * size[1] / (320 * 240)


@checked
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


@checked
class MonocularSettings:
    """The one-camera tracker (Liu 2011). The values here are the default preset; `PRESETS` has the paper's."""

    body: Literal["cardbox", "boxes", "rounded", "anatomical", "cylinders"] = "rounded"
    """The body's model: of the upper body (the first three), or of the whole person, legs and all."""
    resampling: Literal["deterministic", "stratified", "systematic", "multinomial", "residual"] = "deterministic"
    """DRS (Algorithm 4), SRS (Algorithm 3), or another scheme in SRS's place."""
    torso: PartSettings = PartSettings(particles=500)
    """The torso's stage."""
    arm: PartSettings = PartSettings(particles=500, survival=0.4, sigma_rotation=0.25, sigma_cost=4000.0)
    """Each arm's stage."""
    stages: Annotated[tuple[str, ...], Field(min_length=1)] = ("torso", "left_arm", "right_arm")
    """The filter's stages, in order; parts joined by + are moved at once ("torso+left_arm+right_arm" is a flat filter). Legs of a whole
    body that no stage names follow."""
    cycles: Annotated[int, Field(ge=1, le=100)] = 1
    """Estimation cycles a frame. More of them fit the silhouette closer, but not the person: many particles in one cycle do better."""
    cooling: Annotated[float, Field(gt=0, le=1)] = 0.6
    """The noise of each cycle is that of the last times this."""
    explore: Annotated[int, Field(ge=0, le=100_000)] = 500
    """Poses from all over a part's range that are tried beside the particles, in each frame's first cycle."""
    rank_by: Literal["last", "new"] = "last"
    """Costs that rank and weigh before resampling: as known from the last picture, or measured again in the new one (eq. 8 as it is
    printed), which doubles the evaluations."""
    torso_arms: Literal["last", "hidden"] = "hidden"
    """How the torso's stage draws the arms: as last estimated, carried along, or not at all."""
    estimate: Literal["best", "mean"] = "mean"
    """A cycle's estimate: the particle of least cost, or the weighted mean of all."""
    motion_weight: NonNegative = 200.0
    """Pull of shoulders, elbows and hands to where they were (pixels per m^2, at 320 x 240). Holds what the picture does not show,
    above all an arm's depth."""
    motion_reach: Positive = 0.3
    """From about this distance on (m) the pull grows no more: what plainly moved farther is found there."""
    posture_weight: NonNegative = 20.0
    """Pull to usual postures (pixels per squared deviation, at 320 x 240; see `Skeleton.strain`)."""
    limits: bool = True
    """Whether joint limits are kept."""
    recover: bool = True
    """Search afresh for who was lost, or comes back. The papers' filters go on from where they are."""
    ignore_legs: bool = True
    """Leave out of the cost what is seen below the waist, where the model has no legs; of no use for a whole body."""


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
    },
}
"""Named settings: "default", the best we know, and "liu2011", Table I's filter; what a preset leaves out is the default's."""


def make_settings(preset: str = "default", overrides: Mapping[str, Any] | None = None, source: str = "settings") -> MonocularSettings:
    """A preset with some values replaced; tables (`torso`, `arm`) may be given in part.

    Raises `SettingsError` for an unknown preset, an unknown name or an impossible value, with what is possible.
    """
    if preset not in PRESETS:
        raise SettingsError(f"{source}: unknown preset {preset!r}; there are: {choices(PRESETS)}")
    return validate(MonocularSettings, _merge(_plain(MonocularSettings()), PRESETS[preset], overrides or {}), source)


def validate(kind: type[Settings], values: Mapping[str, Any], source: str = "settings") -> Settings:
    """Settings of a kind from plain values; a `SettingsError` names the first bad one, what was found and what is possible."""
    try:
        return TypeAdapter(kind).validate_python(dict(values))
    except ValidationError as error:
        raise _told(error, kind, source) from None


def _told(error: ValidationError, kind: Any, source: str) -> SettingsError:
    """The first of the mistakes in settings of a kind, in a sentence."""
    first = error.errors()[0]
    place = ".".join(str(key) for key in first["loc"])
    if first["type"] in ("unexpected_keyword_argument", "extra_forbidden"):
        for key in first["loc"][:-1]:
            kind = type(getattr(kind(), str(key)))
        return SettingsError(f"{source}: unknown setting {place!r}; there are: {choices(f.name for f in fields(kind))}")
    said = first["msg"].removeprefix("Value error, ")
    return SettingsError(f"{source}: {place}: found {shown(first['input'])}; {said[:1].lower()}{said[1:]}")


def _plain(settings: Any) -> dict[str, Any]:
    return {f.name: _plain(value) if is_dataclass(value := getattr(settings, f.name)) else value for f in fields(settings)}


def _merge(*tables: Mapping[str, Any]) -> dict[str, Any]:
    """Tables laid over one another, the last on top, inner tables too."""
    out: dict[str, Any] = {}
    for table in tables:
        for key, value in table.items():
            out[key] = _merge(out[key], value) if isinstance(value, Mapping) and isinstance(out.get(key), Mapping) else value
    return out


@checked
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
    posture_weight: NonNegative = 10.0
    """Pull to usual postures (pixels per squared deviation, at 320 x 240), where the postures are not known."""
    tolerance: Share = 0.005
    """A subset is done when its cost has not improved by this share within `patience` rounds."""
    patience: Annotated[int, Field(ge=1)] = 15
    """See `tolerance`."""
    rounds: Annotated[int, Field(ge=1)] = 40
    """Rounds at most, for each subset."""
    sweeps: Annotated[int, Field(ge=1)] = 3
    """How often the three subsets are gone through."""


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


@checked
class HullSettings:
    """How surface points are taken from the silhouettes of several cameras (Ni 2008, III). The paper gives no values."""

    rays: Annotated[int, Field(ge=1, le=1_000_000)] = 2000
    """Viewing rays, spread evenly along the contours of all cameras (at most one for two pixels' sides): points are about as many however
    large the pictures are."""
    longest: Positive = 0.25
    """Viewing edges longer than this (m) are left out: few cameras look there."""
    falloff: Positive = 0.1
    """A viewing edge this long (m) has half the weight of a short one."""
    pitch: Positive = 0.25
    """Points on a viewing edge are at most this far apart (m)."""
    tolerated: Annotated[int, Field(ge=0, le=100)] = 1
    """So many cameras may say empty where at least three times as many others see the person, as one does whose silhouette has a hole;
    asked only along rays on which nothing is left otherwise. With 0, each camera carves."""


@checked
class SurfaceSettings:
    """How far surface points are from a body (Ni 2008, eqs. 29-31). The paper gives no values."""

    epsilon: Annotated[float, Field(ge=0, lt=1)] = 0.0
    """How much less a distance counts where the normals agree: by the factor 1 - epsilon cos."""
    tau: Positive = 0.05
    """Distance (m) beyond which a point counts no more."""


@checked
class GaussNewtonSettings:
    """Refinement by damped Gauss-Newton on the distances to tangent planes."""

    coarse: Annotated[int, Field(ge=0, le=100)] = 4
    """Iterations on some of the points."""
    fine: Annotated[int, Field(ge=0, le=100)] = 3
    """Iterations on all of them, after that."""
    share: Annotated[int, Field(ge=1, le=100)] = 3
    """Every so many-th point is one of the some."""
    coarse_tau: Positive = 0.06
    """Distance (m) at which a point counts a quarter, in the coarse iterations."""
    fine_tau: Positive = 0.04
    """The same in the fine ones."""
    emptiness: NonNegative = 2.0
    """Weight of the mean squared distance by which limbs reach out of the silhouettes, with fewer than six cameras."""
    damping: Positive = 0.03
    """Share of its own curvature by which each DOF is held back at first."""
    pull: NonNegative = 1e-5
    """Pull to the last pose (m^2 of mean square distance for each rad^2 or m^2): it decides what the points do not tell."""


@checked
class ForceSettings:
    """Refinement by simulated force and moment (Ni 2008, eqs. 32-41)."""

    iterations: Annotated[int, Field(ge=0, le=1000)] = 20
    """Iterations."""
    translation: Positive = 1.0
    """Weight of the forces on the root, as a share of what their mean distance would take."""
    rotation: Positive = 0.5
    """Weight of the moments, likewise: limbs and what they hang on move at once."""
    modulated: bool = True
    """Whether a force goes by how well the normals agree, and is none where they disagree."""
    robust: bool = True
    """Whether a force is bounded."""
    hierarchical: bool = True
    """Whether a joint feels all that hangs on it, or only its own part."""


@checked
class MultiviewSettings:
    """The tracker of several cameras (Ni 2008). The values here are the default preset; `MULTIVIEW_PRESETS` has the paper's."""

    body: Literal["anatomical", "cylinders"] = "anatomical"
    """The body's model."""
    method: Literal["hybrid", "image_force", "particle_filter"] = "hybrid"
    """Particles that are refined, one that is refined from the last pose, or particles alone (Table II)."""
    refinement: Literal["gauss_newton", "forces"] = "gauss_newton"
    """How poses are refined."""
    particles: Annotated[int, Field(ge=1, le=1_000_000)] | None = None
    """Particles, N. Left out: 16 with six cameras or more, 40 with fewer, which see less and are drawn sooner."""
    resampling: Literal["stratified", "systematic", "multinomial", "residual"] = "systematic"
    """How particles are selected by their weights."""
    defensive: Share = 0.5
    """Share of proposals that are the last poses with noise, beside those of the motion prior: what that does not know is found by them."""
    keep: Share = 0.5
    """Share of what the prior's subspace cannot hold that a proposal keeps."""
    sigma_rotation: Positive = 0.15
    """Noise of angles in defensive proposals (rad)."""
    sigma_translation: Positive = 0.01
    """Noise of the place (m)."""
    sigma_heading: Positive = 0.05
    """Noise of the heading (rad)."""
    explore: Share = 0.3
    """Share of the defensive proposals in which an arm is tried in a usual posture: an arm that was lost is found again."""
    velocity: Share = 0.0
    """Share of the last frame's motion of place and heading with which proposals move on."""
    sigma_cost: Positive = 0.003
    """A pose worse than the best by its square (m^2) weighs 1/e (eq. 29)."""
    silhouettes: NonNegative = 0.1
    """Weight of the share of pixels in which drawn body and silhouettes differ (m^2), beside the distance of the surface points."""
    posture: NonNegative = 2e-6
    """Pull to usual postures, those of the training motion where there is any (m^2 for each squared deviation): it decides what the
    surface does not show, such as how pelvis and chest share a bend."""
    cycles: Annotated[int, Field(ge=1, le=100)] = 1
    """Estimation cycles a frame, each with `cooling` times the noise of the last (annealing)."""
    cooling: Annotated[float, Field(gt=0, le=1)] = 0.6
    """See `cycles`."""
    estimate: Literal["best", "mean"] = "best"
    """The particle of greatest weight, or the weighted mean."""
    recover: bool = True
    """Search afresh for who was lost, jumps, or comes back. The paper's filter goes on from where it is."""
    surface: SurfaceSettings = SurfaceSettings()
    """How poses are weighed by surface points."""
    gauss_newton: GaussNewtonSettings = GaussNewtonSettings()
    """Refinement by Gauss-Newton."""
    forces: ForceSettings = ForceSettings()
    """Refinement by simulated forces."""
    hull: HullSettings = HullSettings()
    """How surface points are found."""


MULTIVIEW_PRESETS: dict[str, dict] = {
    "default": {},
    "ni2008": {
        "body": "cylinders",
        "refinement": "forces",
        "particles": 40,
        "defensive": 0.0,
        "keep": 0.0,
        "explore": 0.0,
        "velocity": 1.0,
        "silhouettes": 0.0,
        "posture": 0.0,
        "surface": {"epsilon": 0.3, "tau": 0.06},
    },
}
"""Named settings of the tracker of several cameras, as `PRESETS`."""


def make_multiview_settings(preset: str = "default", overrides: Mapping[str, Any] | None = None,
                            source: str = "settings") -> MultiviewSettings:
    """A preset of `MULTIVIEW_PRESETS` with some values replaced, as `make_settings`."""
    if preset not in MULTIVIEW_PRESETS:
        raise SettingsError(f"{source}: unknown preset {preset!r}; there are: {choices(MULTIVIEW_PRESETS)}")
    return validate(MultiviewSettings, _merge(_plain(MultiviewSettings()), MULTIVIEW_PRESETS[preset], overrides or {}), source)
