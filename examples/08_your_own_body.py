"""Your own body in the tracker: a function from the 18 sizes to shapes on a skeleton.

The example is the cardbox with two more cards per part, halfway between its two. Two crossed cards look 0.7 times as wide when a limb has
rolled by 45 degrees, four at least 0.92 times. The first argument may be a recording folder; otherwise one is rendered.
"""

import sys
from dataclasses import replace

import numpy as np

import shadowpuppet as sp
from shadowpuppet.body.shapes import Quads
from shadowpuppet.body.upper_body import cardbox
from shadowpuppet.synthetic import Spec, synthesize


def starbox(sizes):
    """Body with cards at 0, 45, 90 and 135 degrees about the axis of each part."""
    box = cardbox(sizes)
    parts = tuple(dict.fromkeys(box.parts))
    first = np.array([box.parts.index(part) for part in parts])
    front, side, turn = box.shapes.corners[first], box.shapes.corners[first + 1], np.sqrt(0.5)
    more = [front * (turn, turn, 1) + sign * side * (turn, turn, 0) for sign in (1, -1)]  # heights are those of the front card
    corners = np.concatenate([box.shapes.corners, *more])
    joints = np.concatenate([box.shapes.joints, *[box.shapes.joints[first]] * 2])
    return replace(box, name="starbox", shapes=Quads(joints, corners), parts=(*box.parts, *parts, *parts))


recording = sys.argv[1] if len(sys.argv) > 1 else synthesize(Spec(), "sample", np.random.default_rng(1))
options = sp.make_options({})
footage = sp.open_footage(recording, options)
masks = list(sp.read_masks(footage, options))

costs = {}
for body in ("cardbox", starbox):
    fit = sp.find_person(np.random.default_rng(0), footage.camera, masks[:10:3], height=1.75, body=body)
    tracker, rng = sp.MonocularTracker(fit.guess.picture(footage.camera, body), options.tracker), np.random.default_rng(0)
    states = [tracker.start(rng, masks[0])]
    for mask in masks[1:]:
        states.append(tracker.step(rng, states[-1], mask))
    name, cards = tracker.picture.body.name, len(tracker.picture.body.parts)
    costs[name] = np.nanmean([state.cost for state in states])
    print(f"{name:8} {cards} cards  mean cost {costs[name]:5.0f} pixels, overlap at the end {states[-1].overlap:.2f}")
