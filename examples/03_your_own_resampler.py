"""A resampling scheme of your own in the tracker: one function from log weights to the indices of those that live on.

Here a tournament: each place goes to the better of two particles picked at random. It needs only ranks, like DRS, and keeps more variety.
A recording folder may be given as the first argument; else one is made.
"""

import sys

import numpy as np

import shadowpuppet as sp
from shadowpuppet.footage import open_footage, silhouettes, take_sample
from shadowpuppet.resampling import with_best
from shadowpuppet.synthetic import Spec, synthesize


def tournament(rng, log_weights, number):
    """Indices (number,) of particles by their log weights (N,)."""
    pairs = rng.integers(len(log_weights), size=(number, 2))
    return np.where(log_weights[pairs[:, 0]] > log_weights[pairs[:, 1]], pairs[:, 0], pairs[:, 1])


recording = sys.argv[1] if len(sys.argv) > 1 else synthesize(Spec(), "sample", np.random.default_rng(1))
options = sp.make_options({"preset": "liu2011"})
footage = open_footage(recording, options)
seen = silhouettes(footage, take_sample(footage), options)
masks = [seen(shot) for shot in footage.shots(ready=False)]
fit = sp.find_person(np.random.default_rng(0), footage.camera, masks[:10:3], height=1.75, body="cardbox")

for name in ("as in the paper", "tournament"):
    tracker = sp.MonocularTracker(fit.guess.picture(footage.camera, "cardbox"), options.tracker)
    if name == "tournament":
        for stage in tracker.stages:
            stage.resample = with_best(tournament)
    rng = np.random.default_rng(0)
    state, costs = tracker.start(rng, masks[0]), []
    for mask in masks:
        state = tracker.step(rng, state, mask)
        costs.append(state.cost)
    print(f"{name:16}  mean cost {np.mean(costs):5.0f} pixels, overlap at the end {state.overlap:.2f}")
