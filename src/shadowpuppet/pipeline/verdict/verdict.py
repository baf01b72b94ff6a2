"""One word on a recording or a run (good, doubtful, bad) and at most three reasons, the weightiest first."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Literal, NamedTuple

from shadowpuppet.errors import HARMFUL, RUINOUS, Caution
from shadowpuppet.pipeline.look import Look, RigLook

MOST = 3
"""Greatest number of reasons."""
Word = Literal["good", "doubtful", "bad"]


class Verdict(NamedTuple):
    """A verdict and its reasons."""

    word: Word
    reasons: tuple[str, ...]
    """At most three, the weightiest first, each with what to do in at most ten words."""

    def plain(self) -> dict[str, Any]:
        """The verdict for JSON."""
        return {"word": self.word, "reasons": list(self.reasons)}


def verdict_of(cautions: Iterable[Caution]) -> Verdict:
    """The verdict that cautions lead to: bad with a ruinous one, doubtful with a harmful one, else good; equal weights keep their order."""
    ordered = sorted(cautions, key=lambda caution: -caution.weight)
    heaviest = ordered[0].weight if ordered else 0
    word: Word = "bad" if heaviest >= RUINOUS else "doubtful" if heaviest >= HARMFUL else "good"
    return Verdict(word, tuple(dict.fromkeys(caution.short for caution in ordered))[:MOST])


def verdict_of_look(look: Look | RigLook) -> Verdict:
    """The verdict on a recording before it is tracked: bad if tracking is hopeless."""
    return Verdict("bad", (look.refusal,)) if look.refusal is not None else verdict_of(look.doubts)
