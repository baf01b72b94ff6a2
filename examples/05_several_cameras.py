"""Track a whole body with several cameras. The first argument is a recording folder; without one, a recording is rendered.

A person walks in front of four cameras with small images. Printed are the path lengths of wrists and ankles, and the overlap of body and
silhouettes.
"""

import sys

import numpy as np

import shadowpuppet as sp
from shadowpuppet.synthetic import Gesture, Ring, Scene, Spec, synthesize

if len(sys.argv) > 1:
    recording = sys.argv[1]
else:
    ring = Ring(count=4, radius=3.8, fov_deg=42)
    spec = Spec(motion=(Gesture(motion="walk", seconds=3),), ring=ring, scene=Scene(empty_seconds=1.5), rate=25)
    recording = synthesize(spec, "ring", np.random.default_rng(1))

run = sp.track_recording(recording, "ring-run", sp.make_options({"seed": 1, "overlay": True}))
motion = run.motion
print(f"{len(motion)} frames, {motion.status_counts}, overlap {np.nanmean(motion.overlap):.2f}")
for name in ("left_wrist", "right_wrist", "left_ankle", "right_ankle"):
    place = motion.table.select([name]).positions[:, 0]  # (frames, 3), metres, in the calibration's world
    steps = np.linalg.norm(np.diff(place, axis=0), axis=1)
    low, high = np.nanmin(place[:, 2]), np.nanmax(place[:, 2])
    print(f"{name:12} went {np.nansum(steps):.2f} m, between {low:.2f} and {high:.2f} m above the floor")
knee = motion.poses[:, motion.dof_names.index("left_knee_flexion")]
print(f"the left knee bent by up to {np.degrees(np.nanmax(knee)):.0f} degrees; look at ring-run/overlay.mp4")
