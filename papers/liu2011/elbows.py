"""III-A: the two rotations of an elbow, which the paper does not name: a hinge that rolls, as ours, or two bends."""

from __future__ import annotations

import numpy as np

from papers.common.claims import Verdict, difference
from papers.common.experiment import Experiment, Outcome, Request, Table
from papers.liu2011.material import cases
from papers.liu2011.repeats import FAR, METHODS, both
from papers.liu2011.shown import told
from shadowpuppet.motion.metrics import UPPER_JOINTS

BODIES = {"cardbox": "roll and flexion", "cardbox_bends": "two bends"}


def make(request: Request) -> Outcome:
    """A table a recording, of the same filter with either elbow."""
    outcome = Outcome()
    columns = ("elbow", "method", "3D error, mm", "2D error, px", "over 30 cm off, %")
    for hinge, bends in zip(*(cases(request, body=body) for body in BODIES)):
        rows, means = [], {}
        for case, what in zip((hinge, bends), BODIES.values()):
            for method, runs in both(request, case).items():
                errors = runs.errors(UPPER_JOINTS)
                means[what, method] = np.nanmean(errors, (1, 2))
                rows.append([what, method, f"{1000 * means[what, method].mean():.0f}", f"{runs.costs.mean():.0f}",
                             f"{100 * (errors > FAR).mean():.1f}"])
        outcome.tables[f"elbows_{hinge.name}"] = Table(columns, rows, shown=True)
        outcome.settings |= told(hinge)
        for method in METHODS:
            first, second = (means[what, method] for what in BODIES.values())
            apart = difference(first, second)
            outcome.verdicts.append(Verdict(
                "Two bends, which are regular at a straight arm, track better than roll and flexion", f"ours, {method}",
                f"{hinge.name}: 3D error {1000 * first.mean():.0f} mm with roll and flexion, {1000 * second.mean():.0f} with two bends "
                f"({1000 * apart.value:.0f} ± {1000 * apart.error:.0f})", apart.greater, own=True))
    return outcome


EXPERIMENT = Experiment("elbows", "III-A: elbows that roll and flex, or bend twice", "a minute", make, runs=10, short_runs=2)
