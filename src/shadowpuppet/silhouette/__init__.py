"""Frames of a fixed camera to silhouettes of a person.

`learn_background` learns the empty scene; the `Segmenter` that it returns turns each frame into a mask. Where there is no empty scene,
`recover_scene` recovers it from the film.
"""

from shadowpuppet.silhouette.external.ready_mask import ready_mask
from shadowpuppet.silhouette.learning import learn_background
from shadowpuppet.silhouette.recovery import RecoveredScene, recover_scene
from shadowpuppet.silhouette.segmenter import Segmenter
from shadowpuppet.silhouette.settings import SilhouetteSettings

__all__ = ["RecoveredScene", "Segmenter", "SilhouetteSettings", "learn_background", "ready_mask", "recover_scene"]
