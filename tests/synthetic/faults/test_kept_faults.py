"""Faults of pictures stay what they are: figures of the documentation were measured on them."""

from __future__ import annotations

import kept
import numpy as np
import pytest


@pytest.mark.parametrize("name", kept.FAULTS)
def test_faults_are_kept(name):
    np.testing.assert_allclose(kept.pictures(kept.FAULTS[name]), kept.kept()["faults"][name], atol=0.1)
