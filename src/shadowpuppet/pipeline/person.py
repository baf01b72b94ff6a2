"""Fits the person in the film of one camera: sizes and place from a file, reference pictures, or the film (Liu 2011, Algorithm 1)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np

from shadowpuppet.body.models import WHOLE
from shadowpuppet.body.sizes import CardboxSizes
from shadowpuppet.body.upper_body import TWIST
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.colour_codes import ColourCode
from shadowpuppet.camera.drawing import overlay_frame
from shadowpuppet.camera.keypoints import Keypoints
from shadowpuppet.camera.mask import Mask, Seen, may_be_person
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.errors import HARMFUL, NOTED, RUINOUS, Finding, RecordingError, SilhouetteError, TrackingError
from shadowpuppet.geometry import Array, evenly_spread
from shadowpuppet.io.person import Person, read_person
from shadowpuppet.io.recording import Reference
from shadowpuppet.motion.motion import Motion, MotionFrame
from shadowpuppet.pipeline.findings.look import Look, Survey
from shadowpuppet.pipeline.footage import CameraFrame, Footage
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.progress import FALLBACK_RATE
from shadowpuppet.pipeline.rig import FrameSet
from shadowpuppet.pipeline.silhouettes import Silhouettes
from shadowpuppet.pipeline.subject import TrackedSubject
from shadowpuppet.silhouette.added import BesideBody
from shadowpuppet.silhouette.boundary import disc
from shadowpuppet.tracking.arm_colours import ColourCounts
from shadowpuppet.tracking.doubt.doubt import Doubt
from shadowpuppet.tracking.doubt.limbs import doubtful_names
from shadowpuppet.tracking.doubt.monocular import Before, MonocularDoubt
from shadowpuppet.tracking.monocular.initialization import POSTURES, SizeFit, as_whole, find_person, fit_references
from shadowpuppet.tracking.monocular.settings import MonocularSettings
from shadowpuppet.tracking.monocular.size_search import PersonEstimate
from shadowpuppet.tracking.monocular.tracker import MonocularTracker, State
from shadowpuppet.tracking.particle_filter import Particles
from shadowpuppet.tracking.smoothing.facing import NEAR, about_profile
from shadowpuppet.tracking.smoothing.head_lean import head_lean
from shadowpuppet.tracking.smoothing.likelier_pass import likelier
from shadowpuppet.tracking.status import PER_OVERLAP, UNCERTAIN_OVERLAP
from shadowpuppet.tracking.unexplained import Unexplained, left_out, look_beside, looks_in
from shadowpuppet.video import Image

WRONG = {"front_t_pose": 0.65, "side_arms_hanging": 0.62, "front_arms_t_pose": 0.65}
"""Overlap (intersection over union) of the fitted body and a reference's silhouette below which the reference shows another posture."""
DOUBTFUL = {"front_t_pose": 0.78, "side_arms_hanging": 0.68, "front_arms_t_pose": 0.78}
"""Overlap below which the reference may show another posture. Correct ones have 0.85 to 0.94, from the side 0.72 to 0.89."""
SEEN = 0.6
"""Share of the level forearms inside the silhouette below which the arms were not level: fitted sizes can hide a wrong posture."""
BESIDE = 0.03
"""Distance by which the silhouette is dilated for this test, over the square root of its area: in small pictures one side of an arm may
be missing."""
DEEP = 1.2
"""Ratio of the fitted trunk's depth to its width above which it was not seen from the side; correct ones have 0.75 to 0.82."""
BROAD = 0.33
"""Ratio of the fitted trunk's lower width to the height above which the silhouette contains more than a person. Correct ones have 0.13 to
0.2, the broadest people (ANSUR II; Gordon et al. 2014) 0.27."""
POOR = 0.75
"""Overlap with the film's first silhouette below which the body is in doubt; bodies that fit have 0.85 to 0.95."""
NOBODY = 0.3
"""Overlap with the first silhouette below which it is hardly the person's."""
LONGEST_REFERENCE = 60
"""Greatest number of frames read from a reference's film."""
MOST = 0.75
"""Share of the first masks in which a part that the body does not explain must be."""
LOOKED_FOR_IN, FEWEST_EARLY = 12, 3
"""Number of masks used to fit a person without references, and how many of them at least are of the first seconds."""
ELSEWHERE = 0.25
"""Share of the moments that do not fit the person's place from which that is a doubt."""


class ColouredMask(NamedTuple):
    """One camera's frame."""

    mask: Mask
    """The silhouette (H, W)."""
    codes: ColourCode | None
    """Coarse colours; None: not known."""
    keypoints: Keypoints | None = None
    """What a detector found; None without."""


@dataclass(frozen=True, eq=False, kw_only=True)
class MonocularSubject(TrackedSubject[State, ColouredMask, Before]):
    """A fitted person seen by one camera, and the tracker."""

    fit: SizeFit
    """Sizes and place, and how they were found."""
    tracker: MonocularTracker
    colours: ColourCounts | None = None
    """What is known of the arms' colours before the first frame."""
    state_types = (State, Particles, Unexplained, Before, ColourCounts)

    @classmethod
    def of(cls, fit: SizeFit, camera: Camera, settings: MonocularSettings, source: str, rate: float) -> MonocularSubject:
        """A subject from a fit, for a film of `rate` frames/s; `source`: where the sizes come from, in words."""
        picture = fit.guess.picture(camera, settings.body)
        person = Person(fit.guess.sizes, round(fit.guess.height, 4), source)
        tracker = MonocularTracker(picture, settings, rate=rate, looks=looks_in(settings.patience, rate))
        return cls(body=picture.body, person=person, fit=fit, tracker=tracker, summary={})

    @property
    def both_ways(self) -> bool:
        """Whether a film is tracked backward, too: an upper body's, if the settings say so."""
        return self.tracker.settings.both_ways and self.body.hem is not None

    def blended(self, forward: Motion, backward: Motion) -> tuple[Motion, Array]:
        """See `TrackedSubject`."""
        alone = about_profile(forward) | about_profile(backward)
        evidence = PER_OVERLAP * (backward.overlap - forward.overlap)
        return likelier(forward, backward, evidence, self.joints, averaged=True, alone=alone)

    def beside_in(self, masks: Sequence[Mask]) -> BesideBody | None:
        """What the body leaves unexplained in most of some masks (H, W), in the poses that fit each best; None if nothing is."""
        unexplained, looks = None, max(1, round(MOST * len(masks)))
        pose, whole = None, self.body.hem is None  # coarse legs of a whole body may leave the feet out
        for k, mask in enumerate(masks):
            pose = self.tracker.start(np.random.default_rng(k), mask).pose if whole else self.tracker.search(mask).pose
            legs = self.picture.legs(pose) if self.tracker.settings.ignore_legs else None
            unexplained = look_beside(unexplained, mask, self.picture.mask(pose), looks, legs)
        if pose is None or unexplained is None or not unexplained.stays.any():
            return None
        return BesideBody(unexplained.stays, self.picture.mask(pose) | self.picture.legs(pose))

    @property
    def picture(self) -> Picture:
        """How the camera sees the body."""
        return self.tracker.picture

    def observe(self, seen: Seen) -> ColouredMask:
        """The camera's mask, its colours and keypoints."""
        (mask,) = seen.masks
        assert mask is not None
        return ColouredMask(mask, seen.codes[0] if seen.codes else None, seen.keypoints[0] if seen.keypoints else None)

    def next_state(self, rng: np.random.Generator, state: State | None, observation: ColouredMask) -> State | None:
        """The tracker's state after a mask; None before the first mask that is not empty, and, for a filter that never searches again,
        before the first that shows a person."""
        if state is None:
            if not observation.mask.any():
                return None
            found = self.tracker.start(rng, observation.mask, keypoints=observation.keypoints)._replace(colours=self.colours)
            return found if found.status != "absent" or self.tracker.settings.recover else None
        return self.tracker.step(rng, state, observation.mask, codes=observation.codes, keypoints=observation.keypoints)

    def turned_back(self, state: State | None) -> Self:
        """See `TrackedSubject`; it knows the arms' colours."""
        return self if state is None else replace(self, colours=state.colours)

    def lean(self, found: MotionFrame, masks: Sequence[Mask | None]) -> float:
        """The lean of the head where an upper body is twisted into a profile, else NaN."""
        if found.pose is None or masks[0] is None or TWIST not in self.body.skeleton.dof_names:
            return np.nan
        twist = np.asarray(found.pose)[self.body.skeleton.dof_names.index(TWIST)]
        return head_lean(masks[0]) if abs(twist) > NEAR else np.nan

    def left_out(self, state: State | None) -> tuple[Mask | None, ...]:
        """The pixels (H, W) that a state leaves out of the silhouette; None for none."""
        return (None,) if state is None else (left_out(state.unexplained),)

    def kept(self, state: State | None) -> State | None:
        """A state without its observation."""
        return None if state is None else state._replace(observation=None)

    def doubt(self, state: State, observation: ColouredMask, seconds: float, before: Before | None) -> tuple[Doubt, Before]:
        """Doubt about the estimate of a mask."""
        return self._doubt(state, observation.mask, seconds, before)

    @cached_property
    def _doubt(self) -> MonocularDoubt:
        return MonocularDoubt(self.tracker)

    def landmarks(self, poses: Array) -> Array:
        """Landmarks (N, L, 3) of poses (N, D) in the world, metres."""
        return self.picture.points_world(poses)

    def draw(self, frames: FrameSet, found: MotionFrame, last: MotionFrame | None = None) -> Image:
        """Model, matching result and raw picture, one below the other."""
        image, mask = frames.images[0], self.observe(frames.seen).mask
        assert image is not None
        pose = np.full(len(self.body.skeleton.dofs), np.nan) if found.pose is None else np.asarray(found.pose)
        ignored = mask & self.picture.legs(pose) if found.pose is not None and self.tracker.settings.ignore_legs else None
        (keypoints,) = frames.seen.keypoints or (None,)
        return overlay_frame(image, mask, self.picture, pose, ignore=ignored, doubtful=doubtful_names(self.body, found.limb_status),
                             last=None if last is None else last.pose, keypoints=keypoints)


def fit_monocular(rng: np.random.Generator, survey: Survey, options: Options) -> MonocularSubject:
    """Fit the person's sizes and place, and make the tracker. Raises `TrackingError` if no person is found, `RecordingError` if a reference
    shows another posture, or `FormatError`."""
    for_fit, for_start = rng.spawn(2)
    rate = survey.look.rate if np.isfinite(survey.look.rate) else FALLBACK_RATE
    (footage,), (clean,), masks = survey.rig.footage, survey.clean, [mask for (mask,) in survey.first.masks if mask is not None]
    spread = [mask for (mask,) in survey.first.spread if mask is not None]
    moments = [*_few(masks, max(LOOKED_FOR_IN - len(spread), FEWEST_EARLY)), *spread]
    if not masks:
        raise TrackingError(f"{footage.view.video}: the silhouettes are empty or nearly all of the picture, expected a person in them")
    try:
        fit, source = _fitted(footage, moments, clean, options, for_fit)
    except TrackingError as error:
        raise TrackingError(f"{footage.recording.path}: {error}") from None
    subject = MonocularSubject.of(fit, footage.camera, options.tracker, source, rate / options.every)
    condition = survey.look.condition if isinstance(survey.look, Look) else None
    if condition is not None and condition.blurred and options.every == 1 and options.tracker.motion_blur:
        subject = replace(subject, tracker=replace(subject.tracker, blurred=True))
    start = subject.tracker.start(for_start, masks[0]).overlap
    other = clean.segmenter.key if clean is not survey.silhouettes[0] and clean.segmenter is not None else None
    guess = fit.guess
    summary = {"source": source, "silhouettes": other, "height": float(guess.height), "distance": float(guess.distance),
               "elevation": float(guess.elevation), "overlaps": dict(fit.overlaps), "start_overlap": start,
               "sizes": dict(zip(guess.sizes.names(), guess.sizes.to_array().tolist()))}
    beside = subject.beside_in(_few(masks)) if options.tracker.patience else None
    doubts = _doubts(fit, source, start, len(moments), stays=subject.body.hem is not None)
    return replace(subject, summary=summary, doubts=tuple(doubts), beside=(beside,))


def _doubts(fit: SizeFit, source: str, start: float, moments: int, stays: bool = True) -> list[Finding]:
    """Doubts about a fit, a sentence each; `start`: overlap of the body, in the best pose found, with the film's first silhouette;
    `moments`: number of silhouettes that the person was looked for in; `stays`: whether the body is an upper one, which stays there."""
    doubts = [Finding.of("references: {name}: the fitted body overlaps its silhouette by {overlap:.2f} only: is it the posture {name}, and "
                         "is the silhouette whole? take it again, or remove it", "reference {name} does not fit: take it again", NOTED,
                         name=name, overlap=overlap)
              for name, overlap in fit.overlaps.items() if source == "references" and overlap < DOUBTFUL[name]]
    if fit.place_overlap < UNCERTAIN_OVERLAP:
        doubts.append(Finding.of("at no distance a person who faces the camera overlaps the silhouettes by more than {overlap:.2f}: "
                                 "turned, or hidden in part, they may be a quarter nearer or farther; measure the distance and give "
                                 "--distance",
                                 "distance uncertain: measure it, give --distance", HARMFUL, overlap=fit.place_overlap))
    apart = moments - len(fit.overlaps) if stays and source != "references" else 0
    if apart >= ELSEWHERE * moments:
        doubts.append(Finding.of("in {apart} of {moments} moments of the film the person is at another distance or height than in most: "
                                 "they walk, or sit down; an upper body stays where it was measured, a whole one can sit down (--body "
                                 "anatomical); cut the film with --start and --end", "person changes place: cut with --start, --end",
                                 HARMFUL, apart=apart, moments=moments))
    elif start < NOBODY:
        doubts.append(Finding.of("the body overlaps the film's first silhouette by {overlap:.2f} only: is anybody in the picture then, and "
                                 "does the distance hold? begin where the whole person is seen (--start), give --distance",
                                 "no person fits the first silhouette: give --start or --distance", RUINOUS, overlap=start))
    elif start < POOR:
        doubts.append(Finding.of("the body overlaps the film's first silhouette by {overlap:.2f} only: do height and distance hold, is the "
                                 "silhouette a person's, and does the person face the camera?",
                                 "body fits the first silhouette badly: check height and distance", HARMFUL, overlap=start))
    return doubts


def _fitted(footage: Footage, masks: list[Mask], silhouettes: Silhouettes, options: Options,
            rng: np.random.Generator) -> tuple[SizeFit, str]:
    subject, body = footage.recording.subject, options.tracker.body
    known = {"height": subject.height, "distance": subject.distance, "body": body, "settings": options.initialization}
    if options.person is not None:
        person = read_person(options.person, body)
        known["height"] = known["height"] or person.height
        fit = find_person(rng, footage.camera, masks, sizes=person.sizes, **known)
        return replace(fit, curves={}), str(options.person)
    source = "proportions, refined on moments of the film"
    try:
        if (fit := _by_references(footage, silhouettes, known, rng)) is not None:
            return fit, "references"
    except RecordingError:
        if silhouettes.recovered is None or not silhouettes.recovered.covered.any():
            raise
        source += "; the references' silhouettes need a picture of the empty scene"
    return find_person(rng, footage.camera, masks, **known), source


def _by_references(footage: Footage, silhouettes: Silhouettes, known: dict[str, Any], rng: np.random.Generator) -> SizeFit | None:
    """The fit to the reference postures; None if there are none. Raises `RecordingError` for a silhouette that is not the posture's."""
    references, body = _references(footage, silhouettes), known["body"]
    if not references:
        return None
    known = {**known, "body": "rounded" if body in WHOLE else body}
    fit = fit_references(rng, footage.camera, references, **known)
    _check_postures(footage, references, fit)
    return as_whole(footage.camera, list(references.values()), fit, body) if body in WHOLE else fit


def _few(masks: list[Mask], most: int = LOOKED_FOR_IN) -> list[Mask]:
    """At most `most` of the masks, evenly spread."""
    return [masks[k] for k in evenly_spread(len(masks), most)]


def _references(footage: Footage, silhouettes: Silhouettes) -> dict[str, Mask]:
    """Masks of the reference postures, by name; if ready silhouettes are used, only of references that have a mask."""
    given = [r for r in footage.recording.references if silhouettes.segmenter is not None or r.mask is not None]
    found = {reference.name: _reference(footage, silhouettes, reference) for reference in given}
    return {name: found[name] for name in POSTURES if name in found}


def _reference(footage: Footage, silhouettes: Silhouettes, reference: Reference) -> Mask:
    path = reference.image if silhouettes.segmenter is not None or reference.mask is None else reference.mask
    images = (image for image, _ in zip(footage.pictures(path, "a reference", masks=path is reference.mask), range(LONGEST_REFERENCE)))
    try:
        masks = [silhouettes.elsewhere(CameraFrame(0.0, image, image)) for image in images]
    except SilhouetteError as error:
        raise RecordingError(f"{path}: {error}") from None
    middle = sorted(masks, key=np.count_nonzero)[len(masks) // 2]  # few frames of a film show the person walking in
    if not may_be_person(middle):
        covers = f"the silhouette covers {100 * middle.mean():.0f} % of the picture"
        found = covers if middle.any() else "the silhouette is empty"
        raise RecordingError(f"{path}: {found}, expected the person in the posture {reference.name} before the background of the "
                             "film; take it again, or remove it: without it, sizes come from proportions")
    return middle


def _check_postures(footage: Footage, masks: Mapping[str, Mask], fit: SizeFit) -> None:
    """Raise `RecordingError` if a reference shows another posture than its name says."""
    paths = {reference.name: reference.image for reference in footage.recording.references}
    for (name, mask), pose in zip(masks.items(), fit.poses):
        if (wrong := wrong_posture(footage.camera, mask, name, fit, pose)) is not None:
            raise RecordingError(f"{paths[name]}: not the posture {name}, it seems: {wrong}; {HOW[name]}; take it again, or remove it")


def wrong_posture(camera: Camera, mask: Mask, name: str, fit: SizeFit, pose: Array) -> str | None:
    """Evidence, in words, that a reference's mask (H, W) shows another posture, given the fit with `pose` (D,); None if there is none."""
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
    """Share of the elbow-wrist lines inside a mask (H, W) dilated by `BESIDE`; only points in the picture count, 1 if there are none."""
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
"""How to stand for each reference."""
