"""Films, pictures and cameras: what is written is read, times are the container's, damage and nonsense are said."""

from __future__ import annotations

import tracemalloc
from fractions import Fraction

import numpy as np
import pytest
from films import RATE, encoded, packets, pictures
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from shadowpuppet.errors import ShadowPuppetWarning, VideoError
from shadowpuppet.video import open_frames, write_frames, write_image

in_tmp_path = settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def smooth(n=12, size=(32, 24)):
    """Soft colours that survive compression."""
    y, x = np.mgrid[: size[1], : size[0]]
    return [np.stack([80 + 2 * x + i, 200 - 3 * y, 60 + x + y], -1).clip(0, 255).astype(np.uint8) for i in range(n)]


def film(path, images, rate=RATE, **options):
    with write_frames(path, rate, **options) as writer:
        for image in images:
            writer.write(image)
    return path


def images_of(source):
    return [frame.image for frame in source]


def far_apart(a, b) -> float:
    return float(np.abs(np.asarray(a, float) - np.asarray(b, float)).mean())


# Films


@in_tmp_path
@given(st.integers(2, 40), st.integers(2, 40), st.booleans(), st.integers(1, 5))
def test_lossless_films_of_any_size_come_back_bit_by_bit(tmp_path, width, height, grey, n):
    images = pictures(n, (width, height), grey)
    source = open_frames(film(tmp_path / "a.mkv", images, lossless=True), grey=grey)
    assert source.size == (width, height)
    np.testing.assert_array_equal(images_of(source), images)


@pytest.mark.parametrize("size", [(32, 24), (31, 23), (50, 17)])
def test_mp4_films_come_back_nearly_and_even(tmp_path, size):
    images = smooth(size=size)
    source = open_frames(film(tmp_path / "a.mp4", images))
    assert source.size == (size[0] + size[0] % 2, size[1] + size[1] % 2)
    assert (source.rate, source.count, source.duration) == (RATE, 12, 1.2)
    for frame, image in zip(source, images, strict=True):
        assert frame.image.dtype == np.uint8
        assert far_apart(frame.image[: size[1], : size[0]], image) < 4


@pytest.mark.parametrize(("settings", "pixel", "interlaced"), [
    ({}, 1, False), ({"pixel": Fraction(4, 3)}, 4 / 3, False), ({"pixel": Fraction(8, 9), "x264-params": "interlaced=1"}, 8 / 9, True),
])
@pytest.mark.parametrize("name", ["a.mp4", "a.mkv", "a.ts"])
def test_a_film_says_the_shape_of_its_pixels_and_whether_it_is_interlaced(tmp_path, name, settings, pixel, interlaced):
    source = open_frames(encoded(tmp_path / name, pictures(size=(64, 32)), **settings), size=(32, 16))
    assert source.pixel == pytest.approx(pixel)
    assert source.interlaced == interlaced


def test_a_film_is_read_again_from_the_start_and_by_two_readers(tmp_path):
    source = open_frames(film(tmp_path / "a.mkv", pictures(), lossless=True))
    one, other = iter(source), iter(source)
    next(one)
    np.testing.assert_array_equal(next(other).image, pictures()[0])
    np.testing.assert_array_equal(next(one).image, pictures()[1])
    assert len(list(source)) == 12


@in_tmp_path
@given(st.lists(st.integers(1, 500), min_size=2, max_size=12))
def test_variable_frame_rates_keep_their_exact_times(tmp_path, steps):
    stamps = [0, *np.cumsum(steps).tolist()]
    path = encoded(tmp_path / "a.mkv", pictures(len(stamps), (16, 16)), stamps=stamps)
    source = open_frames(path)
    assert [frame.time for frame in source] == [stamp / 1000 for stamp in stamps]


def test_times_start_at_the_first_frame_and_follow_the_display(tmp_path):
    path = encoded(tmp_path / "a.mp4", pictures(), stamps=[1000 + 100 * i for i in range(12)], bf="3")
    assert [frame.time for frame in open_frames(path)] == [i / 10 for i in range(12)]


def test_a_given_rate_replaces_a_film_s_times(tmp_path):
    source = open_frames(film(tmp_path / "a.mp4", pictures()), rate=240)
    assert source.rate == 240
    assert [frame.time for frame in source] == [i / 240 for i in range(12)]


def test_missing_frames_are_said_once_and_keep_the_others_times(tmp_path):
    stamps = [100 * i for i in range(40) if i not in (20, 21, 30)]
    source = open_frames(encoded(tmp_path / "a.mkv", pictures(37), stamps=stamps))
    with pytest.warns(ShadowPuppetWarning, match=r"between 1.900 and 2.200 s frames are missing") as caught:
        assert [frame.time for frame in source] == [stamp / 1000 for stamp in stamps]
    assert len(caught) == 1


def test_missing_times_are_filled_in_with_a_warning(tmp_path):
    path = encoded(tmp_path / "a.h264", pictures(), base=Fraction(1, 10))
    with pytest.warns(ShadowPuppetWarning, match="has no time; times are filled in at 10 frames/s"):
        times = [frame.time for frame in open_frames(path)]
    np.testing.assert_allclose(times, np.arange(12) / 10, atol=1e-12)
    assert [frame.time for frame in open_frames(path, rate=5)] == [i / 5 for i in range(12)]


def test_memory_does_not_grow_with_the_film(tmp_path):
    source = open_frames(film(tmp_path / "a.mkv", pictures(100, (64, 48)), lossless=True))

    def peak(n):
        tracemalloc.start()
        for i, _ in enumerate(source):
            if i == n:
                break
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return peak

    assert peak(99) < peak(10) + 5 * 64 * 48 * 3


# Colours and shapes


@pytest.mark.parametrize(("name", "codec", "pixels", "settings"), [
    ("a.mp4", "libx264", "yuv420p", {"crf": "10"}),
    ("a.mp4", "libx264", "yuv444p", {"crf": "10"}),
    ("a.mp4", "libx264", "yuv420p10le", {"crf": "10"}),
    ("a.mp4", "libx264", "nv12", {"crf": "10"}),
    ("a.mp4", "libx264", "gray", {"crf": "10"}),
    ("a.avi", "mjpeg", "yuvj420p", {}),
    ("a.mkv", "ffv1", "bgr0", {}),
    ("a.mkv", "ffv1", "gray", {}),
    ("a.mkv", "ffv1", "yuv422p", {}),
])
@pytest.mark.parametrize("size", [(64, 48), (50, 38)])
def test_grey_is_the_grey_of_the_colours(tmp_path, name, codec, pixels, settings, size):
    import cv2

    path = encoded(tmp_path / name, smooth(3, size), codec=codec, pixels=pixels, base=Fraction(1, 10), **settings)
    for grey, colour in zip(open_frames(path, grey=True), open_frames(path), strict=True):
        assert grey.image.shape == (size[1], size[0])
        difference = grey.image.astype(int) - cv2.cvtColor(colour.image, cv2.COLOR_BGR2GRAY)
        assert abs(difference.mean()) < 2.5  # FFmpeg's quick colour conversion loses a level or two
        assert np.abs(difference).max() <= 8
        assert grey.image.flags.c_contiguous


@pytest.mark.parametrize("pixels", ["yuv420p", "yuv422p10le", "gray", "gray16le", "bgr0"])
def test_grey_reaches_black_and_white(tmp_path, pixels):
    ramp = np.tile(np.arange(256, dtype=np.uint8), (16, 1))
    path = encoded(tmp_path / "a.mkv", [ramp], codec="ffv1", pixels=pixels)
    found, = images_of(open_frames(path, grey=True))
    assert np.abs(found.astype(int) - ramp).max() <= 2
    assert found.min() == 0
    assert found.max() >= 254


def turned_film(path, image, a, b, c, d):
    """Patch an .mp4's display matrix, as a phone does that was held turned; (a, b) and (c, d) are where x and y go."""
    data = bytearray(film(path, [image] * 3).read_bytes())
    start = data.rindex(b"tkhd") + 44
    height, width = image.shape[:2]
    numbers = [a, b, 0, c, d, 0, width * (a < 0) + height * (c < 0), width * (b < 0) + height * (d < 0)]
    data[start : start + 32] = b"".join((number << 16).to_bytes(4, "big", signed=True) for number in numbers)
    path.write_bytes(data)
    return path


@pytest.mark.parametrize("grey", [False, True])
@pytest.mark.parametrize(("matrix", "quarters_clockwise"), [
    ((1, 0, 0, 1), 0), ((0, 1, -1, 0), 1), ((-1, 0, 0, -1), 2), ((0, -1, 1, 0), 3),
])
def test_films_are_shown_upright(tmp_path, matrix, quarters_clockwise, grey):
    image = np.zeros((24, 32, 3), np.uint8)
    image[:8, :12] = 250
    source = open_frames(turned_film(tmp_path / "a.mp4", image, *matrix), grey=grey)
    upright = np.rot90(image[..., 0] if grey else image, -quarters_clockwise)
    assert source.size == upright.shape[1::-1]
    assert far_apart(images_of(source)[1], upright) < 8


@pytest.mark.parametrize("grey", [False, True])
def test_frames_are_scaled_by_areas(tmp_path, grey):
    checks = np.kron(np.indices((12, 16)).sum(0) % 2 * 200, np.ones((2, 2))).astype(np.uint8)
    checks = checks if grey else np.stack([checks] * 3, -1)
    path = film(tmp_path / "a.mkv", [checks], lossless=True)
    source = open_frames(path, grey=grey, size=(8, 6))
    assert source.size == (8, 6)
    assert (images_of(source)[0] == 100).all()
    assert images_of(open_frames(path, grey=grey, size=(64, 48)))[0].shape[:2] == (48, 64)


@pytest.mark.parametrize("grey", [False, True])
def test_frames_are_cut_or_filled_up_with_their_edge_before_they_are_scaled(tmp_path, grey):
    image = np.random.default_rng(5).integers(0, 256, (20, 30, 3), np.uint8)
    write_image(tmp_path / "scene.png", image)
    (plain,), (larger,), (smaller,) = (list(open_frames(tmp_path / "scene.png", grey=grey, whole=whole))
                                       for whole in (None, (32, 24), (16, 20)))
    np.testing.assert_array_equal(larger.image[:20, :30], plain.image)
    np.testing.assert_array_equal(larger.image[20:, :30], np.broadcast_to(plain.image[-1:], larger.image[20:, :30].shape))
    np.testing.assert_array_equal(larger.image[:20, 30:], np.broadcast_to(plain.image[:, -1:], larger.image[:20, 30:].shape))
    np.testing.assert_array_equal(smaller.image, plain.image[:, :16])
    half = open_frames(tmp_path / "scene.png", grey=grey, whole=(16, 20), size=(8, 10))
    assert half.size == (8, 10)
    (small,) = half
    np.testing.assert_allclose(small.image, smaller.image.reshape(10, 2, 8, 2, -1).mean((1, 3)).reshape(small.image.shape), atol=1)


def test_a_change_of_size_is_said(tmp_path):
    path = tmp_path / "a.mjpeg"
    with open(path, "wb") as out:
        for image in [*smooth(3), *smooth(2, (64, 48))]:
            write_image(tmp_path / "a.jpg", image)
            out.write((tmp_path / "a.jpg").read_bytes())
    with pytest.raises(VideoError, match=r"a.mjpeg: frame 3 \(0.300 s\) is 64 x 48 pixels, those before it 32 x 24"):
        list(open_frames(path, rate=10))


# Damage


@in_tmp_path
@given(st.floats(0.3, 0.97))
def test_a_cut_film_gives_every_whole_frame_then_a_warning(tmp_path, share):
    images = pictures(30)
    whole = film(tmp_path / "a.mkv", images, lossless=True).read_bytes()
    (tmp_path / "cut.mkv").write_bytes(whole[: int(len(whole) * share)])
    with pytest.warns(ShadowPuppetWarning, match=r"cut.mkv: broken off at frame \d+ \(\d.\d00 s\)") as caught:
        found = images_of(open_frames(tmp_path / "cut.mkv"))
    assert f"the {len(found)} frames before it are given" in str(caught[0].message)
    assert 30 * share - 3 <= len(found) < 30
    np.testing.assert_array_equal(found, images[: len(found)])


@pytest.mark.parametrize(("name", "codec", "pixels"), [
    ("a.mp4", "libx264", "yuv420p"),
    ("b.avi", "libx264", "yuv420p"),
    ("c.avi", "mjpeg", "yuvj420p"),
    ("d.avi", "mpeg4", "yuv420p"),
])
@pytest.mark.parametrize("share", [0.4, 0.6, 0.8])
def test_cut_films_of_other_kinds_give_every_whole_frame_then_a_warning(tmp_path, name, codec, pixels, share):
    container = {"movflags": "faststart"} if name == "a.mp4" else {}
    path = encoded(tmp_path / name, pictures(40), codec=codec, pixels=pixels, base=Fraction(1, 10), container=container, g="1")
    whole, length = images_of(open_frames(path)), int(path.stat().st_size * share)
    n = sum(end <= length for _, end in packets(path))
    path.write_bytes(path.read_bytes()[:length])
    with pytest.warns(ShadowPuppetWarning, match=f"broken off at frame {n} of 40"):
        found = images_of(open_frames(path))
    np.testing.assert_array_equal(found, whole[:n])


@pytest.mark.parametrize("n", [1, 2, 17, 39])
def test_a_damaged_film_gives_all_that_comes_before(tmp_path, n):
    path = encoded(tmp_path / "a.mp4", pictures(40), g="1")
    whole, data = images_of(open_frames(path)), bytearray(path.read_bytes())
    start, end = packets(path)[n]
    data[start:end] = bytes(end - start)
    path.write_bytes(data)
    with pytest.warns(ShadowPuppetWarning, match=rf"broken off at frame {n} of 40 \({n / 10:.3f} s\)"):
        found = images_of(open_frames(path))
    np.testing.assert_array_equal(found, whole[:n])


def test_an_avi_cut_between_two_pictures_is_broken_off_too(tmp_path):
    path = encoded(tmp_path / "a.avi", pictures(40), codec="mjpeg", pixels="yuvj420p", base=Fraction(1, 10))
    path.write_bytes(path.read_bytes()[: packets(path)[20][0]])
    with pytest.warns(ShadowPuppetWarning, match="broken off at frame 20 of 40"):
        assert len(images_of(open_frames(path))) == 20
    with pytest.warns(ShadowPuppetWarning, match="broken off at frame 20 of 40"):
        assert len(images_of(open_frames(path, rate=100))) == 20


@pytest.mark.parametrize(("name", "content", "said"), [
    ("nowhere.mp4", None, "no such film"),
    ("empty.mp4", b"", "no film that can be read"),
    ("text.mp4", b"not a film\n" * 100, "no film that can be read"),
    ("text.txt", b"not a film\n" * 100, "no film that can be read (none of .264, "),
    ("list.m3u8", b"#EXTM3U\n#EXTINF:1,\nhttp://127.0.0.1:9/a.ts\n#EXT-X-ENDLIST\n", "found a play list (HLS), expected a film"),
    ("picture.png", b"\x89PNG\r\n\x1a\n", "not a picture that can be read"),
    ("picture.jpg", b"", "not a picture that can be read"),
])
def test_what_is_no_film_is_said(tmp_path, name, content, said):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(VideoError) as error:
        open_frames(tmp_path / name)
    assert f"{name}: {said}" in str(error.value)
    assert "\n" not in str(error.value)


def test_sound_alone_is_no_film(tmp_path):
    import av

    with av.open(str(tmp_path / "a.mkv"), "w") as output:
        stream = output.add_stream("pcm_s16le", rate=8000)
        sound = av.AudioFrame.from_ndarray(np.zeros((1, 800), np.int16), layout="mono")
        sound.sample_rate, sound.pts = 8000, 0
        output.mux(stream.encode(sound))
    with pytest.raises(VideoError, match=r"a.mkv: no video stream in it"):
        open_frames(tmp_path / "a.mkv")


@pytest.mark.parametrize("options", [{"rate": 0}, {"rate": float("nan")}, {"size": (0, 4)}])
def test_impossible_options_are_said(tmp_path, options):
    with pytest.raises(VideoError, match="expected"):
        open_frames(film(tmp_path / "a.mp4", pictures()), **options)


@pytest.mark.shared
@pytest.mark.parametrize(("name", "size", "rate", "count"), [
    ("recordings/upper_body/video/cam.mp4", (320, 240), 15, 361),
    ("recordings/walking/background/cam3.mp4", (640, 480), 60, 40),
    ("recordings/reaching/masks/cam.mkv", (320, 240), 15, 301),
    ("real/dancer/video/cam.mp4", (518, 496), 25, 560),
    ("real/balancing/video/cam02.mp4", (1080, 1920), 60, 100),
])
def test_shared_films_are_read_whole(shared, name, size, rate, count):
    import cv2

    source, colour = open_frames(shared / name, grey=True), iter(open_frames(shared / name))
    assert (source.size, source.rate, source.count or count) == (size, rate, count)
    times, first, other = [], None, next(colour).image
    for frame in source:
        first = frame.image if first is None else first
        times.append(frame.time)
    np.testing.assert_allclose(times, np.arange(count) / rate, atol=5e-4)  # .mkv rounds to milliseconds
    difference = first.astype(int) - cv2.cvtColor(other, cv2.COLOR_BGR2GRAY)
    assert abs(difference.mean()) < 2.5
    assert np.percentile(np.abs(difference), 99) <= 5
