"""Liu 2011 on one frame, step by step, in cells; `python -m papers.lectures liu2011` runs it."""

# %% [markdown]
# # Liu, Lee and Sepp (2011) on one frame
#
# One camera, an upper body, one frame: this page runs every step of the paper's method, with its equations in plain NumPy, and shows what
# each step makes of the particles. Where the package has the step as a function, the page calls it too and checks that both agree.
#
# The page is made from the script `papers/lectures/liu2011.py`, whose cells (`# %%`) open as a notebook in VS Code, Spyder, PyCharm and
# Jupytext. To run it: `python -m papers.lectures liu2011` in the root of the repository, with the extra `report`; `--page` writes
# this page.

# %%
import tempfile
from pathlib import Path

import cv2
import numpy as np

import shadowpuppet as sp
from papers.common.plotting import COLOURS, label, new_figure, save_picture
from shadowpuppet.body.sizes import SUBSETS
from shadowpuppet.body.upper_body import cardbox
from shadowpuppet.camera.bits import unpack
from shadowpuppet.camera.drawing import draw_model, matching
from shadowpuppet.io.calibration.calibration_files import read_calibration
from shadowpuppet.synthetic import Gesture, Scene, Spec, synthesize
from shadowpuppet.tracking.monocular.initialization import POSTURES, fit_references
from shadowpuppet.tracking.monocular.settings import InitializationSettings, make_settings
from shadowpuppet.tracking.monocular.tracker import MonocularTracker
from shadowpuppet.tracking.resampling import deterministic, stratified
from shadowpuppet.tracking.silhouette_cost import silhouette_costs
from shadowpuppet.video import read_image

rng = np.random.default_rng(2011)
folder = Path(tempfile.mkdtemp()) / "waving"

# %% [markdown]
# ## The material
#
# A made person waves both hands, 2 m in front of the camera, at 320 x 240 pixels and 15 frames/s. The empty scene is filmed first, and
# there are three reference pictures in known postures.

# %%
spec = Spec(motion=(Gesture(motion="wave_hands", seconds=2.5),), scene=Scene(empty_seconds=1), rate=15)
synthesize(spec, folder, np.random.default_rng(1))
(camera,) = read_calibration(folder / "calibration.toml")
empty = np.array([frame.image for frame in sp.open_frames(folder / "background" / "cam.mp4", grey=True)], float)
film = [frame.image for frame in sp.open_frames(folder / "video" / "cam.mp4")]
print(f"{len(empty)} pictures of the empty scene, {len(film)} of the person, {camera.size[0]} x {camera.size[1]} pixels")

# %% [markdown]
# ## III-B: the silhouette
#
# From the empty scene each pixel has a mean brightness I_B and a standard deviation sigma_B. A pixel of a new picture I_t is foreground
# where
#
#     |I_B - I_t| >= 2 sigma_B                                                   (1)
#
# A compressed film has sigma_B near zero where it repeats what was there, so that eq. 1 alone leaves specks (here differences below one
# grey level do not count). The package's silhouette looks at colours and at neighbours too; the rest of this page uses it, as `track`
# does, where `--silhouette.method averaging` is eq. 1.

# %%
mean, deviation = empty.mean(0), empty.std(0)


def by_equation_1(image):
    """The foreground (H, W) of a picture (H, W, 3)."""
    return np.abs(mean - cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)) >= np.maximum(2 * deviation, 1)


segment = sp.learn_background((frame.image for frame in sp.open_frames(folder / "background" / "cam.mp4")), film=film)
t = len(film) - 12
plain, mask = by_equation_1(film[t]), segment(film[t])
panels = [film[t], *(cv2.cvtColor(255 * each.astype(np.uint8), cv2.COLOR_GRAY2BGR) for each in (plain, mask))]
save_picture(np.concatenate(panels, axis=1), Path("liu2011_one_frame_silhouette.png"))
print(f"eq. 1 and the practical silhouette differ in {np.count_nonzero(plain ^ mask)} of {mask.size} pixels")

# %% [markdown]
# *A picture, its foreground by eq. 1, and the silhouette used from here on.*
#
# ## III-A, Algorithm 1: how large the person is
#
# The body is a *cardbox*: crossed cards in place of closed boxes, 15 planes in all, of 18 sizes. They are found before tracking, from the
# three references. For each, a subset of the sizes (O1, O2, O3) is drawn around the best so far (eq. 4), every hypothesis is drawn as a
# silhouette, and the best becomes the next centre; M is 200 and the deviation 5 cm. What is not the paper's here: average proportions
# pull at sizes that the picture does not show, and the deviation shrinks from round to round.

# %%
references = {name: read_image(folder / "references" / f"{name}_mask.png", grey=True) > 127 for name in POSTURES}
fit = fit_references(rng, camera, references, height=1.75, body=cardbox, settings=InitializationSettings(sweeps=1))
person = fit.guess.picture(camera, cardbox)
for subset, sizes in SUBSETS.items():
    (curve,) = fit.curves[subset]
    print(f"{subset}: {len(sizes)} sizes, cost {curve[0]:.0f} -> {curve[-1]:.0f} pixels in {len(curve)} rounds")
panels = [matching(person.mask(pose), reference) for pose, reference in zip(fit.poses, references.values())]
save_picture(np.concatenate(panels, axis=1), Path("liu2011_one_frame_sizes.png"))

# %% [markdown]
# *The fitted cardbox against the three references: white is agreement, orange the model alone, blue the silhouette alone. Legs are not in
# the model.*
#
# ## III-C: what a pose costs
#
# A pose **d** has 12 degrees of freedom (eq. 3). Its cost is the number of pixels in which the drawn body and the silhouette differ (eq.
# 2):
#
#     W(d) = sum over x, y of | f(x, y) - h(x, y, d) |                           (2)
#
# Below the waist the silhouette has legs and the model has none, so pixels where legs may be do not count.

# %%
settings = make_settings("liu2011")  # Table I: N, e, sigma_beta, sigma_gamma
tracker = MonocularTracker(person, settings)
last = tracker.start(rng, segment(film[t - 1]))  # the frame before, found by search
skeleton = person.body.skeleton
observation = tracker.observe(mask, last.pose)


def cost(poses):
    """Eq. 2 in plain NumPy: pixels (N,) of poses (N, D)."""
    counted = ~(mask & person.legs(last.pose))
    return np.array([np.count_nonzero((person.mask(pose) ^ mask) & counted) for pose in poses])


print(f"d1..d12: {', '.join(skeleton.dof_names[:8])},\n  {', '.join(skeleton.dof_names[8:])}")
print(f"last frame's estimate costs {cost(last.pose[None])[0]} pixels in the new picture;",
      f"the compiled cost says {silhouette_costs(person, observation, last.pose[None])[0]:.0f}")

# %% [markdown]
# ## IV-B: the hierarchy
#
# 600 particles in 12 dimensions would be few. The filter first estimates the torso (4 DOF, 200 particles, the arms not drawn), then each
# arm (4 DOF, 200 particles) with the torso where it was just found. This frame's torso, step by step. The particles are those of the last
# frame, with the costs that they had there.

# %%
torso = tracker.stages[0]
before = last.particles[0]
N, e = torso.number, settings.torso.survival
print(f"stages: {', '.join(settings.stages)}; torso: {', '.join(skeleton.dof_names[d] for d in torso.dofs)}; N = {N}, e = {e}")

# %% [markdown]
# ## IV-C: resampling, the paper's point
#
# **Algorithm 3, SRS**, turns costs into weights by a Gaussian (eq. 6) and draws one particle in each of N equal strata of the cumulative
# weight (eq. 7). But no model fits a person well: the costs are all large and alike, and so are the weights.
#
# **Algorithm 4, DRS**, ranks. The best e N particles survive, each once, and the rest become copies of the very best. Nothing is drawn.

# %%
order = np.argsort(before.costs, kind="stable")
survivors = order[: int(e * N)]
by_rank = np.concatenate([survivors, np.full(N - len(survivors), order[0])])  # Algorithm 4
assert (by_rank == deterministic(rng, before.log_weights, N, e)).all()

weights = np.exp(-(before.costs**2) / (2 * torso.sigma_cost**2))  # eq. 6
L = np.cumsum(weights) / weights.sum()
strata = (np.arange(N) + 1 - np.random.default_rng(3).random(N)) / N  # eq. 7
by_weight = np.array([np.flatnonzero(r <= L)[0] for r in strata])  # Algorithm 3: psi = min { j : r <= L_j }
assert (by_weight == stratified(np.random.default_rng(3), before.log_weights, N)).all()

figure, axes = new_figure(1, 2, width=9, height=2.8, sharey=True)
rank = np.argsort(order)
for panel, (name, ancestors), colour in zip(axes[0], (("SRS", by_weight), ("DRS", by_rank)), COLOURS):
    panel.bar(np.arange(N), np.bincount(rank[ancestors], minlength=N), width=1.0, color=colour)
    label(panel, "particle by rank of its cost", "copies", f"{name}: offspring of each particle", legend=False)
    panel.set_yscale("symlog", linthresh=2)
save_picture(figure, Path("liu2011_one_frame_resampling.png"))
print(f"costs of the torso's particles: {before.costs.min():.0f} to {before.costs.max():.0f} pixels; effective particles of SRS:",
      f"{weights.sum() ** 2 / (weights**2).sum():.0f} of {N}")

# %% [markdown]
# *Copies that each particle gets. SRS hardly distinguishes the best from the worst; DRS keeps the best fifth and bets on the best one.*
#
# ## Diffusion and weighting
#
# Every particle but the first is moved by Gaussian noise sigma_beta (Table I), then drawn and compared. The estimate is the particle of
# least cost. The next cycle ranks by these costs.

# %%
arms_left_out = torso.weigh(observation, last.pose, last.pose)


def cycle(ancestors, values, weigh, stage, rng):
    """New values (N, d) and their costs (N,): Algorithms 3 and 4 after the selection."""
    moved = values[ancestors] + stage.sigma * rng.standard_normal(values.shape) * (np.arange(len(values)) > 0)[:, None]
    moved = stage.clamp(moved)
    return moved, weigh(moved)[0]


values, costs = cycle(by_rank, before.poses, arms_left_out, torso, rng)
pose = torso.put(last.pose, values[np.argmin(costs)])


def outlines(stage, values, others):
    """The picture with every particle's outline, of the parts that the stage draws."""
    image, parts = (film[t] * 0.45).astype(np.uint8), np.concatenate([stage.partial.still, stage.partial.moving])
    for each in stage.put(others, values):
        drawn = unpack(person.draw(each, parts), camera.size[0])
        edges, _ = cv2.findContours(drawn.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        layer = image.copy()
        cv2.drawContours(layer, edges, -1, (66, 228, 240), 1)
        image = np.asarray(cv2.addWeighted(layer, 0.12, image, 0.88, 0), np.uint8)
    return image


panels = [outlines(torso, values, last.pose)]
print(f"torso: least cost {before.costs.min():.0f} in the last picture, {costs.min():.0f} in this one (arms not drawn)")

# %% [markdown]
# ## The arms
#
# The same three steps for each arm, with the torso where it was just estimated. The arms do not see each other's new estimates, so their
# order does not matter.

# %%
placed = pose
for stage, particles, part in zip(tracker.stages[1:], last.particles[1:], settings.stages[1:]):
    ancestors = deterministic(rng, particles.log_weights, stage.number, settings.arm.survival)
    values, costs = cycle(ancestors, particles.poses, stage.weigh(observation, placed, last.pose), stage, rng)
    pose = stage.put(pose, values[np.argmin(costs)])
    panels.append(outlines(stage, values, placed))
    print(f"{part}: {costs.min():.0f} pixels, {np.count_nonzero(costs < costs.min() + 100)} particles within 100 of the best")
overlay = film[t].copy()
draw_model(overlay, person, pose)
panels.append(overlay)
save_picture(np.concatenate(panels, axis=1), Path("liu2011_one_frame_particles.png"))
print(f"cost of the pose: {cost(last.pose[None])[0]} pixels before, {cost(pose[None])[0]} after")

# %% [markdown]
# *200 particles each of the torso, the left and the right arm, and the estimate. An arm's noise, 0.25 rad, is wide: most particles are
# bad, and ranking forgives that.*
#
# ## Algorithm 2, and both schemes side by side
#
# That was one turn of Algorithm 2's loop. `MonocularTracker.cycle` is the same in one call. Repeated on the same picture, DRS gathers its
# particles around the best; SRS keeps the best one too, but scatters all others again each time, as if their costs were equal. Mean of ten
# repetitions:

# %%
figure, axes = new_figure(1, 1, width=6, height=3)
for scheme, colour in zip(("stratified", "deterministic"), COLOURS):
    filters = MonocularTracker(person, make_settings("liu2011", {"resampling": scheme}))
    curves = []
    for repetition in range(10):
        generator, state = np.random.default_rng(repetition), last
        curves.append([state.cost] + [(state := filters.cycle(generator, state, mask)).cost for _ in range(30)])
    curve = np.mean(curves, axis=0)
    axes[0, 0].plot(curve[1:], color=colour, label={"stratified": "SRS", "deterministic": "DRS"}[scheme])
    print(f"{scheme:13} after 1 cycle {curve[1]:5.0f} pixels, after 10 {curve[10]:5.0f}, after 30 {curve[30]:5.0f}")
label(axes[0, 0], "cycle on the same picture", "cost of the estimate, pixels")
save_picture(figure, Path("liu2011_one_frame_cycles.png"))

# %% [markdown]
# *Cost of the estimate over the cycles.*
#
# Where to go on: the whole film is `shadowpuppet track FOLDER --preset liu2011`; the paper's figures over films are in the papers'
# experiments (`docs/reproduction.md`); the method with all its formulas is in `docs/method.md`; your own resampler in place of DRS takes
# forty lines (`docs/extending.md`).
