"""What is kept from run to run changes nothing but the time."""

from __future__ import annotations

import os
from types import SimpleNamespace

import made
import numpy as np
import pytest
from follower import followed

from shadowpuppet.camera.colour_codes import colour_codes, thinned
from shadowpuppet.camera.keypoints import Keypoints
from shadowpuppet.camera.mask import Seen
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.pipeline.options import make_options
from shadowpuppet.pipeline.prepare import MULTIVIEW
from shadowpuppet.pipeline.rig import open_rig
from shadowpuppet.pipeline.silhouette_cache import MaskStore, SilhouetteCache
from shadowpuppet.pipeline.track import Listener, run, track_recording

pytestmark = pytest.mark.usefixtures("scale_unfitted")
QUICK = {"tracker": {"cycles": 1, "explore": 20}, "initialization": {"rounds": 20, "patience": 5, "sweeps": 2}}


@pytest.fixture
def track(recording, tmp_path):
    """Tracks; gives joints.csv and whether silhouettes were kept."""

    def tracked(cache: SilhouetteCache | None = None, listener: Listener | None = None, **values) -> tuple[bytes, bool]:
        run = track_recording(recording, tmp_path / "run", make_options(QUICK | values), listener, cache)
        return (run.folder / "joints.csv").read_bytes(), run.metrics.get("kept_silhouettes", False)

    return tracked


@pytest.mark.parametrize("values", [{}, {"masks": True}, {"region": (30, 0, 140, 120)}, {"every": 4}],
                         ids=["film", "masks", "region", "every"])
def test_runs_are_the_same_with_what_was_kept(track, values):
    cache, plain = SilhouetteCache(), track(seed=2, **values)[0]
    assert not track(cache, seed=1, **values)[1]
    for _ in range(2):
        assert track(cache, seed=2, **values) == (plain, True)


def test_other_trackers_share_silhouettes_and_other_silhouettes_do_not(track):
    cache = SilhouetteCache()
    track(cache)
    other = {"cycles": 2, "explore": 20, "resampling": "stratified"}
    assert track(cache, tracker=other) == (track(tracker=other)[0], True)
    assert track(cache, silhouette={"factor": 3.0}) == (track(silhouette={"factor": 3.0})[0], False)
    assert not track(cache)[1]  # one film is held


def test_an_overlay_has_the_films_pictures(track, tmp_path):
    cache = SilhouetteCache()
    track(cache)
    plain = track()[0]
    assert track(cache, overlay=True) == (plain, True)
    assert len(made.images(tmp_path / "run" / "overlay.mp4")) == made.FRAMES


def test_a_film_that_was_replaced_between_two_runs_is_surveyed_again(spoilt):
    cache, made_of, made_survey = SilhouetteCache(), [], SimpleNamespace(settled=lambda: "a survey")

    def survey(**values) -> None:
        cache.survey(open_rig(spoilt, make_options(values)), make_options(values), lambda rig, _: made_of.append(rig) or made_survey)

    survey()
    survey()
    assert len(made_of) == 1
    (film,) = (path for path in (spoilt / "video").iterdir())
    os.utime(film, (1, 1))
    survey()
    assert len(made_of) == 2


def test_a_run_that_broke_off_leaves_nothing_to_keep(track):
    class Stops(Listener):
        def advance(self, frames: int) -> None:
            if frames == 5:
                raise ShadowPuppetError("stop")

    cache = SilhouetteCache()
    with pytest.raises(ShadowPuppetError, match="stop"):
        track(cache, Stops())
    assert track(cache) == (track()[0], False)


def test_long_films_are_not_kept(track):
    cache = SilhouetteCache(limit=1000)
    track(cache)
    assert track(cache) == (track()[0], False)


@pytest.mark.parametrize("shape", [(1, 1), (3, 5), (120, 160), (7, 64)])
def test_a_store_gives_back_what_it_got(rng, shape):
    store, masks = MaskStore(), rng.random((4, 2, *shape)) < 0.5
    for n, (one, other) in enumerate(masks):
        store.add(n / 10, Seen((one, None, other)))
    assert [each.time for each in store] == [0, 0.1, 0.2, 0.3]
    assert 0 < store.size < 8 * (-(-shape[0] * shape[1] // 8) + 20)
    assert all(each.seen.masks[1] is None and each.images == (None,) * 3 for each in store)
    np.testing.assert_array_equal([[each.seen.masks[0], each.seen.masks[2]] for each in store], masks)


@pytest.mark.parametrize("shape", [(1, 1), (120, 160), (480, 640)])
def test_a_store_keeps_the_colours_of_what_is_in_the_mask(rng, shape):
    store, mask = MaskStore(), rng.random(shape) < 0.5
    codes = colour_codes(rng.integers(0, 256, (*shape, 3), np.uint8))
    store.add(0.0, Seen((mask, mask, None), codes=(codes, None, codes)))
    (found,) = store
    np.testing.assert_array_equal(found.seen.codes[0], np.where(thinned(mask), codes, 0))
    assert found.seen.codes[1:] == (None, None)
    assert store.size > 2 * -(-mask.size // 8)


def test_a_store_keeps_keypoints():
    found = Keypoints(("nose",), np.ones((1, 1, 2)), np.ones((1, 1)), np.array([-1]), "made")
    store, mask = MaskStore(), np.ones((8, 100), bool)
    store.add(0.0, Seen((mask, mask), keypoints=(found, None)))
    store.add(0.1, Seen((mask, mask)))
    assert [each.seen.keypoints for each in store] == [(found, None), ()]


def test_a_full_store_holds_nothing():
    store, mask = MaskStore(limit=20), np.ones((8, 100), bool)
    for _ in range(5):
        store.add(0.0, Seen((mask,)))
    assert not store.sets
    assert store.size > store.limit


@pytest.mark.whole
def test_several_cameras_share_silhouettes_between_seeds(rig_recording, tmp_path, monkeypatch):
    cache = SilhouetteCache()
    kind = MULTIVIEW._replace(fit=lambda rng, survey, options: followed(survey.rig.cameras))

    def tracked(seed: int, cache: SilhouetteCache | None = None) -> tuple[bytes, bool]:
        options = make_options({"seed": seed})
        result = run(open_rig(rig_recording, options), kind, tmp_path / "run", options, Listener(), cache)
        return (result.folder / "joints.csv").read_bytes(), result.metrics.get("kept_silhouettes", False)

    alone = [tracked(seed)[0] for seed in (1, 2)]
    assert alone[0] != alone[1]
    assert tracked(1, cache) == (alone[0], False)
    monkeypatch.setattr("shadowpuppet.pipeline.rig.CameraReader.advance", None)  # nothing is read again
    assert tracked(2, cache) == (alone[1], True)
