"""What ``garl init --adapter`` writes: a landing system around a class with another interface."""

from __future__ import annotations

_ADAPTER = '''\
"""{name} as a landing system of pytest-garl. The lines with <- are guesses: make them yours."""

from __future__ import annotations

import math

from pytest_garl import (
    Abort,
    Airframe,
    Camera,
    Command,
    Detection,
    Diagnostics,
    Land,
    Mission,
    Observation,
    PositionSetpoint,
    VelocitySetpoint,
)
from pytest_garl.vehicle.ned import euler_of, turned
from {module} import {first}


class {adapter}:
    """Gives {name} each picture, and flies what it answers."""

    # Fixed to the body, which tilts; the field of view is that from left to right.
    camera = Camera(width_px=640, height_px=480, field_of_view_rad=math.radians(90))  # <-
    airframe = Airframe(camera=camera)

    def reset(self, mission: Mission) -> None:
        """Begin a flight. Mission has marker_id, marker_side_m, camera.matrix and more."""
        self.mission = mission
        self.is_there = False
        self.stack = {qualified}()  # <-

    def step(self, observation: Observation) -> Command:
        """Answer a picture. The UAV stands on the ground at first, metres from the marker."""
        # Delete these four lines if your stack takes off and flies there by itself.
        there_m = (*self.mission.gps_position_m, self.mission.search_altitude_m)
        self.is_there = self.is_there or math.dist(observation.position_m, there_m) < 1.0
        if not self.is_there:
            return PositionSetpoint(position_m=there_m)

        # The picture's top is the UAV's front. altitude_m is above the start; rangefinder_m, the
        # reading of a rangefinder that looks down, is None without one.
        image_bgr = observation.image[:, :, ::-1].copy()
        time_s, altitude_m = observation.time_s, float(observation.position_m[2])
        # Of aviation. From the east it is math.pi / 2 - heading_rad. As a quaternion, x, y, z, w of
        # FRD in NED: pytest_garl.external.axes.turned_attitude.
        roll_rad, pitch_rad, heading_rad = euler_of(observation.attitude)
        # turned() makes north, east, down of east, north, up, and back. observation.position_m and
        # observation.velocity_mps are east, north, up.
        north_mps, east_mps, down_mps = turned(observation.velocity_mps)
        answer = self.stack.update(  # <-
            image_bgr, altitude_m, heading_rad, (north_mps, east_mps, down_mps)
        )
        # What your stack saw, at the place where it takes the marker to be (east, north, up), such
        # as (Detection(marker_id=7, confidence=1.0, position_m=(x, y, 0.0)),). Reports show it.
        detections: tuple[Detection, ...] = ()  # <-
        seen = Diagnostics(detections=detections)
        if answer == "land":  # <-
            return Land(diagnostics=seen)
        if answer == "abort":  # <- it gives up
            return Abort(diagnostics=seen)
        # North, east, down; without turned() east, north, up. Of forward, right, down of a UAV that
        # is level: north = forward * cos(heading_rad) - right * sin(heading_rad),
        # east = forward * sin(heading_rad) + right * cos(heading_rad). None keeps the heading.
        return VelocitySetpoint(velocity_mps=turned(answer), yaw_rad=None, diagnostics=seen)  # <-
'''


def adapter_name(system: str) -> str:
    """Return the name, MODULE:CLASS, of the adapter of a class that is named so."""
    module, _, qualified = system.partition(":")
    return f"{module.rpartition('.')[2]}_adapter:{qualified.rpartition('.')[2]}Adapter"


def adapter_of(system: str) -> str:
    """Return the source of the adapter of a class, named as MODULE:CLASS."""
    module, _, qualified = system.partition(":")
    return _ADAPTER.format(
        name=qualified.rpartition(".")[2],
        module=module,
        first=qualified.partition(".")[0],
        qualified=qualified,
        adapter=adapter_name(system).partition(":")[2],
    )
