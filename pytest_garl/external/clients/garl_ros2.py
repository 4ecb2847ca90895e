"""Flies a ROS 2 node as a landing system of pytest-garl, in lock-step with the simulated time.

    python3 garl_ros2.py [--speed=1.5] COMMAND...

starts the node by COMMAND, in a ROS domain of its own, and stands between it and pytest-garl.  It
needs rclpy, rosgraph_msgs, sensor_msgs, geometry_msgs, std_msgs, and garl_client.py beside it.

The node gets /mission (a String, JSON), and for each frame /clock, /pose (PoseStamped), /velocity
(TwistStamped), /camera/camera_info and then /camera/image_raw, all of one stamp, in the frame
"map", which is ENU; its body is FLU, as REP 103 has it.  For each image it publishes one message
that bears the image's stamp: /cmd/pose (PoseStamped: fly there), /cmd/velocity (TwistStamped: fly
so in the world), /cmd/land or /cmd/abort (std_msgs/Header).  Time goes on when that is there:
use_sim_time makes the node's clock the flight's.
"""

from __future__ import annotations

import array
import fcntl
import json
import math
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import garl_client

CLOCK_BEGINS_S = 1.0
"""The stamp of the start: 0 means "no time" in ROS 2."""
DOMAINS = 100


def main(words: list[str]) -> None:
    """Start the node, and pass frames and commands until the flight or the node ends.

    Raises SystemExit with the usage if no command is given.
    """
    speed_mps = 3.0
    if words and words[0].startswith("--speed="):
        speed_mps = float(words.pop(0).partition("=")[2])
    if not words:
        raise SystemExit(__doc__)
    link = garl_client.Link(frame="ENU", reads=["image"])
    # Two flights at a time must not hear each other.
    choose_domain()
    node = subprocess.Popen(words, stdin=subprocess.DEVNULL)
    bridge = _Bridge(link.mission, node, speed_mps)
    for seen in link:
        kind, fields = bridge.command_for(seen)
        link.send(kind, **fields)
    node.terminate()


def choose_domain() -> None:
    """Take a ROS domain that no other flight of this machine has, until this process ends.

    Raises SystemExit if all are in use.
    """
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    for domain in range(1, DOMAINS + 1):
        name = Path(tempfile.gettempdir(), f"garl-ros-domain-{domain}")
        try:
            fcntl.flock(os.open(name, os.O_CREAT | os.O_RDWR), fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            continue
        os.environ["ROS_DOMAIN_ID"] = str(domain)
        return
    raise SystemExit(f"all {DOMAINS} ROS domains are in use by other flights")


class _Bridge:
    def __init__(self, mission: dict[str, Any], node: Any, speed_mps: float) -> None:
        import rclpy
        from geometry_msgs.msg import PoseStamped, TwistStamped
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.qos import DurabilityPolicy, QoSProfile
        from rosgraph_msgs.msg import Clock
        from sensor_msgs.msg import CameraInfo, Image
        from std_msgs.msg import Header, String

        rclpy.init()
        self._process, self._camera, self._speed_mps = node, mission["camera"], speed_mps
        self._stamp = (0, 0)
        self._answer: Any = None
        me = self._me = rclpy.create_node("garl")
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(me)
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._clock = me.create_publisher(Clock, "/clock", 10)
        self._pose = me.create_publisher(PoseStamped, "/pose", 10)
        self._velocity = me.create_publisher(TwistStamped, "/velocity", 10)
        self._info = me.create_publisher(CameraInfo, "/camera/camera_info", 10)
        self._image = me.create_publisher(Image, "/camera/image_raw", 10)
        self._kinds = Clock, PoseStamped, TwistStamped, CameraInfo, Image
        for kind, topic, take in (
            (PoseStamped, "/cmd/pose", self._to_pose),
            (TwistStamped, "/cmd/velocity", self._to_velocity),
            (Header, "/cmd/land", lambda message: ("land", {})),
            (Header, "/cmd/abort", lambda message: ("abort", {})),
        ):
            me.create_subscription(kind, topic, self._taking(take), 10)
        told = {key: value for key, value in mission.items() if key not in ("type", "memory")}
        me.create_publisher(String, "/mission", latched).publish(String(data=json.dumps(told)))
        self._wait(lambda: self._image.get_subscription_count() and self._commands())

    def _commands(self) -> int:
        topics = ("/cmd/pose", "/cmd/velocity", "/cmd/land", "/cmd/abort")
        return sum(self._me.count_publishers(topic) for topic in topics)

    def _wait(self, done: Any) -> None:
        """Wait; the limit of a call of pytest-garl ends a node that does not answer."""
        while not done():
            self._executor.spin_once(timeout_sec=0.02)
            status = self._process.poll()
            if status is not None and not done():
                raise SystemExit(f"the node ended with status {status}")

    def _taking(self, take: Any) -> Any:
        def callback(message: Any) -> None:
            stamp = getattr(message, "header", message).stamp
            if (stamp.sec, stamp.nanosec) == self._stamp and self._answer is None:
                self._answer = take(message)

        return callback

    def _to_pose(self, message: Any) -> Any:
        place, q = message.pose.position, message.pose.orientation
        yaw = math.atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z))
        goal = [place.x, place.y, place.z]
        return "position", {"position_m": goal, "speed_mps": self._speed_mps, "yaw_rad": yaw}

    def _to_velocity(self, message: Any) -> Any:
        v = message.twist.linear
        return "velocity", {"velocity_mps": [v.x, v.y, v.z], "yaw_rad": None}

    def command_for(self, seen: Any) -> Any:
        """Publish what a frame shows, and return the command that bears its stamp."""
        nanoseconds = round((seen.time_s + CLOCK_BEGINS_S) * 1e9)
        self._stamp, self._answer = divmod(nanoseconds, 10**9), None
        clock, pose, velocity, info, image = (kind() for kind in self._kinds)
        clock.clock.sec, clock.clock.nanosec = self._stamp
        for message in (pose, velocity, info, image):
            message.header.stamp.sec, message.header.stamp.nanosec = self._stamp
            message.header.frame_id = "map"
        at, q = pose.pose.position, pose.pose.orientation
        at.x, at.y, at.z = seen.position_m
        q.x, q.y, q.z, q.w = seen.attitude
        v = velocity.twist.linear
        v.x, v.y, v.z = seen.velocity_mps
        f, (cx, cy) = self._camera["focal_px"], self._camera["centre_px"]
        width, height = self._camera["width_px"], self._camera["height_px"]
        info.header.frame_id = image.header.frame_id = "camera"
        info.width, info.height = image.width, image.height = width, height
        info.k = [f, 0.0, cx, 0.0, f, cy, 0.0, 0.0, 1.0]
        info.p = [f, 0.0, cx, 0.0, 0.0, f, cy, 0.0, 0.0, 0.0, 1.0, 0.0]
        info.d = list(self._camera["distortion"]) or [0.0] * 5
        info.distortion_model = "rational_polynomial" if len(info.d) == 8 else "plumb_bob"
        image.encoding, image.step = "rgb8", 3 * width
        image.data = array.array("B", bytes(seen.image))
        self._clock.publish(clock)
        self._pose.publish(pose)
        self._velocity.publish(velocity)
        self._info.publish(info)
        self._image.publish(image)
        self._wait(lambda: self._answer is not None)
        return self._answer


if __name__ == "__main__":
    main(sys.argv[1:])
