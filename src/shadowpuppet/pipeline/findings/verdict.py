"""One word on a recording or a run (good, doubtful, bad) and at most three reasons, the weightiest first.

A run is judged by what it states of itself: frames lost, width of the intervals, doubtful limbs. One camera hardly shows depth: a run that
is right in the picture may be doubtful or bad in depth, which is a word of its own.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain
from typing import Any, Literal, NamedTuple, TypedDict

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import HARMFUL, NOTED, RUINOUS, Finding
from shadowpuppet.geometry import Array, unit
from shadowpuppet.motion.limbs import DOUBTFUL, joints_of_limbs, limbs_in_words
from shadowpuppet.motion.metrics import LOST_ERROR
from shadowpuppet.motion.motion import Motion
from shadowpuppet.pipeline.findings.look import Look, RigLook

MOST = 3
"""Greatest number of reasons."""
Word = Literal["good", "doubtful", "bad"]
MOSTLY_LOST = 0.5
"""Share of the frames with a person above which a run that loses them is a failure, with an exit code of its own."""
OFTEN_LOST, OFTEN_DOUBTFUL = 0.05, {1: 0.6, 2: 0.4}
"""Shares of frames, lost (or without one of the cameras, or not in the film) and with a doubtful limb, above which a run is doubtful."""
WIDE_LIMB = {1: 0.0, 2: 0.065}
"""Expected error (m) of such a limb's joints above which it makes the run doubtful. With several cameras an arm of a clean film may be
doubtful in two thirds of the frames, as it might be far off, and yet be expected, rightly, to be off by 40 mm in the mean."""
REMEDIES = {"late": "check its start", "early": "began early, or lost frames?", "frozen": "check its cable", "blind": "look at its film"}
"""What to do about a camera, by why it was set aside."""
WIDE, FAR = {1: 0.105, 2: 0.05}, {1: 0.12, 2: 0.07}
"""Expected joint errors (m) above which a run is doubtful, and bad; for one camera, and for two or more."""
ROUNDED = 1e-3
"""Rounding (s) of the times in `set_aside`."""
MEAN_DISTANCE = 2 * np.sqrt(2 / np.pi) / np.sqrt(3)
"""Mean length of a vector of three independent normal errors, over the root of the sum of their variances."""


class SetAside(TypedDict):
    """A camera that was set aside for a time, or was blind, in metrics.json."""

    camera: str
    why: str
    frames: int
    from_s: float
    to_s: float


class Verdict(NamedTuple):
    """A verdict and its reasons."""

    word: Word
    reasons: tuple[str, ...]
    """At most three, the weightiest first, each with what to do in at most ten words."""
    depth: Word | None = None
    """The word on depth, if it is worse than that on the rest."""

    @property
    def words(self) -> str:
        """The verdict in words."""
        return self.word if self.depth is None else f"{self.word} in the picture, {self.depth} in depth"

    def plain(self) -> dict[str, str | list[str]]:
        """The verdict for JSON."""
        depth = {} if self.depth is None else {"depth": self.depth}
        return {"word": self.word, **depth, "reasons": list(self.reasons)}

    @classmethod
    def of(cls, plain: Mapping[str, Any]) -> Verdict:
        """The verdict that a run's metrics keep."""
        return cls(plain["word"], tuple(plain["reasons"]), plain.get("depth"))


def ranked(findings: Iterable[Finding]) -> list[Finding]:
    """Findings in the order of a report: the gravest first; those of one severity keep their order."""
    return sorted(findings, key=lambda each: -each.severity)


def verdict_of(findings: Iterable[Finding], in_depth: Sequence[Finding] = ()) -> Verdict:
    """The verdict that findings lead to: bad with a ruinous one, doubtful with a harmful one, else good; and those about depth alone."""
    findings = list(findings)
    word, depth = _word(findings), _word([*findings, *in_depth])
    return Verdict(word, tuple(_reasons([*findings, *in_depth]))[:MOST], depth if depth != word else None)


def _reasons(findings: Iterable[Finding]) -> Iterator[str]:
    """The findings' short words, the gravest first; those that several cameras share once."""
    about = dict[str, list[str]]()
    for each in ranked(findings):
        about.setdefault(each.short.removeprefix(f"{each.what}: ") if each.what else each.short, []).append(each.what)
    for short, names in about.items():
        known = [name for name in dict.fromkeys(names) if name]
        yield f"{', '.join(known)}: {short}" if known else short


def _word(findings: Sequence[Finding]) -> Word:
    severity = max((each.severity for each in findings), default=0)
    return "bad" if severity >= RUINOUS else "doubtful" if severity >= HARMFUL else "good"


def verdict_of_look(look: Look | RigLook) -> Verdict:
    """The verdict on a recording before it is tracked: bad if tracking is hopeless."""
    return Verdict("bad", (look.refusal,)) if look.refusal is not None else verdict_of(look.findings)


def verdict_of_run(look: Look | RigLook, motion: Motion, aside: Sequence[SetAside] = (),
                   frames: tuple[int, int | None] | None = None, camera: Camera | None = None) -> Verdict:
    """The verdict on a run of a recording, from what the look found and what the run states of itself.

    `aside`: the entry `set_aside` of metrics.json. `frames`: number of frames, or of sets of several cameras, that were read, and number
    that the films state; None if they do not. `camera`: the only one, along whose view errors are those of depth.
    """
    cameras = len(look.cameras) if isinstance(look, RigLook) else 1
    blind = blind_frames(motion, aside, cameras)
    lengths, along = _expected_lengths(motion, camera)
    of_depth = set[str]() if along is None else {limb for limb, joints in joints_of_limbs(motion.joint_names).items()
                                                 if _mean_error(along[:, joints]) > _mean_error(lengths[:, joints])}  # fmt: skip
    seen, kind = (motion.status != "absent") & ~blind, min(cameras, 2)
    of_motion = chain(_losses(motion), _wide(lengths[seen], kind, "joints may be off by {mm:.0f} mm on average"),
                      _doubtful_limbs(motion, kind, lengths[seen], [limb for limb in motion.limbs if limb not in of_depth]))
    in_depth = [] if along is None else [
        *_wide(along[seen], kind, "depths may be off by {mm:.0f} mm: add a camera aside"),
        *_doubtful_limbs(motion, kind, along[seen], [limb for limb in motion.limbs if limb in of_depth])]  # fmt: skip
    return verdict_of(chain(_missing(*frames or (0, None)), of_motion, _without_cameras(aside, len(motion)), look.findings), in_depth)


def _expected_lengths(motion: Motion, camera: Camera | None) -> tuple[Array, Array | None]:
    """Mean errors (T, J), metres, that the joints' standard deviations lead one to expect, and None; with an only `camera` those across its
    view, and those along it."""
    variances = motion.joint_sd**2
    total = variances.sum(2)
    if camera is None or not np.isfinite(total).any():
        return MEAN_DISTANCE * np.sqrt(total), None
    along = (variances * unit(motion.joints - camera.centre) ** 2).sum(2)
    return np.sqrt(np.pi / 4 * np.maximum(total - along, 0)), np.sqrt(2 / np.pi * along)


def _brief(words: str, severity: int, **evidence: float | str) -> Finding:
    """A finding whose sentence is short."""
    return Finding.of(words, words, severity, **evidence)


def _missing(found: int, stated: int | None) -> Iterator[Finding]:
    """A reason if the films have far fewer frames than they state."""
    share = 1 - found / stated if stated else 0.0
    if share > OFTEN_LOST:
        yield Finding.of("{read} frames were read, but the film states {stated}: is it whole?",
                         "{read} of the film's {stated} frames: is it whole?", RUINOUS if share > MOSTLY_LOST else HARMFUL,
                         read=found, stated=stated or 0)


def lost_share(motion: Motion) -> float:
    """Share of the frames with a person that are lost; 0 without such frames."""
    present = np.count_nonzero(motion.status != "absent")
    return float(np.count_nonzero(motion.status == "lost") / present) if present else 0.0


def blind_frames(motion: Motion, aside: Sequence[SetAside], cameras: int) -> NDArray[np.bool_]:
    """Frames (T,) in which all cameras were blind, from the entry `set_aside` of metrics.json: no picture could have shown the person."""
    blind = np.zeros((cameras, len(motion)), bool)
    names = list(dict.fromkeys(one["camera"] for one in aside))
    for one in aside:
        if one["why"] == "blind":
            blind[names.index(one["camera"])] |= (motion.times > one["from_s"] - ROUNDED) & (motion.times < one["to_s"] + ROUNDED)
    return np.logical_and.reduce(blind, 0)


def expected_error(motion: Motion, blind: NDArray[np.bool_] | None = None) -> float:
    """Mean joint error, metres, that the stated standard deviations lead one to expect, a lost joint counted as 0.5 m; not a number where
    none is stated. `blind`: frames (T,) that are left out."""
    present = (motion.status != "absent") if blind is None else (motion.status != "absent") & ~blind
    return _mean_error(_expected_lengths(motion, None)[0][present])


def _mean_error(lengths: Array) -> float:
    """Mean of expected errors (T, J), metres, a joint without one counted as 0.5 m; not a number without any."""
    if not np.isfinite(lengths).any():
        return np.nan
    return float(np.where(np.isfinite(lengths), lengths, LOST_ERROR).mean())


def _without_cameras(aside: Sequence[SetAside], frames: int) -> Iterator[Finding]:
    """A reason for each camera that was set aside, and why."""
    for camera, why in dict.fromkeys((one["camera"], one["why"]) for one in aside):
        times = [one for one in aside if (one["camera"], one["why"]) == (camera, why)]
        number = sum(one["frames"] for one in times)
        yield _brief("camera {camera!r} {why} from {seconds:.1f} s: {remedy}", HARMFUL if number > OFTEN_LOST * frames else NOTED,
                     camera=camera, why=why, seconds=times[0]["from_s"], remedy=REMEDIES[why], frames=number)


def _losses(motion: Motion) -> Iterator[Finding]:
    """A reason if no frame shows a person, or many lose the person."""
    if not (motion.status != "absent").any():
        yield Finding("nobody was seen in any frame", "nobody was seen: film the empty scene and the person", RUINOUS)
    elif (lost := lost_share(motion)) > OFTEN_LOST:
        yield _brief("person lost in {percent:.0f} % of frames: look where (`view`)",
                     RUINOUS if lost > MOSTLY_LOST else HARMFUL, percent=100 * lost)


def _wide(lengths: Array, kind: int, words: str) -> Iterator[Finding]:
    """A reason, in `words`, if expected errors (T, J), metres, are great."""
    error = _mean_error(lengths)
    if error > WIDE[kind]:
        yield _brief(words, RUINOUS if error > FAR[kind] else HARMFUL, mm=1000 * error)


def _doubtful_limbs(motion: Motion, kind: int, lengths: Array, limbs: Sequence[str]) -> Iterator[Finding]:
    """A reason for limbs that are often doubtful, and one for others that are at times, with expected errors (T, J) of the joints, m."""
    if not len(motion):
        return
    shares = {limb: float(np.isin(motion.limb_status[:, motion.limbs.index(limb)], DOUBTFUL).mean()) for limb in limbs}
    errors = {limb: _mean_error(lengths[:, joints]) for limb, joints in joints_of_limbs(motion.joint_names).items()}
    often = [limb for limb, share in shares.items() if share > OFTEN_DOUBTFUL[kind] and not errors[limb] <= WIDE_LIMB[kind]]
    at_times = [limb for limb, share in shares.items() if share > OFTEN_LOST and limb not in often]
    for some, weight in ((often, HARMFUL), (at_times, NOTED)):
        if some:
            named = "all limbs" if len(some) == len(motion.limbs) > 1 else limbs_in_words(some)
            least, most = (100 * edge(shares[limb] for limb in some) for edge in (min, max))
            share = "{least:.0f}" if round(least) == round(most) else "{least:.0f} to {most:.0f}"
            yield _brief(f"{named} doubtful in {share} % of frames", weight, least=least, most=most)
