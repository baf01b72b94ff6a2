"""GLB files: Khronos' validator finds nothing, and an independent reader finds the joints and the skin where the body has them."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pygltflib
import pytest
import runs
from scipy.spatial.transform import Rotation

from shadowpuppet.errors import ShadowPuppetError, ShadowPuppetWarning
from shadowpuppet.io.motion.glb import write_glb
from shadowpuppet.motion.animation import Y_UP, Animation
from shadowpuppet.motion.body_animation import BodyTree
from shadowpuppet.motion.mesh import body_mesh, bone_mesh

KINDS = {5121: np.uint8, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}
VALIDATE = """
const validator = require('gltf-validator'), fs = require('fs');
validator.validateBytes(new Uint8Array(fs.readFileSync(process.argv[1]))).then(report => console.log(JSON.stringify(report.issues)));
"""
GAPS = (0, 1, 9, 10, 11)


def animated(name: str, rng, frames: int = 24) -> Animation:
    body = runs.body_of(name)
    return BodyTree(body).animation(2 + np.arange(frames) / 25, runs.smooth_poses(body, frames, rng), runs.root_of(body))


class Scene:
    """A file as pygltflib reads it, played by plain NumPy after the specification."""

    def __init__(self, path) -> None:
        self.file = pygltflib.GLTF2().load_binary(str(path))
        self.blob = self.file.binary_blob()
        self.skin = self.file.skins[0]
        self.animation = self.file.animations[0]

    def array(self, index: int) -> np.ndarray:
        accessor = self.file.accessors[index]
        view = self.file.bufferViews[accessor.bufferView]
        width = WIDTHS[accessor.type]
        values = np.frombuffer(self.blob, KINDS[accessor.componentType], accessor.count * width, view.byteOffset)
        return values.reshape(accessor.count, width).astype(float)

    def transforms(self, time: float) -> dict[str, np.ndarray]:
        """Of every joint in the world, by name."""
        nodes, local = self.file.nodes, {}
        for n in self.skin.joints:
            local[n] = {"translation": np.array(nodes[n].translation), "rotation": np.array(nodes[n].rotation), "scale": np.ones(3)}
        for channel in self.animation.channels:
            sampler = self.animation.samplers[channel.sampler]
            at, values = self.array(sampler.input)[:, 0], self.array(sampler.output)
            k = int(np.clip(np.searchsorted(at, time + 1e-6) - 1, 0, len(at) - 1))  # keys are hit exactly here
            local[channel.target.node][channel.target.path] = values[k]
        out: dict[int, np.ndarray] = {}

        def place(n: int, above: np.ndarray) -> None:
            T = np.eye(4)
            T[:3, :3] = Rotation.from_quat(local[n]["rotation"]).as_matrix() * local[n]["scale"]
            T[:3, 3] = local[n]["translation"]
            out[n] = above @ T
            for child in nodes[n].children or []:
                place(child, out[n])

        place(self.skin.joints[0], np.eye(4))
        return {nodes[n].name: out[n] for n in self.skin.joints}

    def skinned(self, time: float) -> np.ndarray:
        """Points of the mesh in the world."""
        attributes = self.file.meshes[0].primitives[0].attributes
        points, joints, weights = (self.array(getattr(attributes, name)) for name in ("POSITION", "JOINTS_0", "WEIGHTS_0"))
        bind = np.swapaxes(self.array(self.skin.inverseBindMatrices).reshape(-1, 4, 4), 1, 2)
        worlds = np.stack(list(self.transforms(time).values())) @ bind
        whole = np.concatenate([points, np.ones((len(points), 1))], 1)
        return np.einsum("vk,vkij,vj->vi", weights, worlds[joints.astype(int)], whole)[:, :3]


@pytest.mark.parametrize("name", runs.BODIES)
def test_joints_lie_where_they_did_in_an_independent_reader(tmp_path, name, rng):
    animation = animated(name, rng)
    write_glb(tmp_path / "a.glb", animation, body_mesh(runs.body_of(name)))
    scene, wanted = Scene(tmp_path / "a.glb"), animation.table.positions @ Y_UP.T
    for frame in (0, 7, 23):
        found = scene.transforms(frame / 25)
        for joint, place in zip(animation.names, wanted[frame]):
            np.testing.assert_allclose(found[joint][:3, 3], place, atol=1e-5)


@pytest.mark.parametrize("name", ["rounded", "anatomical"])
def test_the_skin_moves_with_the_joints(tmp_path, name, rng):
    body = runs.body_of(name)
    animation, mesh = animated(name, rng), body_mesh(body)
    write_glb(tmp_path / "a.glb", animation, mesh)
    places, turns = animation.world()
    local = mesh.points - animation.rest[mesh.joints]
    for frame in (3, 20):
        wanted = places[frame, mesh.joints] + (turns[frame, mesh.joints] @ local[..., None])[..., 0]
        np.testing.assert_allclose(Scene(tmp_path / "a.glb").skinned(frame / 25), wanted @ Y_UP.T, atol=2e-5)


def test_what_an_animation_must_have(tmp_path, rng):
    animation = animated("anatomical", rng)
    write_glb(tmp_path / "a.glb", animation, bone_mesh(animation))
    scene = Scene(tmp_path / "a.glb")
    assert scene.file.asset.version == "2.0"
    paths = {(scene.file.nodes[c.target.node].name, c.target.path) for c in scene.animation.channels}
    assert ("pelvis", "translation") in paths
    assert ("left_knee", "rotation") in paths
    assert ("left_wrist", "rotation") not in paths  # the body has none there
    for sampler in scene.animation.samplers:
        at, values = scene.array(sampler.input)[:, 0], scene.array(sampler.output)
        assert at[0] == 0
        assert (np.diff(at) > 0).all()
        assert len(values) == len(at)
        if values.shape[1] == 4:
            np.testing.assert_allclose(np.linalg.norm(values, axis=1), 1, atol=1e-6)
            assert ((values[1:] * values[:-1]).sum(1) > 0).all()  # never the long way round
    indices = scene.array(scene.file.meshes[0].primitives[0].indices)
    assert indices.max() < scene.file.accessors[scene.file.meshes[0].primitives[0].attributes.POSITION].count


def test_in_gaps_the_puppet_is_not_to_be_seen(tmp_path, rng):
    animation = animated("anatomical", rng)
    rotations = animation.rotations.copy()
    rotations[list(GAPS)] = np.nan
    with pytest.warns(ShadowPuppetWarning, match=r"a\.glb: 5 of 24 frames are not known: the puppet is hidden"):
        write_glb(tmp_path / "a.glb", replace(animation, rotations=rotations), body_mesh(runs.body_of("anatomical")))
    scene = Scene(tmp_path / "a.glb")
    for frame in range(24):
        size = np.ptp(scene.skinned(frame / 25), axis=0).max()
        assert size == 0 if frame in GAPS else size > 0.5
    np.testing.assert_allclose(scene.animation.extras["unknown"], [[0, 2 / 25], [9 / 25, 12 / 25]])


def validator() -> dict[str, str]:
    """The environment in which node finds Khronos' validator; skips where it is not there."""
    if shutil.which("node") is None:
        pytest.skip("no node here")
    environment = {**os.environ}
    found = subprocess.run(["node", "-e", "require('gltf-validator')"], env=environment, capture_output=True)
    if found.returncode:
        pytest.skip("node finds no gltf-validator: npm install gltf-validator, and NODE_PATH to its node_modules")
    return environment


def test_khronos_validator_finds_nothing_to_complain_of(tmp_path, rng):
    environment = validator()
    for name in runs.BODIES:
        animation = animated(name, rng)
        write_glb(tmp_path / f"{name}.glb", animation, body_mesh(runs.body_of(name)))
    rotations = animation.rotations.copy()
    rotations[list(GAPS)] = np.nan
    with pytest.warns(ShadowPuppetWarning):
        write_glb(tmp_path / "gaps.glb", replace(animation, rotations=rotations), bone_mesh(animation))
    for path in tmp_path.glob("*.glb"):
        told = subprocess.run(["node", "-e", VALIDATE, str(path)], env=environment, capture_output=True, text=True, check=True).stdout
        issues = json.loads(told)
        assert (issues["numErrors"], issues["numWarnings"], issues["numInfos"], issues["numHints"]) == (0, 0, 0, 0), issues["messages"]


def test_nothing_known_is_said(tmp_path, rng):
    animation = animated("anatomical", rng, 2)
    with pytest.raises(ShadowPuppetError, match=r"a\.glb: found no frame in which the whole skeleton is known"):
        write_glb(tmp_path / "a.glb", replace(animation, rotations=animation.rotations * np.nan), bone_mesh(animation))
    assert list(tmp_path.iterdir()) == []


def test_bounds_that_are_stated_are_those_of_the_numbers(tmp_path, rng):
    """Viewers draw nothing of what they take to lie outside of the picture."""
    write_glb(tmp_path / "a.glb", animated("anatomical", rng), body_mesh(runs.body_of("anatomical")))
    scene = Scene(tmp_path / "a.glb")
    stated = [(n, accessor) for n, accessor in enumerate(scene.file.accessors) if accessor.min]
    assert len(stated) >= 2  # points of the skin, times
    for n, accessor in stated:
        values = scene.array(n)
        np.testing.assert_allclose([accessor.min, accessor.max], [values.min(0), values.max(0)], rtol=1e-6)
