"""Pictures of people and rooms, and named specs, stay what they are: figures of the documentation were measured on them."""

from __future__ import annotations

import kept
import numpy as np
import pytest


@pytest.mark.parametrize("name", kept.SCENES)
def test_pictures_are_kept(name):
    np.testing.assert_allclose(kept.pictures(kept.SCENES[name]), kept.kept()["scenes"][name], atol=0.1)


@pytest.mark.parametrize("name", kept.SETS)
def test_named_specs_are_kept(name):
    assert kept.digest(name) == kept.kept()["sets"][name]
