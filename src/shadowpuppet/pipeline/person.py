"""Who is in the film: the person's sizes and place, from a file, from reference pictures, or from the film itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import chain, islice

import numpy as np

from shadowpuppet.body.anthropometry import AVERAGE_HEIGHT
from shadowpuppet.body.models import WHOLE
from shadowpuppet.body.sizes import CardboxSizes
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import may_be_person
from shadowpuppet.errors import RecordingError, SilhouetteError, TrackingError
from shadowpuppet.geometry import Array
from shadowpuppet.io.person import Person, read_person
from shadowpuppet.io.recording import Reference
from shadowpuppet.pipeline.footage import FIRST, Footage, Mask, Sample, Shot, Silhouettes
from shadowpuppet.pipeline.options import Options
from shadowpuppet.silhouette.boundary import disc
from shadowpuppet.tracking.monocular.initialization import POSTURES, PersonEstimate, SizeFit, as_whole, find_person, fit_references
from shadowpuppet.tracking.monocular.tracker import MonocularTracker

WRONG = {"front_t_pose": 0.65, "side_arms_hanging": 0.62, "front_arms_t_pose": 0.65}
"""Overlap (intersection over union) of the fitted body and a reference's silhouette under which it does not show its posture..."""
DOUBTFUL = {"front_t_pose": 0.78, "side_arms_hanging": 0.68, "front_arms_t_pose": 0.78}
"""... or may not. Right ones have 0.85 to 0.94, from the side 0.72 to 0.89."""
SEEN = 0.6
"""Share of a level forearm that lies in the silhouette, under which the arms were not level: sizes can hide a wrong posture..."""
BESIDE = 0.03
"""... or so far beside it, over the root of its area: in small pictures an arm may lack one side."""
DEEP = 1.2
"""Depth of the fitted trunk over its width from which on it was not seen from the side; right ones have 0.75 to 0.82."""
BROAD = 0.33
"""Width of the fitted trunk's lower edge over the height from which on it was fitted to more than a person. Right ones have 0.13 to 0.2,
the broadest of people (ANSUR II; Gordon et al. 2014) 0.27."""
POOR = 0.75
"""Overlap with the film's first silhouette under which the body is in doubt; bodies that fit have 0.85 to 0.95."""
LONGEST_REFERENCE = 60
"""Frames of a reference's film that are looked at."""
LOOKED_FOR_IN = 12
"""Masks of the first seconds in which a person without references is looked for."""


@dataclass(frozen=True, eq=False)
class Found:
    """A person who was found in the pictures."""

    fit: SizeFit
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
    masks = list(islice(filter(may_be_person, map(seen, chain(sample.first, sample.shots))), FIRST))
    if not masks:
        raise TrackingError(f"{footage.view.video}: the silhouettes are empty or nearly all of the picture, expected a person in them")
    try:
        fit, source = _fitted(footage, masks, seen, options, for_fit)
    except TrackingError as error:
        raise TrackingError(f"{footage.recording.path}: {error}") from None
    tracker = MonocularTracker(fit.guess.picture(footage.camera, options.tracker.body), options.tracker)
    return Found(fit, source, tracker.start(for_start, masks[0]).overlap)


def told_scale(footage: Footage) -> str:
    """What fixes the scale, in words."""
    subject = footage.recording.subject
    known = [f"{name} {value:.2f} m" for name, value in (("height", subject.height), ("distance", subject.distance)) if value]
    return " and ".join(known) or f"average height of {AVERAGE_HEIGHT:.2f} m, assumed"


def _fitted(footage: Footage, masks: list[Mask], seen: Silhouettes, options: Options, rng: np.random.Generator) -> tuple[SizeFit, str]:
    subject, body = footage.recording.subject, options.tracker.body
    known = {"height": subject.height, "distance": subject.distance, "body": body, "settings": options.initialization}
    if options.person is not None:
        person = read_person(options.person, body)
        known["height"] = known["height"] or person.height
        fit = find_person(rng, footage.camera, _few(masks), sizes=person.sizes, **known)
        return replace(fit, curves={}), str(options.person)
    references = _references(footage, seen)
    if references:
        known["body"] = "rounded" if body in WHOLE else body
        fit = fit_references(rng, footage.camera, references, **known)
        _check_postures(footage, references, fit)
        return as_whole(footage.camera, list(references.values()), fit, body) if body in WHOLE else fit, "references"
    return find_person(rng, footage.camera, _few(masks), **known), "proportions, refined on the first seconds"


def _few(masks: list[Mask]) -> list[Mask]:
    """Some of the masks of the first seconds, spread."""
    return [masks[k] for k in np.unique(np.linspace(0, len(masks) - 1, LOOKED_FOR_IN).astype(int))]


def _references(footage: Footage, seen: Silhouettes) -> dict[str, Mask]:
    """Masks of the reference postures; with ready masks those that have one."""
    given = [r for r in footage.recording.references if seen.segmenter is not None or r.mask is not None]
    found = {reference.name: _reference(footage, seen, reference) for reference in given}
    return {name: found[name] for name in POSTURES if name in found}


def _reference(footage: Footage, seen: Silhouettes, reference: Reference) -> Mask:
    path = reference.image if seen.segmenter is not None or reference.mask is None else reference.mask
    images = (image for image, _ in zip(footage.pictures(path, "a reference"), range(LONGEST_REFERENCE)))
    try:
        masks = [seen(Shot(0.0, image, image)) for image in images]
    except SilhouetteError as error:
        raise RecordingError(f"{path}: {error}") from None
    middle = sorted(masks, key=np.count_nonzero)[len(masks) // 2]  # in a film of the posture, whoever walks in is in few frames
    if not may_be_person(middle):
        covers = f"the silhouette covers {100 * middle.mean():.0f} % of the picture"
        found = covers if middle.any() else "the silhouette is empty"
        raise RecordingError(f"{path}: {found}, expected the person in the posture {reference.name} before the background of the "
                             "film; take it again, or remove it: without it, sizes come from proportions")
    return middle


def _check_postures(footage: Footage, masks: Mapping[str, Mask], fit: SizeFit) -> None:
    """Raise `RecordingError` where a reference shows another posture than its name says."""
    paths = {reference.name: reference.image for reference in footage.recording.references}
    for (name, mask), pose in zip(masks.items(), fit.poses):
        if (wrong := wrong_posture(footage.camera, mask, name, fit, pose)) is not None:
            raise RecordingError(f"{paths[name]}: not the posture {name}, it seems: {wrong}; {HOW[name]}; take it again, or remove it")


def wrong_posture(camera: Camera, mask: Mask, name: str, fit: SizeFit, pose: Array) -> str | None:
    """What shows that a reference's mask (H, W) does not have its posture, after the fit with `pose` (D,); None where nothing does."""
    sizes = fit.guess.sizes
    assert isinstance(sizes, CardboxSizes)
    if fit.overlaps[name] < WRONG[name]:
        return f"the body overlaps the silhouette by {fit.overlaps[name]:.2f} only, expected over {DOUBTFUL[name]}"
    if name == "side_arms_hanging":
        deep, wide = (sizes.torso_top_depth + sizes.torso_bottom_depth) / 2, (sizes.shoulder_width + sizes.torso_bottom_width) / 2
        return f"the trunk is {deep:.2f} m deep and {wide:.2f} m wide, expected less depth than width" if deep > DEEP * wide else None
    if sizes.torso_bottom_width > BROAD * fit.guess.height:
        return (f"the trunk is {sizes.torso_bottom_width:.2f} m wide, expected under {BROAD * fit.guess.height:.2f}: the silhouette, "
                f"{100 * mask.mean():.0f} % of the picture, is of more than the person")
    seen = _forearms_seen(camera, mask, fit.guess, pose)
    return f"{100 * seen:.0f} % of the level forearms are in the silhouette, expected nearly all" if seen < SEEN else None


def _forearms_seen(camera: Camera, mask: Mask, guess: PersonEstimate, pose: Array) -> float:
    """Share of the lines from the elbows to the wrists that lies in a mask (H, W), or `BESIDE` it, of what is in the picture; 1 where
    nothing is."""
    import cv2

    mask = cv2.dilate(mask.astype(np.uint8), disc(max(1, round(BESIDE * mask.sum() ** 0.5)))) > 0
    picture = guess.picture(camera)
    pixels = dict(zip(picture.body.landmark_names, camera.project(picture.points_world(pose[None])[0])))
    along = np.linspace(0, 1, 20)[:, None]
    line = np.concatenate([pixels[f"{side}_elbow"] * (1 - along) + pixels[f"{side}_wrist"] * along for side in ("left", "right")])
    x, y = np.rint(line[np.isfinite(line).all(1)]).astype(int).T
    inside = (x >= 0) & (y >= 0) & (x < camera.size[0]) & (y < camera.size[1])
    return float(mask[y[inside], x[inside]].mean()) if inside.any() else 1.0


HOW = {
    "front_t_pose": "face the camera, arms level to the sides, palms down",
    "side_arms_hanging": "turn to show the left or right side, arms down along the body",
    "front_arms_t_pose": "face the camera, arms level to the sides, palms down",
}
"""What each reference shows."""
