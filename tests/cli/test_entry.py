"""The program in a shell: Ctrl-C while it is being loaded, completion by the Tab key, no colours in pipes."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys

import pytest

from shadowpuppet.cli import app as cli
from shadowpuppet.cli import entry
from shadowpuppet.errors import BROKEN

INTERRUPTING = """
import os, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # even where the tests run in the background

class Finder:
    def find_spec(self, name, path=None, target=None):
        if name == {name!r}:
            os.kill(os.getpid(), signal.SIGINT)

sys.meta_path.insert(0, Finder())
sys.argv = ["shadowpuppet", "info", "nowhere"]
from shadowpuppet.cli.entry import main
main()
"""


@pytest.mark.parametrize(
    "name", ["shadowpuppet.cli.app", "cyclopts", "numpy", "shadowpuppet.pipeline.options", "shadowpuppet.pipeline.findings.rig", "numba"]
)
def test_control_c_while_the_program_is_loaded_is_no_traceback(name):
    done = subprocess.run([sys.executable, "-c", INTERRUPTING.format(name=name)], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr.strip().startswith("interrupted")) == (130, "", True), done.stderr
    assert len(done.stderr.splitlines()) == 1


AT_THE_END = """
import os, signal, sys, threading
from shadowpuppet.cli import app, entry

signal.signal(signal.SIGINT, signal.default_int_handler)  # even where the tests run in the background

def work():
    while signal.getsignal(signal.SIGINT) is signal.default_int_handler and not over.wait(0.01):
        pass
    os.kill(os.getpid(), signal.SIGINT)
    over.wait(600)

def run():
    threading.Thread(target=work).start()
    threading.Timer({seconds}, over.set).start()
    return {code}

over = threading.Event()
app.run = run
entry.main()
"""


@pytest.mark.parametrize("code", [0, 130])
def test_control_c_while_only_threads_are_waited_for_ends_at_once(code):
    done = subprocess.run([sys.executable, "-c", AT_THE_END.format(code=code, seconds=60)], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


def test_a_second_control_c_while_the_first_is_told_is_no_traceback():
    code = ("import os, signal\nfrom shadowpuppet.cli import app, entry\nsignal.signal(signal.SIGINT, signal.default_int_handler)\n"
            "def run(*_, **__):\n    raise KeyboardInterrupt\n"
            "def second(*_, **__):\n    os.kill(os.getpid(), signal.SIGINT)\n    raise SystemExit(7)\n"
            "app.app.__class__.__call__ = run\napp.say = second\nentry.main()")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "interrupted\n")


def test_a_library_that_cannot_be_loaded_is_said_in_a_line():
    code = "import sys; sys.modules['pydantic'] = None; from shadowpuppet.cli.entry import main; main()"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr.startswith("error: a library cannot be loaded (import of pydantic halted")
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize(("name", "ours"), [("shadowpuppet.no_such", True), ("numpy", False), (None, False)])
@pytest.mark.parametrize("loaded_late", [False, True])
def test_a_module_of_ours_that_is_missing_is_a_bug_and_another_one_is_said(monkeypatch, capsys, name, ours, loaded_late):
    def fails(*_: object) -> int:
        cause = ImportError("no such\nmodule", name=name)
        if loaded_late:
            raise ImportError("a command cannot be loaded", name="shadowpuppet.cli") from cause
        raise cause

    monkeypatch.setattr("shadowpuppet.cli.app.run", fails)
    if ours:
        with pytest.raises(ImportError):
            entry._run()
    else:
        assert entry._run() == BROKEN
        assert capsys.readouterr().err.startswith("error: a library cannot be loaded (no such module); `python -m pip")


def test_doctor_runs_where_a_library_cannot_be_loaded():
    code = ("import sys; sys.modules['numpy'] = None; sys.argv = ['shadowpuppet', 'doctor']\n"
            "from shadowpuppet.cli.entry import main; main()")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (1, "")
    assert "tracking does not work here: libraries, kernels" in done.stdout


def test_the_entry_point_and_the_module_begin_there():
    from importlib.metadata import entry_points

    from shadowpuppet import __main__
    from shadowpuppet.cli import entry

    assert __main__.main is entry.main
    (script,) = entry_points(group="console_scripts", name="shadowpuppet")
    assert script.value in ("shadowpuppet.cli.entry:main", "shadowpuppet.cli.app:main")  # the latter from an older installation, editable


# Completion


def completed(script: str, words: list[str]) -> list[str]:
    """What bash offers for the last of some words."""
    quoted = " ".join(f"'{word}'" for word in words)
    code = (f'source "{script}"; COMP_WORDS=({quoted}); COMP_CWORD={len(words) - 1}; COMP_LINE="${{COMP_WORDS[*]}}"; '
            'COMP_POINT=${#COMP_LINE}; function=$(complete -p shadowpuppet); function=${function#*-F }; ${function%% *} shadowpuppet; '
            'printf "%s\\n" "${COMPREPLY[@]}"')
    return subprocess.run(["bash", "--norc", "-c", code], capture_output=True, text=True, check=True).stdout.split()


@pytest.fixture(scope="module")
def script(tmp_path_factory):
    if shutil.which("bash") is None:
        pytest.skip("no bash")
    path = tmp_path_factory.mktemp("completion") / "completion.bash"
    path.write_text(subprocess.run([sys.executable, "-m", "shadowpuppet", "completion", "bash"], capture_output=True, text=True,
                                   check=True).stdout)  # fmt: skip
    return str(path)


@pytest.mark.parametrize(("words", "offered"), [
    (["tr"], {"track"}), (["fit-"], {"fit-person", "fit-prior"}), (["track", "--over"], {"--overlay"}),
    (["live", "--webs"], {"--websocket"}), (["live", "--show", "b"], {"browser"}),
    (["completion", "f"], {"fish"}), (["batch", "--table", ""], {"csv", "parquet"}), (["zzz"], set()),
])  # fmt: skip
def test_bash_completes(script, words, offered):
    assert set(completed(script, ["shadowpuppet", *words])) == offered


def test_bash_completes_files(script, tmp_path, monkeypatch):
    (tmp_path / "walking").mkdir()
    monkeypatch.chdir(tmp_path)
    assert completed(script, ["shadowpuppet", "track", "wal"]) in (["walking"], ["walking/"])


@pytest.mark.parametrize("shell", ["zsh", "fish", "powershell"])
def test_other_shells_get_a_script_that_names_every_command(shell, capsys):
    assert cli.run(["completion", shell]) == 0
    out = capsys.readouterr().out
    assert all(name in out for name in cli.app if not name.startswith("-"))


def test_zsh_takes_the_script(capsys, tmp_path):
    if shutil.which("zsh") is None:
        pytest.skip("no zsh")
    assert cli.run(["completion", "zsh"]) == 0
    (tmp_path / "script").write_text(capsys.readouterr().out)
    code = f'autoload -U compinit; compinit -u -d {tmp_path}/dump; eval "$(cat {tmp_path}/script)"; print $_comps[shadowpuppet]'
    assert subprocess.run(["zsh", "-f", "-c", code], capture_output=True, text=True, check=True).stdout.startswith("_cyclopts")


def test_a_shell_that_is_not_known_is_refused(capsys):
    assert cli.run(["completion", "ksh"]) == 2
    assert '"ksh"' in capsys.readouterr().err


# Help


@pytest.mark.parametrize("name", [*(name for name in cli.app if not name.startswith("-")), ""])
def test_help_fits_80_columns(name, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    for app in (cli.app, cli.app[name]) if name else (cli.app,):
        monkeypatch.setattr(app, "_fallback_console", None)  # which has the width of the first thing that it printed
    assert cli.run([*([name] if name else []), "--help"]) == 0
    out = capsys.readouterr().out
    assert max(map(len, out.splitlines())) <= 80
    assert not re.search(r"--empty-(?!seconds)|\[default: \(\)\]|\bNone\b", out)


def test_there_are_no_colours_in_a_pipe_even_where_the_terminal_has_them():
    environment = {key: value for key, value in os.environ.items() if key != "NO_COLOR"} | {"TERM": "xterm-256color"}
    for tokens in (["track", "--help"], ["track", "here", "--overlya"], ["synthesize", "--list"]):
        done = subprocess.run([sys.executable, "-m", "shadowpuppet", *tokens], capture_output=True, text=True, check=False, env=environment)
        assert done.stdout + done.stderr
        assert "\x1b" not in done.stdout + done.stderr
