"""Result types of examining a recording before the run: plain values for look.json, and the silhouettes that the run uses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

from shadowpuppet.calibration.agreement import Agreement
from shadowpuppet.camera.mask import Mask, Seen
from shadowpuppet.errors import Caution
from shadowpuppet.pipeline.rig import Rig
from shadowpuppet.pipeline.silhouettes import Silhouettes
from shadowpuppet.silhouette.correction.condition import FilmCondition
from shadowpuppet.silhouette.quality import MaskQuality

if TYPE_CHECKING:
    from shadowpuppet.pipeline.people.census import Census  # whose kernels the command line does not need


@dataclass(frozen=True, kw_only=True)
class Look:
    """Findings about a recording of one camera; plain values, so that it can be saved."""

    recording: str
    """Its path."""
    camera: str
    """The camera's name."""
    size: tuple[int, int]
    """Width and height of the film, pixels."""
    worked_size: tuple[int, int]
    """Width and height that frames are scaled to."""
    fov: float
    """Horizontal field of view, degrees."""
    calibrated: bool
    """False if only the field of view is known."""
    frames: int | None
    """Number of the film's frames; None if the film does not state it."""
    looked_at: int
    """Number of frames that were read for this look."""
    rate: float
    """Frames/s."""
    jitter: float
    """Standard deviation of the frames' interval, seconds."""
    scale: str
    """Known lengths that fix the scale, in words."""
    background: str
    """Where the silhouettes come from."""
    key: str
    """Which channels are compared with the background, and why."""
    area: float
    """Mean share of the image that is silhouette."""
    plain_area: float | None
    """The same with the plain rule of eq. 1; None if the background has no standard deviation."""
    exact_overlap: float | None
    """Overlap (intersection over union) with the recording's ready silhouettes; None without these."""
    exact_overlap_plain: float | None
    """The same with the plain rule of eq. 1."""
    quality: MaskQuality
    """Quality of the silhouettes in the sampled frames."""
    left_out: tuple[str, ...] = ()
    """Parts of the silhouettes that are left out because they are not the person, in words and the film's pixels."""
    condition: FilmCondition | None = None
    """Noise, light and movement of the film in the sampled frames; None for ready silhouettes."""
    person: dict[str, Any] | None = None
    """Sizes (m), place (m) and overlaps of the fitted body, and the silhouettes it was fitted to if these are not the tracked ones; None if
    it was not fitted."""
    doubts: tuple[Caution, ...] = ()
    """Possible problems of the run with their remedies, a sentence each."""
    refusal: str | None = None
    """Why tracking is hopeless; None if it is not."""


@dataclass(frozen=True, kw_only=True)
class CameraLook:
    """Findings about one of several cameras; plain values."""

    name: str
    size: tuple[int, int]
    """Width and height of the film, pixels."""
    worked_size: tuple[int, int]
    """Width and height that frames are scaled to."""
    fov: float
    """Horizontal field of view, degrees."""
    place: tuple[float, float, float]
    """Its place in the world, metres."""
    frames: int | None
    """Number of frames from the recording's time 0 on; None if the film does not state it."""
    rate: float
    """Frames/s."""
    start: float
    """The recording's time 0 on the film's own clock, seconds."""
    background: str
    """Where the silhouettes come from."""
    key: str
    """Which channels are compared with the background, and why."""
    exact_overlap: float | None
    """Overlap (intersection over union) with the recording's ready silhouettes; None without these."""
    quality: MaskQuality
    """Quality of the silhouettes in the sampled frames."""
    left_out: tuple[str, ...] = ()
    """Parts of the silhouettes that are left out because they are not the person, in words and the film's pixels."""
    condition: FilmCondition | None = None
    """Noise, light and movement of the film in the sampled frames; None for ready silhouettes."""


@dataclass(frozen=True, kw_only=True)
class RigLook:
    """Findings about a recording of several cameras; plain values, so that it can be saved."""

    recording: str
    """Its path."""
    cameras: tuple[CameraLook, ...]
    rate: float
    """Frame sets/s."""
    frames: int | None
    """Number of frame sets; None if the films do not state it."""
    agreement: Agreement
    """Agreement of the cameras, from the silhouettes of the first seconds."""
    person: dict[str, Any] | None = None
    """Sizes and how they were found; None if the person was not measured."""
    doubts: tuple[Caution, ...] = ()
    """Possible problems of the run with their remedies, a sentence each."""
    refusal: str | None = None
    """Why tracking is hopeless; None if it is not."""


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

    def seen(self, n: int) -> Seen:
        """What the cameras show at time `n`."""
        return Seen(self.masks[n], self.shadows[n] if len(self.shadows) else ())


@dataclass(frozen=True, eq=False)
class Survey:
    """A recording that was examined, and its silhouettes; does not depend on the seed."""

    rig: Rig
    silhouettes: tuple[Silhouettes, ...]
    """For each camera, the silhouettes used for tracking."""
    clean: tuple[Silhouettes, ...]
    """For each camera, the silhouettes used for measuring the person; the same as `silhouettes` if these are clean."""
    first: FirstSeconds
    """Silhouettes of the beginning, made by `clean`."""
    look: Look | RigLook
    census: Census | None = None
    """The number of people and their floor, with several cameras."""

    @property
    def several(self) -> bool:
        """Whether there are several people, each to be tracked."""
        return self.census is not None and self.census.number > 1

    def look_with(self, person: dict[str, Any], doubts: tuple[Caution, ...]) -> Look | RigLook:
        """A copy of `look` with the fitted person and the doubts about the fit."""
        return replace(self.look, person=person, doubts=(*self.look.doubts, *doubts))
