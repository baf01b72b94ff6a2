"""How well the feet stand: slide and depth in contact, and contacts compared with a truth's."""

from __future__ import annotations

from typing import Any

import numpy as np

from shadowpuppet.io.contacts import ContactTable
from shadowpuppet.motion.contact.contact import contacts_of
from shadowpuppet.motion.contact.stance import agreement, depth, slide
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.motion.synchronization import match


def standing_figures(run: JointTable, truth: JointTable | None = None, true_contacts: ContactTable | None = None) -> dict[str, Any]:
    """How a run's heels and toes stand; empty for a run without them.

    Slide (mm/s) and depth (mm) while they are in contact as found in the run itself, and the height of the floor (m). With a truth that has
    contacts, on the run's clock and in its world: the same of the run's points while the truth's are in contact, slide of the truth's,
    precision and recall of the run's contacts.
    """
    found = contacts_of(run)
    if found is None:
        return {}
    points = run.select(found.names).positions
    out: dict[str, Any] = {"floor_m": found.floor, "slide_mm_s": 1000 * slide(run.times, points, found.touching),
                           "depth_mm": {name: 1000 * value for name, value in depth(points, found.touching, found.floor).items()}}
    names = [name for name in found.names if true_contacts is not None and truth is not None and name in true_contacts.names
             and name in truth.names]
    if not names or truth is None or true_contacts is None:
        return out
    index, near = match(run.times, truth.times)
    flag, also = match(true_contacts.times, truth.times)
    used = near & also
    touching = true_contacts.touching[flag[used]][:, [true_contacts.names.index(name) for name in names]]
    times, theirs, ours = truth.times[used], truth.select(names).positions[used], run.select(names).positions[index[used]]
    own = found.touching[index[used]][:, [found.names.index(name) for name in names]]
    touching = touching & np.isfinite(theirs).all(2)
    true = {"slide_mm_s": 1000 * slide(times, ours, touching), "truth_slide_mm_s": 1000 * slide(times, theirs, touching),
            "depth_mm": {name: 1000 * value for name, value in depth(ours, touching, found.floor).items()}}
    return out | {"true_stance": true | agreement(own, touching)}
