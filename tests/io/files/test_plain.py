"""Values for TOML and JSON."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.io.files.plain import for_json, for_toml, plain


def test_what_a_format_does_not_have_is_left_out_or_none():
    value = {"a": None, "b": [1, None, {"c": None, "d": math.nan}], "e": math.inf, "f": 0}
    assert str(for_toml(value)) == str({"b": [1, {"d": math.nan}], "e": math.inf, "f": 0})
    assert for_json(value) == {"a": None, "b": [1, None, {"c": None, "d": None}], "e": None, "f": 0}


def test_arrays_tuples_and_paths_become_plain_and_anything_else_is_refused():
    assert plain({1: (np.arange(2), np.float64(0.5)), "p": Path("a/b"), "n": None}, "x") == {"1": [[0, 1], 0.5], "p": "a/b", "n": None}
    with pytest.raises(ShadowPuppetError, match=r"x\.a\[1\]: found <object"):
        plain({"a": [1, object()]}, "x")
