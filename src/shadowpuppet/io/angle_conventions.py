"""Writes angles.toml of a run folder: what each of its angles means."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from shadowpuppet.body.anthropometry import AVERAGE_HEIGHT
from shadowpuppet.body.conventions import Convention, conventions
from shadowpuppet.body.models import MODELS, average_sizes, make_body
from shadowpuppet.io.files.text import write_whole

ABOUT = {
    "frame": "x forward, y to the person's left, z up; every joint's axes are parallel to these when all angles are zero",
    "sequence": "angles of a joint act by their order, each about its axis as those before have turned it; components of a rotation vector "
                "are one rotation about their sum, by its length; turns are right-handed about the axis",
    "isb": "names of the International Society of Biomechanics (Wu et al. 2002, 2005); isb_sign -1: ours is positive the other way",
}


def write_angles(path: str | Path, body_name: str, dof_names: Sequence[str]) -> bool:
    """Write angles.toml for a body by name; returns whether it is one of ours with these degrees of freedom. Raises `ShadowPuppetError` if
    that fails."""
    import tomli_w

    if body_name not in MODELS:
        return False
    body = make_body(body_name, average_sizes(body_name, AVERAGE_HEIGHT))  # conventions do not depend on sizes
    if tuple(dof_names) != body.skeleton.dof_names:
        return False
    write_whole(Path(path), tomli_w.dumps({"body": body_name} | ABOUT | {each.dof.name: _entry(each) for each in conventions(body)}))
    return True


def _entry(each: Convention) -> dict[str, Any]:
    dof, (name, sign) = each.dof, each.isb
    kind = {"rotation": "angle", "vector": "component of a rotation vector", "translation": "translation"}[dof.kind]
    entry: dict[str, Any] = {"unit": "m" if dof.kind == "translation" else "rad", "kind": kind, "joint": dof.joint}
    entry |= {"parent": each.parent} if each.parent else {}
    entry |= {"order": each.order, "axis": dof.axis, "zero": each.zero, "positive": each.positive}
    entry |= {"low": round(dof.low, 4), "high": round(dof.high, 4)} if np.isfinite([dof.low, dof.high]).all() else {}
    return entry | ({"isb": name, "isb_sign": sign} if name else {})
