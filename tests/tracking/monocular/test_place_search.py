"""Where a person is: the place that fits most moments, silhouettes that leave nothing to explain, and the distance between tried ones."""

from __future__ import annotations

import numpy as np
import pytest
from people import BODIES, camera

from shadowpuppet.body.anthropometry import sizes_from_height
from shadowpuppet.tracking.monocular.place_search import CLOTHED, PLATEAU, RATIO, _middle, find_place
from shadowpuppet.tracking.monocular.size_search import PersonEstimate

CAMERA = camera((160, 120))
SIZES = sizes_from_height(1.75)
ARMS = ((0.3, 0.4), (1.4, 0.6), (0.5, 2.0), (1.5, 1.5), (0.2, 1.0))


def seen(arms: tuple[float, float], distance: float = 2.2, elevation: float = -0.35, spread: float = 8.0) -> np.ndarray:
    """The mask of a person of average sizes with raised arms, and with legs."""
    picture = PersonEstimate(SIZES, 1.75, distance, elevation).picture(CAMERA)
    left, right = arms
    pose = BODIES["rounded"](SIZES).skeleton.pose(left_shoulder_abduction=left, right_shoulder_abduction=right)
    return picture.mask(pose) | picture.legs(pose, spread=np.radians(spread))


def test_a_person_of_known_sizes_is_found_at_their_place():
    found, fits, _ = find_place(CAMERA, [seen(arms) for arms in ARMS], None, None, SIZES)
    assert found.distance == pytest.approx(2.2, rel=0.07)
    assert found.elevation == pytest.approx(-0.35, abs=0.1)
    assert found.sizes is SIZES
    assert fits == [True] * len(ARMS)
    assert find_place(CAMERA, [seen(arms) for arms in ARMS], None, None, SIZES).overlap > 0.75


def test_the_clothes_of_a_person_of_unknown_sizes_are_allowed_for():
    """Bodies without clothes, drawn by the model, are thus found too far away by the clothes; the fit never ends far off, where legs would
    explain all of the silhouette."""
    found, *_ = find_place(CAMERA, [seen(arms) for arms in ARMS], 1.75, None, None)
    assert found.distance == pytest.approx(2.2 / CLOTHED, rel=0.07)


def test_a_small_body_far_away_does_not_win_by_explaining_nothing():
    masks = [seen(arms, spread=24.0) for arms in ARMS]  # most of the silhouette is where legs may be
    assert find_place(CAMERA, masks, 1.75, None, None)[0].distance < 3.2


def test_the_place_of_most_moments_counts():
    """Whoever stands first and then sits down is measured where they sit."""
    standing = [seen(arms, elevation=0.1) for arms in ARMS[:2]]
    sitting = [seen(arms) for arms in (*ARMS, *ARMS[:1])]
    found, fits, _ = find_place(CAMERA, [*standing, *sitting], None, None, SIZES)
    assert found.distance == pytest.approx(2.2, rel=0.07)
    assert fits == [False] * 2 + [True] * 6


def test_who_is_turned_away_is_found_where_they_are():
    picture = PersonEstimate(SIZES, 1.75, 2.2, -0.35).picture(CAMERA)
    pose = BODIES["rounded"](SIZES).skeleton.pose(torso_twist=1.5, left_shoulder_abduction=0.2, left_shoulder_forward=1.2,
                                                  right_shoulder_forward=1.2, left_elbow_flexion=0.6, right_elbow_flexion=0.6)
    mask = picture.mask(pose) | picture.legs(pose, spread=np.radians(8))
    found = find_place(CAMERA, [mask], None, None, SIZES)
    assert found.estimate.distance == pytest.approx(2.2, rel=0.15)
    assert found.overlap > 0.75  # of bodies that face the camera 0.69


def test_given_distances_are_kept():
    assert find_place(CAMERA, [seen(ARMS[0])], 1.75, 2.5, None)[0].distance == 2.5


@pytest.mark.parametrize(("below", "above"), [(3.2, 3.2), (2.4, 5.7)])
def test_the_middle_of_a_plateau_is_between_where_the_overlap_falls_below_it(below, above):
    steps = np.arange(-8.0, 9.0)
    overlaps = 0.9 - np.where(steps < 0, -steps / below, steps / above) * PLATEAU
    assert _middle(2 * RATIO**steps, overlaps) == pytest.approx(2 * RATIO ** ((above - below) / 2), rel=1e-6)


def test_a_plateau_that_does_not_end_reaches_to_the_last_distance():
    assert _middle(np.array([1.0, 1.1, 1.21]), np.array([0.9, 0.9, 0.89])) == pytest.approx(1.1)
    assert _middle(np.array([2.0]), np.array([0.9])) == pytest.approx(2.0)


def test_other_heights_at_a_distance_do_not_count():
    tried = np.array([1.0, 1.0, 1.1, 1.1, 1.21, 1.21])
    assert _middle(tried, np.array([0.7, 0.3, 0.9, 0.2, 0.7, 0.4])) == pytest.approx(1.1)
