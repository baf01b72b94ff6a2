"""What a sample of a film tells of its clock."""

from __future__ import annotations

import numpy as np
import pytest

from shadowpuppet.pipeline.footage import Sample


@pytest.mark.parametrize(("times", "pace", "jitter"), [([0.0], np.nan, np.nan), ([1.0, 1.1], 0.1, 0.0), ([0, 0.1, 0.2, 0.5], 0.1, 0.0943)])
def test_two_frames_have_an_interval_and_one_has_none(times, pace, jitter):
    sample = Sample([], [], [], np.array(times))
    assert (sample.pace, sample.jitter) == pytest.approx((pace, jitter), abs=1e-4, nan_ok=True)
