"""Keypoints that a script makes of a film's frames, and masks in the same pass if it is asked for them.

The script writes lines as `io.keypoints.script_output` says. If it is started with one more argument, `masks`, each frame's line is
followed by the frame's mask, HEIGHT x WIDTH bytes as `silhouette.external` says.
"""

from __future__ import annotations

from collections.abc import Generator, Iterable
from contextlib import closing
from typing import IO

from shadowpuppet.camera.mask import Mask
from shadowpuppet.errors import FILE_MEMORY, SilhouetteError
from shadowpuppet.external.pipes import FilmScript, Output
from shadowpuppet.io.files.text import errors_named
from shadowpuppet.io.keypoints.film_keypoints import FilmKeypoints
from shadowpuppet.io.keypoints.gathering import Gathered
from shadowpuppet.io.keypoints.script_output import Header, header_of, people_of
from shadowpuppet.silhouette.external.masks import checked_mask
from shadowpuppet.video import Image


class ScriptKeypoints:
    """Keypoints that a script makes of one film."""

    def __init__(self, script: FilmScript) -> None:
        """Nothing is run before `made`."""
        self.script = script
        self._known: tuple[Header, Gathered] | None = None

    def made(self, frames: Iterable[Image]) -> Generator[tuple[bool, Mask | None]]:
        """Whether a person is found in each of a film's frames (H, W, 3), one after another, and the mask (H, W) if it was asked for.

        Raises the errors of `FilmScript.outputs`, and `FormatError` or `SilhouetteError`, which name script, film and frame, for what is no
        line of keypoints or no mask.
        """
        rule = 'one line {"people": [...]} a frame: has the script printed to standard output?'
        with closing(self.script.outputs(frames, Output("lines of keypoints", rule, self._read))) as made:
            for n, data in enumerate(made):
                where = f"{self.script.where}: frame {n}"
                line, _, mask = data.partition(b"\n")
                yield self._add(n, line, where), checked_mask(mask, self.script.size, where) if self.script.options else None

    def film(self) -> FilmKeypoints:
        """All of them, after the last frame. Raises `FormatError`, naming script and film, for values that cannot be keypoints."""
        if self._known is None:
            raise SilhouetteError(f"{self.script.where}: found no frames")
        with errors_named(self.script.where):
            return self._known[1].film()

    def _read(self, pipe: IO[bytes]) -> tuple[bytes, str]:
        """The next frame's line and mask; the header before the first."""
        if self._known is None and (first := self._line(pipe)):
            with errors_named(f"{self.script.where}: first line"):
                header = header_of(first.decode("utf-8", "replace"))
                self._known = header, Gathered(header.names, header.detector, self.script.size)
        line = self._line(pipe)
        if not self.script.options or not line:
            return line, "" if line.endswith((b"\n", b"}")) else f"found a line that ends after {len(line)} bytes"
        mask = pipe.read(size := self.script.size[0] * self.script.size[1])
        fault = f"found {len(mask)} bytes after its line, expected its mask of {size}, as the script was started with the argument masks"
        return line + mask, "" if len(mask) == size else fault

    def _line(self, pipe: IO[bytes]) -> bytes:
        line = pipe.readline(FILE_MEMORY)
        if len(line) == FILE_MEMORY:
            raise SilhouetteError(f"{self.script.where}: found {FILE_MEMORY} bytes without a line's end, expected lines of keypoints")
        return line

    def _add(self, frame: int, line: bytes, where: str) -> bool:
        """Keep what a frame's line says; whether a person is in it."""
        assert self._known is not None, "the header was read before"
        header, gathered = self._known
        with errors_named(where):
            people = list(people_of(line.decode("utf-8", "replace"), header))
            for person, points in people:
                gathered.add(frame, person, points)
        return bool(people)
