"""The clients in examples/clients receive what outlets send, through real sockets; the ROS node with a stand-in for ROS."""

from __future__ import annotations

import contextlib
import re
import runpy
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
import runs
import stand_in_ros
from scipy.spatial.transform import Rotation

from shadowpuppet.live.stream.choice import open_outlets
from shadowpuppet.live.stream.outlet import Outlets, StreamSubject
from shadowpuppet.live.stream.settings import OutletSettings
from shadowpuppet.live.stream.websocket import WebSocketOutlet
from shadowpuppet.motion.limbs import LIMBS, limb_of
from shadowpuppet.motion.motion import MotionFrame

CLIENTS = Path(__file__).resolve().parents[2] / "examples" / "clients"
AGE = 0.02
"""Seconds from capture to sending."""


@pytest.fixture(scope="module")
def who():
    return StreamSubject(runs.body_of("anatomical"), np.eye(4), 1.78, 0.0)


@pytest.fixture(scope="module")
def frame(who):
    pose = runs.smooth_poses(who.body, 10, np.random.default_rng(2))[7]
    return MotionFrame(1.25, "tracked", pose, overlap=0.9)


@contextlib.contextmanager
def sending(outlets: Outlets, who: StreamSubject, frame: MotionFrame):
    """A person is tracked within the block."""
    over = threading.Event()

    def send():
        while not over.wait(0.01):
            outlets.follow(frame, AGE)
            outlets.follow(MotionFrame(1.5, "lost"), AGE)

    with outlets:
        outlets.begin(who)
        thread = threading.Thread(target=send)
        thread.start()
        try:
            yield
        finally:
            over.set()
            thread.join()


def free_port(kind: int) -> int:
    with socket.socket(type=kind) as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]


def first_place(client: str, *args: object) -> tuple[np.ndarray, float]:
    """The first place (3,), metres, that a client prints, and its age (ms)."""
    words = re.compile(r" at (-?[\d.]+) (-?[\d.]+) (-?[\d.]+) m, (-?\d+) ms old")
    with subprocess.Popen([sys.executable, CLIENTS / client, *map(str, args)], stdout=subprocess.PIPE, text=True) as child:
        limit = threading.Timer(60, child.kill)
        limit.start()
        assert child.stdout is not None
        try:
            found = next(filter(None, map(words.search, child.stdout)))
        finally:
            limit.cancel()
            child.kill()
    return np.array(found.groups()[:3], float), float(found[4])


def hand(who, frame, side="left"):
    return who.stream_frame(frame).positions[who.names.index(f"{side}_hand")]


def test_the_websocket_client_tells_where_a_hand_is(who, frame):
    outlet = WebSocketOutlet("127.0.0.1", 0)
    with sending(Outlets([outlet]), who, frame):
        place, age = first_place("websocket_client.py", "--address", f"ws://127.0.0.1:{outlet.port}", "--joint", "left_hand")
    np.testing.assert_allclose(place, hand(who, frame), atol=1e-3)
    assert age == 1000 * AGE


@pytest.mark.parametrize("side", ["left", "right"])
def test_the_osc_client_puts_the_bones_together(who, frame, side):
    port = free_port(socket.SOCK_DGRAM)
    wrist = who.stream_frame(frame).positions[who.names.index(f"{side}_wrist")]
    with sending(open_outlets(OutletSettings(osc=str(port))), who, frame):
        place, age = first_place("osc_client.py", "--port", port, "--side", side)
    np.testing.assert_allclose(place, [-wrist[1], wrist[2], wrist[0]], atol=1e-3)  # a hand begins at the wrist
    assert age == 1000 * AGE


@pytest.mark.filterwarnings("ignore:the lab streaming layer listens")
def test_the_lsl_client_tells_where_a_hand_is_and_how_old_that_is(who, frame):
    try:
        import pylsl  # noqa: F401
    except (ImportError, OSError, RuntimeError) as error:
        pytest.skip(f"no pylsl, or no liblsl for it: {error}")
    name = f"puppet-{time.time_ns()}"
    with sending(open_outlets(OutletSettings(lsl=name)), who, frame):
        place, age = first_place("lsl_client.py", "--stream", name, "--joint", "left_hand")
    np.testing.assert_allclose(place, hand(who, frame), atol=1e-3)
    assert age >= 1000 * AGE - 5  # this clock's, and the time to get here


def test_the_ros_node_publishes_transforms_angles_and_a_stick_figure(who, frame, monkeypatch):
    """The joints of an arm that is not vouched for have no transform, and another colour."""
    frame = frame._replace(limb_status=["uncertain" if limb == "left_arm" else "tracked" for limb in LIMBS])
    doubted = np.array([limb_of(name) == "left_arm" for name in who.names])
    for name, module in stand_in_ros.modules().items():
        monkeypatch.setitem(sys.modules, name, module)
    outlet = WebSocketOutlet("127.0.0.1", 0)
    monkeypatch.setattr(stand_in_ros, "PARAMETERS", {"address": f"ws://127.0.0.1:{outlet.port}", "frame": "lab"})
    node = threading.Thread(target=runpy.run_path, args=[str(CLIENTS / "ros2_node.py")], kwargs={"run_name": "__main__"})
    published = stand_in_ros.Node.published
    published.clear()
    with sending(Outlets([outlet]), who, frame):
        node.start()
        end = time.monotonic() + 60
        while not (published.get("person/joint_states") and len(published.get("person/markers", [])) > 4) and time.monotonic() < end:
            time.sleep(0.01)
    node.join(60)
    assert not node.is_alive()
    told = who.stream_frame(frame)
    transforms = published["/tf"][: (~doubted).sum()]
    assert [each.child_frame_id for each in transforms] == [f"person/{name}" for name, doubt in zip(who.names, doubted) if not doubt]
    assert {each.header.frame_id for each in transforms} == {"lab"}
    assert {each.header.stamp.sec + 1e-9 * each.header.stamp.nanosec for each in transforms} == {stand_in_ros.NOW - AGE}
    turns = Rotation.from_quat([[each.transform.rotation.values[axis] for axis in "xyzw"] for each in transforms])
    places = [[each.transform.translation.values[axis] for axis in "xyz"] for each in transforms]
    np.testing.assert_allclose(places, told.positions[~doubted], atol=1e-4)
    np.testing.assert_allclose(turns.as_matrix(), told.rotations[~doubted], atol=1e-4)
    angles = published["person/joint_states"][0]
    assert angles.name == list(who.body.skeleton.dof_names)
    np.testing.assert_allclose(angles.position, told.pose, atol=1e-4)
    figures = [each.markers[0] for each in published["person/markers"]]
    assert {(each.action, len(each.points)) for each in figures} == {(0, 2 * sum(parent >= 0 for parent in who.parents)), (3, 0)}
    drawn = next(each for each in figures if each.points)
    assert (drawn.type, drawn.header.frame_id, drawn.lifetime.nanosec) == (5, "lab", 500_000_000)
    ends = np.array([[point.x, point.y, point.z] for point in drawn.points[:2]])
    np.testing.assert_allclose(ends, told.positions[[who.parents[1], 1]], atol=1e-4)
    pale = [colour.a < 1 for colour in drawn.colors]
    assert pale == [doubted[n] for n, parent in enumerate(who.parents) if parent >= 0 for _ in "ab"]
