"""Frames of a fixed camera to silhouettes of a person.

`learn_background` learns the empty scene; the `Segmenter` that it returns turns each frame into a mask.
"""

from shadowpuppet.silhouette.background import background_from_film
from shadowpuppet.silhouette.learning import learn_background
from shadowpuppet.silhouette.ready_mask import ready_mask
from shadowpuppet.silhouette.segmenter import Segmenter
from shadowpuppet.silhouette.settings import SilhouetteSettings

__all__ = ["Segmenter", "SilhouetteSettings", "background_from_film", "learn_background", "ready_mask"]
