"""Table I: the recordings, and how many frames are learnt from and tracked."""

from __future__ import annotations

from papers.common.claims import Verdict
from papers.common.experiment import Outcome, Request, Table
from papers.ni2008.inputs import cases

PAPER = {"walking": (100, 433), "jogging": (100, 393), "boxing": (100, 377)}
"""Training and testing sizes."""
CAMERAS, SIZE = 7, (640, 480)


def make(request: Request) -> Outcome:
    """Count."""
    some = cases(request)
    rows = [(case.motion, len(case.training), case.frames, len(case.cameras), "{} x {}".format(*case.cameras[0].size), case.rate,
             round(case.around)) for case in some]  # fmt: skip
    table = Table(("motion", "training size, frames", "testing size, frames", "cameras", "pictures", "frames/s", "surface points a frame"),
                  rows, shown=True)
    same = {case.motion: PAPER.get(case.motion) == (len(case.training), case.frames) and len(case.cameras) == CAMERAS
            and all(camera.size == SIZE for camera in case.cameras) for case in some}  # fmt: skip
    verdict = Verdict("100 frames to learn from; 433 (walking), 393 (jogging), 377 (boxing) to track, in seven views of 640 x 480",
                      "VI, Table I", "; ".join(f"{case.motion} {len(case.training)} and {case.frames}" for case in some),
                      all(same.values()) and set(same) == set(PAPER), "table_1.csv")
    return Outcome({}, {}, {"table_1": table}, [verdict])
