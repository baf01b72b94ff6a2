"""Your own cost in the tracker: a function of poses that is added to the silhouette cost in every frame.

A silhouette contains no information on an arm in front of the body. Here the left hand is also observed in the image, for example by a
coloured glove or a detector; it is simulated by the true hand plus pixel noise. The first argument may be a recording with ground truth.
"""

import sys

import numpy as np

import shadowpuppet as sp
from shadowpuppet.synthetic import Gesture, Spec, synthesize

WEIGHT, FAR, NOISE = 4.0, 20.0, 1.0
"""Cost per squared pixel of distance; distance (pixels) beyond which the cost is constant; observation noise (pixels)."""


def glove(picture, observed):
    """Cost function of poses (N, D): squared distance of their projected left hand from the observed pixel (2,), bounded."""
    def cost(poses):
        drawn = picture.camera.project(picture.points_world(poses, ["left_hand"])[:, 0])
        return WEIGHT * np.minimum(((drawn - observed) ** 2).sum(1), FAR**2)

    return cost


spec = Spec(motion=(Gesture(motion="forearms_up", seconds=4), Gesture(motion="reach", seconds=5)))
recording = sys.argv[1] if len(sys.argv) > 1 else synthesize(spec, "sample", np.random.default_rng(1))
options, rng = sp.make_options({}), np.random.default_rng(0)
footage = sp.open_footage(recording, options)
masks = list(sp.read_masks(footage, options))
hand = sp.read_truth(footage.recording.truth).select(["left_hand"]).positions[: len(masks), 0]  # (frames, 3), metres
pixels = footage.camera.project(hand) + NOISE * rng.standard_normal((len(hand), 2))
fit = sp.find_person(rng, footage.camera, masks[:10:3], height=footage.recording.subject.height)
tracker = sp.MonocularTracker(fit.guess.picture(footage.camera), options.tracker)

errors, apart = {}, {}  # of the left hand: mm, and pixels
for name, costs in (("silhouettes", [None] * len(masks)), ("with the glove", [glove(tracker.picture, pixel) for pixel in pixels])):
    rng = np.random.default_rng(0)
    states = [tracker.start(rng, masks[0], costs[0])]
    for mask, cost in zip(masks[1:], costs[1:]):
        states.append(tracker.step(rng, states[-1], mask, cost))
    found = tracker.picture.points_world([state.pose for state in states], ["left_hand"])[:, 0]
    errors[name] = 1000 * np.linalg.norm(found - hand, axis=1).mean()
    apart[name] = np.linalg.norm(footage.camera.project(found) - footage.camera.project(hand), axis=1).mean()
    print(f"{name:14}  error of the left hand {errors[name]:4.0f} mm, in the image {apart[name]:4.1f} pixels")
