"""Settings: presets and Table I, tables laid over one another, ranges, and what is said of names and values that are wrong."""

from __future__ import annotations

import math
from dataclasses import FrozenInstanceError, fields, is_dataclass, replace
from typing import get_args, get_type_hints

import numpy as np
import pytest

from shadowpuppet.body.models import MODELS, WHOLE
from shadowpuppet.errors import SettingsError, ShadowPuppetError
from shadowpuppet.motion.prior.settings import PriorSettings
from shadowpuppet.pipeline.options import Options, make_options
from shadowpuppet.settings import validate
from shadowpuppet.silhouette import SilhouetteSettings
from shadowpuppet.tracking.monocular.settings import PRESETS, InitializationSettings, MonocularSettings, PartSettings, make_settings
from shadowpuppet.tracking.multiview.settings import (
    MULTIVIEW_PRESETS,
    ForceSettings,
    GaussNewtonSettings,
    HullSettings,
    MultiviewSettings,
    SurfaceSettings,
    make_multiview_settings,
)
from shadowpuppet.tracking.resampling import SCHEMES

OF_SEVERAL = (MultiviewSettings, SurfaceSettings, GaussNewtonSettings, ForceSettings, HullSettings, PriorSettings)
KINDS = (PartSettings, MonocularSettings, InitializationSettings, SilhouetteSettings, Options, *OF_SEVERAL)


# Presets --------------------------------------------------------------------------------------------------------------


def test_liu2011_is_table_i():
    paper = make_settings("liu2011")
    assert paper.torso == PartSettings(particles=200, survival=0.2, sigma_rotation=0.1, sigma_translation=0.02, sigma_cost=8000)
    assert paper.arm == PartSettings(particles=200, survival=0.4, sigma_rotation=0.25, sigma_translation=0.02, sigma_cost=4000)
    assert (paper.body, paper.resampling, paper.estimate) == ("cardbox", "deterministic", "best")
    assert paper.stages == ("torso", "left_arm", "right_arm")
    # One cycle a frame of one noise, and nothing that the paper does not have.
    assert (paper.cycles, paper.cooling, paper.explore, paper.motion_weight, paper.posture_weight) == (1, 1, 0, 0, 0)


@pytest.mark.parametrize("preset", PRESETS)
def test_presets_are_possible_and_overrides_come_last(preset):
    plain = make_settings(preset)
    changed = make_settings(preset, {"cycles": 9, "arm": {"survival": 0.77}})
    assert changed == replace(plain, cycles=9, arm=replace(plain.arm, survival=0.77))
    assert make_settings(preset, {}) == plain


def test_the_default_preset_is_what_the_class_says():
    assert make_settings() == MonocularSettings()


def test_a_table_given_in_part_keeps_the_rest_of_the_preset_s():
    made = make_settings("liu2011", {"arm": {"particles": 50}})
    assert (made.arm.particles, made.arm.survival, made.arm.sigma_cost) == (50, 0.4, 4000)
    assert made.torso == make_settings("liu2011").torso
    assert make_settings("liu2011", {"torso": PartSettings(particles=7)}).torso == PartSettings(particles=7)


def test_merging_changes_no_preset():
    before = repr(PRESETS)
    make_settings("liu2011", {"arm": {"particles": 50}, "torso": {"survival": 1.0}})
    assert repr(PRESETS) == before


def test_names_that_settings_offer_are_those_there_are():
    hints = get_type_hints(MonocularSettings)
    assert set(get_args(hints["body"])) == set(MODELS)
    assert set(get_args(hints["resampling"])) == set(SCHEMES)


# Several cameras ------------------------------------------------------------------------------------------------------


def test_ni2008_is_the_paper_s():
    """What it says (V, VI): cylinders, forces, N = 40, proposals from the prior alone, which forgets what it cannot hold."""
    paper = make_multiview_settings("ni2008")
    assert (paper.body, paper.method, paper.refinement, paper.particles) == ("cylinders", "hybrid", "forces", 40)
    assert (paper.defensive, paper.keep, paper.silhouettes, paper.cycles) == (0, 0, 0, 1)
    assert (paper.resampling, paper.select_best, paper.region, paper.velocity) == ("multinomial", False, "drawn", 0)
    assert not paper.recover
    assert paper.forces.modulated
    assert paper.forces.rho == "quadratic"
    assert paper.forces.hierarchical


@pytest.mark.parametrize("preset", MULTIVIEW_PRESETS)
def test_presets_of_several_cameras_are_possible_and_overrides_come_last(preset):
    plain = make_multiview_settings(preset)
    changed = make_multiview_settings(preset, {"particles": 3, "surface": {"tau": 0.123}, "forces": {"iterations": 7}})
    assert changed == replace(plain, particles=3, surface=replace(plain.surface, tau=0.123), forces=replace(plain.forces, iterations=7))
    assert make_multiview_settings() == MultiviewSettings()


def test_one_preset_is_for_both_trackers():
    """A name that only one of the trackers knows leaves the other its default."""
    paper = make_options({"preset": "ni2008", "multiview": {"particles": 5}})
    assert paper.multiview == make_multiview_settings("ni2008", {"particles": 5})
    assert paper.tracker == MonocularSettings()
    assert make_options({"preset": "liu2011"}).multiview == MultiviewSettings()
    with pytest.raises(SettingsError, match="unknown preset 'ni'; there are: default, liu2011, liu2011_printed, ni2008"):
        make_options({"preset": "ni"}, "run.toml")
    with pytest.raises(SettingsError, match="unknown preset 'liu2011'; there are: default, ni2008"):
        make_multiview_settings("liu2011")


def test_a_preset_measures_as_algorithm_1_is_printed_and_tracks_as_the_papers():
    printed, paper = make_options({"preset": "liu2011_printed"}), make_options({"preset": "liu2011"})
    assert printed.tracker == paper.tracker
    assert paper.initialization == InitializationSettings()
    found = printed.initialization
    assert (found.share, found.shrink, found.prior_weight, found.posture_weight, found.sweeps) == (1, 1, 0, 0, 1)
    assert (found.memory, found.place, paper.tracker.recover, paper.tracker.motion_blur) == (False,) * 4
    assert make_options({"preset": "liu2011_printed", "initialization": {"memory": True}}).initialization.memory
    assert printed.smoothing == ("off", 0.0)


def test_names_that_settings_of_several_cameras_offer_are_those_there_are():
    hints = get_type_hints(MultiviewSettings)
    assert set(get_args(hints["body"])) == set(WHOLE)
    assert set(get_args(hints["resampling"])) == set(SCHEMES) - {"deterministic"}


@pytest.mark.parametrize(("overrides", "said"), [
    ({"particle": 3}, "multiview: unknown setting 'particle'; there are: arm_colours, arms, body, cooling, cycles"),
    ({"surface": {"far": 3}}, "multiview: unknown setting 'surface.far'; there are: epsilon, nearest, tau"),
    ({"particles": 0}, "multiview: particles: found 0; input should be greater than or equal to 1"),
    ({"defensive": 1.5}, "defensive: found 1.5; input should be less than or equal to 1"), ({"keep": -0.1}, "keep: found -0.1"),
    ({"surface": {"epsilon": 1.0}}, "surface.epsilon: found 1.0; input should be less than 1"), ({"surface": {"tau": 0}}, "surface.tau"),
    ({"gauss_newton": {"share": 0}}, "gauss_newton.share: found 0"), ({"gauss_newton": {"damping": 0}}, "gauss_newton.damping"),
    ({"forces": {"iterations": -1}}, "forces.iterations: found -1"), ({"forces": {"rotation": 0}}, "forces.rotation: found 0"),
    ({"hull": {"rays": 0}}, "hull.rays: found 0"), ({"hull": 3}, "hull: found 3; input should be a dictionary"),
    ({"method": "luck"}, "method: found 'luck'; input should be 'hybrid', 'image_force' or 'particle_filter'"),
    ({"method": "hybird"}, "input should be 'hybrid', 'image_force' or 'particle_filter'; did you mean hybrid?"),
    ({"refinement": None}, "refinement: found None; input should be 'gauss_newton' or 'forces'"),
    ({"body": "rounded"}, "body: found 'rounded'; input should be 'anatomical' or 'cylinders'"),
    ({"sigma_cost": math.nan}, "sigma_cost: found nan"), ({"velocity": 2}, "velocity: found 2"), ({"silhouettes": -1}, "silhouettes"),
])  # fmt: skip
def test_what_is_wrong_with_several_cameras_is_said(overrides, said):
    with pytest.raises(SettingsError) as error:
        make_options({"preset": "ni2008", "multiview": overrides}, "run.toml")
    assert str(error.value).startswith("run.toml: multiview: ")
    assert said in str(error.value)
    assert "\n" not in str(error.value)


# What is wrong --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("overrides", "said"), [
    ({"particles": 3}, "unknown setting 'particles'; there are: arm, arm_colours, body, both_ways, cooling, cycles"),
    ({"torso": {"particle": 3}}, "unknown setting 'torso.particle'; there are: particles, sigma_cost, sigma_rotation"),
    ({"arm": {"cycles": 3}}, "unknown setting 'arm.cycles'; there are: particles"),
    ({"torso": {"particles": 1}}, "torso.particles: found 1; input should be greater than or equal to 2"),
    ({"torso": {"particles": 2.5}}, "torso.particles: found 2.5; input should be a valid integer"),
    ({"torso": {"survival": 1.01}}, "torso.survival: found 1.01; input should be less than or equal to 1"),
    ({"arm": {"survival": -0.1}}, "arm.survival"), ({"arm": {"sigma_rotation": 0}}, "arm.sigma_rotation"),
    ({"arm": {"sigma_translation": -1}}, "arm.sigma_translation"), ({"arm": {"sigma_cost": 0}}, "arm.sigma_cost"),
    ({"arm": {"sigma_rotation": math.nan}}, "arm.sigma_rotation: found nan"),
    ({"torso": 3}, "torso: found 3; input should be a dictionary"),
    ({"torso": None}, "torso: found None"), ({"stages": []}, "stages: found []"), ({"stages": "torso"}, "stages: found 'torso'"),
    ({"stages": ["torso", 3]}, "stages.1: found 3"), ({"cycles": 0}, "cycles: found 0"), ({"cycles": 101}, "cycles: found 101"),
    ({"cooling": 0}, "cooling"), ({"cooling": 1.1}, "cooling"), ({"explore": -1}, "explore"), ({"motion_weight": -1}, "motion_weight"),
    ({"motion_reach": 0}, "motion_reach"), ({"posture_weight": math.nan}, "posture_weight"),
    ({"body": "ball"}, "body: found 'ball'; input should be 'cardbox', 'cardbox_bends', 'boxes', 'rounded', 'anatomical' or 'cylinders'"),
    ({"resampling": "best"}, "resampling: found 'best'; input should be 'deterministic', 'stratified'"),
    ({"rank_by": None}, "rank_by: found None"), ({"torso_arms": "both"}, "input should be 'last' or 'hidden'"),
    ({"estimate": "median"}, "input should be 'best' or 'mean'"), ({"limits": 2}, "limits: found 2"),
    ({"ignore_legs": "perhaps"}, "ignore_legs"),
])  # fmt: skip
def test_what_is_wrong_is_said_with_its_place_and_what_is_possible(overrides, said):
    with pytest.raises(SettingsError) as error:
        make_settings("liu2011", overrides, "run.toml")
    assert str(error.value).startswith("run.toml: ")
    assert said in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(("values", "said"), [
    ({"hypotheses": 1}, "hypotheses"), ({"sigma": 0}, "sigma"), ({"share": 0}, "share"), ({"shrink": 1.5}, "shrink"),
    ({"prior_weight": -1}, "prior_weight"), ({"tolerance": 2}, "tolerance"), ({"patience": 0}, "patience"), ({"rounds": 0}, "rounds"),
    ({"sweeps": 0}, "sweeps"), ({"cycles": 1}, "unknown setting 'cycles'; there are: accuracy, hypotheses, memory, patience"),
])  # fmt: skip
def test_what_is_wrong_in_other_tables_is_said_alike(values, said):
    with pytest.raises(SettingsError) as error:
        validate(InitializationSettings, values, "run.toml")
    assert said in str(error.value)


def numbers(kind):
    """The settings of a kind that are numbers with a fraction."""
    return [f.name for f in fields(kind) if isinstance(getattr(kind(), f.name), float) or f.name in ("height", "distance", "fov")]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("value", [math.inf, -math.inf, math.nan, np.float64(np.inf)])
def test_no_setting_may_be_infinite_or_no_number(kind, value):
    for name in numbers(kind):
        for attempt in (lambda name=name: kind(**{name: value}), lambda name=name: validate(kind, {name: value}, "run.toml"),
                        lambda name=name: replace(kind(), **{name: value})):
            with pytest.raises(SettingsError) as error:
                attempt()
            said = "expected 0." if name in ("height", "distance") else "input should be a finite number"
            assert f"{name}: found {float(value)}; {said}" in str(error.value)


@pytest.mark.parametrize(("made", "said"), [
    (lambda: MonocularSettings(cycles=0), "MonocularSettings: cycles: found 0; input should be greater than or equal to 1"),
    (lambda: replace(MonocularSettings(), cycles=np.int64(0)), "MonocularSettings: cycles: found 0; input should be greater"),
    (lambda: MonocularSettings(arm={"particles": 1}), "MonocularSettings: arm.particles: found 1; input should be greater"),
    (lambda: MonocularSettings(arm={"particle": 1}), "unknown setting 'arm.particle'; there are: particles, sigma_cost"),
    (lambda: PartSettings(particle=3), "PartSettings: unknown setting 'particle'; there are: particles, sigma_cost"),
    (lambda: PartSettings(sigma_cost=np.float64(-1)), "PartSettings: sigma_cost: found -1.0; input should be greater than 0"),
    (lambda: InitializationSettings(sweeps=0), "InitializationSettings: sweeps: found 0"),
    (lambda: SilhouetteSettings(factor=101), "SilhouetteSettings: factor: found 101; input should be less than or equal to 100"),
    (lambda: Options(seed=-1), "Options: seed: found -1"),
    (lambda: Options(region=(1, 2, 3)), "Options: region: found (1, 2, 3); expected four numbers x0,y0,x1,y1, found 3"),
    (lambda: Options(height=180), "Options: height: found 180; expected 0.5 to 2.5 metres (180 cm are 1.8)"),
    (lambda: Options(height=np.float64(18)), "Options: height: found 18.0; expected 0.5 to 2.5 metres"),
    (lambda: Options(height="tall"), "Options: height: found 'tall'; expected 0.5 to 2.5 metres"),
    (lambda: Options(distance=250), "Options: distance: found 250; expected 0.2 to 30 metres (250 cm are 2.5)"),
    (lambda: PartSettings(3), "PartSettings: 0: found 3; unexpected positional argument"),
])  # fmt: skip
def test_what_is_wrong_in_python_is_said_alike(made, said):
    for family in (ShadowPuppetError, ValueError):
        with pytest.raises(family) as error:
            made()
        assert type(error.value) is SettingsError
        assert str(error.value).startswith(said) if said[0].isupper() else said in str(error.value)
        assert "\n" not in str(error.value)


def test_an_unknown_preset_is_said_with_those_there_are():
    with pytest.raises(SettingsError, match="unknown preset 'liu'; there are: default, liu2011"):
        make_settings("liu", source="run.toml")


# What holds of all settings -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_settings_are_frozen_named_and_comparable(kind):
    made = kind()
    assert made == kind()
    assert hash(made) == hash(kind())
    with pytest.raises(FrozenInstanceError):
        setattr(made, fields(made)[0].name, 3)


@pytest.mark.parametrize("kind", KINDS)
def test_settings_go_through_plain_values_and_back(kind):
    """As they do through TOML and run.toml."""
    def plain(settings):
        return {f.name: plain(v) if is_dataclass(v := getattr(settings, f.name)) else list(v) if isinstance(v, tuple) else v
                for f in fields(settings)}

    assert validate(kind, plain(kind())) == kind()
