"""The two resampling schemes of Liu 2011 on one silhouette: a minimal particle filter.

A cardbox in a known pose is drawn; 200 particles search for that pose from the silhouette alone, in all 12 degrees of freedom at once. SRS
turns costs into probabilities, which hardly differ for the paper's sigma_gamma: the particles spread. DRS ranks them and converges.
"""

from pathlib import Path

import numpy as np

from shadowpuppet.body.anthropometry import sizes_from_height
from shadowpuppet.body.upper_body import cardbox
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.drawing import matching
from shadowpuppet.camera.rasterize import Picture, place
from shadowpuppet.tracking.particle_filter import diffuse, evaluate, step
from shadowpuppet.tracking.resampling import make_scheme
from shadowpuppet.tracking.silhouette_cost import Observation, silhouette_costs
from shadowpuppet.video import write_image

SIGMA_COST = 8000.0  # sigma_gamma of eq. 6, pixels
CYCLES, PARTICLES = 100, 200

camera = Camera.from_fov((320, 240), np.radians(60))
picture = Picture(cardbox(sizes_from_height(1.75)), camera, place(camera, distance=2.0, elevation=-0.4))
skeleton = picture.body.skeleton
truth = skeleton.pose(torso_bend=0.2, left_shoulder_abduction=1.6, left_elbow_roll=1.5, left_elbow_flexion=0.8,
                      right_shoulder_abduction=0.9)  # fmt: skip
start = skeleton.pose(left_shoulder_abduction=1.0, left_elbow_roll=1.0, left_elbow_flexion=0.4, right_shoulder_abduction=0.6)
observation = Observation.of(picture.mask(truth))
noise = np.array([0.02 if dof.kind == "translation" else 0.1 for dof in skeleton.dofs])


def weigh(poses):
    """Costs (N,) by eq. 2 and log weights (N,) by eq. 6."""
    costs = silhouette_costs(picture, observation, poses)
    return costs, -(costs**2) / (2 * SIGMA_COST**2)


panels = []
for name in ("deterministic", "stratified"):
    rng = np.random.default_rng(7)
    poses = skeleton.clamp(diffuse(rng, np.repeat(start[None], PARTICLES, axis=0), noise))  # eq. 5
    particles, curve = evaluate(poses, weigh), []
    for _ in range(CYCLES):
        particles = step(rng, particles, resample=make_scheme(name, survival=0.2), weigh=weigh,
                         propose=lambda rng, poses: skeleton.clamp(diffuse(rng, poses, noise)))  # fmt: skip
        curve.append((particles.costs.min(), particles.costs.mean()))
    best, mean = curve[-1]
    print(f"{name:13}  best {curve[0][0]:5.0f} -> {best:5.0f} pixels; mean of all particles {mean:5.0f}")
    panels.append(matching(picture.mask(particles.best), picture.mask(truth)))

write_image("one_picture.png", np.concatenate(panels, axis=1))
print(f"white is agreement, left DRS, right SRS: {Path('one_picture.png').resolve()}")
