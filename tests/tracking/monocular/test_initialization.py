"""Sizes and place from silhouettes that the model itself drew, proportions, and what cannot be used."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from people import BODIES, camera, random_poses

from shadowpuppet.body.anthropometry import AVERAGE_HEIGHT, PROPORTIONS, SOLE, SizePrior, sizes_from_height
from shadowpuppet.body.sizes import SUBSETS, CardboxSizes
from shadowpuppet.camera.bits import unpack
from shadowpuppet.camera.rasterize import Picture, place
from shadowpuppet.errors import TrackingError
from shadowpuppet.pipeline.person import wrong_posture
from shadowpuppet.tracking.monocular.initialization import POSTURES, SizeFit, find_person, fit_references, refine
from shadowpuppet.tracking.monocular.settings import InitializationSettings
from shadowpuppet.tracking.monocular.size_search import LinearBodies, PersonEstimate, SizeSearch
from shadowpuppet.tracking.silhouette_cost import Observation, silhouette_costs

CAMERA = camera((320, 240))
AVERAGE = sizes_from_height(1.78)
SOMEONE = AVERAGE.with_values(
    head_width=1.08 * AVERAGE.head_width, torso_bottom_width=1.1 * AVERAGE.torso_bottom_width,
    torso_bottom_depth=1.2 * AVERAGE.torso_bottom_depth, upper_arm_length=1.05 * AVERAGE.upper_arm_length,
)  # fmt: skip
"""Taller in the arm and stouter than the average."""
TRUE = PersonEstimate(SOMEONE, 1.78, 2.8, 0.15)
QUICK = InitializationSettings(rounds=15, sweeps=2)


def reach(sizes: CardboxSizes) -> float:
    """From the body's middle to the end of a level arm."""
    return sizes.shoulder_width / 2 - sizes.shoulder_inset + sizes.upper_arm_length + sizes.forearm_length


def crown(guess: PersonEstimate) -> float:
    return guess.elevation + guess.sizes.torso_height + guess.sizes.neck_gap + guess.sizes.head_height


def seen(pose: np.ndarray, body: str = "rounded", guess: PersonEstimate = TRUE) -> np.ndarray:
    """The mask of a pose, with legs that begin a little inside the waist."""
    picture = guess.picture(CAMERA, body)
    legs = picture.legs(pose, spread=np.radians(4))
    return picture.mask(pose) | legs | np.roll(legs, -4, axis=0)


@cache
def references(body: str = "rounded") -> dict[str, np.ndarray]:
    skeleton = BODIES[body](SOMEONE).skeleton
    return {name: seen(skeleton.pose(torso_y=0.3 * i, **angles), body) for i, (name, angles) in enumerate(POSTURES.items())}


@cache
def fitted(body: str = "rounded", settings: InitializationSettings = InitializationSettings(), **known: float) -> SizeFit:  # noqa: B008
    return fit_references(np.random.default_rng(0), CAMERA, references(body), body=body, settings=settings, **known)


# Proportions ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("height", [1.0, 1.55, 1.78, 2.1])
def test_sizes_by_proportion_add_up(height):
    """Chin to crown, neck, trunk and waist make the length from crotch to crown; the arms' span is near the height."""
    sizes, stature = sizes_from_height(height), height - SOLE
    assert set(PROPORTIONS) == set(CardboxSizes.names())
    trunk = sizes.head_height + sizes.neck_gap + sizes.torso_height + sizes.waist_height
    assert trunk == pytest.approx(0.52 * stature, rel=0.02)
    assert 2 * reach(sizes) == pytest.approx(1.03 * stature, rel=0.03)
    np.testing.assert_allclose(sizes.to_array() / stature, sizes_from_height(1.7).to_array() / (1.7 - SOLE))


def test_the_prior_is_least_near_its_mean_and_grows_with_every_size():
    prior = SizePrior(1.78)
    at = prior.penalty(prior.mean[None])[0]
    assert at < 0.5  # not zero: proportions of parts and of their sums have different sources
    spread = np.diag([PROPORTIONS[name][1] for name in CardboxSizes.names()])
    for size in prior.mean * (1 + 3 * np.stack([spread, -spread])).reshape(-1, 1, 18):
        assert prior.penalty(size)[0] > at + 4
    stretched = prior.mean * np.array([[1.0], [1.1], [1.3]])
    assert (np.diff(prior.penalty(stretched)) > 0).all()


# Algorithm 1 ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("body", ["rounded", "cardbox"])
def test_sizes_are_found_where_height_and_distance_are_known(body):
    fit = fitted(body, height=1.78, distance=2.8)
    sizes = fit.guess.sizes
    assert fit.guess.distance == 2.8
    assert min(fit.overlaps.values()) > 0.92
    assert crown(fit.guess) == pytest.approx(crown(TRUE), abs=0.015)
    assert reach(sizes) == pytest.approx(reach(SOMEONE), abs=0.015)
    errors = dict(zip(CardboxSizes.names(), sizes.to_array() - SOMEONE.to_array()))
    for name in ("head_width", "head_height", "torso_height", "head_depth", "upper_arm_width", "elbow_width", "hand_width"):
        assert abs(errors[name]) < 0.015, name
    for name in ("torso_bottom_width", "torso_bottom_depth", "waist_width"):
        assert abs(errors[name]) < 0.025, name
    assert np.abs(list(errors.values())).mean() < 0.01
    np.testing.assert_allclose(fit.poses[:, 0], [0, 0.3, 0.6], atol=0.02)


def test_algorithm_1_improves_on_proportions():
    fit = fitted(height=1.78, distance=2.8)
    average = PersonEstimate(sizes_from_height(1.78), 1.78, 2.8, crown(TRUE) - crown(PersonEstimate(sizes_from_height(1.78), 0, 0, 0)))
    costs = [sum(silhouette_costs(view, Observation.without_legs(mask, view, pose), pose[None])[0]
                 for mask, pose in zip(references().values(), fit.poses))
             for view in (fit.guess.picture(CAMERA), average.picture(CAMERA))]  # fmt: skip
    assert costs[0] < 0.7 * costs[1]


def test_distance_alone_gives_the_scale():
    guess = fitted(settings=QUICK, distance=2.8).guess
    assert guess.distance == 2.8
    assert reach(guess.sizes) == pytest.approx(reach(SOMEONE), abs=0.03)
    assert guess.sizes.head_height == pytest.approx(SOMEONE.head_height, abs=0.02)


def test_height_alone_gives_the_scale_in_proportion():
    """A silhouette does not tell a small person near by from a tall one far off: sizes and distance follow the height that is told."""
    small, tall = (fitted(settings=QUICK, height=height).guess for height in (1.6, 1.92))
    assert tall.distance / small.distance == pytest.approx(1.2, rel=0.03)
    for measure in (reach, lambda sizes: sizes.head_height, lambda sizes: sizes.torso_height + sizes.waist_height):
        assert measure(tall.sizes) / measure(small.sizes) == pytest.approx(1.2, rel=0.06)
    right = fitted(settings=QUICK, height=1.78).guess
    assert right.distance == pytest.approx(2.8, rel=0.06)


def test_without_either_the_average_is_taken():
    guess = fitted(settings=QUICK).guess
    assert guess.height == AVERAGE_HEIGHT
    assert guess.distance == pytest.approx(2.8 * AVERAGE_HEIGHT / 1.78, rel=0.08)


def test_each_search_ends_with_its_least_cost_and_keeps_it(monkeypatch):
    """From one search to the next the cost may rise: where the legs are, is looked up again."""
    original, searches = SizeSearch.search, []

    def search(of, rng, columns, pictures, settings, sigma, scale=True):
        observations, before = of.observe(), of.vector
        curve = original(of, rng, columns, pictures, settings, sigma, scale)
        searches.append((curve, *(of.costs(v[None], pictures, observations)[0] for v in (before, of.vector))))
        return curve

    monkeypatch.setattr(SizeSearch, "search", search)
    fit = fit_references(np.random.default_rng(0), CAMERA, references(), height=1.78, distance=2.8, settings=QUICK)
    assert len(searches) == QUICK.sweeps * len(SUBSETS)
    for curve, before, after in searches:
        assert (np.diff(curve) <= 0).all()
        assert len(curve) <= QUICK.rounds
        assert before >= curve[0]
        assert after == pytest.approx(curve[-1])
    for i, subset in enumerate(SUBSETS):
        assert fit.curves[subset] == tuple(tuple(curve) for curve, *_ in searches[i :: len(SUBSETS)])


def test_a_search_stops_when_nothing_is_gained():
    calm = InitializationSettings(tolerance=1.0, patience=3, sweeps=1)
    fit = fit_references(np.random.default_rng(0), CAMERA, references(), height=1.78, distance=2.8, settings=calm)
    assert {len(curve) for curves in fit.curves.values() for curve in curves} == {4}
    eager = InitializationSettings(tolerance=0.0, patience=1, rounds=7, sweeps=1)
    fit = fit_references(np.random.default_rng(0), CAMERA, references(), height=1.78, distance=2.8, settings=eager)
    assert max(len(curve) for curves in fit.curves.values() for curve in curves) <= 7


def test_a_search_ends_where_the_accuracy_is_reached_and_keeps_that_round():
    """Algorithm 1's own end; without it the last round counts, better or worse."""
    wild = InitializationSettings(hypotheses=30, share=1.0, shrink=1.0, prior_weight=0.0, sweeps=1, memory=False, patience=30, rounds=30)
    easy, never = (fit_references(np.random.default_rng(0), CAMERA, references("cardbox"), height=1.78, distance=2.8, body="cardbox",
                                  settings=replace(wild, accuracy=accuracy)) for accuracy in (0.3, 0.0))
    assert [len(curve) for (curve,) in easy.curves.values()] < [len(curve) for (curve,) in never.curves.values()]
    areas = [int(mask.sum()) for mask in references("cardbox").values()]
    assert all(curve[-1] <= 0.3 * area for (curve,), area in zip(easy.curves.values(), areas))


def test_a_known_place_is_held():
    held, free = (fit_references(np.random.default_rng(0), CAMERA, references(), height=1.78, distance=2.8,
                                 settings=replace(QUICK, place=place)) for place in (False, True))
    assert held.guess.distance == 2.8
    assert held.guess.elevation != free.guess.elevation
    again = fit_references(np.random.default_rng(1), CAMERA, references(), height=1.78, distance=2.8, settings=replace(QUICK, place=False))
    assert held.guess.elevation == again.guess.elevation
    np.testing.assert_array_equal(held.poses, again.poses)


def test_sizes_stay_possible_whatever_is_drawn():
    wild = InitializationSettings(sigma=1.0, share=1.0, shrink=1.0, prior_weight=0.0, rounds=10, sweeps=1)
    fit = fit_references(np.random.default_rng(0), CAMERA, references(), distance=2.8, settings=wild)
    sizes = fit.guess.sizes  # CardboxSizes itself refuses what is not positive
    assert min(v for name, v in zip(CardboxSizes.names(), sizes.to_array()) if name not in ("neck_gap", "shoulder_inset")) >= 0.01


@pytest.mark.parametrize("memory", [True, False])
def test_without_memory_a_round_may_end_worse_than_it_began(memory):
    """Of hypotheses that are all wild, each worse than where they began."""
    wild = InitializationSettings(hypotheses=5, sigma=0.4, share=1.0, shrink=1.0, prior_weight=0.0, rounds=4, sweeps=1, memory=memory)
    masks = list(references("cardbox").values())
    poses = np.array([BODIES["cardbox"](SOMEONE).skeleton.pose(torso_y=0.3 * i, **angles) for i, angles in enumerate(POSTURES.values())])
    search = SizeSearch(CAMERA, masks, poses, TRUE, SizePrior(1.78), wild, "cardbox")
    search.search(np.random.default_rng(0), search.columns(CardboxSizes.names()), [0, 1, 2], wild, wild.sigma)
    assert (search.estimate().sizes == SOMEONE) == memory


@pytest.mark.parametrize("names", [["front_t_pose"], ["side_arms_hanging"], ["front_arms_t_pose", "side_arms_hanging"]])
def test_some_references_are_enough_to_begin_with(names):
    few = {name: references()[name] for name in names}
    fit = fit_references(np.random.default_rng(0), CAMERA, few, height=1.78, distance=2.8, settings=QUICK)
    assert list(fit.overlaps) == [name for name in POSTURES if name in names]
    assert min(fit.overlaps.values()) > 0.75
    assert crown(fit.guess) == pytest.approx(crown(TRUE), abs=0.04)


def test_who_stands_at_the_side_is_looked_for_there():
    brief = InitializationSettings(rounds=2, sweeps=1)
    fit = fit_references(np.random.default_rng(0), CAMERA, references(), height=1.78, distance=2.8, settings=brief)
    np.testing.assert_allclose(fit.poses[:, 0], [0, 0.3, 0.6], atol=0.06)


@pytest.mark.parametrize("farther", [-0.5, 0.3, 1.0])
def test_who_is_drawn_farther_away_is_drawn_taller_so_that_the_picture_stays(farther):
    """It would take a search all sizes at once to come from one distance to another."""
    names, masks = list(POSTURES), list(references().values())
    poses = np.array([BODIES["rounded"](SOMEONE).skeleton.pose(torso_y=0.3 * i, **POSTURES[name]) for i, name in enumerate(names)])
    no_prior = InitializationSettings(prior_weight=0.0, posture_weight=0.0)
    of = SizeSearch(CAMERA, masks, poses, TRUE, SizePrior(1.78), no_prior, "rounded")
    here, there = of.vector[None].copy(), of.vector[None].copy()
    there[:, of.columns([], distance=True)[0]] -= farther
    moved = there.copy()
    of.scale_with_distance(moved, of.vector)
    assert moved[0, 0] == pytest.approx(SOMEONE.head_width * (2.8 + farther) / 2.8)
    scaled, left, as_it_was = (of.costs(v, range(3), of.observe())[0] for v in (moved, there, here))
    assert left > as_it_was + 1000
    assert scaled < as_it_was + 0.25 * (left - as_it_was)  # not all: a shoulder's rise has one size


@pytest.mark.parametrize("seed", [0, 1])
def test_who_was_taken_for_small_and_near_becomes_taller_and_farther(seed):
    """The picture is the same for both; only the height that is known tells them apart."""
    share = 1.5 / 1.78
    near = PersonEstimate(CardboxSizes.from_array(SOMEONE.to_array() * share), 1.78, 2.8 * share, 0.15 * share)
    pose = BODIES["rounded"](SOMEONE).skeleton.pose
    poses = np.array([pose(torso_y=0.3 * i * share, **angles) for i, angles in enumerate(POSTURES.values())])
    fit = refine(np.random.default_rng(seed), CAMERA, near, list(references().values()), poses, free_distance=True, settings=QUICK)
    assert fit.guess.distance > near.distance + 0.1
    assert crown(fit.guess) > crown(near) + 0.02


def test_same_seed_same_sizes():
    quick = [fit_references(np.random.default_rng(s), CAMERA, references(), height=1.78, settings=QUICK).guess for s in (0, 0, 1)]
    assert quick[0].sizes == quick[1].sizes
    assert quick[0].distance == quick[1].distance
    assert quick[0].sizes != quick[2].sizes


@pytest.mark.parametrize(("name", "shown"), [
    ("front_t_pose", {}), ("front_t_pose", {"left_shoulder_abduction": 2.6, "right_shoulder_abduction": 2.6}),
    ("front_arms_t_pose", {"left_shoulder_abduction": 0.3, "right_shoulder_abduction": 1.57}),
    ("side_arms_hanging", {"left_shoulder_abduction": 1.57, "right_shoulder_abduction": 1.57}),
])  # fmt: skip
def test_a_wrong_posture_can_be_reported(name, shown):
    """Sizes can hide a wrong posture (arms that hang are no arms): overlap alone does not tell it, `wrong_posture` does."""
    pose = BODIES["rounded"](SOMEONE).skeleton.pose(**shown)
    wrong = references() | {name: seen(pose)}
    misled = fit_references(np.random.default_rng(0), CAMERA, wrong, height=1.78, distance=2.8, settings=QUICK)
    for fit, masks, expected in ((fitted(height=1.78, distance=2.8), references(), False), (misled, wrong, True)):
        k = list(fit.overlaps).index(name)
        assert (wrong_posture(CAMERA, masks[name], name, fit, fit.poses[k]) is not None) == expected


@pytest.mark.parametrize(("names", "said"), [
    ([], "references: found none; the known postures are: front_arms_t_pose, front_t_pose, side_arms_hanging"),
    (["t_pose", "front_t_pose"], "references: found front_t_pose, t_pose; the known postures are"),
])
def test_unknown_postures_are_said_with_those_there_are(names, said):
    with pytest.raises(TrackingError) as error:
        fit_references(np.random.default_rng(0), CAMERA, dict.fromkeys(names, references()["front_t_pose"]), height=1.78)
    assert said in str(error.value)


def test_an_empty_silhouette_is_said_with_its_posture():
    masks = references() | {"side_arms_hanging": np.zeros((240, 320), bool)}
    with pytest.raises(TrackingError, match="references: side_arms_hanging: the silhouette is empty"):
        fit_references(np.random.default_rng(0), CAMERA, masks, height=1.78)


def test_silhouettes_of_everything_are_said_with_their_posture():
    for share in (0.85, 1.0):
        masks = references() | {"front_t_pose": np.broadcast_to(np.arange(240)[:, None] >= (1 - share) * 240, (240, 320))}
        said = f"references: front_t_pose: the silhouette covers {100 * share:.0f} % of the picture, expected a person"
        with pytest.raises(TrackingError, match=said):
            fit_references(np.random.default_rng(0), CAMERA, masks, height=1.78)


@pytest.mark.parametrize("shape", [(120, 160), (320, 240), (240, 320, 3), (240,), ()])
def test_masks_of_another_shape_are_said_with_both(shape):
    wrong = np.ones(shape, bool)
    with pytest.raises(TrackingError) as error:
        fit_references(np.random.default_rng(0), CAMERA, references() | {"side_arms_hanging": wrong})
    assert str(error.value) == f"references: side_arms_hanging: found shape {shape}, expected (240, 320), the camera's rows and columns"
    with pytest.raises(TrackingError, match="mask 1 of the first seconds: found shape"):
        find_person(np.random.default_rng(0), CAMERA, [references()["front_t_pose"], wrong], height=1.78)


@pytest.mark.parametrize(("known", "said"), [
    ({"height": 0}, "height: found 0, expected 0.5 to 2.5 metres"), ({"height": -1.8}, "height: found -1.8, expected 0.5 to 2.5 metres"),
    ({"height": np.float64(18)}, "height: found 18.0, expected 0.5 to 2.5 metres"),
    ({"height": np.int64(180)}, "height: found 180, expected 0.5 to 2.5 metres (180 cm are 1.8)"),
    ({"height": np.nan}, "height: found nan, expected"), ({"height": np.inf}, "height: found inf, expected"),
    ({"height": "tall"}, "height: found 'tall', expected"), ({"height": True}, "height: found True, expected"),
    ({"distance": 0}, "distance: found 0, expected 0.2 to 30 metres"), ({"distance": np.float64(np.nan)}, "distance: found nan, expected"),
    ({"distance": -2.8}, "distance: found -2.8, expected"),
    ({"distance": 280}, "distance: found 280, expected 0.2 to 30 metres (280 cm are 2.8)"),
])  # fmt: skip
def test_heights_and_distances_that_cannot_be_are_said(known, said):
    for attempt in (lambda: fit_references(np.random.default_rng(0), CAMERA, references(), **known),
                    lambda: find_person(np.random.default_rng(0), CAMERA, [references()["front_t_pose"]], **known)):
        with pytest.raises(TrackingError) as error:
            attempt()
        assert str(error.value).startswith(said)


@pytest.mark.parametrize("height", [None, 1.78])
@pytest.mark.parametrize("name", POSTURES)
@pytest.mark.parametrize("distance", [0.25, 18, np.float64(12)])
def test_a_distance_that_does_not_go_with_the_picture_is_said(height, name, distance):
    """Masks are of someone at 2.8 m: at 18 they would be ten metres tall. How near they can be is told by the head and trunk alone."""
    end = r"least 1\.[2-4]" if distance < 1 else r"most [2-3]\.\d"
    said = rf"distance: found {distance:g} metres, expected at {end}, by how large a person of 1\.7\d m is in {name}"
    with pytest.raises(TrackingError, match=said):
        fit_references(np.random.default_rng(0), CAMERA, {name: references()[name]}, height=height, distance=distance)


@pytest.mark.parametrize("name", POSTURES)
def test_a_line_across_the_picture_is_not_taken_for_the_person_s_size(name):
    """As where a floor ends, which a picture shows sharper than the film of the empty scene."""
    mask = references()[name].copy()
    mask[:, 20:22] |= name == "side_arms_hanging"
    mask[50:52] |= name != "side_arms_hanging"
    brief = InitializationSettings(rounds=1, sweeps=1)
    assert fit_references(np.random.default_rng(0), CAMERA, {name: mask}, distance=4.0, settings=brief).guess.distance == 4.0


# Legs -----------------------------------------------------------------------------------------------------------------


def standing(gap: slice | None = None, feet: int = 240, width: int = 24) -> np.ndarray:
    """The mask of someone whose legs reach down to the row `feet`, with a gap between them in some rows."""
    pose = BODIES["rounded"](SOMEONE).skeleton.pose(**POSTURES["front_t_pose"])
    view = TRUE.picture(CAMERA)
    mask = view.mask(pose) | view.legs(pose, spread=0.0) | np.roll(view.legs(pose, spread=0.0), -4, axis=0)
    mask[feet:] = False
    middle = round(float(np.flatnonzero(view.legs(pose, spread=0.0)[-1]).mean()))
    if gap is not None:
        mask[gap, middle - width // 2 : middle + width // 2] = False
    return mask


def counted(mask: np.ndarray) -> np.ndarray:
    """Rows in which the middle of the silhouette counts."""
    pose = BODIES["rounded"](SOMEONE).skeleton.pose(**POSTURES["front_t_pose"])[None]
    of = SizeSearch(CAMERA, [mask], pose, TRUE, SizePrior(1.78), QUICK, "rounded")
    middle = round(float(np.flatnonzero(TRUE.picture(CAMERA).legs(pose[0], spread=0.0)[-1]).mean()))
    ignored = unpack(of.observe()[0].ignore, 320)
    return np.flatnonzero(mask[:, middle] & ~ignored[:, middle])


HEM = int(np.flatnonzero(TRUE.picture(CAMERA).legs(np.zeros(12)).any(1))[0])
CROTCH = HEM + 9


def test_the_waist_ends_at_a_crotch_that_is_seen():
    assert counted(standing(slice(CROTCH, 240)))[-1] == CROTCH - 1
    assert counted(standing(slice(CROTCH, CROTCH + 6)))[-1] == CROTCH - 1  # the knees touch: they say nothing


@pytest.mark.parametrize("mask", [
    standing(), standing(slice(CROTCH, CROTCH + 1)), standing(slice(CROTCH, CROTCH + 2)), standing(feet=HEM + 20),
    standing(slice(CROTCH, 240), width=4),
], ids=["no gap", "one row of noise", "two rows of noise", "nothing under the feet", "a gap too narrow for the middle"])  # fmt: skip
def test_what_is_no_gap_between_legs_shows_no_crotch(mask):
    assert counted(mask)[-1] == HEM - 1


# Without references ---------------------------------------------------------------------------------------------------


def moving() -> tuple[np.ndarray, list[np.ndarray]]:
    """Someone with bent arms, poses (4, D) and masks."""
    skeleton = BODIES["rounded"](SOMEONE).skeleton
    poses = np.array([skeleton.pose(torso_y=0.2, left_shoulder_abduction=a, left_elbow_roll=1.5, left_elbow_flexion=b,
                                    right_shoulder_abduction=1.6 - a, right_elbow_flexion=0.2)
                      for a, b in ((0.4, 0.3), (0.9, 0.8), (1.4, 1.2), (1.2, 0.4))])  # fmt: skip
    return poses, [seen(pose) for pose in poses]


@pytest.mark.parametrize("seed", range(3))
def test_clutter_beside_the_head_does_not_lead_the_search_astray(seed):
    """As where a sharp picture shows more of a thing's edges than the film of the empty scene."""
    seen = {name: mask.copy() for name, mask in references().items()}
    for name in ("front_t_pose", "front_arms_t_pose"):
        crown = np.flatnonzero(seen[name].any(1))[0]
        for row in (crown, crown + 20):
            seen[name][row : row + 2, 20:70] = True
        seen[name][crown : crown + 40, 68:70] = True
    fit = fit_references(np.random.default_rng(seed), CAMERA, seen, height=1.78, distance=2.8, settings=QUICK)
    assert min(fit.overlaps.values()) > 0.85
    clean = fitted(settings=QUICK, height=1.78, distance=2.8).guess.sizes
    np.testing.assert_allclose(fit.guess.sizes.to_array(), clean.to_array(), atol=0.1)


def test_someone_is_found_without_references():
    poses, masks = moving()
    fit = find_person(np.random.default_rng(0), CAMERA, masks, height=1.78, distance=2.8, settings=QUICK)
    assert min(fit.overlaps.values()) > 0.85
    assert crown(fit.guess) == pytest.approx(crown(TRUE), abs=0.03)
    np.testing.assert_allclose(fit.poses[:, 0], poses[:, 0], atol=0.04)
    assert fit.guess.distance == 2.8


def test_sizes_that_are_known_are_kept():
    masks = moving()[1]
    fit = find_person(np.random.default_rng(0), CAMERA, masks, distance=2.8, sizes=SOMEONE, settings=QUICK)
    np.testing.assert_allclose(fit.guess.sizes.to_array(), SOMEONE.to_array(), atol=1e-12)
    assert crown(fit.guess) == pytest.approx(crown(TRUE), abs=0.03)


def test_the_distance_of_someone_of_known_sizes_is_found():
    small = moving()[1][1][::2, ::2]
    fit = find_person(np.random.default_rng(0), camera((160, 120)), [small], sizes=SOMEONE, settings=QUICK)
    assert fit.guess.distance == pytest.approx(2.8, rel=0.08)


def test_empty_masks_are_left_out_and_nobody_at_all_is_said():
    masks = moving()[1][:2]
    nothing = np.zeros_like(masks[0])
    known = {"height": 1.78, "distance": 2.8, "settings": QUICK}
    with_gaps = find_person(np.random.default_rng(0), CAMERA, [nothing, *masks, nothing], **known)
    assert with_gaps.guess.sizes == find_person(np.random.default_rng(0), CAMERA, masks, **known).guess.sizes
    for masks in ([], [nothing, nothing], [~nothing]):
        with pytest.raises(TrackingError, match="nobody is found"):
            find_person(np.random.default_rng(0), CAMERA, masks, **known)


def test_refining_does_not_spoil_what_is_right():
    poses, masks = moving()
    fit = refine(np.random.default_rng(0), CAMERA, TRUE, masks, poses, settings=QUICK)
    assert min(fit.overlaps.values()) > 0.9
    np.testing.assert_allclose(fit.guess.sizes.to_array(), SOMEONE.to_array(), atol=0.05)
    assert np.abs(fit.poses - poses)[:, [0, 4, 8]].max() < 0.25


# Many people at once --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("body", BODIES)
def test_costs_of_many_sizes_are_those_of_bodies_built_one_by_one(body, rng):
    many = SOMEONE.to_array() * rng.uniform(0.8, 1.2, (6, 18))
    poses = random_poses(rng, BODIES[body](SOMEONE).skeleton, 6)
    shift = rng.uniform(-0.1, 0.1, (6, 2))
    mask = TRUE.picture(CAMERA, body).mask(poses[0])
    ignore = rng.random(mask.shape) < 0.1
    root = place(CAMERA, 2.8, 0.15)
    found = LinearBodies(body).costs(CAMERA, root, Observation.of(mask, ignore), poses, many, shift)
    for n, sizes in enumerate(many):
        at = place(CAMERA, 2.8 - shift[n, 0], 0.15 + shift[n, 1])
        alone = Picture(BODIES[body](CardboxSizes.from_array(sizes)), CAMERA, at)
        assert abs(found[n] - silhouette_costs(alone, Observation.of(mask, ignore), poses[n : n + 1])[0]) <= 2


# Where a search begins, and how it narrows -----------------------------------------------------------------------------

BRIEF = InitializationSettings(hypotheses=2, rounds=1, sweeps=1)
"""Hardly any search: what comes back is where it began."""


def test_with_a_distance_alone_people_of_all_heights_are_tried():
    child = PersonEstimate(sizes_from_height(1.2), 1.2, 2.0, -0.2)
    mask = seen(BODIES["rounded"](child.sizes).skeleton.pose(left_shoulder_abduction=0.3, right_shoulder_abduction=0.2), guess=child)
    found = find_person(np.random.default_rng(0), CAMERA, [mask], distance=2.0, settings=BRIEF).guess
    assert found.distance == 2.0
    assert found.height == pytest.approx(1.2, abs=0.1)


def test_arms_over_the_head_are_not_taken_for_the_head():
    pose = BODIES["rounded"](SOMEONE).skeleton.pose(left_shoulder_abduction=2.4, right_shoulder_abduction=2.4)
    mask = seen(pose)
    found = find_person(np.random.default_rng(0), CAMERA, [mask], height=1.78, distance=2.8, settings=BRIEF)
    assert crown(found.guess) == pytest.approx(crown(TRUE), abs=0.08)
    assert min(found.overlaps.values()) > 0.6


def test_each_sweep_halves_the_noise_and_frees_the_arms_after_the_first(monkeypatch):
    asked = []

    def search(self, rng, columns, pictures, settings, sigma, scale=True):
        asked.append((pictures[0], len(columns), sigma))
        return [1.0]

    monkeypatch.setattr(SizeSearch, "search", search)
    settings = InitializationSettings(sigma=0.08, sweeps=3)
    fit_references(np.random.default_rng(0), CAMERA, references(), height=1.78, distance=2.8, settings=settings)
    o1, o2, o3 = (len(sizes) + 2 for sizes in SUBSETS.values())  # and up, and the place to the side
    sizes = [[o1, o2, o3]] + 2 * [[o1 + len(SUBSETS["O3"]), o2, o3]]
    assert asked == [(k, sizes[sweep][k], 0.08 / 2**sweep) for sweep in range(3) for k in range(3)]


def test_a_search_s_noise_shrinks_from_round_to_round(monkeypatch):
    drawn = []
    poses = np.array([BODIES["rounded"](SOMEONE).skeleton.pose(**POSTURES["front_t_pose"])])
    settings = InitializationSettings(hypotheses=2000, share=1.0, shrink=0.5, rounds=4, prior_weight=0.0)
    search = SizeSearch(CAMERA, [references()["front_t_pose"]], poses, TRUE, SizePrior(1.78), settings, "rounded")
    monkeypatch.setattr(search, "costs", lambda vectors, *_: (drawn.append(vectors), np.arange(len(vectors), dtype=float))[1])
    columns = search.columns(["torso_height", "waist_height"])
    search.search(np.random.default_rng(0), columns, [0], settings, 0.02, scale=False)
    np.testing.assert_allclose([vectors[1:, columns].std(0).mean() for vectors in drawn], 0.02 * 0.5 ** np.arange(4), rtol=0.05)
    others = np.setdiff1d(np.arange(drawn[0].shape[1]), columns)
    assert all((vectors[:, others] == vectors[:1, others]).all() for vectors in drawn)
