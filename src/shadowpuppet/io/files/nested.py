"""Nested values of named tuples, tuples, dictionaries, arrays and numbers as an archive of arrays beside a text of JSON: exact, and nothing
in it is executed."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.errors import FormatError, ShadowPuppetError
from shadowpuppet.io.files.npz import read_arrays
from shadowpuppet.io.files.text import write_whole

TREE = "tree"
"""Name of the archive's member with the JSON text, as bytes; the arrays are `0`, `1`, ..."""


def write_nested(path: Path, value: Any) -> None:
    """Write a value that `read_nested` gives back with the same types, bits and order in memory; dictionaries have texts as keys. Raises
    `ShadowPuppetError` if it cannot be written, `TypeError` for a value of another type."""
    import io

    arrays: list[NDArray[Any]] = []
    text = json.dumps(_encoded(value, arrays))
    out = io.BytesIO()
    np.savez(out, allow_pickle=False, **{TREE: np.frombuffer(text.encode(), np.uint8)}, **{str(n): each for n, each in enumerate(arrays)})
    write_whole(path, out.getvalue())


def read_nested(path: Path, types: Iterable[type]) -> Any:
    """The value in a file that `write_nested` wrote. `types`: the named tuples that may be in it. Raises `FormatError`."""
    try:
        arrays = read_arrays(path)
        return _decoded(json.loads(arrays[TREE].tobytes()), arrays, {kind.__name__: kind for kind in types})
    except ShadowPuppetError as error:
        raise FormatError(f"{path}: {error}") from None
    except (KeyError, ValueError, TypeError, AttributeError, RecursionError) as error:
        raise FormatError(f"{path}: not a whole state of a run ({error})") from None


def _encoded(value: Any, arrays: list[NDArray[Any]]) -> Any:
    """A value for JSON: as it is, or a list of its kind and content."""
    if isinstance(value, (np.ndarray, np.generic)):
        held = np.asarray(value)
        order = sorted(range(held.ndim), key=lambda axis: -abs(held.strides[axis]))  # as it lies in memory, so that sums add up alike
        arrays.append(np.ascontiguousarray(held.transpose(order)) if held.ndim else held)
        return ["array" if isinstance(value, np.ndarray) else "scalar", len(arrays) - 1, order]
    if isinstance(value, tuple):
        fields = getattr(value, "_fields", None)
        return ["tuple" if fields is None else type(value).__name__, *(_encoded(each, arrays) for each in value)]
    if isinstance(value, Mapping):
        return {key: _encoded(each, arrays) for key, each in value.items()}
    if value is None or isinstance(value, (str, bool, int, float)):
        return value
    raise TypeError(f"found {type(value).__name__}, expected arrays, numbers, texts, tuples or dictionaries")


def _decoded(held: Any, arrays: Mapping[str, NDArray[Any]], types: Mapping[str, type]) -> Any:
    if isinstance(held, dict):
        return {key: _decoded(each, arrays, types) for key, each in held.items()}
    if not isinstance(held, list):
        return held
    kind, *content = held
    if kind in ("array", "scalar"):
        index, order = content
        array = arrays[str(index)].transpose(np.argsort(order))
        return array if kind == "array" else array[()]
    values = (_decoded(each, arrays, types) for each in content)
    return tuple(values) if kind == "tuple" else types[kind](*values)
