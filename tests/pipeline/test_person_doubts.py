"""What is doubted about a person's sizes and place, for made fits."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import HARMFUL, NOTED, RUINOUS
from shadowpuppet.pipeline.person import DOUBTFUL, ELSEWHERE, NOBODY, POOR, _doubts, _few, _forearms_seen
from shadowpuppet.tracking.status import UNCERTAIN_OVERLAP


def doubts(overlaps=None, place=0.9, source="proportions", start=0.9, moments=4, stays=True):
    fit = SimpleNamespace(overlaps={f"m{n}": 0.9 for n in range(4)} if overlaps is None else overlaps, place_overlap=place)
    return [(doubt.short.split(":")[0], doubt.severity) for doubt in _doubts(fit, source, start, moments, stays)]


@pytest.mark.parametrize("name", DOUBTFUL)
def test_references_that_do_not_fit(name):
    said = [(f"reference {name} does not fit", NOTED)]
    assert doubts({name: DOUBTFUL[name] - 0.001}, source="references", moments=1) == said
    assert doubts({name: DOUBTFUL[name]}, source="references", moments=1) == []
    assert doubts({name: 0.1}, moments=1) == []


def test_a_distance_that_is_uncertain():
    assert doubts(place=UNCERTAIN_OVERLAP) == []
    assert doubts(place=UNCERTAIN_OVERLAP - 0.001) == [("distance uncertain", HARMFUL)]


def test_somebody_who_changes_place_or_is_not_there():
    assert doubts(start=POOR) == []
    assert doubts(start=POOR - 0.001) == [("body fits the first silhouette badly", HARMFUL)]
    assert doubts(start=NOBODY) == [("body fits the first silhouette badly", HARMFUL)]
    assert doubts(start=NOBODY - 0.001) == [("no person fits the first silhouette", RUINOUS)]
    assert ELSEWHERE == 0.25
    assert doubts(moments=5) == []  # one of five
    assert doubts({"a": 0.9, "b": 0.9, "c": 0.9}, moments=4, start=0.1) == [("person changes place", HARMFUL)]
    assert doubts({"a": 0.9, "b": 0.9, "c": 0.9}, moments=4, stays=False) == []  # a whole person may go elsewhere
    assert doubts({"front_t_pose": 0.9}, moments=4, source="references") == []


def test_a_few_masks_are_spread():
    masks = [np.full((1, 1), n % 2 == 0) for n in range(30)]
    found = _few(masks, 4)
    assert [next(k for k, mask in enumerate(masks) if mask is each) for each in found] == [0, 9, 19, 29]


def forearms(line, mask) -> float:
    """Share of a mask's pixels along both forearms, which lie on one line of pixels."""
    camera = Camera("cam", (20, 10), [[1, 0, 0], [0, 1, 0], [0, 0, 1]])
    ends = np.array([(*end, 1.0) for end in line])
    names = ("left_elbow", "left_wrist", "right_elbow", "right_wrist")
    picture = SimpleNamespace(body=SimpleNamespace(landmark_names=names), points_world=lambda poses: np.concatenate([ends, ends])[None])
    return _forearms_seen(camera, mask, SimpleNamespace(picture=lambda camera: picture), np.zeros(3))


@pytest.mark.parametrize("line", [((0, 0), (19, 0)), ((0, 0), (0, 9)), ((0, 9), (19, 9)), ((19, 0), (19, 9)), ((5, -5), (5, 0))])
def test_forearms_along_the_picture_s_border_are_in_it(line):
    nothing, border = np.zeros((10, 20), bool), np.zeros((10, 20), bool)
    border[[0, -1]] = border[:, [0, -1]] = True
    assert forearms(line, border) == 1
    assert forearms(line, nothing) == 0
    beside = np.ones((10, 20), bool)
    beside[3:7, 3:17] = False
    assert forearms(((3, 5), (16, 5)), beside) < 0.5


@pytest.mark.parametrize("line", [((20, 0), (30, 0)), ((-1, 0), (-9, 0)), ((0, -1), (9, -1)), ((0, 10), (19, 10))])
def test_forearms_out_of_the_picture_are_not_missed(line):
    assert forearms(line, np.zeros((10, 20), bool)) == 1
