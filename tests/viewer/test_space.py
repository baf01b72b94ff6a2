"""The body of a live session in space: what the page is sent, and the scene of a measured person."""

from __future__ import annotations

import base64
import http.client
import json
from dataclasses import replace

import cv2
import numpy as np
import people
import pytest

from shadowpuppet.geometry import inverse, rigid, rotation_about
from shadowpuppet.live.display.view import SessionState
from shadowpuppet.motion.limbs import LIMBS
from shadowpuppet.viewer.web.frustum_images import Undistorter
from shadowpuppet.viewer.web.live import WIDTH, SpaceDisplay

ROOM = np.full((120, 160, 3), 90, np.uint8)


@pytest.fixture
def page():
    with SpaceDisplay(port=0, footer="nothing is kept") as display:
        yield display


def tracked(picture, **more):
    pose = np.zeros(len(picture.body.skeleton.dofs))
    known = {"phase": "tracking", "status": "tracked", "image": ROOM, "mask": picture.mask(pose), "picture": picture,
             "pictures": (picture,), "pose": pose}
    return SessionState(**known | more)


def ask(page, path, **headers):
    connection = http.client.HTTPConnection("127.0.0.1", page.server.server_port, timeout=60)
    connection.request("GET", path, headers=headers)
    answer = connection.getresponse()
    return answer.status, answer.headers["Content-Type"], answer.read()


def unpacked(packed):
    return np.frombuffer(base64.b64decode(packed["data"]), f"<{packed['type']}")


def test_the_space_begins_when_the_person_is_measured(page):
    view = SessionState(phase="waiting", image=ROOM)
    page.show(view)
    assert "space" not in page.figures(view)
    assert [ask(page, path)[0] for path in ("/space.json", "/space.jpg", "/space.html")] == [404, 404, 404]
    view = tracked(people.picture("rounded"))
    page.show(view)
    told = page.figures(view)
    assert (told["space"], told["chip"], told["footer"]) == (1, "tracked", "nothing is kept")
    json.dumps(told, allow_nan=False)
    status, kind, body = ask(page, "/space.json")
    scene = json.loads(body)
    assert (status, kind, scene["number"], scene["film"]) == (200, "application/json", 1, True)
    assert [camera["name"] for camera in scene["cameras"]] == ["cam"]
    assert "mesh" in scene["figures"][0]
    status, kind, body = ask(page, "/space.js")
    assert (status, kind) == (200, "text/javascript; charset=utf-8")
    assert b"class Stage" in body
    assert not any(word in body for word in (b"http://", b"https://", b"@import"))


def test_the_body_stands_in_space_where_the_camera_sees_it(page, rng):
    camera = replace(people.camera(), T_camera_world=rigid(rotation_about([0, 1, 0], 0.7), [0.3, -0.2, 2.0]))
    picture = replace(people.picture("rounded", elevation=-0.3), camera=camera)
    poses = people.random_poses(rng, picture.body.skeleton, 3)
    scene = page._space_of(tracked(picture)).content(tracked(picture))
    names = [name.replace(" ", "_") for name in scene["figures"][0]["jointNames"]]
    for pose in poses:
        puppet = page.figures(tracked(picture, pose=pose))["puppet"]
        places = dict(zip(names, unpacked(puppet["named"]).reshape(-1, 3)))
        camera_to_world = inverse(picture.camera.T_camera_world)
        for name in ("left_wrist", "head"):
            seen = picture.T_camera_base @ np.append(picture.body.points(pose[None], names=[name])[0, 0], 1)
            assert places[name] == pytest.approx((camera_to_world @ seen)[:3], abs=1e-4)


def test_a_body_is_pale_where_its_view_is_and_gone_without_a_pose(page):
    picture = people.picture("rounded")
    for doubtful, limbs in ((), set()), (("left_elbow", "left_forearm"), {"left_arm"}), (("right_wrist",), {"right_arm"}):
        puppet = page.figures(tracked(picture, doubtful=frozenset(doubtful)))["puppet"]
        assert {LIMBS[k] for k in np.flatnonzero(unpacked(puppet["doubtful"]))} == limbs
    gone = page.figures(tracked(picture, pose=None, status="lost"))
    assert (gone["space"], gone["puppet"], gone["chip"]) == (1, None, "lost")


def test_a_person_who_is_measured_again_gets_a_new_scene(page):
    one, two = people.picture("rounded"), people.picture("rounded", distance=3.0)
    assert [page.figures(tracked(picture))["space"] for picture in (one, one, two, two)] == [1, 1, 2, 2]
    page.show(tracked(two))
    assert json.loads(ask(page, "/space.json")[2])["number"] == 2


def test_the_image_in_space_is_undistorted_with_the_outline_and_without_the_body(page):
    picture = people.picture("rounded", people.camera(lens="distorted"))
    lined = ROOM.copy()
    lined[:, ::20] = 255
    page.show(tracked(picture, image=np.repeat(np.repeat(lined, 2, 0), 2, 1)))
    status, kind, body = ask(page, "/space.jpg?1")
    image = cv2.imdecode(np.frombuffer(body, np.uint8), cv2.IMREAD_COLOR)
    assert (status, kind, image.shape) == (200, "image/jpeg", (120, 160, 3))
    straight, lens = (np.abs(image.astype(float) - shown).mean() for shown in (lined, Undistorter(picture.camera, WIDTH)(lined)))
    assert lens < 0.7 * straight
    blue, _, red = image.astype(int).transpose(2, 0, 1)
    assert (blue - red > 20).sum() > 50, "the outline"
    assert (red - blue > 20).sum() == 0, "no body"


def test_several_cameras_stand_in_space_without_images(page):
    cams = (people.camera(), people.camera(focal=1.2))
    pictures = tuple(people.picture("rounded", cam) for cam in cams)
    view = SessionState(phase="tracking", image=ROOM, pictures=pictures, pose=np.zeros(len(pictures[0].body.skeleton.dofs)))
    page.show(view)
    assert page.figures(view)["puppet"] is not None
    scene = json.loads(ask(page, "/space.json")[2])
    assert (len(scene["cameras"]), scene["film"]) == (2, False)


def test_the_space_is_for_this_machine_alone(page):
    page.show(tracked(people.picture("rounded")))
    for path in ("/space.js", "/space.json", "/space.jpg"):
        assert ask(page, path, Host="evil.example")[0] == 421
