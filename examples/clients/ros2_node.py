"""A ROS 2 node that publishes the person whom `shadowpuppet live --websocket 8601` tracks; needs `pip install websockets`.

    python examples/clients/ros2_node.py [--ros-args -p address:=ws://127.0.0.1:8601 -p frame:=map]

It publishes transforms from the fixed frame to `person/<joint>` on /tf, of joints that are vouched for; angles as sensor_msgs/JointState on
person/joint_states; and a stick figure for RViz as visualization_msgs/MarkerArray on person/markers, in which bones that are not vouched
for are orange. Units and axes are REP 103's: metres, radians, right-handed, Z up; a joint's frame has X forward, Y left, Z up when the
person stands with hanging arms. The fixed frame is the calibration's world (REP 105: name it `map`, or publish its place in `map`). Stamps
are the moments at which pictures were captured, on this machine's clock.

It has been tested against a stand-in for rclpy with ROS's message definitions, not in ROS itself.
"""

import json

import rclpy
from geometry_msgs.msg import Point, Quaternion, TransformStamped, Vector3
from rclpy.duration import Duration
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import ColorRGBA
from tf2_ros import TransformBroadcaster
from visualization_msgs.msg import Marker, MarkerArray
from websockets.sync.client import connect

SURE, DOUBTFUL = ColorRGBA(r=0.2, g=0.6, b=1.0, a=1.0), ColorRGBA(r=1.0, g=0.6, b=0.1, a=0.5)


class Person(Node):
    """Publishes the messages of a session."""

    def __init__(self):
        super().__init__("person")
        self.address = self.declare_parameter("address", "ws://127.0.0.1:8601").value
        self.frame = self.declare_parameter("frame", "map").value
        self.transforms = TransformBroadcaster(self)
        self.angles = self.create_publisher(JointState, "person/joint_states", 10)
        self.markers = self.create_publisher(MarkerArray, "person/markers", 10)

    def follow(self):
        with connect(self.address) as session:
            for message in map(json.loads, session):
                if message["type"] == "begin":
                    self.begin = message
                elif message["joints"] is None:  # the person is lost or absent: nothing is known
                    self.markers.publish(MarkerArray(markers=[Marker(action=Marker.DELETEALL)]))
                else:
                    self.publish(message)

    def publish(self, message):
        stamp = (self.get_clock().now() - Duration(seconds=message["age"] or 0.0)).to_msg()
        points = [Point(x=x, y=y, z=z) for x, y, z in message["joints"]]
        sure = [status == "tracked" for status in message["statuses"]]
        placed = [self.transform(stamp, *each) for each in zip(self.begin["joints"], points, message["rotations"])]
        self.transforms.sendTransform([each for each, known in zip(placed, sure) if known])
        angles = JointState(name=self.begin["angles"], position=message["angles"])
        angles.header.stamp = stamp
        self.angles.publish(angles)
        bones = Marker(ns="person", type=Marker.LINE_LIST, action=Marker.ADD)
        bones.header.stamp, bones.header.frame_id, bones.scale.x, bones.pose.orientation.w = stamp, self.frame, 0.03, 1.0
        bones.lifetime = Duration(seconds=0.5).to_msg()
        ends = [(n, end) for n, parent in enumerate(self.begin["parents"]) if parent >= 0 for end in (parent, n)]
        bones.points = [points[end] for _, end in ends]
        bones.colors = [SURE if sure[n] else DOUBTFUL for n, _ in ends]
        self.markers.publish(MarkerArray(markers=[bones]))

    def transform(self, stamp, joint, point, rotation):
        made = TransformStamped(child_frame_id=f"person/{joint}")
        made.header.stamp, made.header.frame_id = stamp, self.frame
        made.transform.translation = Vector3(x=point.x, y=point.y, z=point.z)
        made.transform.rotation = Quaternion(**dict(zip("xyzw", rotation)))
        return made


rclpy.init()
try:
    Person().follow()
except KeyboardInterrupt:
    pass
finally:
    rclpy.try_shutdown()
