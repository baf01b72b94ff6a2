"""A calibration's wrong scale is named by the person's height, and mended where that is known; a right one is not."""

from __future__ import annotations

import made_rig
import numpy as np
import pytest
import rendered

from shadowpuppet.errors import RUINOUS
from shadowpuppet.geometry import unit
from shadowpuppet.io.calibration.calibration_files import read_calibration
from shadowpuppet.pipeline.findings import scale
from shadowpuppet.pipeline.findings.scale import ScaleError, _whole, judged, scale_error, stands
from shadowpuppet.pipeline.findings.verdict import verdict_of_look
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.prepare import look_at
from shadowpuppet.pipeline.repair.films import check_films
from shadowpuppet.pipeline.repair.fix import fix_recording
from shadowpuppet.pipeline.rig import open_rig
from shadowpuppet.tracking.multiview.settings import MultiviewSettings

HEIGHT = 1.75
"""Of the person in `lab`, metres."""


def error(cameras, masks, factor, height=None):
    scaled = [made_rig.scaled(camera, factor) for camera in cameras]
    return scale_error(scaled, scale.moments_of(scaled, masks, MultiviewSettings()), MultiviewSettings(), height)


@pytest.mark.parametrize(("heights", "height", "named"), [
    ([2.5, 2.55, 2.6], None, True), ([2.1, 2.15, 2.12], None, False), ([0.8, 0.82, 0.81], None, True), ([0.95, 0.93, 0.96], None, False),
    ([2.5, 1.6, 2.3], None, False), ([1.9, 3.2, 2.4], None, False),  # the spread is greater than what is beyond
    ([2.0, 2.01, 2.02], 1.75, True), ([1.8, 1.81, 1.82], 1.75, False), ([1.52, 1.53, 1.54], 1.75, True),
    ([2.5], None, False), ([], 1.75, False)])  # fmt: skip
def test_a_scale_is_wrong_beyond_the_heights_of_people_or_the_known_one_and_its_doubt(heights, height, named):
    assert (judged(np.array(heights), height) is not None) is named


def test_the_factor_has_the_doubt_of_moments_of_the_fit_and_of_an_unknown_height():
    known, unknown = judged(np.array([2.4, 2.5, 2.6]), 1.75), judged(np.array([2.4, 2.5, 2.6]), None)
    assert known is not None
    assert unknown is not None
    assert known.factor == pytest.approx(2.5 / 1.75)
    assert known.doubt == pytest.approx(np.hypot(0.04, 0.035), abs=0.001)
    alike = judged(np.array([2.54, 2.54, 2.54]), 1.75)  # of a ring that is 1.4 times too large
    assert alike is not None
    assert abs(alike.factor - 1.4) < 1.645 * alike.factor * alike.doubt
    assert unknown.doubt > known.doubt
    assert "2.50 m tall: the board's square?" in known.caution()
    assert "1.43 ± 0.08 times too large" in known.caution()
    assert "--height" in unknown.caution()
    assert "check --fix" in known.caution()
    assert known.caution().severity == RUINOUS
    assert known.caution().evidence == {"height": known.height, "expected": 1.75, "factor": known.factor,
                                        "within": known.factor * known.doubt}
    assert "too small, 0.57" in ScaleError(height=1.0, expected=1.75, is_known=True, doubt=0.02).caution()


def test_a_standing_person_of_the_right_size_needs_no_fit(monkeypatch):
    monkeypatch.setattr(scale, "seen_stature", None)
    cameras, masks = rendered.person(1.7, motion="walk", moments=3)
    assert error(cameras, masks, 1.0) is None
    assert error(cameras, masks, 1.0, 1.7) is None
    assert not stands([np.array([2.5, 0.8, 0.5])] * 3, None)
    assert not stands([np.array([1.75, 1.6, 0.5])] * 3, None)  # arms aside: no height
    assert not stands([np.array([1.75, 0.6, 0.5])] * 3, 1.5)


@pytest.mark.whole
@pytest.mark.parametrize(("factor", "height", "named"), [(1.4, None, True), (1.0, None, False), (1.15, 1.75, True), (0.87, 1.75, True),
                                                         (1.0, 1.75, False)])  # fmt: skip
def test_a_seated_person_tells_a_wrong_scale_and_no_right_one(factor, height, named):
    cameras, masks = rendered.person(1.75, "seated", motion="reach", moments=2)
    found = error(cameras, masks, factor, height)
    assert (found is not None) is named
    if height and found is not None:
        assert found.factor == pytest.approx(factor, rel=0.05)


def test_who_is_cut_off_at_the_border_tells_no_height():
    mask = np.zeros((20, 30), bool)
    mask[5:15, 4:9] = mask[0:2, 25:] = True  # the smaller part reaches the border
    whole = _whole(mask)
    assert whole is not None
    assert np.count_nonzero(whole) == 50
    mask[15:, 4:9] = True
    assert _whole(mask) is None
    cameras, masks = rendered.person(1.75)
    cut = [tuple(np.roll(each, each.shape[0] // 2, 0) for each in row) for row in masks]
    assert scale.moments_of(cameras, cut, MultiviewSettings()) == []


def test_views_from_about_the_same_or_the_opposite_side_tell_no_scale():
    cameras, masks = rendered.person(1.75)
    middle = np.mean([camera.centre for camera in cameras], axis=0)
    rays = unit(np.array([camera.centre for camera in cameras]) - middle)
    for n in range(1, len(cameras)):
        two = [tuple(each if k in (0, n) else None for k, each in enumerate(row)) for row in masks]
        crosses = abs(float(rays[0] @ rays[n])) < np.cos(np.radians(45))
        assert bool(scale.moments_of(cameras, two, MultiviewSettings())) == crosses
    assert 0 < sum(abs(float(rays[0] @ ray)) < np.cos(np.radians(45)) for ray in rays[1:]) < len(cameras) - 1


@pytest.fixture
def lab(tmp_path):
    """A recording whose calibration is 1.4 times too large."""
    cameras, masks = rendered.person(HEIGHT, motion="walk", moments=12)
    return made_rig.write(tmp_path / "lab", [made_rig.scaled(camera, 1.4) for camera in cameras], masks)


@pytest.mark.whole
def test_info_and_check_name_a_wrong_scale_and_fix_mends_it(lab):
    options = Options(masks=True, height=HEIGHT)
    look = look_at(lab, options)
    assert verdict_of_look(look).word == "bad"
    assert "the board's square?" in verdict_of_look(look).reasons[0]
    rig = open_rig(lab, options)
    checked = check_films(rig, options)
    assert checked.check.scale is not None
    assert checked.check.scale.factor == pytest.approx(1.4, rel=0.05)
    assert "the board's square?" in checked.check.doubts[0]
    fix = fix_recording(rig, checked)
    assert any("all lengths divided by 1.4" in line for line in fix.done)
    for now, true in zip(read_calibration(lab / "calibration.toml"), rendered.person(HEIGHT, motion="walk", moments=12)[0]):
        assert now.centre == pytest.approx(true.centre, rel=0.05, abs=0.01)
    assert (lab / "calibration.before1.toml").exists()
    assert check_films(open_rig(lab, options), options).check.scale is None


@pytest.mark.whole
def test_without_the_height_nothing_is_mended(lab):
    rig, options = open_rig(lab, Options(masks=True)), Options(masks=True)
    checked = check_films(rig, options)
    assert checked.check.scale is not None
    assert not checked.check.scale.is_known
    assert fix_recording(rig, checked).done == ()
