"""Cache of a recording's survey and silhouettes, kept from one run to the next.

They depend on neither the seed nor the tracker, and take most of the time of runs that are repeated with other seeds.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from functools import cached_property
from io import SEEK_END, BufferedRandom
from pathlib import Path
from tempfile import TemporaryFile
from weakref import finalize

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.camera.colour_codes import ColourCode, thinned
from shadowpuppet.camera.keypoints import Keypoints
from shadowpuppet.camera.mask import Mask, Seen
from shadowpuppet.pipeline.findings.look import Survey
from shadowpuppet.pipeline.options import Options, plain_options
from shadowpuppet.pipeline.rig import FrameSet, Rig

SHARED = ("height", "distance", "fov", "calibration", "camera", "background", "masks", "region", "start", "end", "max_size",
          "every", "people", "silhouette", "evidence")
"""Options on which survey and silhouettes depend."""
LIMIT = 256_000_000
"""Greatest size of the kept silhouettes, bytes: about half an hour of one camera's 25 frames/s at 320 x 240."""


def film_of(recording: str | Path, settings: Mapping[str, object]) -> dict[str, object]:
    """Recording and options that must be equal for two runs to share silhouettes; `settings`: plain values, as from `plain_options`."""
    return {"recording": str(Path(recording).resolve()), **{name: settings.get(name) for name in SHARED}}


Place = tuple[int, int]
"""Where compressed values are in a file, and their number of bytes."""
Packed = tuple[Place, tuple[int, ...]]
"""A mask's bits, and its shape (H, W)."""


class MaskStore:
    """Masks of a recording's frame sets, in order, compressed in a temporary file, as memory should not grow with a film; emptied once they
    exceed the limit."""

    def __init__(self, limit: int = LIMIT) -> None:
        """`limit`: greatest size, bytes."""
        self.limit = limit
        self.size = 0
        """Size of what is stored, bytes."""
        self.complete = False
        """Whether all frame sets of the recording are stored."""
        self.sets: list[tuple[float, list[Packed | None], list[Place | None], tuple[Keypoints | None, ...]]] = []
        """For each set its time (s) and, for each camera, `Seen.masks`, where the mask is, `Seen.codes`, and `Seen.keypoints`; None for a
        camera without them."""

    @cached_property
    def _file(self) -> BufferedRandom:
        file = TemporaryFile()  # noqa: SIM115 - closed with the store
        finalize(self, file.close)
        return file

    def add(self, time: float, seen: Seen) -> None:
        """Store one frame set's masks, and the colours in them; not the shadows."""
        if self.size > self.limit:
            self.sets.clear()
            self._file.truncate(0)
            return
        packed = [None if mask is None else (self._written(np.packbits(mask)), mask.shape) for mask in seen.masks]
        colours = [None if mask is None or each is None else self._written(each[thinned(mask)])
                   for mask, each in zip(seen.masks, seen.codes)]
        self.sets.append((time, packed, colours, seen.keypoints))
        self.size += sum(each.xy.nbytes + each.confidence.nbytes for each in seen.keypoints if each is not None)

    def _written(self, values: NDArray) -> Place:
        begin = self._file.seek(0, SEEK_END)
        self.size += (number := self._file.write(zlib.compress(values.tobytes(), 1)))
        return begin, number

    def _read(self, place: Place, kind: type[np.number]) -> NDArray:
        self._file.seek(place[0])
        return np.frombuffer(zlib.decompress(self._file.read(place[1])), kind)

    def __iter__(self) -> Iterator[FrameSet]:
        """The stored frame sets, without images."""
        yield from map(self._frame_set, range(len(self.sets)))

    def __reversed__(self) -> Iterator[FrameSet]:
        """The same, the last first."""
        yield from map(self._frame_set, reversed(range(len(self.sets))))

    def _frame_set(self, n: int) -> FrameSet:
        time, packed, colours, keypoints = self.sets[n]
        masks = tuple(map(self._mask, packed))
        seen = Seen(masks, codes=tuple(map(self._codes, masks, colours)), keypoints=keypoints)
        return FrameSet(time, (None,) * len(packed), seen)

    def _mask(self, packed: Packed | None) -> Mask | None:
        if packed is None:
            return None
        place, shape = packed
        return np.unpackbits(self._read(place, np.uint8), count=int(np.prod(shape))).reshape(shape).view(np.bool_)

    def _codes(self, mask: Mask | None, place: Place | None) -> ColourCode | None:
        """Colours in a mask (H, W), and 0 elsewhere."""
        if mask is None or place is None:
            return None
        inside = thinned(mask)
        codes = np.zeros(inside.shape, np.uint16)
        codes[inside] = self._read(place, np.uint16)
        return codes

    def stored(self, frames: Iterable[FrameSet]) -> Generator[FrameSet]:
        """Pass frame sets on, and store their masks."""
        for each in frames:
            self.add(each.time, each.seen)
            yield each
        self.complete = self.size <= self.limit


def _state(rig: Rig) -> dict[str, object]:
    """The state of the files on which silhouettes depend, by name: a film may be replaced between two runs."""
    return {name: state for name, state in rig.inputs.began.items() if not name.startswith("--") or name.removeprefix("--") in SHARED}


class SilhouetteCache:
    """Keeps the survey and the silhouettes of one recording at a time. Not for several threads."""

    def __init__(self, limit: int = LIMIT) -> None:
        """`limit`: greatest size of the kept silhouettes, bytes; those of longer films are not kept."""
        self.limit = limit
        self._film: dict[str, object] | None = None
        self._survey: Survey | None = None
        self._store = MaskStore(limit)

    def survey(self, rig: Rig, options: Options, make: Callable[[Rig, Options], Survey]) -> Survey:
        """The kept survey, or a new one from `make`."""
        film = film_of(rig.recording.path, plain_options(options)) | {"state": _state(rig)}
        if self._survey is None or film != self._film:
            self.forget()
            survey = make(rig, options)
            self._survey, self._film = survey.settled(), film
            return survey
        return self._survey

    def keep(self, survey: Survey) -> None:
        """Keep another survey of the same film, whose silhouettes differ."""
        self._survey, self._store = survey.settled(), MaskStore(self.limit)

    @property
    def is_complete(self) -> bool:
        """Whether all silhouettes of the surveyed recording are kept."""
        return self._store.complete

    def frames(self, frames: Generator[FrameSet]) -> Generator[FrameSet]:
        """The kept frame sets, without images, if they are complete; else `frames`, whose masks are then kept."""
        if self.is_complete:
            yield from self._store
        else:
            self._store = MaskStore(self.limit)
            yield from self._store.stored(frames)

    def forget(self) -> None:
        """Discard survey and silhouettes."""
        self._film, self._survey, self._store = None, None, MaskStore(self.limit)
