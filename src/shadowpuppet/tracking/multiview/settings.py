"""Settings and presets of the tracker for several cameras (Ni 2008)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Any, Literal

from pydantic import Field

from shadowpuppet.body.models import WholeBodyName
from shadowpuppet.settings import NonNegative, Positive, Share, checked, from_preset


@checked
class HullSettings:
    """How surface points are taken from the silhouettes of several cameras (Ni 2008, III). The paper gives no values."""

    rays: Annotated[int, Field(ge=1, le=1_000_000)] = 2000
    """Number of viewing rays, spread evenly along the contours of all cameras (at most one for two pixels' sides). It sets the number of
    points, whatever the pictures' size."""
    longest: Positive = 0.25
    """Viewing edges longer than this (m) are left out: few cameras see that place."""
    falloff: Positive = 0.1
    """A viewing edge this long (m) has half the weight of a short one."""
    pitch: Positive = 0.25
    """Points on a viewing edge are at most this far apart (m)."""
    tolerated: Annotated[int, Field(ge=0, le=100)] = 1
    """Number of cameras that may be overruled if at least three times as many others see the person, for example if one silhouette has a
    hole. Used only on rays that have no viewing edge otherwise; with several people, none of at most `longest`. 0: every camera carves."""


@checked
class SurfaceSettings:
    """Distance of surface points from a body (Ni 2008, eqs. 29-31). The paper gives no values."""

    epsilon: Annotated[float, Field(ge=0, lt=1)] = 0.0
    """Weight of the normals: a distance is multiplied by 1 - epsilon times the cosine of the angle between them."""
    tau: Positive = 0.05
    """Upper bound (m) of a point's distance."""
    nearest: Literal["euclidean", "modulated"] = "modulated"
    """How a point's nearest body part is chosen: by the plain distance, as in the paper, or by the one weighted by the normals."""


@checked
class GaussNewtonSettings:
    """Refinement by damped Gauss-Newton on distances to tangent planes."""

    coarse: Annotated[int, Field(ge=0, le=100)] = 4
    """Iterations on a share of the points."""
    fine: Annotated[int, Field(ge=0, le=100)] = 3
    """Iterations on all points, after that."""
    share: Annotated[int, Field(ge=1, le=100)] = 3
    """Coarse iterations use every `share`-th surface point."""
    coarse_tau: Positive = 0.06
    """Distance (m) at which a point's weight is a quarter, in the coarse iterations."""
    fine_tau: Positive = 0.04
    """Distance (m) at which a point's weight is a quarter, in the fine iterations."""
    emptiness: NonNegative = 2.0
    """Weight of the mean squared distance by which limbs reach out of the silhouettes, with fewer than six cameras. A quarter of it if all
    films have lost detail to compression."""
    damping: Positive = 0.03
    """Initial damping, as a share of each DOF's curvature."""
    pull: NonNegative = 1e-5
    """Weight of the pull to the last pose (m^2 per rad^2 or m^2), which determines what the points do not show."""


@checked
class ForceSettings:
    """Refinement by simulated force and moment (Ni 2008, eqs. 32-41)."""

    iterations: Annotated[int, Field(ge=0, le=1000)] = 80
    """Largest number of iterations: half of them with the coarse bound, the others with the fine one."""
    coarse_tau: Positive = 0.1
    """Upper bound (m) of a point's force, until the forces balance for the first time."""
    fine_tau: Positive = 0.03
    """Upper bound (m) of a point's force after that, until they balance again."""
    balance: NonNegative = 0.001
    """The forces balance when no degree of freedom moves by more than this (m or rad) in an iteration."""
    translation: Positive = 1.0
    """Gain of the root's translation; 1 moves it by the mean force (m)."""
    rotation: Positive = 0.5
    """Gain of the rotations; less than 1 because a joint and those below it turn at the same time."""
    modulated: bool = True
    """Whether forces are multiplied by the cosine between the normals, and zero where it is negative."""
    rho: Literal["none", "linear", "quadratic"] = "linear"
    """How the size of a force grows with the distance (rho of eq. 32): without bound, linearly up to the bound, or quadratically up to it,
    as in the paper."""
    hierarchical: bool = True
    """Whether a joint is turned by the moments on all parts below it, or only by those on its own parts."""


@checked
class MultiviewSettings:
    """Settings of the several-camera tracker (Ni 2008). The values here are the default preset; `MULTIVIEW_PRESETS` has the paper's."""

    body: WholeBodyName = "anatomical"
    """Body model."""
    method: Literal["hybrid", "image_force", "particle_filter"] = "hybrid"
    """Refined particles; one particle, refined from the last pose; or particles without refinement (Table II)."""
    refinement: Literal["gauss_newton", "forces"] = "gauss_newton"
    """How poses are refined."""
    particles: Annotated[int, Field(ge=1, le=1_000_000)] | None = None
    """Number of particles, N. Default: 16 with six cameras or more, 24 with five, 40 with fewer, which show less, and 80 with two."""
    resampling: Literal["stratified", "systematic", "multinomial", "residual"] = "systematic"
    """How particles are selected by their weights."""
    select_best: bool = True
    """Whether selection always takes the best particle and draws the others; the paper draws all."""
    defensive: Share = 0.5
    """Share of proposals that are the last poses with noise instead of the motion prior's, for motion that the prior does not contain."""
    region: Literal["nearest", "drawn"] = "nearest"
    """The region of the motion prior (state s) in which a particle lies: the one nearest to its refined pose, or the one that was drawn for
    it, as in the paper."""
    keep: Share = 0.5
    """Share of a pose's offset from the prior's subspace that a proposal keeps."""
    sigma_rotation: Positive = 0.15
    """Noise of angles in defensive proposals (rad)."""
    sigma_translation: Positive = 0.01
    """Noise of the root's position (m)."""
    sigma_heading: Positive = 0.05
    """Noise of the heading (rad)."""
    explore: Share = 0.3
    """Share of the defensive proposals in which an arm is replaced by one of another posture, so that a lost arm is found again."""
    local: Annotated[int, Field(ge=0, le=100)] = 4
    """Rounds of a local search after refinement: single joints of the best pose are turned at random, and what refinement made worse by
    the particles' cost is undone. 0: none."""
    velocity: Share | None = None
    """Share of the last frame's motion of position and heading that is added to proposals, once a frame. None: all of it where a frame
    lasts longer than 1/20 s, else nothing."""
    sigma_cost: Positive = 0.003
    """sigma of eq. 29 (m): a pose that costs sigma^2 more than the best weighs 1/e."""
    silhouettes: NonNegative = 0.1
    """Weight (m^2) of the share of pixels in which drawn body and silhouettes differ; added to the cost of the surface points. Half of it
    if all films have lost detail to compression."""
    posture: NonNegative = 2e-6
    """Weight of the pull to usual postures, or those of the training motion (m^2 per squared deviation). It determines what the surface
    does not show, for example how a bend divides between pelvis and chest."""
    arms: NonNegative = 1e-4
    """Weight (m^2) of how rare the posture of each arm is among people, in units of a log density. It chooses between places of an arm that
    silhouettes do not tell apart."""
    limbs: NonNegative = 1e-4
    """Weight (m^2) of how rare the posture of arms, legs and trunk together is among people, in units of a log density, bounded. It chooses
    between postures that few cameras do not tell apart."""
    arm_colours: NonNegative | None = None
    """Weight (m^2) of the share of the silhouettes' pixels that have the colours of this person's hands and bare forearms and that no arm
    covers. The colours are learnt from the film where they differ from the clothes'. 0: not looked for. Default: 0.1 with four cameras or
    fewer; more show arms well enough."""
    keypoints: NonNegative = 1e-4
    """Weight (m^2) of how surprising a detector's keypoints are, where there are any, in units of a log density as of `arms` and `limbs`.
    Refinement beside silhouettes weighs them by `sigma_cost`. 0: they are not used."""
    cycles: Annotated[int, Field(ge=1, le=100)] | None = None
    """Estimation cycles per frame (annealing). None: one for each 1/30 s that a frame lasts, at most four; one when live."""
    cooling: Annotated[float, Field(gt=0, le=1)] = 0.6
    """Factor of the noise from one cycle to the next."""
    estimate: Literal["best", "mean"] = "best"
    """The estimated pose: that of the particle of greatest weight, or the weighted mean."""
    patience: NonNegative = 1.0
    """Seconds after which parts of the silhouettes that the body does not explain, such as a chair, are left out; 0: never."""
    odd_camera: bool = True
    """Whether a camera whose silhouette suddenly contradicts all others (late, bumped, covered) is left out while it does."""
    recover: bool = True
    """Search for the person again after a loss, a jump or an absence. The paper's filter continues from its last particles."""
    surface: SurfaceSettings = SurfaceSettings()
    """How poses are weighted by surface points."""
    gauss_newton: GaussNewtonSettings = GaussNewtonSettings()
    """Refinement by Gauss-Newton."""
    forces: ForceSettings = ForceSettings()
    """Refinement by simulated forces."""
    hull: HullSettings = HullSettings()
    """How surface points are computed from the silhouettes."""


CYCLE_TIME, MOST_CYCLES = 1 / 30, 4
"""Time, s, for which one cycle suffices; most cycles. People who walk move by a head's width in a tenth of a second: noise that suffices
for 30 frames/s loses them. Proposals of frames that last longer than one cycle and a half take the last frame's motion along, too."""


def for_rate(settings: MultiviewSettings, rate: float) -> MultiviewSettings:
    """The settings with what they leave to the frame rate (frames/s)."""
    seconds = 1 / rate
    cycles = min(max(round(seconds / CYCLE_TIME), 1), MOST_CYCLES) if settings.cycles is None else settings.cycles
    velocity = float(seconds > 1.5 * CYCLE_TIME) if settings.velocity is None else settings.velocity
    return replace(settings, cycles=cycles, velocity=velocity)


SMEARED_EMPTINESS, SMEARED_SILHOUETTES = 0.25, 0.5
"""Weights `emptiness` and `silhouettes` where all films have lost detail, over those where none has. Silhouettes of such films lack hands,
forearms, now and then a leg; a body that must not reach out of them is pulled off the limbs that the other cameras show."""


def for_smeared(settings: MultiviewSettings, share: float) -> MultiviewSettings:
    """The settings for a rig in which a share of the films has lost detail to compression or focus."""
    if not share:
        return settings
    emptiness = settings.gauss_newton.emptiness * SMEARED_EMPTINESS**share
    return replace(settings, silhouettes=settings.silhouettes * SMEARED_SILHOUETTES**share,
                   gauss_newton=replace(settings.gauss_newton, emptiness=emptiness))


MULTIVIEW_PRESETS: dict[str, dict] = {
    "default": {},
    "ni2008": {
        "body": "cylinders",
        "refinement": "forces",
        "particles": 40,
        "resampling": "multinomial",
        "select_best": False,
        "defensive": 0.0,
        "region": "drawn",
        "keep": 0.0,
        "explore": 0.0,
        "local": 0,
        "velocity": 0.0,
        "cycles": 1,
        "silhouettes": 0.0,
        "posture": 0.0,
        "arms": 0.0,
        "limbs": 0.0,
        "arm_colours": 0.0,
        "keypoints": 0.0,
        "patience": 0.0,
        "odd_camera": False,
        "recover": False,
        "surface": {"epsilon": 0.3, "tau": 0.06, "nearest": "euclidean"},
        "forces": {"rho": "quadratic"},
    },
}
"""Named settings of the tracker for several cameras, as `PRESETS`."""


def make_multiview_settings(preset: str = "default", overrides: Mapping[str, Any] | None = None,
                            source: str = "settings") -> MultiviewSettings:
    """A preset of the tracker for several cameras with some values replaced, as `from_preset`."""
    return from_preset(MultiviewSettings, MULTIVIEW_PRESETS, preset, overrides, source)
