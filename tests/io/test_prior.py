"""A prior's file: what is written is read to the last bit, and what is none is said."""

from __future__ import annotations

import contextlib
import io
import pickle
import zipfile

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from motions import gait, prior

from shadowpuppet.errors import FormatError, ShadowPuppetError
from shadowpuppet.io.motion.npz import read_npz
from shadowpuppet.io.prior import read_prior, write_prior
from shadowpuppet.motion.prior.settings import PriorSettings
from shadowpuppet.motion.prior.vqpca import fit_prior


def fields(of) -> list[np.ndarray]:
    inner = of.subspaces
    return [of.transitions, of.initial, inner.centres, inner.bases, inner.variances, inner.noise]


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(seed=st.integers(0, 2**32 - 1), regions=st.integers(1, 6), width=st.integers(1, 6), dimensions=st.integers(1, 6),
       named=st.booleans(), rate=st.none() | st.floats(1, 1000))
def test_what_is_written_is_read(tmp_path, seed, regions, width, dimensions, named, rate):
    names = tuple(f"left_knee_{i}_ä" for i in range(width)) if named else ()
    written = prior(np.random.default_rng(seed), regions, width, min(dimensions, width), names=names, rate=rate)
    write_prior(tmp_path / "prior.npz", written)
    read = read_prior(tmp_path / "prior.npz")
    assert all(np.array_equal(a, b) for a, b in zip(fields(read), fields(written), strict=True))
    assert (read.names, read.rate) == (names, rate)


def test_a_learnt_prior_proposes_the_same_after_it_was_kept(tmp_path):
    made = fit_prior(np.random.default_rng(0), [gait(60)], PriorSettings(regions=6), rate=60.0).prior
    write_prior(tmp_path / "walk.npz", made)
    read = read_prior(str(tmp_path / "walk.npz"))
    proposed = [each.propose(np.random.default_rng(1), gait(60)).poses for each in (made, read)]
    np.testing.assert_array_equal(*proposed)
    first = (tmp_path / "walk.npz").read_bytes()
    write_prior(tmp_path / "walk.npz", read)
    assert (tmp_path / "walk.npz").read_bytes() == first


def arrays(**changes) -> dict:
    made = prior(np.random.default_rng(0), 3, 4, 2)
    inner = made.subspaces
    good = {"format": "shadowpuppet motion prior", "version": 1, "names": np.array([], str), "centres": inner.centres, "bases": inner.bases,
            "variances": inner.variances, "noise": inner.noise, "transitions": made.transitions, "initial": made.initial, "rate": 60.0}
    return {name: value for name, value in (good | changes).items() if value is not None}


def test_the_file_can_be_made_by_others(tmp_path):
    np.savez(tmp_path / "prior.npz", **arrays(centres=np.zeros((3, 4), np.int32), notes="more is passed over"))
    assert read_prior(tmp_path / "prior.npz").rate == 60.0


@pytest.mark.parametrize(("changes", "said"), [
    ({"format": "something else"}, "format: found 'something else', expected 'shadowpuppet motion prior'"),
    ({"format": None}, "format: found 'None'"),
    ({"version": 2}, "version: found 2, expected 1"),
    ({"centres": None}, "centres: found no such array, expected one of numbers"),
    ({"centres": np.zeros((3, 4), complex)}, "centres: found an array of complex128"),
    ({"noise": np.array(["a", "b", "c"])}, "noise: found an array of <U1, expected one of numbers"),
    ({"names": np.zeros(4)}, "names: found an array of float64, expected one of text"),
    ({"names": np.array([["a", "b"], ["c", "d"]])}, r"names: found shape \(2, 2\), expected 1 dimensions"),
    ({"names": np.array(["a", "b"])}, "names: found 2 different ones, expected 4"),
    ({"rate": np.array([60.0])}, r"rate: found shape \(1,\), expected 0 dimensions"),
    ({"rate": -1.0}, "rate: found -1.0"),
    ({"bases": np.zeros((3, 4, 2))}, "bases: found vectors that are not orthonormal"),
    ({"noise": np.zeros(3)}, "noise: found 0.0, expected variances"),
    ({"transitions": np.ones((3, 3))}, "transitions: found numbers that are no probabilities"),
    ({"initial": np.full(2, 0.5)}, r"initial: found shape \(2,\), expected \(3,\)"),
    ({"variances": np.full((3, 2), np.nan)}, "variances: found a number that is not finite"),
])
def test_what_is_no_prior_is_said(tmp_path, changes, said):
    np.savez(tmp_path / "prior.npz", **arrays(**changes))
    with pytest.raises(FormatError, match=rf"prior\.npz: cannot be read as a motion prior \({said}"):
        read_prior(tmp_path / "prior.npz")


class Executed:
    """Raises where it is read by pickle."""

    def __reduce__(self):
        return (pytest.fail, ("a file was executed",))


def test_nothing_in_a_file_is_executed(tmp_path):
    np.savez(tmp_path / "prior.npz", **arrays(centres=np.array([Executed()], object)))
    with pytest.raises(FormatError, match="not a whole archive of arrays"):
        read_prior(tmp_path / "prior.npz")
    (tmp_path / "prior.npz").write_bytes(pickle.dumps(Executed()))
    with pytest.raises(FormatError, match="not a whole archive of arrays"):
        read_prior(tmp_path / "prior.npz")


def test_broken_files_are_said(tmp_path):
    path = tmp_path / "prior.npz"
    with pytest.raises(FormatError, match=r"prior.npz: cannot be read as a motion prior \(no such file"):
        read_prior(path)
    whole = io.BytesIO()
    np.savez_compressed(whole, **arrays())
    content = whole.getvalue()
    rng = np.random.default_rng(0)
    broken = [b"", b"PK", b"time,pelvis_x\n0,1\n", content[:-30], content[: len(content) // 2]]
    flags = content.index(b"PK\x01\x02") + 8
    broken.append(content[:flags] + b"\x01" + content[flags + 1 :])  # as if it were encrypted
    for each in broken:
        path.write_bytes(each)
        with pytest.raises(FormatError, match="cannot be read as a motion prior"):
            read_prior(path)
    for place in rng.integers(len(content) - 4, size=200):  # numbers that nobody reads may be others; nothing else may happen
        path.write_bytes(content[:place] + rng.bytes(4) + content[place + 4 :])
        with contextlib.suppress(FormatError):
            assert all(np.array_equal(a, b) for a, b in zip(fields(read_prior(path)), fields(prior(np.random.default_rng(0), 3, 4, 2))))
    alone = io.BytesIO()
    np.save(alone, np.zeros(3))
    path.write_bytes(alone.getvalue())
    with pytest.raises(FormatError, match="not a whole archive of arrays"):
        read_prior(path)


def test_an_array_that_claims_to_be_larger_than_memory_is_said(tmp_path):
    np.savez(tmp_path / "prior.npz", **arrays(centres=None))
    with zipfile.ZipFile(tmp_path / "prior.npz", "a") as file:
        head = b"{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000, 1000000), }"
        file.writestr("centres.npy", b"\x93NUMPY\x01\x00" + len(head + b"\n").to_bytes(2, "little") + head + b"\n")
    with pytest.raises(FormatError, match="not a whole archive of arrays"):
        read_prior(tmp_path / "prior.npz")


def test_a_folder_that_is_missing_is_said(tmp_path):
    with pytest.raises(ShadowPuppetError, match=r"prior.npz: cannot be written \(no such file"):
        write_prior(tmp_path / "no" / "prior.npz", prior(np.random.default_rng(0)))


@pytest.mark.parametrize(("name", "content"), [("format.npy", b"\x93NUMPY\x01\x00\x0a\x00{'descr':(\n"), ("format", b"no array")])
def test_members_that_are_no_arrays_are_said(tmp_path, name, content):
    with zipfile.ZipFile(tmp_path / "prior.npz", "w") as archive:
        archive.writestr(name, content)
    with pytest.raises(FormatError, match=r"prior\.npz: cannot be read as a motion prior"):
        read_prior(tmp_path / "prior.npz")
    with pytest.raises(FormatError, match=r"prior\.npz: no joints"):
        read_npz(tmp_path / "prior.npz")
