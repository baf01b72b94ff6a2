"""The command `doctor`: tests what works on this machine, and states a remedy for the rest. Loads nothing that may be broken."""

from __future__ import annotations

import os
import platform
import re
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import nullcontext
from dataclasses import asdict, dataclass
from importlib import import_module, metadata
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter
from rich.table import Table
from rich.text import Text

from shadowpuppet.cli.tables import PlainConsole, show
from shadowpuppet.errors import BROKEN, extra_command
from shadowpuppet.output import say_text

OLDEST_PYTHON = (3, 11)
MODULES = {"opencv-python-headless": "cv2", "python-osc": "pythonosc"}
"""Import names of distributions, where they differ."""
EXTRAS = {
    "report": (("matplotlib",), "pages and plots about runs"), "formats": (("pyarrow",), "Parquet"),
    "batch": (("distributed",), "many runs on a cluster"), "live": (("websockets",), "live motion over a WebSocket"),
    "lsl": (("pylsl",), "live motion for the lab streaming layer"),
}  # fmt: skip
"""Modules of each extra, and its purpose."""
CODECS = {"H.264": "h264", "HEVC": "hevc", "VP9": "vp9", "AV1": "av1", "MPEG-4": "mpeg4", "ProRes": "prores", "Motion JPEG": "mjpeg",
          "FFV1": "ffv1"}  # fmt: skip
"""Common codecs, and FFmpeg's names of their decoders."""
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "firefox", "safari", "microsoft-edge", "xdg-open", "open")
MARKS = {"works": ("yes", "green"), "missing": ("no", "yellow"), "broken": ("broken", "red")}
PACKAGES = ("shadowpuppet", "numpy", "numba", "llvmlite", "opencv-python-headless", "av")
LEVELS = (("avx512f", "AVX-512"), ("avx2", "AVX2"), ("avx", "AVX"), ("neon", "NEON"))
REPAIR = "python -m pip install --force-reinstall shadowpuppet"


@dataclass(frozen=True)
class Examined:
    """Result of one check."""

    name: str
    state: Literal["works", "missing", "broken"]
    """`missing`: absent, but not needed to track films."""
    told: str
    remedy: str = ""
    """Repair; may be empty."""
    needed: bool = False
    """Whether tracking is impossible without it."""


def doctor(
    *,
    warm: Annotated[bool, Parameter(group="Other", negative=(), show_default=False, help="Compile everything first.")] = False,
    as_json: Annotated[bool, Parameter(name="--json", group="Other", negative=(), show_default=False, help="Print JSON.")] = False,
) -> int:
    """Check what works on this machine, and how to mend what does not: libraries, compiled kernels, films, extras, browser, cameras.

    With `--warm` all that tracking compiles is compiled now, in a minute or two, and kept: the first recording then starts at once.

    Exit code 1: something that tracking needs does not work.
    """
    import json

    console = PlainConsole(error=True, quiet=as_json)
    if warm:
        from shadowpuppet.cli.warm_up import warm_up

        console.print("compiling everything, once: a minute or two")
        warm_up()
    with console.status("trying what works") if console.is_terminal else nullcontext():
        found = examine()
    if as_json:
        say_text(json.dumps({"works": works(found), "findings": [asdict(finding) for finding in found]}, indent=1))
    else:
        show(*_tables(found))
    return 0 if works(found) else BROKEN


def _tables(found: Sequence[Examined]) -> Iterator[Any]:
    """Table with a row per check and its remedy below, and the outcome in a sentence."""
    table = Table.grid(padding=(0, 2))
    table.add_column(no_wrap=True, style="bold")
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    for finding in found:
        text = Text(finding.told)
        if finding.remedy:
            text.append(f"\n→ {finding.remedy}", "dim")
        table.add_row(Text(finding.name), Text(*MARKS[finding.state]), text)
    yield table
    broken = [finding.name for finding in found if finding.needed and finding.state != "works"]
    outcome = f"tracking does not work here: {', '.join(broken)}" if broken else "tracking works here"
    yield Text(outcome, "bold red" if broken else "bold green")


def examine() -> list[Examined]:
    """Run all checks; one that raises an error is reported as broken."""
    found = list[Examined]()
    for name, check, needed in CHECKS:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                found += check()
        except Exception as error:
            info = f"{type(error).__name__}: {' '.join(str(error).split())}"
            found.append(Examined(name, "broken", info[:300], REPAIR if needed else "", needed))
    return found


def works(found: list[Examined]) -> bool:
    """Whether tracking is possible."""
    return not any(finding.needed and finding.state != "works" for finding in found)


# The core


def _python() -> Iterator[Examined]:
    old = sys.version_info[:2] < OLDEST_PYTHON
    yield Examined("Python", "broken" if old else "works", f"{platform.python_version()}, {platform.platform()}",
                  f"install Python {OLDEST_PYTHON[0]}.{OLDEST_PYTHON[1]} or later" if old else "", True)  # fmt: skip


def _libraries() -> Iterator[Examined]:
    info, bad = [], []
    for name in _required("shadowpuppet"):
        try:
            import_module(MODULES.get(name, name.replace("-", "_")))
            info.append(f"{name} {metadata.version(name)}")
        except Exception as error:
            bad.append(f"{name}: {type(error).__name__}: {' '.join(str(error).split())}")
    if bad:
        yield Examined("libraries", "broken", "; ".join(bad), REPAIR, True)
    else:
        yield Examined("libraries", "works", ", ".join(info), needed=True)


def _required(name: str) -> list[str]:
    """The distributions that one states to need, without extras. Raises `PackageNotFoundError`."""
    return [re.split(r"[^\w.-]", text, maxsplit=1)[0] for text in metadata.requires(name) or [] if "extra ==" not in text]


def _kernels() -> Iterator[Examined]:
    """Check that a compiled kernel computes the joints of a body."""
    import numpy as np

    from shadowpuppet.body.models import average_sizes, make_body

    body = make_body("rounded", average_sizes("rounded", 1.75))
    head = body.points(np.zeros((1, len(body.skeleton.dofs))), names=["head"])[0, 0]
    if not 0.3 < head[2] < 0.9:
        yield Examined("kernels", "broken", f"compiled code puts the head {head[2]:.3f} m above the waist", REPAIR, True)
    else:
        yield Examined("kernels", "works", "compiled, and right", needed=True)


def _cache() -> Iterator[Examined]:
    from shadowpuppet.body.forward_kinematics import place_all

    info = getattr(getattr(place_all, "_cache", None), "cache_path", "")
    if os.environ.get("NUMBA_DISABLE_JIT", "0") != "0":
        yield Examined("compiled code", "missing", "NUMBA_DISABLE_JIT is set: nothing is compiled, which is very slow",
                      "unset NUMBA_DISABLE_JIT")  # fmt: skip
    elif not info or not _writable(Path(info)):
        yield Examined("compiled code", "missing", f"cannot be kept{f' in {info}' if info else ''}: it is compiled again at every start, "
                      "which takes up to half a minute", "set NUMBA_CACHE_DIR to a folder of your own that can be written")  # fmt: skip
    else:
        yield Examined("compiled code", "works", f"kept in {info}")


def _films() -> Iterator[Examined]:
    """Check that films, lossy and lossless, can be written and read."""
    import numpy as np

    from shadowpuppet.video import open_frames, write_frames

    images = [np.full((48, 64, 3), 20 * n, np.uint8) for n in range(8)]
    with tempfile.TemporaryDirectory() as folder:
        for name, lossless in (("film.mp4", False), ("film.mkv", True)):
            with write_frames(Path(folder, name), 25, lossless=lossless) as film:
                for image in images:
                    film.write(image)
            off = [int(np.abs(frame.image.astype(int) - image).max()) for frame, image in zip(open_frames(Path(folder, name)), images)]
            if len(off) != len(images) or max(off) > (0 if lossless else 12):
                yield Examined("films", "broken", f"{name}: {len(off)} of {len(images)} frames came back, off by {max(off, default=0)}",
                              REPAIR, True)  # fmt: skip
                return
    yield Examined("films", "works", "H.264 and FFV1 are written and read", needed=True)


def _codecs() -> Iterator[Examined]:
    import av

    there = [name for name, codec in CODECS.items() if _has_codec(av, codec)]
    lacking = [name for name in CODECS if name not in there]
    info = f"{', '.join(there)} can be read" + (f"; not {', '.join(lacking)}" if lacking else "")
    yield Examined("codecs", "missing" if lacking else "works", info, "turn such films into H.264 first" if lacking else "")


def _has_codec(av: object, name: str) -> bool:
    try:
        av.codec.Codec(name, "r")  # pyright: ignore[reportAttributeAccessIssue]
    except ValueError:
        return False
    return True


def environment() -> dict[str, Any]:
    """Processor, cores, vector instructions, system and versions."""
    import llvmlite.binding as llvm

    features = llvm.get_host_cpu_features()
    level = next((name for feature, name in LEVELS if features.get(feature)), "none known")
    return {"cpu": _model(), "llvm_cpu": llvm.get_host_cpu_name(), "cores": os.cpu_count(), "vectors": level, "system": platform.platform(),
            "python": platform.python_version(), **{name: metadata.version(name) for name in PACKAGES}}


def _model() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text("utf-8").splitlines()
    except OSError:
        return platform.processor() or "unknown"
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), platform.machine())


def _processor() -> Iterator[Examined]:
    from shadowpuppet.threads import THREADS_VARIABLE, thread_limit, usable_cores

    known = environment()
    info = f"{known['cpu']}; {usable_cores()} of {known['cores']} cores may be used; Numba sees {known['vectors']}"
    info += f"; {THREADS_VARIABLE} is {thread_limit()}" if thread_limit() is not None else ""
    slow = known["vectors"] in ("AVX", "none known") and platform.machine().lower() in ("x86_64", "amd64")
    yield Examined("processor", "missing" if slow else "works", info, "all works, at half the speed or less" if slow else "")


# Extras and devices


def _extras() -> Iterator[Examined]:
    for extra, (names, purpose) in EXTRAS.items():
        try:
            for name in names:
                import_module(name)
        except ImportError:
            yield Examined(f"extra {extra}", "missing", f"{purpose}: not installed", extra_command(extra))
        except Exception as error:  # such as a missing system library
            yield Examined(f"extra {extra}", "broken", f"{purpose}: {' '.join(str(error).split())[:200]}")
        else:
            yield Examined(f"extra {extra}", "works", f"{purpose}: {', '.join(f'{name} {metadata.version(name)}' for name in names)}")


def _scripts() -> Iterator[Examined]:
    """Check the program that runs the scripts of `masks` and `keypoints`."""
    from shadowpuppet.external.environment import cache_folder, uv_path

    uv = uv_path()
    how = f"are run by uv, {uv}" if uv else f"run in environments kept in {cache_folder()}"
    remedy = "" if uv else "uv (pip install uv) would also bring the version of Python that a script needs"
    yield Examined("scripts", "works", f"scripts of `masks` and `keypoints` {how}", remedy)


def _browser() -> Iterator[Examined]:
    import shutil

    there = next((name for name in BROWSERS if shutil.which(name)), "")
    if there or platform.system() in ("Windows", "Darwin"):
        yield Examined("browser", "works", there or "the system's own")
    else:
        yield Examined("browser", "missing", "none was found", "pages of `live` and reports can be opened on another machine")


def _cameras() -> Iterator[Examined]:
    """Find the cameras that Linux lists; they are not opened, as their lights would go on."""
    if platform.system() != "Linux":
        yield Examined("cameras", "works", "not looked for here; `live --camera 0` tries the first")
        return
    devices = sorted(Path("/dev").glob("video*"))
    shut = [device.name for device in devices if not os.access(device, os.R_OK | os.W_OK)]
    named = ", ".join(f"{device.name} ({_camera_name(device)})" for device in devices)
    if not devices:
        yield Examined("cameras", "missing", "none is connected", "`live --camera FILM` or an address of the network will do")
    elif shut:
        yield Examined("cameras", "broken", f"{', '.join(shut)} may not be opened", "add yourself to the group video, and log in again")
    else:
        yield Examined("cameras", "works", named)


def _camera_name(device: Path) -> str:
    try:
        return Path("/sys/class/video4linux", device.name, "name").read_text("utf-8").strip()
    except OSError:
        return "unknown"


def _writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


CHECKS: tuple[tuple[str, Callable[[], Iterator[Examined]], bool], ...] = (
    ("Python", _python, True), ("libraries", _libraries, True),
    ("kernels", _kernels, True), ("compiled code", _cache, False),
    ("films", _films, True), ("codecs", _codecs, False), ("processor", _processor, False), ("extras", _extras, False),
    ("scripts", _scripts, False), ("browser", _browser, False), ("cameras", _cameras, False),
)  # fmt: skip
"""Name, function, whether tracking needs it."""
