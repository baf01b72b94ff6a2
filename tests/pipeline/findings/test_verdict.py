"""Verdicts on recordings and on runs: the word, the reasons, their order and their length."""

from __future__ import annotations

import copy
import json
from dataclasses import FrozenInstanceError, fields, replace

import numpy as np
import pytest

from shadowpuppet.calibration.agreement import Agreement
from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import HARMFUL, NOTED, RUINOUS, Finding
from shadowpuppet.motion.limbs import limbs_of
from shadowpuppet.motion.motion import Motion, MotionBuilder, MotionFrame
from shadowpuppet.pipeline.findings.look import Look, RigLook
from shadowpuppet.pipeline.findings.verdict import (
    Verdict,
    blind_frames,
    expected_error,
    lost_share,
    verdict_of,
    verdict_of_look,
    verdict_of_run,
)
from shadowpuppet.pipeline.progress import json_text
from shadowpuppet.silhouette.correction.condition import FilmCondition
from shadowpuppet.silhouette.quality import MaskQuality

JOINTS = ("pelvis", "left_shoulder", "left_elbow", "left_hand", "right_shoulder", "right_elbow", "right_hand")
QUALITY = MaskQuality(frames=40, area=0.1, area_change=0.0, area_jumps=0.0, flicker=0.0, specks=0.0, speck_area=0.0, holes=0.0,
                      hole_area=0.0, border=dict.fromkeys(("left", "top", "right", "bottom"), 0.0), empty=0, full=0)
LOOK = Look(recording="film", camera="cam", size=(320, 240), worked_size=(320, 240), fov=60.0, calibrated=True, lens_calibrated=True,
            frames=100, looked_at=100, rate=25.0, jitter=0.0, scale="height 1.80 m", background="film", key="both", area=0.1,
            plain_area=None, exact_overlap=None, exact_overlap_plain=None, quality=QUALITY)

CAMERA = Camera.from_fov((320, 240), 1.0)
"""At the origin, with depth along y."""


def caution(weight: int, name: str = "x") -> Finding:
    return Finding(f"a sentence on {name}", name, weight)


@pytest.mark.parametrize(("weights", "word"), [((), "good"), ((NOTED,) * 5, "good"), ((NOTED, HARMFUL), "doubtful"),
                                               ((HARMFUL, RUINOUS, NOTED), "bad")])
def test_the_heaviest_reason_decides(weights, word):
    assert verdict_of(caution(weight) for weight in weights).word == word


def test_reasons_are_the_three_heaviest_each_once():
    verdict = verdict_of([caution(NOTED, "a"), caution(HARMFUL, "b"), caution(HARMFUL, "c"), caution(RUINOUS, "d"), caution(HARMFUL, "b")])
    assert verdict.reasons == ("d", "b", "c")


def test_a_reason_that_cameras_share_is_said_once_with_their_names():
    shared, other = Finding("compressed too much", "compressed: use less", HARMFUL), caution(NOTED, "b")
    verdict = verdict_of([shared.about("cam1"), shared.about("cam2"), other, caution(HARMFUL).about("cam1"), shared.about("cam4")])
    assert verdict.reasons == ("cam1, cam2, cam4: compressed: use less", "cam1: x", "b")


def test_a_finding_reads_as_its_sentence_and_survives_copies():
    made = Finding("long and whole", "short", HARMFUL)
    for same in (made, copy.deepcopy(made), copy.copy(made)):
        assert (str(same), same.short, same.severity) == ("long and whole", "short", HARMFUL)
    assert made.at_most(NOTED).severity == NOTED
    assert made.at_most(RUINOUS).severity == HARMFUL
    about = made.about("camera 'a'")
    assert (str(about), about.short, about.severity) == ("camera 'a': long and whole", "camera 'a': short", HARMFUL)


def test_a_findings_words_hold_its_figures_and_no_name_in_them_is_a_figure():
    made = Finding.of("camera {camera!r} moved by {pixels:.1f} pixels", "{camera}: {pixels:.0f} px", HARMFUL, camera="{pixels}", pixels=2.6)
    assert (made.words, made.short) == ("camera '{pixels}' moved by 2.6 pixels", "{pixels}: 3 px")
    assert made.evidence == {"camera": "{pixels}", "pixels": 2.6}
    assert made.about("film").evidence == made.at_most(NOTED).evidence == made.evidence
    assert "2.6 pixels" in made
    with pytest.raises(FrozenInstanceError):
        made.words = "nothing"


def test_findings_are_saved_with_their_evidence():
    (saved,) = json.loads(json_text(replace(LOOK, findings=(Finding.of("{x:.1f}", "x", NOTED, x=np.float64(1.25)),))))["findings"]
    assert saved == {"words": "1.2", "short": "x", "severity": NOTED, "evidence": {"x": 1.25}, "what": ""}


def test_a_recording_that_cannot_be_tracked_is_bad():
    assert verdict_of_look(replace(LOOK, refusal="nobody is in it")) == ("bad", ("nobody is in it",), None)
    assert verdict_of_look(LOOK).word == "good"


def all_cautions() -> list[Finding]:
    """Those of the worst silhouettes, film and cameras."""
    worst = replace(QUALITY, area=0.001, area_change=1.0, area_jumps=1.0, flicker=1.0, specks=9.0, speck_area=1.0, holes=9.0, hole_area=1.0,
                    border=dict.fromkeys(QUALITY.border, 1.0), empty=9, full=9, first_empty=3, first_full=7)
    numbers = dict.fromkeys((field.name for field in fields(FilmCondition)), 50.0)
    film = FilmCondition(**{**numbers, "gain": (0.3, 3.0), "moved_since": None, "change": None, "copied": None})
    apart = Agreement(names=("a", "b", "c", "d"), apart=(1.0, 1.0, 50.0, 1.0), pairs=((None,) * 4,) * 4, limit=10.0, height=1.8)
    return [*worst.warnings(), *film.warnings(), *film.warnings(recovered=True),
            *replace(film, moved_since=1.0, change=1.0, copied=1.0).warnings(), *apart.doubts(),
            *replace(apart, apart=(50.0,) * 4).doubts(), *replace(apart, remedy="say so").doubts()]


def test_every_reason_has_at_most_ten_words():
    cautions = all_cautions()
    assert len(cautions) > 15
    for each in cautions:
        assert 3 <= len(each.short.split()) <= 10, each.short
        assert len(each.words.split()) > len(each.short.split()) or each.words == "say so"
        assert each.severity in (NOTED, HARMFUL, RUINOUS)


def motion(sd: float, *, statuses: str = "tttttttttt", doubtful: int = 0) -> Motion:
    """Ten frames: tracked, lost or absent, with one standard deviation; the left arm doubtful in the first ones."""
    built = MotionBuilder("cardbox", ("x",), JOINTS)
    for n, letter in enumerate(statuses):
        status = {"t": "tracked", "l": "lost", "a": "absent"}[letter]
        if status != "tracked":
            built.append(MotionFrame(float(n), status))
            continue
        limbs = ["uncertain" if limb == "left_arm" and n < doubtful else "tracked" for limb in limbs_of(JOINTS)]
        built.append(MotionFrame(float(n), status, np.zeros(1), np.zeros((7, 3)), joint_sd=np.full((7, 3), sd), limb_status=limbs))
    return built.build()


def test_errors_that_intervals_lead_one_to_expect_are_met_by_draws():
    rng = np.random.default_rng(2)
    drawn = np.linalg.norm(rng.normal(size=(100_000, 3)) * 0.05, axis=1).mean()
    assert expected_error(motion(0.05)) == pytest.approx(drawn, rel=0.01)
    assert expected_error(motion(0.0, statuses="tttttttttl")) == pytest.approx(0.05)  # a lost joint counts as half a metre
    assert expected_error(motion(0.05, statuses="ttttttttaa")) == pytest.approx(drawn, rel=0.01)


@pytest.mark.parametrize(("run", "word", "reason"), [
    (motion(0.03), "good", None),
    (motion(0.03, statuses="tttttttlaa"), "doubtful", "person lost in 12 % of frames: look where (`view`)"),
    (motion(0.03, statuses="ttlllaaaaa"), "bad", "person lost in 60 % of frames: look where (`view`)"),
    (motion(0.03, statuses="aaaaaaaaaa"), "bad", "nobody was seen: film the empty scene and the person"),
    (motion(0.03, doubtful=2), "good", "left arm doubtful in 20 % of frames"),
    (motion(0.03, doubtful=8), "doubtful", "left arm doubtful in 80 % of frames"),
    (motion(0.3), "bad", "joints may be off by 479 mm on average")])
def test_runs_are_judged_by_what_they_state(run, word, reason):
    verdict = verdict_of_run(LOOK, run)
    assert verdict.word == word
    assert verdict.reasons[:1] == (() if reason is None else (reason,))


@pytest.mark.parametrize(("sd", "words", "reasons"), [
    ((0.03, 0.03, 0.03), "good", ()),
    ((0.03, 0.3, 0.03), "good in the picture, bad in depth", ("depths may be off by 239 mm: add a camera aside",)),
    ((0.03, 0.14, 0.03), "good in the picture, doubtful in depth", ("depths may be off by 112 mm: add a camera aside",)),
    ((0.3, 0.03, 0.03), "bad", ("joints may be off by 267 mm on average",)),
    ((0.3, 0.3, 0.3), "bad", ("joints may be off by 376 mm on average", "depths may be off by 239 mm: add a camera aside"))])
def test_one_camera_is_judged_in_the_picture_and_in_depth(sd, words, reasons):
    run = motion(0.0)
    run = replace(run, joint_sd=np.broadcast_to(sd, run.joint_sd.shape), joints=run.joints + np.array([0, 4, 0]))
    found = verdict_of_run(LOOK, run, camera=CAMERA)
    assert (found.words, found.reasons) == (words, reasons)
    assert Verdict.of(json.loads(json.dumps(found.plain()))) == found


@pytest.mark.parametrize(("sd", "words"), [((0.02, 0.06, 0.02), "good in the picture, doubtful in depth"),
                                           ((0.06, 0.02, 0.06), "doubtful")])
def test_a_limb_is_doubtful_where_it_may_be_farther_off(sd, words):
    run = motion(0.0, doubtful=8)
    run = replace(run, joint_sd=np.broadcast_to(sd, run.joint_sd.shape), joints=run.joints + np.array([0, 4, 0]))
    found = verdict_of_run(LOOK, run, camera=CAMERA)
    assert (found.words, found.reasons) == (words, ("left arm doubtful in 80 % of frames",))


@pytest.mark.parametrize(("arm", "word"), [(0.03, "good"), (0.05, "doubtful")])
def test_with_several_cameras_an_arm_that_is_often_doubtful_counts_where_it_may_be_far_off(arm, word):
    """The arm is expected to be off by 48 or 80 mm, the whole body by under 50."""
    run = motion(0.012, doubtful=8)
    deviations = run.joint_sd.copy()
    deviations[:, 1:4] = arm
    rig = RigLook(recording="lab", cameras=(None,) * 4, rate=25.0, frames=10, agreement=None)
    found = verdict_of_run(rig, replace(run, joint_sd=deviations))
    assert found[:2] == (word, ("left arm doubtful in 80 % of frames",))
    assert verdict_of_run(LOOK, run).word == "doubtful"


def test_frames_without_a_person_are_not_lost():
    assert lost_share(motion(0.03, statuses="tllaaaaaaa")) == pytest.approx(2 / 3)
    assert lost_share(motion(0.03, statuses="aaaaaaaaaa")) == 0


@pytest.mark.parametrize(("frames", "word"), [((4, 3), "doubtful"), ((1,), "good")])
def test_a_camera_that_was_set_aside_is_a_reason_once_and_by_name(frames, word):
    run = motion(0.03, statuses="t" * 30)
    aside = [{"camera": "b", "why": "late", "frames": many, "from_s": 2.25 + n, "to_s": 2.25 + n} for n, many in enumerate(frames)]
    assert verdict_of_run(LOOK, run, aside)[:2] == (word, ("camera 'b' late from 2.2 s: check its start",))


def test_frames_in_which_every_camera_was_blind_are_no_error_of_the_joints():
    """A second without a picture makes a good run doubtful, not bad; a person lost in pictures that show them counts in full."""
    run = motion(0.06, statuses="tttttttttl")
    black = [{"camera": "cam", "why": "blind", "frames": 1, "from_s": 9.0, "to_s": 9.0}]
    assert (expected_error(run), expected_error(run, blind_frames(run, black, 1))) == pytest.approx((0.136, 0.096), abs=1e-3)
    assert verdict_of_run(LOOK, run).word == "bad"
    assert verdict_of_run(LOOK, run, black)[:2] == ("doubtful", ("person lost in 10 % of frames: look where (`view`)",
                                                             "camera 'cam' blind from 9.0 s: look at its film"))
    assert not blind_frames(run, black, 2).any()
    assert not blind_frames(run, [black[0] | {"why": "frozen"}], 1).any()


@pytest.mark.parametrize(("frames", "word"), [((10, 10), "good"), ((96, 100), "good"), ((94, 100), "doubtful"), ((42, 617), "bad"),
                                              ((10, None), "good"), ((12, 10), "good")])
def test_a_run_with_far_fewer_frames_than_the_film_states_is_not_good(frames, word):
    verdict = verdict_of_run(LOOK, motion(0.03), (), frames)
    assert verdict.word == word
    assert verdict.reasons == (() if word == "good" else (f"{frames[0]} of the film's {frames[1]} frames: is it whole?",))


def test_what_the_look_found_is_among_the_reasons():
    verdict = verdict_of_run(replace(LOOK, findings=(caution(HARMFUL, "film is noisy: use more light"),)), motion(0.03, doubtful=2))
    assert verdict[:2] == ("doubtful", ("film is noisy: use more light", "left arm doubtful in 20 % of frames"))


@pytest.mark.parametrize(("limbs", "reason"), [(("left_arm",), "left arm doubtful in 80 % of frames"),
                                               (("trunk", "left_arm"), "trunk, left arm doubtful in 70 to 80 % of frames"),
                                               (("left_arm", "right_arm"), "both arms doubtful in 80 to 90 % of frames"),
                                               (("trunk", "left_arm", "right_arm"), "all limbs doubtful in 70 to 90 % of frames")])
def test_limbs_that_are_often_doubtful_take_one_reason(limbs, reason):
    often, clean = {"trunk": 7, "left_arm": 8, "right_arm": 9}, motion(0.03)
    statuses = clean.limb_status.copy()
    for limb in limbs:
        statuses[: often[limb], clean.limbs.index(limb)] = "uncertain"
    found = verdict_of_run(replace(LOOK, findings=()), replace(clean, limb_status=statuses))
    assert [each for each in found.reasons if "doubtful" in each] == [reason]
