"""Ni 2008 on one frame, step by step, in cells; `python -m papers.lectures ni2008` runs it."""

# %% [markdown]
# # Ni, Kassim and Winkler (2008) on one frame
#
# Several cameras, a whole body, one frame: silhouettes, surface points of the visual hull, the motion prior, and the five steps of V-A
# with the forces and moments of V-B, in plain NumPy where that is short. Where the package has the step as a function, the page calls it
# too and checks that both agree.
#
# The page is made from the script `papers/lectures/ni2008.py`, whose cells (`# %%`) open as a notebook in VS Code, Spyder, PyCharm and
# Jupytext. To run it: `python -m papers.lectures ni2008` in the root of the repository, with the extra `report`; `--page` writes
# this page.

# %%
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from papers.common.plotting import COLOURS, label, new_figure, save_picture
from papers.ni2008.inputs import Case, Source
from papers.ni2008.models import limbs_of
from papers.ni2008.reading import drawn
from papers.ni2008.recordings import humaneva
from shadowpuppet.body.skeleton import BONES
from shadowpuppet.camera.drawing import draw_model
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.motion.prior.settings import PriorSettings
from shadowpuppet.motion.prior.training import modelled
from shadowpuppet.motion.prior.vqpca import fit_prior
from shadowpuppet.tracking.multiview.observation import MultiviewObservation
from shadowpuppet.tracking.multiview.refinement.correspondence import make_cloud
from shadowpuppet.tracking.multiview.settings import ForceSettings, make_multiview_settings
from shadowpuppet.tracking.multiview.surface.visual_hull import VisualHull
from shadowpuppet.tracking.multiview.tracker import MultiviewTracker

rng = np.random.default_rng(2008)

# %% [markdown]
# ## The material
#
# A person walks before seven cameras, as in HumanEva: twelve frames to track, a hundred and twenty others to learn from. To keep the page
# quick the silhouettes are drawn, of a body of another shape than the one that is tracked.

# %%
spec = next(spec for spec in humaneva() if "walking" in spec.name)
source = Source(spec.name, None, replace(spec, frames=12, training_frames=120), factor=0.25)
case = Case(spec.name, Path(), *drawn(source))
t, body, names = 8, case.body, modelled(case.body.skeleton)
skeleton, limbs = body.skeleton, limbs_of(case.body)
print(f"{len(case.cameras)} cameras, {case.frames} frames; {len(limbs.parts)} cylinders, {len(skeleton.dofs)} degrees of freedom")

# %% [markdown]
# ## II, III: model and surface points
#
# The model is ten elliptic cylinders on a tree of joints (II). What is observed is not the pictures but points on the person's surface
# (III): a viewing ray through a silhouette's outline touches the visual hull along a *viewing edge*, the part of the ray that no other
# silhouette cuts away. Each edge gives a point and, from the outline's direction, a normal **n**.

# %%
masks, truth = [mask for mask in case.masks(t) if mask is not None], case.true_poses[t]
surface = VisualHull(case.cameras).points(masks)
from_side = (0, 2)  # X and Z
figure, axes = new_figure(1, 4, width=11, height=4, width_ratios=(1, 1, 1, 2))


def around(mask):
    """Rows and columns of a picture about its silhouette (H, W)."""
    (top, left), (bottom, right) = np.argwhere(mask).min(0) - 6, np.argwhere(mask).max(0) + 6
    return slice(max(top, 0), bottom), slice(max(left, 0), right)


for panel, n in zip(axes[0, :3], (0, 2, 4)):
    panel.imshow(masks[n][around(masks[n])], cmap="gray", interpolation="none")
    panel.set_title(f"camera {n + 1}", fontsize=9)
    panel.axis("off")
x, z = surface.points[:, from_side].T
across, up = 0.05 * surface.normals[:, from_side].T
axes[0, 3].quiver(x, z, across, up, surface.normals[:, 1], cmap="coolwarm", angles="xy", scale_units="xy", scale=1, width=0.004)
axes[0, 3].set_aspect("equal")
axes[0, 3].set_title(f"{len(surface.points)} surface points with normals", fontsize=9)
axes[0, 3].axis("off")
save_picture(figure, Path("ni2008_one_frame_surface.png"))

# %% [markdown]
# *Three of seven silhouettes, and the surface points from the side; colour is the normal's component toward the viewer.*
#
# ## IV: the motion prior
#
# The training poses are divided into M regions, each with a mean, m principal directions and variances (VQPCA, eqs. 8-14), and the
# probabilities a_ij that region j follows region i are learnt by EM as those of a hidden Markov model (eqs. 1-7, 15-17). Position and
# heading are left out. Learnt from 120 frames, with M = 10 and m = 3:

# %%
training = case.training[:, skeleton.dof_indices(names)]
prior = fit_prior(rng, [training], PriorSettings(regions=10, dimensions=3), names=names, rate=case.rate).prior
regions, _ = prior.encode(training)
centred = training - training.mean(0)
plane = centred @ np.linalg.svd(centred, full_matrices=False)[2][:2].T
figure, axes = new_figure(1, 2, width=9, height=3.4)
axes[0, 0].scatter(*plane.T, c=regions, cmap="tab10", s=12)
for region in range(10):
    axes[0, 0].annotate(str(region), plane[regions == region].mean(0), fontsize=9, weight="bold")
label(axes[0, 0], "first principal direction, rad", "second, rad", "training poses by region", legend=False)
axes[0, 1].imshow(prior.transitions, cmap="magma", vmin=0, vmax=1)
label(axes[0, 1], "to region j", "from region i", "a_ij", legend=False)
save_picture(figure, Path("ni2008_one_frame_prior.png"))
back = prior.reconstruct(prior.encode(training))
print(f"{len(names)} numbers a pose, {prior.subspaces.dimensions} in its region's subspace; reconstruction error",
      f"{np.degrees(np.sqrt(((back - training) ** 2).mean())):.1f} degrees")

# %% [markdown]
# *A stride is a loop through the regions, and the matrix of transitions says so: stay, or go on to the next.*
#
# ## V-A, steps 1 and 2: particles, selection
#
# A particle is (s, **x**, w): state, pose, weight. Forty came out of the last frame; each is selected as often as its weight says. Here s
# is the region in which the refined pose lies.

# %%
settings = make_multiview_settings("ni2008", {"velocity": 0.0})
tracker = MultiviewTracker(body, case.cameras, settings, prior, case.training)
state = tracker.start(rng, case.points(t - 3), case.masks(t - 3))
for n in (t - 2, t - 1):
    state = tracker.cycle(rng, state, MultiviewObservation(tracker.views, case.points(n), case.masks(n)))
weights = np.exp(state.particles.log_weights - state.particles.log_weights.max())
weights /= weights.sum()  # step 1
ancestors = np.searchsorted(np.cumsum(weights), (np.arange(tracker.number) + rng.random()) / tracker.number)  # step 2
selected = state.particles.poses[ancestors]
print(f"{tracker.number} particles; {len(np.unique(ancestors))} have offspring, the best {np.bincount(ancestors).max()} times")

# %% [markdown]
# ## Step 3: sampling from the prior
#
# For each particle: draw the next state from row s of a_ij (eq. 24); project the pose into that state's subspace (eq. 27); add noise of
# the subspace's variances; reconstruct (eq. 28).

# %%
columns = skeleton.dof_indices(names)
s, _ = prior.encode(selected[:, columns])
drawn_state = np.array([rng.choice(10, p=prior.transitions[i]) for i in s])  # eq. 24
r, P, variances = (each[drawn_state] for each in (prior.subspaces.centres, prior.subspaces.bases, prior.subspaces.variances))
theta = np.einsum("ndm,nd->nm", P, selected[:, columns] - r)  # eq. 27
assert np.allclose(theta, prior.subspaces.project(selected[:, columns], drawn_state))
theta += np.sqrt(variances) * rng.standard_normal(theta.shape)
proposed = selected.copy()
proposed[:, columns] = r + np.einsum("ndm,nm->nd", P, theta)  # eq. 28
proposed[:, tracker.proposals.root] += tracker.proposals.sigma[tracker.proposals.root] * rng.standard_normal((len(selected), 4))
proposed = skeleton.clamp(proposed)
print(f"states before: {np.unique(s).tolist()}, drawn: {np.unique(drawn_state).tolist()}")

# %% [markdown]
# ## V-B: one force
#
# A surface point p pulls the model's nearest point p'. The force's size is the distance, times the cosine of the angle between both
# normals (m_F), bounded by the robust function rho (eq. 32); it also turns the part about its joint, M = r x F (eq. 33). A part passes
# both on to its parent (eqs. 36-40), and each joint moves by what arrives (eqs. 34, 35, 41). Here the forces of the first iteration on
# one proposal:

# %%
cloud = make_cloud(surface.points, surface.normals, surface.weights)
origins = skeleton.forward(proposed[:1])[0]
tau, epsilon, bound = settings.surface.tau, settings.surface.epsilon, settings.forces.coarse_tau


def closest_on_cylinders(points):
    """Nearest points (P, 3) on the cylinders of the first proposal, treated as round, and the outward normals (P, 3) there."""
    best, found, normals = np.full(len(points), np.inf), np.zeros((len(points), 3)), np.zeros((len(points), 3))
    for joint, start, end, radii in zip(limbs.joints, limbs.starts, limbs.ends, limbs.radii):
        a, b = (origins[joint][:3, :3] @ each + origins[joint][:3, 3] for each in (start, end))
        along = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
        out = points - (a + along[:, None] * (b - a))
        out /= np.linalg.norm(out, axis=1, keepdims=True)
        on = a + along[:, None] * (b - a) + radii.mean() * out
        nearer = (distance := np.linalg.norm(points - on, axis=1)) < best
        best, found, normals = np.minimum(best, distance), np.where(nearer[:, None], on, found), np.where(nearer[:, None], out, normals)
    return found, normals


on_model, outward = closest_on_cylinders(surface.points)
pull = surface.points - on_model
distance = np.linalg.norm(pull, axis=1, keepdims=True)
m_F = np.maximum((outward * surface.normals).sum(1, keepdims=True), 0)
forces = np.minimum(m_F * distance, bound) * pull / np.maximum(distance, 1e-9)  # eq. 32


def bones(panel, pose, colour, **how):
    """Draw a pose's skeleton from the side."""
    where = dict(zip(body.landmark_names, body.points(pose[None])[0][:, from_side]))
    for n, (a, b) in enumerate((a, b) for a, b in BONES if a in where and b in where):
        panel.plot(*np.transpose([where[a], where[b]]), color=colour, **(how if n == 0 else {k: v for k, v in how.items() if k != "label"}))


figure, axes = new_figure(1, 3, width=11, height=4.2, sharey=True)
for pose in proposed:
    bones(axes[0, 0], pose, COLOURS[4], linewidth=0.6, alpha=0.5)
bones(axes[0, 0], truth, "black", linewidth=1.5, label="true pose")
axes[0, 0].set_title("step 3: proposals", fontsize=9)
bones(axes[0, 1], proposed[0], COLOURS[1], linewidth=1.5)
axes[0, 1].quiver(*on_model[:, from_side].T, *forces[:, from_side].T, angles="xy", scale_units="xy", scale=0.4, width=0.003,
                  color=COLOURS[0])  # fmt: skip
axes[0, 1].set_title("V-B: forces on one of them", fontsize=9)

# %% [markdown]
# ## Step 4: refinement
#
# All forty proposals are moved by their forces, iteration by iteration, until these balance (`Refiner.forces`): the first half of the
# iterations with a coarse bound of the forces, the second with a fine one.

# %%
refiner, iterations = tracker.refiner, (0, 2, 5, 10, 20, 40, 80)
refined = [refiner.forces(proposed, cloud, ForceSettings(iterations=n)) for n in iterations]
for n, poses in zip(iterations, refined):
    error = 1000 * np.linalg.norm(body.points(poses) - body.points(truth[None]), axis=2).mean(1)
    print(f"{n:3} iterations: D {1e6 * refiner.costs(poses, cloud).mean():6.0f} mm^2, joints {error.mean():5.1f} mm off, "
          f"particles {1000 * body.points(poses).std(0).mean():4.1f} mm apart")
poses = refined[iterations.index(settings.forces.iterations)]
for pose in poses:
    bones(axes[0, 2], pose, COLOURS[4], linewidth=0.6, alpha=0.5)
bones(axes[0, 2], truth, "black", linewidth=1.5, label="true pose")
axes[0, 2].set_title("step 4: refined", fontsize=9)
for panel in axes[0]:
    panel.set_aspect("equal")
    panel.axis("off")
save_picture(figure, Path("ni2008_one_frame_forces.png"))

# %% [markdown]
# *Forty proposals of the prior; the forces that the surface points exert on one of them; all forty after refinement. Black: the true
# pose.*
#
# ## Step 5: weights and estimate
#
# D is the mean over the points of the bounded squared distance, modulated by the normals (eqs. 30, 31); a particle's weight is exp(-D /
# sigma^2) (eq. 29), and the estimate the particle of greatest weight.

# %%
D = refiner.costs(poses, cloud)
log_weights = -D / settings.sigma_cost**2  # eq. 29
weights = np.exp(log_weights - log_weights.max())
estimate = poses[np.argmax(weights)]
error = 1000 * np.linalg.norm(body.points(estimate[None]) - body.points(truth[None]), axis=2).mean()
effective = weights.sum() ** 2 / (weights**2).sum()
print(f"estimate: joints {error:.1f} mm off; {effective:.0f} of {len(poses)} particles are effective")
figure, axes = new_figure(1, 3, width=7, height=4)
for panel, n in zip(axes[0], (0, 2, 4)):
    large = case.cameras[n].resized((1280, 960))
    image = np.where(masks[n][..., None], 245, 110).astype(np.uint8).repeat(3, axis=2)
    image = np.asarray(cv2.resize(image, large.size, interpolation=cv2.INTER_NEAREST), np.uint8)
    draw_model(image, Picture(body, large, large.T_camera_world), estimate)
    panel.imshow(image[around(np.asarray(cv2.resize(masks[n].astype(np.uint8), large.size), bool))][..., ::-1])
    panel.axis("off")
save_picture(figure, Path("ni2008_one_frame_estimate.png"))

# %% [markdown]
# *The estimate over three of the silhouettes.*
#
# `MultiviewTracker.cycle` is these five steps in one call. Where to go on: the paper's figures and Table II are in the papers'
# experiments (`docs/reproduction.md`); all formulas in `docs/method.md`; `shadowpuppet track FOLDER --preset ni2008` tracks a recording
# this way, and without `--preset` by Gauss-Newton in place of forces, which is faster and nearer.
