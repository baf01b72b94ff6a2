"""A fault of the pictures as an entry of a spec, and as text."""

from __future__ import annotations

import re
from typing import Annotated, Any

from pydantic import Field
from pydantic.dataclasses import dataclass

from shadowpuppet.errors import SettingsError, choices
from shadowpuppet.settings import STRICT
from shadowpuppet.synthetic.faults.kinds import KINDS, FaultKind, FaultName
from shadowpuppet.synthetic.viewpoint import Name

FaultSeconds = Annotated[float, Field(ge=0, le=36_000)]


@dataclass(frozen=True, config=STRICT, kw_only=True)
class Fault:
    """A fault of one or more cameras' films, from a time on, for some time, or throughout."""

    kind: FaultName
    """Kind of fault."""
    amount: float | None = None
    """Strength, in the unit of the kind; by default a moderate one."""
    begin: FaultSeconds = 0.0
    """Second of the film at which it begins."""
    end: FaultSeconds | None = None
    """Second of the film at which it ends; by default it stays."""
    drift: bool = False
    """Whether it builds up evenly from `begin` to `end` (by default the film's end) and stays, rather than being there at once."""
    cameras: tuple[Name, ...] = ()
    """Names of the cameras that have it; empty for all."""
    empty: bool = False
    """Whether the film of the empty scene has it as well, from its first to its last frame."""
    direction_deg: Annotated[float, Field(ge=-180, le=180)] = 0.0
    """Direction in which a nudge moves the picture's content, degrees: 0 to the right, 90 down."""
    roll_deg: Annotated[float, Field(ge=-45, le=45)] = 0.0
    """Clockwise turn of the picture's content after a nudge, or the greatest one of a shaking camera, degrees."""

    def __post_init__(self) -> None:
        """Check the values against the kind."""
        known = KINDS[self.kind]
        self._check_amount(known)
        if self.end is not None and self.end <= self.begin:
            raise ValueError(f"end: found {self.end:g}, expected more than begin, {self.begin:g}")
        if known.everywhere and self.cameras:
            raise ValueError(f"cameras: found {', '.join(self.cameras)}, expected none for {self.kind}, which all cameras see")
        if self.kind == "crf" and (self.begin, self.end) != (0, None):
            raise ValueError(f"begin, end: found {self.begin:g} and {self.end}, expected none for crf, which is a whole film's")
        refused = {"drift": self.drift and not known.gradual, "empty": self.empty and not known.in_empty_scene,
                   "roll_deg": self.roll_deg and known.displacement is None,
                   "direction_deg": self.direction_deg and self.kind != "nudge"}  # fmt: skip
        allows = {"drift": lambda kind: kind.gradual, "empty": lambda kind: kind.in_empty_scene,
                  "roll_deg": lambda kind: kind.displacement is not None, "direction_deg": lambda kind: kind is KINDS["nudge"]}  # fmt: skip
        for name in (name for name, wrong in refused.items() if wrong):
            others = ", ".join(other for other, kind in KINDS.items() if allows[name](kind))
            raise ValueError(f"{name}: found {str(getattr(self, name)).lower()} for {self.kind}; only these have it: {others}")

    def _check_amount(self, known: FaultKind) -> None:
        if self.amount is None:
            return
        if not known.unit:
            raise ValueError(f"amount: found {self.amount:g}, expected none for {self.kind}")
        if not known.least <= self.amount <= known.most or (known.whole and self.amount != round(self.amount)):
            number = "a whole number" if known.whole else "a number"
            raise ValueError(f"amount: found {self.amount:g}, expected {number} from {known.least:g} to {known.most:g} "
                             f"for {self.kind} ({known.unit})")

    @property
    def strength(self) -> float:
        """The amount, or the kind's default."""
        return KINDS[self.kind].default if self.amount is None else self.amount

    def is_of(self, camera: str) -> bool:
        """Whether a camera of this name has it."""
        return not self.cameras or camera in self.cameras

    def share(self, seconds: float, last: float) -> float:
        """Share of the fault, 0 to 1, that is there at a time; `last`: the film's last frame. Both are seconds from the first frame."""
        if not self.drift:
            return float(self.begin - 1e-9 <= seconds and (self.end is None or seconds < self.end - 1e-9))
        end = last if self.end is None else self.end
        return min(max((seconds - self.begin) / max(end - self.begin, 1e-9), 0.0), 1.0)


def faults_from_text(text: str, source: str = "faults") -> list[dict[str, Any]]:
    """Plain values of faults from the text `kind amount @begin-end drift camera, kind ...`; all but the kind may be left out.

    Raises `SettingsError` for a text that cannot be read; values are checked by the spec.
    """
    return [_fault(item.split(), source) for item in text.split(",")]


def _fault(words: list[str], source: str) -> dict[str, Any]:
    if not words or words[0] not in KINDS:
        raise SettingsError(f"{source}: found {' '.join(words)!r}, which names no kind of fault; there are: {choices(KINDS)}")
    values: dict[str, Any] = {"kind": words[0]}
    for word in words[1:]:
        if times := re.fullmatch(r"@(\d+(?:\.\d*)?)(?:-(\d+(?:\.\d*)?))?", word):
            values |= {"begin": float(times[1])} | ({"end": float(times[2])} if times[2] else {})
        elif word == "drift":
            values["drift"] = True
        elif re.fullmatch(r"\d+(\.\d*)?", word) and "amount" not in values:
            values["amount"] = float(word)
        elif re.fullmatch(r"[A-Za-z][A-Za-z0-9_-]*", word):
            values["cameras"] = [*values.get("cameras", []), word]
        else:
            raise SettingsError(f"{source}: found {word!r} in {' '.join(words)!r}, expected an amount, @begin-end in seconds, drift, or a "
                                f"camera's name")
    return values
