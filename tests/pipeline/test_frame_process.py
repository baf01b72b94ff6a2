"""Frame sets from a process of their own: the same sets, warnings and errors, and an end whatever becomes of either process."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import threading
import warnings
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from solids import looking
from waiting import LONG

from shadowpuppet.errors import ShadowPuppetError, ShadowPuppetWarning, TrackingError, warn
from shadowpuppet.io.recording import Recording, View
from shadowpuppet.pipeline import frame_process
from shadowpuppet.pipeline.footage import Footage
from shadowpuppet.pipeline.frame_process import Task, _taken, frames_beside
from shadowpuppet.pipeline.rig import Rig
from shadowpuppet.pipeline.silhouettes import Silhouettes
from shadowpuppet.silhouette import SilhouetteSettings, learn_background
from shadowpuppet.tracking.multiview.surface.visual_hull import VisualHull
from shadowpuppet.video import write_frames

SIZE = (64, 48)


@pytest.fixture
def started(monkeypatch) -> list[subprocess.Popen]:
    """The processes that are started; films of any length get one."""
    found = list[subprocess.Popen]()

    class Noted(subprocess.Popen):
        def __init__(self, *arguments, **named) -> None:
            super().__init__(*arguments, **named)
            found.append(self)

    monkeypatch.setattr(frame_process, "WORTHWHILE", 0)
    monkeypatch.setattr(frame_process, "usable_cores", lambda: 2)
    monkeypatch.setattr(frame_process.subprocess, "Popen", Noted)
    return found


def task(folder: Path, counts: tuple[int, ...] = (12, 12, 12), **more) -> Task:
    """Of cameras before a block that moves, with films of these numbers of frames."""
    views = list[View]()
    for k, count in enumerate(counts):
        with write_frames(folder / f"cam{k + 1}.mp4", 10.0) as out:
            for n in range(count):
                picture = np.zeros((SIZE[1], SIZE[0], 3), np.uint8)
                picture[10:40, 15 + n : 35 + n] = 255
                out.write(picture, n / 10)
        views.append(View(looking((2.0, k - 1.0, 1.0), size=SIZE, name=f"cam{k + 1}"), folder / f"cam{k + 1}.mp4"))
    recording = Recording(folder, "made", tuple(views))
    rig = Rig(recording, tuple(Footage(recording, view, view.camera) for view in views))
    return Task(rig, (Silhouettes("the film", None),) * len(views), **more)


def alike(one, other) -> bool:
    """Whether two frame sets are equal, but for the seconds they took."""
    def plain(value):
        return value.tolist() if isinstance(value, np.ndarray) else tuple(map(plain, value)) if isinstance(value, tuple) else value

    timeless = [each._replace(decoding=0.0, segmenting=0.0, carving=0.0) for each in (one, other)]
    return plain(timeless[0]) == plain(timeless[1])


@pytest.mark.parametrize("more", [{}, {"every": 3}, {"images": False, "corrected": False}])
def test_the_sets_are_those_of_threads(tmp_path, started, more):
    wanted = task(tmp_path, **more)
    wanted = replace(wanted, hull=VisualHull(wanted.rig.cameras))
    ours, theirs = list(wanted.frames()), list(frames_beside(wanted))
    assert len(started) == 1
    assert len(theirs) == len(ours) == -(-12 // wanted.every)
    assert all(map(alike, ours, theirs))
    assert len(theirs[0].points.points)
    assert all((image is None) != wanted.images for each in theirs for image in each.images)
    theirs[0].seen.masks[0][0, 0] = True  # arrays belong to who has them


def test_nothing_of_the_current_folder_is_imported(tmp_path, started, monkeypatch):
    here = tmp_path / "here"
    here.mkdir()
    for name in ("sitecustomize", "usercustomize", "numpy", "pickle", "shadowpuppet"):
        (here / f"{name}.py").write_text(f"open({str(tmp_path / f'executed-{name}')!r}, 'w').close()\n")
    wanted = task(tmp_path)
    monkeypatch.chdir(here)
    assert len(list(frames_beside(wanted))) == 12
    assert len(started) == 1
    assert not list(tmp_path.glob("executed-*"))


def test_its_warnings_are_ours(tmp_path, started):
    with pytest.warns(ShadowPuppetWarning, match=r"cam2.mp4: ends at 0.30 s; .* without camera 'cam2'") as caught:
        assert len(list(frames_beside(task(tmp_path, (12, 4, 12))))) == 12
    assert len(caught) == 1
    assert caught[0].filename == __file__


def test_warnings_of_libraries_stay_theirs():
    """As warnings of ours, they would name a problem of the films."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        warnings.warn("overflow encountered in cast", RuntimeWarning, stacklevel=1)
        warn("the film breaks off")
        taken = _taken(caught)
    sent = pickle.loads(pickle.dumps(taken))
    assert [(str(each), type(each)) for each in sent] == [("overflow encountered in cast", RuntimeWarning),
                                                          ("the film breaks off", ShadowPuppetWarning)]
    assert caught == []


def test_its_errors_are_ours(tmp_path, started):
    wanted = task(tmp_path)
    with pytest.raises(TrackingError, match="found 3, expected 2"):
        list(frames_beside(replace(wanted, hull=VisualHull(wanted.rig.cameras[:2]))))
    assert started[0].returncode is not None


def test_a_process_that_is_killed_is_an_error_not_a_wait(tmp_path, started):
    with closing(frames_beside(task(tmp_path, (40, 40)))) as frames:
        next(frames)
        started[0].kill()
        with pytest.raises(ShadowPuppetError, match=r"ended with code -?\d+, .*SHADOWPUPPET_THREADS=1"):
            list(frames)


def test_whoever_stops_early_ends_it(tmp_path, started):
    before = threading.active_count()
    for taken in (1, 5):
        with closing(frames_beside(task(tmp_path, (40, 40)))) as frames:
            for _ in range(taken):
                next(frames)
    assert len(started) == 2
    assert all(each.returncode is not None for each in started)
    assert threading.active_count() == before


def test_nothing_is_started_before_the_first_set_is_wanted(tmp_path, started):
    frames_beside(task(tmp_path)).close()
    assert not started


def test_it_ends_when_its_reader_has_gone(tmp_path):
    """As when the reader is killed, which closes the pipe."""
    process = subprocess.Popen([sys.executable, "-c", f"from {frame_process.__name__} import main; main()"], stdin=subprocess.PIPE,
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    with process.stdin as given:
        given.write(pickle.dumps(task(tmp_path, (40, 40))))
    process.stdout.read(100)
    process.stdout.close()
    assert process.wait(LONG) == 0
    assert process.stderr.read() == b""
    process.stderr.close()


def test_short_films_and_single_cameras_and_single_cores_need_none(tmp_path, started, monkeypatch):
    assert len(list(frames_beside(task(tmp_path, (12,))))) == 12
    monkeypatch.setattr(frame_process, "WORTHWHILE", 12 * 3 * SIZE[0] * SIZE[1] + 1)
    assert not task(tmp_path).is_long
    assert len(list(frames_beside(task(tmp_path)))) == 12
    monkeypatch.setattr(frame_process, "WORTHWHILE", 12 * 3 * SIZE[0] * SIZE[1])
    assert task(tmp_path).is_long
    assert not task(tmp_path, every=2).is_long
    monkeypatch.setattr(Rig, "count", None)  # not known
    assert not task(tmp_path).is_long
    monkeypatch.undo()
    monkeypatch.setattr(frame_process, "WORTHWHILE", 0)
    monkeypatch.setattr(frame_process, "usable_cores", lambda: 1)
    assert len(list(frames_beside(task(tmp_path)))) == 12
    assert not started


def test_what_cannot_be_sent_stays_here(tmp_path, started):
    """A mixture is an object of OpenCV; a function without a name in a module cannot be found by another process."""
    empty = [np.zeros((SIZE[1], SIZE[0], 3), np.uint8)] * 5
    mixture = Silhouettes("mog2", learn_background(iter(empty), SilhouetteSettings(method="mog2")))
    wanted = task(tmp_path, (6, 6))
    assert len(list(frames_beside(replace(wanted, silhouettes=(mixture, mixture))))) == 6
    learnt = learn_background(iter(empty), SilhouetteSettings())
    unnamed = Silhouettes("ours", replace(learnt, classifier=lambda frame: np.zeros(frame.shape[:2], np.uint8)))
    assert len(list(frames_beside(replace(wanted, silhouettes=(unnamed, unnamed))))) == 6
    assert not started


@pytest.mark.skipif(not hasattr(os, "nice"), reason="this system knows no niceness")
def test_it_yields_to_the_tracker(tmp_path, started):
    with closing(frames_beside(task(tmp_path, (40, 40)))) as frames:
        next(frames)
        assert os.getpriority(os.PRIO_PROCESS, started[0].pid) == min(os.getpriority(os.PRIO_PROCESS, 0) + frame_process.NICE, 19)
