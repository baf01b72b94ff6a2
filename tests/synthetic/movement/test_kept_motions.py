"""Motions stay what they are: figures of the documentation were measured on them."""

from __future__ import annotations

import kept
import numpy as np
import pytest


@pytest.mark.parametrize("name", kept.MOTIONS)
def test_motions_are_kept(name):
    np.testing.assert_allclose(kept.motion(name), kept.kept()["motions"][name], atol=1e-5)
