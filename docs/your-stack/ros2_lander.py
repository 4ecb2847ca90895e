"""A plain ROS 2 node that lands on what is white in the picture; it knows nothing of pytest-garl.

For each image it publishes one command with the stamp of the image.
"""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np


def turned(vector: Any, attitude: Any) -> Any:
    """Return a vector of the body in the world; the attitude is x, y, z, w."""
    axis, w = np.array(attitude[:3]), attitude[3]
    return vector + 2 * np.cross(axis, np.cross(axis, vector) + w * vector)


class WhiteLander:
    """Flies to the coordinate, takes the middle of what is white for the marker, descends on it."""

    def __init__(self, gps_position_m: Any, search_altitude_m: float, focal_px: float) -> None:
        self.goal = tuple(gps_position_m)
        self.search_altitude_m, self.focal_px = search_altitude_m, focal_px
        self.lands = False

    def __call__(self, image: Any, place: Any, attitude: Any) -> Any:
        """Return the place to fly to, or None to land."""
        x, y, z = place
        rows, columns = np.nonzero(image.min(axis=2) > 200)
        seen = len(rows) > 10
        if seen:
            height, width = image.shape[:2]
            # Image down is the body's back, image right the body's right; the camera looks down.
            ray = np.array(
                [
                    ((height - 1) / 2 - float(rows.mean())) / self.focal_px,
                    ((width - 1) / 2 - float(columns.mean())) / self.focal_px,
                    -1.0,
                ]
            )
            east, north, up = (float(each) for each in turned(ray, attitude))
            self.goal = (x + z * east / -up, y + z * north / -up)
        beside = math.hypot(self.goal[0] - x, self.goal[1] - y)
        self.lands = self.lands or (seen and z < 1.0 and beside < 0.3)
        if self.lands:
            return None
        if not seen:
            return (*self.goal, self.search_altitude_m)
        return (*self.goal, max(z - 1.0, 0.5) if beside < 0.5 else z)


def main() -> None:
    """Run the node until it is ended."""
    import rclpy
    from geometry_msgs.msg import PoseStamped
    from rclpy.node import Node
    from rclpy.qos import DurabilityPolicy, QoSProfile
    from sensor_msgs.msg import CameraInfo, Image
    from std_msgs.msg import Header, String

    class Lander(Node):
        def __init__(self) -> None:
            super().__init__("lander")
            self.rule: Any = None
            self.mission: Any = None
            self.seen: dict[str, dict[tuple[int, int], Any]] = {}
            self.to_pose = self.create_publisher(PoseStamped, "/cmd/pose", 10)
            self.to_land = self.create_publisher(Header, "/cmd/land", 10)
            latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
            self.create_subscription(String, "/mission", self.on_mission, latched)
            for kind, topic in (
                (Image, "/camera/image_raw"),
                (CameraInfo, "/camera/camera_info"),
                (PoseStamped, "/pose"),
            ):
                self.create_subscription(kind, topic, self.collecting(topic), 10)

        def on_mission(self, message: Any) -> None:
            self.mission = json.loads(message.data)
            self.answer()

        def collecting(self, topic: str) -> Any:
            def take(message: Any) -> None:
                stamp = (message.header.stamp.sec, message.header.stamp.nanosec)
                self.seen.setdefault(topic, {})[stamp] = message
                self.answer()

            return take

        def answer(self) -> None:
            """Answer an image once all that bears its stamp is there."""
            stamps = [set(each) for each in self.seen.values()]
            if self.mission is None or len(stamps) < 3 or not set.intersection(*stamps):
                return
            stamp = min(set.intersection(*stamps))
            image, info, pose = (
                self.seen[topic].pop(stamp)
                for topic in ("/camera/image_raw", "/camera/camera_info", "/pose")
            )
            if self.rule is None:
                told = self.mission
                self.rule = WhiteLander(
                    told["gps_position_m"], told["search_altitude_m"], float(info.k[0])
                )
            at, q = pose.pose.position, pose.pose.orientation
            picture = np.frombuffer(image.data, np.uint8).reshape(image.height, image.width, 3)
            goal = self.rule(picture, (at.x, at.y, at.z), (q.x, q.y, q.z, q.w))
            if goal is None:
                self.to_land.publish(image.header)
                return
            command = PoseStamped(header=image.header)
            place = command.pose.position
            place.x, place.y, place.z = (float(each) for each in goal)
            self.to_pose.publish(command)

    rclpy.init()
    rclpy.spin(Lander())


if __name__ == "__main__":
    main()
