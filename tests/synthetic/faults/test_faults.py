"""Faults of made pictures: each kind does what it says, at its time and in its cameras, and only that."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from itertools import pairwise
from typing import get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shadowpuppet.errors import SettingsError
from shadowpuppet.io.motion.table import read_joints
from shadowpuppet.synthetic import Fault, Gesture, Ring, Scene, Spec, Viewpoint, spec_from, spec_text, synthesize
from shadowpuppet.synthetic.faults.camera_faults import CameraFaults, averaged, rearranged
from shadowpuppet.synthetic.faults.fault import faults_from_text
from shadowpuppet.synthetic.faults.kinds import KINDS, FaultName
from shadowpuppet.synthetic.spec_changes import SpecChanges, apply_changes
from shadowpuppet.video import open_frames, read_image

CAMERA = Viewpoint(size=(48, 32)).camera()
RATE, COUNT = 10.0, 31
GREY = np.full((32, 48, 3), 0.5)


def of(*faults: Fault, seed: int = 0) -> CameraFaults:
    """Faults of a film of 3 s."""
    return CameraFaults(faults, CAMERA, COUNT, RATE, np.random.default_rng(seed))


def lit(fault: Fault, index: int | None, light: np.ndarray = GREY) -> np.ndarray:
    return of(fault).lit(light, index, 0.0 if index is None else index / RATE)


def test_every_kind_is_a_row_of_the_table():
    assert list(KINDS) == list(get_args(FaultName))
    for kind in KINDS.values():
        assert kind.least <= kind.default <= kind.most
        assert sum(function is not None for function in (kind.light, kind.displacement, kind.timing)) <= 1


@pytest.mark.parametrize("kind", [name for name, kind in KINDS.items() if kind.light])
def test_a_fault_of_light_is_there_in_its_time_only(kind):
    fault = Fault(kind=kind, begin=1, end=2)
    ramp = GREY * np.linspace(0.2, 1, 48)[:, None] * np.array([1, 0.9, 0.8])
    for index, there in ((0, False), (9, False), (11, True), (19, True), (20, False), (None, False)):
        assert (lit(fault, index, ramp) is not ramp) == there
    assert not np.allclose(lit(fault, 11, ramp), ramp)


def test_light_in_numbers():
    assert np.allclose(lit(Fault(kind="gain", amount=1.4), 3), 0.7)
    assert np.allclose(lit(Fault(kind="white_balance", amount=1.25), 3), [0.625, 0.5, 0.4])
    assert (lit(Fault(kind="black"), 3) == 0).all()
    dark = lit(Fault(kind="vignetting", amount=0.4), 3)
    assert dark[0, 0, 0] == pytest.approx(0.3, abs=1e-3)
    assert dark[15:17, 23:25].min() > 0.499
    swing = [lit(Fault(kind="flicker", amount=0.1), index)[0, 0, 0] for index in range(COUNT)]
    assert max(swing) == pytest.approx(0.55, abs=2e-3)
    assert min(swing) == pytest.approx(0.45, abs=2e-3)
    half = np.zeros((32, 48, 3))
    half[:, 24:] = 1
    soft = lit(Fault(kind="defocus", amount=2), 3, half)[16, :, 0]
    assert ((soft > 0.05) & (soft < 0.95)).sum() in range(5, 9)


def test_a_lamp_lights_a_part_of_the_picture_and_another_part_less():
    change = lit(Fault(kind="lamp", amount=1.8), 3)[..., 0] / 0.5
    assert change.max() > 1.75
    assert change.min() < 1.1
    assert (lit(Fault(kind="lamp", amount=0.4), 3) < 0.5).any()
    places = {tuple(np.unravel_index(of(Fault(kind="lamp"), seed=seed).lit(GREY, 3, 0.3)[..., 0].argmax(), (32, 48))) for seed in range(9)}
    assert len(places) > 3


def test_the_sun_comes_and_wanders_inward():
    fault = Fault(kind="sun", amount=1.6, drift=True)
    change = [lit(fault, index)[..., 0].max(axis=0) / 0.5 for index in range(COUNT)]
    assert change[0].max() == pytest.approx(1)
    assert all(each.max() > 1.5 and each.min() < 1.01 for each in change[COUNT // 5 :])
    places = [abs(float(np.average(np.arange(48) - 23.5, weights=each - 1))) for each in change[COUNT // 5 :]]
    assert (np.diff(places) < 0).all()
    assert places[0] - places[-1] > 0.1 * 48


def test_a_drift_builds_up_evenly_and_stays():
    fault = Fault(kind="gain", amount=2, begin=1, end=2, drift=True)
    seen = [lit(fault, index)[0, 0, 0] / 0.5 for index in range(COUNT)]
    assert seen[:11] == [1] * 11
    assert seen[15] == pytest.approx(2**0.5)
    assert seen[20:] == pytest.approx([2] * 11)
    assert all(a <= b for a, b in pairwise(seen))
    assert lit(replace(fault, end=None), COUNT - 1)[0, 0, 0] == pytest.approx(1)


def test_the_empty_scene_is_without_faults_unless_said():
    assert lit(Fault(kind="gain", amount=1.4), None) is GREY
    assert np.allclose(lit(Fault(kind="gain", amount=1.4, empty=True, begin=2), None), 0.7)
    assert of(Fault(kind="noise", amount=4, empty=True)).noise(3, None) == pytest.approx(5)
    assert of(Fault(kind="noise", amount=4)).noise(3, None) == 3
    assert of(Fault(kind="noise", amount=4)).noise(3, 0) == pytest.approx(5)
    alone, both = of(Fault(kind="crf", amount=30)), of(Fault(kind="crf", amount=30, empty=True))
    assert [(one.crf(18, empty=False), one.crf(18, empty=True)) for one in (alone, both)] == [(30, 18), (30, 30)]


# Tripod


def spot(x: int, y: int, margin: int) -> np.ndarray:
    picture = np.zeros((32 + 2 * margin, 48 + 2 * margin, 3))
    picture[y + margin, x + margin] = 1
    return picture


def test_a_nudge_moves_the_picture_once_and_it_stays():
    faults = of(Fault(kind="nudge", amount=5, direction_deg=90, begin=1))
    assert faults.margin == 16
    assert faults.wide_camera().size == (80, 64)
    picture = spot(20, 10, 16)
    for index, row in ((0, 10), (9, 10), (10, 15), (30, 15)):
        assert np.argwhere(faults.displaced(picture, index)[..., 0] > 0.5).tolist() == [[row, 20]]
    mask = (255 * picture[..., 0]).astype(np.uint8)
    assert np.argwhere(faults.displaced(mask, 20)).tolist() == [[15, 20]]


def test_a_nudged_camera_sees_what_is_beside_its_picture():
    faults = of(Fault(kind="nudge", amount=6))
    assert np.argwhere(faults.displaced(spot(-4, 8, 16), 0)[..., 0] > 0.5).tolist() == [[8, 2]]


def test_a_roll_turns_clockwise_about_the_middle():
    faults = of(Fault(kind="nudge", amount=0, roll_deg=10))
    moved = faults.displaced(spot(43, 16, faults.margin), 0)[..., 0]
    row, column = np.unravel_index(moved.argmax(), moved.shape)
    middle, arm, rise = 23.5, 19.5, 0.5
    angle = np.radians(10)
    assert column == pytest.approx(middle + arm * np.cos(angle) - rise * np.sin(angle), abs=0.6)
    assert row == pytest.approx(15.5 + arm * np.sin(angle) + rise * np.cos(angle), abs=0.6)


def test_a_shaking_camera_moves_smoothly_as_far_as_said():
    moves = of(Fault(kind="shake", amount=4, roll_deg=1)).moves
    away = np.hypot(moves[:, 0], moves[:, 1])
    assert away.max() == pytest.approx(4)
    assert np.abs(moves[:, 2]).max() == pytest.approx(np.radians(1))
    assert np.hypot(*np.diff(moves[:, :2], axis=0).T).max() < 3.5
    assert len(np.unique(away)) == COUNT
    rough = CameraFaults([Fault(kind="shake", amount=4)], CAMERA, 301, 100.0, np.random.default_rng(0)).moves
    assert np.hypot(*np.diff(rough[:, :2], axis=0).T).max() < 0.5


def test_a_lens_that_folds_beyond_its_picture_refuses_a_nudge():
    bent = Viewpoint(size=(320, 240), distortion=(-0.2, 0.0, 0.0, 0.0)).camera()
    straight = Viewpoint(size=(320, 240), distortion=(-0.09, 0.05, 0.0, 0.0)).camera()
    assert CameraFaults([Fault(kind="nudge", amount=20)], straight, 5, RATE, np.random.default_rng(0)).margin == 32
    with pytest.raises(SettingsError, match=r"faults\.0: amount: found 90 pixels of nudge, expected fewer: the lens of 'cam'"):
        CameraFaults([Fault(kind="nudge", amount=90)], bent, 5, RATE, np.random.default_rng(0))


# Timing


def test_timing_in_numbers():
    base = list(range(COUNT))
    assert of(Fault(kind="frozen", begin=1, end=1.5)).sources == [*base[:10], *[10] * 5, *base[15:]]
    assert of(Fault(kind="frozen", begin=1)).sources == [*base[:10], *[10] * 21]
    assert of(Fault(kind="repeated", amount=3, begin=1, end=1.6)).sources == [*base[:10], 10, 10, 10, 13, 13, 13, *base[16:]]
    assert of(Fault(kind="late", amount=4, begin=1)).sources == [*base[:10], *range(6, 27)]
    assert of(Fault(kind="late", amount=4)).sources == [0, 0, 0, 0, *range(27)]
    assert of(Fault(kind="dropped", amount=1, begin=1, end=1.5)).sources == [*base[:10], *base[15:]]
    some = of(Fault(kind="dropped", amount=0.4)).sources
    assert COUNT * 0.35 < len(some) < COUNT * 0.85
    assert some == sorted(set(some))
    with pytest.raises(SettingsError, match="all frames of the film are missing"):
        of(Fault(kind="dropped", amount=1))


@given(st.lists(st.integers(0, 30), min_size=1, max_size=40))
@settings(deadline=None)
def test_frames_are_rearranged_as_listed(sources):
    assert list(rearranged(iter(range(31)), sources)) == sources


@given(st.lists(st.integers(1, 7), min_size=1, max_size=25))
@settings(deadline=None)
def test_pictures_are_averaged_over_their_spans(spans):
    pictures = np.random.default_rng(0).random((len(spans), 2, 3, 3))
    found = list(averaged(((one, n) for n, one in enumerate(pictures)), spans))
    assert [n for _, n in found] == list(range(len(spans)))
    for n, (span, (picture, _)) in enumerate(zip(spans, found)):
        first = n - span // 2
        assert np.allclose(picture, pictures[max(first, 0) : first + span].mean(0))


def test_motion_blur_averages_in_its_time():
    pictures = [(np.full((2, 2, 3), float(n)), n) for n in range(COUNT)]
    seen = [one[0, 0, 0] for one, _ in of(Fault(kind="motion_blur", amount=2, begin=1, end=2)).blurred(iter(pictures))]
    assert seen == [*range(10), *(n - 0.5 for n in range(10, 20)), *range(20, COUNT)]


def test_a_fault_has_chance_of_its_own():
    shaking = Fault(kind="shake")
    alone, among = of(Fault(kind="gain"), shaking), of(Fault(kind="dropped"), shaking)
    assert np.array_equal(alone.moves, among.moves)
    assert not np.array_equal(alone.moves, of(Fault(kind="gain"), shaking, seed=1).moves)


# Specs and text

kinds = st.sampled_from(sorted(set(KINDS) - {"crf"}))
faults = st.builds(Fault, kind=kinds, begin=st.floats(0, 5), end=st.one_of(st.none(), st.floats(6, 9)))


@given(st.lists(faults, max_size=3).map(tuple))
@settings(deadline=None)
def test_faults_come_back_from_a_specs_text(some):
    spec = Spec(faults=some)
    assert spec_from(tomllib.loads(spec_text(spec))) == spec


@pytest.mark.parametrize(("values", "message"), [
    ({"kind": "gian"}, r"faults\.0\.kind: input should be 'gain', .*, found 'gian'"),
    ({"kind": "gain", "amount": 40}, r"faults\.0: amount: found 40, expected a number from 0\.1 to 10 for gain \(factor on the light\)"),
    ({"kind": "crf", "amount": 30.5}, r"faults\.0: amount: found 30\.5, expected a whole number from 0 to 51 for crf"),
    ({"kind": "frozen", "amount": 3}, r"faults\.0: amount: found 3, expected none for frozen"),
    ({"kind": "gain", "begin": 3, "end": 3}, r"faults\.0: end: found 3, expected more than begin, 3"),
    ({"kind": "crf", "begin": 3}, r"faults\.0: begin, end: found 3 and None, expected none for crf"),
    ({"kind": "late", "drift": True}, r"faults\.0: drift: found true for late; only these have it: gain, .*shake$"),
    ({"kind": "nudge", "empty": True}, r"faults\.0: empty: found true for nudge; only these have it: gain, .*crf$"),
    ({"kind": "gain", "roll_deg": 2}, r"faults\.0: roll_deg: found 2\.0 for gain; only these have it: nudge, shake$"),
    ({"kind": "shake", "direction_deg": 2}, r"faults\.0: direction_deg: found 2\.0 for shake; only these have it: nudge$"),
    ({"kind": "gain", "cameras": ["cam2"]}, r"faults\.0: cameras: found 'cam2', there are: cam$"),
    ({"kind": "absent", "cameras": ["cam"]}, r"faults\.0: cameras: found cam, expected none for absent, which all cameras see"),
    ({"kind": "gain", "from": 2}, r"faults\.0\.from: no such setting; possible are amount, begin, cameras, direction_deg, drift"),
])  # fmt: skip
def test_an_impossible_fault_is_refused(values, message):
    with pytest.raises(SettingsError, match=message):
        spec_from({"faults": [values]})


def test_faults_from_a_flag():
    spec = apply_changes(SpecChanges(cameras=3, faults="gain 1.3 @3-6 drift, nudge 20 @4 cam2 cam3, black, noise 4."), Spec())
    assert spec.faults == (Fault(kind="gain", amount=1.3, begin=3, end=6, drift=True),
                           Fault(kind="nudge", amount=20, begin=4, cameras=("cam2", "cam3")), Fault(kind="black"),
                           Fault(kind="noise", amount=4))
    assert apply_changes(SpecChanges(faults="black"), spec).faults == (Fault(kind="black"),)
    with pytest.raises(SettingsError, match="faults: found 'dim 3', which names no kind of fault; there are: absent, "):
        faults_from_text("gain 2, dim 3")
    with pytest.raises(SettingsError, match=r"faults: found '@x' in 'gain 2 @x', expected an amount, @begin-end"):
        faults_from_text("gain 2 @x")
    with pytest.raises(SettingsError, match=r"flags: faults\.0: cameras: found 'front', there are: cam$"):
        apply_changes(SpecChanges(faults="gain front"), Spec())


# Whole recordings

TINY = Spec(motion=(Gesture(motion="wave_hands", seconds=2),), cameras=(Viewpoint(size=(64, 48)),), rate=5,
            scene=Scene(empty_seconds=0.4, noise=0, crf=0))


def film(folder, kind="video", name="cam"):
    ending = {"masks": "mkv"}.get(kind, "mp4")
    return np.array([frame.image for frame in open_frames(folder / kind / f"{name}.{ending}")]).astype(int)


@pytest.fixture(scope="module")
def clean(tmp_path_factory):
    return synthesize(TINY, tmp_path_factory.mktemp("clean") / "out")


def spoiled(folder, text):
    return synthesize(apply_changes(SpecChanges(faults=text), TINY), folder)


def test_a_recording_with_faults_keeps_truth_and_empty_scene(clean, tmp_path):
    out = spoiled(tmp_path / "out", "gain 0.6 @1-2, nudge 4 @2, black @3")
    assert np.array_equal(film(out, "background"), film(clean, "background"))
    assert np.array_equal(read_joints(out / "truth.csv").positions, read_joints(clean / "truth.csv").positions)
    references = [read_image(one / "references" / "front_t_pose.png").astype(int) for one in (out, clean)]
    assert np.abs(references[0] - references[1]).mean() < 0.1  # shadows at the picture's border differ a little
    seen, plain, masks, exact = film(out), film(clean), film(out, "masks")[..., 0], film(clean, "masks")[..., 0]
    assert np.abs(seen[:5] - plain[:5]).mean() < 2
    assert seen[6].mean() == pytest.approx(0.6 * plain[6].mean(), rel=0.03)
    assert np.array_equal(masks[:10], exact[:10])
    assert np.array_equal(masks[10:15, :, 4:], exact[10:15, :, :-4])
    assert np.abs(seen[10, :, 4:] - plain[10, :, :-4]).mean() < 2
    assert not masks[15:].any()
    assert seen[15:].max() < 3


def test_masks_are_those_of_the_picture_shown(clean, tmp_path):
    exact = film(clean, "masks")
    assert np.array_equal(film(spoiled(tmp_path / "a", "frozen @1"), "masks"), exact[[0, 1, 2, 3, 4, *[5] * (len(exact) - 5)]])
    fewer = spoiled(tmp_path / "b", "dropped 1 @1-2")
    assert np.array_equal(film(fewer, "masks"), np.delete(exact, range(5, 10), axis=0))
    assert len(film(fewer)) == len(exact) - 5
    assert len(read_joints(fewer / "truth.csv").times) == len(exact)


def test_an_absent_person_leaves_the_empty_scene(clean, tmp_path):
    out = spoiled(tmp_path / "out", "absent @1-2")
    assert not film(out, "masks")[5:10].any()
    assert np.array_equal(film(out)[[4, 10]], film(clean)[[4, 10]])
    assert np.abs(film(out)[5:10] - film(clean, "background")[0]).max() <= 3
    truth = read_joints(out / "truth.csv").positions
    assert np.isnan(truth[5:10]).all()
    assert np.array_equal(np.delete(truth, range(5, 10), 0), np.delete(read_joints(clean / "truth.csv").positions, range(5, 10), 0))


def test_the_same_seed_makes_the_same_faulty_film_and_only_in_its_camera(tmp_path):
    ring = replace(TINY, cameras=Spec().cameras, ring=Ring(count=2, size=(64, 48)), training=(), faults=(
        Fault(kind="shake", amount=3, cameras=("cam2",)), Fault(kind="dropped", amount=0.3, cameras=("cam2",))))
    one, two = synthesize(ring, tmp_path / "one"), synthesize(ring, tmp_path / "two")
    plain = synthesize(replace(ring, faults=()), tmp_path / "plain")
    for name in ("cam1", "cam2"):
        assert np.array_equal(film(one, name=name), film(two, name=name))
    assert np.array_equal(film(one, name="cam1"), film(plain, name="cam1"))
    assert len(film(one, name="cam2")) < len(film(plain, name="cam2"))


def test_a_fault_after_the_film_is_refused(tmp_path):
    with pytest.raises(SettingsError, match=r"faults\.0: begin: found 30 s, after the film's last frame at 3\.6 s"):
        spoiled(tmp_path / "out", "gain @30")
