"""Track a recording and read the joints in metres. The argument is a recording's folder or a film; without one, one is rendered."""

import sys

import numpy as np

import shadowpuppet as sp
from shadowpuppet.synthetic import Spec, synthesize

made = len(sys.argv) < 2
recording = synthesize(Spec(), "sample", np.random.default_rng(1)) if made else sys.argv[1]
options = {"seed": 1, "overlay": True}  # named as the flags of `track`; a film alone needs {"fov": 65, "height": 1.75} too
run = sp.track_recording(recording, "sample-run", sp.make_options(options))
hand = run.motion.table.select(["left_hand"]).positions[:, 0]  # (frames, 3), metres
print(f"{len(run.motion)} frames, {run.motion.status_counts}")
print(f"the left hand moved through {np.nanmax(hand, 0) - np.nanmin(hand, 0)} m")
print("look at sample-run/overlay.mp4")
