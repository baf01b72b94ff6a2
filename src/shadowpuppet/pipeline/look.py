"""What a look at a recording finds before the run, as plain values: one camera's film, or several synchronized ones."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from shadowpuppet.calibration.agreement import Agreement
from shadowpuppet.camera.mask import Mask
from shadowpuppet.errors import TrackingError
from shadowpuppet.pipeline.rig import Rig
from shadowpuppet.pipeline.silhouettes import Silhouettes
from shadowpuppet.silhouette.quality import MaskQuality


@dataclass(frozen=True, kw_only=True)
class Look:
    """What was found in a recording of one camera; plain values, so that it can be saved."""

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
    """False where only the field of view is known."""
    frames: int | None
    """Number of the film's frames, if the film states it."""
    looked_at: int
    """Number of frames that were read for this look."""
    rate: float
    """Frames/s."""
    jitter: float
    """Standard deviation of the frames' interval, seconds."""
    scale: str
    """What fixes the scale."""
    background: str
    """Where the silhouettes come from."""
    key: str
    """What is compared with the background, and why."""
    area: float
    """Mean share of the image that is silhouette."""
    plain_area: float | None
    """The same by the plain rule of eq. 1; None without a standard deviation of the background."""
    exact_overlap: float | None
    """Overlap (intersection over union) with the recording's ready silhouettes, if there are any."""
    exact_overlap_plain: float | None
    """The same of the plain rule."""
    quality: MaskQuality
    """Quality of the silhouettes in the sampled frames."""
    person: dict[str, Any] | None = None
    """Sizes (m), place (m) and overlaps of the fitted body, and the silhouettes it was fitted in, where these are not the tracked ones;
    None if it was not fitted."""
    doubts: tuple[str, ...] = ()
    """What may harm the run, and the remedy, a sentence each."""
    refusal: str | None = None
    """Why tracking is hopeless; None if it is not."""


@dataclass(frozen=True, kw_only=True)
class CameraLook:
    """What was found of one of several cameras; plain values."""

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
    """Number of frames from the recording's time 0 on, if the film states it."""
    rate: float
    """Frames/s."""
    start: float
    """The recording's time 0 by the film's own clock, seconds."""
    background: str
    """Where the silhouettes come from."""
    key: str
    """What is compared with the background, and why."""
    exact_overlap: float | None
    """Overlap (intersection over union) with the recording's ready silhouettes, if there are any."""
    quality: MaskQuality
    """Quality of the silhouettes in the sampled frames."""


@dataclass(frozen=True, kw_only=True)
class RigLook:
    """What was found in a recording of several cameras; plain values, so that it can be saved."""

    recording: str
    """Its path."""
    cameras: tuple[CameraLook, ...]
    rate: float
    """Frame sets/s."""
    frames: int | None
    """Number of frame sets, if the films state it."""
    agreement: Agreement
    """How far the cameras agree, by the first seconds' silhouettes."""
    person: dict[str, Any] | None = None
    """Sizes and how they were found; None if the person was not measured."""
    doubts: tuple[str, ...] = ()
    """What may harm the run, and the remedy, a sentence each."""
    refusal: str | None = None
    """Why tracking is hopeless; None if it is not."""


class FirstSeconds(NamedTuple):
    """Silhouettes from the recording's beginning, in which the person is measured."""

    times: list[float]
    """Seconds, F of them."""
    masks: list[tuple[Mask | None, ...]]
    """For each time, one for each camera (H, W); None without a frame."""


@dataclass(frozen=True, eq=False)
class Survey:
    """A recording that was looked at; the same for every seed."""

    rig: Rig
    silhouettes: tuple[Silhouettes, ...]
    """One for each camera, in which the person is tracked."""
    clean: tuple[Silhouettes, ...]
    """Those in which the person is measured; the same if these are clean."""
    first: FirstSeconds
    """In clean silhouettes."""
    look: Look | RigLook

    def check(self) -> None:
        """Raise `TrackingError` if tracking is hopeless."""
        if self.look.refusal is not None:
            raise TrackingError(f"{self.look.recording}: {self.look.refusal}")

    def look_with(self, person: dict[str, Any], doubts: tuple[str, ...]) -> Look | RigLook:
        """The look with the fitted person, and the doubts that the fit raises."""
        return replace(self.look, person=person, doubts=(*self.look.doubts, *doubts))
