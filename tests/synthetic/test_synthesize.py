"""`shadowpuppet synthesize`, and specs as files, as values and as a few words."""

from __future__ import annotations

import tomllib
from dataclasses import replace

import acclaim
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shadowpuppet.errors import RecordingError, SettingsError
from shadowpuppet.io.motion.table import read_joints
from shadowpuppet.io.recording import read_recording
from shadowpuppet.pipeline.synthesize import make_recording
from shadowpuppet.pipeline.track import Listener
from shadowpuppet.synthetic import (
    Bystander,
    Gesture,
    Mannequin,
    Obstacle,
    Ring,
    Scene,
    Spec,
    Viewpoint,
    around,
    named_specs,
    proving_ground,
    proving_rings,
    read_spec,
    resting,
    spec_from,
    spec_text,
    synthesize,
)
from shadowpuppet.synthetic.movement.gestures import GESTURES
from shadowpuppet.synthetic.recording import covered_places, perform
from shadowpuppet.synthetic.spec_changes import SpecChanges, apply_changes, parse_gestures
from shadowpuppet.synthetic.spec_file import SPEC_HEADER, seed_of
from shadowpuppet.synthetic.truth import SOLES
from shadowpuppet.video import open_frames

TINY = ["--size", "64x48", "--rate", "4", "--seconds", "2"]
SMALL = Spec(motion=(Gesture(motion="stand", seconds=2),), cameras=(Viewpoint(size=(64, 48)),), rate=2, scene=Scene(empty_seconds=0.5))


@pytest.fixture
def shell(shell):
    """Runs `shadowpuppet synthesize`, or another command that is named."""
    return lambda *tokens, command="synthesize": shell(command, *tokens)


def frames(path):
    return [frame.image for frame in open_frames(path)]


# Specs as files

numbers = st.floats(0, 1)
obstacles = st.builds(Obstacle, kind=st.sampled_from(["table", "chair", "pillar", "cabinet"]), ahead=st.floats(0.4, 1),
                      left=st.floats(-1, 1), turn_deg=st.floats(-180, 180), colour=st.integers(0, 99))  # fmt: skip
bystanders = st.builds(Bystander, kind=st.sampled_from(["woman", "man", "child", "random"]), seed=st.integers(0, 99),
                       ahead=st.floats(-3, -1), left=st.floats(-2, 2), turn_deg=st.floats(-180, 180),
                       away=st.none() | st.tuples(st.floats(0, 9), st.floats(0, 9)))  # fmt: skip
scenes = st.builds(Scene, clothing=st.integers(0, 9), shadow=numbers, noise=st.floats(0, 40), camouflage=numbers,
                   flicker=st.floats(0, 0.5), drift=st.floats(-0.5, 0.5), crf=st.integers(0, 51),
                   background=st.sampled_from(["room", "plain", "cluttered", "textured"]),
                   obstacles=st.lists(obstacles, max_size=2).map(tuple),
                   bystanders=st.lists(bystanders, max_size=2).map(tuple))  # fmt: skip
sides = st.integers(16, 999)
views = st.builds(Viewpoint, size=st.tuples(sides, sides), fov_deg=st.floats(20, 100), height=st.floats(0.5, 3),
                  distance=st.floats(4, 9), azimuth_deg=st.floats(-180, 180), pitch_deg=st.floats(-40, 40),
                  roll_deg=st.floats(-180, 180), yaw_deg=st.floats(-40, 40),
                  distortion=st.sampled_from([(), (-0.02, 0.01, 0.0, 0.0)]))  # fmt: skip
gestures = st.builds(Gesture, motion=st.sampled_from(sorted(GESTURES)), seconds=st.floats(2, 99))
specs = st.builds(
    Spec,
    name=st.from_regex(r"[A-Za-z0-9_-]{1,9}", fullmatch=True),
    body=st.builds(Mannequin.draw, st.integers(0, 999).map(np.random.default_rng)),
    motion=st.lists(gestures, min_size=1, max_size=3).map(tuple),
    cameras=st.lists(views, min_size=1, max_size=2).map(lambda some: tuple(replace(v, name=f"c{n}") for n, v in enumerate(some))),
    training=st.one_of(st.none(), st.lists(gestures, max_size=2).map(tuple)),
    scene=scenes, rate=st.floats(1, 240), turn_deg=st.floats(-180, 180), still=st.floats(0, 3),
    seed=st.one_of(st.integers(0, 2**63 - 1), st.lists(st.integers(0, 2**40), min_size=1, max_size=3).map(tuple)),
)  # fmt: skip


@given(spec=specs)
@settings(max_examples=40, deadline=None)
def test_a_spec_comes_back_from_its_text(spec):
    assert spec_from(tomllib.loads(spec_text(spec))) == spec


@given(ring=st.builds(Ring, count=st.integers(2, 9), radius=st.floats(2, 9), jitter=numbers, fisheye=st.booleans()))
@settings(max_examples=20, deadline=None)
def test_a_spec_with_a_ring_comes_back(ring):
    spec = Spec(ring=ring)
    assert spec_from(tomllib.loads(spec_text(spec))) == spec
    assert len(spec.views()) == ring.count


def test_named_specs_are_theirs_by_name_and_can_be_written():
    named = named_specs()
    assert {"demo", "ring_walking", "man_reach"} <= set(named)
    assert len(named) == 2 + len(proving_ground()) + len(around()) + len(proving_rings()) + len(resting())
    for name, spec in named.items():
        assert spec.name == name
        assert spec_from(tomllib.loads(spec_text(spec))) == spec


@pytest.mark.parametrize("seed", [7, 0, 2**70, (0, 3), (5,)])
def test_the_seed_of_a_generator_is_found(seed):
    found = seed_of(np.random.default_rng(seed))
    assert found == (list(seed) if isinstance(seed, list) else seed)
    assert np.random.default_rng(found).random() == np.random.default_rng(seed).random()


def test_a_generator_that_spawned_has_no_seed_to_keep(tmp_path):
    rng = np.random.default_rng(3)
    child = rng.spawn(1)[0]
    assert seed_of(rng) is None
    assert seed_of(child) is None
    assert seed_of(np.random.default_rng()) is not None  # the system's own seed is one, too
    folder = synthesize(SMALL, tmp_path / "made", child)
    assert "no seed that could be kept" in (folder / "spec.toml").read_text()
    assert read_spec(folder / "spec.toml") == SMALL


def test_a_made_recording_can_be_made_again_from_its_spec(tmp_path):
    spec = replace(SMALL, motion=(Gesture(motion="random", seconds=2),), scene=Scene(empty_seconds=0.5, bystanders=(Bystander(),)))
    first = synthesize(spec, tmp_path / "first", np.random.default_rng([4, 2]))
    kept = read_spec(first / "spec.toml")
    assert kept == replace(spec, seed=(4, 2))
    second = synthesize(kept, tmp_path / "second")
    assert (first / "truth.csv").read_bytes() == (second / "truth.csv").read_bytes()
    assert (first / "spec.toml").read_bytes() == (second / "spec.toml").read_bytes()
    for name in ("video/cam.mp4", "background/cam.mp4", "masks/cam.mkv", "people/cam.mkv"):
        np.testing.assert_array_equal(frames(first / name), frames(second / name))


def test_the_encoder_has_one_thread_so_that_a_film_is_the_same_every_time(tmp_path):
    spec = replace(SMALL, cameras=(Viewpoint(size=(320, 320)),))  # of one with fewer blocks libx264 would not take several
    folder = synthesize(spec, tmp_path / "made", np.random.default_rng(1))
    for name in ("video/cam.mp4", "background/cam.mp4"):
        assert b" threads=1 " in (folder / name).read_bytes()  # libx264's own note of its settings


@pytest.mark.parametrize(("text", "told"), [
    ("fog = 1", r"spec\.toml: fog: no such setting; possible are begin, body, cameras, faults, frames, motion"),
    ("[scene]\nfog = 1", r"scene\.fog: no such setting; possible are background, bystanders"),
    ("[ring]\nnumber = 3", r"ring\.number: no such setting; possible are ahead, count, distortion"),
    ("[[scene.obstacles]]\nkind = 'sofa'", r"scene\.obstacles\.0\.kind: .*'table', 'chair', 'pillar' or 'cabinet', found 'sofa'"),
    ("[[scene.obstacles]]\nkind = 'chair'\nwhere = 1", r"scene\.obstacles\.0\.where: no such setting; possible are ahead, colour"),
    ("[[scene.obstacles]]\nkind = 'chair'\nahead = 0.1", r"scene\.obstacles\.0: ahead, left: found 0.1, 0, where the person stands"),
    ("[[scene.obstacles]]\nkind = 'chair'\nleaves = 0", r"scene\.obstacles\.0: leaves: found 0 s, expected a time after it enters"),
    ("[[scene.obstacles]]\nkind = 'table'\nseat = true", r"scene\.obstacles\.0: seat: found a table, expected a chair"),
    ("[[scene.obstacles]]\nkind = 'chair'\nseat = true", r"scene\.obstacles: found a seat, but the person is not seated"),
    ("posture = 'seated'\nmotion = [{motion = 'walk'}]", r"posture: found the motion walk of a person who is seated, expected stand"),
    ("posture = 'lying'\nmotion = [{motion = 'twist'}]", r"posture: found the motion twist of a person who is lying, expected stand"),
    ("motion = [{motion = 'sit_down'}, {motion = 'walk'}]\n[[scene.obstacles]]\nkind = 'chair'\nseat = true",
     r"scene\.obstacles: found a seat and the motion walk"),
    ("[[scene.obstacles]]\nkind = 'pillar'\nahead = 2.0", r"scene\.obstacles: found a pillar where the camera 'cam' stands"),
    ("[[scene.bystanders]]\nahead = 1.8\nleft = 0.1", r"scene\.bystanders: found a person where the camera 'cam' stands"),
    ("[[scene.bystanders]]\nahead = 0.2\nleft = 0.1", r"scene\.bystanders\.0: ahead, left: found 0.2, 0.1, where the person stands"),
    ("[[scene.bystanders]]\nmotion = 'stand'", r"scene\.bystanders\.0\.motion: found 'stand', expected a table"),
    ("[[scene.bystanders]]\nmotion = { motion = 'fly' }", r"scene\.bystanders\.0\.motion\.motion: .*found 'fly'"),
    ("[[scene.bystanders]]\nmotion = { motion = 'stand', pace = 1 }", r"bystanders\.0\.motion\.pace: no such setting; possible are "),
    ("[ring]\ncount = 1", r"ring\.count: .*greater than or equal to 2, found 1"),
    ("[ring]\nradius = 0.1", r"ring\.radius: .*found 0.1"),
    ("[[cameras]]\nname = 'a'\n[ring]", r"ring: found cameras as well, expected one of them"),
    ("[[cameras]]\nfov_deg = 150", r"cameras\.0: fov_deg: found 150, expected at most 120, or fisheye = true"),
    ("[[cameras]]\nfisheye = true\nfov_deg = 169", r"cameras\.0: fov_deg: found 169, expected at most 140 for a fisheye of this shape"),
    ("[[cameras]]\nfisheye = true\ndistortion = [0,0,0,0,0]", r"cameras\.0: distortion: found 5 numbers, expected 0 or 4"),
    ("[[cameras]]\ndistortion = [-0.9, 0, 0, 0]", r"cameras\.0: distortion: found \[-0.9.*bends the picture so far"),
    ("[[cameras]]\ndistortion = [nan, 0, 0, 0]", r"cameras\.0: distortion: found \[nan.*expected finite numbers"),
    ("[[cameras]]\nheight = nan", r"cameras\.0\.height: .*found nan"),
    ("cameras = 3", r"cameras: found 3, expected a list"),
    ("body = 'man'", r"body: found 'man', expected a table"),
    ("[body]\nstature = 3.0", r"body\.stature: .*less than or equal to 2.2, found 3.0"),
    ("seed = -1", r"seed: found -1, expected a whole number from 0, or a list of them"),
    ("seed = []", r"seed: found \[\], expected a whole number"),
    ("seed = true", r"seed: found True, expected a whole number"),
    ("seed = 1.5", r"seed: found 1.5, expected a whole number"),
    ("rate = ", r"spec\.toml: not valid TOML"),
    ("[scene]\ncrf = 60", r"scene\.crf: .*less than or equal to 51, found 60"),
    ("[scene]\nbackground = 'sea'", r"scene\.background: .*'room', 'plain', 'cluttered' or 'textured', found 'sea'"),
])  # fmt: skip
def test_a_bad_spec_file_is_reported_in_one_sentence(tmp_path, text, told):
    (tmp_path / "spec.toml").write_text(text)
    with pytest.raises(SettingsError, match=told) as caught:
        read_spec(tmp_path / "spec.toml")
    assert "\n" not in str(caught.value).split("not valid TOML")[0]
    assert str(caught.value).startswith(str(tmp_path / "spec.toml"))


# Specs in a few words


@given(lengths=st.lists(st.one_of(st.none(), st.integers(2, 9)), min_size=1, max_size=5), spare=st.integers(0, 9))
def test_gestures_without_seconds_share_what_is_left(lengths, spare):
    text = ", ".join("reach" + (f" {length}" if length else "") for length in lengths)
    open_ = lengths.count(None)
    total = sum(filter(None, lengths)) + 2 * open_ + spare
    found = parse_gestures(text, total if open_ else None)
    assert sum(g.seconds for g in found) == pytest.approx(total if open_ else sum(filter(None, lengths)))
    assert [g.seconds for g, length in zip(found, lengths) if length] == [length for length in lengths if length]
    assert len({g.seconds for g, length in zip(found, lengths) if not length}) <= 1


@pytest.mark.parametrize(("text", "seconds", "told"), [
    ("reach 4 5", None, r"motion: found 'reach 4 5', expected gestures and their seconds"),
    ("reach four", None, r"found 'reach four'"),
    ("reach,", None, r"found ''"),
    ("reach 1.5", None, r"motion: found reach 1\.5, expected at least 2 seconds of each gesture"),
    ("reach 4", 10, r"seconds for every gesture and 10 for all"),
    ("reach 4, twist", 5, r"found 5 seconds, of which 1 gestures get 1 each, expected at least 2"),
    ("fly", None, r"motion\.0\.motion: .*found 'fly'"),
])  # fmt: skip
def test_gestures_that_cannot_be_meant_are_reported(text, seconds, told):
    with pytest.raises(SettingsError, match=told):
        parse_gestures(text, seconds)


def test_words_go_over_a_spec_and_leave_the_rest():
    spec = replace(SMALL, seed=5, rate=30)
    assert apply_changes(SpecChanges(), spec) == spec
    changed = apply_changes(SpecChanges(noise=9.0, fov=40, height=1.6, occluder="chair", second_person="aside", crf=30), spec)
    assert changed.scene.noise == 9
    assert changed.scene.crf == 30
    assert changed.cameras[0] == replace(spec.cameras[0], fov_deg=40)
    assert changed.body == replace(spec.body, stature=1.6)
    assert changed.motion == spec.motion
    assert (changed.rate, changed.seed) == (30, 5)
    assert [thing.kind for thing in changed.scene.obstacles] == ["chair"]
    assert len(changed.scene.bystanders) == 1
    child = apply_changes(SpecChanges(body="child"), spec).body
    assert child.stature < 1.6
    assert child == apply_changes(SpecChanges(body="child"), spec).body
    assert child != apply_changes(SpecChanges(body="child"), replace(spec, seed=6)).body
    stretched = apply_changes(SpecChanges(seconds=12), Spec(motion=parse_gestures("reach 2, twist 4")))
    assert [g.seconds for g in stretched.motion] == [4, 8]


def test_one_camera_becomes_a_ring_and_back():
    lens = replace(SMALL, cameras=(replace(SMALL.cameras[0], fov_deg=80.0, distortion=(-0.1, 0.02, 0.0, 0.0)),))
    ring = apply_changes(SpecChanges(cameras=5, ring_radius=4.5), lens)
    assert ring.ring == Ring(count=5, radius=4.5, size=(64, 48), fov_deg=80, distortion=(-0.1, 0.02, 0.0, 0.0))
    higher = apply_changes(SpecChanges(cameras=3, camera_height=2.2, size="80x60"), ring)
    assert higher.ring == replace(ring.ring, count=3, height=2.2, size=(80, 60))
    assert apply_changes(SpecChanges(cameras=1, distance=3.0), ring).cameras == (Viewpoint(distance=3.0),)
    two = replace(SMALL, cameras=(Viewpoint(name="a"), Viewpoint(name="b")))
    assert [view.fov_deg for view in apply_changes(SpecChanges(fov=50), two).cameras] == [50, 50]
    with pytest.raises(SettingsError, match="cameras: found 4, but the spec places its 2 cameras itself"):
        apply_changes(SpecChanges(cameras=4), two)


# The command


def test_flags_make_a_recording_and_say_how_to_track_it(shell, tmp_path):
    code, out, err = shell("-o", "made", "--motion", "wave_hands", "--body", "woman", "--height", "1.6", "--noise", "1", *TINY)
    assert (code, err) == (0, "")
    assert max(map(len, out.splitlines())) <= 80
    for said in ("recording  made\n", "1.60 m: wave_hands 2", "64 x 48 pixels, 4 frames/s", "shadowpuppet track made --overlay"):
        assert said in out
    recording = read_recording(tmp_path / "made")
    assert recording.subject.height == 1.6
    assert len(recording.references) == 3
    assert recording.training is None
    assert len(frames(tmp_path / "made" / "video" / "cam.mp4")) == len(read_joints(tmp_path / "made" / "truth.csv").times) == 15


def test_a_flag_makes_faults_and_the_table_names_them(shell, tmp_path):
    code, out, err = shell("-o", "made", "--faults", "gain 1.3 @1, frozen @2-3, gain 0.9 @3", *TINY)
    assert (code, err) == (0, "")
    assert "faults     gain, frozen\n" in out
    masks = frames(tmp_path / "made" / "masks" / "cam.mkv")
    assert all(np.array_equal(masks[8], mask) for mask in masks[9:12])
    assert not np.array_equal(masks[8], masks[12])
    code, _, err = shell("-o", "other", "--faults", "gain 1.3 @1, freeze", *TINY)
    assert code != 0
    assert "faults: found 'freeze', which names no kind of fault; there are: absent, black" in " ".join(err.split())


@pytest.mark.whole
def test_made_recordings_can_be_looked_at_and_tracked(shell):
    assert shell("-o", "made", "--motion", "wave_hands", "--size", "160x120", "--rate", "8", "--seconds", "2", "--quiet") == (0, "", "")
    code, out, _ = shell("made", "--verbose", command="info")
    assert code == 0
    assert "these silhouettes overlap the ready ones by 0.9" in out
    quick = ["--tracker.cycles", 1, "--tracker.explore", 20, "--initialization.rounds", 20, "--initialization.sweeps", 2]
    code, out, _ = shell("made", "-o", "run", *quick, command="track")
    assert code == 0
    assert "joint errors, mm" in out


@pytest.mark.filterwarnings("ignore:.*nothing of the person is hidden")
def test_references_are_whole_or_not_there(tmp_path):
    for ahead, count in ((0.8, 0), (-0.8, 3)):
        made = make_recording(replace(SMALL, scene=replace(SMALL.scene, obstacles=(Obstacle(kind="pillar", ahead=ahead),))), tmp_path,
                              force=True)
        assert len(made.references) == count


def test_flags_seat_a_person_on_a_chair_without_an_empty_scene(shell, tmp_path):
    code, _, err = shell("-o", "made", "--posture", "seated", "--chair", "new", "--empty-seconds", 0, "--motion", "reach", *TINY)
    assert (code, err) == (0, "")
    spec = read_spec(tmp_path / "made" / "spec.toml")
    assert spec.posture == "seated"
    assert spec.scene.obstacles == (Obstacle(kind="chair", seat=True, enters=0.0),)
    recording = read_recording(tmp_path / "made")
    assert [view.background for view in recording.views] == [None]
    known = apply_changes(SpecChanges(chair="known"), spec)
    assert known.scene.obstacles == (Obstacle(kind="chair", seat=True),)  # in place of the other chair
    code, _, err = shell("-o", "other", "--chair", "new", *TINY)
    assert code != 0
    assert "the person is not seated" in err


def test_a_ring_has_training_motion_and_no_references(shell, tmp_path):
    code, out, err = shell("-o", "ring", "--cameras", 3, "--ring-radius", 3, "--seed", 4, "--motion", "random", *TINY)
    assert (code, err) == (0, "")
    assert "shadowpuppet track ring --overlay" in out
    assert "--camera" not in out  # all are tracked
    recording = read_recording(tmp_path / "ring")
    assert [view.camera.name for view in recording.views] == ["cam1", "cam2", "cam3"]
    assert recording.references == ()
    assert recording.training == tmp_path / "ring" / "training.csv"
    truth, training = read_joints(recording.truth), read_joints(recording.training)
    assert truth.names == (*training.names, *SOLES)
    assert np.abs(truth.select(training.names).positions - training.positions).max() > 0.05  # another performance
    upper = [[np.linalg.norm(np.diff(table.select(["left_shoulder", "left_elbow"]).positions, axis=1), axis=-1).mean()]
             for table in (truth, training)]  # fmt: skip
    assert upper[0] == pytest.approx(upper[1], abs=1e-4)  # by the same body
    code, out, _ = shell("ring", "--camera", "cam2", "--initialization.rounds", 5, "--initialization.sweeps", 1, command="info")
    assert "cam2, 64 x 48" in out


def test_training_motion_is_another_or_none_where_the_spec_says_so(tmp_path):
    spec = replace(SMALL, cameras=(Viewpoint(),), ring=Ring(count=2, size=(48, 32)), rate=4, motion=parse_gestures("squat 2"))
    made = {}
    for name, training in (("same", None), ("other", parse_gestures("overhead 2.5")), ("none", ())):
        wanted = replace(spec, training=training)
        assert spec_from(tomllib.loads(spec_text(wanted))) == wanted
        made[name] = make_recording(wanted, tmp_path / name)
    assert made["none"].training is None
    low = {name: read_joints(made[name].training).select(["pelvis"]).positions[..., 2].min() for name in ("same", "other")}
    assert low["other"] - low["same"] > 0.1  # nobody squats
    assert len(read_joints(made["other"].training).times) == len(read_joints(made["same"].training).times) + 2  # half a second more
    truths = [one.truth.read_bytes() for one in made.values()]
    assert truths[0] == truths[1] == truths[2]
    assert make_recording(replace(spec, training=()), tmp_path / "same", force=True).training is None  # the old one is not taken for it


def test_the_spec_shown_is_the_spec_made(shell, tmp_path):
    tokens = ["--cameras", 2, "--fisheye", "--occluder", "pillar", "--second-person", "behind", "--flicker", 0.05, "--seed", 9, *TINY]
    code, text, _ = shell("--show-spec", *tokens)
    assert code == 0
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "mine.toml").write_text(text)
    assert shell("mine.toml", "--show-spec")[1] == text
    assert shell("mine.toml", "-o", "one", "--quiet")[0] == 0
    assert read_spec(tmp_path / "one" / "spec.toml") == read_spec(tmp_path / "mine.toml")
    assert (tmp_path / "one" / "spec.toml").read_text() == SPEC_HEADER + text
    assert (tmp_path / "one" / "people" / "cam1.mkv").exists()


def test_named_specs_are_listed_and_made(shell, tmp_path):
    code, out, _ = shell("--list")
    assert code == 0
    assert max(map(len, out.splitlines())) <= 80
    assert all(name in out for name in named_specs())
    code, text, _ = shell("--like", "man_reach", "--show-spec")
    assert spec_from(tomllib.loads(text)) == named_specs()["man_reach"]
    assert shell("--like", "man_reach", *TINY[:-1], 6, "--quiet")[0] == 0
    assert (tmp_path / "man_reach" / "video" / "cam.mp4").exists()


@pytest.mark.parametrize(("tokens", "said"), [
    (["--height", 3], "flags: height: found 3, expected 0.9 to 2.2 metres"),
    (["--height", 175], "flags: height: found 175, expected 0.9 to 2.2 metres (175 cm are 1.75)"),
    (["--height", 175, "--body", "child"], "flags: height: found 175, expected 0.9 to 2.2 metres (175 cm are 1.75)"),
    (["--motion", "wlak 3"], "found 'wlak'; did you mean walk?"),
    (["--cameras", 7, "--distance", 3], "flags: distance: found 3, which needs a camera that is in no ring (for one, --ring-radius)"),
    (["--ring-radius", 3], "flags: ring-radius: found 3, which needs several cameras (--cameras 7)"),
    (["--size", "wide"], "flags: size: found 'wide', expected width and height in pixels, such as 640x480"),
    (["--size", "8x8"], "flags: cameras.0.size.0: input should be greater than or equal to 16, found 8"),
    (["--like", "nobody"], "flags: like: found 'nobody', which names no spec; there are: child_paper"),
    (["--like", "demo", "spec.toml"], "flags: found a file (spec.toml) and --like demo, expected one of them"),
    (["none.toml"], "none.toml: cannot be read (no such file or directory)"),
    (["--seconds", 1], "flags: seconds: found 1"),
    (["--fisheye", "--fov", 165], "flags: cameras.0: fov_deg: found 165, expected at most 140 for a fisheye of this shape"),
    (["--fov", 165], "flags: cameras.0: fov_deg: found 165, expected at most 120, or fisheye = true"),
    (["--occluder", "sofa"], '"table", "chair", "pillar", "cabinet"'),
    (["--seed", -1], "flags: seed: found -1, expected a whole number from 0"),
    (["--crf", 99], "flags: scene.crf: input should be less than or equal to 51, found 99"),
    (["--motions", "reach"], "--motion"),
])  # fmt: skip
def test_what_cannot_be_meant_is_said_in_a_line(shell, tmp_path, tokens, said):
    code, out, err = shell(*tokens)
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert said in err
    assert list(tmp_path.iterdir()) == []


# Folders


def test_only_made_recordings_are_made_again_unasked(shell, tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "video").mkdir()
    (tmp_path / "mine" / "video" / "cam.mp4").write_bytes(b"my only film")
    (tmp_path / "mine" / "spec.toml").write_text(spec_text(SMALL))  # a spec that somebody wrote makes no made recording
    code, _, err = shell("-o", "mine", *TINY)
    assert code == 2
    assert "mine: found files in it that are no made recording; choose another folder, or write among them with --force" in err
    assert (tmp_path / "mine" / "video" / "cam.mp4").read_bytes() == b"my only film"
    assert shell("-o", "mine", "--force", "--quiet", *TINY)[0] == 0
    assert len(frames(tmp_path / "mine" / "video" / "cam.mp4")) == 15
    (tmp_path / "file").write_text("")
    assert "file: found a file, expected a folder" in shell("-o", "file", *TINY)[2]


def test_making_again_leaves_nothing_of_the_old_and_all_that_is_the_users(tmp_path):
    spec = replace(SMALL, rate=1)
    make_recording(spec, tmp_path)
    ring = replace(spec, cameras=(Viewpoint(),), ring=Ring(count=3, size=(48, 32)), scene=Scene(empty_seconds=1, bystanders=(Bystander(),)))
    with pytest.raises(RecordingError, match="a made recording of another spec"):
        make_recording(ring, tmp_path)
    assert (tmp_path / "video" / "cam.mp4").exists()
    make_recording(ring, tmp_path, force=True)
    (tmp_path / "notes.txt").write_text("mine")
    (tmp_path / "video" / "cam2.part.mp4").write_bytes(b"")
    recording = make_recording(spec, tmp_path, force=True)
    assert [view.camera.name for view in recording.views] == ["cam"]
    assert recording.training is None
    left = {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*") if path.is_file() and "references" not in path.parts}
    assert left == {"notes.txt", "spec.toml", "calibration.toml", "recording.toml", "truth.csv", "truth.trc", "video/cam.mp4",
                    "background/cam.mp4", "masks/cam.mkv"}  # fmt: skip


def test_a_recording_that_was_interrupted_can_be_used_and_made_again(tmp_path):
    class Impatient(Listener):
        def advance(self, frames):
            if frames == 3:
                raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        make_recording(SMALL, tmp_path, Impatient())
    recording = read_recording(tmp_path)
    assert len(frames(recording.views[0].video)) == len(frames(recording.views[0].masks)) == 3
    assert len(read_joints(recording.truth).times) == 8
    assert len(frames(make_recording(SMALL, tmp_path).views[0].video)) == 8


def test_a_folder_that_cannot_be_written_is_reported(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(RecordingError, match="file"):
        make_recording(SMALL, tmp_path / "file" / "below")


def test_a_person_passes_behind(shell, tmp_path):
    assert shell("-o", "two", "--second-person", "passing", "--distance", 3, "--quiet", *TINY)[0] == 0
    people, masks = (np.array(frames(tmp_path / "two" / kind / "cam.mkv")).max(-1) for kind in ("people", "masks"))
    middle = [np.flatnonzero(one.any(0)).mean() for one in people & ~masks if one.any()]
    assert np.ptp(middle) > 8


# Motion capture


def test_motion_capture_is_found_from_the_spec_and_kept_with_its_place(shell, tmp_path):
    (tmp_path / "mocap").mkdir()
    acclaim.write(tmp_path / "mocap", 400, size=5.0)
    (tmp_path / "mocap" / "mine.toml").write_text('rate = 4\nmotion = [{ motion = "mocap", file = "01_01.amc", seconds = 2 }]\n')
    assert read_spec(tmp_path / "mocap" / "mine.toml").motion[0].file == str(tmp_path / "mocap" / "01_01.amc")
    assert shell("mocap/mine.toml", "-o", "one", "--cameras", 2, "--size", "64x48", "--quiet")[0] == 0
    assert shell("one/spec.toml", "-o", "two", "--quiet")[0] == 0
    assert shell("-o", "three", "--motion", "mocap/01_01.amc", "--cameras", 2, *TINY, "--quiet")[0] == 0
    truths = [(tmp_path / name / "truth.csv").read_bytes() for name in ("one", "two", "three")]
    assert truths[0] == truths[1] == truths[2]
    assert read_recording(tmp_path / "one").training is None  # it would be the truth


def test_a_file_that_cannot_be_used_removes_nothing(shell, tmp_path):
    assert shell("-o", "made", "--quiet", *TINY)[0] == 0
    code, _, err = shell("-o", "made", "--motion", "gone.amc", *TINY)
    assert code == 2
    assert "gone.amc: " in err
    assert len(frames(tmp_path / "made" / "video" / "cam.mp4")) == 15


# A part of a motion


def test_a_film_may_show_a_part_of_the_motion():
    whole = Spec(motion=parse_gestures("walk 6"), rate=20)
    times, figure = perform(whole, np.random.default_rng(1))
    some, part = perform(replace(whole, begin=3, frames=11), np.random.default_rng(1))
    np.testing.assert_allclose(some, times[:11])
    assert np.linalg.norm(part.joints[0, 0] - figure.joints[0, 0]) > 0.3  # they are on their way
    np.testing.assert_allclose(np.ptp(part.joints, axis=0), np.ptp(figure.joints[60:71], axis=0), atol=0.02)  # but for sway and tremor
    to_the_end, _ = perform(replace(whole, begin=3), np.random.default_rng(1))
    assert len(to_the_end) == len(times) - 60


def test_a_film_longer_than_its_motion_is_reported(tmp_path):
    spec = Spec(motion=parse_gestures("walk 4"), rate=10, begin=2, frames=40)
    with pytest.raises(SettingsError, match=r"frames: found 40 pictures at 10 a second after 2 s, expected at most 37"):
        perform(spec, np.random.default_rng(1))
    with pytest.raises(SettingsError, match=r"found 1 pictures .* after 60 s, expected at most 0"):
        perform(replace(spec, frames=None, begin=60), np.random.default_rng(1))


def test_training_and_bystanders_of_a_part(tmp_path):
    scene = Scene(empty_seconds=0.3, bystanders=(Bystander(),))
    spec = Spec(motion=parse_gestures("walk 4"), rate=10, begin=1.0, frames=3, training_frames=7, ring=Ring(count=2, size=(64, 48)),
                scene=scene)
    folder = synthesize(spec, tmp_path / "made")
    assert len(read_joints(folder / "truth.csv").times) == 3
    assert len(read_joints(folder / "training.csv").times) == 7
    assert len(frames(folder / "people" / "cam1.mkv")) == 3


def test_a_motion_of_the_whole_body_is_filmed_from_where_the_feet_are_seen():
    walks = apply_changes(SpecChanges(motion="walk 3"), Spec())
    (view,) = walks.cameras
    places = covered_places(walks)
    feet = np.column_stack([places, np.zeros(len(places))])
    rows = view.camera().project(feet)[:, 1]
    assert rows.max() < view.size[1]
    assert rows.max() > 0.8 * view.size[1]  # and no farther away
    assert [each.distance for each in apply_changes(SpecChanges(motion="reach 3"), Spec()).cameras] == [2.0]
    assert [each.distance for each in apply_changes(SpecChanges(motion="walk 3", distance=3.0), Spec()).cameras] == [3.0]
    assert apply_changes(SpecChanges(motion="walk 3", cameras=3), Spec()).ring is not None
