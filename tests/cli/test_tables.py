"""What tables on the terminal say of made figures: values, units, decimals, and what is left out."""

from __future__ import annotations

import threading
from types import SimpleNamespace

import pytest
from waiting import LONG

from shadowpuppet.cli import batch_terminal
from shadowpuppet.cli.batch_terminal import LINES, BatchTerminal, _clock, _pace
from shadowpuppet.cli.look_tables import _camera_table, _film, _keypoints, _quality, _rig_person, _rig_table
from shadowpuppet.cli.tables import error_table, files_in, metrics_table, people_table, show_next, verdict_of, verdict_table
from shadowpuppet.cli.terminal import Terminal
from shadowpuppet.errors import typed
from shadowpuppet.pipeline.findings.keypoints import FilmKeypointsLook, KeypointsLook
from shadowpuppet.pipeline.findings.verdict import Verdict

QUALITY = SimpleNamespace(frames=12, area=0.0512, area_change=0.0123, flicker=0.0045, specks=0.25, holes=1.5,
                          border={"left": 0.021, "right": 0.02, "bottom": 0.5})  # fmt: skip
PERSON = {"height": 1.756, "distance": 2.5, "source": "references", "overlaps": {"O1": 0.912, "O2": 0.805}, "silhouettes": None,
          "start_overlap": 0.876}  # fmt: skip
LOOK = {"recording": "lab", "camera": "cam", "size": (640, 480), "worked_size": (320, 240), "fov": 60.4, "calibrated": True,
        "lens_calibrated": True, "frames": 250, "rate": 29.97, "jitter": 0.0004, "scale": "by the height", "background": "a film",
        "key": "none", "area": 0.0512, "plain_area": 0.06, "exact_overlap": 0.9512, "exact_overlap_plain": 0.9, "quality": QUALITY,
        "refusal": None, "person": PERSON, "keypoints": None}  # fmt: skip


def test_keypoints_are_listed_by_camera_with_how_far_rays_pass_each_other():
    films = tuple(FilmKeypointsLook(name, "HALPE_26", 26, 120, 2) for name in ("left", "right"))
    one = "left: 26 landmarks by HALPE_26, persons in 120 frames, up to 2 in one"
    assert _keypoints(None) is None
    assert _keypoints(KeypointsLook(films[:1])) == one
    assert _keypoints(KeypointsLook(films, 0.0123, 4.21)) == (
        f"{one}; {one.replace('left', 'right')}; rays pass the points where they meet by 4.2 px, 12 mm (median)")


def test_the_look_at_a_recording(printed):
    assert printed(_camera_table(SimpleNamespace(**LOOK))) == [
        "recording lab",
        "camera cam, 640 x 480 pixels, scaled to 320 x 240, 60 degrees wide, calibrated",
        "film 250 frames, 29.97 frames/s, times uneven by 0.4 ms",
        "scale by the height",
        "background a film",
        "silhouettes 5.1 % of the picture, in 12 frames; by the fixed threshold of Liu 2011, eq. 1, 6.0 %",
        "exact masks these silhouettes overlap the ready ones by 0.951; those of the plain rule by 0.900",
        "quality area changes by 1.2 % a frame, 0.4 % flickers; 0.2 specks and 1.5 holes a frame; touches left, bottom of the "
        "picture",
        "person height 1.76 m at 2.50 m; sizes from references (overlap: O1 0.91, O2 0.81); overlaps the film's first silhouette "
        "by 0.88",
    ]
    little = LOOK | {"worked_size": (640, 480), "calibrated": False, "lens_calibrated": False, "key": "colour: more",
                     "plain_area": None, "exact_overlap": None, "refusal": "no",
                     "person": PERSON | {"source": "height", "silhouettes": "hand"}}  # fmt: skip
    found = printed(_camera_table(SimpleNamespace(**little)))
    assert found[1] == "camera cam, 640 x 480 pixels, 60 degrees wide, not calibrated"
    assert printed(_camera_table(SimpleNamespace(**little | {"lens_calibrated": True})))[1].endswith("its lens calibrated, not its place")
    assert found[4:7] == ["background a film", "told by colour: more", "silhouettes 5.1 % of the picture, in 12 frames"]
    assert " ".join(found[7:]) == ("person height 1.76 m at 2.50 m; sizes from height; overlaps the film's first silhouette by 0.88; all "
                                   "this in clean silhouettes by hand: plain ones show no posture")
    assert _film(SimpleNamespace(frames=None, rate=float("inf"), jitter=0.0)) == "frames not counted, rate unknown"
    assert _film(SimpleNamespace(frames=3, rate=100.0, jitter=0.0001)) == "3 frames, 100 frames/s"
    assert _quality(SimpleNamespace(quality=SimpleNamespace(**{**vars(QUALITY), "border": {"left": 0.02}}))).endswith(
        "touches no side of the picture")


def test_the_look_at_several_cameras(printed):
    cameras = [SimpleNamespace(name=name, size=(640, 480), worked_size=size, fov=45.6, place=(1.0, -2.25, 1.5), quality=QUALITY,
                               exact_overlap=exact, key=key, background=f"background/{name}.mp4")
               for name, size, exact, key in (("a", (640, 480), None, "none"), ("b", (320, 240), 0.95, "colour: red"))]  # fmt: skip
    person = {"source": "training", "overlap": 0.912, "residual": 0.0123}
    look = SimpleNamespace(recording="lab", frames=250, rate=25.0, cameras=cameras, person=person, keypoints=None,
                           agreement=SimpleNamespace(height=1.8, apart=(None, 1.25)))  # fmt: skip
    assert printed(_rig_table(look)) == [
        "recording lab", "cameras 2, 250 sets of pictures in step, 25 a second", "",
        "camera pixels wide stands at, m person exact apart",
        "a 640 x 480 46° 1.0 -2.2 1.5 5.1 %",
        "b 640 x 480, as 320 x 240 46° 1.0 -2.2 1.5 5.1 % 0.950 1.2 px", "",
        "background background/<camera>.mp4", "told by colour", "seen silhouettes span 1.80 m, raised hands, hair and shoes included",
        "person sizes from training; overlaps the first silhouettes by 0.91; 12 mm from body to surface points (rms)",
    ]  # fmt: skip
    look.person = {"source": "person.toml", "residual": float("nan")}
    assert printed(_rig_table(look))[-1] == "person sizes from person.toml"
    look.cameras[1].exact_overlap, look.person, look.agreement.height, look.frames = None, None, None, None
    found = printed(_rig_table(look))
    assert found[1] == "cameras 2, sets not counted of pictures in step, 25 a second"
    assert found[3] == "camera pixels wide stands at, m person apart"
    assert found[5] == "b 640 x 480, as 320 x 240 46° 1.0 -2.2 1.5 5.1 % 1.2 px"
    assert found[-1] == "told by colour"
    assert _rig_person({}) == "measured"


METRICS = {"frames": 60, "status": {"tracked": 57, "lost": 3}, "limb_status": None, "jitter_m_s2": 2.345, "truth_jitter_m_s2": None,
           "overlap": {"count": 57, "mean": 0.9123, "p5": 0.8}, "cost_px": {"count": 57, "mean": 812.6, "p95": 1234.5},
           "errors": {"mean_mm": 12.34, "rmse_mm": 15.5, "plane_mm": 5.0, "depth_mm": 9.0, "aligned_mean_mm": 8.0, "far": 0.0123, "lost": 3,
                      "frames": 58}}  # fmt: skip


def test_figures_of_a_run(printed):
    assert printed(metrics_table(METRICS)) == [
        "frames 60: 57 tracked, 3 lost (nothing fits)", "overlap 0.912, good (IoU of body and silhouette; p5 0.800)",
        "jitter 2.35 m/s2",
        "error 12.3 mm (MPJPE; plane 5.0, depth 9.0); 8.0 mm with each frame moved to the truth's place; 1.2 % off by over 300 mm",
        "lost 3 of the truth's 58 frames have no pose: 500 mm off each",
        "compared the truth has 58 frames, the run 60: is it this recording's?",
    ]  # fmt: skip
    several = METRICS | {"cost_m2": {"count": 5, "mean": 0.0123, "p95": 0.05}, "truth_jitter_m_s2": 1.5, "clock": {}}
    found = printed(metrics_table(several))
    assert found[2] == "jitter 2.35 m/s2, the truth's 1.50"
    assert found[3].startswith("error 12.3 mm (MPJPE; rmse 15.5); 8.0 mm")
    assert len(found) == 5
    nothing = {"frames": 0, "status": {}, "jitter_m_s2": None, "overlap": {"count": 0}, "cost_px": {"count": 0}, "limb_status": None}
    assert printed(metrics_table(nothing)) == ["frames none"]
    assert printed(metrics_table(METRICS | {"jitter_m_s2": float("nan")}))[2].startswith("error")


def test_errors_of_joints(printed):
    one = {"mean_mm": 12.34, "rmse_mm": 15.5, "p95_mm": 30.0, "max_mm": 99.9, "far": 0.0123}
    assert printed(error_table(one | {"joints": {"head": one}})) == [
        "joint errors, mm", "joint mean rmse p95 max over 300", "head 12.3 15.5 30.0 99.9 1.2 %", "all 12.3 15.5 30.0 99.9 1.2 %"]


def test_people(printed):
    one = {"frames": 60, "status": {"tracked": 57, "lost": 3, "absent": 0}, "overlap": {"count": 5, "mean": 0.912}}
    assert printed(people_table({1: one, 2: one | {"overlap": {"count": 0}, "errors": {"mean_mm": 12.34}}})) == [
        "people", "frames status overlap error, mm", "person 1 60 57 tracked, 3 lost 0.91", "person 2 60 57 tracked, 3 lost 12.3"]


def test_verdicts(printed):
    def verdict(word, *reasons):
        return printed(verdict_table(Verdict(word, reasons), "verdict"))

    assert verdict("good", "it is dark", "it is far") == ["verdict good", "but it is dark", "it is far"]
    assert verdict("bad", "it is dark") == ["verdict bad", "because it is dark"]
    assert verdict("good") == ["verdict good"]
    assert printed(verdict_table(Verdict("bad", ("dark",)), "on the run")) == ["on the run bad", "because dark"]
    assert printed(verdict_of({"word": "bad", "reasons": ["dark"], "more": 1}, "person 1")) == ["person 1 bad", "because dark"]
    both = ["verdict good in the picture, bad in depth", "because one camera"]
    assert printed(verdict_table(Verdict("good", ("one camera",), "bad"), "verdict")) == both


def test_files_that_are_there_are_named(tmp_path):
    for name in ("b.csv", "c.mp4"):
        (tmp_path / name).touch()
    assert files_in(tmp_path, "a.csv", "b.csv", "c.mp4") == ("made", [str(tmp_path / "b.csv"), str(tmp_path / "c.mp4")])


def test_parts_stand_apart(printed):
    assert printed("one", "two") == ["one", "", "two"]


# A batch --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("pace", "said"), [(12, "12 runs/s"), (0.5, "0.5 runs/s"), (0.49, "29 runs/min"), (0.01, "0.6 runs/min"),
                                            (0.008, "29 runs/h"), (0.0001, "0.36 runs/h")])
def test_paces(pace, said):
    assert _pace(pace) == said


@pytest.mark.parametrize(("seconds", "said"), [(0, "0:00:00"), (59.9, "0:00:59"), (60, "0:01:00"), (3599, "0:59:59"), (36061, "10:01:01")])
def test_clocks(seconds, said):
    assert _clock(seconds) == said


def test_commands_to_go_on_with_can_be_pasted(capsys, monkeypatch):
    monkeypatch.setenv("SHADOWPUPPET_COMMAND", "./run shadowpuppet")
    show_next(typed("info", "Über mich/mein Raum"), typed("track", "a" * 90, "--overlay"))
    assert capsys.readouterr().out.splitlines() == [
        "", "next", "  ./run shadowpuppet info 'Über mich/mein Raum'", f"  ./run shadowpuppet track {'a' * 90} --overlay"]


def task(name):
    return SimpleNamespace(name=name, label=f"{name} drs 0")


@pytest.fixture
def batch(monkeypatch, capsys):
    """A batch of ten runs, two of them done before, after 100 s."""
    now = [50.0]
    monkeypatch.setattr(batch_terminal, "monotonic", lambda: now[0])
    made = BatchTerminal(Terminal())
    made.begin(10, 2)
    now[0] = 150.0
    yield made
    made.stop()


def test_a_batch_counts(batch, capsys):
    assert batch._counts() == "2 of 10 runs done"
    batch.ended(task("a"), {"status": "done"}, False)
    batch.ended(task("b"), {"status": "failed", "message": "no film"}, True)
    batch.ended(task("b"), {"status": "failed", "message": "no film"}, False)
    assert (batch.done, batch.failed) == (1, 1)
    assert batch._counts() == "3 of 10 runs done, 1 failed  1.2 runs/min, 0:05:00 left"
    said = capsys.readouterr().err.splitlines()
    assert said == ["2 of 10 runs are done already", "warning: b drs 0: no film; it is tried again", "warning: b: failed: no film"]


def test_without_a_screen_a_batch_says_in_lines_what_it_does(batch):
    assert batch._line() == "2 of 10 runs done"
    for n in range(4):
        batch.working(n, task(f"film{n}"), "tracking", 5, 60)
    assert batch._line() == "2 of 10 runs done; film0 drs 0: tracking 5/60; film1 drs 0: tracking 5/60; 2 more"


def test_the_lines_begin_and_end_with_the_batch(monkeypatch, capsys):
    monkeypatch.setattr(batch_terminal, "LOG_EVERY", 0.001)
    monkeypatch.setattr(batch_terminal, "PAUSE", 0.001)
    told, said = BatchTerminal(Terminal()), threading.Event()
    monkeypatch.setattr(told._terminal.console, "print", lambda *_, **__: said.set())
    told.begin(3, 0)
    assert said.wait(LONG)
    told.stop()
    assert told._log._end is None


def test_workers_are_shown(batch, printed):
    assert printed(batch._table())[0] == "workers are starting"
    for n in range(LINES + 3):
        batch.working(n, task(f"film{n}"), "tracking", 5 if n else 0, 60 if n > 1 else None)
    batch.resting(LINES + 2)
    lines = printed(batch._table())
    assert lines[:3] == ["1 film0 drs 0 tracking", "2 film1 drs 0 tracking 5", "3 film2 drs 0 tracking 5/60"]
    assert lines[LINES] == "and 2 more"
    assert lines[-1].endswith("2 of 10 runs done")


def test_failures_are_said_once_a_reason(batch, capsys):
    told = {"a": "dark", "b": "far", "c": "dark", "d": "dark"}
    runs = [SimpleNamespace(message=message, task=task(name)) for name, message in told.items()]
    batch.failures(SimpleNamespace(failed=runs, runs=runs * 2))
    assert capsys.readouterr().err.splitlines()[-3:] == ["failed: a drs 0 and 2 more: dark", "failed: b drs 0: far",
                                                         "4 of 8 runs failed; the same command tries them again"]
