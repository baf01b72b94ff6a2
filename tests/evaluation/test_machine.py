"""The process that measures is held to some of the cores that it may use."""

from __future__ import annotations

import os

import pytest

from shadowpuppet.evaluation.bench import machine


@pytest.fixture(autouse=True)
def threads(monkeypatch):
    """OpenCV keeps its threads."""
    monkeypatch.setattr("cv2.setNumThreads", lambda count: None)


@pytest.mark.parametrize(("count", "cores", "said"), [
    (1, [8], "the process kept to one core"), (2, [3, 8], "the process kept to 2 cores"), (9, [1, 3, 8], "the process kept to 3 cores"),
])
def test_it_is_held_to_the_last_cores(monkeypatch, count, cores, said):
    chosen = []
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: {8, 1, 3}, raising=False)  # which has no order
    monkeypatch.setattr(os, "sched_setaffinity", lambda process, cores: chosen.append((process, cores)), raising=False)
    assert machine.use_cores(count) == said
    assert chosen == [(0, cores)]


def test_a_system_without_a_choice_of_cores(monkeypatch):
    monkeypatch.delattr(os, "sched_setaffinity", raising=False)
    assert machine.use_cores() == "one thread each for OpenCV, Numba and BLAS"
