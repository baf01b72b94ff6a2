"""Would the tests notice a mistake? Small mistakes are put into the package at random, one at a time, and the tests of its room are run.

    python benchmarks/mutants.py [--number 60] [--seed 1] [--under src/shadowpuppet/FOLDER] [--seconds 300] [--near] [--again LIST]

A mistake: a comparison, sum, product, whole number, condition, minimum or statement of a function is changed. Compiled functions are left
out (plain twins check them), and so are texts, annotations and the constants of modules. Tests are those of the folder in tests/ that
mirrors the module's, the files that name the module first, until one fails. A test counts that passes without the mistake: one that fails
then too (on a busy machine, by its clock) is left out, and the others go on. Prints a line for each mistake, `killed` and by which test,
`hangs` if one test takes longer than `--seconds` with the mistake alone, else `SURVIVED`, and the share not survived. The mistakes are in a
copy of the package in a temporary folder. A survivor is a test to write, or a change that changes nothing; `--again` tries the survivors in
a printed list once more.
"""

from __future__ import annotations

import argparse
import ast
import copy
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
import smallest

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "src" / "shadowpuppet"
COMPARED = {ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.Is: ast.IsNot,
            ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In}  # fmt: skip
COMPUTED = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.FloorDiv: ast.Div, ast.Mod: ast.FloorDiv,
            ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd, ast.Pow: ast.Mult}  # fmt: skip
NAMES = {"min": "max", "max": "min", "any": "all", "all": "any", "minimum": "maximum", "maximum": "minimum", "argmin": "argmax",
         "argmax": "argmin", "floor": "ceil", "ceil": "floor", "median": "mean", "nanmedian": "nanmax", "sorted": "list"}  # fmt: skip
COMPILED = ("kernel", "inline_kernel", "reduction_kernel", "device", "compiled")


class Mistake(NamedTuple):
    """One change of a module's text."""

    module: Path
    line: int
    before: str
    after: str
    text: str
    """The whole module with the change."""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--number", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--under", type=Path, default=PACKAGE, help="module, or folder of modules, to change")
    parser.add_argument("--seconds", type=float, default=300, help="time after which a test counts as hanging")
    parser.add_argument("--again", type=Path, help="what an earlier run printed: its survivors instead of random ones")
    parser.add_argument("--near", action="store_true", help="only the tests that name the module: a first look, in a tenth of the time")
    args = smallest.parse(parser, lambda folder: ["--number", 1, "--under", PACKAGE / "errors.py"])
    modules = [args.under.resolve()] if args.under.is_file() else sorted(args.under.resolve().rglob("*.py"))
    found = [mistake for module in modules if "scripts" not in module.parts for mistake in mistakes(module)]
    if args.again is None:
        chosen = [found[k] for k in np.random.default_rng(args.seed).permutation(len(found))[: args.number]]
    else:
        survived = [line.removeprefix("SURVIVED ") for line in args.again.read_text("utf-8").splitlines() if line.startswith("SURVIVED ")]
        chosen = [mistake for mistake in found if named(mistake) in survived]
    killed = 0
    tests = near if args.near else tests_of
    with tempfile.TemporaryDirectory(prefix="shadowpuppet-mutants-") as folder:
        shutil.copytree(PACKAGE.parent, Path(folder) / "src", ignore=shutil.ignore_patterns("__pycache__"))
        for mistake in chosen:
            end, test = tried(mistake, tests(mistake.module), Path(folder), args.seconds)
            killed += end != "SURVIVED"
            print(f"{end:8} {named(mistake)}" + (f"  by {test}" if test else ""), flush=True)
    print(f"{killed} of {len(chosen)} killed, {100 * killed / max(len(chosen), 1):.0f} %, of {len(found)} possible ones")
    return 0


def named(mistake: Mistake) -> str:
    """A mistake in a line."""
    where = f"{mistake.module.relative_to(PACKAGE)}:{mistake.line}"
    return f"{where}: {shown(mistake.before)} -> {shown(mistake.after)}"


def shown(text: str) -> str:
    """A piece of code in a line."""
    return " ".join(text.split())[:70]


def tried(mistake: Mistake, files: list[Path], folder: Path, seconds: float) -> tuple[str, str]:
    """What the tests say of the package's copy in `folder` with a mistake in it: killed, hangs or SURVIVED, and which test noticed."""
    target = folder / "src" / mistake.module.relative_to(PACKAGE.parent)
    whole, stamp, unfit = target.read_bytes(), target.stat(), list[str]()
    while files:
        target.write_text(mistake.text, encoding="utf-8")
        try:
            end, test = tested(folder, [*map(str, files), *(f"--deselect={each}" for each in unfit)], seconds)
        finally:
            target.write_bytes(whole)
            os.utime(target, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))  # compiled kernels are kept by the module's time
        if end == "SURVIVED" or not test or tested(folder, [test], seconds)[0] == "SURVIVED":
            return end, test
        unfit.append(test)
    return "SURVIVED", ""


def tested(folder: Path, arguments: list[str], seconds: float) -> tuple[str, str]:
    """How pytest ends for the package in `folder`, and the test that failed; none where the tests cannot be begun."""
    environment = os.environ | {"PYTHONPATH": str(folder / "src"), "PYTHONDONTWRITEBYTECODE": "1",
                                "NUMBA_CACHE_DIR": str(folder / "kernels")}  # fmt: skip
    command = [sys.executable, "-m", "pytest", "-x", "-v", "--tb=no", "-p", "no:cacheprovider", "-o", f"faulthandler_timeout={seconds}",
               "-o", "faulthandler_exit_on_timeout=true", *arguments]  # fmt: skip
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, errors="replace")
    if done.returncode in (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED):
        return "SURVIVED", ""
    begun = re.findall(r"^(tests/.+?::.+?)(?: (PASSED|SKIPPED|XFAIL|FAILED|ERROR)\b.*)?$", done.stdout, re.MULTILINE)
    test = next((test for test, outcome in reversed(begun) if outcome in ("FAILED", "ERROR", "")), "")
    return "hangs" if "Timeout (" in done.stderr else "killed", test


def near(module: Path) -> list[Path]:
    """The files with tests that name a module."""
    name, own = ".".join(module.relative_to(PACKAGE.parent).with_suffix("").parts), f"test_{module.stem}"
    return [path for path in tests_of(module) if path.stem == own or name in path.read_text("utf-8")]


def tests_of(module: Path) -> list[Path]:
    """The files with the tests of a module's room, those that name the module first."""
    name, own = ".".join(module.relative_to(PACKAGE.parent).with_suffix("").parts), f"test_{module.stem}"
    room = ROOT / "tests" / module.parent.relative_to(PACKAGE)
    while not list(room.glob("test_*.py")):
        room = room.parent
    files = sorted(room.rglob("test_*.py"), key=lambda path: (path.stem != own, name not in path.read_text("utf-8"), path))
    if room != ROOT / "tests":
        return files
    return [path for path in files if path.stem == own] or [path for path in files if name in path.read_text("utf-8")]


# Mistakes


def mistakes(module: Path) -> Iterator[Mistake]:
    """All mistakes that can be made in a module."""
    text = module.read_text("utf-8")
    lines = text.splitlines(keepends=True)
    starts = np.cumsum([0, *(len(line.encode()) for line in lines)])
    content = text.encode()
    for node in (part for function in functions(ast.parse(text)) for part in parts(function)):
        begin, end = starts[node.lineno - 1] + node.col_offset, starts[node.end_lineno - 1] + node.end_col_offset
        before = content[begin:end].decode()
        for after in variants(node):
            changed = content[:begin] + after.encode() + content[end:]
            yield Mistake(module, node.lineno, before, after, changed.decode())


def functions(node: ast.AST) -> Iterator[ast.stmt]:
    """The statements of the functions in a module or class that are not compiled."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.FunctionDef) and not any(_name(each) in COMPILED for each in child.decorator_list):
            yield from child.body
        elif isinstance(child, ast.ClassDef):
            yield from functions(child)


def parts(node: ast.AST) -> Iterator[ast.expr | ast.Expr]:
    """The parts of a tree that can be changed, without annotations and texts."""
    if isinstance(node, ast.JoinedStr | ast.Raise | ast.Import | ast.ImportFrom) or _is_checking(node):
        return
    if isinstance(node, ast.expr | ast.Expr):
        yield node
    for field, value in ast.iter_fields(node):
        if field not in ("annotation", "returns", "decorator_list", "type_params"):
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, ast.AST):
                    yield from parts(child)


def _is_checking(node: ast.AST) -> bool:
    """Whether a statement is for the type checker alone."""
    return isinstance(node, ast.Assert) or (isinstance(node, ast.If) and _name(node.test) == "TYPE_CHECKING")


def _name(node: ast.AST) -> str:
    node = node.func if isinstance(node, ast.Call) else node
    return node.id if isinstance(node, ast.Name) else node.attr if isinstance(node, ast.Attribute) else ""


def variants(node: ast.expr | ast.Expr) -> Iterator[str]:
    """What a part of a tree is changed to."""
    changed = copy.deepcopy(node)
    if isinstance(changed, ast.Compare) and type(changed.ops[0]) in COMPARED:
        changed.ops[0] = COMPARED[type(changed.ops[0])]()
    elif isinstance(changed, ast.BinOp) and type(changed.op) in COMPUTED and not isinstance(changed.left, ast.Constant | ast.JoinedStr):
        changed.op = COMPUTED[type(changed.op)]()
    elif isinstance(changed, ast.BoolOp):
        changed.op = ast.Or() if isinstance(changed.op, ast.And) else ast.And()
    elif isinstance(changed, ast.UnaryOp):
        changed = changed.operand
    elif isinstance(changed, ast.Constant) and isinstance(changed.value, bool | int):
        value = changed.value
        changed.value = not value if isinstance(value, bool) else value + 1
    elif isinstance(changed, ast.IfExp):
        changed.test = ast.UnaryOp(ast.Not(), changed.test)
    elif isinstance(changed, ast.Call) and _name(changed) in NAMES:
        new, function = NAMES[_name(changed)], changed.func
        changed.func = ast.Name(new) if isinstance(function, ast.Name) else ast.Attribute(function.value, new)  # pyright: ignore[reportAttributeAccessIssue]
    elif isinstance(changed, ast.Expr) and isinstance(changed.value, ast.Call):
        yield "pass"
        return
    else:
        return
    yield f"({ast.unparse(ast.fix_missing_locations(changed))})"


if __name__ == "__main__":
    sys.exit(main())
