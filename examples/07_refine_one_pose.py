"""Ni 2008's refinement by simulated forces, and Gauss-Newton, on one frame: from silhouettes to surface points to a pose.

A body in a known pose is drawn in five cameras; its silhouettes give surface points of the visual hull. A perturbed pose is then fitted to
the points by simulated forces and by Gauss-Newton. Printed are the joint errors after increasing numbers of iterations.
"""

from pathlib import Path

import numpy as np

import shadowpuppet as sp
from shadowpuppet.body.models import average_sizes, make_body
from shadowpuppet.camera.drawing import draw_model
from shadowpuppet.synthetic import Ring, Spec
from shadowpuppet.tracking.multiview.refinement.correspondence import make_cloud
from shadowpuppet.tracking.multiview.refinement.refiner import Refiner
from shadowpuppet.tracking.multiview.settings import ForceSettings
from shadowpuppet.video import write_image

ITERATIONS = (0, 1, 2, 5, 10, 20, 40)

cameras = [view.camera() for view in Spec(ring=Ring(count=5, radius=3.5, fov_deg=42)).views()]
body = make_body("anatomical", average_sizes("anatomical", 1.75))
truth = body.skeleton.pose(root_z=0.95, root_heading=0.6, left_shoulder_x=1.0, left_elbow_flexion=0.9, right_shoulder_y=-0.9,
                           right_elbow_flexion=0.4, left_hip_y=-0.5, left_knee_flexion=0.6)  # fmt: skip
pictures = [sp.Picture(body, camera, camera.T_camera_world) for camera in cameras]
surface = sp.VisualHull(cameras).points([picture.mask(truth) for picture in pictures])
cloud = make_cloud(surface.points, surface.normals, surface.weights)
print(f"{len(surface.points)} surface points from {len(cameras)} silhouettes")

rng = np.random.default_rng(3)
noise = np.array([0.04 if dof.kind == "translation" else 0.2 for dof in body.skeleton.dofs])
start = body.skeleton.clamp(truth + noise * rng.standard_normal((1, len(truth))))
refiner, pull = Refiner(body), np.full(len(truth), 1e-5)


def error(poses):
    """Mean distance of the joints to the true ones, mm."""
    return 1000 * np.linalg.norm(body.points(poses) - body.points(truth[None]), axis=2).mean()


print("iterations     " + "".join(f"{n:7}" for n in ITERATIONS))
forced = [refiner.forces(start, cloud, ForceSettings(iterations=n)) for n in ITERATIONS]
solved = [refiner.gauss_newton(start, ((cloud, n, 0.06),), start, pull) for n in ITERATIONS]
for name, found in (("forces", forced), ("Gauss-Newton", solved)):
    print(f"{name:15}" + "".join(f"{error(poses):7.1f}" for poses in found) + "  mm")

tiles = [np.full((240, 320, 3), 235, np.uint8) for _ in range(4)]
for tile, pose in zip(tiles, (start[0], forced[-1][0], solved[-1][0], truth)):
    draw_model(tile, pictures[0], pose)
write_image("refined.png", np.concatenate(tiles, axis=1))
print(f"start, forces, Gauss-Newton, truth: {Path('refined.png').resolve()}")
