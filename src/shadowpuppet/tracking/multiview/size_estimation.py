"""The person's body sizes from the first frames of several cameras, solved together with the poses.

Ni 2008 takes the sizes as known. Here bones come from training motion if there is any, else from the height; then all sizes are refined on
the hulls of the first frames.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Generic, NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.anthropometry import stature_of
from shadowpuppet.body.models import MODELS, shares_of
from shadowpuppet.body.shapes import Body
from shadowpuppet.body.sizes import BoneSizes, Sizes
from shadowpuppet.body.whole_body import heading_column
from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import TrackingError
from shadowpuppet.geometry import Array, evenly_spread
from shadowpuppet.tracking.keypoints.sights import NO_SIGHTS
from shadowpuppet.tracking.multiview.bundle_adjustment import POINT_NOISE, Deviations, Measured, solve_bundle
from shadowpuppet.tracking.multiview.height_estimation import FRAMES, First, FirstFrame, first_frames
from shadowpuppet.tracking.multiview.keypoint_evidence import opening_heading
from shadowpuppet.tracking.multiview.observation import MultiviewObservation, middle_of
from shadowpuppet.tracking.multiview.settings import MultiviewSettings
from shadowpuppet.tracking.multiview.surface.visual_hull import SurfacePoints
from shadowpuppet.tracking.multiview.tracker import MultiviewState, MultiviewTracker
from shadowpuppet.tracking.unexplained import Unexplained

SIZES_FROM_JOINTS = (
    "hip_distance", "hip_drop", "hip_forward", "shoulder_distance", "shoulder_drop", "shoulder_forward", "upper_arm_length",
    "forearm_length", "hand_point", "thigh_length", "shank_length", "trunk_height", "lumbar_height", "thorax_height",
)  # fmt: skip
"""Sizes that follow from the joints of training motion."""
JOINT_DEVIATION = 0.001
"""Their standard deviation (m)."""
SPINE = ("trunk_height", "lumbar_height", "thorax_height")
SPINE_DEVIATION = 0.015
"""Parts of the spine, and the standard deviation (m) by which each may be shorter than in training motion, never longer: the spine bends,
and the distance between the ends of its parts varies within a take of a dancer by 1.3 cm (sd), and by 9 at most (`cmu_joints`)."""
ROUNDS = 2
"""Number of rounds; each tracks the first frames, then solves for the sizes."""
MAX_FRAMES, POINT_STRIDE = 24, 4
"""Largest number of frames that are solved together, and the stride of their points."""
SIZE_PULL = 1e-5
"""Weight of the pull of the poses to the tracked ones."""
OVERLAP_LOSS = 0.06
"""A frame whose agreement is lower than the best by more than this is left out: its pose is wrong."""
CLOTHES = 1.1
"""Widths of dressed people over those of average bodies: silhouettes show clothes and hair. Without it, a body whose legs are bent fits
best if it is drawn 5 to 10 % too large (in made films)."""
STATURE_DEVIATION, GIRTH_DEVIATION = 0.06, 0.15
"""Standard deviations of the stature (m) about one that was estimated, and of the relative girth that all widths share."""
EMPTINESS_SHARE = 0.25
"""Weight of limbs that reach out of the silhouettes while sizes are solved for, over that of the tracker: bones must neither grow into
empty space nor shrink where a chair hides them."""
ALIKE = 1.2
"""Cost of the best pose that faces another way, over that of a pose, up to which the front is doubted and both are measured."""
SAME_FRAME = 0.01
"""Distance (m) of the means of two frames' surface points below which they are taken for the same frame's."""
MIN_FRAMES = 4
"""Smallest number of frames with a person from which sizes are solved."""


class Front(NamedTuple):
    """The front of a person whose silhouettes hardly show it, as those of two cameras never do."""

    heading: float
    """In the first frame in which the person was found, rad."""
    middle: Array
    """Mean of that frame's surface points (3,), world."""
    lead: float
    """Mean cost of the best body that faces another way, with sizes that suit it, over that of the estimate, less 1; infinite if none fits
    the first frame nearly as well."""

    def heading_in(self, surface: SurfacePoints) -> float | None:
        """The heading, rad, if these are that frame's surface points; None of others."""
        here = len(surface.points) > 0 and float(np.linalg.norm(surface.points.mean(0) - self.middle)) < SAME_FRAME
        return self.heading if here else None


Found = tuple[int, MultiviewState]
"""Index of a frame in which the person is found, and the state."""


@dataclass(frozen=True, eq=False)
class SizeEstimate(Generic[Measured]):
    """Sizes measured on the first frames."""

    sizes: Measured
    body: Body
    residual: float
    """Root mean square distance of the surface points to the tangent planes, metres."""
    overlap: float
    """Mean intersection over union of body and silhouettes; NaN without silhouettes."""
    frames: int
    """Frames in which the person was found."""
    pose: Array
    """The last of these frames' pose, of shape (D,)."""
    unexplained: tuple[Unexplained | None, ...] = ()
    """What the silhouettes have beside the body, by camera."""
    front: Front | None = None
    """The front, if a body that faces another way fits nearly as well."""


def size_deviations(sizes: BoneSizes, shown: bool) -> Array:
    """Standard deviations (2, K), metres, of sizes that are smaller and larger than expected, as people's differ; `JOINT_DEVIATION` for
    bones that joints have `shown`, but a bent spine is shorter."""
    shares = shares_of(type(sizes))
    stature = stature_of({name: getattr(sizes, name) for name in ("thigh_length", "shank_length", "upper_arm_length", "forearm_length")})
    larger = [JOINT_DEVIATION if shown and name in SIZES_FROM_JOINTS else shares[name][1] * stature for name in sizes.names()]
    smaller = [SPINE_DEVIATION if shown and name in SPINE else each for name, each in zip(sizes.names(), larger, strict=True)]
    return np.array([smaller, larger])


def shared_deviations(sizes: BoneSizes, cameras: int) -> Array:
    """Deviations (1 or 2, K), metres, that sizes have together about those of an estimated height, as in `solve_bundle`: stature, and with
    three cameras or more girth. With a known height neither: few cameras' hulls are too wide, and girths would grow with them until arms
    vanish in the trunk."""
    values = sizes.to_array()
    girth = GIRTH_DEVIATION * np.where(_is_width(type(sizes)), values, 0.0)
    return np.array([STATURE_DEVIATION / stature_of(dict(zip(sizes.names(), values))) * values, girth])[: 2 if cameras > 2 else 1]


UPRIGHT = ("ankle_height", "shank_length", "thigh_length", "hip_drop", "trunk_height", "lumbar_height", "thorax_height", "neck_length",
           "head_height")  # fmt: skip
"""Sizes one above the other in a person who stands: their sum is the stature."""
STATURE_KNOWN = 0.01
"""Standard deviation (m) of a known height: of shoes and of posture."""


def known_stature(sizes: BoneSizes) -> Array:
    """The sum (1, K) of sizes that a known height tells, for `Deviations.sums`."""
    return np.isin(sizes.names(), UPRIGHT)[None] / STATURE_KNOWN


def dressed(sizes: Measured) -> Measured:
    """The sizes of a person in clothes: widths and depths larger by `CLOTHES`."""
    return widened(sizes, CLOTHES)


def widened(sizes: Measured, factor: float) -> Measured:
    """The sizes with widths and depths multiplied by a factor."""
    return type(sizes).from_array(sizes.to_array() * np.where(_is_width(type(sizes)), factor, 1.0))


def _is_width(kind: type[Sizes]) -> NDArray[np.bool_]:
    """Which sizes (K,) are widths, depths or thicknesses."""
    return np.array([name.endswith(("_width", "_depth", "_thickness")) for name in kind.names()])


def estimate_sizes(rng: np.random.Generator, make: Callable[[Measured], Body], expected: Measured, spread: Array | Deviations,
                   cameras: Sequence[Camera], first: First, settings: MultiviewSettings, library: Array | None = None, looks: int = 0,
                   begin: int = 0, both_fronts: bool = True) -> SizeEstimate[Measured]:
    """Sizes of the person in the `first` frames, `expected` with deviations `spread` as in `solve_bundle`. `looks`: number of frames after
    which what the body does not explain is left out; 0: never. `begin`: frame in which the person is searched for. Raises `TrackingError`
    if no person is found.

    Silhouettes of a person who stands upright hardly distinguish front and back, and those of two cameras four quarters. With
    `both_fronts`, where a body that faces another way fits nearly as well, the person is measured facing that way, too, and what fits best
    is kept; not with cylinders, which have no front. A front of which the frames' keypoints are certain is the front.
    """
    first = first_frames(first)
    plain, prior = replace(settings, method="hybrid", refinement="gauss_newton"), Deviations.of(spread)
    alone = settings.keypoints > 0 and all(mask is None for each in first for mask in each.masks)
    worth = POINT_NOISE**2 / settings.keypoints if alone else MODELS[settings.body].independent_points  # a nat of keypoints counts as one

    def followed(rng: np.random.Generator, sizes: Measured, facing: float | None) -> tuple[MultiviewTracker, list[Found]]:
        tracker = MultiviewTracker(make(sizes), tuple(cameras), plain, None, library, looks=looks)
        return tracker, _followed(rng, tracker, first, begin, facing)

    def measured(rng: np.random.Generator,
                 facing: float | None = None) -> tuple[SizeEstimate[Measured], MultiviewTracker, list[Found]] | None:
        sizes, residual = expected, np.nan
        for _ in range(ROUNDS if (np.asarray(prior.alone) > 0).any() else 0):
            tracker, found = followed(rng, sizes, facing)
            if len(found) < MIN_FRAMES:
                break
            chosen = evenly_spread(len(found), MAX_FRAMES)
            poses = np.array([found[i][1].pose for i in chosen])
            frames = [first[found[i][0]] for i in chosen]
            seen = [MultiviewObservation(tracker.views, each.points, each.masks) for each in frames]
            shown = [tracker.shown(*each, last=pose) for each, pose in zip(frames, poses, strict=True)]
            rays = [(NO_SIGHTS, 0.0) if each is None else each.rays(alone) for each in shown]
            if not (alone or tracker.sees_quarters_alike):  # a landmark is off alike in all frames; two cameras' hull is too wide
                rays = [(sights, nat / len(rays)) for sights, nat in rays]
            clouds = [each.cloud(POINT_STRIDE) for each in seen]
            pulls = [tracker.posture_prior.quadratic(pose, SIZE_PULL, settings.posture) for pose in poses]
            centre, pull = map(np.array, zip(*pulls, strict=True))
            bundle = solve_bundle(make, expected, prior, poses, clouds, settings.surface, pull=pull, centre=centre, first=sizes,
                                  worth=worth, spaces=() if prior.together is None else [each.space for each in seen],
                                  emptiness=EMPTINESS_SHARE * settings.gauss_newton.emptiness,
                                  rays=rays)
            sizes, residual = bundle.sizes, bundle.residual
        tracker, found = followed(rng, sizes, facing)
        if not found:
            return None
        last = found[-1][1]
        return SizeEstimate(sizes, tracker.body, residual, float(np.mean([state.overlap for _, state in found])), len(found), last.pose,
                            last.unexplained), tracker, found

    front = _shown_front(MultiviewTracker(make(expected), tuple(cameras), plain), first, begin)
    best = measured(rng, front)
    if best is None:
        raise TrackingError(f"nobody is found in the first {len(first)} frames' silhouettes: are they a whole person's, in two cameras or "
                            "more at once, and do the cameras agree? `shadowpuppet info` tells")
    other = rng.spawn(1)[0]  # the numbers drawn afterwards do not depend on whether a front is tried
    estimate, tracker, found = best
    about = min(found, key=lambda each: abs(each[0] - begin))
    other_ways = both_fronts and front is None and settings.body != "cylinders"
    ways = _other_fronts(other, tracker, first, *about) if other_ways else []
    turned = [each for facing in ways if (each := measured(other, facing)) is not None]
    if not turned and not tracker.sees_quarters_alike:
        return estimate
    by_cost = sorted((best, *turned), key=lambda each: _mean_cost(each[2]))
    estimate, _, found = by_cost[0]
    lead = _mean_cost(by_cost[1][2]) / _mean_cost(found) - 1 if turned else np.inf
    index, state = found[0]
    return replace(estimate, front=Front(heading_of(estimate.body, state.pose), middle_of(first[index].points), lead))


def _mean_cost(found: Sequence[Found]) -> float:
    return float(np.mean([state.cost for _, state in found]))


def _shown_front(tracker: MultiviewTracker, first: Sequence[FirstFrame], begin: int) -> float | None:
    """The heading (rad) in frame `begin` if the keypoints of the first frames are certain of the front; None if they are not."""
    looks = (tracker.shown(*first[n]) for n in evenly_spread(len(first), FRAMES))  # neighbouring ones are wrong together
    now = tracker.shown(*first[begin])
    return None if now is None else opening_heading([each for each in looks if each is not None], now)


def _other_fronts(rng: np.random.Generator, tracker: MultiviewTracker, first: Sequence[FirstFrame], index: int,
                  state: MultiviewState) -> list[float]:
    """The headings (rad) opposite to that of a state found in frame `index`, or with two cameras a quarter turn from it, in which a body
    fits the frame nearly as well."""
    ways, out = 4 if tracker.sees_quarters_alike else 2, list[float]()
    points, masks, keypoints = first[index]
    for facing in heading_of(tracker.body, state.pose) + 2 * np.pi * np.arange(1, ways) / ways:
        turned = tracker.start(rng, points, masks, facing=float(facing), keypoints=keypoints)
        is_turned = np.cos(heading_of(tracker.body, turned.pose) - facing) > np.cos(np.pi / ways)  # or it has turned back while fitted
        if is_turned and turned.cost <= ALIKE * state.cost:
            out.append(float(facing))
    return out


def heading_of(body: Body, pose: Array) -> float:
    """Heading (rad) of a pose (D,)."""
    return float(pose[heading_column(body.skeleton)])


def _followed(rng: np.random.Generator, tracker: MultiviewTracker, first: First, begin: int, facing: float | None) -> list[Found]:
    """The frames in which the person is found: searched for in the frame `begin`, as facing a heading (rad) or any way, followed from there
    back to the first one and then through all, and searched for again if the agreement falls."""
    state, found, best, frames = None, list[Found](), 0.0, first_frames(first)

    def begun(frame: FirstFrame) -> MultiviewState:
        return tracker.start(rng, frame.points, frame.masks, facing=facing, keypoints=frame.keypoints)

    def stepped(state: MultiviewState | None, frame: FirstFrame) -> MultiviewState:
        return begun(frame) if state is None else tracker.step(rng, state, frame.points, frame.masks, keypoints=frame.keypoints)

    for frame in frames[begin:0:-1]:
        state = stepped(state, frame)
    state = None if state is None else state._replace(velocity=np.zeros_like(state.velocity), unexplained=())
    for n, frame in enumerate(frames):
        state = stepped(state, frame)
        if state.agreement < best - OVERLAP_LOSS and state.status != "absent":
            facing = None if facing is None else heading_of(tracker.body, state.pose)
            again = begun(frame)._replace(unexplained=state.unexplained)
            state = min(state, again, key=lambda each: each.cost)
        best = max(best, state.agreement)
        if state.status in ("tracked", "uncertain"):
            found.append((n, state))
    return [(n, state) for n, state in found if state.agreement > best - OVERLAP_LOSS]
