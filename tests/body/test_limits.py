"""The limits, usual values and usual deviations of the bodies' angles, degrees: how far people bend."""

from __future__ import annotations

import numpy as np
import pytest
from runs import body_of

UPPER = """
torso_twist        -90  90    0  40.1  40.1
torso_bow          -10  90    0   3.4   3.4
torso_bend         -50  50    0  14.3  14.3
shoulder_abduction -40 190 45.8 114.6 114.6
shoulder_forward   -30 100    0  17.2  40.1
elbow_roll         -95  95    0  57.3  57.3
elbow_flexion        0 150    0  68.8  68.8
"""
BENDS = UPPER[: UPPER.index("elbow_roll")] + """
elbow_aside       -150 150    0  68.8  68.8
elbow_forward       -5 150    0  68.8  68.8
"""
WHOLE = """
root_bow          -100 130    0     5    10
root_tilt          -80  80    0     8     8
"""
ANATOMICAL = WHOLE + """
chest_x            -50  50    0    12    12
chest_y            -30  80    3     6    20
chest_z            -65  65    0    12    12
head_x             -55  55    0    15    15
head_y             -70  75    0    20    20
head_z             -90  90    0    25    25
shoulder_x        -100 210   12    40    40
shoulder_y        -215 100   -5    50    50
shoulder_z        -150 150    0    40    40
elbow_flexion        0 150   20    25    60
hip_x              -60  95    4    15    15
hip_y             -150  60   -5    25    25
hip_z              -75  75    0    12    12
knee_flexion         0 155   10    10    30
ankle_flexion      -40  60    0    15    20
ankle_inversion    -30  40    0    10    10
"""
CYLINDERS = WHOLE + """
head_flexion       -70  75    0    20    20
head_bend          -55  55    0    15    15
head_twist         -90  90    0    25    25
shoulder_flexion  -100 215    5    50    50
shoulder_abduction -60 200   12    40    40
shoulder_twist    -150 150    0    40    40
elbow_flexion        0 135   20    25    60
hip_flexion        -60 150    5    25    25
hip_abduction      -60  95    4    15    15
hip_twist          -75  75    0    12    12
knee_flexion         0 155   10    10    30
"""
FREE = {"torso_y", "root_x", "root_y", "root_z", "root_heading"}


@pytest.mark.parametrize(("name", "table"), [("cardbox", UPPER), ("boxes", UPPER), ("rounded", UPPER), ("cardbox_bends", BENDS),
                                             ("anatomical", ANATOMICAL), ("cylinders", CYLINDERS)])
def test_people_bend_so_far(name, table):
    """Both sides alike; components of the right side's rotation vectors about x and z are those of the left with the other sign."""
    rows = {row.split()[0]: [float(value) for value in row.split()[1:]] for row in table.split("\n") if row}
    for dof in body_of(name).skeleton.dofs:
        found = np.degrees([dof.low, dof.high, dof.rest, *dof.spread])
        side, _, rest = dof.name.partition("_")
        if dof.name in FREE:
            assert (found == [-np.inf, np.inf, 0, np.inf, np.inf]).all(), dof.name
            continue
        wanted = np.array(rows.get(dof.name) or rows[rest])
        if side == "right" and dof.kind == "vector" and dof.axis in "xz":
            wanted = np.array([-wanted[1], -wanted[0], -wanted[2], wanted[4], wanted[3]])
        np.testing.assert_allclose(found, wanted, atol=0.05, err_msg=dof.name)
    named = {dof.name for dof in body_of(name).skeleton.dofs}
    assert all({row, f"left_{row}", f"right_{row}"} & named for row in rows)
