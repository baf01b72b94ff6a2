"""A person's sizes and place from silhouettes: in known postures (Liu 2011, Algorithm 1), or in any posture by body proportions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from shadowpuppet.body.anthropometry import AVERAGE_HEIGHT, SOLE, SizePrior, sizes_from_height, stature_of
from shadowpuppet.body.models import WHOLE, Make, make_body
from shadowpuppet.body.sizes import DISTANCES, HEIGHTS, SUBSETS, BoneSizes, CardboxSizes, Sizes, expected_metres, is_within
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import NEARLY_ALL, Mask, check_mask, may_be_person
from shadowpuppet.camera.rasterize import place
from shadowpuppet.errors import TrackingError, choices, shown
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.monocular.place_search import find_place
from shadowpuppet.tracking.monocular.pose_search import align_sideways, search_turned
from shadowpuppet.tracking.monocular.settings import InitializationSettings
from shadowpuppet.tracking.monocular.size_search import PersonEstimate, SizeSearch
from shadowpuppet.tracking.monocular.whole_body import whole_from_estimate

POSTURES: Mapping[str, Mapping[str, float]] = {
    "front_t_pose": {"left_shoulder_abduction": np.pi / 2, "right_shoulder_abduction": np.pi / 2},
    "side_arms_hanging": {"torso_twist": np.pi / 2},
    "front_arms_t_pose": {"left_shoulder_abduction": np.pi / 2, "right_shoulder_abduction": np.pi / 2},
}
"""The known postures d_ref of the reference pictures, for O1, O2 and O3 in this order."""
POSTURE_OF = dict(zip(SUBSETS, POSTURES, strict=True))
"""The posture in which each subset of sizes is fitted."""
THINNEST_ROW = 1 / 60
"""Smallest number of pixels in a person's row or column, as a share of the picture's height; specks and lines have fewer."""
MIN_DISTANCE_RATIO, MAX_DISTANCE_RATIO = 0.3, 2.0
"""Range of plausible given distances, relative to the distance at which the upper body (minimum), or the whole person or level arms
(maximum), would have the size seen in the reference. It is wide, as arms may hang and parts of the person be outside the picture."""


@dataclass(frozen=True, eq=False)
class SizeFit:
    """Result of fitting a person to pictures."""

    guess: PersonEstimate
    curves: Mapping[str, tuple[tuple[float, ...], ...]]
    """For each subset of sizes and each of its searches, the least cost (pixels) after every round."""
    overlaps: Mapping[str, float]
    """For each picture, intersection over union of the drawn body and the silhouette, without legs."""
    poses: Array
    """Poses (K, D) in the pictures."""
    place_overlap: float = np.nan
    """Overlap of coarse poses with the pictures (`place_search.Place`), if the distance was searched for; else not a number."""


def fit_references(rng: np.random.Generator, camera: Camera, references: Mapping[str, Mask], *, height: float | None = None,
                   distance: float | None = None, body: str | Make = "rounded", settings: InitializationSettings | None = None) -> SizeFit:
    """Algorithm 1: sizes from masks (H, W) of a person in the known postures `POSTURES`.

    Height (m, shoes on) or distance (m) fixes the scale; without either the average height is assumed. The person may stand anywhere
    sideways: the torso's place is found with the sizes. Raises `TrackingError` for an unknown posture, a mask that is not of the
    camera's size, is empty or nearly all of the picture, or an impossible height or distance.
    """
    settings = settings or InitializationSettings()
    _check_scale(height, distance)
    checked = _checked(camera, references)
    names, masks = list(checked), list(checked.values())
    initial = _initial_estimate(camera, names[0], masks[0], height, distance)
    skeleton = make_body("cardbox", initial.sizes).skeleton
    poses = np.array([skeleton.pose(**POSTURES[name]) for name in names])
    picture = initial.picture(camera, body)
    poses = np.array([align_sideways(picture, mask, pose) for mask, pose in zip(masks, poses, strict=True)])
    side = skeleton.dof_indices(["torso_y"])
    search = SizeSearch(camera, masks, poses, initial, SizePrior(initial.height), settings, body)
    curves: dict[str, list[tuple[float, ...]]] = {}
    for sweep in range(settings.sweeps):
        for subset, sizes in SUBSETS.items():
            view = POSTURE_OF[subset]
            if view not in names and subset == "O3":
                view = "front_t_pose"  # both show the same shape
            if view not in names:
                continue
            k = names.index(view)
            free = [*sizes, *(SUBSETS["O3"] if subset == "O1" and sweep else ())]
            columns = search.columns(free, distance=distance is None and subset != "O2", height=settings.place)
            if settings.place:
                columns = np.concatenate([columns, search.pose_columns(k, side)])
            curve = search.search(rng, columns, [k], settings, settings.sigma / 2**sweep)
            curves.setdefault(subset, []).append(tuple(curve))
    return _fit(search, names, curves)


def find_person(rng: np.random.Generator, camera: Camera, masks: Sequence[Mask], *, height: float | None = None,
                distance: float | None = None, sizes: Sizes | None = None, body: str | Make = "rounded",
                settings: InitializationSettings | None = None) -> SizeFit:
    """Place and sizes without references, from masks (H, W) of some moments in any posture.

    Initial sizes are the average person's for the height (m, shoes on), or those given; the place is the one that fits most of the masks
    (`find_place`); then poses and sizes, or the place of a person of given sizes, are fitted to the masks that it fits. `body`: a name, or
    a function of `CardboxSizes`. Raises `TrackingError` if no mask shows a person or one is not of the camera's size, or for an impossible
    height or distance.
    """
    settings = settings or InitializationSettings()
    if isinstance(body, str) and body in WHOLE:
        return _find_whole(rng, camera, masks, height, distance, sizes, body, settings)
    assert sizes is None or isinstance(sizes, CardboxSizes)
    _check_scale(height, distance)
    checked = [check_mask(mask, camera.size, f"mask {k} of the first seconds") for k, mask in enumerate(masks)]
    usable = [mask for mask in checked if may_be_person(mask)]
    if not usable:
        raise TrackingError("nobody is found: the silhouettes of the first seconds are empty, or nearly all of the picture")
    initial, fits, overlap = find_place(camera, usable, height, distance, sizes, body)
    usable = [mask for mask, well in zip(usable, fits, strict=True) if well]
    poses = np.array([search_turned(initial.picture(camera, body), mask).pose for mask in usable])
    free = distance is None and sizes is not None
    fit = refine(rng, camera, initial, usable, poses, free_sizes=sizes is None, free_distance=free, body=body, settings=settings)
    return replace(fit, place_overlap=overlap if distance is None else np.nan)


def _find_whole(rng: np.random.Generator, camera: Camera, masks: Sequence[Mask], height: float | None, distance: float | None,
                sizes: Sizes | None, body: str, settings: InitializationSettings) -> SizeFit:
    """`find_person` for a whole body: the upper body is fitted first, since the legs may be outside the picture."""
    assert sizes is None or isinstance(sizes, BoneSizes)
    if height is None and sizes is not None:
        height = stature_of(dict(zip(sizes.names(), sizes.to_array().tolist()))) + SOLE
    fit = find_person(rng, camera, masks, height=height, distance=distance, settings=settings)
    return as_whole(camera, list(filter(may_be_person, masks)), fit, body, sizes, distance, standing=False)


def as_whole(camera: Camera, masks: Sequence[Mask], fit: SizeFit, body: str, sizes: BoneSizes | None = None,
             distance: float | None = None, standing: bool = True) -> SizeFit:
    """The fit of an upper body converted to that of a whole one, with new poses, and new sizes and distance (m) unless given; arguments as
    in `whole_from_estimate`. Overlaps stay the upper body's: they show how well the person was measured."""
    guess = whole_from_estimate(camera, masks, fit.guess, body, sizes, distance, standing)
    picture = guess.picture(camera, body)
    return replace(fit, guess=guess, poses=np.array([search_turned(picture, mask).pose for mask in masks]))


def refine(rng: np.random.Generator, camera: Camera, initial: PersonEstimate, masks: Sequence[Mask], poses: Array, *,
           free_sizes: bool = True, free_distance: bool = False, body: str | Make = "rounded",
           settings: InitializationSettings | None = None) -> SizeFit:
    """Sizes, place and poses fitted to masks (H, W) in turn, from initial poses (K, D). Bent arms separate sizes that straight arms do
    not (shoulder, upper arm, forearm)."""
    settings = settings or InitializationSettings()
    search = SizeSearch(camera, masks, np.array(poses, float), initial, SizePrior(initial.height), settings, body)
    pictures, dofs = range(len(masks)), np.arange(poses.shape[1])
    columns = search.columns(CardboxSizes.names() if free_sizes else (), distance=free_distance)
    curves: list[tuple[float, ...]] = []
    for sweep in range(settings.sweeps):
        for k in pictures:
            search.search(rng, search.pose_columns(k, dofs), [k], settings, 0.2 / 2**sweep)
        curves.append(tuple(search.search(rng, columns, pictures, settings, settings.sigma / 2**sweep, scale=free_sizes)))
    return _fit(search, [str(k) for k in pictures], {"all": curves})


def _fit(search: SizeSearch, names: Sequence[str], curves: Mapping[str, list[tuple[float, ...]]]) -> SizeFit:
    """The result of a search so far."""
    overlaps = dict(zip(names, search.overlaps(), strict=True))
    return SizeFit(search.estimate(), {subset: tuple(each) for subset, each in curves.items()}, overlaps, search.poses().copy())


def _check_scale(height: float | None, distance: float | None) -> None:
    """Raise `TrackingError` for an impossible height or distance."""
    for name, value, limits in (("height", height, HEIGHTS), ("distance", distance, DISTANCES)):
        if value is not None and not is_within(value, limits):
            raise TrackingError(f"{name}: found {shown(value)}, {expected_metres(value, limits)}")


def _checked(camera: Camera, references: Mapping[str, Mask]) -> dict[str, Mask]:
    """The masks in the order of `POSTURES`. Raises `TrackingError` for one that cannot be used."""
    if not references or set(references) - set(POSTURES):
        raise TrackingError(f"references: found {choices(references)}; the known postures are: {choices(POSTURES)}")
    masks = {name: check_mask(references[name], camera.size, f"references: {name}") for name in POSTURES if name in references}
    for name, mask in masks.items():
        if not mask.any():
            raise TrackingError(f"references: {name}: the silhouette is empty")
        if not may_be_person(mask):
            raise TrackingError(f"references: {name}: the silhouette covers {100 * mask.mean():.0f} % of the picture, expected a "
                                f"person before the background, under {100 * NEARLY_ALL:.0f} %")
    return masks


def _span(sizes: CardboxSizes) -> float:
    """Distance between the hands' ends with level arms, metres."""
    return 2 * (sizes.shoulder_width / 2 - sizes.shoulder_inset + sizes.upper_arm_length + sizes.forearm_length)


def _upper(sizes: CardboxSizes) -> float:
    """Height of the crown above the waist's lower edge, metres."""
    return sizes.torso_height + sizes.head_height + sizes.neck_gap + sizes.waist_height


def _check_distance(distance: float, tall: float, focal: float, name: str, mask: Mask) -> None:
    """Raise `TrackingError` if a person of stature `tall` (m) at a distance (m) cannot have the size of the mask of the posture `name`."""
    thick = max(round(THINNEST_ROW * len(mask)), 2)
    along = (np.flatnonzero(counts >= min(thick, counts.max())) for counts in (mask.sum(0), mask.sum(1)))
    wide, high = (max(int(found[-1] - found[0]), 1) for found in along)
    sizes = sizes_from_height(tall)
    least = focal * _upper(sizes) / high
    most = focal * tall / high if name == "side_arms_hanging" else focal * _span(sizes) / wide
    too_near, too_far = distance < MIN_DISTANCE_RATIO * least, distance > MAX_DISTANCE_RATIO * most
    for end, wrong in ((f"least {least:.1f}", too_near), (f"most {most:.1f}", too_far)):
        if wrong:
            raise TrackingError(f"distance: found {distance:g} metres, expected at {end}, by how large a person of {tall:.2f} m is in "
                                f"{name}")


def _initial_estimate(camera: Camera, name: str, mask: Mask, height: float | None, distance: float | None) -> PersonEstimate:
    """Sizes from the height, and the place that puts the crown of such a body at that of the mask of the posture `name`. Raises
    `TrackingError` for a distance that contradicts the size in the mask."""
    rows, columns = np.flatnonzero(mask.any(1)), np.flatnonzero(mask.any(0))
    focal, tall, aside = camera.matrix[0, 0], height or AVERAGE_HEIGHT, name == "side_arms_hanging"
    if distance is not None:
        _check_distance(distance, tall, focal, name, mask)
    sizes = sizes_from_height(tall)
    extent, measure = (rows[-1] - rows[0], _upper(sizes)) if aside else (columns[-1] - columns[0], _span(sizes))
    if distance is not None and height is None:
        tall *= distance * extent / focal / measure
        sizes = sizes_from_height(tall)
    far = distance if distance is not None else focal * measure / max(extent, 1)
    down = camera.rays(np.array([columns.mean(), rows[0]], float))
    up = place(camera, 0.0, 0.0)[:3, 2]
    crown = down / abs(down[2]) * far
    elevation = float(crown @ up) - (sizes.torso_height + sizes.neck_gap + sizes.head_height)
    return PersonEstimate(sizes, tall, far, elevation)
