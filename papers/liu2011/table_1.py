"""Table I: the paper's parameters beside those of the preset `liu2011`."""

from __future__ import annotations

from papers.common.claims import Verdict
from papers.common.experiment import Experiment, Outcome, Request, Table
from shadowpuppet.tracking.monocular.settings import make_settings

PAPER = {
    "N": (200, 200, 200),
    "e": (0.2, 0.4, 0.4),
    "sigma_beta for rotation (rad)": (0.1, 0.25, 0.25),
    "sigma_beta for translation (cm)": (2.0, None, None),
    "sigma_gamma (pixels)": (8000.0, 4000.0, 4000.0),
}
"""Torso, left arm, right arm; None: there is none."""


def make(request: Request) -> Outcome:
    """A row a parameter."""
    ours = preset()
    rows = [[f"{name}{who}", *values] for name in PAPER for who, values in ((": paper", PAPER[name]), (": `liu2011`", ours[name]))]
    differ = [name for name in PAPER if PAPER[name] != ours[name]]
    total = sum(int(n) for n in ours["N"] if n)
    got = f"{total} particles in {make_settings('liu2011').stages}".replace("'", "")
    return Outcome(
        settings={"preset": make_settings("liu2011")},
        tables={"table_1": Table(("parameter", "torso", "left arm", "right arm"), rows, shown=True)},
        verdicts=[Verdict("The parameters of all experiments (600 particles in all)", "Table I",
                          f"the preset's are {'the same; ' + got if not differ else 'others: ' + ', '.join(differ)}", not differ)],
    )  # fmt: skip


def preset() -> dict[str, tuple[float | None, ...]]:
    """What the preset has, as the table."""
    settings = make_settings("liu2011")
    of = (settings.torso, settings.arm, settings.arm)
    return {
        "N": tuple(part.particles for part in of),
        "e": tuple(part.survival for part in of),
        "sigma_beta for rotation (rad)": tuple(part.sigma_rotation for part in of),
        "sigma_beta for translation (cm)": (100 * settings.torso.sigma_translation, None, None),
        "sigma_gamma (pixels)": tuple(part.sigma_cost for part in of),
    }


EXPERIMENT = Experiment("table_1", "Table I: the parameters, the paper's and the preset's", "no time", make)
