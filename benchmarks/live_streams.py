"""Several streams tracked live, with their faults: error of the joints at the moment that was filmed, and latency.

    python benchmarks/live_streams.py RECORDING [--cameras cam1,cam3,cam5,cam7] [--rate 10] [--speed 0.5] [--seconds 7] [--sessions 3]

The recording's films are served as network cameras are (JPEG over HTTP), each forth and back without end after its empty scene, and `live`
tracks them with its own settings. As the streams come from this program, it knows what was filmed when.
"""

from __future__ import annotations

import argparse
import contextlib
import http.server
import multiprocessing
import tempfile
import threading
import time
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import smallest
from rich.console import Console
from rich.table import Table

from shadowpuppet.io.calibration.calibration_files import write_calibration
from shadowpuppet.io.motion.motion_files import read_truth
from shadowpuppet.io.motion.table import JointTable
from shadowpuppet.io.recording import Recording, read_recording
from shadowpuppet.live.display.view import Display, SessionState
from shadowpuppet.live.run import run_live
from shadowpuppet.live.settings import LiveSettings
from shadowpuppet.live.stream.outlet import Outlet, Outlets, StreamFrame, StreamSubject
from shadowpuppet.pipeline.options import make_options
from shadowpuppet.video import Size, open_frames

EMPTY = 3.0
"""Seconds of the empty scene."""
PROCESSES = multiprocessing.get_context("spawn")
"""Pictures are sent by a process of their own, as they are by cameras."""
LATE, HALF, STALLS = 0.15, 2, 2.0
"""Delay of a late stream, s; factor by which a slow stream's rate is lower; length of a gap, s."""


@dataclass(frozen=True)
class Faults:
    """What is wrong with the second stream, or with all."""

    late: float = 0.0
    every: int = 1
    stalls: float = 0.0
    apart: bool = False
    """Whether the cameras' shutters are evenly spread over the interval instead of together."""
    told: bool = False
    """Whether the session gets `--delay`."""


ROWS = {"clean": Faults(), "shutters apart": Faults(apart=True), f"one {1000 * LATE:.0f} ms late": Faults(late=LATE),
        "the same with --delay": Faults(late=LATE, told=True), "one at half the rate": Faults(every=HALF),
        f"one stops for {STALLS:.0f} s": Faults(stalls=STALLS)}  # fmt: skip


@dataclass
class Stage:
    """Films as streams: what is filmed when."""

    recording: Recording
    size: Size
    rate: float
    apart: float
    """Seconds between two cameras' shutters."""
    speed: float
    """Of the films, over their own."""
    jpegs: list[list[bytes]] = field(default_factory=list)
    empty: list[list[bytes]] = field(default_factory=list)
    start: float = 0.0
    """Seconds of the monotonic clock."""

    def load(self) -> None:
        for view in self.recording.views:
            film = open_frames(view.video, size=self.size)
            step = max(1, round(film.rate * self.speed / self.rate))
            self.speed = step * self.rate / film.rate
            self.jpegs.append([_jpeg(frame.image) for n, frame in enumerate(film) if n % step == 0])
            assert view.background is not None
            scene = [_jpeg(frame.image) for frame in open_frames(view.background, size=self.size)]
            self.empty.append([scene[k % len(scene)] for k in range(round(EMPTY * self.rate))])

    def jpeg(self, camera: int, n: int) -> bytes:
        """Picture `n` of a stream."""
        scene, film = self.empty[camera], self.jpegs[camera]
        return scene[n] if n < len(scene) else film[_to_and_fro(n - len(scene), len(film))]

    def film_time(self, moment: float) -> float:
        """The film's time (s) that was to be seen at a moment of the monotonic clock."""
        last, n = len(self.jpegs[0]) - 1, (moment - self.start) * self.rate - len(self.empty[0])
        return (last - abs(n % (2 * last) - last)) / self.rate * self.speed


def _to_and_fro(n: int, count: int) -> int:
    return count - 1 - abs(n % (2 * count - 2) - (count - 1))


def _jpeg(image: np.ndarray) -> bytes:
    return cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, 92])[1].tobytes()


def serve(stage: Stage, faults: Faults, start: float, stalled_from: Any, ports: Any) -> None:
    """Cameras of the network on free ports of this machine, until the process is ended; a stream stalls from a time (s) on."""

    def handler(camera: int) -> type[http.server.BaseHTTPRequestHandler]:
        own = faults if camera == 1 else Faults()

        class Handler(http.server.BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                self.send_response(200)
                self.send_header("Content-Type", "multipart/x-mixed-replace; boundary=frame")
                self.end_headers()
                n = max(0, int((time.monotonic() - start) * stage.rate))
                with contextlib.suppress(OSError):  # the reader has enough
                    while True:
                        due = start + n / stage.rate + own.late + stage.apart * camera
                        time.sleep(max(due - time.monotonic(), 0.0))
                        if n % own.every == 0 and not 0 < due - stalled_from.value < own.stalls:
                            self._send(stage.jpeg(camera, n))
                        n += 1

            def _send(self, data: bytes) -> None:
                head = b"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n"
                self.wfile.write(head % len(data) + data + b"\r\n")

            def log_message(self, *_: Any) -> None:
                pass

        return Handler

    servers = [http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler(camera)) for camera in range(len(stage.jpegs))]
    for server in servers:
        threading.Thread(target=server.serve_forever, daemon=True).start()
    ports.put([server.server_port for server in servers])
    threading.Event().wait()


class Receiver(Outlet):
    """Receives frames as other programs do."""

    def __init__(self) -> None:
        """Nothing has come."""
        self.frames: list[tuple[float, StreamFrame]] = []
        self.names: tuple[str, ...] = ()

    def begin(self, subject: StreamSubject) -> None:
        """Note the joints' names."""
        self.names = subject.names

    def send(self, frame: StreamFrame) -> None:
        """Keep a frame with the time of its arrival (s)."""
        self.frames.append((time.monotonic(), frame))


class Timer(Display):
    """Ends the session some seconds after the first pose; has a stream stall in the middle."""

    def __init__(self, stalled_from: Any, seconds: float) -> None:
        """Begins with the first pose."""
        self.stalled_from, self.seconds, self.end, self.said = stalled_from, seconds, np.inf, set[str]()
        self.limit = time.monotonic() + 90

    def show(self, view: SessionState) -> None:
        """Look for the first pose."""
        if view.phase == "tracking" and not np.isfinite(self.end):
            self.end = time.monotonic() + self.seconds
            self.stalled_from.value = time.monotonic() + self.seconds / 3
        self.said.add(view.trouble or (view.message if view.phase == "tracking" else ""))

    def command(self) -> str:
        """Stop when it is time."""
        return "stop" if time.monotonic() > min(self.end, self.limit) else ""


def session(stage: Stage, faults: Faults, seconds: float, truth: JointTable) -> list[float]:
    """`figures` of one session; NaN without a pose."""
    cameras = [view.camera.resized(stage.size) for view in stage.recording.views]
    stage.apart = 1 / stage.rate / len(cameras) if faults.apart else 0.0
    stage.start, stalled_from, ports = time.monotonic() + 1.0, PROCESSES.Value("d", np.inf), PROCESSES.Queue()
    receiver, timer = Receiver(), Timer(stalled_from, seconds)
    cameraman = PROCESSES.Process(target=serve, args=(stage, faults, stage.start, stalled_from, ports), daemon=True)
    cameraman.start()
    try:
        settings = LiveSettings(camera=",".join(f"http://127.0.0.1:{port}/" for port in ports.get(timeout=30)), countdown=0.0,
                                learn=EMPTY - 1.0, show="none")
        if faults.told:
            settings = replace(settings, delay=(0.0, faults.late, *[0.0] * (len(cameras) - 2)))
        with tempfile.TemporaryDirectory() as folder:
            calibration = Path(folder) / "calibration.toml"
            write_calibration(calibration, cameras)
            metrics = run_live(Path(folder) / "run", make_options({"calibration": calibration, "seed": 1}), settings, display=timer,
                               outlets=Outlets([receiver]))
    finally:
        cameraman.kill()
        cameraman.join()
    for said in sorted(timer.said - {""}):
        print(f"    {said}")
    return [np.nan] * 7 if metrics is None else figures(stage, receiver, truth, seconds, metrics["live"])


def figures(stage: Stage, receiver: Receiver, truth: JointTable, seconds: float, live: dict[str, Any]) -> list[float]:
    """Poses/s, median and 95 % of the joints' errors (mm), of the latency to the pose and of the age on arrival (ms)."""
    shared = [name for name in truth.names if name in receiver.names and not name.endswith("_hand") and name != "head"]
    nodes, reference = [receiver.names.index(name) for name in shared], truth.select(shared).positions
    errors, ages = [], []
    for came, frame in receiver.frames:
        if frame.positions is not None:
            at = stage.film_time(came - frame.age)
            right = reference[int(np.abs(truth.times - at).argmin())]
            errors.append(1000 * np.linalg.norm(frame.positions[nodes] - right, axis=1).mean())
            ages.append(1000 * frame.age)
    if not errors:
        return [np.nan] * 7
    late = live["latency_ms"]
    return [len(errors) / seconds, np.median(errors), np.percentile(errors, 95), late["median"], late["p95"], np.median(ages),
            np.percentile(ages, 95)]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recording", type=Path)
    parser.add_argument("--cameras", default="", help="some of them, with commas between; all if left out")
    parser.add_argument("--rate", type=float, default=15.0, help="pictures/s of the streams")
    parser.add_argument("--speed", type=float, default=1.0, help="of the films; rounded to whole frames between pictures")
    parser.add_argument("--seconds", type=float, default=12.0, help="how long a session tracks")
    parser.add_argument("--sessions", type=int, default=1, help="of which the table has the medians")
    parser.add_argument("--size", default="320x240", help="of the streams")
    parser.add_argument("--rows", default=",".join(ROWS), help="which of the table's rows")
    args = smallest.parse(parser, lambda folder: [smallest.make(folder / "ring", smallest.RING), "--rate", 10, "--seconds", 1, "--size",
                                                  "160x120", "--rows", "clean"])
    recording, (width, height) = read_recording(args.recording), map(int, args.size.split("x"))
    chosen = args.cameras.split(",") if args.cameras else [view.camera.name for view in recording.views]
    recording = replace(recording, views=tuple(view for view in recording.views if view.camera.name in chosen))
    stage, truth = Stage(recording, (width, height), args.rate, 0.0, args.speed), read_truth(args.recording / "truth.csv")
    stage.load()
    table = Table("streams", "poses/s", "error, mm", "95 %", "latency, ms", "95 %", "age, ms", "95 %")
    for name in args.rows.split(","):
        found = [session(stage, ROWS[name], args.seconds, truth) for _ in range(args.sessions)]
        table.add_row(name, *(f"{value:.0f}" if k else f"{value:.1f}" for k, value in enumerate(np.nanmedian(found, 0))))
    Console(width=120).print(table)


if __name__ == "__main__":
    main()
