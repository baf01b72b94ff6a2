from __future__ import annotations

import json
import re
from dataclasses import asdict, replace

import made
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import HARMFUL, NOTED, RecordingError, SettingsError, ShadowPuppetError, SilhouetteError
from shadowpuppet.io.recording import Subject
from shadowpuppet.pipeline.findings.camera import _doubts as camera_doubts
from shadowpuppet.pipeline.findings.camera import _look, survey_camera
from shadowpuppet.pipeline.findings.cautions import recovery_cautions
from shadowpuppet.pipeline.findings.film import quality_of, survey_film
from shadowpuppet.pipeline.findings.verdict import verdict_of_look
from shadowpuppet.pipeline.footage import FIRST, FIRST_SECONDS, LOOKED_AT, RUN, RUNS, _spread, open_footage, take_sample
from shadowpuppet.pipeline.options import Options, make_options
from shadowpuppet.pipeline.person import DEEP, _doubts, _forearms_seen, wrong_posture
from shadowpuppet.pipeline.prepare import MONOCULAR, Prepared, look_at, prepare
from shadowpuppet.pipeline.rig import open_rig
from shadowpuppet.pipeline.silhouettes import Silhouettes, clean_silhouettes, learn_silhouettes
from shadowpuppet.pipeline.track import json_text
from shadowpuppet.silhouette import RecoveredScene, Segmenter
from shadowpuppet.silhouette.quality import mask_quality
from shadowpuppet.synthetic import synthesize
from shadowpuppet.synthetic.spec_changes import parse_gestures
from shadowpuppet.tracking.monocular.initialization import POSTURES, PersonEstimate, SizeFit, sizes_from_height

QUICK = {"rounds": 20, "patience": 5, "sweeps": 2}


@pytest.fixture(scope="module")
def look(recording):
    return look_at(recording)


@pytest.mark.parametrize(("size", "fov", "doubted"), [((480, 640), 65.0, True), ((480, 640), 40.0, False), ((640, 480), 65.0, False)])
def test_the_view_of_a_phone_held_across_is_doubted_in_an_upright_film(recording, look, size, fov, doubted):
    doubts = camera_doubts(replace(look, size=size, fov=fov, calibrated=False), open_footage(recording, Options()), whole=False)
    assert any("--fov 40" in str(doubt) for doubt in doubts) == doubted


@pytest.mark.parametrize(("lens", "short", "guessed"), [
    (False, "camera not calibrated: depths are rough; give --calibration", True),
    (True, "camera's place not calibrated: depths are rough", False),
])
def test_what_is_known_of_a_lens_is_not_called_a_guess(recording, look, lens, short, guessed):
    doubts = camera_doubts(replace(look, calibrated=False, lens_calibrated=lens), open_footage(recording, Options()), whole=False)
    (said,) = [each for each in doubts if "no calibration of the camera's place" in each]
    assert said.short == short
    assert ("a field of view of 60 degrees and no distortion" in said) == guessed


def test_a_look_says_what_is_there(recording, look):
    assert look.recording == str(recording)
    assert (look.camera, look.size, look.worked_size, look.frames) == ("cam", made.SIZE, made.SIZE, made.FRAMES)
    assert look.fov == pytest.approx(60, abs=0.1)
    assert look.rate == pytest.approx(made.RATE)
    assert look.jitter == pytest.approx(0, abs=1e-6)
    assert look.scale == "height 1.78 m and distance 2.00 m" or look.scale.startswith("height 1.7")
    assert look.background == "background/cam.mp4"
    assert look.key.split(":")[0] in ("brightness", "colour", "both")
    assert look.refusal is None
    assert not look.doubts


def test_a_look_measures_silhouettes_by_both_rules_against_those_that_are_known(look):
    assert look.exact_overlap > 0.93
    assert look.exact_overlap_plain < look.exact_overlap - 0.1
    assert look.plain_area > look.area > 0.05


def test_a_look_tells_whether_the_person_fits(look):
    assert set(look.person["overlaps"]) == set(POSTURES)
    assert look.person["start_overlap"] > 0.85
    assert look.person["distance"] == pytest.approx(2.0)
    assert set(look.person["sizes"]) == set(sizes_from_height(1.7).names())


def test_each_sampled_frame_is_classified_once(recording, monkeypatch):
    """However many look at it: the masks, the count of people, the first seconds."""
    seen, labelled = [], Segmenter.labelled
    monkeypatch.setattr(Segmenter, "labelled", lambda self, image: seen.append(image) or labelled(self, image))
    survey = survey_camera(open_rig(recording, Options()), Options())
    (film,) = survey.films
    assert len(seen) < len(film.sample.frames) + len(film.sample.first)
    assert all(sum(each is frame.image for each in seen) == 1 for frame in film.sample.frames)
    assert not film.silhouettes.classified  # nothing is held any longer
    first, (mask,) = film.sample.frames[0], survey.first.masks[0]
    np.testing.assert_array_equal(film.silhouettes(first), mask)


def test_a_look_is_plain(look):
    assert json.loads(json_text(look))["quality"]["border"]["bottom"] == 1.0


def test_without_ready_masks_nothing_is_said_of_them(recording, tmp_path):
    bare = made.copied(recording, tmp_path / "bare", without=["masks"])
    assert look_at(bare).exact_overlap is None


def test_a_single_picture_of_the_scene_has_no_plain_rule(recording, tmp_path):
    from shadowpuppet.video import write_image

    still = made.copied(recording, tmp_path / "still", without=["background/cam.mp4"])
    write_image(still / "background" / "cam.png", made.images(recording / "background" / "cam.mp4")[0])
    look = look_at(still)
    assert look.plain_area is None
    assert look.exact_overlap > 0.9
    with pytest.raises(SilhouetteError, match=r"found a single picture, expected at least 2 frames for method averaging"):
        look_at(still, make_options({"silhouette": {"method": "averaging"}}))


def test_ready_masks_need_no_background(recording, tmp_path):
    bare = made.copied(recording, tmp_path / "bare", without=["background"])
    look = look_at(bare, Options(masks=True))
    assert look.background == "masks/cam.mkv, ready silhouettes"
    assert look.key == "none"
    assert look.person["overlaps"].keys() == POSTURES.keys()
    with pytest.raises(RecordingError, match=r"no ready silhouettes in it, expected masks/cam.mkv .* leave --masks out"):
        look_at(made.copied(recording, tmp_path / "without", without=["masks"]), Options(masks=True))


def test_masks_black_on_white_are_the_same_as_white_on_black(recording, tmp_path):
    other = made.copied(recording, tmp_path / "other")
    made.write_film(other / "masks" / "cam.mkv", [255 - mask for mask in made.images(other / "masks" / "cam.mkv")], lossless=True)
    for path in (other / "references").glob("*_mask.*"):
        _write(path, 255 - made.images(path)[0])
    right, found = (look_at(each, Options(masks=True)) for each in (recording, other))
    assert found.background == "masks/cam.mkv, ready silhouettes, black on white"
    assert (found.quality, found.person) == (right.quality, right.person)


def prepared(recording, options) -> Prepared:
    return prepare(np.random.default_rng(0), open_rig(recording, options), options, MONOCULAR)


def test_where_plain_masks_are_tracked_the_person_is_measured_in_clean_ones(recording, look):
    plain = prepared(recording, make_options({"silhouette": {"method": "averaging"}}))
    assert plain.survey.silhouettes[0].segmenter.key == "averaging"
    assert plain.look.key == "averaging: as set"
    assert plain.look.exact_overlap == pytest.approx(look.exact_overlap_plain, abs=1e-6)
    assert plain.look.person["silhouettes"] == look.key.split(":")[0]
    assert look.person["silhouettes"] is None
    clean = prepared(recording, Options())
    assert plain.look.person["sizes"] == clean.look.person["sizes"]
    assert clean.survey.clean == clean.survey.silhouettes


@pytest.mark.parametrize(("settings", "key", "cleaned"), [
    ({"method": "averaging", "clean": True}, "both", True), ({"method": "brightness", "clean": False, "factor": 3.0}, "brightness", True),
    ({"method": "mog2", "clean": False}, "mog2", True),
])  # fmt: skip
def test_silhouettes_with_specks_are_not_measured_in(recording, settings, key, cleaned):
    options = make_options({"silhouette": settings})
    footage = open_footage(recording, options)
    sample = take_sample(footage)
    seen = learn_silhouettes(footage, sample, options)
    clear = clean_silhouettes(footage, sample, seen, options).segmenter
    assert (clear.key, clear.settings.cleaned) == (key, cleaned)
    assert clear.settings.factor == (2.0 if settings["method"] == "averaging" else options.silhouette.factor)


@pytest.mark.parametrize("settings", [{}, {"method": "brightness"}, {"method": "mog2"}, {"clean": True}])
def test_silhouettes_that_are_clean_are_measured_in(recording, settings):
    options = make_options({"silhouette": settings})
    footage = open_footage(recording, options)
    sample = take_sample(footage)
    seen = learn_silhouettes(footage, sample, options)
    assert clean_silhouettes(footage, sample, seen, options) is seen


# Doubts


def doubts(recording, **options) -> str:
    return "\n".join(look_at(recording, make_options(options)).doubts)


def test_an_assumed_scale_is_said(recording, tmp_path):
    unknown = made.copied(recording, tmp_path / "unknown", without=["recording.toml"])
    assert "neither height nor distance is known: the average height of 1.70 m, assumed" in doubts(unknown, initialization=QUICK)
    assert "neither" not in doubts(unknown, height=1.8, initialization=QUICK)
    assert look_at(unknown, make_options({"distance": 2.5, "initialization": QUICK})).person["distance"] == pytest.approx(2.5)


def test_a_distance_that_only_the_silhouette_tells_is_doubted(recording, tmp_path):
    alone = made.copied(recording, tmp_path / "alone", without=["recording.toml", "references"])
    said = doubts(alone, initialization=QUICK, height=1.7)
    assert "the distance is not known: it is found from the silhouette" in said
    assert "the distance is not known" not in doubts(alone, initialization=QUICK, height=1.7, distance=2.0)


@pytest.mark.parametrize(("calibrated", "weight"), [(True, NOTED), (False, HARMFUL)])
def test_an_unknown_distance_before_a_camera_that_was_not_calibrated_is_no_good_film(recording, look, calibrated, weight):
    footage = open_footage(recording, make_options({"height": 1.7}))
    footage = replace(footage, recording=replace(footage.recording, references=(), subject=Subject(height=1.7)))
    (doubt,) = [each for each in camera_doubts(replace(look, calibrated=calibrated), footage, whole=False) if "distance" in each.short]
    assert not [each for each in camera_doubts(replace(look, calibrated=calibrated), footage, whole=True) if "distance" in each.short]
    assert doubt.severity == weight


def test_a_guessed_camera_is_said(recording, tmp_path):
    bare = made.copied(recording, tmp_path / "bare", without=["calibration.toml"])
    said = doubts(bare, fov=60.0, initialization=QUICK)
    assert "no calibration of the camera's place: it is taken for level, with a field of view of 60 degrees" in said
    background = str(recording / "background" / "cam.mp4")
    values = {"fov": 60, "height": 1.7, "distance": 2, "background": background, "initialization": QUICK}
    film = look_at(recording / "video" / "cam.mp4", make_options(values))
    assert film.background == "background/cam.mp4"
    assert film.person["source"].startswith("proportions")


def test_a_head_that_never_moves_makes_a_recording_doubtful():
    scene = RecoveredScene(np.zeros((4, 4), np.uint8), np.ones((4, 4), bool), 60, head_still=True)
    (said, _) = recovery_cautions(["cam"], [Silhouettes("the film", None, recovered=scene)])
    assert (said.severity, said.short) == (HARMFUL, "head never moves: film the empty scene")


def test_a_scene_taken_from_the_film_is_said(recording, tmp_path):
    bare = made.copied(recording, tmp_path / "bare", without=["background", "masks", "references"])
    film = made.images(recording / "video" / "cam.mp4")
    shift = 60
    walk = [np.roll(image, shift * (n % 3 - 1), axis=1) for n, image in enumerate(film)]  # the person, and the room, move
    made.write_film(bare / "video" / "cam.mp4", walk)
    look = look_at_masks(bare)
    assert "the film itself (recovered from" in look.background
    assert any("no picture of the empty scene: it was recovered from the film" in doubt for doubt in look.doubts)


def look_at_masks(recording):
    """The look without the search for the person."""
    footage = open_footage(recording, Options())
    return _look(footage, survey_film(footage, Options()), Options())


def test_uneven_times_are_said(recording, tmp_path):
    frames = made.copied(recording, tmp_path / "frames", without=["video/cam.mp4"])
    from shadowpuppet.video import write_image

    (frames / "video" / "cam").mkdir()
    times = np.cumsum(np.where(np.arange(made.FRAMES) % 2, 0.05, 0.15))
    for n, image in enumerate(made.images(recording / "video" / "cam.mp4")):
        write_image(frames / "video" / "cam" / f"{n}.png", image)
    (frames / "video" / "cam" / "timestamps.txt").write_text("\n".join(map(str, times)))
    look = look_at(frames)
    assert look.jitter == pytest.approx(0.05, abs=0.001)
    assert any("the time from frame to frame varies by" in doubt for doubt in look.doubts)


# Refusals


def test_a_film_that_does_not_show_its_background_is_bad_and_says_why(recording, tmp_path):
    other = made.copied(recording, tmp_path / "other")
    made.write_film(other / "video" / "cam.mp4", [255 - image for image in made.images(recording / "video" / "cam.mp4")])
    with pytest.raises(RecordingError, match=r"side_arms_hanging\.png: the silhouette is empty"):
        look_at(other)
    (other / "references").rename(tmp_path / "references")
    verdict = verdict_of_look(look_at(other))
    assert verdict.word == "bad"
    assert any("the empty scene is another place's: film it again" in reason for reason in verdict.reasons)


def test_references_in_another_posture_are_refused(recording, tmp_path):
    wrong = made.copied(recording, tmp_path / "wrong")
    for name in ("front_t_pose", "front_arms_t_pose"):  # arms hanging: sizes can make up for it, so that the overlap alone is high
        image = made.images(recording / "references" / "side_arms_hanging.png")[0]
        _write(wrong / "references" / f"{name}.png", image)
    with pytest.raises(RecordingError, match=r"references/front_t_pose.png: not the posture front_t_pose, it seems: .*; face the camera, "):
        look_at(wrong)
    other = made.copied(recording, tmp_path / "other")
    _write(other / "references" / "side_arms_hanging.png", made.images(recording / "references" / "front_t_pose.png")[0])
    with pytest.raises(RecordingError, match=r"side_arms_hanging.png: not the posture side_arms_hanging, .*; turn to show the left"):
        look_at(other)


def test_empty_references_and_those_of_another_size_are_refused(recording, tmp_path):
    empty = made.copied(recording, tmp_path / "empty")
    _write(empty / "references" / "front_t_pose.png", made.images(recording / "background" / "cam.mp4")[0])
    with pytest.raises(RecordingError, match=r"front_t_pose.png: the silhouette is empty, expected the person in the posture front_t_pose"):
        look_at(empty)
    changed = made.copied(recording, tmp_path / "changed")  # the light, say: the mask is of all
    for name in POSTURES:
        image = made.images(recording / "references" / f"{name}.png")[0]
        _write(changed / "references" / f"{name}.png", np.where(image < 128, 255, 0).astype(np.uint8))
        with pytest.raises(RecordingError, match=rf"{name}.png: the silhouette covers \d+ % of the picture, expected the person in the "):
            look_at(changed)
        _write(changed / "references" / f"{name}.png", image)
    large = made.copied(recording, tmp_path / "large")
    _write(large / "references" / "front_t_pose.png", np.zeros((240, 320, 3), np.uint8))
    with pytest.raises(RecordingError, match=r"front_t_pose.png: found a reference of 320 x 240 pixels, expected 160 x 120 as the film"):
        look_at(large)


def _write(path, image) -> None:
    from shadowpuppet.video import write_image

    write_image(path, image)


def _drawn(posture: str, pose_of: str, distance: float = 2.0):
    """What `wrong_posture` is asked of a body drawn in one posture that is said to be another."""
    camera = replace(Camera.from_fov((320, 240), np.radians(60)), oriented=True)
    guess = PersonEstimate(sizes_from_height(1.75), 1.75, distance, -0.55)
    picture = guess.picture(camera)
    pose, said = (picture.body.skeleton.pose(**POSTURES[name]) for name in (pose_of, posture))
    return camera, picture.mask(pose), posture, SizeFit(guess, {}, {posture: 0.9}, np.array([said])), said


@pytest.mark.parametrize("posture", POSTURES)
def test_the_right_posture_is_not_doubted(posture):
    assert wrong_posture(*_drawn(posture, posture)) is None


def test_an_arm_that_lacks_one_side_in_a_small_picture_is_no_wrong_posture():
    camera, mask, *rest = _drawn("front_t_pose", "front_t_pose", distance=4.0)
    rows = np.flatnonzero(mask[:, 120])  # of an arm
    thin = mask.copy()
    thin[rows[0] - 2 : rows[0] + len(rows) // 2 + 1, :140] = False
    assert 0 < np.count_nonzero(thin[:, 120]) < len(rows)
    assert wrong_posture(camera, thin, *rest) is None


def test_arms_that_are_not_seen_and_trunks_that_are_too_deep_show_a_wrong_posture():
    assert "0 % of the level forearms are in the silhouette" in str(wrong_posture(*_drawn("front_t_pose", "side_arms_hanging")))
    camera, mask, name, fit, pose = _drawn("side_arms_hanging", "side_arms_hanging")
    sizes = fit.guess.sizes
    wide = 2 * DEEP * max(sizes.shoulder_width, sizes.torso_bottom_width)
    deep = replace(fit, guess=replace(fit.guess, sizes=sizes.with_values(torso_top_depth=wide, torso_bottom_depth=wide)))
    assert "expected less depth than width" in str(wrong_posture(camera, mask, name, deep, pose))
    broad = replace(fit, guess=replace(fit.guess, sizes=sizes.with_values(torso_bottom_width=0.7)), overlaps={"front_t_pose": 0.9})
    assert "the trunk is 0.70 m wide, expected under 0.58" in str(wrong_posture(camera, mask, "front_t_pose", broad, pose))
    assert "by 0.30 only" in str(wrong_posture(camera, mask, name, replace(fit, overlaps={name: 0.3}), pose))


def seated_doubts(folder, motion, options=None):
    synthesize(replace(made.SPEC, motion=parse_gestures(motion)), folder, np.random.default_rng(3))
    survey = MONOCULAR.survey(open_rig(folder, options or Options()), options or Options())
    return {doubt.short: doubt for doubt in survey.look.findings}


def test_who_sits_down_later_is_told_from_who_bows(tmp_path):
    (short,) = seated_doubts(tmp_path / "sits", "stand 3, sit_down 4")
    assert re.fullmatch(r"person sits or kneels at [4-6].\d s: cut, or --body anatomical", short)
    assert seated_doubts(tmp_path / "bows", "bow_forward 3, wave_hands 2") == {}


def test_feet_are_missed_only_where_legs_are_tracked(tmp_path):
    found = seated_doubts(tmp_path / "stands", "wave_hands 2", make_options({"body": "anatomical"}))
    assert [(each.short, each.severity) for each in found.values()] == [("feet are cut off: step back, or tilt the camera", HARMFUL)]


# What is looked at


@given(st.integers(0, LOOKED_AT))
def test_a_sample_is_spread_over_the_film_in_runs(length):
    wanted = _spread(length)
    assert all(0 <= n < max(length, 1) for n in wanted)
    assert min(wanted) == 0
    assert max(wanted) == max(length, 1) - 1
    runs = {start: sorted(n for n, of in wanted.items() if of == start) for start in set(wanted.values())}
    assert all(run == list(range(start, start + len(run))) for start, run in runs.items())
    assert len(wanted) <= RUNS * RUN


def test_a_sample_has_the_first_seconds(recording):
    sample = take_sample(open_footage(recording, Options()))
    first = [shot.time for shot in sample.first]
    end = min(FIRST_SECONDS, sample.times[-1])
    assert first[0] == 0
    assert end - FIRST_SECONDS / FIRST - 1 / made.RATE <= first[-1] <= FIRST_SECONDS
    assert np.diff(first) == pytest.approx(FIRST_SECONDS / FIRST, abs=1 / made.RATE)
    assert len(sample.times) == made.FRAMES
    assert all(shot.ready is not None for shot in sample.frames)


masks = st.lists(st.integers(0, 2**16 - 1), min_size=3, max_size=9).map(
    lambda numbers: [np.random.default_rng(n).random((12, 16)) < 0.4 for n in numbers])


@settings(deadline=None)
@given(masks)
def test_the_quality_of_one_run_is_that_of_its_masks(run):
    ours, right = asdict(quality_of([run], [0])), asdict(mask_quality(run))
    assert ours.pop("border") == pytest.approx(right.pop("border"))
    assert ours == pytest.approx(right)


@settings(deadline=None)
@given(masks, masks)
def test_the_quality_of_two_runs_lies_between(first, second):
    both, one, two = quality_of([first, second], [0, 50]), mask_quality(first), mask_quality(second)
    assert both.frames == one.frames + two.frames
    for name in ("area", "area_change", "area_jumps", "flicker", "specks", "holes"):
        low, high = sorted([getattr(one, name), getattr(two, name)])
        assert low - 1e-9 <= getattr(both, name) <= high + 1e-9


def test_the_first_bad_frame_is_counted_in_the_film():
    empty, person = np.zeros((12, 16), bool), np.pad(np.ones((8, 4), bool), [(2, 2), (6, 6)])
    quality = quality_of([[person, person], [person, empty]], [0, 50])
    assert (quality.empty, quality.first_empty) == (1, 51)


# What is asked for


def test_a_camera_that_is_not_there_is_said_with_those_that_are(recording):
    with pytest.raises(RecordingError, match=r"tiny: camera: found 'left', expected one of cam"):
        look_at(recording, Options(camera="left"))


@pytest.mark.shared
def test_of_several_cameras_one_is_to_be_chosen(shared):
    with pytest.raises(RecordingError, match=r"found 7 cameras, expected one to be chosen with --camera: cam1?"):
        open_footage(shared / "recordings" / "walking", Options())


@pytest.mark.parametrize(("region", "said"), [("0,0,161,100", "found 0,0,161,100, expected .* 160"), ("20,0,20,9", "found 20,0,20,9"),
                                              ("1,2,3", "expected four numbers x0,y0,x1,y1, found 3"), ("a,0,9,9", "region")])
def test_regions_outside_the_film_are_said(recording, region, said):
    with pytest.raises(SettingsError, match=said):
        open_footage(recording, make_options({"region": region}))


@pytest.mark.parametrize(("values", "said"), [
    ({"sed": 1}, r"unknown setting 'sed'; there are: anyway, appearance, background, .*seed"),
    ({"tracker": {"arm": {"particle": 3}}}, r"tracker: unknown setting 'arm.particle'; there are: particles, sigma_cost"),
    ({"tracker": 3}, r"tracker: found 3, expected a table \[tracker\]"),
    ({"preset": "liu"}, r"unknown preset 'liu'; there are: default, liu2011"),
    ({"preset": 7}, r"preset: found 7, expected a name in quotes"),
    ({"silhouette": {"method": "magic"}}, r"silhouette.method: found 'magic'"),
    ({"seed": -1}, r"seed: found -1; .*greater than or equal to 0"),
    ({"height": 178}, r"height: found 178; expected 0.5 to 2.5 metres \(178 cm are 1.78\)"),
])  # fmt: skip
def test_wrong_settings_are_said_with_what_is_possible(values, said):
    with pytest.raises(SettingsError, match=said):
        make_options(values)


def test_live_cameras_are_for_later():
    with pytest.raises(ShadowPuppetError, match="camera"):
        open_footage("camera:99", Options(fov=60))


def found_without_references(overlaps: int, place: float) -> SizeFit:
    guess = PersonEstimate(sizes_from_height(1.7), 1.7, 2.0, 0.0)
    return SizeFit(guess, {}, {str(k): 0.85 for k in range(overlaps)}, np.zeros((overlaps, 12)), place)


def test_a_distance_that_silhouettes_do_not_show_is_doubted():
    certain, uncertain = (_doubts(found_without_references(12, place), "proportions", 0.85, 12) for place in (0.8, 0.6))
    assert not certain
    assert [doubt.words.startswith("at no distance a person who faces the camera") for doubt in uncertain] == [True]
    assert not _doubts(found_without_references(12, np.nan), "proportions", 0.85, 12)


def test_a_person_who_is_elsewhere_in_many_moments_is_doubted():
    (doubt,) = _doubts(found_without_references(8, 0.8), "proportions", 0.2, 12)
    assert doubt.words.startswith("in 4 of 12 moments of the film the person is at another distance or height")
    assert not _doubts(found_without_references(10, 0.8), "proportions", 0.85, 12)
    known = replace(found_without_references(1, np.nan), overlaps={"front_t_pose": 0.9})
    assert not _doubts(known, "references", 0.85, 12)


def test_only_forearms_in_the_picture_count():
    near = PersonEstimate(sizes_from_height(1.75), 1.75, 1.2, -0.3)
    camera = Camera.from_fov((160, 120), np.radians(50))
    picture = near.picture(camera)
    pose = picture.body.skeleton.pose(**POSTURES["front_t_pose"])
    ends = camera.project(picture.points_world(pose[None])[0])
    hands = ends[[picture.body.landmark_names.index(f"{s}_wrist") for s in ("left", "right")]]
    assert hands[:, 0].min() < -1
    assert hands[:, 0].max() > 161
    assert _forearms_seen(camera, picture.mask(pose), near, pose) == 1
    assert _forearms_seen(camera, np.zeros((120, 160), bool), near, pose) == 0
