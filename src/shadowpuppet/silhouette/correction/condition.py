"""Condition of a film beside its empty scene: noise, compression, light and movement of the camera, and what of it is too much."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.errors import HARMFUL, NOTED, RUINOUS, Finding
from shadowpuppet.silhouette.background import Image, smoothed, to_planes
from shadowpuppet.silhouette.correction.frame_correction import Corrected, Correction
from shadowpuppet.silhouette.correction.motion_blur import blurred_share
from shadowpuppet.silhouette.segmenter import Segmenter

# Limits of the warnings. Films in good light have a noise of 0.9 to 1.3; sensor noise of sd 15 leaves 5.8, H.264 at crf 28
# 1.3 to 2.3, at crf 32, from which on errors grow by more than a third, 1.7 to 3.4.
WARN_NOISE = 6.5
WARN_ERROR = 3.0
WARN_COMPRESSION = 1.6
WARN_GAIN = 1.5
WARN_UNMATCHED = 0.02
UNMATCHED_MOSTLY = 0.5
WARN_BLUR = 0.6
BLURRED = 0.3
"""Share of mixtures in fast limbs from which on a film counts as blurred by motion; short exposures have at most 0.26."""
STEADY = 0.5
"""Change from frame to frame over the difference to the empty scene, below which that difference is no noise: it stays."""
COPIED = 0.8
"""Share of values that a frame has in common with the last from which on a film is compressed: noise and light change most of them."""


@dataclass(frozen=True)
class FilmCondition:
    """What a film's frames show beside a person: noise, compression, light, movement. `warnings` says what is too much."""

    noise: float
    """Standard deviation of the film about its empty scene, after correction and smoothing, grey levels of brightness."""
    change: float | None
    """Standard deviation of its change from frame to frame, likewise, over the root of 2; None without consecutive frames."""
    copied: float | None
    """Share of values that are the same in a frame and the next."""
    gain: tuple[float, float]
    """Least and greatest gain of a channel over the empty scene; (1, 1) if light is not followed."""
    moved: float
    """Greatest movement of the camera since the empty scene, pixels at the corners of the picture; 0 if it is not followed."""
    moved_frames: float
    """Share of the frames with a movement."""
    moved_since: float | None
    """Time (s) from which on all frames have a movement; None if the last one has none."""
    unmatched: float
    """Share of the frames in which the empty scene was not found, whatever the movement."""
    blur: float | None = None
    """Share of mixtures of limb and background in fast limbs; None if nothing moves fast."""

    @property
    def blurred(self) -> bool:
        """Whether moving limbs are blurred, because the exposure lasts from frame to frame."""
        return self.blur is not None and self.blur >= BLURRED and not self.compressed

    @property
    def compressed(self) -> bool:
        """Whether most of a frame is copied from the last."""
        return self.copied is not None and self.copied > COPIED

    def warnings(self, recovered: bool = False) -> tuple[Finding, ...]:
        """What harms the silhouettes, and the remedy, a sentence each. `recovered`: whether the empty scene was recovered from the film,
        not filmed by itself."""
        return (*self._movement(recovered), *self._light(), *self._noise(recovered), *self._blur())

    def _movement(self, recovered: bool) -> Iterator[Finding]:
        remedy = "its frames are shifted back, and what they do not show of the scene is guessed"
        if self.moved_since is not None:
            when = "throughout" if self.moved_frames == 1 else f"from about {self.moved_since:.1f} s on"
            yield Finding.of(f"the camera is up to {{pixels:.1f}} pixels from where it saw the empty scene, {when}: {remedy}; fix the "
                             "tripod", "camera moved by {pixels:.1f} pixels: fix the tripod", NOTED, pixels=self.moved)
        elif self.moved:
            yield Finding.of(f"the camera moves by up to {{pixels:.1f}} pixels, in {{percent:.0f}} % of the frames: {remedy}; fix the "
                             "tripod", "camera shakes by {pixels:.1f} pixels: fix the tripod", NOTED, pixels=self.moved,
                             percent=100 * self.moved_frames)
        percent = 100 * self.unmatched
        if self.unmatched > WARN_UNMATCHED and recovered:
            yield Finding.of("{percent:.0f} % of the frames do not fit the empty scene that was recovered from the film: the "
                             "person hides too much of it, or the camera moves; film it without the person, and step back",
                             "empty scene cannot be told from the film: film it", RUINOUS, percent=percent)
        elif WARN_UNMATCHED < self.unmatched < UNMATCHED_MOSTLY:
            yield Finding.of("{percent:.0f} % of the frames do not show the empty scene: the camera was covered, black or moved "
                             "by over a tenth of the picture for that time; look at the film, and cut it there",
                             "camera covered or moved in {percent:.0f} % of frames: cut them", HARMFUL, percent=percent)
        elif self.unmatched > WARN_UNMATCHED:
            yield Finding.of("{percent:.0f} % of the frames do not show the empty scene: the camera was moved by over a tenth "
                             "of the picture, is covered, or films another place; take the empty scene again",
                             "the empty scene is another place's: film it again", RUINOUS, percent=percent)

    def _light(self) -> Iterator[Finding]:
        least, most = self.gain
        if max(1 / least, most) > WARN_GAIN:
            yield Finding.of("the film's light is {least:.2f} to {most:.2f} times the empty scene's: this is followed up to about 1.4; "
                             "fix exposure and white balance, or take the empty scene again",
                             "light changes too much: fix exposure and white balance", HARMFUL, least=least, most=most)

    def _noise(self, recovered: bool) -> Iterator[Finding]:
        lasts = self.change is not None and self.change < STEADY * self.noise
        if lasts and self.noise > WARN_COMPRESSION and self.compressed:
            yield Finding.of("the film is compressed too much (its pixels are {grey_levels:.1f} grey levels off the empty scene): outlines "
                             "are blurred, and thin limbs merge with what is behind them; film at a higher bit rate or quality",
                             "film is compressed too much: use a higher quality", HARMFUL, grey_levels=self.noise)
        elif lasts and self.noise > WARN_ERROR:
            scene, remedy, short = "its empty scene", "take the empty scene again", "light differs from the empty scene's: film that again"
            if recovered:
                scene, remedy = "the empty scene that was recovered from it", "film the empty scene"
                short = "the recovered empty scene differs from the film: film it"
            yield Finding.of(f"the film differs from {scene} by {{grey_levels:.1f}} grey levels in light that no smooth change explains: "
                             f"clothes like the background are missed; {remedy} in this light", short, HARMFUL, grey_levels=self.noise)
        elif self.noise > WARN_NOISE:
            yield Finding.of("the film is noisy ({grey_levels:.1f} grey levels after smoothing): clothes like the background are missed; "
                             "use more light, or less gain of the camera", "film is noisy: use more light", HARMFUL, grey_levels=self.noise)

    def _blur(self) -> Iterator[Finding]:
        if self.blur is not None and self.blur > WARN_BLUR and not self.compressed:
            yield Finding.of("moving limbs are blurred ({percent:.0f} % of what they reach or leave within two frames is half limb, "
                             "half background): they look too wide, or vanish; use a shorter exposure with more light",
                             "moving limbs are blurred: use a shorter exposure", HARMFUL, percent=100 * self.blur)


class _State(NamedTuple):
    """Correction of one frame."""

    gains: NDArray[np.float64]
    """Of the channels (C,)."""
    moved: float
    """Pixels."""
    matched: bool


def film_condition(segmenter: Segmenter, runs: Sequence[Sequence[tuple[float, Image]]],
                   masks: Sequence[Sequence[NDArray[np.bool_]]] | None = None) -> FilmCondition:
    """The condition of a film's sampled frames, in `runs` of consecutive ones, each with its time (s) and picture (H, W, 3) or (H, W).

    masks: the people's masks (H, W) in them: for motion blur, and as what hides the empty scene.
    """
    correction = segmenter.correction or Correction(np.zeros(segmenter.background.image_shape, np.uint8))
    correction = replace(correction, detail=None)
    frames = [frame for run in runs for frame in run]
    each = [[correction(image) for _, image in run] for run in runs]
    corrected = [[frame.image for frame in run] for run in each]
    people = [None] * len(frames) if masks is None else [mask for run in masks for mask in run]
    states = [_state(correction, image, frame, mask)
              for (_, image), frame, mask in zip(frames, itertools.chain(*each), people, strict=True)]
    gains = np.concatenate([state.gains for state in states])
    moved = np.array([state.moved for state in states])
    still = np.flatnonzero(moved == 0)
    first = int(still[-1]) + 1 if len(still) else 0
    change, copied = _changes(corrected)
    return FilmCondition(
        noise=segmenter.noise, change=change, copied=copied, gain=(float(gains.min()), float(gains.max())),
        moved=float(moved.max()), moved_frames=float((moved > 0).mean()),
        moved_since=frames[first][0] if first < len(frames) else None,
        unmatched=float(np.mean([not state.matched for state in states])),
        blur=None if masks is None else blurred_share(corrected, masks),
    )  # fmt: skip


def _state(correction: Correction, image: Image, frame: Corrected, people: NDArray[np.bool_] | None) -> _State:
    registration = correction.registration
    if registration is None:
        return _State(frame.gains, 0.0, True)
    moved = 0.0 if frame.movement is None else registration.pixels(frame.movement)
    return _State(frame.gains, moved, registration.matches(image, frame.movement, people))


def _changes(runs: Sequence[Sequence[Image]]) -> tuple[float | None, float | None]:
    """Standard deviation of the change from frame to frame (grey levels, over the root of 2), and the share of values
    that stay."""
    changes, same = list[float](), list[float]()
    for run in runs:
        planes = [smoothed(to_planes(image)[..., :1].astype(np.float32)) for image in run]
        changes += [float(np.percentile(np.abs(a - b)[::2, ::2], 68)) for a, b in itertools.pairwise(planes)]
        same += [float(np.mean(a[::2, ::2] == b[::2, ::2])) for a, b in itertools.pairwise(run)]
    return (float(np.median(changes)) / 2**0.5, float(np.median(same))) if changes else (None, None)
