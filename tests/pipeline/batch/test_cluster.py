"""A batch on the workers of a Dask cluster, one of which is killed."""

from __future__ import annotations

import gc
import os
import re
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import pytest

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.io.run import read_run
from shadowpuppet.pipeline.batch import BatchListener, make_grid, run_batch

distributed = pytest.importorskip("distributed")
dask = pytest.importorskip("dask")
psutil = pytest.importorskip("psutil")  # Dask needs it
pytestmark = [pytest.mark.whole, pytest.mark.filterwarnings("default")]  # theirs are not ours
QUICK = make_grid({"masks": True, "tracker": {"cycles": 1, "explore": 20}, "initialization": {"rounds": 20, "patience": 5, "sweeps": 2}})


class DaskCluster:
    """A scheduler and its workers, each a process of its own, as in a laboratory."""

    def __init__(self, scheduler, address):
        self.scheduler, self.address, self.nannies = scheduler, address, []

    def worker_pids(self):
        """Of the processes that work; the nannies begin each again when it is lost."""
        children = [child for nanny in self.nannies for child in psutil.Process(nanny.pid).children()]
        return [child.pid for child in children if "spawn_main" in "".join(child.cmdline())]


@contextmanager
def dask_cluster(folder, workers):
    """Start a scheduler and `workers` workers with one thread each; end them all."""
    module = [sys.executable, "-P", "-m", "distributed.cli.dask_"]
    here = os.environ | {"PYTHONPATH": str(Path(__file__).parents[3])}  # what a worker is sent may be a function of this file
    logs = [(folder / f"{index}.log").open("w+") for index in range(workers + 1)]
    begun = []

    def begin(name, *arguments):
        command = [*module[:-1], module[-1] + name, "--no-dashboard", *arguments]
        begun.append(subprocess.Popen(command, cwd=folder, env=here, stdout=logs[len(begun)], stderr=subprocess.STDOUT))
        return begun[-1]

    def said(log, pattern, times=1):
        for _ in range(600):
            text = (folder / f"{log}.log").read_text()
            if len(found := re.findall(pattern, text)) >= times:
                return found[-1]
            time.sleep(0.1)
        raise TimeoutError(f"no {pattern!r} within a minute: {text}")

    try:
        scheduler = begin("scheduler", "--host", "127.0.0.1", "--port", "0")
        cluster = DaskCluster(scheduler, said(0, r"Scheduler at:\s+(tcp://\S+)"))
        for _ in range(workers):
            cluster.nannies.append(begin("worker", cluster.address, "--nthreads", "1", "--local-directory", str(folder)))
        said(0, r"Register worker", workers)
        yield cluster
    finally:
        for process in reversed(begun):
            for child in psutil.Process(process.pid).children(recursive=True) if process.poll() is None else ():
                child.kill()
            process.kill()
            process.wait()
        for log in logs:
            log.close()


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    with dask_cluster(tmp_path_factory.mktemp("dask"), 2) as found:
        yield found


class Kills(BatchListener):
    """Kills the worker that finished the first run: most of what it is given next is lost with it."""

    def __init__(self, pids) -> None:
        self.pids = pids
        self.ends, self.notes = [], []

    def ended(self, task, outcome, again):
        if not self.ends:
            os.kill(self.pids[0], signal.SIGKILL)
        self.ends.append((task.name, task.seed, outcome["status"]))

    def note(self, message):
        self.notes.append(message)


def test_a_cluster_whose_worker_is_killed_does_the_rest(cluster, recording, tmp_path):
    kills, both = Kills(cluster.worker_pids()), [recording, tmp_path / "gone"]
    batch = run_batch(both, tmp_path / "out", QUICK, range(6), scheduler=cluster.address, listener=kills)
    assert [run.status for run in batch.runs] == ["done"] * 6 + ["failed"] * 6
    assert sorted(seed for name, seed, status in kills.ends if status == "done") == list(range(6))
    assert "no such recording" in batch.runs[6].message
    assert kills.notes == []
    assert not [path for path in (tmp_path / "out" / "runs").iterdir() if path.name.startswith(".")]
    here = run_batch([recording], tmp_path / "here", QUICK, [5], workers=0)
    assert (batch.runs[5].folder / "joints.csv").read_bytes() == (here.runs[0].folder / "joints.csv").read_bytes()
    assert read_run(batch.runs[5].folder).complete


def test_a_second_start_elsewhere_does_what_is_missing(cluster, recording, tmp_path):
    run_batch([recording], tmp_path / "out", QUICK, [0, 1], workers=0)
    kills = Kills([])
    kills.ends.append("nobody is killed")
    run_batch([recording], tmp_path / "out", QUICK, range(4), scheduler=cluster.address, listener=kills)
    assert sorted(kills.ends[1:]) == [("tiny", 2, "done"), ("tiny", 3, "done")]


def test_a_run_whose_workers_are_lost_each_time_is_named(cluster, recording, tmp_path, monkeypatch):
    """As one that takes more memory than a worker may have."""
    monkeypatch.setattr("shadowpuppet.pipeline.batch.cluster.do_there", _dies)
    batch = run_batch([recording], tmp_path / "out", QUICK, retries=0, scheduler=cluster.address)
    assert batch.runs[0].message == "its workers were lost, one after another: killed, or out of memory"


def _dies(*_: object) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def test_a_folder_that_a_worker_does_not_see_is_said(tmp_path):
    from shadowpuppet.pipeline.batch.cluster import do_there

    said = do_there({"folder": "x"}, str(tmp_path / "elsewhere"), "now", True)
    assert said["status"] == "failed"
    assert "elsewhere: found no batch.toml in it, expected the batch's folder, which all machines" in said["message"]


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:1", "nonsense://here", ""])
def test_a_scheduler_that_does_not_answer_is_said(recording, tmp_path, address, monkeypatch):
    monkeypatch.setattr("shadowpuppet.pipeline.batch.cluster.PATIENCE", 0.5)
    with pytest.raises(ShadowPuppetError, match=r"scheduler: found '.*', at which no Dask scheduler answers"):
        run_batch([recording], tmp_path / "out", QUICK, scheduler=address)
    left = [thing for thing in gc.get_objects() if isinstance(thing, distributed.Client) and thing.status != "closed"]
    assert not left, "a client that the collector finds while another begins is a deadlock"


def test_a_scheduler_that_ends_is_said(recording, tmp_path, monkeypatch):
    class Ends(BatchListener):
        def ended(self, task, outcome, again):
            found.scheduler.terminate()

    monkeypatch.setattr("shadowpuppet.pipeline.batch.cluster.PATIENCE", 5)
    with dask.config.set({"distributed.comm.timeouts.connect": "2s"}), dask_cluster(tmp_path, 1) as found, \
            pytest.raises(ShadowPuppetError, match=r"scheduler: the connection to .* was lost"):
        run_batch([recording], tmp_path / "out", QUICK, range(50), scheduler=found.address, listener=Ends())
    assert (tmp_path / "out" / "summary.csv").exists()


def test_without_dask_it_is_said_what_is_missing(recording, tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "distributed", None)
    with pytest.raises(ShadowPuppetError, match=r"is not installed; .*install 'shadowpuppet\[batch\]'"):
        run_batch([recording], tmp_path / "out", QUICK, scheduler="tcp://127.0.0.1:8786")
