"""What runs of one film have in common, kept from each to the next: the survey, and the silhouettes.

Neither depends on the seed or on what tracks. Of runs that are repeated with other seeds they are the greater part of the work.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.pipeline.footage import Footage, Mask, Shot, Silhouettes
from shadowpuppet.pipeline.look import Prepared, survey, with_person
from shadowpuppet.pipeline.options import Options, plain_options

SHARED = ("height", "distance", "fov", "calibration", "camera", "background", "masks", "region", "max_size", "every", "silhouette")
"""Options that survey and silhouettes depend on."""
LIMIT = 256_000_000
"""Bytes of silhouettes that are kept, a bit a pixel: half an hour of 25 frames/s at 320 x 240, a quarter of that at 640 x 480."""


def film_of(recording: str | Path, settings: Mapping[str, Any]) -> dict[str, Any]:
    """What two runs must have the same so that their silhouettes are; `settings`: plain values, as of `plain_options`."""
    return {"recording": str(Path(recording).resolve()), **{name: settings.get(name) for name in SHARED}}


@dataclass
class Reel:
    """The silhouettes of a film's shots, in order, as far as there is room for them."""

    limit: int = LIMIT
    """Bytes."""
    times: list[float] = field(default_factory=list)
    """Seconds."""
    bits: list[NDArray[np.uint8]] = field(default_factory=list)
    """A bit a pixel, row by row."""
    shape: tuple[int, int] = (0, 0)
    """Of the masks (H, W)."""
    whole: bool = False
    """Whether they are those of the whole film."""

    @property
    def size(self) -> int:
        """Bytes."""
        return sum(map(len, self.bits[:1])) * len(self.bits)

    def add(self, time: float, mask: Mask) -> None:
        """Keep one more; beyond the limit none."""
        if self.size > self.limit:
            self.times.clear()
            self.bits.clear()
            self.limit = -1
            return
        self.shape = mask.shape
        self.times.append(time)
        self.bits.append(np.packbits(mask))

    def mask(self, bits: NDArray[np.uint8]) -> Mask:
        """One of `bits`, of shape (H, W)."""
        return np.unpackbits(bits, count=self.shape[0] * self.shape[1]).reshape(self.shape).view(np.bool_)


class Repeats:
    """Prepares runs as `look.prepare` does, and keeps what the next of the same film can use. For one thread; holds one film."""

    def __init__(self, limit: int = LIMIT) -> None:
        """`limit`: bytes of silhouettes that are kept; those of longer films are made anew."""
        self.limit = limit
        self.reused = False
        """Whether the last run that was prepared takes silhouettes that were kept."""
        self._film: dict[str, Any] | None = None
        self._surveyed: Prepared | None = None
        self._reel = Reel(limit)

    def prepare(self, recording: str | Path, options: Options, rng: np.random.Generator) -> Prepared:
        """As `look.prepare`, with the same result. With an overlay, which shows the pictures, silhouettes are made anew."""
        film = film_of(recording, plain_options(options))
        if self._surveyed is None or film != self._film:
            self.forget()
            self._surveyed, self._film = survey(str(recording), options), film
        prepared = with_person(self._surveyed, options, rng)
        self.reused = self._reel.whole and not options.overlay
        if not self.reused:
            self._reel = Reel(self.limit)
        of_footage, of_silhouettes = (_Kept, _Unpacked) if self.reused else (_Filming, _Filmed)
        return replace(prepared, footage=of_footage(**_values(prepared.footage), reel=self._reel),
                       silhouettes=of_silhouettes(**_values(prepared.silhouettes), reel=self._reel))

    def forget(self) -> None:
        """Let go of what is kept."""
        self._film, self._surveyed, self._reel = None, None, Reel(self.limit)


@dataclass(frozen=True, eq=False)
class _Filming(Footage):
    """A film that tells when it came to its end."""

    reel: Reel = field(default_factory=Reel)

    def shots(self, ready: bool, strict: bool = True) -> Iterator[Shot]:
        yield from super().shots(ready, strict)
        self.reel.whole = self.reel.size <= self.reel.limit


@dataclass(frozen=True, eq=False)
class _Filmed(Silhouettes):
    """Silhouettes that are kept as they are made."""

    reel: Reel = field(default_factory=Reel)

    def __call__(self, shot: Shot) -> Mask:
        mask = super().__call__(shot)
        self.reel.add(shot.time, mask)
        return mask


@dataclass(frozen=True, eq=False)
class _Kept(Footage):
    """A film of which silhouettes are kept: the picture of a shot is the bits of one."""

    reel: Reel = field(default_factory=Reel)

    def tracked(self, ready: bool, every: int) -> Iterator[Shot]:
        return (Shot(time, bits, None) for time, bits in zip(self.reel.times, self.reel.bits))


@dataclass(frozen=True, eq=False)
class _Unpacked(Silhouettes):
    """Silhouettes from the bits of one."""

    reel: Reel = field(default_factory=Reel)

    def __call__(self, shot: Shot) -> Mask:
        return self.reel.mask(shot.image)


def _values(of: Any) -> dict[str, Any]:
    return {f.name: getattr(of, f.name) for f in fields(of)}
