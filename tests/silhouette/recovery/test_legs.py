from __future__ import annotations

import numpy as np
import pytest

from shadowpuppet.silhouette.recovery.legs import _zone, still_legs, waist
from shadowpuppet.silhouette.recovery.movement import Movement

SIZE = 120, 160
FLOOR, TROUSERS = (100, 120, 140), (60, 150, 110)


def standing() -> tuple[np.ndarray, Movement, np.ndarray]:
    """Still picture, movement and what is covered of a person whose trunk sways, and whose legs keep still."""
    still = np.full((*SIZE, 3), FLOOR, np.float32)
    region, covered = np.zeros(SIZE, bool), np.zeros(SIZE, bool)
    region[20:62, 60:100], covered[24:60, 64:96] = True, True
    for x in (66, 84):
        still[60:100, x : x + 10] = TROUSERS
    return still, Movement(np.ones(3), region, covered), covered


def test_legs_that_keep_still_are_found_below_the_trunk():
    still, movement, covered = standing()
    found = still_legs(still, movement, covered)
    assert found is not None
    assert found[62:99, 66:76].all()
    assert found[62:99, 84:94].all()
    assert not found[70:, 78:82].any()
    assert not found[102:].any()


@pytest.mark.parametrize("wider", [0, 1, -1])
def test_a_trunk_is_measured_at_its_centre_and_a_twentieth_of_its_rows_above(wider):
    trunk = np.zeros(SIZE, bool)
    for n in range(40):
        half = 30 + wider * (n - 20) // 2
        trunk[10 + n, 80 - half : 80 + half] = True
    middle, across = waist(trunk)
    rows, _ = np.nonzero(trunk)
    assert middle == int(rows.mean())
    np.testing.assert_array_equal(across, trunk[middle if wider > 0 else middle - 2])


def test_legs_are_looked_for_below_the_centre_and_half_as_wide_as_the_trunk_on_either_side():
    zone, (_, _, covered) = np.zeros(SIZE, bool), standing()
    zone[41:, 64 - 16 : 96 + 16] = True
    np.testing.assert_array_equal(_zone(covered), zone)


@pytest.mark.parametrize("what", ["nothing covered", "a floor without legs", "trousers of the wall's colour", "not connected", "far aside"])
def test_without_legs_there_are_none(what):
    still, movement, covered = standing()
    if what == "nothing covered":
        covered = np.zeros(SIZE, bool)
    elif what == "a floor without legs":
        still[:] = FLOOR
    elif what == "trousers of the wall's colour":
        still[:20] = TROUSERS
    elif what == "not connected":
        still[58:68] = FLOOR
    else:
        still[60:] = FLOOR
        still[60:100, 130:140] = TROUSERS
    assert still_legs(still, movement, covered) is None


def test_the_region_is_left_as_it_is():
    still, movement, covered = standing()
    before = movement.region.copy()
    found = still_legs(still, movement, covered)
    assert found is not None
    np.testing.assert_array_equal(movement.region, before)
