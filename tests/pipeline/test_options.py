"""Options that do nothing for a recording, and the preset of a paper about other recordings."""

import warnings

import numpy as np
import pytest

from shadowpuppet.errors import SettingsError, ShadowPuppetWarning
from shadowpuppet.pipeline.options import check_used, make_options
from shadowpuppet.threads import one_blas_thread


@pytest.mark.parametrize(("values", "several", "named"), [
    ({"tracker": {"arm": {"particles": 300}}, "distance": 3.0}, True, "several cameras: distance, tracker.arm.particles"),
    ({"facing": "away", "initialization": {"sweeps": 1}}, True, "several cameras: facing, initialization.sweeps"),
    ({"multiview": {"particles": 30}, "prior": "walk.npz"}, False, "one camera: prior, multiview.particles"),
    ({"appearance": False, "training": {"regions": 9}}, False, "one camera: appearance, training.regions"),
])  # fmt: skip
def test_what_has_no_effect_is_named(values, several, named):
    options = make_options(values)
    check_used(options, not several)
    with pytest.warns(ShadowPuppetWarning, match=f"^no effect with {named}$"):
        check_used(options, several)


@pytest.mark.parametrize("values", [{}, {"body": "anatomical"}, {"evidence": "silhouettes,keypoints"},
                                    {"seed": 3, "smooth": "off", "overlay": True, "max_size": 320}])  # fmt: skip
@pytest.mark.parametrize("several", [False, True])
def test_nothing_is_said_of_what_has_an_effect(values, several):
    check_used(make_options(values), several)


@pytest.mark.parametrize(("preset", "several", "match"), [
    ("liu2011", True, "'liu2011', a method for one camera; expected with several cameras one of default, ni2008, or one camera"),
    ("ni2008", False, "'ni2008', a method for several cameras; expected with one camera one of default, liu2011"),
])  # fmt: skip
def test_a_paper_s_preset_is_for_its_own_recordings(preset, several, match):
    options = make_options({"preset": preset})
    check_used(options, not several)
    with pytest.raises(SettingsError, match=f"^preset: found {match}"):
        check_used(options, several)


def test_the_papers_have_no_keypoints():
    used = [make_options(values).uses_keypoints for values in ({}, {"preset": "ni2008"}, {"evidence": "silhouettes"})]
    assert used == [True, False, False]
    with pytest.raises(SettingsError, match=r"^evidence: found 'silhouettes,keypoints' with the preset ni2008, expected silhouettes"):
        check_used(make_options({"preset": "ni2008", "evidence": "silhouettes,keypoints"}), several=True)


def test_a_warning_names_the_caller_s_line_behind_the_wrappers_of_other_packages():
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        one_blas_thread()(np.errstate()(check_used))(make_options({"prior": "walk.npz"}), False)
    assert [each.filename for each in seen] == [__file__]


@pytest.mark.parametrize("several", [False, True])
def test_a_label_without_ready_silhouettes_has_no_effect(several):
    with pytest.warns(ShadowPuppetWarning, match=r"^no effect without ready silhouettes \(--masks\): label$"):
        check_used(make_options({"label": 2}), several)
    check_used(make_options({"label": 2, "masks": True}), several)
