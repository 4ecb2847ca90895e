"""PX4's topics of ROS 2, for nodes that were written for px4_msgs.

    python px4_face.py NODE.py ...

starts the nodes, in a ROS domain of their own, and stands between them and pytest-garl.  The
vehicle holds its place until a node commands OFFBOARD, then flies to its setpoints, and lands when
it is told to.  The nodes' clock is the flight's: it waits for their answers to picture and clock.
"""

from __future__ import annotations

import array
import math
import subprocess
import sys
import time
from typing import Any

import garl_client
import garl_ros2
import rclpy
from px4_msgs.msg import TrajectorySetpoint, VehicleCommand, VehicleLocalPosition
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Image
from std_msgs.msg import Float32MultiArray

ANSWER_S = 2.0
"""How long in wall time an answer is waited for: not each frame and not each moment has one."""
OFFBOARD = 6.0
"""The main mode in the second parameter of VEHICLE_CMD_DO_SET_MODE."""


class Face:
    """The vehicle as the nodes see it; local positions begin at the home position."""

    def __init__(self, mission: dict[str, Any]) -> None:
        rclpy.init()
        self._home, self._camera = mission["home_m"], mission["camera"]
        self._mode = ""
        self._hold: list[float] | None = None
        self._seen = self._setpoint_us = 0
        self._setpoint: Any = None
        node = self._node = rclpy.create_node("px4")
        lossy = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
        self._clock = node.create_publisher(Clock, "/clock", 10)
        self._image = node.create_publisher(Image, "/vtol/downward_camera/image_raw", 10)
        place = "/fmu/out/vehicle_local_position_v1"
        self._place = node.create_publisher(VehicleLocalPosition, place, lossy)
        for kind, topic, take in (
            (TrajectorySetpoint, "/fmu/in/trajectory_setpoint", self._fly),
            (VehicleCommand, "/fmu/in/vehicle_command", self._obey),
            (Float32MultiArray, "/marker/pose", self._note),
        ):
            node.create_subscription(kind, topic, take, 10)
        ends = (self._image, self._place)
        self._wait(lambda: all(each.get_subscription_count() for each in ends), math.inf)
        self._wait(lambda: node.count_publishers("/fmu/in/trajectory_setpoint"), math.inf)

    def _wait(self, done: Any, limit_s: float = ANSWER_S) -> None:
        end = time.monotonic() + limit_s
        while not done() and time.monotonic() < end:
            rclpy.spin_once(self._node, timeout_sec=0.02)

    def _note(self, _: Any) -> None:
        self._seen += 1

    def _fly(self, message: Any) -> None:
        self._setpoint, self._setpoint_us = message, message.timestamp

    def _obey(self, message: Any) -> None:
        if message.command == VehicleCommand.VEHICLE_CMD_NAV_LAND:
            self._mode = "land"
        elif message.command == VehicleCommand.VEHICLE_CMD_DO_SET_MODE:
            self._mode = "offboard" if message.param2 == OFFBOARD else ""

    def command_for(self, seen: Any) -> tuple[str, dict[str, Any]]:
        """Show the nodes a frame, let their time go on, and return what the vehicle does."""
        image, place, clock = Image(), VehicleLocalPosition(), Clock()
        width, height = self._camera["width_px"], self._camera["height_px"]
        image.width, image.height, image.step, image.encoding = width, height, 3 * width, "rgb8"
        image.data = array.array("B", bytes(seen.image))
        place.x, place.y, place.z = (
            a - b for a, b in zip(seen.position_m, self._home, strict=True)
        )
        place.vx, place.vy, place.vz = seen.velocity_mps
        place.xy_valid = place.z_valid = place.v_xy_valid = place.v_z_valid = True
        nanoseconds = round((seen.time_s + garl_ros2.CLOCK_BEGINS_S) * 1e9)
        clock.clock.sec, clock.clock.nanosec = divmod(nanoseconds, 10**9)
        awaited = self._seen + 1
        self._place.publish(place)
        self._image.publish(image)
        self._wait(lambda: self._seen >= awaited)
        self._clock.publish(clock)
        if self._mode != "land":
            self._wait(lambda: self._setpoint_us >= nanoseconds // 1000 or self._mode == "land")
        if self._mode == "land":
            return "land", {"speed_mps": 0.7}
        if self._mode == "" or self._setpoint is None:
            self._hold = self._hold or list(seen.position_m)
            return "position", {"position_m": self._hold}
        goal = [a + b for a, b in zip(map(float, self._setpoint.position), self._home, strict=True)]
        return "position", {"position_m": goal, "yaw_rad": float(self._setpoint.yaw)}


def main(nodes: list[str]) -> None:
    """Start the nodes, and pass frames and commands until the flight ends."""
    link = garl_client.Link(frame="NED", reads=["image"])
    garl_ros2.choose_domain()
    options = ["--ros-args", "-p", "use_sim_time:=true"]
    started = [subprocess.Popen([sys.executable, each, *options]) for each in nodes]
    face = Face(link.mission)
    for seen in link:
        kind, fields = face.command_for(seen)
        link.send(kind, **fields)
    for each in started:
        each.terminate()


if __name__ == "__main__":
    main(sys.argv[1:])
