"""Which body one camera's film asks for, and how a run follows it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from shadowpuppet.io.run import read_run
from shadowpuppet.pipeline.findings.body import MOVES, body_for, walking_cautions
from shadowpuppet.pipeline.options import Options, make_options
from shadowpuppet.pipeline.prepare import as_before, for_person, look_at
from shadowpuppet.pipeline.rig import open_rig
from shadowpuppet.pipeline.track import track_recording
from shadowpuppet.synthetic import Gesture, Mannequin, Scene, Spec, Viewpoint, synthesize

HIGH = 100


def person(x: float = 100, low: float = 200, legs: bool = True, squats: float = 0) -> np.ndarray:
    """A mask (240, 240) of a trunk `HIGH` high that ends in a row `low`, on legs or not, or as much lower as the person `squats`."""
    rows, columns = np.mgrid[:240, :240]
    from_low = low - rows
    trunk = (from_low >= (0.4 * HIGH if legs else 0)) & (from_low < HIGH - squats) & (abs(columns - x) < 18)
    feet = (from_low >= 0) & (from_low < 0.5 * HIGH) & (abs(abs(columns - x) - 9) < 5) & legs
    return trunk | feet


@pytest.mark.parametrize(("masks", "body"), [
    ([person() for _ in range(9)], "rounded"),
    ([person(x) for x in np.linspace(60, 60 + 2 * MOVES * HIGH, 9)], "anatomical"),
    ([person(low=low) for low in np.linspace(150, 150 + 2 * MOVES * HIGH, 9)], "anatomical"),
    ([person(squats=drop) for drop in np.linspace(0, 2 * MOVES * HIGH, 9)], "anatomical"),
    ([person(legs=False, squats=drop) for drop in np.linspace(0, 2 * MOVES * HIGH, 9)], "rounded"),  # sits down behind a table
    ([person(x, legs=False) for x in np.linspace(60, 120, 9)], "rounded"),  # walks behind one
    ([person(x, low=260) for x in np.linspace(60, 120, 9)], "rounded"),  # the feet are cut off
    ([person(x, low=260 if x < 110 else 200) for x in np.linspace(60, 120, 9)], "anatomical"),  # but not always
    ([np.zeros((240, 240), bool)] * 3, "rounded"),
    ([], "rounded"),
])  # fmt: skip
def test_who_does_not_stay_in_one_place_is_tracked_whole(masks, body):
    assert body_for(masks) == body


@pytest.mark.parametrize(("masks", "said"), [
    ([person(x, legs=False) for x in np.linspace(60, 60 + 2 * MOVES * HIGH, 9)], 1),
    ([person(x, legs=False) for x in np.linspace(60, 60 + MOVES * HIGH, 9)], 0),
    ([person(60 if n else 160, legs=False) for n in range(9)], 0),  # somebody passes
    ([np.zeros((240, 240), bool)] * 3, 0),
])  # fmt: skip
def test_who_goes_about_with_feet_unseen_is_at_an_unknown_distance(masks, said):
    found = walking_cautions(masks)
    assert [each.short for each in found] == ["person goes about, feet unseen: distance unknown; step back"] * said


def test_a_body_that_is_said_or_a_paper_s_or_given_sizes_or_references_is_kept(tmp_path):
    assert not Options().body_is_known
    for values in ({"body": "rounded"}, {"preset": "liu2011"}, {"person": str(tmp_path / "person.toml")}, {"tracker": {"body": "boxes"}}):
        assert make_options(values).body_is_known
    whole = Options().with_body("anatomical")
    assert (whole.body, whole.tracker.body) == ("anatomical", "anatomical")
    assert whole == make_options({"body": "anatomical"})
    assert Options().with_body("rounded") == Options()


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    """A film of a person who walks across, without reference pictures."""
    place = tmp_path_factory.mktemp("walk") / "walk"
    spec = Spec(body=Mannequin.draw(np.random.default_rng(3), "man"), motion=(Gesture(motion="walk", seconds=3.0, path="line", size=2.0),),
                turn_deg=90, cameras=(Viewpoint(size=(160, 120), height=1.3, distance=5.0, fov_deg=60),), rate=8, tells="height",
                begin=1.0, frames=16, scene=Scene(empty_seconds=1.0), seed=5)
    synthesize(replace(spec), place)
    for path in (place / "references").glob("*"):
        path.unlink()
    (place / "references").rmdir()
    return place


def test_a_run_tracks_the_whole_person_who_walks_and_goes_on_so(walk, tmp_path):
    quick = {"seed": 1, "masks": True, "tracker": {"torso": {"particles": 20}, "arm": {"particles": 20}, "explore": 20}}
    run = track_recording(walk, tmp_path / "run", make_options(quick))
    assert run.look is not None
    assert run.look.body == "anatomical"
    assert any("the whole person is tracked" in finding.short for finding in run.look.findings)
    kept = read_run(tmp_path / "run")
    assert kept.motion.body_name == "anatomical"
    assert {"left_ankle", "right_knee"} <= set(kept.motion.joint_names)
    assert kept.info["settings"]["body"] == kept.info["settings"]["tracker"]["body"] == "anatomical"
    assert as_before(tmp_path / "run", make_options(quick)).body == "anatomical"
    assert as_before(tmp_path / "elsewhere", make_options(quick)).body is None

    known = make_options(quick | {"person": str(tmp_path / "run" / "person.toml")})  # of the whole body, which nobody needs to say
    assert for_person(open_rig(walk, known), known).body == "anatomical"
    assert look_at(walk, known).person["source"] == str(known.person)

    upper = track_recording(walk, tmp_path / "upper", make_options(quick | {"body": "rounded"}))
    assert upper.motion.body_name == "rounded"
    assert not any("the whole person" in finding.short for finding in upper.look.findings)
    of_upper = make_options(quick | {"person": str(tmp_path / "upper" / "person.toml")})
    assert for_person(open_rig(walk, of_upper), of_upper) == of_upper
