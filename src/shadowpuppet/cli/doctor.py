"""What works on this machine, tried rather than guessed: libraries, compiled kernels, films, extras, screens, cameras."""

from __future__ import annotations

import os
import platform
import re
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module, metadata
from pathlib import Path
from typing import Literal

import numpy as np

LEAST = (3, 11)
"""The oldest Python."""
MODULES = {"av": "av", "opencv-python-headless": "cv2", "tomli-w": "tomli_w"}
"""What a distribution is imported as, where that is another name."""
EXTRAS = {
    "view": (("viser",), "the viewer"), "report": (("matplotlib",), "pages and plots about runs"),
    "formats": (("pyarrow",), "Parquet"), "batch": (("distributed",), "many runs on a cluster"),
    "live": (("websockets",), "live motion over a WebSocket"), "lsl": (("pylsl",), "live motion for the lab streaming layer"),
}  # fmt: skip
"""What each extra installs, and is for."""
CODECS = {"H.264": "h264", "HEVC": "hevc", "VP9": "vp9", "AV1": "av1", "MPEG-4": "mpeg4", "ProRes": "prores", "Motion JPEG": "mjpeg",
          "FFV1": "ffv1"}  # fmt: skip
"""Of films that people have, and FFmpeg's names of what reads them."""
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "firefox", "safari", "microsoft-edge", "xdg-open", "open")
REPAIR = "python -m pip install --force-reinstall shadowpuppet"


@dataclass(frozen=True)
class Finding:
    """One thing that was tried."""

    name: str
    state: Literal["works", "missing", "broken"]
    """`missing`: not there, and not needed for tracking films."""
    told: str
    remedy: str = ""
    """What would mend it; empty where nothing need be."""
    needed: bool = False
    """Whether the core is broken without it."""


def examine() -> list[Finding]:
    """Try everything; what raises an error is broken, and says so."""
    found = list[Finding]()
    for name, check, needed in CHECKS:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                found += check()
        except Exception as error:  # whatever it is: that is what is asked for
            told = f"{type(error).__name__}: {' '.join(str(error).split())}"
            found.append(Finding(name, "broken", told[:300], REPAIR if needed else "", needed))
    return found


def works(found: list[Finding]) -> bool:
    """Whether the core does."""
    return not any(finding.needed and finding.state != "works" for finding in found)


# The core


def _python() -> Iterator[Finding]:
    old = sys.version_info[:2] < LEAST
    yield Finding("Python", "broken" if old else "works", f"{platform.python_version()}, {platform.platform()}",
                  f"install Python {LEAST[0]}.{LEAST[1]} or later" if old else "", True)  # fmt: skip


def _libraries() -> Iterator[Finding]:
    wanted = [text for text in metadata.requires("shadowpuppet") or [] if "extra ==" not in text]
    told, bad = [], []
    for text in wanted:
        name = re.split(r"[^\w.-]", text, maxsplit=1)[0]
        try:
            import_module(MODULES.get(name, name.replace("-", "_")))
            told.append(f"{name} {metadata.version(name)}")
        except Exception as error:
            bad.append(f"{name}: {type(error).__name__}: {' '.join(str(error).split())}")
    if bad:
        yield Finding("libraries", "broken", "; ".join(bad), REPAIR, True)
    else:
        yield Finding("libraries", "works", ", ".join(told), needed=True)


def _kernels() -> Iterator[Finding]:
    """A body's joints, by a kernel that is compiled for this processor."""
    from shadowpuppet.body.models import average_sizes, make_body

    body = make_body("rounded", average_sizes("rounded", 1.75))
    head = body.points(np.zeros((1, len(body.skeleton.dofs))), names=["head"])[0, 0]
    if not 0.3 < head[2] < 0.9:
        yield Finding("kernels", "broken", f"compiled code puts the head {head[2]:.3f} m above the waist", REPAIR, True)
    else:
        yield Finding("kernels", "works", "compiled, and right", needed=True)


def _cache() -> Iterator[Finding]:
    from shadowpuppet.body.forward_kinematics import place_all

    told = getattr(getattr(place_all, "_cache", None), "cache_path", "")
    if os.environ.get("NUMBA_DISABLE_JIT", "0") != "0":
        yield Finding("compiled code", "missing", "NUMBA_DISABLE_JIT is set: nothing is compiled, which is very slow",
                      "unset NUMBA_DISABLE_JIT")  # fmt: skip
    elif not told or not _writable(Path(told)):
        yield Finding("compiled code", "missing", f"cannot be kept{f' in {told}' if told else ''}: it is compiled anew at every start, "
                      "which takes up to half a minute", "set NUMBA_CACHE_DIR to a folder of your own that can be written")  # fmt: skip
    else:
        yield Finding("compiled code", "works", f"kept in {told}")


def _films() -> Iterator[Finding]:
    """A film is written and read again, and one without loss."""
    from shadowpuppet.video import open_frames, write_frames

    images = [np.full((48, 64, 3), 20 * n, np.uint8) for n in range(8)]
    with tempfile.TemporaryDirectory() as folder:
        for name, lossless in (("film.mp4", False), ("film.mkv", True)):
            with write_frames(Path(folder, name), 25, lossless=lossless) as film:
                for image in images:
                    film.write(image)
            off = [int(np.abs(frame.image.astype(int) - image).max()) for frame, image in zip(open_frames(Path(folder, name)), images)]
            if len(off) != len(images) or max(off) > (0 if lossless else 12):
                yield Finding("films", "broken", f"{name}: {len(off)} of {len(images)} frames came back, off by {max(off, default=0)}",
                              REPAIR, True)  # fmt: skip
                return
    yield Finding("films", "works", "H.264 and FFV1 are written and read", needed=True)


def _codecs() -> Iterator[Finding]:
    import av

    there = [name for name, codec in CODECS.items() if _has_codec(av, codec)]
    lacking = [name for name in CODECS if name not in there]
    told = f"{', '.join(there)} can be read" + (f"; not {', '.join(lacking)}" if lacking else "")
    yield Finding("codecs", "missing" if lacking else "works", told, "turn such films into H.264 first" if lacking else "")


def _has_codec(av: object, name: str) -> bool:
    try:
        av.codec.Codec(name, "r")  # pyright: ignore[reportAttributeAccessIssue]
    except ValueError:
        return False
    return True


def _processor() -> Iterator[Finding]:
    from shadowpuppet.evaluation.bench.machine import environment
    from shadowpuppet.threads import LIMIT, thread_limit, usable_cores

    known = environment()
    told = f"{known['cpu']}; {usable_cores()} of {known['cores']} cores may be used; Numba sees {known['vectors']}"
    told += f"; {LIMIT} is {thread_limit()}" if thread_limit() is not None else ""
    slow = known["vectors"] in ("AVX", "none known") and platform.machine().lower() in ("x86_64", "amd64")
    yield Finding("processor", "missing" if slow else "works", told, "all works, at half the speed or less" if slow else "")


# What is beside


def _extras() -> Iterator[Finding]:
    for extra, (names, purpose) in EXTRAS.items():
        try:
            for name in names:
                import_module(name)
        except ImportError:
            yield Finding(f"extra {extra}", "missing", f"{purpose}: not installed", f"pip install 'shadowpuppet[{extra}]'")
        except Exception as error:  # as where a library of the system lacks
            yield Finding(f"extra {extra}", "broken", f"{purpose}: {' '.join(str(error).split())[:200]}")
        else:
            yield Finding(f"extra {extra}", "works", f"{purpose}: {', '.join(f'{name} {metadata.version(name)}' for name in names)}")


def _browser() -> Iterator[Finding]:
    import shutil

    there = next((name for name in BROWSERS if shutil.which(name)), "")
    if there or platform.system() in ("Windows", "Darwin"):
        yield Finding("browser", "works", there or "the system's own")
    else:
        yield Finding("browser", "missing", "none was found", "pages of `live` and reports can be opened on another machine")


def _cameras() -> Iterator[Finding]:
    """Those that Linux lists; they are not opened, for their lamps would go on."""
    if platform.system() != "Linux":
        yield Finding("cameras", "works", "not looked for here; `live --camera 0` tries the first")
        return
    devices = sorted(Path("/dev").glob("video*"))
    shut = [device.name for device in devices if not os.access(device, os.R_OK | os.W_OK)]
    named = ", ".join(f"{device.name} ({_camera_name(device)})" for device in devices)
    if not devices:
        yield Finding("cameras", "missing", "none is connected", "`live --camera FILM` or an address of the network will do")
    elif shut:
        yield Finding("cameras", "broken", f"{', '.join(shut)} may not be opened", "add yourself to the group video, and log in again")
    else:
        yield Finding("cameras", "works", named)


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


CHECKS: tuple[tuple[str, Callable[[], Iterator[Finding]], bool], ...] = (
    ("Python", _python, True), ("libraries", _libraries, True), ("kernels", _kernels, True), ("compiled code", _cache, False),
    ("films", _films, True), ("codecs", _codecs, False), ("processor", _processor, False), ("extras", _extras, False),
    ("browser", _browser, False), ("cameras", _cameras, False),
)  # fmt: skip
"""Name, what tries it, whether the core needs it."""
