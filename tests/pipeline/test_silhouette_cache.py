"""What is kept from run to run changes nothing but the time."""

from __future__ import annotations

import made
import numpy as np
import pytest

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.pipeline.options import make_options
from shadowpuppet.pipeline.silhouette_cache import Reel, Repeats
from shadowpuppet.pipeline.track import Listener, track_recording

QUICK = {"tracker": {"cycles": 1, "explore": 20}, "initialization": {"rounds": 20, "patience": 5, "sweeps": 2}}


@pytest.fixture
def track(recording, tmp_path):
    """Tracks; gives joints.csv and whether silhouettes were kept."""

    def tracked(repeats: Repeats | None = None, listener: Listener | None = None, **values) -> tuple[bytes, bool]:
        run = track_recording(recording, tmp_path / "run", make_options(QUICK | values), listener, repeats)
        return (run.folder / "joints.csv").read_bytes(), run.metrics.get("kept_silhouettes", False)

    return tracked


@pytest.mark.parametrize("values", [{}, {"masks": True}, {"region": (30, 0, 140, 120)}, {"every": 4}],
                         ids=["film", "masks", "region", "every"])
def test_runs_are_the_same_with_what_was_kept(track, values):
    repeats = Repeats()
    for seed, kept in ((1, False), (2, True), (1, True)):
        assert track(repeats, seed=seed, **values) == (track(seed=seed, **values)[0], kept)


def test_other_trackers_share_silhouettes_and_other_silhouettes_do_not(track):
    repeats = Repeats()
    track(repeats)
    assert track(repeats, preset="liu2011") == (track(preset="liu2011")[0], True)
    assert track(repeats, silhouette={"factor": 3.0}) == (track(silhouette={"factor": 3.0})[0], False)
    assert not track(repeats)[1]  # one film is held


def test_an_overlay_has_the_films_pictures(track, tmp_path):
    repeats = Repeats()
    track(repeats)
    plain = track()[0]
    assert track(repeats, overlay=True) == (plain, False)
    assert len(made.images(tmp_path / "run" / "overlay.mp4")) == made.FRAMES


def test_a_run_that_broke_off_leaves_nothing_to_keep(track):
    class Stops(Listener):
        def advance(self, frames: int) -> None:
            if frames == 5:
                raise ShadowPuppetError("stop")

    repeats = Repeats()
    with pytest.raises(ShadowPuppetError, match="stop"):
        track(repeats, Stops())
    assert track(repeats) == (track()[0], False)


def test_long_films_are_not_kept(track):
    repeats = Repeats(limit=10 * made.SIZE[0] * made.SIZE[1] // 8)
    track(repeats)
    assert track(repeats) == (track()[0], False)


@pytest.mark.parametrize("shape", [(1, 1), (3, 5), (120, 160), (7, 64)])
def test_a_reel_gives_back_what_it_got(rng, shape):
    reel, masks = Reel(), rng.random((4, *shape)) < 0.5
    for n, mask in enumerate(masks):
        reel.add(n / 10, mask)
    assert reel.times == [0, 0.1, 0.2, 0.3]
    assert reel.size == 4 * -(-shape[0] * shape[1] // 8)
    np.testing.assert_array_equal([reel.mask(bits) for bits in reel.bits], masks)


def test_a_full_reel_holds_nothing():
    reel, mask = Reel(limit=100), np.ones((8, 100), bool)
    for _ in range(5):
        reel.add(0.0, mask)
    assert reel.size == 0
    assert reel.size > reel.limit
