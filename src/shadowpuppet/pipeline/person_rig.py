"""Fits the person in the films of several cameras, and makes the tracker: sizes from a file, training motion or a height, refined on the
first seconds; a motion prior."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import NamedTuple, Self

import numpy as np

from shadowpuppet.body.anthropometry import AVERAGE_HEIGHT
from shadowpuppet.body.models import WHOLE, average_sizes, make_body
from shadowpuppet.body.sizes import BoneSizes
from shadowpuppet.camera.bits import Bits
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.keypoints import Keypoints, cameras_with_persons
from shadowpuppet.camera.mask import Mask, Seen, may_be_person
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.errors import HARMFUL, NOTED, Finding, SettingsError, choices
from shadowpuppet.geometry import Array
from shadowpuppet.io.motion.motion_files import read_motion
from shadowpuppet.io.person import Person, read_person
from shadowpuppet.motion.motion import BLANK, JointTable, Motion, MotionFrame
from shadowpuppet.pipeline.findings.look import Survey
from shadowpuppet.pipeline.learn_prior import familiar
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.overlay_video import overlay_grid
from shadowpuppet.pipeline.rig import FrameSet
from shadowpuppet.pipeline.subject import Observed, TrackedSubject, TrackerState
from shadowpuppet.silhouette.added import BesideBody
from shadowpuppet.tracking.arm_colours import ColourCounts
from shadowpuppet.tracking.doubt.doubt import Doubt
from shadowpuppet.tracking.doubt.multiview import Before, MultiviewDoubt
from shadowpuppet.tracking.doubt.steps import Trail
from shadowpuppet.tracking.doubt.variance import variance_model
from shadowpuppet.tracking.keypoints.definitions import landmarks_of
from shadowpuppet.tracking.keypoints.stature import height_by_bones
from shadowpuppet.tracking.multiview.bundle_adjustment import Deviations
from shadowpuppet.tracking.multiview.height_estimation import FirstFrame, SeenHeight, estimate_height, is_unlikely
from shadowpuppet.tracking.multiview.settings import MultiviewSettings, for_rate, for_smeared
from shadowpuppet.tracking.multiview.size_estimation import (
    Front,
    dressed,
    estimate_sizes,
    known_stature,
    shared_deviations,
    size_deviations,
)
from shadowpuppet.tracking.multiview.surface.visual_hull import NO_SURFACE, SurfacePoints, VisualHull
from shadowpuppet.tracking.multiview.tracker import MultiviewState, MultiviewTracker
from shadowpuppet.tracking.particle_filter import Particles
from shadowpuppet.tracking.smoothing.likelier_pass import likelier
from shadowpuppet.tracking.status import PER_OVERLAP
from shadowpuppet.tracking.unexplained import Unexplained, left_out, looks_in
from shadowpuppet.video import Image

SURE_OVERLAP = 0.8
"""Overlap below which an estimated height is doubted: of 12 made people those below were 6 to 20 cm off, the others 8 cm at most."""
SURE_FRONT = 0.03
"""Lead of the front's cost (`Front`) below which the front is doubted: in 17 made films it was 4.8 to 73 %, and the front right."""


class HullObservation(NamedTuple):
    """The multiview tracker's observation of one frame set."""

    points: SurfacePoints
    """Surface points of the visual hull."""
    seen: Seen
    people: int
    """Number of cameras in which the silhouette may be a person's, or in which a detector found one if there are no silhouettes."""


@dataclass(frozen=True, eq=False, kw_only=True)
class MultiviewSubject(TrackedSubject[MultiviewState, HullObservation, Before]):
    """A fitted person seen by several cameras, and the tracker."""

    tracker: MultiviewTracker
    hull: VisualHull | None
    """None if keypoints alone are evidence."""
    is_measured: bool = True
    """Whether the sizes are the person's own, not average ones."""
    front: Front | None = None
    """The front, if silhouettes hardly show it: the pose is first searched for about it."""
    silhouettes_alone: bool = False
    """Whether no keypoints tell the front."""
    state_types = (MultiviewState, Particles, Unexplained, ColourCounts, Before, Trail)

    def observe(self, seen: Seen) -> HullObservation:
        """Surface points of the visual hull of the masks, if they are evidence, and what was seen."""
        if self.hull is None:
            return HullObservation(NO_SURFACE, seen, cameras_with_persons(seen.keypoints))
        people = sum(mask is not None and may_be_person(mask) for mask in seen.masks)
        return HullObservation(self.hull.points(seen.masks), seen, people)

    def observations(self, frames: Iterable[FrameSet]) -> Generator[Observed[HullObservation]]:
        """Observations of frame sets; another thread makes the next one while one is tracked."""
        source = super().observations(frames)
        with ThreadPoolExecutor(1, "hull") as thread:
            coming = thread.submit(next, source, None)
            while (observed := coming.result()) is not None:
                coming = thread.submit(next, source, None)
                yield observed

    def next_state(self, rng: np.random.Generator, state: MultiviewState | None, observation: HullObservation) -> MultiviewState | None:
        """The tracker's state after an observation; None while no person is visible.

        After None the first pose is searched for again, once two cameras see a person.
        """
        points, seen, people = observation
        if people == 0 or (state is None and people < min(2, len(self.tracker.cameras))):
            return None
        if state is None:
            found = self.tracker.start(rng, points, seen.masks, facing=None if self.front is None else self.front.heading_in(points),
                                       keypoints=seen.keypoints)
            return found if found.status != "absent" or self.tracker.settings.recover else None
        return self.tracker.step(rng, state, points, seen.masks, codes=seen.codes, keypoints=seen.keypoints)

    def left_out(self, state: MultiviewState | None) -> tuple[Mask | None, ...]:
        """For each camera the pixels (H, W), at half size, that a state leaves out of the silhouettes; None for none."""
        return () if state is None else tuple(map(left_out, state.unexplained))

    def drawn(self, state: TrackerState | MotionFrame | None) -> tuple[Bits, ...]:
        """The body of a state in each camera's picture of half the size; empty if it is lost or absent."""
        if state is None or state.pose is None or state.status in BLANK:
            return ()
        return tuple(picture.draw(np.asarray(state.pose)) for picture in self.tracker.views.pictures)

    @property
    def limits(self) -> Mapping[str, float] | None:
        """See `FittedPerson`: by silhouettes of three cameras or more, whose doubt is calibrated so."""
        return variance_model("multiview").limits if self.silhouettes_alone and not self.tracker.sees_quarters_alike else None

    @property
    def both_ways(self) -> bool:
        """Whether a film is tracked backward, too: two cameras', whose silhouettes allow several fronts."""
        return self.silhouettes_alone and self.tracker.sees_quarters_alike

    def turned_back(self, state: MultiviewState | None) -> Self:
        """See `TrackedSubject`; the person is searched for in the last frame."""
        return replace(self, front=None)

    def blended(self, forward: Motion, backward: Motion) -> tuple[Motion, Array]:
        """See `TrackedSubject`."""
        evidence = PER_OVERLAP / MultiviewSettings().silhouettes * (forward.cost - backward.cost)  # costs differ by overlaps
        return likelier(forward, backward, evidence, self.joints, averaged=False, limits=variance_model("pair").limits)

    def doubt(self, state: MultiviewState, observation: HullObservation, seconds: float, before: Before | None) -> tuple[Doubt, Before]:
        """Doubt about the estimate of a frame set."""
        points, seen, _ = observation
        keypoints = self.tracker.shown(points, seen.masks, seen.keypoints, state.pose)
        return self._doubt(state, points, seen.masks, seconds, before, keypoints)

    @cached_property
    def _doubt(self) -> MultiviewDoubt:
        return MultiviewDoubt(self.tracker)

    def unfound(self, observation: HullObservation) -> str:
        """`lost` if a camera still sees a person, else `absent`."""
        return "lost" if observation.people else "absent"

    def draw(self, frames: FrameSet, found: MotionFrame, last: MotionFrame | None = None) -> Image:
        """A grid of the cameras' images with the model and the silhouettes."""
        return overlay_grid(frames, found, self.pictures, last)

    @cached_property
    def pictures(self) -> list[Picture]:
        """How each camera sees the body."""
        return [Picture(self.body, camera, camera.T_camera_world) for camera in self.tracker.cameras]


def fit_multiview(rng: np.random.Generator, survey: Survey, options: Options) -> MultiviewSubject:
    """Fit the person's sizes to the first seconds, and make the tracker. Raises a `ShadowPuppetError` if no person is found, or a file is
    not usable."""
    rig, recording = survey.rig, survey.rig.recording
    check_body(options)
    smeared = float(np.mean([each.smeared for each in survey.silhouettes])) if survey.silhouettes else 0.0
    options = replace(options, multiview=for_smeared(options.multiview, smeared))
    training = None if recording.training is None else read_motion(recording.training)
    return fit_in_views(rng, rig.cameras, survey.first.masks, options, rig.rate / options.every, recording.subject.height, training,
                        keypoints=survey.first.keypoints)


def fit_in_views(rng: np.random.Generator, cameras: Sequence[Camera], views: Sequence[Sequence[Mask | None]], options: Options,
                 rate: float, height: float | None = None, training: JointTable | None = None,
                 both_fronts: bool = True, keypoints: Sequence[Sequence[Keypoints | None]] = ()) -> MultiviewSubject:
    """Fit the person to `views`, masks by time and camera, and make the tracker for `rate` frames/s; `both_fronts` as in `estimate_sizes`.
    `keypoints`: of the same times and cameras; empty without any. Raises the errors of `fit_multiview`."""
    settings = options.multiview
    hull = VisualHull(cameras, settings.hull) if options.uses_silhouettes else None
    known = familiar(rng, options, training, settings.body, rate)
    first = [FirstFrame(NO_SURFACE if hull is None else hull.points(masks), masks, keypoints[n] if keypoints else ())
             for n, masks in enumerate(views)]
    height, seen, begin = options.height or height, None, 0
    shown = "hulls" if options.uses_silhouettes else "keypoints"
    if options.person is not None:
        sizes, source = read_person(options.person, settings.body).sizes, str(options.person)
        spread = Deviations(np.zeros(len(sizes.names())))
    elif known.sizes is not None:
        sizes, source = known.sizes, f"training motion, and the {shown} of the first seconds"
        spread = Deviations(size_deviations(known.sizes, shown=True))
    else:
        seen = _seen_height(rng, cameras, first, settings) if height is None else None
        tall, begin = (height or AVERAGE_HEIGHT, 0) if seen is None else seen
        sizes = dressed(average_sizes(settings.body, tall))
        scale = "the height" if height else f"an average height of {tall:.2f} m" if seen is None else f"a height of {tall:.2f} m as seen"
        source = f"{scale}, and the {shown} of the first seconds"
        assert isinstance(sizes, BoneSizes)
        spread = Deviations(size_deviations(sizes, shown=False), None if height else shared_deviations(sizes, len(cameras)))
        if len(cameras) == 1:  # which shows proportions only
            spread = Deviations(spread.alone, sums=known_stature(sizes))
    library, looks = known.poses if len(known.poses) else None, 0 if hull is None else looks_in(settings.patience, rate)
    person = estimate_sizes(rng, partial(make_body, settings.body), sizes, spread, cameras, first, settings, library,
                            len(first) // 2 if looks else 0, begin, both_fronts)
    prior = known.prior if settings.method == "hybrid" else None
    fit = {"overlap": round(person.overlap, 3), "residual": person.residual} if options.uses_silhouettes else {}
    summary = {"source": source, **fit, "frames": person.frames,
               "sizes": dict(zip(person.sizes.names(), map(float, person.sizes.to_array()), strict=True))}
    tracker = MultiviewTracker(person.body, tuple(cameras), for_rate(settings, rate), prior, library, looks=looks,
                               carve=hull.points if settings.odd_camera and hull is not None else None, rate=rate)
    return MultiviewSubject(body=person.body, person=Person(person.sizes, height, source), summary=summary, hull=hull, tracker=tracker,
                            doubts=(*_front_doubts(person.front), *(() if seen is None else _doubts(seen.height, person.overlap))),
                            front=person.front, silhouettes_alone=not any(map(any, keypoints)),
                            beside=tuple(_beside(each, picture.mask(person.pose), camera.size)
                                         for each, picture, camera in zip(person.unexplained, tracker.views.pictures, cameras)))


def _seen_height(rng: np.random.Generator, cameras: Sequence[Camera], first: Sequence[FirstFrame],
                 settings: MultiviewSettings) -> SeenHeight | None:
    """The height that silhouettes ask for, or without them the bones between keypoints."""
    made = partial(average_sizes, settings.body)
    if any(mask is not None for each in first for mask in each.masks):
        return estimate_height(rng, lambda tall: make_body(settings.body, dressed(made(tall))), cameras, first, settings)
    body = make_body(settings.body, made(AVERAGE_HEIGHT))
    height = height_by_bones(cameras, [each.keypoints for each in first if any(each.keypoints)], landmarks_of(body))
    return None if height is None else SeenHeight(height, 0)


def _front_doubts(front: Front | None) -> tuple[Finding, ...]:
    """Doubts about which way the person faces."""
    if front is None or front.lead >= SURE_FRONT:
        return ()
    return (Finding.of("which way the person faces is uncertain: facing the other way a body fits the silhouettes about as well "
                       "({percent:.0f} % worse); look at it (--overlay), and if it is turned round, let the film begin with a walk "
                       "or raised arms (--start), or add a camera at the side",
                       "front may be back: look; begin with a walk (--start)", HARMFUL, percent=100 * front.lead),)


def _doubts(height: float, overlap: float) -> tuple[Finding, ...]:
    """Doubts about an estimated height, metres, of a body that overlaps the silhouettes by `overlap`, NaN without any."""
    if is_unlikely(height):
        return (Finding.of("the person's height as seen is {height:.2f} m, more than 99 adults in 100 have: furniture or a shadow makes "
                           "silhouettes larger, or the calibration's scale is wrong; give --height",
                           "a height of {height:.2f} m is unlikely: give --height", HARMFUL, height=height),)
    if np.isnan(overlap) or overlap >= SURE_OVERLAP:
        return ()
    return (Finding.of("the person's height, {height:.2f} m, may be off by 20 cm: the body overlaps the silhouettes by {overlap:.2f} only; "
                       "furniture before the person, or a chair that is not in the empty scene, does that; --height gives the height",
                       "height is uncertain: give --height", NOTED, height=height, overlap=overlap),)


def average_person(rng: np.random.Generator, cameras: Sequence[Camera], options: Options, rate: float, height: float) -> MultiviewSubject:
    """A person of average sizes for a height, metres, as `fit_in_views` makes one who cannot be measured."""
    sizes, source = average_sizes(options.multiview.body, height), "the height alone: not seen apart from other people"
    summary = {"source": source, "sizes": dict(zip(sizes.names(), map(float, sizes.to_array()), strict=True))}
    return known_person(rng, cameras, options, rate, Person(sizes, height, source), summary, is_measured=False)


def known_person(rng: np.random.Generator, cameras: Sequence[Camera], options: Options, rate: float, person: Person,
                 summary: dict[str, object], is_measured: bool) -> MultiviewSubject:
    """A person of known sizes, without training motion, as `fit_in_views` makes one; `summary`: how they were found."""
    settings = options.multiview
    known, hull = familiar(rng, options, None, settings.body, rate), VisualHull(cameras, settings.hull)
    prior = known.prior if settings.method == "hybrid" else None
    tracker = MultiviewTracker(make_body(settings.body, person.sizes), tuple(cameras), for_rate(settings, rate), prior,
                               known.poses if len(known.poses) else None, looks=looks_in(settings.patience, rate), rate=rate)
    return MultiviewSubject(body=tracker.body, person=person, summary=summary, hull=hull, tracker=tracker, is_measured=is_measured)


def _beside(unexplained: Unexplained | None, body: Mask, size: tuple[int, int]) -> BesideBody | None:
    """What is beside a body, drawn at half size (H, W), in masks of a size (width, height); None if nothing is."""
    if unexplained is None or not unexplained.stays.any():
        return None
    return BesideBody(*(mask.repeat(2, 0).repeat(2, 1)[: size[1], : size[0]] for mask in (unexplained.stays, body)))


def check_body(options: Options) -> None:
    """Raise `SettingsError` for a body that several cameras cannot track."""
    if options.body not in (None, options.multiview.body):
        raise SettingsError(f"body: found {options.body!r}, an upper body, for several cameras; expected one of {choices(WHOLE)}, "
                            "or one camera (--camera)")
