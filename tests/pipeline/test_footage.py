"""What a sample of a film tells of its clock."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from shadowpuppet.body.anthropometry import sizes_from_height
from shadowpuppet.errors import SettingsError
from shadowpuppet.io.person import Person, write_person
from shadowpuppet.pipeline.footage import Sample, open_recording
from shadowpuppet.pipeline.options import make_options


@pytest.mark.parametrize(("times", "pace", "jitter"), [([0.0], np.nan, np.nan), ([1.0, 1.1], 0.1, 0.0), ([0, 0.1, 0.2, 0.5], 0.1, 0.0943)])
def test_two_frames_have_an_interval_and_one_has_none(times, pace, jitter):
    sample = Sample([], [], [], np.array(times))
    assert (sample.pace, sample.jitter) == pytest.approx((pace, jitter), abs=1e-4, nan_ok=True)


def test_the_height_of_known_sizes_is_the_scale_and_no_other_is_taken(tmp_path, recording):
    person = Person(sizes_from_height(1.7), 1.7)
    write_person(tmp_path / "me.toml", person)
    known = make_options({"person": str(tmp_path / "me.toml")})
    assert open_recording(recording, known).subject.height == 1.7
    assert open_recording(recording, replace(known, height=1.72)).subject.height == 1.72
    with pytest.raises(SettingsError, match=r"height: found 1\.6 m, but \S+me\.toml has the sizes of a person of 1\.7 m"):
        open_recording(recording, replace(known, height=1.6))
