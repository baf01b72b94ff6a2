"""What a run leaves out of the silhouettes: what is said of it, and a made film with a cabinet that came after the empty scene."""

from dataclasses import replace

import numpy as np
import pytest

from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import ShadowPuppetWarning
from shadowpuppet.pipeline.findings.camera import survey_camera
from shadowpuppet.pipeline.findings.film import films_again, look_again, survey_film
from shadowpuppet.pipeline.footage import Footage, open_footage
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.progress import Listener, Steps, add_left_out, left_out_metrics, warn_of_left_out
from shadowpuppet.pipeline.rig import open_rig
from shadowpuppet.silhouette.added import BesideBody
from shadowpuppet.synthetic import Obstacle, Scene, Spec, Viewpoint, synthesize
from shadowpuppet.video import open_frames


def camera(name="front"):
    return Camera(name=name, size=(320, 240), matrix=np.array([[300.0, 0, 160], [0, 300.0, 120], [0, 0, 1]]))


def test_left_out_parts_are_said_with_camera_times_and_place_in_the_films_pixels():
    mask = np.zeros((120, 160), bool)
    mask[10:20, 30:50] = True
    carried = ()
    for seconds, masks in ((0.0, ()), (0.5, (None, None)), (1.0, (None, mask)), (1.5, (None, np.roll(mask, 5, axis=1))), (2.0, ()),
                           (2.5, (None, None))):  # fmt: skip
        carried = add_left_out(carried, seconds, masks)
    (found,) = left_out_metrics(carried, [camera(), camera("side")])["left_out"]
    assert found == {"camera": "side", "frames": 2, "from_s": 1.0, "to_s": 1.5, "box": [60, 20, 110, 40]}
    with pytest.warns(ShadowPuppetWarning, match=r"camera 'side', 2 frames from 1\.0 to 1\.5 s, within x 60 to 110, y 20 to 40"):
        warn_of_left_out([found])


def test_a_run_that_leaves_nothing_out_says_nothing(recwarn):
    assert left_out_metrics(add_left_out((), 0.0, (None,)), [camera()]) == {}
    warn_of_left_out([])
    assert not recwarn.list


@pytest.fixture(scope="module")
def beside_cabinet(tmp_path_factory):
    """A small film of a person beside a cabinet that was not there when the empty scene was filmed."""
    cabinet = Obstacle(kind="cabinet", ahead=-0.1, left=0.62, enters=0.0)
    spec = Spec(cameras=(Viewpoint(size=(128, 96), distance=2.6),), rate=8, scene=Scene(obstacles=(cabinet,), empty_seconds=1), seed=5)
    spec = replace(spec, motion=spec.motion[:1])
    folder = tmp_path_factory.mktemp("cabinet") / "made"
    synthesize(spec, folder)
    return folder


def test_what_the_body_leaves_unexplained_and_never_moves_belongs_to_the_scene(beside_cabinet, monkeypatch):
    options = Options()
    footage = open_footage(beside_cabinet, options)
    first = survey_film(footage, options)
    exact = np.mean([frame.image > 0 for frame in open_frames(next((beside_cabinet / "masks").iterdir()))], axis=0)
    person = (exact if exact.ndim == 2 else exact[..., 0]) > 0.5
    thing = (np.mean(first.masks, axis=0) > 0.9) & ~(exact if exact.ndim == 2 else exact[..., 0]).astype(bool)
    assert thing.any()
    with monkeypatch.context() as patched:
        patched.setattr(Footage, "frames", lambda *_, **__: pytest.fail("the film is read again"))
        again = look_again(footage, first, options, BesideBody(thing, person), Steps(None, ["cam"]))
    assert again.silhouettes.added is not None
    assert again.silhouettes.before is not None
    assert np.mean([mask[thing].mean() for mask in again.masks]) < 0.1
    assert np.mean([mask[person].mean() for mask in again.masks]) > 0.9
    assert "never moves" in again.look.added
    assert look_again(footage, again, options, None, Steps(None, ["cam"])) is again
    kept = survey_film(footage, options, added=again.silhouettes.added)
    assert all((one == other).all() for one, other in zip(kept.masks, again.masks))


def test_a_second_look_that_finds_nothing_more_examines_no_recording_again(beside_cabinet, monkeypatch):
    """A kept survey has no films: they are examined again, with what was added before."""
    options = Options()
    rig = open_rig(beside_cabinet, options)
    survey = survey_camera(rig, options)
    nothing = BesideBody(np.zeros((96, 128), bool), np.ones((96, 128), bool))
    with monkeypatch.context() as patched:
        patched.setattr(Footage, "frames", lambda *_, **__: pytest.fail("the film is read again"))
        assert films_again(survey, options, [nothing], Listener()) is None
    assert films_again(survey.settled(), options, [nothing], Listener()) is None
