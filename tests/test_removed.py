"""Commands, settings and files of earlier versions are answered with their replacement."""

from __future__ import annotations

import pytest

from shadowpuppet.removed import COMMANDS


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("more", [(), ("--help",), ("--quick", "--json", "b.json")])
def test_a_removed_command_names_its_replacement(shell, command, more):
    code, out, err = shell(command, *more)
    assert (code, out) == (2, "")
    assert err == f"error: {COMMANDS[command]}\n"


def test_bench_is_in_the_source_repository(shell):
    assert shell("bench")[2] == "error: bench has moved: python -m benchmarks.bench in the source repository\n"
