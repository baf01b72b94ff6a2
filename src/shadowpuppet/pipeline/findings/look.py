"""Result types of examining a recording before the run: plain values for look.json, and the silhouettes that the run uses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

from shadowpuppet.body.models import BodyName
from shadowpuppet.calibration.agreement import Agreement
from shadowpuppet.camera.keypoints import Keypoints
from shadowpuppet.camera.mask import Mask, Seen
from shadowpuppet.errors import Finding
from shadowpuppet.pipeline.findings.keypoints import KeypointsLook
from shadowpuppet.pipeline.footage import Sample
from shadowpuppet.pipeline.rig import Rig
from shadowpuppet.pipeline.silhouettes import Silhouettes
from shadowpuppet.silhouette.correction.condition import FilmCondition
from shadowpuppet.silhouette.quality import MaskQuality

if TYPE_CHECKING:
    from shadowpuppet.pipeline.people.census import Census  # whose kernels the command line does not need


@dataclass(frozen=True, kw_only=True)
class FilmLook:
    """What one film shows; plain values."""

    size: tuple[int, int]
    """Width and height of the film, pixels."""
    worked_size: tuple[int, int]
    """Width and height that frames are scaled to."""
    fov: float
    """Horizontal field of view, degrees."""
    frames: int | None
    """Number of frames from the recording's time 0 on; None if the film does not state it."""
    rate: float
    """Frames/s."""
    background: str
    """Where the silhouettes come from."""
    key: str
    """Which channels are compared with the background, and why."""
    exact_overlap: float | None
    """Overlap (intersection over union) with the recording's ready silhouettes; None without these."""
    quality: MaskQuality
    """Quality of the silhouettes in the sampled frames."""
    added: str | None = None
    """What was added to the empty scene and is left out of the silhouettes, in words and the film's pixels; None for nothing."""
    condition: FilmCondition | None = None
    """Noise, light and movement of the film in the sampled frames; None for ready silhouettes."""


@dataclass(frozen=True, kw_only=True)
class CameraLook(FilmLook):
    """Findings about one of several cameras; plain values."""

    name: str
    place: tuple[float, float, float]
    """Its place in the world, metres."""
    start: float
    """The recording's time 0 on the film's own clock, seconds."""


@dataclass(frozen=True, kw_only=True)
class RecordingLook:
    """What a look at a recording says, with one camera or several; plain values, so that it can be saved."""

    recording: str
    """Its path."""
    rate: float
    """Frames, or frame sets of several cameras, a second."""
    frames: int | None
    """Number of frames or frame sets; None if the films do not state it."""
    person: dict[str, object] | None = None
    """Sizes (m) and how they were found; with one camera also place (m) and overlaps of the fitted body, and the silhouettes it was fitted
    to if these are not the tracked ones. None if the person was not measured."""
    findings: tuple[Finding, ...] = ()
    """Possible problems of the run, with their remedies."""
    refusal: str | None = None
    """Why tracking is hopeless; None if it is not."""
    keypoints: KeypointsLook | None = None
    """What detectors found in the films, if it was looked at and there is any."""

    @property
    def doubts(self) -> tuple[str, ...]:
        """The findings, a sentence each."""
        return tuple(each.words for each in self.findings)


@dataclass(frozen=True, kw_only=True)
class Look(RecordingLook, FilmLook):
    """Findings about a recording of one camera."""

    camera: str
    """The camera's name."""
    calibrated: bool
    """Whether the camera's place is known."""
    lens_calibrated: bool
    """Whether more of the lens is known than its field of view."""
    looked_at: int
    """Number of frames that were read for this look."""
    jitter: float
    """Standard deviation of the frames' interval, seconds."""
    scale: str
    """Known lengths that fix the scale, in words."""
    area: float
    """Mean share of the image that is silhouette."""
    plain_area: float | None
    """The same with the plain rule of eq. 1; None if the background has no standard deviation."""
    exact_overlap_plain: float | None
    """As `exact_overlap`, with the plain rule of eq. 1."""
    body: BodyName = "rounded"
    """The body that the film asks for."""


@dataclass(frozen=True, kw_only=True)
class RigLook(RecordingLook):
    """Findings about a recording of several cameras."""

    cameras: tuple[CameraLook, ...]
    agreement: Agreement
    """Agreement of the cameras, from the silhouettes of the first seconds."""


class FilmSurvey(NamedTuple):
    """Result of examining one camera's film: its sample, silhouettes and findings."""

    sample: Sample
    silhouettes: Silhouettes
    runs: list[list[Mask]]
    """Silhouettes of the sample's runs."""
    exact: list[Mask]
    """The recording's ready silhouettes of the same frames; empty if there are none, or if `silhouettes` are these."""
    look: FilmLook

    @property
    def masks(self) -> list[Mask]:
        """Silhouettes of the sample's frames."""
        return [mask for run in self.runs for mask in run]


class FirstSeconds(NamedTuple):
    """Silhouettes from the recording's beginning, to which the person's sizes are fitted."""

    times: list[float]
    """F times, seconds."""
    masks: Sequence[tuple[Mask | None, ...]]
    """For each time a mask (H, W) per camera; None for a camera without a frame. With several cameras they are made when they are asked
    for: a look needs a few of them only."""
    spread: tuple[tuple[Mask | None, ...], ...] = ()
    """With one camera: masks of moments spread over the whole film, as `masks`."""
    shadows: Sequence[tuple[Mask | None, ...]] = ()
    """With several: what was taken for shadow, as in `Seen`, for each time."""
    keypoints: Sequence[tuple[Keypoints | None, ...]] = ()
    """With several: what detectors found, likewise; empty without any."""

    def seen(self, n: int) -> Seen:
        """What the cameras show at time `n`."""
        return Seen(self.masks[n], self.shadows[n] if len(self.shadows) else (), keypoints=self.keypoints[n] if self.keypoints else ())


@dataclass(frozen=True, eq=False)
class Survey:
    """A recording that was examined, and its silhouettes; does not depend on the seed."""

    rig: Rig
    silhouettes: tuple[Silhouettes, ...]
    """For each camera, the silhouettes used for tracking; empty if keypoints alone are."""
    clean: tuple[Silhouettes, ...]
    """For each camera, the silhouettes used for measuring the person; the same as `silhouettes` if these are clean."""
    first: FirstSeconds
    """Silhouettes of the beginning, made by `clean`."""
    look: Look | RigLook
    census: Census | None = None
    """The number of people and their floor, with several cameras."""
    films: tuple[FilmSurvey, ...] = ()
    """For each camera what was found of its film, of one person; empty once the person is measured."""

    @property
    def several(self) -> bool:
        """Whether there are several people, each to be tracked."""
        return self.census is not None and self.census.number > 1

    def settled(self) -> Survey:
        """The survey without the films' samples, which nothing needs once the person is measured."""
        return replace(self, films=())

    def look_with(self, person: dict[str, object], findings: tuple[Finding, ...]) -> Look | RigLook:
        """A copy of `look` with the fitted person and the findings about the fit."""
        return replace(self.look, person=person, findings=(*self.look.findings, *findings))
