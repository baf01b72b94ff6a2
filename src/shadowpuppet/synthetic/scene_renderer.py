"""Frames of one camera of a recording: the person, bystanders, obstacles and the room."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.geometry import Array
from shadowpuppet.synthetic.compositing import Layer, composite, composite_people, visible
from shadowpuppet.synthetic.faults.camera_faults import CameraFaults
from shadowpuppet.synthetic.person.clothes import Clothes
from shadowpuppet.synthetic.person.head import head
from shadowpuppet.synthetic.person.kinematics import PosedBody
from shadowpuppet.synthetic.person.limbs import arm, leg
from shadowpuppet.synthetic.person.mannequin import Mannequin
from shadowpuppet.synthetic.person.surface import Surface
from shadowpuppet.synthetic.person.trunk import shoulders, trunk
from shadowpuppet.synthetic.person_renderer import PersonRenderer
from shadowpuppet.synthetic.room import Room, expose, lamp_brightness
from shadowpuppet.synthetic.spec import Bystander, Spec


class RenderedFrame(NamedTuple):
    """A frame with its exact masks."""

    image: np.ndarray
    """Of shape (H, W, 3), blue green red, uint8."""
    mask: np.ndarray
    """Visible part of the tracked person, of shape (H, W), uint8, 0 or 255."""
    people: np.ndarray
    """Visible parts of all people, of shape (H, W), uint8, 0 or 255; `mask` itself if there are no bystanders."""
    hidden: int
    """Number of the person's pixels hidden by obstacles and bystanders."""


class Lit(NamedTuple):
    """Light of a frame before lens and sensor, with its exact masks as in `RenderedFrame`."""

    light: Array
    """Of shape (H, W, 3), RGB, about 0 to 1."""
    mask: np.ndarray
    """Of shape (H, W), uint8, 0 or 255."""
    people: np.ndarray
    """Of shape (H, W), uint8, 0 or 255."""
    hidden: int
class EmptyStage(NamedTuple):
    """The scene without people, while the same obstacles are there."""

    room: Array
    """Light of the room with the obstacles' shadows, of shape (H, W, 3), RGB, about 0 to 1."""
    things: list[Layer]
    """The obstacles, as one layer; none if there are none."""


class SceneRenderer:
    """Renders the scene of a spec as one camera sees it."""

    def __init__(self, spec: Spec, camera: Camera, rng: np.random.Generator, others: Sequence[PosedBody] = (), least: float = 0.0,
                 faults: CameraFaults | None = None) -> None:
        """rng: for the noise; clothes and room have their own seeds in the spec.

        others: figures of `spec.scene.bystanders`, at the same times as the person's; least: least distance (m) of the wall behind the
        person; faults: those of the camera's film.
        """
        self.faults = faults or CameraFaults((), camera, 1, spec.rate, np.random.default_rng(0))
        camera = self.faults.wide_camera()
        scene = spec.scene
        least = max([least, *(view.distance + 1 for view in spec.views() if abs(view.azimuth_deg) > 60)])
        self.furniture = spec.furniture()
        arrangements = self.furniture.arrangements()
        self.room = Room(camera, np.random.default_rng(scene.room), scene.shadow, least, scene.background, arrangements)
        clothes = Clothes.draw(np.random.default_rng(scene.clothing))
        if scene.camouflage:
            clothes = _camouflaged(clothes, self.room.wall_colour, scene.camouflage)
        self.renderer = PersonRenderer(camera, dressed(spec.body, clothes), clothes, self.room.lights)
        self.spec, self.rng = spec, rng
        self.others = [(figure, self._of(bystander, camera)) for figure, bystander in zip(others, scene.bystanders, strict=True)]
        fine = self.renderer.fine_rays() if self.furniture else np.zeros((0, 0, 3))
        layers = [[now.layer(camera.centre, self.renderer.rays, fine, self.room.lights)] if now else [] for now in arrangements]
        self._places = {now.things: EmptyStage(room, drawn) for now, room, drawn in zip(arrangements, self.room.pictures, layers)}
        self._length = 0.0

    def place(self, seconds: float | None) -> EmptyStage:
        """The place without people, `seconds` after the film's first frame; None: in the film of the empty scene."""
        return self._places[self.furniture.at(seconds).things]

    def _of(self, bystander: Bystander, camera: Camera) -> PersonRenderer:
        clothes = Clothes.draw(np.random.default_rng([bystander.seed, 1]))
        return PersonRenderer(camera, dressed(bystander_body(bystander), clothes), clothes, self.room.lights)

    def empty(self, index: int = 0, count: int = 1) -> np.ndarray:
        """Frame `index` of `count` of the empty scene, (H, W, 3) BGR, before the film begins."""
        light = self.faults.cropped(composite(*self.place(None)))
        return self._exposed(light, (index - count) / self.spec.rate, None)

    def take(self, figure: PosedBody, index: int) -> tuple[np.ndarray, np.ndarray]:
        """A frame (H, W, 3) BGR of posture `index` in the empty scene, without bystanders, and its exact mask (H, W), 0 or 255."""
        light, mask, *_ = self._lit(figure, index, None)
        return self._exposed(self.faults.cropped(light), 0.0, None), self.faults.cropped(mask)

    def hides(self, figure: PosedBody) -> bool:
        """Whether obstacles of the empty scene hide a part of the figure in its first posture."""
        return bool(self.place(None).things) and self._lit(figure, 0, None)[3] > 0

    def film(self, figure: PosedBody, workers: int | None = None) -> Iterator[RenderedFrame]:
        """Frames of the film in order; `workers` threads (by default 2 to 8) draw ahead, the noise is drawn in order."""
        count = len(figure.joints)
        self._length = (count - 1) / self.spec.rate
        lights = ((one.light, one) for one in self._drawn(figure, workers or min(max(os.cpu_count() or 2, 2), 8)))
        return self.faults.timed(self._taken(light, one, index) for index, (light, one) in enumerate(self.faults.blurred(lights)))

    def _drawn(self, figure: PosedBody, workers: int) -> Iterator[Lit]:
        """All postures as the moved camera sees them."""
        from concurrent.futures import ThreadPoolExecutor

        count = len(figure.joints)
        with ThreadPoolExecutor(workers) as pool:
            ahead = deque(pool.submit(self._seen, figure, index) for index in range(min(2 * workers, count)))
            for index in range(count):
                lit = ahead.popleft().result()
                if index + 2 * workers < count:
                    ahead.append(pool.submit(self._seen, figure, index + 2 * workers))
                yield lit

    def _seen(self, figure: PosedBody, index: int) -> Lit:
        """A posture among the bystanders, as the moved camera sees it."""
        light, mask, people, hidden = self._lit(figure, index, index / self.spec.rate)
        light, moved = self.faults.displaced(light, index), self.faults.displaced(mask, index)
        return Lit(light, moved, moved if people is mask else self.faults.displaced(people, index), hidden)

    def _taken(self, light: Array, lit: Lit, index: int) -> RenderedFrame:
        """The sensor's frame of the light; nothing of a person is in a black one."""
        there = np.uint8(not self.faults.is_black(index))
        return RenderedFrame(self._exposed(light, index / self.spec.rate, index), lit.mask * there, lit.people * there, lit.hidden)

    def _lit(self, figure: PosedBody, index: int, seconds: float | None) -> Lit:
        """Light, masks and number of hidden pixels, with the margin, `seconds` after the film's first frame; None: in the empty scene,
        without bystanders."""
        person = self.renderer.draw(figure, index)
        others = self.others if seconds is not None else []
        empty, things = self.place(seconds)
        room = self.room.shaded(empty, figure, index, *(other for other, _ in others))
        if not (others or things):
            mask = _mask(person.mask)
            return Lit(person.over(room), mask, mask, 0)
        bystanders = [renderer.draw(other, index) for other, renderer in others]
        rest = [*bystanders, *things]
        seen = visible(person, rest)
        people = seen.copy()
        for n, layer in enumerate(bystanders):
            people |= visible(layer, [person, *rest[:n], *rest[n + 1 :]])
        hidden = int((person.mask & ~seen).sum())
        return Lit(composite_people(room, [person, *bystanders], things), _mask(seen), _mask(people), hidden)

    def _exposed(self, light: Array, seconds: float, index: int | None) -> np.ndarray:
        """The sensor's picture, BGR uint8; index None: not in the film."""
        scene = self.spec.scene
        bright = lamp_brightness(scene, seconds, self._length)
        light = self.faults.lit(light if bright == 1 else bright * light, index, seconds)
        return expose(light, self.faults.noise(scene.noise, index), self.rng)[..., ::-1]


def dressed(body: Mannequin, clothes: Clothes) -> Surface:
    """The surface of `body` in `clothes`."""
    left = [*arm(body, clothes), *leg(body, clothes)]
    return Surface.of([*trunk(body, clothes), *shoulders(body, clothes), *head(body, clothes), *left, *(loft.mirrored() for loft in left)])


def bystander_body(bystander: Bystander) -> Mannequin:
    """The body drawn by a bystander's seed."""
    kind = None if bystander.kind == "random" else bystander.kind
    return Mannequin.draw(np.random.default_rng([bystander.seed, 0]), kind)


def _camouflaged(clothes: Clothes, wall: Array, share: float) -> Clothes:
    """Clothes with shirt and trousers blended by `share` with the wall's colour."""
    near = {name: tuple((1 - share) * np.array(clothes.colours[name]) + share * wall) for name in ("shirt", "trousers")}
    return replace(clothes, colours=clothes.colours | near, stripes=(1 - share) * clothes.stripes)


def _mask(seen: np.ndarray) -> np.ndarray:
    return np.where(seen, 255, 0).astype(np.uint8)
