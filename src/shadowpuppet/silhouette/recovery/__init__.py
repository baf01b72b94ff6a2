"""The empty scene recovered from a film that never shows it: the person is there from the first frame to the last.

`recover_scene` takes frames spread over the film. Nothing is known of the person but that it moves, if only a little.
"""

from shadowpuppet.silhouette.recovery.scene import RecoveredScene, recover_scene

__all__ = ["RecoveredScene", "recover_scene"]
