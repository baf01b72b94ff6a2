"""Motion given to other programs: heard by libraries that are not ours, through real sockets."""

from __future__ import annotations

import contextlib
import json
import os
import re
import signal
import socket
import sys
import threading
import time
import types
from pathlib import Path

import fastjsonschema
import numpy as np
import pytest
import runs
from hypothesis import given, settings
from hypothesis import strategies as st
from listeners import OscEar, composed, osc_messages
from pythonosc.osc_message_builder import build_msg
from waiting import until
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from shadowpuppet import network
from shadowpuppet.cli import app as cli
from shadowpuppet.errors import SettingsError, ShadowPuppetWarning
from shadowpuppet.geometry import inverse, transform
from shadowpuppet.io.run import read_run
from shadowpuppet.live.display.view import LiveListener
from shadowpuppet.live.play import play_run
from shadowpuppet.live.stream import websocket
from shadowpuppet.live.stream.avatar import Avatar
from shadowpuppet.live.stream.choice import open_outlets
from shadowpuppet.live.stream.json_messages import beginning, framed
from shadowpuppet.live.stream.outlet import Outlet, Outlets, StreamSubject
from shadowpuppet.live.stream.settings import OutletSettings
from shadowpuppet.live.stream.vmc import VmcOutlet, bundles, messages
from shadowpuppet.live.stream.websocket import WebSocketOutlet
from shadowpuppet.motion.motion import MotionFrame

JOINTS = {"Hips": "pelvis", "Neck": "neck", "Head": "head"}
for _Side, _side in (("Left", "left"), ("Right", "right")):
    JOINTS |= {f"{_Side}{bone}": f"{_side}_{joint}" for bone, joint in (
        ("UpperArm", "shoulder"), ("LowerArm", "elbow"), ("Hand", "wrist"), ("UpperLeg", "hip"), ("LowerLeg", "knee"), ("Foot", "ankle"))}


def subject(name: str = "rounded") -> StreamSubject:
    body = runs.body_of(name)
    return StreamSubject(body, runs.root_of(body), 1.78, 0.0 if body.limbs is not None else None)


def posed(who: StreamSubject, **angles):
    return who.stream_frame(MotionFrame(1.25, "tracked", who.body.skeleton.pose(**angles), overlap=0.9))


def heard(who: StreamSubject, told):
    return osc_messages(bundle.dgram for bundle in bundles(messages(Avatar(who), told)))


def bones(who: StreamSubject, told) -> dict[str, list[float]]:
    return {params[0]: params[1:] for address, params in heard(who, told) if address == "/VMC/Ext/Bone/Pos"}


# Frames


@pytest.mark.parametrize("name", runs.BODIES)
def test_places_are_those_that_a_run_has(name, rng):
    who = subject(name)
    poses = runs.smooth_poses(who.body, 5, rng)
    names = [landmark for landmark in who.names if landmark in who.body.landmark_names]
    wanted = who.body.points(poses, who.T_world_base, names)
    for pose, places in zip(poses, wanted):
        told = who.stream_frame(MotionFrame(0.0, "tracked", pose))
        np.testing.assert_allclose(told.positions[[who.names.index(n) for n in names]], places, atol=1e-12)
        R = told.rotations
        np.testing.assert_allclose(R @ np.swapaxes(R, 1, 2), np.broadcast_to(np.eye(3), R.shape), atol=1e-12)


@pytest.mark.parametrize(("status", "pose"), [("lost", np.zeros(12)), ("absent", None), ("tracked", None),
                                              ("tracked", np.full(12, np.nan))])
def test_a_frame_without_a_pose_tells_none(status, pose):
    told = subject().stream_frame(MotionFrame(0.5, status, pose))
    assert (told.time, told.status, told.pose, told.positions, told.rotations) == (0.5, status, None, None, None)


def test_every_joint_has_the_status_of_its_limb_or_of_the_frame():
    who, whole = subject("anatomical"), posed(subject("anatomical"))
    assert set(whole.statuses) == {"tracked"}
    statuses = ("tracked", "uncertain", "tracked", "predicted", "tracked")
    found = dict(zip(who.names, who.stream_frame(MotionFrame(0.5, "tracked", whole.pose, limb_status=statuses)).statuses))
    assert [found[name] for name in ("pelvis", "left_wrist", "right_wrist", "left_toe", "right_toe")] == list(statuses)


# OSC


def test_a_message_is_the_bytes_of_the_specification():
    (bundle,) = bundles([build_msg("/abc", ("Hips", 1, 0.5))])
    assert bundle.dgram == (b"#bundle\0" b"\0\0\0\0\0\0\0\1" b"\0\0\0\x20" b"/abc\0\0\0\0" b",sif\0\0\0\0"
                            b"Hips\0\0\0\0" b"\0\0\0\1" b"\x3f\0\0\0")  # fmt: skip


@given(st.integers(0, 60), st.integers(100, 1400))
def test_bundles_hold_every_message_once_in_order_and_are_no_longer_than_asked(number, largest):
    sent = [build_msg("/a", (n, "bone", 0.5)) for n in range(number)]
    data = [bundle.dgram for bundle in bundles(sent, largest)]
    assert osc_messages(data) == [("/a", [n, "bone", 0.5]) for n in range(number)]
    assert all(len(each) <= largest for each in data)
    assert sum(map(len, data)) == 16 * len(data) + sum(4 + message.size for message in sent)
    assert all(len(one) + 4 + sent[0].size > largest for one in data[:-1])  # as few as possible


# The avatar


@pytest.mark.parametrize("name", runs.BODIES)
def test_bones_put_together_as_unity_does_land_where_the_joints_are(name, rng):
    """Right, up, forward: of a person whom several cameras see in the world, of one before a camera in the frame that they stand in."""
    who = subject(name)
    for pose in runs.smooth_poses(who.body, 6, rng):
        told = who.stream_frame(MotionFrame(0.0, "tracked", pose))
        places = told.positions
        if who.floor is None:
            places = transform(inverse(who.T_world_base), places) + np.array([0, 0, who.pelvis_height])
        found = composed(heard(who, told))
        assert len(found) == (9 if who.body.limbs is None else 15) + ("chest" in who.names or "torso" in who.names)
        for bone, place in found.items():
            if bone != "Spine":
                x, y, z = places[who.names.index(JOINTS[bone])]
                np.testing.assert_allclose(place, [-y, z, x], atol=2e-6, err_msg=bone)


@pytest.mark.parametrize(("name", "angles"), [
    ("rounded", {"left_shoulder_abduction": np.pi / 2, "right_shoulder_abduction": np.pi / 2}),
    ("anatomical", {"left_shoulder_x": np.pi / 2, "right_shoulder_x": -np.pi / 2}),
    ("cylinders", {"left_shoulder_abduction": np.pi / 2, "right_shoulder_abduction": np.pi / 2}),
])  # fmt: skip
def test_who_stands_in_a_t_has_no_rotation_at_all(name, angles):
    for bone, (*_, x, y, z, w) in bones(who := subject(name), posed(who, **angles)).items():
        assert [x, y, z, w] == pytest.approx([0, 0, 0, 1], abs=1e-6), bone


def test_left_is_left_and_forward_is_forward():
    who = subject("anatomical")
    hanging = composed(heard(who, posed(who, root_z=0.95)))
    raised = composed(heard(who, posed(who, root_z=0.95, left_shoulder_y=-np.pi / 2)))
    assert hanging["LeftHand"][0] < -0.1 < 0.1 < hanging["RightHand"][0]  # who looks along Z has their left hand at -X
    assert raised["LeftHand"][2] > hanging["LeftHand"][2] + 0.4
    assert raised["LeftHand"][1] > hanging["LeftHand"][1] + 0.4
    assert raised["RightHand"] == pytest.approx(hanging["RightHand"])
    assert hanging["LeftFoot"][1] < hanging["Hips"][1] < hanging["Head"][1]


def test_who_stands_before_one_camera_looks_along_z_with_feet_on_the_floor():
    who = subject("rounded")
    found = composed(heard(who, posed(who, torso_y=0.2)))
    assert found["Hips"] == pytest.approx([-0.2, who.pelvis_height, 0], abs=1e-6)  # a step to their left
    assert 0.8 < who.pelvis_height < 1.05
    assert found["LeftUpperArm"][2] == pytest.approx(0, abs=0.02)


@pytest.mark.parametrize("roll", [-1.0, 0.0, 1.2])
def test_an_elbow_only_bends_and_the_upper_arm_has_the_turn(roll):
    turns = bones(who := subject("rounded"), posed(who, left_shoulder_abduction=0.7, left_elbow_roll=roll, left_elbow_flexion=1.1))
    x, y, z, w = turns["LeftLowerArm"][3:]
    assert (x, z) == pytest.approx((0, 0), abs=1e-6)
    assert abs(2 * np.arctan2(y, w)) == pytest.approx(1.1, abs=1e-5)


def test_a_frame_ends_with_ok_and_its_time_and_is_lost_without_bones():
    who = subject()
    told = heard(who, posed(who))
    assert told[0] == ("/VMC/Ext/Root/Pos", ["root", 0, 0, 0, 0, 0, 0, 1])
    assert told[-2:] == [("/VMC/Ext/OK", [1, 3, 0, 1]), ("/VMC/Ext/T", [1.25])]
    assert heard(who, posed(who)._replace(age=0.25))[-3] == ("/shadowpuppet/age", [0.25])
    assert heard(who, who.stream_frame(MotionFrame(2.0, "lost"))) == [("/VMC/Ext/OK", [1, 3, 0, 0]), ("/VMC/Ext/T", [2.0])]


def test_datagrams_come_and_what_cannot_be_sent_is_counted_and_said_once():
    who = subject()
    with OscEar() as ear, VmcOutlet("127.0.0.1", ear.port) as outlet:
        outlet.send(posed(who))  # before anybody was measured
        outlet.begin(who)
        outlet.send(posed(who))
        assert [address for address, _ in ear.heard()].count("/VMC/Ext/Bone/Pos") == 10
        assert outlet.counts() == {"sent": 1, "failed": 0}
        assert outlet.trouble() == ""
    with VmcOutlet("255.255.255.255", 9) as outlet:  # a broadcast, which a socket may not send unless it says so
        outlet.begin(who)
        for _ in range(3):
            outlet.send(posed(who))
        assert outlet.counts() == {"sent": 0, "failed": 3}
        assert [bool(outlet.trouble()) for _ in range(3)] == [True, False, False]


def test_nobody_listening_is_no_trouble():
    with OscEar() as ear:
        port = ear.port
    who = subject()
    with VmcOutlet("127.0.0.1", port) as outlet:
        outlet.begin(who)
        for _ in range(5):
            outlet.send(posed(who))
            time.sleep(0.01)
        assert (outlet.counts(), outlet.trouble()) == ({"sent": 5, "failed": 0}, "")


def test_an_address_of_version_six_is_sent_to():
    who = subject()
    with socket.socket(socket.AF_INET6, socket.SOCK_DGRAM) as ear:
        try:
            ear.bind(("::1", 0))
        except OSError:
            pytest.skip("no IPv6 here")
        with VmcOutlet("::1", ear.getsockname()[1]) as outlet:
            assert outlet.loopback
            outlet.begin(who)
            outlet.send(posed(who))
            ear.settimeout(60)
            assert ear.recv(65536).startswith(b"#bundle\0")


# JSON


def schema() -> dict:
    text = (Path(__file__).parents[2] / "docs" / "live.md").read_text("utf-8")
    return json.loads(re.findall(r"```json\n(\{\n *\"\$schema\".*?)```", text, re.DOTALL)[0])


@pytest.mark.parametrize("name", ["rounded", "anatomical", "cylinders"])
def test_messages_are_as_the_manual_says(name):
    check, who = fastjsonschema.compile(schema()), subject(name)
    begin, frame = json.loads(beginning(who)), json.loads(framed(posed(who)))
    for message in (begin, frame, json.loads(framed(who.stream_frame(MotionFrame(0.1, "absent"))))):
        check(message)
    for spoilt in (begin | {"type": "frame"}, frame | {"joints": [[1, 2]]}, {**frame, "status": "well"}, frame | {"statuses": ["well"]},
                   begin | {"units": {}}):  # fmt: skip
        with pytest.raises(fastjsonschema.JsonSchemaValueException):
            check(spoilt)
    joints = begin["joints"]
    assert len(joints) == len(begin["parents"]) == len(frame["joints"]) == len(frame["rotations"])
    assert len(begin["angles"]) == len(frame["angles"])
    assert len(joints) == len(frame["statuses"])
    assert all(parent < n for n, parent in enumerate(begin["parents"]))


def test_rotations_carry_the_joints_below_them(rng):
    """From the axes of who stands at zero: the place of a joint follows from its parent's rotation and place at zero."""
    from scipy.spatial.transform import Rotation

    who = subject("anatomical")
    zero, pose = who.stream_frame(MotionFrame(0, "tracked", np.zeros(32))), runs.smooth_poses(who.body, 3, rng)[2]
    message = json.loads(framed(who.stream_frame(MotionFrame(0, "tracked", pose))))
    places, turns = np.array(message["joints"]), Rotation.from_quat(message["rotations"]).as_matrix()
    for n, parent in enumerate(who.parents):
        if parent >= 0:
            offset = zero.positions[n] - zero.positions[parent]
            np.testing.assert_allclose(places[parent] + turns[parent] @ offset, places[n], atol=3e-5)


# The WebSocket


@contextlib.contextmanager
def served(*origins):
    with WebSocketOutlet("127.0.0.1", 0, origins) as outlet:
        yield outlet, f"ws://127.0.0.1:{outlet.port}/"


def test_a_program_gets_the_beginning_and_then_frames_and_is_reported_goodbye():
    who = subject()
    with served() as (outlet, url), connect(url) as early:
        outlet.begin(who)
        outlet.send(posed(who))
        assert [json.loads(early.recv(60))["type"] for _ in range(2)] == ["begin", "frame"]
        with connect(url) as late:
            assert [json.loads(late.recv(60))["type"] for _ in range(2)] == ["begin", "frame"]  # what was newest when it came
            outlet.send(who.stream_frame(MotionFrame(2.5, "lost")))
            for each in (early, late):
                message = json.loads(each.recv(60))
                assert (message["time"], message["status"], message["joints"]) == (2.5, "lost", None)
        outlet.begin(subject("anatomical"))
        assert json.loads(early.recv(60))["body"] == "anatomical"
        outlet.__exit__()
        with pytest.raises(ConnectionClosed) as closed:
            early.recv(60)
        assert closed.value.rcvd is not None
        assert (closed.value.rcvd.code, closed.value.rcvd.reason) == (1001, "the session is over")
        assert outlet.counts() == {"served": 2, "refused": 0}


@pytest.mark.parametrize(("origins", "origin", "good"), [
    ((), None, True), ((), "http://localhost:3000", False), ((), "http://127.0.0.1:8600", False), ((), "http://[::1]:8600", False),
    (("http://localhost:3000",), "http://localhost:3000", True), (("http://localhost:3000",), "http://localhost:3001", False),
    ((), "https://evil.example", False), ((), "null", False), ((), "http://localhost.evil.example", False),
    ((), "http://127.0.0.1.evil.example", False), ((), "file://", False), ((), "", False),
    (("https://good.example",), "https://good.example", True), (("https://good.example",), "https://evil.example", False),
    (("https://good.example",), "http://good.example", False), (("*",), "https://evil.example", True),
])  # fmt: skip
def test_pages_of_other_sites_may_not_listen(origins, origin, good):
    with served(*origins) as (outlet, url):
        outlet.begin(subject())
        headers = {} if origin is None else {"Origin": origin}
        if good:
            with connect(url, additional_headers=headers) as connection:
                assert json.loads(connection.recv(60))["type"] == "begin"
        else:
            with pytest.raises(InvalidStatus) as refused:
                connect(url, additional_headers=headers)
            assert refused.value.response.status_code == 403
            assert b"pages may not listen unless" in refused.value.response.body
            assert outlet.counts() == {"served": 0, "refused": 1}


@pytest.mark.parametrize("hosts", [["evil.example"], ["127.0.0.1", "evil.example"], ["127.0.0.1", "127.0.0.1"]])
def test_a_name_that_another_site_turned_to_this_machine_and_two_hosts_are_refused(hosts):
    named = "".join(f"Host: {host}\r\n" for host in hosts)
    with served() as (outlet, _):
        with socket.create_connection(("127.0.0.1", outlet.port)) as raw:
            raw.sendall(f"GET / HTTP/1.1\r\n{named}Upgrade: websocket\r\nConnection: Upgrade\r\n"
                        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n".encode())
            raw.settimeout(60)
            assert raw.recv(100).startswith(b"HTTP/1.1 403")
        assert outlet.counts()["refused"] == 1


def test_who_is_slow_gets_the_newest_frame_and_holds_nobody_up(monkeypatch):
    monkeypatch.setattr(websocket, "SEND_SECONDS", 600)
    who = subject("anatomical")
    told = posed(who)
    with served() as (outlet, url), raw_listener(outlet.port) as slow, connect(url) as quick:
        outlet.begin(who)
        seen = []
        reader = threading.Thread(target=lambda: seen.extend(json.loads(text).get("time") for text in quick), daemon=True)
        reader.start()
        number, end = 0, time.monotonic() + 60
        while number < 1500 or len(seen) <= 40:  # the quick one reads on while the slow one does not
            assert time.monotonic() < end, "a client that reads is held up by one that does not"
            number += 1
            outlet.send(told._replace(time=float(number)))
            time.sleep(0.0005)
        received = drained(slow, lambda text: f'"time":{number}.0' in text)
        times = [float(found) for found in re.findall(r'"type":"frame","time":([0-9.]+)', received)]
        assert times[-1] == number  # the newest came, and at once after what had been on its way
        assert times == sorted(times)
        assert len(times) < number / 2


def test_who_reads_nothing_makes_room(monkeypatch):
    monkeypatch.setattr(websocket, "SEND_SECONDS", 0.2)
    monkeypatch.setattr(network, "MAX_OF_ADDRESS", 1)
    who, end = subject("anatomical"), time.monotonic() + 20
    with served() as (outlet, url), raw_listener(outlet.port):
        with pytest.raises(InvalidStatus):
            connect(url)
        outlet.begin(who)
        while len(outlet._clients):
            outlet.send(posed(who)._replace(time=time.monotonic()))
            assert time.monotonic() < end, "a client that reads nothing is still counted"
            time.sleep(0.0005)
        with connect(url) as connection:
            assert json.loads(connection.recv(5))["type"] == "begin"


def test_who_hangs_does_not_hold_up_the_end():
    who = subject("anatomical")
    outlet = WebSocketOutlet("127.0.0.1", 0)
    with outlet, raw_listener(outlet.port):
        outlet.begin(who)
        for n in range(400):
            outlet.send(posed(who)._replace(time=float(n)))
            time.sleep(0.0005)
        outlet.__exit__()
        assert not outlet._thread.is_alive()


@contextlib.contextmanager
def raw_listener(port: int):
    """Connected, with little room, and does not read."""
    with socket.socket() as raw:
        raw.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 32768)
        raw.connect(("127.0.0.1", port))
        raw.sendall(f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n".encode())
        raw.settimeout(60)
        assert b"101" in raw.recv(20)
        yield raw


def drained(raw: socket.socket, until) -> str:
    text = ""
    while not until(text[-20000:]):
        text += raw.recv(65536).decode("utf-8", "replace")
    return text


@pytest.mark.parametrize("rubbish", [b"\x00" * 100, b"GET / HTTP/1.1\r\n\r\n", b"x" * 20000, b""])
def test_rubbish_from_elsewhere_is_no_trouble(rubbish):
    who = subject()
    with served() as (outlet, url):
        with socket.create_connection(("127.0.0.1", outlet.port)) as raw, contextlib.suppress(OSError):
            raw.sendall(rubbish)
        with connect(url) as connection:
            connection.send("x" * 5000)  # longer than anything that anybody need say
            with pytest.raises(ConnectionClosed):
                connection.recv(60)
        with connect(url) as connection:
            outlet.begin(who)
            assert json.loads(connection.recv(60))["type"] == "begin"


def test_no_more_than_so_many_listen_and_who_leaves_makes_room(monkeypatch):
    monkeypatch.setattr(network, "MAX_CONNECTIONS", 2)
    with served() as (outlet, url), connect(url):
        with connect(url), pytest.raises(InvalidStatus):
            connect(url)
        end = time.monotonic() + 60
        while len(outlet._clients) > 1:
            assert time.monotonic() < end, "a client that left is still counted"
            time.sleep(0.01)
        with connect(url):
            until(lambda: outlet.counts() == {"served": 3, "refused": 1})


# LSL


def test_the_lab_streaming_layer_carries_places_and_rotations(monkeypatch):
    try:
        import pylsl
    except (ImportError, OSError, RuntimeError) as error:
        pytest.skip(f"no pylsl, or no liblsl for it: {error}")
    who, name = subject(), f"puppet-{time.time_ns()}"
    with pytest.warns(ShadowPuppetWarning, match="who knows its port can have the person's joints"):
        outlets = open_outlets(OutletSettings(lsl=name))
    with outlets:
        outlets.begin(who)
        found = pylsl.resolve_byprop("name", name, timeout=60)
        inlet = pylsl.StreamInlet(found[0])
        inlet.open_stream(timeout=60)
        told, now = posed(who, torso_bow=0.3)._replace(age=0.25), pylsl.local_clock()
        outlets.send(told)
        outlets.send(who.stream_frame(MotionFrame(2.0, "lost")))
        samples = [inlet.pull_sample(timeout=60) for _ in range(2)]
        channels, channel = [], inlet.info().desc().child("channels").child("channel")
        while not channel.empty():
            channels.append([channel.child_value(key) for key in ("label", "type", "unit")])
            channel = channel.next_sibling()
        inlet.close_stream()
    assert [row[0] for row in channels[:7]] == [f"pelvis_{kind}" for kind in (
        "PositionX", "PositionY", "PositionZ", "OrientationX", "OrientationY", "OrientationZ", "OrientationW")]
    assert len(channels) == 7 * len(who.names)
    values = np.array(samples[0][0]).reshape(-1, 7)
    np.testing.assert_allclose(values[:, :3], told.positions, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(values[:, 3:], axis=1), 1, atol=1e-6)
    assert samples[0][1] == pytest.approx(now - 0.25, abs=0.2)
    assert np.isnan(samples[1][0]).all()
    assert outlets.counts() == {"lsl": {"sent": 2}}


class FakeStream:
    """What a stream of pylsl keeps, where there is no liblsl."""

    made: list = []  # noqa: RUF012

    def __init__(self, info, **_):
        self.info, self.samples = info, []
        FakeStream.made.append(self)

    def push_sample(self, sample, stamp):
        self.samples.append((sample, stamp))


class FakeInfo:
    def __init__(self, *told):
        self.told = told

    def desc(self):
        return self

    def append_child(self, _):
        return self

    def append_child_value(self, *_):
        return self


def test_a_stream_is_made_again_only_for_other_joints(monkeypatch):
    FakeStream.made.clear()
    fake = types.SimpleNamespace(StreamInfo=FakeInfo, StreamOutlet=FakeStream, IRREGULAR_RATE=0.0, local_clock=lambda: 50.0)
    monkeypatch.setitem(sys.modules, "pylsl", fake)
    with pytest.warns(ShadowPuppetWarning, match="to everybody in it"):
        outlets = open_outlets(OutletSettings(lsl="puppet", lsl_scope="link"))
    with outlets:
        outlets.send(posed(subject()))  # before anybody was measured
        for who in (subject(), subject(), subject("anatomical")):
            outlets.begin(who)
            outlets.send(posed(who)._replace(age=0.5))
    assert [len(stream.samples) for stream in FakeStream.made] == [2, 1]
    assert [stream.info.told[2] for stream in FakeStream.made] == [7 * 12, 7 * 22]
    assert FakeStream.made[0].samples[0][1] == 49.5
    assert outlets.trouble() == ""


# What is asked for


@pytest.mark.parametrize(("asked", "said"), [
    ({"osc": "nowhere.invalid:39539"}, "osc: found the host 'nowhere.invalid', which is not known"),
    ({"osc": "39539x"}, "osc: found '39539x', expected a port, or host:port"),
    ({"osc": "::1"}, "expected a port, or host:port"), ({"osc": ":39539"}, "expected a port, or host:port"),
    ({"osc": "70000"}, "osc: found '70000'"), ({"osc": "0"}, "osc: found port 0"), ({"osc": ""}, "osc: found ''"),
    ({"websocket": "192.0.2.1:8601"}, "websocket: 192.0.2.1:8601: cannot be listened at"),
    ({"websocket": "localhost"}, "websocket: found 'localhost'"),
])  # fmt: skip
def test_what_cannot_be_is_said(asked, said):
    with pytest.raises(SettingsError) as error:
        open_outlets(OutletSettings(**asked))
    assert said in str(error.value)


@pytest.mark.parametrize(("name", "asked"), [("websockets", {"websocket": "0"}), ("pylsl", {"lsl": "puppet"})])
def test_a_library_that_is_missing_is_said(name, asked, monkeypatch):
    for module in [m for m in sys.modules if m == name or m.startswith(name + ".")]:
        monkeypatch.delitem(sys.modules, module)
    monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(SettingsError, match=r"pip install 'shadowpuppet\[l(ive|sl)\]'"):
        open_outlets(OutletSettings(**asked))


@pytest.mark.parametrize(("asked", "said"), [({"osc": "192.0.2.7:39539"}, r"sent to 192\.0\.2\.7, unencrypted"),
                                             ({"websocket": "0.0.0.0:0"}, r"served at 0\.0\.0\.0: everybody")])
def test_what_leaves_this_machine_is_said(asked, said):
    with pytest.warns(ShadowPuppetWarning, match=said):
        outlets = open_outlets(OutletSettings(**asked))
    with outlets:
        pass


def test_nothing_is_given_to_anybody_by_default():
    outlets = open_outlets(OutletSettings())
    outlets.begin(subject())
    outlets.follow(MotionFrame(0, "absent"))
    assert (outlets.where, outlets.counts(), outlets.trouble()) == ("", {}, "")


def test_one_that_fails_is_given_up_and_the_others_go_on():
    class Bad(Outlet):
        name, asked = "bad", 0

        def send(self, frame):
            Bad.asked += 1
            raise ValueError("a mistake")

    who = subject()
    with OscEar() as ear, Outlets([Bad(), VmcOutlet("127.0.0.1", ear.port)]) as outlets:
        outlets.begin(who)
        for _ in range(3):
            outlets.follow(MotionFrame(0.0, "tracked", np.zeros(12)))
        assert outlets.trouble() == "bad: ValueError: a mistake; nothing more is given to it"
        assert outlets.trouble() == ""
        assert Bad.asked == 1
        assert outlets.counts() == {"osc": {"sent": 3, "failed": 0}}


# A run played


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return runs.make_run(tmp_path_factory.mktemp("played") / "run", "anatomical", frames=20, lost=(3, 4))


def test_a_run_is_played_at_its_own_pace_to_all(run):
    now, naps = [100.0], []

    def sleep(seconds):
        naps.append(seconds)
        now[0] += seconds

    with OscEar() as ear:
        outlets = Outlets([VmcOutlet("127.0.0.1", ear.port)])
        assert play_run(run, outlets, speed=2.0, clock=lambda: now[0], sleep=sleep) == 20
        told = ear.heard()
    times = [params[0] for address, params in told if address == "/VMC/Ext/T"]
    np.testing.assert_allclose(times, np.arange(20) / runs.RATE, atol=1e-6)
    assert now[0] - 100 == pytest.approx(19 / runs.RATE / 2)
    assert max(naps) <= 0.05
    assert [params[3] for address, params in told if address == "/VMC/Ext/OK"] == [int(n not in (3, 4)) for n in range(20)]
    cut = [n for n, (address, _) in enumerate(told) if address == "/VMC/Ext/T"]
    motion, last = read_run(run).motion, composed(told[cut[-2] + 1 :])
    x, y, z = motion.joints[-1, motion.joint_names.index("left_wrist")]
    np.testing.assert_allclose(last["LeftHand"], [-y, z, x], atol=1e-5)  # in the world, whose floor is at zero


def test_the_command_plays_a_run_until_its_end(run, capsys):
    with OscEar() as ear:
        assert cli.run(["play", str(run), "--osc", str(ear.port), "--speed", "20"]) == 0
        assert [address for address, _ in ear.heard()].count("/VMC/Ext/T") == 20
        assert f"OSC (VMC) to 127.0.0.1:{ear.port}" in capsys.readouterr().err
        assert cli.run(["play", str(run), "--osc", str(ear.port), "--speed", "20", "--quiet"]) == 0
        assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize(("more", "said"), [
    ([], "expected one of --osc, --websocket and --lsl"), (["--osc", "5", "--speed", "0"], "speed: found 0.0"),
    (["--osc", "5", "--speed", "nan"], "speed: found nan"), (["--lsl-scope", "moon", "--lsl", "x"], "moon"),
])  # fmt: skip
def test_what_play_cannot_do_is_said(run, more, said, capsys):
    assert cli.run(["play", str(run), *more]) == 2
    assert said in capsys.readouterr().err


def test_a_run_without_sizes_is_refused(tmp_path, capsys):
    folder = runs.make_run(tmp_path / "run", "rounded", frames=3, person=False)
    assert cli.run(["play", str(folder), "--osc", "5"]) == 2
    assert "person.toml: found no such file, expected the person's sizes, which rotations of joints need" in capsys.readouterr().err


@pytest.fixture
def heeding():
    """Ctrl-C is heeded, as it is not where the tests were begun in the background."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_a_loop_goes_on_with_later_times(run, heeding):
    class Listener(LiveListener):
        given = 0

        def advance(self, frames):
            self.given = frames
            if frames == 45:
                os.kill(os.getpid(), signal.SIGINT)
            assert frames < 100

    with OscEar() as ear:
        heard_by = Listener()
        play_run(run, Outlets([VmcOutlet("127.0.0.1", ear.port)]), heard_by, speed=100.0, loop=True)
        times = np.array([params[0] for address, params in ear.heard() if address == "/VMC/Ext/T"])
    assert heard_by.given == 45
    assert (np.diff(times) > 0).all()


# While it is tracked: in test_live_run.py


@settings(max_examples=20)
@given(st.floats(allow_nan=True), st.floats(allow_nan=True))
def test_frames_are_json_whatever_is_not_known(overlap, age):
    who = subject()
    json.loads(framed(posed(who)._replace(overlap=overlap, age=age)), parse_constant=pytest.fail)
