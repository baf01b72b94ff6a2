"""Names of the ways to smooth a motion."""

from __future__ import annotations

from typing import Literal

Method = Literal["off", "tracker", "butterworth"]
"""`tracker`: by the stated deviations and people's accelerations; `butterworth`: a low-pass filter; `off`: gaps only."""
