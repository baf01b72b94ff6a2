"""Settings of segmentation, documented here and nowhere else."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field

from shadowpuppet.settings import checked
from shadowpuppet.silhouette.classifiers import METHODS

Method = str if TYPE_CHECKING else Literal[("auto", *METHODS)]


@checked
class SilhouetteSettings:
    """How a person is told from the background. The defaults serve any film; `averaging` is Liu 2011, eq. 1, to the letter."""

    method: Method = "auto"
    """What is compared: brightness, colour (Cr and Cb), both, or the one of these that `auto` finds fit for the background; the
    plain rule of eq. 1 (`averaging`); a mixture of Gaussians (`mog2`) or nearest neighbours (`knn`), frozen after learning."""
    factor: Annotated[float, Field(gt=0, le=100)] = 2.0
    """A pixel is foreground where it differs by this many standard deviations (eq. 1). Brightness, colour and both also ask that
    it hangs together with pixels that differ by twice as much; mog2 and knn have thresholds of their own."""
    noise_floor: Annotated[float, Field(ge=0, le=100)] = 2.5
    """Least standard deviation assumed (grey levels; three quarters of it for colour). Not used by `averaging`."""
    shadow: bool = True
    """Whether a pixel that keeps its colour and loses up to half of its light is taken for the background in shadow. A grey film
    has no colour to keep: nothing is taken for shadow there. Not used by `averaging`."""
    clean: bool | None = None
    """Whether specks and small holes are removed, the person alone is kept, and the outline is drawn where the contrast has
    fallen to half. Left out: for every method but `averaging`."""

    @property
    def cleaned(self) -> bool:
        """Whether masks are cleaned: `clean`, or what it is by default."""
        return self.method != "averaging" if self.clean is None else self.clean
