"""A stand-in for the part of ROS 2 that the example node uses: messages with the fields and types of ROS's definitions (common_interfaces,
Humble), and a node that keeps what is published. As in rclpy, an unknown field or a value of another type raises."""

from __future__ import annotations

import types
from typing import Any


class Message:
    """A message; FIELDS: the fields that are used, by name, with their types."""

    FIELDS: dict[str, Any] = {}  # noqa: RUF012
    __slots__ = ("values",)

    def __init__(self, **values: Any) -> None:
        object.__setattr__(self, "values", {name: kind() for name, kind in self.FIELDS.items()})
        for name, value in values.items():
            setattr(self, name, value)

    def __getattr__(self, name: str) -> Any:
        try:
            return self.values[name]
        except KeyError:
            raise AttributeError(name) from None

    def __setattr__(self, name: str, value: Any) -> None:
        if name not in self.FIELDS:
            raise AttributeError(f"{type(self).__name__} has no field {name!r}")
        assert isinstance(value, self.FIELDS[name]), f"{name}: found {type(value).__name__}, expected {self.FIELDS[name].__name__}"
        self.values[name] = value


def message(kind: str, /, *, constants: dict[str, int] | None = None, **fields: Any) -> type[Message]:
    return type(kind, (Message,), {"FIELDS": fields, "__slots__": (), **(constants or {})})


Time = message("Time", sec=int, nanosec=int)
Header = message("Header", stamp=Time, frame_id=str)
Point = message("Point", x=float, y=float, z=float)
Vector3 = message("Vector3", x=float, y=float, z=float)
Quaternion = message("Quaternion", x=float, y=float, z=float, w=float)
Transform = message("Transform", translation=Vector3, rotation=Quaternion)
TransformStamped = message("TransformStamped", header=Header, child_frame_id=str, transform=Transform)
Pose = message("Pose", position=Point, orientation=Quaternion)
JointState = message("JointState", header=Header, name=list, position=list, velocity=list, effort=list)
ColorRGBA = message("ColorRGBA", r=float, g=float, b=float, a=float)
Marker = message("Marker", constants={"ADD": 0, "DELETEALL": 3, "LINE_LIST": 5}, header=Header, ns=str, id=int, type=int, action=int,
                 pose=Pose, scale=Vector3, color=ColorRGBA, lifetime=message("Duration", sec=int, nanosec=int), points=list,
                 colors=list)  # fmt: skip
MarkerArray = message("MarkerArray", markers=list)

NOW = 1000.0
"""The node's clock, seconds."""


class Duration:
    """Of time, as `rclpy.duration.Duration`; a moment, too."""

    def __init__(self, *, seconds: float = 0.0, kind: type[Message] = Marker.FIELDS["lifetime"]) -> None:
        self.seconds, self.kind = seconds, kind

    def __sub__(self, other: Duration) -> Duration:
        return Duration(seconds=self.seconds - other.seconds, kind=self.kind)

    def to_msg(self) -> Message:
        return self.kind(sec=int(self.seconds), nanosec=round(1e9 * (self.seconds % 1)))


class Node:
    """Keeps what is published, by topic."""

    published: dict[str, list[Message]] = {}  # noqa: RUF012

    def __init__(self, name: str) -> None:
        Node.published.clear()

    def declare_parameter(self, name: str, value: Any) -> Any:
        return types.SimpleNamespace(value=PARAMETERS.get(name, value))

    def create_publisher(self, kind: type[Message], topic: str, depth: int) -> Any:
        def publish(each: Message) -> None:
            assert isinstance(each, kind)
            self.published.setdefault(topic, []).append(each)

        return types.SimpleNamespace(publish=publish)

    def get_clock(self) -> Any:
        return types.SimpleNamespace(now=lambda: Duration(seconds=NOW, kind=Time))


PARAMETERS: dict[str, Any] = {}
"""Values that parameters have in place of their defaults."""


class TransformBroadcaster:
    """Publishes on /tf."""

    def __init__(self, node: Node) -> None:
        self.node = node

    def sendTransform(self, transforms: list[Message]) -> None:
        assert all(isinstance(each, TransformStamped) for each in transforms)
        self.node.published.setdefault("/tf", []).extend(transforms)


def modules() -> dict[str, types.ModuleType]:
    """The modules, by name."""
    contents: dict[str, dict[str, Any]] = {
        "rclpy": {"init": lambda: None, "try_shutdown": lambda: None},
        "rclpy.node": {"Node": Node}, "rclpy.duration": {"Duration": Duration},
        "geometry_msgs": {}, "sensor_msgs": {}, "std_msgs": {}, "visualization_msgs": {},
        "geometry_msgs.msg": {"Point": Point, "Quaternion": Quaternion, "TransformStamped": TransformStamped, "Vector3": Vector3},
        "sensor_msgs.msg": {"JointState": JointState}, "std_msgs.msg": {"ColorRGBA": ColorRGBA},
        "visualization_msgs.msg": {"Marker": Marker, "MarkerArray": MarkerArray}, "tf2_ros": {"TransformBroadcaster": TransformBroadcaster},
    }  # fmt: skip
    made = {}
    for name, content in contents.items():
        made[name] = types.ModuleType(name)
        vars(made[name]).update(content)
    return made
