"""Your own resampling scheme in the tracker: a function from log weights to the indices of the surviving particles.

The example is tournament selection: each survivor is the better of two particles picked at random. It needs only ranks, like DRS, and keeps
more diversity. The first argument may be a recording folder; otherwise one is rendered.
"""

import sys

import numpy as np

import shadowpuppet as sp
from shadowpuppet.synthetic import Spec, synthesize


def tournament(rng, log_weights, number):
    """Indices (number,) of the surviving particles, from log weights (N,)."""
    pairs = rng.integers(len(log_weights), size=(number, 2))
    return np.where(log_weights[pairs[:, 0]] > log_weights[pairs[:, 1]], pairs[:, 0], pairs[:, 1])


recording = sys.argv[1] if len(sys.argv) > 1 else synthesize(Spec(), "sample", np.random.default_rng(1))
options = sp.make_options({"preset": "liu2011"})
footage = sp.open_footage(recording, options)
masks = list(sp.read_masks(footage, options))
fit = sp.find_person(np.random.default_rng(0), footage.camera, masks[:10:3], height=1.75, body="cardbox")
picture = fit.guess.picture(footage.camera, "cardbox")

costs = {}
for name, scheme in (("as in the paper", None), ("tournament", tournament)):
    tracker, rng = sp.MonocularTracker(picture, options.tracker, scheme=scheme), np.random.default_rng(0)
    states = [tracker.start(rng, masks[0])]
    for mask in masks[1:]:
        states.append(tracker.step(rng, states[-1], mask))
    costs[name] = np.nanmean([state.cost for state in states])
    print(f"{name:16}  mean cost {costs[name]:5.0f} pixels, overlap at the end {states[-1].overlap:.2f}")
