"""Nested values come back with the same types, bits and order in memory; what is damaged is said."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from shadowpuppet.errors import FormatError
from shadowpuppet.io.files.nested import read_nested, write_nested


class Pair(NamedTuple):
    """Two values."""

    one: object
    other: object


LEAVES = st.none() | st.booleans() | st.integers() | st.floats() | st.text() | arrays.arrays(
    st.sampled_from([np.float64, np.uint8, np.bool_, np.int64]), arrays.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=3))
VALUES = st.recursive(LEAVES, lambda inner: st.tuples(inner, inner) | st.builds(Pair, inner, inner) | st.just(())
                      | st.dictionaries(st.text(max_size=3), inner, max_size=3), max_leaves=6)  # fmt: skip


def assert_same(one, other) -> None:
    assert type(one) is type(other)
    if isinstance(one, tuple):
        assert len(one) == len(other)
        for left, right in zip(one, other):
            assert_same(left, right)
    elif isinstance(one, dict):
        assert one.keys() == other.keys()
        for key, value in one.items():
            assert_same(value, other[key])
    elif isinstance(one, (np.ndarray, np.generic)):
        assert (one.dtype, one.shape) == (other.dtype, other.shape)
        assert one.tobytes() == other.tobytes()
    else:
        assert repr(one) == repr(other)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(VALUES)
def test_what_is_written_is_read_exactly(tmp_path, value):
    write_nested(tmp_path / "a.npz", value)
    assert_same(read_nested(tmp_path / "a.npz", [Pair]), value)


def test_arrays_lie_in_memory_as_they_did_and_can_be_changed(tmp_path, rng):
    values = rng.random((3, 4, 5)).transpose(1, 2, 0)
    write_nested(tmp_path / "a.npz", (values, np.float32(2), rng.bit_generator.state))
    found, number, state = read_nested(tmp_path / "a.npz", [])
    assert found.strides == values.strides
    found[0] = 1
    assert type(number) is np.float32
    assert state == rng.bit_generator.state


@pytest.mark.parametrize("value", [{1, 2}, object(), b"bytes"])
def test_what_cannot_be_written_exactly_is_refused(tmp_path, value):
    with pytest.raises(TypeError, match="expected arrays, numbers"):
        write_nested(tmp_path / "a.npz", (value,))


def test_what_is_damaged_or_of_an_unknown_kind_is_said(tmp_path):
    write_nested(tmp_path / "a.npz", Pair(1, np.zeros(100)))
    with pytest.raises(FormatError, match=r"a\.npz: not a whole state of a run \('Pair'\)"):
        read_nested(tmp_path / "a.npz", [])
    (tmp_path / "a.npz").write_bytes((tmp_path / "a.npz").read_bytes()[:300])
    with pytest.raises(FormatError, match=r"a\.npz: "):
        read_nested(tmp_path / "a.npz", [Pair])
    np.savez(tmp_path / "b.npz", tree=np.frombuffer(b'["array", 7, []]', np.uint8))
    with pytest.raises(FormatError, match="not a whole state of a run"):
        read_nested(tmp_path / "b.npz", [Pair])
