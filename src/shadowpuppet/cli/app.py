"""The command line: its commands, and how it runs one."""

from __future__ import annotations

import re
import sys
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from cyclopts import App, CycloptsError, Group, MissingArgumentError, UnusedCliTokensError

from shadowpuppet.errors import INTERRUPTED, MISTAKE, ShadowPuppetError, choices, is_out_of_memory, one_line, reason
from shadowpuppet.output import say, say_text
from shadowpuppet.removed import refuse_tokens

COMMANDS = {
    "track": "track:track", "live": "track:live", "play": "track:play", "demo": "track:demo", "fit-person": "track:fit_person",
    "info": "recordings:info", "synthesize": "recordings:synthesize",
    "masks": "made:masks", "keypoints": "made:keypoints",
    "calibrate": "calibration.calibrate:calibrate",
    "check": "calibration.check:check", "fit-prior": "motion:fit_prior", "export": "motion:export", "convert": "motion:convert",
    "evaluate": "evaluation:evaluate", "batch": "batch:batch", "view": "viewer:view",
    "settings": "app:settings", "completion": "app:completion", "doctor": "doctor:doctor",
}  # fmt: skip
"""Module in this package and function of each command, by the command's name; loaded when used."""

FIRST = ("track", "live", "info", "calibrate", "check", "masks", "keypoints", "view", "evaluate", "export", "synthesize", "demo")
"""Commands that `--help` lists first; the others are under "More"."""
_GROUPS = tuple(Group(name, sort_key=n) for n, name in enumerate(("Commands", "More")))


def _version() -> str:
    from importlib.metadata import version

    return version("shadowpuppet")


app = App(name="shadowpuppet", version=_version, help_format="plaintext", suppress_keyboard_interrupt=False,
          group_commands=_GROUPS[0], help="Markerless motion capture from silhouettes.")
EXAMPLES: dict[str, dict[str, str]] = tomllib.loads(Path(__file__).with_name("examples.toml").read_text("utf-8"))
"""What follows each command in its examples, and what these are for."""


def _epilogue(command: str) -> str:
    lines = ((f"shadowpuppet {command} {arguments}".rstrip(), what) for arguments, what in EXAMPLES[command].items())
    return "\n".join(["Examples:\n", *(f"    {line}\n        {what}" for line, what in lines)])


for _name, _place in COMMANDS.items():
    app.command(f"shadowpuppet.cli.{_place}", name=_name, group=_GROUPS[_name not in FIRST], help_epilogue=_epilogue(_name))


def settings(*, preset: str = "default") -> None:
    """Print every setting with its explanation: a file for --config, and the names of the flags.

    Parameters
    ----------
    preset
        Settings to start from: default, liu2011 or ni2008.
    """
    from shadowpuppet.pipeline.options import make_options, options_text

    text = options_text(make_options({"preset": preset}))  # before anything is printed, as the preset may be unknown
    say("# Settings of `shadowpuppet track`; a setting particles in the table [tracker.arm] is the flag --tracker.arm.particles.")
    say("")
    say_text(text)


def completion(shell: Literal["bash", "zsh", "fish", "powershell"], /) -> None:
    """Print a script with which a shell completes commands, flags and files on the Tab key.

    In ~/.bashrc: eval "$(shadowpuppet completion bash)"; in ~/.zshrc the same with zsh, after compinit; in config.fish:
    shadowpuppet completion fish | source.

    Parameters
    ----------
    shell
        Which shell: bash, zsh, fish or powershell.
    """
    script = app.generate_completion(prog_name="shadowpuppet", shell=shell)
    function = re.search(r"^(_\w+)\(\)", script, re.MULTILINE)
    if shell == "zsh" and function is not None:  # zsh reads such scripts from its own folders; evaluated, they do nothing by themselves
        script += f"\ncompdef {function[1]} shadowpuppet"
    say_text(script)


def run(tokens: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code: 0, 2 for a user's mistake, 130 after Ctrl-C; 1 and 3 come from commands."""
    tokens = sys.argv[1:] if tokens is None else tokens
    try:
        refuse_tokens(tokens)
        if not tokens or tokens[0] in app.help_flags:
            app.resolved_commands()  # the list of commands shows the first line of each one's help
        code = app(list(tokens), exit_on_error=False, print_error=False, result_action="return_value")
        sys.stdout.flush()
    except (ShadowPuppetError, CycloptsError) as error:
        say(f"error: {' '.join(_told(error).split())}", error=True)
        return MISTAKE
    except KeyboardInterrupt as interrupt:
        say(f"interrupted{': ' if interrupt.args else ''}{' '.join(map(str, interrupt.args))}", error=True)
        return INTERRUPTED
    except Exception as error:
        if not is_out_of_memory(error):
            raise
        say(f"error: the memory of this machine does not suffice ({one_line(reason(error))}); a lower --max-size, a shorter part of the "
            "film or fewer cameras need less", error=True)
        return MISTAKE
    return code if isinstance(code, int) else 0


def _told(error: Exception) -> str:
    """A mistake in words."""
    if isinstance(error, UnusedCliTokensError):
        words = error.unused_tokens or ()
        return one_line(f"found {' '.join(words)!r} after all that the command takes; a path with blanks belongs in quotes")
    if isinstance(error, MissingArgumentError) and error.argument is not None and error.keyword is None and not error.argument.tokens:
        command, possible = " ".join(error.command_chain or ()), error.argument.get_choices()
        expected = f"expected {choices(possible)}" if possible else f"`shadowpuppet {command} --help` has examples"
        return f"{command}: found no {error.argument.name}; {expected}"
    comma = re.search(r'unable to convert "(-?\d+),(\d+)" into float', str(error))
    return one_line(error) + (f" Write {comma[1]}.{comma[2]}." if comma else "")
