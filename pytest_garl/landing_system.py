"""The contract between a landing system and the simulator that flies it.

A landing system is any class with two methods; there is nothing to inherit::

    class MyLandingSystem:
        airframe = Airframe()                                   # optional

        def reset(self, mission: Mission) -> None: ...
        def step(self, observation: Observation) -> Command: ...

World frame: metres, seconds, radians; x east, y north, z up; origin on the ground at
the map's centre.  Quaternions are x, y, z, w and turn body vectors into world vectors.
The body frame is x forward, y left, z up; the camera looks along the body's -z axis, unless the
airframe says otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, runtime_checkable

from pytest_garl.airframe import (
    MAX_RATE_HZ,
    Airframe,
    Camera,
    NavigationKind,
    Rangefinder,
    airframe_of,
)
from pytest_garl.commands import (
    MAX_SPEED_MPS,
    WORLD_M,
    Abort,
    AttitudeSetpoint,
    Command,
    Detection,
    Diagnostics,
    Land,
    PositionSetpoint,
    VelocitySetpoint,
)
from pytest_garl.fiducial import NestedMarker

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__all__ = [
    "MAX_RATE_HZ",
    "MAX_SPEED_MPS",
    "WORLD_M",
    "Abort",
    "Airframe",
    "AttitudeSetpoint",
    "Camera",
    "Command",
    "Detection",
    "Diagnostics",
    "Land",
    "LandingSystem",
    "Mission",
    "MotorThrusts",
    "NavigationKind",
    "Observation",
    "PositionSetpoint",
    "Rangefinder",
    "VehicleState",
    "VelocitySetpoint",
    "airframe_of",
]


@dataclass(frozen=True, slots=True, kw_only=True)
class Mission:
    """The task of one flight, which a landing system gets before take-off.

    ``gps_position_m`` (x, y) is the approximate place of the marker, which lies up to
    7.5 m away from it.  ``home_m`` (x, y, z) is where the UAV stands at the start,
    motors off, or hovers if the test says so.
    ``marker_dictionary`` is OpenCV's name of the marker's dictionary, ``marker_side_m`` the length
    of its black border's outer side; ``nested_markers`` are smaller markers on its board.
    """

    gps_position_m: tuple[float, float]
    home_m: tuple[float, float, float]
    search_altitude_m: float
    marker_id: int
    marker_side_m: float
    marker_dictionary: str
    camera: Camera
    time_limit_s: float
    nested_markers: tuple[NestedMarker, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Observation:
    """The readings of the UAV's sensors at one camera frame.

    ``position_m`` and ``velocity_mps`` are shape (3,) in the world frame, ``attitude``
    is the quaternion (4,); ``image`` is RGB uint8 (H, W, 3) and ``depth_m`` is planar
    depth float32 (H, W) in metres: 0 where nothing is measured, 100 where an unlimited depth
    camera sees nothing.  The arrays are read-only.  ``rangefinder_m`` is the distance
    from the belly to what lies below along the body's axis; None without a rangefinder,
    and if nothing is in its range.
    """

    time_s: float
    position_m: NDArray[np.float64]
    velocity_mps: NDArray[np.float64]
    attitude: NDArray[np.float64]
    image: NDArray[np.uint8]
    depth_m: NDArray[np.float32]
    rangefinder_m: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleState:
    """The state of the vehicle at the control rate.

    ``position_m``, ``velocity_mps`` (world) and ``angular_velocity_radps`` (body) are
    (3,) tuples, ``attitude`` is a quaternion.  ``thrusts_n`` are the four motors' present
    thrusts in newtons.
    """

    time_s: float
    position_m: tuple[float, float, float]
    velocity_mps: tuple[float, float, float]
    attitude: tuple[float, float, float, float]
    angular_velocity_radps: tuple[float, float, float]
    thrusts_n: tuple[float, float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class MotorThrusts:
    """Wanted thrust of each motor in newtons: front left, front right, rear right, rear left.

    A motor limits this to the range from 0 to its maximum.  A value beyond ten times the
    maximum is refused.
    """

    newtons: tuple[float, float, float, float]


@runtime_checkable
class LandingSystem(Protocol):
    """Any class with these two methods; see the module's docstring.

    A value that breaks the contract (NaN, out of range, a wrong type or shape) ends the
    flight as a crash of the landing system, and the message names the field.

    A class may also declare ``airframe: Airframe``.  One that flies the motors itself
    declares ``Airframe(control_rate_hz=...)`` and offers
    ``control(state: VehicleState) -> MotorThrusts``; it is not called before the first ``step``.
    One that holds files, threads or processes offers ``close()``, which is called once after the
    flight, however it ended.  If it raises, a flight that landed counts as a crash.
    """

    def reset(self, mission: Mission) -> None:
        """Prepare for one flight; called once, before the first ``step``."""

    def step(self, observation: Observation) -> Command:
        """Return the command for the time until the next camera frame.

        Not called again after it has returned ``Abort()``.
        """
