"""Several films in step: what belongs together, cameras that differ in rate, start and length, films that break off."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from solids import looking

from shadowpuppet.errors import RecordingError, SettingsError, ShadowPuppetWarning, SilhouetteError
from shadowpuppet.io.keypoints.film_keypoints import film_keypoints
from shadowpuppet.io.keypoints.keypoint_files import KeypointSource
from shadowpuppet.io.recording import Recording, View
from shadowpuppet.pipeline.findings.opening import kept_sets
from shadowpuppet.pipeline.footage import CameraFrame, Footage, Opening, camera_footage, chosen_views, cut, spread_frames, take_sample
from shadowpuppet.pipeline.options import Options, make_options
from shadowpuppet.pipeline.repair.films import check_calibration
from shadowpuppet.pipeline.rig import LATE, Rig, open_rig, read_frames, synchronized_frames
from shadowpuppet.silhouette.segmenter import Segmented
from shadowpuppet.video import write_frames

SIZE = (32, 16)
in_tmp_path = settings(max_examples=12, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def numbered(n: int) -> np.ndarray:
    """A picture that tells its number, whatever the codec does to it: eight bars."""
    bits = 255 * np.repeat((n >> np.arange(8)) & 1, SIZE[0] // 8).astype(np.uint8)
    return np.broadcast_to(bits[None, :, None], (*SIZE[::-1], 3)).copy()


def number_of(image: np.ndarray) -> int:
    bars = image[:, :, 1].reshape(SIZE[1], 8, -1).mean((0, 2)) > 127
    return int((bars << np.arange(8)).sum())


def film(path: Path, times: np.ndarray) -> Path:
    with write_frames(path, 1 / float(np.median(np.diff(times))), lossless=path.suffix == ".mkv") as out:
        for n, time in enumerate(times):
            out.write(numbered(n), float(time))
    return path


def rig(folder: Path, *times: np.ndarray, starts=(), duration: float | None = None, suffix: str = ".mkv") -> Rig:
    """A rig of films of frames at these times (s)."""
    views = []
    for k, shown in enumerate(times):
        path = film(folder / f"cam{k + 1}{suffix}", shown)
        views.append(View(looking((2.0, k, 1.0), size=SIZE, name=f"cam{k + 1}"), path, start=starts[k] if starts else 0.0))
    recording = Recording(folder, "made", tuple(views), duration=duration)
    return Rig(recording, tuple(Footage(recording, view, view.camera) for view in views))


def bright(shot: CameraFrame) -> Segmented:
    return Segmented(shot.image[:, :, 1] > 127)


def numbers(made: Rig, **more) -> list[tuple[int | None, ...]]:
    """Of the frames of every set."""
    sets = list(synchronized_frames(made, [bright] * len(made.footage), **more))
    for each in sets:
        for image, mask in zip(each.images, each.seen.masks):
            assert (image is None) == (mask is None)
            assert image is None or (mask == (image[:, :, 1] > 127)).all()
    return [tuple(None if image is None else number_of(image) for image in each.images) for each in sets]


def test_sets_have_the_images_that_fit_the_masks(tmp_path):
    made = rig(tmp_path, steady(3), steady(3))
    darker = (lambda shot: Segmented(shot.image[:, :, 1] > 127, image=shot.image // 2), bright)
    for each in synchronized_frames(made, darker):
        assert each.corrected[1] is None
        np.testing.assert_array_equal(each.corrected[0], each.images[0] // 2)


def steady(count: int, rate: float = 10.0, start: float = 0.0) -> np.ndarray:
    return start + np.arange(count) / rate


def test_frames_of_one_number_belong_together(tmp_path):
    made = rig(tmp_path, steady(7), steady(7), steady(7))
    assert numbers(made) == [(n, n, n) for n in range(7)]
    assert [each.time for each in synchronized_frames(made, [bright] * 3)] == pytest.approx(steady(7))
    assert made.rate == pytest.approx(10)


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_sets_do_not_depend_on_threads(tmp_path, threads):
    made = rig(tmp_path, steady(9), steady(5, 5.0), steady(8, 10.0))
    assert numbers(made, threads=threads) == numbers(made)


@pytest.mark.parametrize("every", [1, 2, 3, 20])
def test_only_every_nth_set_is_looked_at(tmp_path, every):
    looked = []

    def see(shot: CameraFrame) -> Segmented:
        looked.append(number_of(shot.image))
        return bright(shot)

    made = rig(tmp_path, steady(11), steady(11))
    sets = list(synchronized_frames(made, [see] * 2, every=every))
    assert [number_of(each.images[0]) for each in sets] == list(range(0, 11, every))
    assert sorted(looked) == sorted(2 * list(range(0, 11, every)))
    assert all(mask is not None for each in sets for mask in each.seen.masks)


def test_a_slower_camera_is_missing_between_its_frames(tmp_path):
    made = rig(tmp_path, steady(8), steady(4, 5.0), steady(8))
    assert numbers(made) == [(n, n // 2 if n % 2 == 0 else None, n) for n in range(8)]


def test_a_faster_camera_gives_every_other_frame(tmp_path):
    made = rig(tmp_path, steady(16, 20.0), steady(8), steady(8))
    assert numbers(made) == [(2 * n, n, n) for n in range(8)]


def test_of_two_rates_the_slower_one_counts(tmp_path):
    assert numbers(rig(tmp_path, steady(12, 20.0), steady(6))) == [(2 * n, n) for n in range(6)]


def test_films_that_began_at_other_times_are_reported_so(tmp_path):
    made = rig(tmp_path, steady(10), steady(10), starts=(0.3, 0.0))
    assert numbers(made)[:7] == [(n + 3, n) for n in range(7)]


def test_a_recording_may_end_before_its_films(tmp_path):
    made = rig(tmp_path, steady(10), steady(12), starts=(0.0, 0.2), duration=0.5)
    assert numbers(made) == [(n, n + 2) for n in range(5)]


def test_a_part_of_a_recording_keeps_its_times(tmp_path):
    """Of frames at the median rate, after [start]."""
    whole = rig(tmp_path, steady(10), steady(12), steady(24, 20.0), starts=(0.0, 0.2, 0.0), suffix=".mp4")
    part = of_recording(whole, cut(whole.recording, make_options({"start": "3f", "end": 0.7})))
    sets = list(synchronized_frames(part, [bright] * 3))
    assert [each.time for each in sets] == pytest.approx([0.3, 0.4, 0.5, 0.6])
    assert [footage.count for footage in part.footage] == [4, 4, 8]
    for one, other in zip(sets, list(synchronized_frames(whole, [bright] * 3))[3:7], strict=True):
        for image, same in zip(one.images, other.images, strict=True):
            np.testing.assert_array_equal(image, same)
    assert take_sample(part.footage[0]).times == pytest.approx([0.3, 0.4, 0.5, 0.6])
    assert take_sample(part.footage[0]).first[0].time == pytest.approx(0.3)


def test_the_empty_scene_of_a_part_is_recovered_from_the_whole_film(tmp_path):
    whole = rig(tmp_path, steady(10), suffix=".mp4")
    part = of_recording(whole, cut(whole.recording, make_options({"start": "3f", "end": 0.7})))
    assert [number_of(image) for image in spread_frames(part.footage[0])] == list(range(10))
    assert [number_of(frame.image) for frame in take_sample(part.footage[0]).frames] == [3, 4, 5, 6]


@pytest.mark.parametrize(("late", "every"), [(0.0, 1), (0.015, 3), (-0.015, 1)])
def test_the_opening_need_not_be_read_again(tmp_path, late, every):
    """What the samples keep of films in step are the frame sets that reading them gives."""
    made = rig(tmp_path, steady(40), steady(38), starts=(0.0, -late), suffix=".mp4")
    part = of_recording(made, replace(made.recording, begin=0.75))
    opening = Opening(2.0, every, 5)
    kept = kept_sets(part, [take_sample(footage, opening=opening) for footage in part.footage], opening)
    read = list(islice(synchronized_frames(part, [bright] * 2, every=every), 5))
    assert [frames[part.leaders[0]].time for frames in kept] == [each.time for each in read]
    for frames, each in zip(kept, read, strict=True):
        for frame, image in zip(frames, each.images, strict=True):
            np.testing.assert_array_equal(frame.image, image)


@pytest.mark.parametrize(("other", "late"), [(steady(20), 0.04), (steady(20, 5.0), 0.0), (steady(4), 0.0)], ids=["late", "slow", "short"])
def test_films_out_of_step_are_read_again(tmp_path, other, late):
    made, opening = rig(tmp_path, steady(20), other, starts=(0.0, -late), suffix=".mp4"), Opening(2.0, 1, 5)
    assert kept_sets(made, [take_sample(footage, opening=opening) for footage in made.footage], opening) is None


def test_a_part_outside_of_the_recording_is_refused(tmp_path):
    whole = rig(tmp_path, steady(10), duration=0.5, suffix=".mp4").recording
    assert cut(whole, make_options({})) is whole
    with pytest.warns(ShadowPuppetWarning, match=r"end: found 30s?, 30 s; the film ends at 0.5 s"):
        assert cut(whole, make_options({"start": 0.1, "end": 30})).duration == 0.5
    with pytest.raises(SettingsError, match=r"start: found 6f, 0.6 s, expected a moment before the film's end, 0.500 s"):
        cut(whole, make_options({"start": "6f"}))
    with pytest.raises(SettingsError, match=r"start: found 'soon'; expected seconds such as 3.5, or frames such as 120f"):
        make_options({"start": "soon"})


def of_recording(made: Rig, recording: Recording) -> Rig:
    return Rig(recording, tuple(Footage(recording, each.view, each.camera) for each in made.footage))


def test_how_many_sets_there_are_is_reported_where_films_tell_it(tmp_path):
    """Matroska does not."""
    made = rig(tmp_path, steady(10), steady(12), steady(20, 20.0), starts=(0.0, 0.3, 0.0), suffix=".mp4")
    assert [footage.count for footage in made.footage] == [10, 9, 20]
    assert made.count == len(numbers(made)) == 10
    assert rig(tmp_path, steady(10), steady(12), duration=0.5, suffix=".mp4").count == 5
    assert rig(tmp_path, steady(10), steady(12)).count is None


def test_films_that_may_have_lost_frames_are_those_with_fewer_than_another(tmp_path):
    made = rig(tmp_path, steady(20), steady(19), steady(18), steady(9, 5.0), steady(16, 20.0), suffix=".mp4")
    assert [footage.count for footage in made.footage] == [20, 19, 18, 9, 16]
    assert made.short == (False, False, True, False, True)
    assert rig(tmp_path, steady(20), steady(10)).short == (False, False)  # films that do not state their lengths


def test_frames_missing_in_one_film_are_none(tmp_path):
    found = numbers(rig(tmp_path, steady(12), np.delete(steady(12), [4, 5])))
    assert found == [(n, n if n < 4 else None if n < 6 else n - 2) for n in range(12)]


@given(jitter=st.integers(0, 2**32 - 1), phase=st.floats(-0.45, 0.45))
@in_tmp_path
def test_clocks_that_tremble_and_lie_half_a_frame_apart_lose_nothing(tmp_path, jitter, phase):
    rng = np.random.default_rng(jitter)
    count = 10
    wobble = steady(count) + rng.uniform(-0.004, 0.004, count)
    wobble -= wobble[0]
    made = rig(tmp_path, steady(count), wobble, starts=(max(0.0, 0.1 * phase), max(0.0, -0.1 * phase)))
    found = numbers(made)
    seen = [b for _, b in found if b is not None]
    assert seen == sorted(set(seen))  # each once, in order
    assert sum(None not in pair for pair in found) >= count - 2


def test_a_film_that_ends_is_missing_from_there_on_and_that_is_said_once(tmp_path):
    made = rig(tmp_path, steady(6), steady(20), steady(20))
    message = r"cam1\.mkv: ends at 0\.50 s; from there on the run goes on without camera 'cam1'"
    with pytest.warns(ShadowPuppetWarning, match=message) as said:
        found = numbers(made)
    assert found == [(n if n < 6 else None, n, n) for n in range(20)]
    assert len(said) == 1


def test_films_of_nearly_one_length_need_no_word(tmp_path):
    assert len(numbers(rig(tmp_path, steady(10), steady(10 + LATE - 1)))) == 10 + LATE - 1  # warnings are errors here


def test_a_film_that_is_cut_off_leaves_the_others(tmp_path):
    made = rig(tmp_path, steady(40), steady(40))
    path = tmp_path / "cam1.mkv"
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.warns(ShadowPuppetWarning) as said:
        found = numbers(made)
    lost = [a for a, _ in found].index(None)
    assert 3 < lost < 37
    assert found == [(n if n < lost else None, n) for n in range(40)]
    assert sum("goes on without camera 'cam1'" in str(each.message) for each in said) == 1


def test_a_silhouette_that_cannot_be_made_costs_that_camera_only(tmp_path):
    made = rig(tmp_path, steady(12), steady(12))

    def fails(shot: CameraFrame) -> Segmented:
        if shot.time > 0.35:
            raise SilhouetteError("masks/cam2.mkv: none left")
        return bright(shot)

    with pytest.warns(ShadowPuppetWarning, match="none left; from there on the run goes on without camera 'cam2'"):
        sets = list(synchronized_frames(made, [bright, fails]))
    assert [each.seen.masks[1] is not None for each in sets] == [n < 4 for n in range(12)]
    assert len(sets) == 12


def test_other_errors_are_not_swallowed(tmp_path):
    def broken(shot: CameraFrame) -> Segmented:
        raise RuntimeError("a bug")

    with pytest.raises(RuntimeError, match="a bug"):
        list(synchronized_frames(rig(tmp_path, steady(3), steady(3)), [bright, broken]))


def test_a_reader_who_stops_leaves_no_threads(tmp_path):
    import threading

    sets = synchronized_frames(rig(tmp_path, steady(30), steady(30)), [bright] * 2, threads=2)
    next(sets)
    assert any(thread.name.startswith("camera") for thread in threading.enumerate())
    sets.close()
    assert not any(thread.name.startswith("camera") for thread in threading.enumerate())


# Recordings


def recording(folder: Path, count: int = 3) -> Path:
    """A folder of a recording."""
    from shadowpuppet.io.calibration.calibration_files import write_calibration

    (folder / "video").mkdir(parents=True)
    cameras = [looking((2.0, k, 1.0), size=SIZE, name=f"cam{k + 1}") for k in range(count)]
    write_calibration(folder / "calibration.toml", cameras)
    for camera in cameras:
        film(folder / "video" / f"{camera.name}.mkv", steady(4))
    return folder


def test_a_recording_of_several_cameras_is_a_rig(tmp_path):
    made = open_rig(recording(tmp_path / "r"), Options())
    assert made.names == ("cam1", "cam2", "cam3")
    assert numbers(made) == [(n, n, n) for n in range(4)]


def test_some_cameras_can_be_chosen_in_the_recordings_own_order(tmp_path):
    assert open_rig(recording(tmp_path / "r"), Options(camera="cam3, cam1")).names == ("cam1", "cam3")


@pytest.mark.parametrize("names", ["cam1,cam9", "cam1,cam1", "", "cam1;cam2"])
def test_cameras_that_are_not_there_are_refused(tmp_path, names):
    made = open_rig(recording(tmp_path / "r"), Options())
    with pytest.raises(RecordingError, match="expected one of cam1, cam2, cam3; or some, each once"):
        chosen_views(made.recording, names)


def test_one_camera_is_a_rig_whose_calibration_cannot_be_checked(tmp_path):
    made = open_rig(recording(tmp_path / "r"), Options(camera="cam2"))
    assert made.names == ("cam2",)
    assert not made.is_multiview
    with pytest.raises(RecordingError, match="found one camera, expected two or more"):
        check_calibration(made, Options())


@pytest.mark.parametrize("every", [1, 3])
def test_one_cameras_frames_are_read_as_several_cameras_are(tmp_path, every):
    made = rig(tmp_path, steady(10))
    alone = list(read_frames(made, [bright], every=every))
    assert [each.time for each in alone] == [each.time for each in synchronized_frames(made, [bright], every=every)]
    assert [number_of(each.images[0]) for each in alone] == list(range(0, 10, every))


def test_one_camera_that_breaks_off_is_an_error(tmp_path):
    def fails(frame: CameraFrame) -> Segmented:
        raise SilhouetteError("none left")

    with pytest.raises(SilhouetteError, match="none left"):
        list(read_frames(rig(tmp_path, steady(3)), [fails]))


@pytest.mark.parametrize(("options", "message"), [
    ({"region": (0, 0, 8, 8)}, "region: found a region for 3 cameras"),
    ({"background": Path("x.png")}, r"background: found one for 3 cameras, expected one each, background/<camera>"),
])
def test_what_serves_one_camera_is_refused_for_several(tmp_path, options, message):
    with pytest.raises(SettingsError, match=message):
        open_rig(recording(tmp_path / "r"), Options(**options))


def test_masks_are_needed_of_every_camera(tmp_path):
    with pytest.raises(RecordingError, match=r"masks/cam1\.mkv"):
        open_rig(recording(tmp_path / "r"), Options(masks=True))


def test_keypoints_that_are_asked_for_must_be_there(tmp_path):
    made = rig(tmp_path, steady(3))
    with pytest.raises(RecordingError, match=r"no keypoints of camera 'cam1' in it, expected keypoints/cam1.npz .* leave --evidence out"):
        camera_footage(made.recording, made.recording.views[0], make_options({"evidence": "silhouettes,keypoints"}))
    given = replace(made.recording.views[0], keypoints=KeypointSource(tmp_path / "keypoints.npz"))
    left = [camera_footage(made.recording, given, make_options(values)).view.keypoints for values in ({}, {"evidence": "silhouettes"})]
    assert left == [given.keypoints, None]


def test_keypoints_are_those_of_the_films_own_frames(tmp_path):
    """Of a film that begins later on its clock, and scaled as its pictures are; of a camera without a frame, and without any, none."""
    made = rig(tmp_path, steady(6), steady(6), starts=(0.2, 0.0))
    places = np.arange(6.0).repeat(2).reshape(6, 1, 2) + 10
    numbered_by_frame = film_keypoints(["nose"], np.arange(6), np.full(6, -1), places, np.ones((6, 1)), "made", SIZE)
    half = replace(made.footage[0], camera=made.footage[0].view.camera.resized((SIZE[0] // 2, SIZE[1] // 2)))
    half.__dict__["keypoints"] = numbered_by_frame
    made = replace(made, footage=(half, made.footage[1]))
    for n, each in enumerate(synchronized_frames(made, [bright] * 2)):
        found, other = each.seen.keypoints if n < 4 else ((), None)
        assert other is None
        assert n >= 4 or (found.xy[0, 0] == (10 + n + 2 + 0.5) / 2 - 0.5).all()
    assert each.seen.keypoints == ()
