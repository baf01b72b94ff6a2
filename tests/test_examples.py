"""Every example runs, on a small made recording, and the README's is one of them."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path

import numpy as np
import pytest
from people import shapes_of

from shadowpuppet.camera.bits import count
from shadowpuppet.synthetic import Gesture, Ring, Scene, Spec, Viewpoint, synthesize

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
MADE = {"01": ["sample-run/joints.csv", "sample-run/overlay.mp4"], "02": ["one_picture.png"], "04": ["masks.mkv"],
        "05": ["ring-run/joints.csv", "ring-run/overlay.mp4"], "06": ["prior.npz", "prior.png"], "07": ["refined.png"]}
"""Files that examples leave behind, by their numbers."""


@pytest.fixture(scope="module")
def recording(once) -> Path:
    return once("examples/recording", lambda folder: small(folder, Gesture(motion="wave_hands", seconds=3)))


@pytest.fixture(scope="module")
def reaching(once) -> Path:
    """Arms before the body."""
    motion = Gesture(motion="forearms_up", seconds=4), Gesture(motion="reach", seconds=5)
    return once("examples/reaching/recording", lambda folder: small(folder, *motion))


def small(folder: Path, *motion: Gesture) -> Path:
    """One small camera."""
    spec = Spec(motion=motion, cameras=(Viewpoint(size=(160, 120)),), scene=Scene(empty_seconds=1), rate=6)
    return synthesize(spec, folder, np.random.default_rng(1))


@pytest.fixture(scope="module")
def ring(once) -> Path:
    """Four small cameras."""
    spec = Spec(motion=(Gesture(motion="walk", seconds=2),), scene=Scene(empty_seconds=1), rate=6,
                ring=Ring(count=4, radius=3.6, fov_deg=42, size=(160, 120)))  # fmt: skip
    return once("examples/ring", lambda folder: synthesize(spec, folder, np.random.default_rng(1)))


def given(example: Path, recording: Path, ring: Path, reaching: Path) -> list[str]:
    """What an example is started with: what it would else make is large, and what it makes itself is not."""
    if "synthesize" not in example.read_text("utf-8"):
        return []
    return [str({"05": ring, "09": reaching}.get(example.name[:2], recording))]


@pytest.mark.whole
@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_examples_run_and_say_something(example, recording, ring, reaching, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [str(example), *given(example, recording, ring, reaching)])
    left = runpy.run_path(str(example), run_name="__main__")
    assert capsys.readouterr().out.strip()
    SHOWN.get(example.name[:2], lambda left: None)(left)
    for name in MADE.get(example.name[:2], []):
        assert (tmp_path / name).stat().st_size > 0
    gallery = runpy.run_path(str(ROOT / "docs" / "make_gallery.py"))
    if example.name[:2] in gallery["LEFT"]:
        assert gallery["picture_of"](example.name[:2], tmp_path).std() > 10


def tournament_selects(left):
    """Costs of a random body would be some thousands of pixels, of 19,200."""
    assert 0 < left["costs"]["tournament"] < 2 * left["costs"]["as in the paper"] < 2000


def more_cards_keep_their_width(left):
    """A level forearm that is turned about itself; and who has such arms is followed as well as by the cardbox."""
    drawn = {}
    for body in ("cardbox", left["starbox"]):
        picture = left["fit"].guess.picture(left["footage"].camera, body)
        rolled = [picture.body.skeleton.pose(left_shoulder_abduction=np.pi / 2, left_elbow_roll=roll) for roll in np.radians([0, 22.5, 45])]
        forearm = shapes_of(picture.body, "left_forearm")
        areas = [count(picture.draw(pose, forearm)) for pose in rolled]
        drawn[picture.body.name] = min(areas) / areas[0]
    assert drawn["cardbox"] < 0.85 < 0.9 < drawn["starbox"]
    assert left["costs"]["starbox"] < 1.3 * left["costs"]["cardbox"]
    assert len(left["tracker"].picture.body.parts) == 15 + 2 * 7


def the_glove_tells_where_the_hand_is(left):
    """In the image; how far away the hand is one small picture does not show."""
    assert left["apart"]["with the glove"] < 0.5 * left["apart"]["silhouettes"]


SHOWN = {"03": tournament_selects, "08": more_cards_keep_their_width, "09": the_glove_tells_where_the_hand_is}
"""What must be true of what examples found, by their numbers: of the names that they leave."""


@pytest.mark.parametrize("number", SHOWN)
def test_what_is_added_takes_under_forty_lines(number):
    code = next(path for path in EXAMPLES if path.name.startswith(number)).read_text("utf-8").split('"""', 2)[2]
    assert sum(1 for line in code.splitlines() if line.strip()) < 40


def test_examples_are_numbered_and_each_says_what_it_shows():
    assert [path.name[:2] for path in EXAMPLES] == [f"{n:02}" for n in range(1, len(EXAMPLES) + 1)]
    assert all(path.read_text("utf-8").startswith('"""') and len(path.read_text("utf-8").splitlines()) <= 70 for path in EXAMPLES)


def test_the_readme_shows_the_first_example():
    code = EXAMPLES[0].read_text("utf-8").split('"""')[2].strip()
    assert code in (ROOT / "README.md").read_text("utf-8")
