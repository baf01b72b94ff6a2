"""Films of several cameras are examined on several cores: what is warned of is in the order of the cameras."""

from __future__ import annotations

import time
import warnings
from types import SimpleNamespace

from shadowpuppet.errors import ShadowPuppetWarning, warn
from shadowpuppet.pipeline.findings.film import _each


def test_warnings_are_in_the_order_of_the_cameras_whichever_film_is_done_first():
    def work(name: str, seconds: float) -> str:
        time.sleep(seconds)
        warn(f"{name} is odd")
        return name

    rig = SimpleNamespace(is_multiview=True, footage=("cam1", "cam2", "cam3"))
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always", ShadowPuppetWarning)
        found = _each(rig, work, (0.2, 0.1, 0.0))  # pyright: ignore[reportArgumentType]
    assert found == rig.footage
    assert [str(each.message) for each in said] == ["cam1 is odd", "cam2 is odd", "cam3 is odd"]
