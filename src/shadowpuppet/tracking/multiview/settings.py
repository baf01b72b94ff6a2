"""Settings and presets of the tracker of several cameras (Ni 2008)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field

from shadowpuppet.settings import NonNegative, Positive, Share, checked, from_preset


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
    """A preset of the tracker of several cameras with some values replaced, as `from_preset`."""
    return from_preset(MultiviewSettings, MULTIVIEW_PRESETS, preset, overrides, source)
