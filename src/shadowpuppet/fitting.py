"""Who is in the film: the person's sizes and place, from a file, from reference pictures, or from the film itself."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from shadowpuppet.errors import RecordingError, SilhouetteError, TrackingError
from shadowpuppet.footage import Footage, Mask, Sample, Shot, Silhouettes
from shadowpuppet.initialization import AVERAGE_HEIGHT, Fit, find_person, fit_references
from shadowpuppet.io.person import Person, read_person
from shadowpuppet.io.recording import Reference
from shadowpuppet.options import Options
from shadowpuppet.tracking import MonocularTracker

WRONG = {"front_t_pose": 0.65, "side_arms_hanging": 0.57, "front_arms_t_pose": 0.65}
"""Overlap of the fitted body and a reference's silhouette under which it does not show its posture..."""
DOUBTFUL = {"front_t_pose": 0.78, "side_arms_hanging": 0.68, "front_arms_t_pose": 0.78}
"""... or may not."""
POOR = 0.75
"""Overlap with the film's first silhouette under which the body is in doubt; bodies that fit have 0.85 to 0.95."""
LONGEST_REFERENCE = 60
"""Frames of a reference's film that are looked at."""
LOOKED_FOR_IN = 6
"""Masks of the first seconds in which a person without references is looked for."""


@dataclass(frozen=True, eq=False)
class Found:
    """A person who was found in the pictures."""

    fit: Fit
    """Sizes and place."""
    source: str
    """Where the sizes come from, in words."""
    start: float
    """Overlap of the body, in the best pose found, with the film's first silhouette."""

    @property
    def person(self) -> Person:
        """To be saved and used again."""
        guess = self.fit.guess
        return Person(guess.sizes, round(guess.height, 4), self.source)

    def doubts(self) -> list[str]:
        """What speaks against this fit."""
        said = [f"references: {name}: the fitted body overlaps its silhouette by {overlap:.2f} only: is it the posture {name}, and "
                "is the silhouette whole? take it again, or remove it" for name, overlap in self.fit.overlaps.items()
                if self.source == "references" and overlap < DOUBTFUL[name]]
        if self.start < POOR:
            said.append(f"the body overlaps the film's first silhouette by {self.start:.2f} only: do height and distance hold, is the "
                        "silhouette a person's, and does the person face the camera?")
        return said


def find(footage: Footage, sample: Sample, seen: Silhouettes, options: Options, rng: np.random.Generator) -> Found:
    """Sizes and place. Raises `TrackingError` where nobody is found or a reference shows another posture, or `FormatError`."""
    for_fit, for_start = rng.spawn(2)
    masks = [mask for mask in map(seen, [*sample.first, *sample.shots]) if mask.any()]
    if not masks:
        raise TrackingError(f"{footage.view.video}: the silhouettes are empty, expected a person in them")
    fit, source = _fitted(footage, masks, seen, options, for_fit)
    tracker = MonocularTracker(fit.guess.picture(footage.camera, options.tracker.body), options.tracker)
    return Found(fit, source, tracker.start(for_start, masks[0]).overlap)


def told_scale(footage: Footage) -> str:
    """What fixes the scale, in words."""
    subject = footage.recording.subject
    known = [f"{name} {value:.2f} m" for name, value in (("height", subject.height), ("distance", subject.distance)) if value]
    return " and ".join(known) or f"average height of {AVERAGE_HEIGHT:.2f} m, assumed"


def _fitted(footage: Footage, masks: list[Mask], seen: Silhouettes, options: Options, rng: np.random.Generator) -> tuple[Fit, str]:
    subject, body = footage.recording.subject, options.tracker.body
    known = {"height": subject.height, "distance": subject.distance, "body": body, "settings": options.initialization}
    if options.person is not None:
        person = read_person(options.person)
        known["height"] = known["height"] or person.height
        fit = find_person(rng, footage.camera, _few(masks), sizes=person.sizes, **known)
        return replace(fit, curves={}), str(options.person)
    references = _references(footage, seen)
    if references:
        fit = fit_references(rng, footage.camera, references, **known)
        _check_postures(footage, fit)
        return fit, "references"
    return find_person(rng, footage.camera, _few(masks), **known), "proportions, refined on the first seconds"


def _few(masks: list[Mask]) -> list[Mask]:
    """Some of the masks of the first seconds, spread."""
    first = masks[: max(10, LOOKED_FOR_IN)]
    places = np.unique(np.linspace(0, len(first) - 1, LOOKED_FOR_IN).astype(int))
    return [first[k] for k in places]


def _references(footage: Footage, seen: Silhouettes) -> dict[str, Mask]:
    """Masks of the reference postures; with ready masks those that have one."""
    given = [r for r in footage.recording.references if seen.segmenter is not None or r.mask is not None]
    return {reference.name: _reference(footage, seen, reference) for reference in given}


def _reference(footage: Footage, seen: Silhouettes, reference: Reference) -> Mask:
    path = reference.image if seen.segmenter is not None or reference.mask is None else reference.mask
    images = (image for image, _ in zip(footage.pictures(path, "a reference"), range(LONGEST_REFERENCE)))
    try:
        masks = [seen(Shot(0.0, image, image)) for image in images]
    except SilhouetteError as error:
        raise RecordingError(f"{path}: {error}") from None
    middle = sorted(masks, key=np.count_nonzero)[len(masks) // 2]  # in a film of the posture, whoever walks in is in few frames
    if not middle.any():
        raise RecordingError(f"{path}: the silhouette is empty, expected the person in the posture {reference.name} before the "
                             "background of the film; take it again, or remove it: without it, sizes come from proportions")
    return middle


def _check_postures(footage: Footage, fit: Fit) -> None:
    paths = {reference.name: reference.image for reference in footage.recording.references}
    worst = min(fit.overlaps, key=lambda name: fit.overlaps[name] - WRONG[name])
    if fit.overlaps[worst] < WRONG[worst]:
        raise RecordingError(f"{paths[worst]}: the body in the posture {worst} overlaps the silhouette by "
                             f"{fit.overlaps[worst]:.2f} only, expected over {DOUBTFUL[worst]}: {HOW[worst]}; take it again, or remove it")


HOW = {
    "front_t_pose": "face the camera, arms level to the sides, palms down",
    "side_arms_hanging": "turn to show the left or right side, arms down along the body",
    "front_arms_t_pose": "face the camera, arms level to the sides, palms down",
}
"""What each reference shows."""
