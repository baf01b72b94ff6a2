"""Settings of segmentation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field

from shadowpuppet.settings import checked
from shadowpuppet.silhouette.classifiers import METHODS

if TYPE_CHECKING:
    Method = str
else:
    Method = Literal[("auto", *METHODS)]


@checked
class SilhouetteSettings:
    """How a person is segmented from the background. The defaults suit any film; `averaging` is Liu 2011, eq. 1, unchanged."""

    method: Method = "auto"
    """Segmentation method. `brightness`, `colour` (Cr and Cb) and `both` name the channels that are compared with the background; `auto`
    is `both`, `colour` before a coloured wall, or `brightness` of a film without colour. `averaging` is eq. 1; `mog2`, a mixture of
    Gaussians, is frozen after learning."""
    factor: Annotated[float, Field(gt=0, le=100)] = 2.0
    """Least difference of a foreground pixel from the background, standard deviations (eq. 1). With brightness, colour and both it must
    also be connected to pixels that differ by twice as much; mog2 has thresholds of its own."""
    noise_floor: Annotated[float, Field(ge=0, le=100)] = 2.5
    """Least assumed standard deviation (grey levels; three quarters of it for colour). Not used by `averaging`."""
    shadow: bool = True
    """Whether a pixel that keeps its colour and loses up to half of its light counts as background in shadow. Has no effect on a grey
    film, which has no colour. Not used by `averaging`."""
    light: bool | None = None
    """Whether to follow changes of exposure and white balance, frame by frame. By default for every method but `averaging`."""
    stabilise: bool | None = None
    """Whether to follow a nudged or shaking camera, frame by frame, so that masks are those of a camera that stands still. By default for
    every method but `averaging`."""
    clean: bool | None = None
    """Whether to remove specks and small holes, keep only the person, and move the outline to half of the contrast. By default for
    every method but `averaging`."""

    @property
    def follows_light(self) -> bool:
        """Whether changes of light are followed: `light`, or its default."""
        return self.method != "averaging" if self.light is None else self.light

    @property
    def follows_camera(self) -> bool:
        """Whether movements of the camera are followed: `stabilise`, or its default."""
        return self.method != "averaging" if self.stabilise is None else self.stabilise

    @property
    def cleaned(self) -> bool:
        """Whether masks are cleaned: `clean`, or its default."""
        return self.method != "averaging" if self.clean is None else self.clean
