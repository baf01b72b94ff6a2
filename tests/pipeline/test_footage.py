"""What a sample of a film tells of its clock."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from films import encoded, pictures

from shadowpuppet.body.anthropometry import sizes_from_height
from shadowpuppet.errors import SettingsError
from shadowpuppet.io.person import Person, write_person
from shadowpuppet.pipeline.findings.cautions import film_cautions
from shadowpuppet.pipeline.footage import Sample, open_footage, open_recording
from shadowpuppet.pipeline.options import make_options
from shadowpuppet.video import write_image


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


@pytest.mark.parametrize(("settings", "pixel"), [({"pixel": Fraction(4, 3)}, 4 / 3), ({"x264-params": "interlaced=1"}, 1.0)])
def test_pixels_that_are_not_square_are_used_and_interlaced_films_named(tmp_path, settings, pixel):
    film = encoded(tmp_path / "cam.mp4", pictures(size=(96, 64)), **settings)
    footage = open_footage(film, make_options({"fov": 60}))
    matrix = footage.view.camera.matrix
    assert matrix[1, 1] / matrix[0, 0] == pytest.approx(pixel)
    assert matrix[0, 0] == pytest.approx(48 / np.tan(np.pi / 6))
    interlaced = ["the film is interlaced: every other row" in each for each in film_cautions(footage)]
    assert interlaced == ([True] if "x264-params" in settings else [])


def test_a_calibration_with_pixels_of_another_shape_than_the_film_says_is_named(tmp_path):
    film = encoded(tmp_path / "cam.mp4", pictures(size=(96, 64)), pixel=Fraction(4, 3))
    footage = open_footage(film, make_options({"fov": 60}))
    square = replace(footage.view.camera, matrix=np.array([[80, 0, 48], [0, 80, 32], [0, 0, 1.0]]))
    (caution,) = film_cautions(replace(footage, view=replace(footage.view, camera=square)))
    assert "cam.mp4: the film says that its pixels are 1.33 times as wide as high, the calibration takes them for 1 times" in caution


def test_an_empty_scene_in_pictures_needs_no_rate(tmp_path):
    (tmp_path / "video").mkdir()
    encoded(tmp_path / "video" / "cam.mp4", pictures(size=(96, 64)))
    (tmp_path / "background" / "cam").mkdir(parents=True)
    for n in range(3):
        write_image(tmp_path / "background" / "cam" / f"{n}.png", np.full((64, 96, 3), 50, np.uint8))
    assert len(list(open_footage(tmp_path, make_options({"fov": 60})).empty_scene())) == 3  # no warning of a rate
