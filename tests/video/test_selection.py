"""Frames chosen of a film are those that decoding it from the start gives, and few others are decoded."""

from __future__ import annotations

import av
import numpy as np
import pytest
from films import encoded, packets, pictures
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from shadowpuppet.errors import ShadowPuppetWarning
from shadowpuppet.video import film, open_frames, selection

FRAMES = 90
UNEVEN = np.cumsum([0, *np.random.default_rng(4).integers(8, 80, FRAMES - 1)]).tolist()
FILMS = {
    "default.mp4": {},
    "b_frames.mp4": {"b_strategy": "0", "bf": "3", "g": "30"},
    "one_key_frame.mp4": {"b_strategy": "0", "bf": "3", "g": "250", "sc_threshold": "0"},
    "open_groups.mp4": {"b_strategy": "0", "bf": "3", "g": "12", "x264-params": "open-gop=1"},
    "later.mp4": {"b_strategy": "0", "bf": "2", "g": "25", "stamps": [5000 + 100 * n for n in range(FRAMES)]},
    "uneven.mkv": {"b_strategy": "0", "bf": "3", "g": "20", "stamps": UNEVEN},
    "refresh.mkv": {"g": "20", "intra-refresh": "1"},
    "stream.ts": {"b_strategy": "0", "bf": "3", "g": "15"},
    "hevc.mov": {"codec": "libx265", "x265-params": "bframes=3:b-adapt=0:keyint=20:log-level=none:pools=1"},
    "lossless.mkv": {"codec": "ffv1", "pixels": "bgr0"},
    "other_codec.avi": {"codec": "mpeg4", "g": "12"},
}
IN_TURN = ("refresh.mkv", "stream.ts", "other_codec.avi")
"""Films that are decoded from the start whatever is chosen."""


@pytest.fixture(scope="module", params=FILMS)
def path(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("film") / request.param
    return encoded(path, pictures(FRAMES, (64, 48)), **FILMS[request.param])


def chosen(path, numbers, at_once=False):
    """The frames of those numbers, and the times that were asked for. `at_once`: without decoding the film from its start."""
    asked, source = list[float](), open_frames(path)

    def wanted(time):
        asked.append(time)
        return len(asked) - 1 in numbers

    with pytest.MonkeyPatch.context() as patch:
        if at_once:
            patch.setattr(film, "decoded", None)
        return list(source.read(wanted)), asked


@pytest.mark.filterwarnings("ignore::shadowpuppet.errors.ShadowPuppetWarning")  # uneven times
def test_chosen_frames_are_those_of_the_whole_film(path):
    whole = list(open_frames(path))
    assert len(whole) == FRAMES
    for numbers in ({0}, {FRAMES - 1}, {7, 8, 9, 47, 48, 80}, set(range(1, FRAMES, 13)), set(range(40, FRAMES)), set(range(FRAMES)), set()):
        found, asked = chosen(path, numbers, at_once=path.name not in IN_TURN)
        assert asked == [frame.time for frame in whole]
        assert [frame.time for frame in found] == [whole[n].time for n in sorted(numbers)]
        for frame, n in zip(found, sorted(numbers), strict=True):
            np.testing.assert_array_equal(frame.image, whole[n].image)


@given(numbers=st.sets(st.integers(0, FRAMES - 1)), held=st.sampled_from([1, 10, 600]))
@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_choice_of_a_film_with_b_frames(tmp_path_factory, numbers, held):
    path = tmp_path_factory.getbasetemp() / "any.mp4"
    if not path.exists():
        encoded(path, pictures(FRAMES, (32, 24)), b_strategy="0", bf="3", g="25")
    whole = list(open_frames(path))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(selection, "HELD", held)
        found, _ = chosen(path, numbers, at_once=True)
    np.testing.assert_array_equal([frame.image for frame in found], [whole[n].image for n in sorted(numbers)])


def test_few_other_frames_are_decoded(tmp_path, monkeypatch):
    path = encoded(tmp_path / "a.mp4", pictures(300, (32, 24)), g="10", b_strategy="0", bf="2")
    read, codec = list[int](), selection._Reader._decode
    monkeypatch.setattr(selection._Reader, "_decode", lambda self, pts: (read.append(pts), codec(self, pts))[1])
    monkeypatch.setenv("SHADOWPUPPET_THREADS", "1")
    found, _ = chosen(path, {0, 100, 200})
    assert len(found) == 3
    assert len(read) < 30


@pytest.mark.parametrize("n", [17, 39])
def test_damage_before_a_chosen_frame_ends_the_film(tmp_path, n):
    path = encoded(tmp_path / "a.mp4", pictures(60), g="20", bf="0")
    data = bytearray(path.read_bytes())
    start, end = packets(path)[n]
    data[start:end] = bytes(end - start)
    path.write_bytes(data)
    with pytest.warns(ShadowPuppetWarning, match="broken off at frame") as said:
        whole = list(open_frames(path))
    assert n <= len(whole) < 58
    with pytest.warns(ShadowPuppetWarning) as said_again:
        found, _ = chosen(path, set(range(2, 60, 3)))
    assert [str(each.message) for each in said_again] == [str(each.message) for each in said]
    np.testing.assert_array_equal([frame.image for frame in found], [frame.image for frame in whole[2::3]])


@pytest.mark.filterwarnings("ignore::shadowpuppet.errors.ShadowPuppetWarning")  # shorter than announced
def test_a_film_cut_out_of_a_longer_one_begins_where_its_decoding_does(tmp_path):
    """Its first packets are of frames before the cut, which cannot be decoded."""
    long, path = encoded(tmp_path / "long.mkv", pictures(60, (64, 48)), b_strategy="0", bf="3",
                         **{"x264-params": "open-gop=1:keyint=12"}), tmp_path / "cut.mkv"
    with av.open(str(long)) as source, av.open(str(path), "w") as target:
        stream = target.add_stream_from_template(source.streams.video[0])
        for packet in list(source.demux(video=0))[12:-1]:
            packet.stream = stream
            target.mux(packet)
    whole = list(open_frames(path))
    found, asked = chosen(path, {0, 5, 20})
    assert asked == [frame.time for frame in whole]
    np.testing.assert_array_equal([frame.image for frame in found], [whole[n].image for n in (0, 5, 20)])
