"""A batch on the workers of a Dask cluster, one of which is killed."""

from __future__ import annotations

import os
import signal

import pytest

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.io.run import read_run
from shadowpuppet.pipeline.batch import BatchListener, make_grid, run_batch

distributed = pytest.importorskip("distributed")
dask = pytest.importorskip("dask")
pytestmark = pytest.mark.filterwarnings("default")  # theirs are not ours
QUICK = make_grid({"masks": True, "tracker": {"cycles": 1, "explore": 20}, "initialization": {"rounds": 20, "patience": 5, "sweeps": 2}})


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    place = str(tmp_path_factory.mktemp("dask"))
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, local_directory=place) as found:
        yield found


class Kills(BatchListener):
    """Kills the worker that finished the first run: most of what it is given next is lost with it."""

    def __init__(self, cluster) -> None:
        self.pids = [nanny.pid for nanny in cluster.workers.values()]
        self.ends, self.notes = [], []

    def ended(self, task, outcome, again):
        if not self.ends:
            os.kill(self.pids[0], signal.SIGKILL)
        self.ends.append((task.name, task.seed, outcome["status"]))

    def note(self, message):
        self.notes.append(message)


def test_a_cluster_whose_worker_is_killed_does_the_rest(cluster, recording, tmp_path):
    kills, both = Kills(cluster), [recording, tmp_path / "gone"]
    batch = run_batch(both, tmp_path / "out", QUICK, range(6), scheduler=cluster.scheduler_address, listener=kills)
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
    kills = Kills(cluster)
    kills.pids = []
    kills.ends.append("nobody is killed")
    run_batch([recording], tmp_path / "out", QUICK, range(4), scheduler=cluster.scheduler_address, listener=kills)
    assert sorted(kills.ends[1:]) == [("tiny", 2, "done"), ("tiny", 3, "done")]


def test_a_run_whose_workers_are_lost_each_time_is_named(cluster, recording, tmp_path, monkeypatch):
    """As one that takes more memory than a worker may have."""
    monkeypatch.setattr("shadowpuppet.pipeline.batch.cluster.do_there", _dies)
    batch = run_batch([recording], tmp_path / "out", QUICK, retries=0, scheduler=cluster.scheduler_address)
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


def test_a_scheduler_that_ends_is_said(recording, tmp_path, monkeypatch):
    class Ends(BatchListener):
        def ended(self, task, outcome, again):
            found.scheduler.loop.add_callback(found.scheduler.close)

    monkeypatch.setattr("shadowpuppet.pipeline.batch.cluster.PATIENCE", 1)
    with dask.config.set({"distributed.comm.timeouts.connect": "2s"}), \
            distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=":0") as found, \
            pytest.raises(ShadowPuppetError, match=r"scheduler: the connection to .* was lost"):
        run_batch([recording], tmp_path / "out", QUICK, range(50), scheduler=found.scheduler_address, listener=Ends())
    assert (tmp_path / "out" / "summary.csv").exists()


def test_without_dask_it_is_said_what_is_missing(recording, tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "distributed", None)
    with pytest.raises(ShadowPuppetError, match=r"is not installed; pip install 'shadowpuppet\[batch\]'"):
        run_batch([recording], tmp_path / "out", QUICK, scheduler="tcp://127.0.0.1:8786")
