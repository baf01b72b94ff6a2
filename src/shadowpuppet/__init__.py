"""Markerless motion capture from silhouettes: a jointed puppet is fitted to a person's shadow, on a CPU, with no neural network.

Everything here is loaded when it is first used, so that `import shadowpuppet` takes no time.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from shadowpuppet.body.sizes import AnatomicalSizes, CardboxSizes, CylinderSizes
    from shadowpuppet.camera.camera import Camera
    from shadowpuppet.camera.rasterize import Picture
    from shadowpuppet.errors import ShadowPuppetError, ShadowPuppetWarning
    from shadowpuppet.evaluation.evaluation import Comparison, Evaluation, measure_run
    from shadowpuppet.evaluation.report.page import write_report
    from shadowpuppet.io.calibration.calibration_files import read_calibration, write_calibration
    from shadowpuppet.io.export import convert_motion, export_run
    from shadowpuppet.io.motion.motion_files import read_motion, read_truth
    from shadowpuppet.io.motion.table import read_joints, write_joints
    from shadowpuppet.io.person import Person, read_person, write_person
    from shadowpuppet.io.prior import read_prior, write_prior
    from shadowpuppet.io.recording import Recording, read_recording
    from shadowpuppet.io.run import Run, read_run
    from shadowpuppet.motion.inverse_kinematics import FittedPoses, fit_poses
    from shadowpuppet.motion.metrics import evaluate
    from shadowpuppet.motion.motion import JointTable, Motion
    from shadowpuppet.motion.prior.motion_prior import MotionPrior
    from shadowpuppet.motion.prior.settings import PriorSettings
    from shadowpuppet.motion.prior.vqpca import choose_regions, fit_prior
    from shadowpuppet.pipeline.findings.look import Look
    from shadowpuppet.pipeline.footage import open_footage
    from shadowpuppet.pipeline.options import Options, make_options
    from shadowpuppet.pipeline.prepare import look_at
    from shadowpuppet.pipeline.silhouettes import read_masks
    from shadowpuppet.pipeline.track import Listener, track_recording
    from shadowpuppet.silhouette import SilhouetteSettings, learn_background
    from shadowpuppet.synthetic import synthesize
    from shadowpuppet.tracking.monocular.initialization import find_person, fit_references
    from shadowpuppet.tracking.monocular.settings import MonocularSettings, make_settings
    from shadowpuppet.tracking.monocular.tracker import MonocularTracker
    from shadowpuppet.tracking.multiview.settings import HullSettings, MultiviewSettings, make_multiview_settings
    from shadowpuppet.tracking.multiview.surface.visual_hull import SurfacePoints, VisualHull
    from shadowpuppet.tracking.multiview.tracker import MultiviewTracker
    from shadowpuppet.video import open_frames, write_frames

    __version__: str

_HOMES = {
    "CardboxSizes": "body.sizes", "Camera": "camera.camera", "ShadowPuppetError": "errors", "ShadowPuppetWarning": "errors",
    "find_person": "tracking.monocular.initialization", "fit_references": "tracking.monocular.initialization",
    "read_calibration": "io.calibration.calibration_files", "write_calibration": "io.calibration.calibration_files",
    "read_joints": "io.motion.table", "write_joints": "io.motion.table", "Person": "io.person", "read_person": "io.person",
    "write_person": "io.person", "Recording": "io.recording", "read_recording": "io.recording", "Run": "io.run", "read_run": "io.run",
    "Look": "pipeline.findings.look", "evaluate": "motion.metrics", "JointTable": "motion.motion", "Motion": "motion.motion",
    "Options": "pipeline.options", "make_options": "pipeline.options", "Listener": "pipeline.track", "look_at": "pipeline.prepare",
    "track_recording": "pipeline.track", "Picture": "camera.rasterize", "MonocularSettings": "tracking.monocular.settings",
    "make_settings": "tracking.monocular.settings", "SilhouetteSettings": "silhouette", "learn_background": "silhouette",
    "synthesize": "synthetic", "MonocularTracker": "tracking.monocular.tracker", "open_frames": "video", "write_frames": "video",
    "MotionPrior": "motion.prior.motion_prior", "PriorSettings": "motion.prior.settings", "choose_regions": "motion.prior.vqpca",
    "fit_prior": "motion.prior.vqpca", "read_prior": "io.prior", "write_prior": "io.prior",
    "HullSettings": "tracking.multiview.settings", "SurfacePoints": "tracking.multiview.surface.visual_hull",
    "VisualHull": "tracking.multiview.surface.visual_hull", "FittedPoses": "motion.inverse_kinematics",
    "fit_poses": "motion.inverse_kinematics", "AnatomicalSizes": "body.sizes", "CylinderSizes": "body.sizes",
    "read_motion": "io.motion.motion_files", "MultiviewTracker": "tracking.multiview.tracker",
    "MultiviewSettings": "tracking.multiview.settings", "make_multiview_settings": "tracking.multiview.settings",
    "export_run": "io.export", "convert_motion": "io.export", "Comparison": "evaluation.evaluation",
    "Evaluation": "evaluation.evaluation", "measure_run": "evaluation.evaluation", "read_truth": "io.motion.motion_files",
    "write_report": "evaluation.report.page", "open_footage": "pipeline.footage", "read_masks": "pipeline.silhouettes",
}  # fmt: skip
"""Where each public name lives."""

__all__ = [  # noqa: RUF022 - loaded by __getattr__
    "CardboxSizes", "Camera", "JointTable", "Listener", "Look", "MonocularSettings", "MonocularTracker", "Motion", "Options", "Person",
    "Picture", "Recording", "Run", "ShadowPuppetError", "ShadowPuppetWarning", "SilhouetteSettings", "__version__", "evaluate",
    "find_person", "fit_references", "learn_background", "look_at", "make_options", "make_settings", "open_frames",
    "read_calibration", "read_joints", "read_person", "read_recording", "read_run", "synthesize", "track_recording",
    "write_calibration", "write_frames", "write_joints", "write_person",
    "MotionPrior", "PriorSettings", "choose_regions", "fit_prior", "read_prior", "write_prior", "HullSettings", "SurfacePoints",
    "VisualHull", "FittedPoses", "fit_poses", "AnatomicalSizes", "CylinderSizes",
    "read_motion", "MultiviewTracker", "MultiviewSettings", "make_multiview_settings", "export_run",
    "convert_motion", "Comparison", "Evaluation", "measure_run", "read_truth", "write_report",
    "open_footage", "read_masks",
]  # fmt: skip


def __getattr__(name: str) -> object:
    """Load a public name's home (PEP 562)."""
    if name == "__version__":
        from importlib.metadata import version

        return version("shadowpuppet")
    if name not in _HOMES:
        raise AttributeError(f"module 'shadowpuppet' has no attribute {name!r}")
    value = getattr(import_module(f"shadowpuppet.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """All public names, loaded or not."""
    return sorted({*globals(), *__all__})
