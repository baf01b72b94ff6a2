"""Reads multical's calibration.json: lenses under `cameras`, places under `camera_poses`, as `<camera>_to_<first camera>`.

A pose takes points of the first camera to the camera: p_camera = R p_first + T.
"""

from __future__ import annotations

from typing import Any

from shadowpuppet.errors import CalibrationError, choices, shown

IGNORED = ("image_sets",)
"""Keys of the whole file that do not describe cameras."""


def is_multical(values: Any) -> bool:
    """Whether a JSON file's content is multical's."""
    return isinstance(values, dict) and all(isinstance(values.get(key), dict) for key in ("cameras", "camera_poses"))


def with_poses(values: dict[str, Any]) -> dict[str, Any]:
    """The file's content with each pose in its camera, for `read_json`. Raises `CalibrationError` for a pose that cannot be used."""
    cameras, reference = values["cameras"], set()
    placed = {name: {**lens} for name, lens in cameras.items() if isinstance(lens, dict)}
    for key, pose in values["camera_poses"].items():
        name, to = _of(key, cameras)
        if name not in placed or not isinstance(pose, dict) or set(pose) != {"R", "T"}:
            raise CalibrationError(f"camera_poses: found {shown(key)}, expected <camera>_to_<camera> with R and T, of the cameras "
                                   f"{choices(cameras)}")
        reference |= {to} - {None}
        placed[name] |= {"R": pose["R"], "T": pose["T"]}
    if len(reference) > 1:
        raise CalibrationError(f"camera_poses: found poses relative to {choices(reference)}, expected all relative to one camera")
    return {**{key: value for key, value in values.items() if key not in ("camera_poses", *IGNORED)}, "cameras": placed}


def _of(key: str, cameras: dict[str, Any]) -> tuple[str, str | None]:
    """The camera of a pose's key, and the one that it is relative to."""
    if key in cameras:
        return key, None
    pairs = ((name, key.removeprefix(f"{name}_to_")) for name in cameras if key.startswith(f"{name}_to_"))
    return next(((name, to) for name, to in pairs if to in cameras), ("", None))
