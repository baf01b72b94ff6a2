"""A motion prior (Ni 2008, IV), learnt from four seconds of walking, generates more walking frame by frame.

Arguments may be motion files (.csv, .trc, .bvh, .c3d, or .amc beside its .asf); otherwise synthetic walking is used. The picture shows
every sixth proposal, starting from a training pose: what the tracker would propose without observations.
"""

import sys
from pathlib import Path

import numpy as np

import shadowpuppet as sp
from shadowpuppet.camera.drawing import draw_model
from shadowpuppet.motion.prior.training import train_prior
from shadowpuppet.synthetic import Gesture, Ring, Spec
from shadowpuppet.synthetic.person.mannequin import JOINTS
from shadowpuppet.synthetic.recording import perform
from shadowpuppet.video import write_image

TILES, EVERY = 8, 6

rng = np.random.default_rng(1)
if len(sys.argv) > 1:
    motions = {path: sp.read_motion(path) for path in sys.argv[1:]}
else:
    times, figure = perform(Spec(motion=(Gesture(motion="walk", seconds=4),), rate=60), rng)
    motions = {"walking": sp.JointTable(times, tuple(JOINTS), figure.joints)}

trained = train_prior(rng, motions, sp.PriorSettings(regions=15))
sp.write_prior("prior.npz", trained.prior)  # for track --prior
print(f"{len(trained.prior.subspaces)} regions of {trained.prior.subspaces.dimensions} dimensions for {len(trained.prior.names)} angles; "
      f"a pose loses {np.degrees(trained.error):.1f} degrees, {1000 * trained.joint_error:.0f} mm at the joints")  # fmt: skip

clip = trained.clips[0]
body, poses = clip.fitted.body, clip.parts[0]
walk = poses[[len(poses) // 2]]
angles, tiles = body.skeleton.dof_indices(trained.prior.names), []
camera = Spec(ring=Ring(count=2, radius=3.4, height=1.0, fov_deg=28, size=(160, 240))).views()[0].camera()
picture = sp.Picture(body, camera, camera.T_camera_world)
region = trained.prior.encode(walk[:, angles]).regions
for n in range(TILES * EVERY):
    proposal = trained.prior.propose(rng, walk[:, angles], region)
    walk, region = walk.copy(), proposal.regions
    walk[:, angles] = proposal.poses
    if n % EVERY == 0:
        tiles.append(np.full((240, 160, 3), 235, np.uint8))
        upright = walk[0].copy()
        upright[body.skeleton.dof_indices(("root_x", "root_y", "root_heading"))] = 0, 0, np.radians(60)
        draw_model(tiles[-1], picture, upright)
write_image("prior.png", np.concatenate(tiles, axis=1))
print(f"use prior.npz with track --prior; the proposals are drawn in {Path('prior.png').resolve()}")
