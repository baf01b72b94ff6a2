"""The command line as a user types it."""

from __future__ import annotations

import functools
import importlib
import inspect
import io
import itertools
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
import tomllib
import warnings
from dataclasses import is_dataclass
from pathlib import Path
from types import SimpleNamespace

import made
import numpy as np
import pytest
from numba.core import event
from waiting import until

from shadowpuppet import jit
from shadowpuppet.cli import app as cli
from shadowpuppet.cli import terminal as terminal_module
from shadowpuppet.cli import track as track_module
from shadowpuppet.errors import PERSON_LOST, ShadowPuppetWarning
from shadowpuppet.io.run import read_run
from shadowpuppet.live.settings import LiveSettings
from shadowpuppet.live.stream.settings import OutletSettings
from shadowpuppet.motion.metrics import UPPER_JOINTS
from shadowpuppet.pipeline.options import Options, make_options, options_text
from shadowpuppet.settings import settings_of
from shadowpuppet.synthetic.spec_changes import SpecChanges

QUICK = ["--tracker.cycles", "1", "--tracker.explore", "20", "--initialization.rounds", "20", "--initialization.patience", "5",
         "--initialization.sweeps", "2"]


@pytest.fixture(scope="module")
def run(recording, once):
    def make(folder):
        assert cli.run(["track", str(recording), "-o", str(folder), "--quiet", "--overlay", *QUICK]) == 0

    return once("quick/run", make)


def process(*tokens: object, **more) -> subprocess.Popen:
    command = [sys.executable, "-m", "shadowpuppet", *map(str, tokens)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **more)


def refused(shell, *tokens: object) -> str:
    """The one line that a command which cannot be done ends with."""
    code, _, err = shell(*tokens)
    errors = [line for line in err.splitlines() if not line.startswith("warning: ")]
    assert code == 2
    assert len(errors) == 1, err
    assert errors[0].startswith("error: ")
    assert "Traceback" not in err
    return errors[0]


# Set-up


def test_importing_the_package_loads_nothing_heavy():
    code = "import sys, shadowpuppet; print(sorted({'numba', 'cv2', 'av', 'matplotlib', 'scipy', 'pydantic'} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


def test_public_names_are_loaded_when_used():
    import shadowpuppet

    for name in shadowpuppet.__all__:
        assert getattr(shadowpuppet, name) is not None
    assert set(shadowpuppet.__all__) - {"__version__"} == set(shadowpuppet._HOMES)
    assert set(shadowpuppet.__all__) <= set(dir(shadowpuppet))
    with pytest.raises(AttributeError, match="no attribute 'track_film'"):
        shadowpuppet.track_film  # noqa: B018


def test_help_loads_no_kernels_and_fits_a_terminal():
    code = ("import sys\nfrom shadowpuppet.cli.app import run\ncode = run(['track', '--help'])\n"
            "print(code, sorted({'numba', 'cv2', 'av', 'matplotlib', 'scipy'} & set(sys.modules)), file=sys.stderr)")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=os.environ | {"COLUMNS": "80"})
    assert done.stderr == "0 []\n"
    assert max(map(len, done.stdout.splitlines())) <= 80
    for flag in ("--output -o", "--preset", "--seed", "--overlay", "--height", "--region", "--config", "--quiet"):
        assert flag in done.stdout


@pytest.mark.parametrize(("command", "kind", "choices"), [
    ("track", Options, ["off, tracker, butterworth", "camera, away"]),
    ("live", LiveSettings, ["auto, browser"]),
    ("play", OutletSettings, ["machine, link, site"]),
    ("synthesize", SpecChanges, ["known, new", "standing, seated", "behind, aside", "round, past"]),
])  # fmt: skip
def test_help_lists_every_setting_that_is_in_no_table_with_its_choices(shell, command, kind, choices):
    shown = " ".join(shell(command, "--help")[1].replace("│", " ").split())
    for setting in settings_of(kind):
        assert is_dataclass(setting.kind) or f"--{setting.name.replace('_', '-')} " in shown
    for words in choices:
        assert f"[choices: {words}" in shown


def test_a_look_loads_nothing_that_only_other_commands_need():
    code = ("import sys, shadowpuppet.cli.recordings, shadowpuppet.cli.terminal, shadowpuppet.pipeline.prepare\n"
            "others = {'scipy.linalg', 'scipy.spatial', 'scipy.signal', 'matplotlib', 'shadowpuppet.live.run'}\n"
            "print(sorted(others & set(sys.modules)))")
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


def test_progress_goes_on_while_the_compiler_is_being_imported(monkeypatch):
    """That takes seconds on a busy machine, in which another thread prints."""
    monkeypatch.setitem(sys.modules, "shadowpuppet.jit", SimpleNamespace())
    assert terminal_module._compiling() == ""


def test_help_lists_what_most_need_first(shell):
    _, out, _ = shell("--help")
    first, more = (set(re.findall(r"^[│ ]*([a-z]+(?:-[a-z]+)*)  ", part, re.MULTILINE)) for part in out.split("More", 1))
    assert set(cli.FIRST) <= first
    assert set(cli.COMMANDS) - set(cli.FIRST) <= more


@pytest.mark.parametrize("command", cli.COMMANDS)
def test_help_ends_with_three_examples_that_are_understood(shell, command):
    _, shown, _ = shell(command, "--help")
    lines = re.findall(rf"^    shadowpuppet ({command}.*)$", shown.partition("Examples:")[2], re.MULTILINE)
    assert len(lines) == 3
    for line in lines:
        function, *_ = cli.app.parse_args(line, exit_on_error=False, print_error=False)
        assert function.__name__.strip("_").replace("_", "-") == command
        assert f"    shadowpuppet {line}" in shown.splitlines()
        assert len(line) < 80 - len("    shadowpuppet ")


def test_the_version_is_reported_by_the_module_too():
    child = process("--version")
    out, err = child.communicate()
    assert (child.returncode, err) == (0, "")
    assert re.fullmatch(r"\d+\.\d+.*\n", out)


@pytest.mark.parametrize(("tokens", "said"), [
    (["trac"], 'Unknown command "trac"'),
    (["track", "my", "film.mp4"], "found 'film.mp4' after all that the command takes; a path with blanks belongs in quotes"),
    (["track"], "error: track: found no RECORDING; `shadowpuppet track --help` has examples"),
    (["track", "here", "--output"], "parameter --output requires an argument"),
    (["completion"], "error: completion: found no SHELL; expected bash, fish, powershell, zsh"),
    (["track", "here", "--overlya"], "Unknown option: --overlya. Did you mean --overlay"),
    (["track", "here", "--tracker.arm.particle", "3"], "Did you mean --tracker.arm.particles"),
    (["track", "here", "--height", "1,75"], '--height: unable to convert "1,75" into float. Write 1.75.'),
    (["track", "here", "--tracker.arm.particles", "many"], '--tracker.arm.particles: unable to convert "many" into int'),
    (["track", "here", "--tracker.arm.particles", "1"], "tracker: arm.particles: found 1; "),
    (["track", "here", "--preset", "liu"], "unknown preset 'liu'; there are: default, liu2011"),
    (["track", "here", "--silhouette.method", "magic"], "magic"),
    (["track", "here", "--height", "180"], "flags: height: found 180.0; expected 0.5 to 2.5 metres (180 cm are 1.8)"),
    (["info", "here", "--distance", "nan"], "flags: distance: found nan; expected 0.2 to 30 metres"),
    (["track", "here", "--people", "0"], "flags: people: found 0; input should be greater than or equal to 1"),
    (["info", "here", "--people", "7"], "flags: people: found 7; input should be less than or equal to 6"),
    (["track", "here", "--people", "two"], '--people: unable to convert "two" into int'),
    (["live", "film.mp4", "--people", "2"], "people: found 2 for a live session, expected 1: `track` follows several"),
    (["track", "here", "--tracker.motion-weight", "inf"], "tracker: motion_weight: found inf; input should be a finite number"),
    (["track", "here", "--config", "none.toml"], "none.toml: cannot be read (no such file"),
    (["track", "here"], "here: no such recording, expected a folder with video/ and calibration.toml, or a film"),
    (["evaluate", "here"], "here: no such folder, expected a run's, as `shadowpuppet track` writes it"),
    (["export", "here"], "here: no such folder, expected a run's"),
    (["settings", "--preset", "liu"], "unknown preset 'liu'"),
])  # fmt: skip
def test_what_cannot_be_meant_is_said_in_a_line(shell, tokens, said):
    assert said in refused(shell, *tokens)


@pytest.mark.parametrize("command", ["track", "info"])
def test_one_camera_follows_one_person(shell, recording, command):
    assert "people: found 2 for one camera, expected 1: two calibrated cameras or more" in refused(shell, command, recording, "--people", 2)


# Use


def test_track_tells_what_it_found_and_what_came_out(shell, recording, tmp_path):
    code, out, err = shell("track", recording, *QUICK)
    assert (code, err) == (0, "")
    assert "\x1b" not in out
    assert max(map(len, out.splitlines())) <= 80
    assert not any(line.endswith(" ") for line in out.splitlines())
    assert out.startswith("verdict on the film  good\n")
    assert out.count("verdict on the film  ") == out.count("verdict on the run  ") == 1
    assert "exact masks" not in out
    for word in ("camera     cam, 160 x 120 pixels, 60 degrees wide, calibrated",
                 f"film       {made.FRAMES} frames, 8 frames/s", "scale", "person", f"frames   {made.FRAMES}",
                 "doubt    ", "legs     not tracked; --body anatomical", "joint errors, mm", "left_hand", "frames/s (ms a frame: decode"):
        assert word in out
    assert "run-tiny/joints.csv" in out
    assert (tmp_path / "run-tiny" / "joints.csv").exists()


@pytest.mark.parametrize("name", ["track", "live", "demo", "fit-person", "synthesize", "evaluate", "fit-prior",
                                  "export", "convert", "batch", "play"])
def test_every_command_that_takes_its_time_can_be_quiet(name, shell):
    assert "--quiet" in shell(name, "--help")[1]


def printed_until(capsys, text: str) -> list[str]:
    """Lines of standard error up to the first with a text."""
    printed = []

    def comes() -> bool:
        printed.append(capsys.readouterr().err)
        return any(text in line for line in "".join(printed).splitlines())

    until(comes)
    return "".join(printed).splitlines()


def test_progress_is_printed_where_there_is_no_terminal(capsys, monkeypatch):
    monkeypatch.setattr(terminal_module, "LOG_EVERY", 0.02)
    monkeypatch.setattr(terminal_module, "monotonic", functools.partial(next, itertools.count(0, 0.001)))
    with terminal_module.terminal() as listener:
        listener.begin("looking at 4 films")
        lines = printed_until(capsys, "... looking")
        listener.begin("tracking", 80)
        listener.advance(20)
        lines += printed_until(capsys, "... tracking 20/80, ")
    assert lines[0] == "... looking at 4 films, 0 s"
    assert lines[-1].startswith("... tracking 20/80, ")
    time.sleep(0.1)
    with terminal_module.terminal(quiet=True) as listener:
        listener.begin("tracking")
        time.sleep(0.1)
    assert capsys.readouterr().err == ""


def test_a_line_of_progress_does_not_fall_into_what_is_printed_next():
    """On a machine with much to do the thread may be about to print when progress ends."""
    printing, printed = threading.Event(), []

    def line():
        printing.set()
        time.sleep(0.1)
        return "looking"

    lines = terminal_module.LogLines(SimpleNamespace(print=lambda text, **_: printed.append(text)), line, lambda: 0.001)
    lines.start()
    printing.wait()
    lines.stop()
    assert printed == ["... looking"]
    time.sleep(0.2)
    assert printed == ["... looking"]


def test_compiling_is_said_once_a_phase(capsys, monkeypatch):
    monkeypatch.setattr(terminal_module, "LOG_EVERY", 0.02)
    monkeypatch.setattr(terminal_module, "monotonic", functools.partial(next, itertools.count(0, 0.001)))
    with terminal_module.terminal() as listener:
        listener.begin("measuring the person")
        lines = printed_until(capsys, "... measuring")
        with event.trigger_event("numba:compile", data={}):
            assert jit.is_compiling()
            lines += printed_until(capsys, "(a minute or two)")
            later = [line for _ in range(2) for line in printed_until(capsys, "... measuring")]
            listener.begin("tracking")
            tracking = printed_until(capsys, "... tracking")
        assert not jit.is_compiling()
    assert not any("compiling" in line for line in later)
    assert tracking[-1].endswith(", compiling, once (a minute or two)")
    assert not lines[0].endswith("(a minute or two)")
    assert lines[-1] == "... measuring the person, 0 s, compiling, once (a minute or two)"


def test_what_a_message_quotes_is_printed_as_it_is(capsys):
    with terminal_module.terminal() as listener:
        listener.note("reading [red]films[/red] of [bold]")
        listener.warn("camera '[dim]' is late")
        listener.trouble("no pictures from [/dev/video0]")
    lines = [line for line in capsys.readouterr().err.splitlines() if not line.startswith("...")]
    assert lines == ["reading [red]films[/red] of [bold]", "warning: camera '[dim]' is late", "warning: no pictures from [/dev/video0]"]


def test_warnings_about_the_program_s_own_code_are_for_those_who_ask(capsys):
    for verbose in (False, True):
        with terminal_module.terminal(verbose=verbose):
            for category, text in ((RuntimeWarning, "overflow encountered in cast"), (ShadowPuppetWarning, "the film breaks off")):
                with warnings.catch_warnings():
                    warnings.simplefilter("always", category)
                    warnings.warn(text, category, stacklevel=1)
        said = [line for line in capsys.readouterr().err.splitlines() if line.startswith("warning")]
        assert said[-1] == "warning: the film breaks off"
        assert [re.sub(r"\d+", "N", line) for line in said[:-1]] == (
            ["warning: RuntimeWarning in test_app.py:N: overflow encountered in cast"] if verbose else [])


def test_a_run_that_had_all_its_frames_before_has_no_speed(capsys, run):
    metrics = read_run(run).metrics
    for frames_per_s, said in ((metrics["frames_per_s"], True), (0.0, False)):
        track_module._show_run(run, metrics | {"frames_per_s": frames_per_s})
        assert ("frames/s" in capsys.readouterr().out) == said


def test_the_help_of_view_is_about_viewing(shell):
    found = shell("view", "--help").out
    assert "--html" in found
    for of_tracking in ("--anyway", "--seed", "--smooth", "--overlay"):
        assert of_tracking not in found


def test_info_looks_and_leaves_nothing(shell, recording, tmp_path):
    code, out, err = shell("info", recording)
    assert (code, err) == (0, "")
    assert out.startswith("verdict on the film  good\n")
    assert "exact masks" not in out
    code, out, err = shell("info", recording, "--verbose")
    assert (code, err) == (0, "")
    assert "these silhouettes overlap the ready ones by 0.9" in out
    assert not list(tmp_path.iterdir())
    code, out, _ = shell("info", recording, "--json")
    assert (code, json.loads(out)["frames"]) == (0, made.FRAMES)


@pytest.mark.whole
def test_evaluate_measures_again_what_track_measured(shell, recording, run):
    code, out, err = shell("evaluate", run)
    assert (code, err) == (0, "")
    for name in ("left_shoulder", "right_hand", "all", "overlap", "jitter"):
        assert name in out
    code, out, _ = shell("evaluate", run, "--json")
    metrics, kept = json.loads(out), read_run(run).metrics
    assert metrics["errors"].pop("joints").keys() == kept["errors"].pop("joints").keys()
    assert metrics["errors"] == pytest.approx(kept["errors"])
    assert metrics["truth"] == str(recording / "truth.csv")
    assert f"{metrics['errors']['mean_mm']:.1f}" in shell("evaluate", run, recording / "truth.trc")[1]


def test_evaluate_takes_joints_and_a_first_frame(shell, run):
    code, out, _ = shell("evaluate", run, "--joints", "neck,head", "--start", "10", "--json")
    errors = json.loads(out)["errors"]
    assert (code, list(errors["joints"]), errors["frames"]) == (0, ["neck", "head"], made.FRAMES - 10)
    group = json.loads(shell("evaluate", run, "--joints", "upper", "--json")[1])["errors"]
    assert list(group["joints"]) == list(UPPER_JOINTS)
    assert "the run lacks" in refused(shell, "evaluate", run, "--joints", "left_knee")
    assert f"start: found 99, expected 0 to {made.FRAMES - 1}, a frame of" in refused(shell, "evaluate", run, "--start", "99")


def test_evaluate_says_when_the_truth_is_gone(shell, run, tmp_path):
    moved = made.copied(run, tmp_path / "run")
    info = tomllib.loads((run / "run.toml").read_text())
    made.replace_text(moved / "run.toml", info["truth"], "/nowhere/truth.csv")
    code, out, err = shell("evaluate", moved)
    assert code == 0
    assert "/nowhere/truth.csv: the recording's truth is not there any more; give it as TRUTH" in err
    assert "overlap" in out
    assert "joint errors" not in out


@pytest.mark.whole
def test_plain_masks_are_tracked_though_they_show_no_posture(shell, recording, tmp_path):
    code, out, err = shell("track", recording, "--silhouette.method", "averaging", "-o", tmp_path / "plain", "--verbose", *QUICK)
    assert code == PERSON_LOST  # the silhouettes of this method are too poor in so small a film
    assert "Traceback" not in err
    assert err.splitlines()[-1].startswith("the person is lost: person lost in ")
    said = " ".join(out.split())
    assert "told by averaging: as set" in said
    assert "all this in clean silhouettes by both: plain ones show no posture" in said
    assert read_run(tmp_path / "plain").info["settings"]["silhouette"]["method"] == "averaging"


@pytest.mark.whole
def test_fit_person_shows_sizes_and_curves_and_track_uses_them(shell, recording, tmp_path):
    code, out, err = shell("fit-person", recording, "-o", "me.toml")
    assert (code, err) == (0, "")
    for word in ("a1  head_width", "a18  shoulder_inset", "O1", "O2", "O3", "front_t_pose 0.", "saved    me.toml"):
        assert word in out
    assert (tmp_path / "me.toml").exists()
    code, out, _ = shell("track", recording, "--person", "me.toml", *QUICK)
    assert code == 0
    assert "sizes from me.toml" in out


@pytest.mark.whole
def test_a_whole_body_is_tracked_with_one_camera_and_its_sizes_are_kept(shell, recording, tmp_path):
    code, out, err = shell("track", recording, "-o", "run", "--body", "cylinders", *QUICK)
    assert (code, err) == (0, "")
    assert "frames" in out
    header = (tmp_path / "run" / "angles.csv").read_text().splitlines()[0].split(",")
    assert {"root_bow", "left_shoulder_abduction", "right_knee_flexion"} <= set(header)
    assert "left_ankle_x" in (tmp_path / "run" / "joints.csv").read_text().splitlines()[0]
    person = tmp_path / "run" / "person.toml"
    assert 'body = "cylinders"' in person.read_text()
    assert shell("track", recording, "-o", "again", "--body", "cylinders", "--person", person, "--quiet", *QUICK)[0] == 0
    assert (tmp_path / "again" / "person.toml").read_text().split("[sizes]")[1] == person.read_text().split("[sizes]")[1]
    assert shell("track", recording, "-o", "known", "--person", person, "--quiet", *QUICK)[0] == 0
    assert read_run(tmp_path / "known").info["body"] == "cylinders"  # that of the sizes
    said = "sizes: found those of the body 'cylinders', expected those of 'boxes'"
    assert said in refused(shell, "track", recording, "--body", "boxes", "--person", person)
    assert 'Invalid value "ball" for --body. Choose from: "cardbox"' in refused(shell, "track", recording, "--body", "ball")


# Settings


def test_settings_are_a_file_of_settings(shell, recording, tmp_path):
    code, out, _ = shell("settings", "--preset", "liu2011")
    assert code == 0
    assert make_options(tomllib.loads(out)) == make_options({"preset": "liu2011"})
    (tmp_path / "mine.toml").write_text(out)
    assert shell("track", recording, "-o", "run", "--quiet", "--config", "mine.toml", "--seed", "5", *QUICK) == (0, "", "")
    info = read_run(tmp_path / "run").info
    assert info["settings"]["seed"] == 5
    assert info["settings"]["tracker"]["body"] == make_options({"preset": "liu2011"}).tracker.body
    assert info["settings"]["tracker"]["explore"] == 20


def test_settings_of_an_unknown_preset_print_nothing(shell):
    assert shell("settings", "--preset", "foo")[:2] == (2, "")


def test_every_setting_is_explained(shell):
    lines = options_text(Options()).splitlines()
    bare = [line for before, line in zip(["", *lines], lines) if re.match(r"(# )?\w+ =", line) and not before.startswith("# ")]
    assert bare == []


def test_flags_go_before_the_file_and_the_file_before_the_preset(monkeypatch, tmp_path):
    from shadowpuppet.cli.flags import Flags, options_from

    file = tmp_path / "mine.toml"
    file.write_text('preset = "liu2011"\nseed = 3\nperson = "me.toml"\n[tracker.arm]\nparticles = 30\n[silhouette]\nclean = false\n')
    paper, flags = make_options({"preset": "liu2011"}), Flags(seed=4)
    options = options_from(flags, file)
    assert options.seed == 4
    assert options.tracker.arm.particles == 30
    assert options.tracker.torso == paper.tracker.torso
    assert options.silhouette.clean is False
    assert options.person == tmp_path / "me.toml"  # beside the file
    assert options_from(None, None) == Options()


def test_a_run_can_be_made_again_from_its_own_file(shell, recording, run, tmp_path):
    assert shell("track", recording, "-o", "again", "--quiet", "--config", run / "run.toml")[0] == 0
    assert (tmp_path / "again" / "joints.csv").read_bytes() == (run / "joints.csv").read_bytes()


@pytest.mark.parametrize(("text", "said"), [
    ("[case.fast]\nseed = 3", "mine.toml: found a file for `shadowpuppet batch`, expected settings of one run"),
    ("particles = 3", "mine.toml: unknown setting 'particles'; there are: anyway, appearance, background, body"),
    ("[tracker]\narms = 3", "mine.toml: tracker: unknown setting 'arms'; there are: arm, arm_colours, body"),
    ("[tracker.arm]\nparticles = -3", "mine.toml: tracker: arm.particles: found -3"),
    ("seed = ", "mine.toml: not valid TOML"),
])  # fmt: skip
def test_a_wrong_file_of_settings_is_said_by_name(shell, recording, tmp_path, text, said):
    (tmp_path / "mine.toml").write_text(text)
    assert said in refused(shell, "track", recording, "--config", "mine.toml")


# Bad input


def test_a_missing_film(shell, spoilt):
    (spoilt / "video" / "cam.mp4").unlink()
    assert "spoilt: no films in it, expected <camera>.mp4 or video/<camera>.mp4, a folder of pictures" in refused(shell, "track", spoilt)


def test_an_unreadable_film(shell, spoilt):
    (spoilt / "video" / "cam.mp4").write_bytes(b"no film" * 100)
    assert "video/cam.mp4: no film that can be read" in refused(shell, "track", spoilt)


def test_a_film_of_another_size_than_its_calibration(shell, spoilt):
    made.write_film(spoilt / "video" / "cam.mp4", [np.zeros((240, 320, 3), np.uint8)] * 3)
    said = refused(shell, "track", spoilt)
    assert "found pictures of 320 x 240 pixels, the calibration of camera 'cam' is for 160 x 120; they have the same shape" in said


def test_a_rotation_that_is_none(shell, spoilt):
    rotation = next(line for line in (spoilt / "calibration.toml").read_text().splitlines() if line.startswith("rotation"))
    made.replace_text(spoilt / "calibration.toml", rotation, "rotation = [[1.0, 0.2, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]")
    said = refused(shell, "track", spoilt)
    assert "calibration.toml: [cam]: camera 'cam': rotation: found" in said
    assert "expected an orthonormal, right-handed matrix" in said


def test_what_is_not_a_number(shell, spoilt):
    translation = next(line for line in (spoilt / "calibration.toml").read_text().splitlines() if line.startswith("translation"))
    made.replace_text(spoilt / "calibration.toml", translation, "translation = [0.0, nan, 2.0]")
    said = refused(shell, "track", spoilt)
    assert "calibration.toml: [cam]: translation: found [0.0, nan, 2.0], expected 3 finite numbers" in said


def test_an_unknown_camera(shell, spoilt):
    made.replace_text(spoilt / "calibration.toml", "cam", "left")
    assert "found cam, but the calibration knows no such camera; cameras known: left" in refused(shell, "track", spoilt)


def test_an_unknown_camera_that_is_asked_for(shell, recording):
    assert "camera: found 'left', expected one of cam" in refused(shell, "track", recording, "--camera", "left")


def test_no_calibration(shell, spoilt):
    (spoilt / "calibration.toml").unlink()
    assert "no calibration: give the camera's horizontal field of view (--fov DEGREES" in refused(shell, "track", spoilt)


def test_nobody_in_the_film(shell, spoilt, tmp_path):
    made.write_film(spoilt / "video" / "cam.mp4", made.images(spoilt / "background" / "cam.mp4") * 4)
    code, out, err = shell("track", spoilt, "-o", "run")
    assert code == 2
    assert out.startswith("verdict on the film  bad\nbecause              the silhouette is empty in 100 % of the frames")
    assert err.startswith("error: ")
    assert "the silhouette is empty in 100 % of the frames: nobody is in the picture" in err
    assert not (tmp_path / "run").exists()
    code, out, err = shell("info", spoilt, "--verbose")
    assert code == 2
    assert "silhouettes  0.0 % of the picture" in out  # what was seen is shown
    assert "the silhouette is empty" in err


def test_silhouettes_of_everything(shell, spoilt, tmp_path):
    made.write_film(spoilt / "masks" / "cam.mkv", [np.full(made.SIZE[::-1], 255, np.uint8)] * made.FRAMES, lossless=True)
    said = refused(shell, "track", spoilt, "--masks")
    assert "the masks cover nearly all of the picture in 100 % of the frames; expected the person" in said
    assert not (tmp_path / "run-spoilt").exists()


def test_a_person_partly_outside(shell, spoilt, tmp_path):
    shifted = [np.pad(mask[:, 40:], [(0, 0), (0, 40), (0, 0)][: mask.ndim]) for mask in made.images(spoilt / "masks" / "cam.mkv")]
    made.write_film(spoilt / "masks" / "cam.mkv", shifted, lossless=True)
    code, out, err = shell("track", spoilt, "-o", "run", "--masks", "--verbose", *QUICK)
    assert code == 0
    assert "person is cut off at the left: step back" in out
    assert "warning: the silhouette touches the left border in" in err
    motion = read_run(tmp_path / "run").motion
    assert len(motion) == made.FRAMES
    assert np.isfinite(motion.joints[motion.status == "tracked"]).all()


@pytest.mark.whole
def test_no_references_no_height_no_distance(shell, recording, tmp_path):
    bare = made.copied(recording, tmp_path / "bare", without=["references", "recording.toml"])
    code, out, err = shell("track", bare, "-o", "run", "--preset", "liu2011", "--verbose", *QUICK)
    assert code == 0
    assert "height not known: all lengths are guesses; give --height" in out
    assert "average height of 1.70 m, assumed" in out
    assert err.count("warning: neither height nor distance is known") == 1
    assert len(read_run(tmp_path / "run").motion) == made.FRAMES


def test_a_distance_that_the_references_do_not_bear_out(shell, recording):
    said = refused(shell, "info", recording, "--distance", "18", "--height", "1.75")
    assert "tiny: distance: found 18 metres, expected at most 2." in said
    assert "np.float64" not in said


def test_an_unknown_reference(shell, spoilt):
    (spoilt / "references" / "front_t_pose.png").rename(spoilt / "references" / "t_pose.png")
    assert "found t_pose; postures known: front_t_pose, side_arms_hanging" in refused(shell, "track", spoilt)


def test_a_truncated_film_gives_what_it_has(shell, spoilt, tmp_path):
    frames = made.images(spoilt / "video" / "cam.mp4")
    (spoilt / "video" / "cam.mp4").unlink()
    made.write_film(spoilt / "video" / "cam.mkv", frames)
    data = (spoilt / "video" / "cam.mkv").read_bytes()
    (spoilt / "video" / "cam.mkv").write_bytes(data[: len(data) // 2])
    code, _, err = shell("track", spoilt, "-o", "run", *QUICK)
    assert code == 0
    assert err.count("broken off") == 1  # though the film is read more than once
    assert 5 < len(read_run(tmp_path / "run").motion) < made.FRAMES


def test_a_full_disk(shell, recording, monkeypatch, tmp_path):
    import shadowpuppet.io.run_writer

    lines, real = [], shadowpuppet.io.run_writer.csv_line

    def full(cells):
        lines.append(cells)
        if len(lines) > 2 + 2 * 9:
            raise OSError(28, "No space left on device")
        return real(cells)

    monkeypatch.setattr(shadowpuppet.io.run_writer, "csv_line", full)
    said = refused(shell, "track", recording, "-o", "run", *QUICK)
    assert "run: the run cannot be written (no space left on device); the 10 frames so far are in joints.csv" in said
    assert 9 <= len(read_run(tmp_path / "run").motion) <= 10


def test_a_folder_that_holds_something_else(shell, recording, tmp_path):
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "thesis.tex").touch()
    assert "found thesis.tex in it but no run.toml of a run" in refused(shell, "track", recording, "-o", "thesis")


@pytest.mark.parametrize(("name", "code"), [
    ("SIGINT", 130), pytest.param("SIGTERM", 143, marks=pytest.mark.whole), pytest.param("SIGHUP", 129, marks=pytest.mark.whole)])
def test_control_c_and_the_like_leave_a_run_that_can_be_read_and_goes_on(recording, tmp_path, name, code):
    folder, number = tmp_path / "run", getattr(signal, name)
    # Who starts the tests in the background has them, and so their children, ignore Ctrl-C.
    heeding = functools.partial(signal.signal, number, signal.SIG_DFL)
    child = process("track", recording, "-o", folder, "--tracker.arm.particles", "2000", "--tracker.cycles", "10", preexec_fn=heeding)
    rows = folder / "joints.csv"
    until(lambda: child.poll() is not None or (rows.exists() and rows.read_text().count("\n") >= 4))
    child.send_signal(number)
    _, err = child.communicate()
    assert child.returncode == code
    said = rf"interrupted: the \d+ frames so far are in {re.escape(str(folder))}; the same command with --resume goes on with them"
    assert re.fullmatch(said, err.splitlines()[-1])
    left = read_run(folder)
    assert not left.complete
    assert 2 <= len(left.motion) < made.FRAMES
    assert (folder / "checkpoint.npz").exists()


def interrupted_in(folder):
    with terminal_module.terminal(quiet=True, folder=folder, resume="; --resume"):
        (folder / "run.toml").write_text("complete = false\n", encoding="utf-8")
        (folder / "joints.csv").write_text("time,x\n0,1\n1,1\n", encoding="utf-8")
        raise KeyboardInterrupt


@pytest.mark.parametrize(("before", "said"), [(False, "the 2 frames so far are in {}; --resume"), (True, "nothing was written")])
def test_frames_that_an_interrupted_run_had_written_before_one_was_counted_are_said(tmp_path, before, said):
    (tmp_path / "run.toml").write_text(f"complete = {'false' if before else 'true'}\n", encoding="utf-8")
    with pytest.raises(KeyboardInterrupt) as stop:
        interrupted_in(tmp_path)
    assert str(stop.value) == said.format(tmp_path)


def test_an_earlier_run_is_replaced_only_if_asked_to(shell, recording, run, monkeypatch, tmp_path):
    shutil.copytree(run, tmp_path / "run")
    monkeypatch.setattr("shadowpuppet.pipeline.track.look_around", lambda *_: pytest.fail("it was begun"))
    said = "run: found a complete run, expected --force, which replaces it, or another folder"
    assert said in refused(shell, "track", recording, "-o", "run")
    info = tmp_path / "run" / "run.toml"
    info.write_text(info.read_text().replace("complete = true", "complete = false"))
    assert "run: found a run that was broken off, expected --resume" in refused(shell, "track", recording, "-o", "run")
    said = "run: found a run that was broken off, expected --force, which replaces it, or another folder"
    assert said in refused(shell, "live", "no.mp4", "-o", "run")  # before the camera is opened

    monkeypatch.setattr("shadowpuppet.pipeline.track.track_recording", lambda *_, resume, **__: 1 / 0)
    for answer in ("y\n", "n\n", ""):
        typed = io.StringIO(answer)
        typed.isatty = lambda: True
        monkeypatch.setattr(sys, "stdin", typed)
        monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
        if answer == "y\n":
            with pytest.raises(ZeroDivisionError):
                shell("track", recording, "-o", "run")
        else:
            assert "run that was broken off; replace it? [y/N] error: " in shell("track", recording, "-o", "run").err
    with pytest.raises(ZeroDivisionError):
        shell("track", recording, "-o", "run", "--force")


def test_a_run_that_is_complete_needs_not_go_on(shell, recording, run, monkeypatch, tmp_path):
    shutil.copytree(run, tmp_path / "run")
    monkeypatch.setattr("shadowpuppet.pipeline.track.look_around", lambda *_: pytest.fail("it was begun"))
    code, out, err = shell("track", recording, "-o", "run", "--resume", "--overlay", *QUICK)
    assert (code, err) == (0, "run: the run is complete: nothing is left to be done\n")
    assert "frames/s" in out


def test_control_c_before_the_first_frame(shell, recording, monkeypatch, tmp_path):
    def stop(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("shadowpuppet.pipeline.track.look_around", stop)
    assert shell("track", recording, "-o", "run") == (130, "", "interrupted: nothing was written\n")
    assert not (tmp_path / "run").exists()


def test_a_closed_pipe_is_no_error(recording):
    child = process("settings")
    assert child.stdout is not None
    child.stdout.close()
    assert child.wait() == 0
    assert child.stderr is not None
    assert child.stderr.read() == ""
    child.stderr.close()


def test_a_bug_is_not_hidden(shell, recording, monkeypatch):
    monkeypatch.setattr("shadowpuppet.pipeline.track.look_around", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        shell("track", recording, "-o", "run")


@pytest.mark.shared
def test_the_errors_are_those_of_the_projects_own_script(shell, recording, run, shared):
    score = Path(shared) / "tools" / "score.py"
    command = [sys.executable, str(score), str(run / "joints.csv"), str(recording / "truth.csv"), "--joints", "upper", "--json"]
    theirs = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    ours = json.loads(shell("evaluate", run, "--json")[1])["errors"]
    for key in ("mean_mm", "rmse_mm", "plane_mm", "far", "p95_mm", "aligned_mean_mm"):
        assert ours[key] == pytest.approx(theirs[key], abs=0.01)


def test_plane_and_depth_are_those_of_the_runs_camera(shell, run, tmp_path):
    """Seen from the side, what was depth lies in the picture."""
    turned = made.copied(run, tmp_path / "run")
    rotation = next(line for line in (turned / "calibration.toml").read_text().splitlines() if line.startswith("rotation"))
    side = [[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]]
    made.replace_text(turned / "calibration.toml", rotation, f"rotation = {side}")
    before, after = (json.loads(shell("evaluate", folder, "--json")[1])["errors"] for folder in (run, turned))
    assert after["mean_mm"] == pytest.approx(before["mean_mm"])
    assert after["depth_mm"] < 0.9 * before["depth_mm"]
    assert after["plane_mm"] > before["plane_mm"]


def test_the_speed_of_a_resumed_run_is_that_of_its_own_frames(monkeypatch):
    clock = iter([0.0, 4.0])
    monkeypatch.setattr(terminal_module, "monotonic", lambda: next(clock))
    log = terminal_module._Log(SimpleNamespace(print=lambda *_, **__: None))
    log.begin("tracking", 80)
    log.stop()
    for frame in range(61, 69):
        log.advance(frame)
    assert log._text() == "tracking 68/80, 2.0 a second, 4 s"


@pytest.mark.parametrize("place", cli.COMMANDS.values())
def test_lines_of_a_commands_help_end_where_sentences_do(place):
    module, name = place.split(":")
    text = inspect.cleandoc(getattr(importlib.import_module(f"shadowpuppet.cli.{module}"), name).__doc__)
    for line, following in itertools.pairwise(text.partition("\n\n")[2].splitlines()):  # the first paragraph flows
        indents = [len(each) - len(each.lstrip()) for each in (line, following)]
        if line and following and indents[0] == indents[1] and "---" not in line + following:
            assert line.endswith((".", ":", ";")), line
