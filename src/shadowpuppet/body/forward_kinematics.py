"""Forward kinematics of blocks of poses: kernels on trees of joints as arrays."""

from __future__ import annotations

import numpy as np

from shadowpuppet.jit import device, kernel

# Coefficients of fdlibm's kernels (Sun Microsystems 1993): sine and cosine within pi / 4, and pi / 2 in three parts.
_SINE = (-1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04,
         2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10)  # fmt: skip
_COSINE = (4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05,
           -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11)  # fmt: skip
_QUARTER = (1.57079632673412561417, 6.07710050630396597660e-11, 2.02226624879595063154e-21)
TRANSLATION, ROTATION, VECTOR = 0, 1, 2
DOF_KINDS = {"translation": TRANSLATION, "rotation": ROTATION, "vector": VECTOR}
"""Kinds of DOF: along an axis, about an axis, a component of a rotation vector (three in a row)."""


@device
def sines(angles, sine, cosine):  # pragma: no cover
    """Sine and cosine (B,) of angles (B,), to the last bit or two for angles under 1e5 rad; the C library's do not vectorise."""
    s0, s1, s2, s3, s4, s5 = _SINE
    c0, c1, c2, c3, c4, c5 = _COSINE
    for n in range(angles.size):
        turns = np.floor(angles[n] * (2 / np.pi) + 0.5)
        x = ((angles[n] - turns * _QUARTER[0]) - turns * _QUARTER[1]) - turns * _QUARTER[2]
        z = x * x
        s = x + x * z * (s0 + z * (s1 + z * (s2 + z * (s3 + z * (s4 + z * s5)))))
        c = 1 - 0.5 * z + z * z * (c0 + z * (c1 + z * (c2 + z * (c3 + z * (c4 + z * c5)))))
        quarter = turns - 4 * np.floor(0.25 * turns)
        odd = (quarter == 1) | (quarter == 3)
        up, along = (c, s) if odd else (s, c)
        sine[n] = -up if quarter >= 2 else up
        cosine[n] = -along if (quarter == 1) | (quarter == 2) else along


@device
def _begin_joint(poses, begin, j, tree, offsets, root, T, offset):  # pragma: no cover
    """Transforms (3, 4, B) of joint `j` before its DOF: the parent's, shifted by the joint's offset (3, B) and couplings."""
    parent, coupled, shifts = tree[0][j], tree[5], tree[6]
    own, last = T[j], poses.shape[0] - 1
    for r in range(3):
        for n in range(T.shape[3]):
            offset[r, n] = offsets[0, j, r]
        if offsets.shape[0] > 1:
            for n in range(T.shape[3]):
                offset[r, n] = offsets[min(begin + n, last), j, r]
    for k in range(coupled.shape[0]):
        if coupled[k, 0] == j:
            for n in range(T.shape[3]):
                value = poses[min(begin + n, last), coupled[k, 1]]
                for r in range(3):
                    offset[r, n] += value * shifts[k, r]
    for r in range(3):
        for c in range(4):
            for n in range(T.shape[3]):
                own[r, c, n] = root[r, c] if parent < 0 else T[parent, r, c, n]
        x, y, z, place = own[r, 0], own[r, 1], own[r, 2], own[r, 3]
        for n in range(T.shape[3]):
            place[n] += x[n] * offset[0, n] + y[n] * offset[1, n] + z[n] * offset[2, n]


@kernel
def place_joints(poses, begin, joints, tree, offsets, root, T, work):  # pragma: no cover
    """Transforms of `joints` into a block T (J, 3, 4, B), for B poses from `begin` on; past the end the last pose is repeated. Each is
    the parent's transform, its offset, its DOF; a rotation about an axis mixes the other two columns. `work`: (6, B). Always called with
    arguments of the same types (all joints are `tree[7]`, no range), so that it is compiled once."""
    first, axes, signs, kinds = tree[1], tree[2], tree[3], tree[4]
    value, sine, cosine = work[3], work[4], work[5]
    for j in joints:
        _begin_joint(poses, begin, j, tree, offsets, root, T, work)
        for d in range(first[j], first[j + 1]):
            for n in range(value.size):
                value[n] = signs[d] * poses[min(begin + n, poses.shape[0] - 1), d]
            if kinds[d] == ROTATION:
                sines(value, sine, cosine)
                _turn(T[j], (axes[d] + 1) % 3, (axes[d] + 2) % 3, sine, cosine)
            elif kinds[d] == VECTOR:
                for n in range(value.size):
                    work[axes[d], n] = value[n]
                if axes[d] == 2:
                    _turn_by_vector(T[j], work)
            else:
                for r in range(3):
                    along, place = T[j, r, axes[d]], T[j, r, 3]
                    for n in range(value.size):
                        place[n] += along[n] * value[n]


@device
def _turn(T, a, b, sine, cosine):  # pragma: no cover
    """Rotate columns a and b of transforms (3, 4, B) by angles (B,)."""
    for r in range(3):
        u, v = T[r, a], T[r, b]
        for n in range(sine.size):
            x, y = u[n], v[n]
            u[n], v[n] = cosine[n] * x + sine[n] * y, cosine[n] * y - sine[n] * x


@device
def _turn_by_vector(T, work):  # pragma: no cover
    """Rotate transforms (3, 4, B) by the rotation vectors in the first rows of `work` (6, B): Rodrigues' formula, row by row. A row w
    becomes w + a (w x v) + b (w x v) x v, a = sin |v| / |v|, b = (1 - cos |v|) / |v|^2, both by half the angle, which loses no digits
    near zero."""
    u, v, w, half, sine, cosine = work[0], work[1], work[2], work[3], work[4], work[5]
    for n in range(half.size):
        half[n] = max(0.5 * np.sqrt(u[n] * u[n] + v[n] * v[n] + w[n] * w[n]), 1e-150)
    sines(half, sine, cosine)
    for r in range(3):
        x, y, z = T[r, 0], T[r, 1], T[r, 2]
        for n in range(half.size):
            share = sine[n] / half[n]
            a, b = share * cosine[n], 0.5 * share * share
            p, q, s = y[n] * w[n] - z[n] * v[n], z[n] * u[n] - x[n] * w[n], x[n] * v[n] - y[n] * u[n]
            x[n] += a * p + b * (q * w[n] - s * v[n])
            y[n] += a * q + b * (s * u[n] - p * w[n])
            z[n] += a * s + b * (p * v[n] - q * u[n])


@device
def load_joints(transforms, begin, T):  # pragma: no cover
    """Copy transforms (N, J, 3, 4) from `begin` on into a block (J, 3, 4, B)."""
    for n in range(min(T.shape[3], transforms.shape[0] - begin)):
        for j in range(T.shape[0]):
            for r in range(3):
                for c in range(4):
                    T[j, r, c, n] = transforms[begin + n, j, r, c]


@kernel
def place_all(poses, joints, tree, offsets, root, out, T, work):  # pragma: no cover
    """Transforms of `joints` into `out` (N, J, 3, 4), which holds those of the others. Work arrays: T (J, 3, 4, B), work (6, B)."""
    for begin in range(0, poses.shape[0], T.shape[3]):
        load_joints(out, begin, T)
        place_joints(poses, begin, joints, tree, offsets, root, T, work)
        for n in range(min(T.shape[3], poses.shape[0] - begin)):
            for j in joints:
                for r in range(3):
                    for c in range(4):
                        out[begin + n, j, r, c] = T[j, r, c, n]


@kernel
def place_points(poses, tree, offsets, root, joints, places, out, T, work):  # pragma: no cover
    """Points (N, P, 3) at `places` (P, 3) in the frames of `joints` (P,). Work arrays: T (J, 3, 4, B), work (6, B)."""
    for begin in range(0, poses.shape[0], T.shape[3]):
        place_joints(poses, begin, tree[7], tree, offsets, root, T, work)
        for i in range(joints.size):
            x, y, z = places[i, 0], places[i, 1], places[i, 2]
            for r in range(3):
                row = T[joints[i], r]
                for n in range(min(T.shape[3], poses.shape[0] - begin)):
                    out[begin + n, i, r] = row[0, n] * x + row[1, n] * y + row[2, n] * z + row[3, n]
