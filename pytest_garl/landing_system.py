"""The contract between a landing system and the simulator that flies it.

A landing system is any class with two methods; there is nothing to inherit::

    class MyLandingSystem:
        airframe = Airframe()                                   # optional

        def reset(self, mission: Mission) -> None: ...
        def step(self, observation: Observation) -> Command: ...

World frame: metres, seconds, radians; x east, y north, z up; origin on the ground at
the map's centre.  Quaternions are x, y, z, w and turn body vectors into world vectors.
The body frame is x forward, y left, z up; the camera looks along the body's -z axis.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, Protocol, get_args, runtime_checkable

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
from pytest_garl.errors import LandingSystemError
from pytest_garl.fiducial import NestedMarker
from pytest_garl.messages import listed

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

MAX_RATE_HZ = 240.0
"""The rate of the physics: nothing can be asked more often."""


_MOST_PIXELS = 3840 * 2160
NavigationKind = Literal["rtk", "gnss", "ideal"]
"""What the vehicle's navigation rests on."""


def _check(
    kind: str, name: str, value: object, low: float, high: float, unit: str, *, whole: bool = False
) -> None:
    """Raise LandingSystemError unless a value is a number in a range; NaN is in none."""
    __tracebackhide__ = True  # pytest shows the line of the user's module that made it
    try:
        fits = low <= value <= high and not (whole and value != int(value))  # type: ignore[operator, call-overload]
    except (TypeError, ValueError, OverflowError):
        fits = False
    if not fits:
        number = "a whole number" if whole else "a number"
        text = repr(value)
        found = text if len(text) <= 80 else f"{text[:77]}..."
        raise LandingSystemError(
            f"{kind}.{name} = {found}; expected {number} from {low:g} to {high:g} {unit}"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Camera:
    """A pinhole camera under the UAV's belly, looking along the body's -z axis.

    Image right (+u) is the body's right (-y); image down (+v) is the body's back (-x).
    At zero yaw (nose east) the image's top is east and its right is south.  There is no
    lens distortion.  The default is 320x240 at 10 Hz with 90 degrees of horizontal field
    of view; the paper's code used 640x480.  Raises LandingSystemError for a camera that cannot be
    simulated: fewer than 16 pixels on a side, more than 3840x2160 in all, a field of view
    outside 0.05 to 3 rad (towards pi the image plane grows without limit), a rate outside
    0.1 to 240 Hz.
    """

    width_px: int = 320
    height_px: int = 240
    field_of_view_rad: float = math.pi / 2
    rate_hz: float = 10.0

    def __post_init__(self) -> None:
        __tracebackhide__ = True
        for name in ("width_px", "height_px"):
            _check("Camera", name, getattr(self, name), 16, _MOST_PIXELS // 16, "px", whole=True)
        if self.width_px * self.height_px > _MOST_PIXELS:
            raise LandingSystemError(
                f"Camera of {self.width_px} x {self.height_px} px: expected at most "
                f"{_MOST_PIXELS} pixels (3840 x 2160)"
            )
        _check("Camera", "field_of_view_rad", self.field_of_view_rad, 0.05, 3.0, "rad")
        _check("Camera", "rate_hz", self.rate_hz, 0.1, MAX_RATE_HZ, "Hz")

    @property
    def focal_px(self) -> float:
        """Focal length in pixels, the same on both axes."""
        return self.width_px / 2 / math.tan(self.field_of_view_rad / 2)

    @property
    def centre_px(self) -> tuple[float, float]:
        """Principal point (cx, cy) in pixels, pixel centres at whole numbers."""
        return (self.width_px - 1) / 2, (self.height_px - 1) / 2

    @property
    def matrix(self) -> NDArray[np.float64]:
        """Camera matrix, shape (3, 3), as OpenCV takes it."""
        import numpy as np

        (cx, cy), f = self.centre_px, self.focal_px
        return np.array([[f, 0.0, cx], [0.0, f, cy], [0.0, 0.0, 1.0]])


@dataclass(frozen=True, slots=True, kw_only=True)
class Rangefinder:
    """A laser rangefinder beside the camera, which measures along the body's -z axis.

    It reads once per camera frame, and has no reading of what is nearer than ``least_m`` or farther
    than ``most_m``.  The default is LightWare's SF11/C, with the limits that PX4 has for it; a
    TFmini reads 0.3 to 6 m outdoors (ArduPilot's documentation).  Raises LandingSystemError for a
    limit outside 0 to 200 m, and if the lower one is not below the upper one.
    """

    least_m: float = 0.2
    most_m: float = 120.0

    def __post_init__(self) -> None:
        __tracebackhide__ = True
        for name in ("least_m", "most_m"):
            _check("Rangefinder", name, getattr(self, name), 0.0, 200.0, "m")
        if self.least_m >= self.most_m:
            raise LandingSystemError(
                f"Rangefinder from {self.least_m:g} to {self.most_m:g} m: expected least_m below "
                "most_m"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class Airframe:
    """The vehicle of a landing system, declared by its class.

    ``latency_s`` is the delay between an image and the command that follows from it.
    ``control_rate_hz`` is the rate at which the simulator calls ``control`` for motor thrusts;
    ``None`` means that the simulator's own simple flight control follows the commands. The
    default mass and size are those of the DJI Matrice 100 (see
    ``simulation/physics/vehicle.py``). Raises LandingSystemError for a mass outside 0.1 to 100
    kg, a size outside 0.1 to 5 m, a latency outside 0 to 5 s, a control rate outside 1 to 240
    Hz.

    ``navigation`` bounds the navigation errors that a search draws: "gnss" all those of the domain,
    "rtk" those of a receiver with corrections, "ideal" none.  A scenario file flies as written.
    ``rangefinder`` adds ``Observation.rangefinder_m``.
    """

    mass_kg: float = 2.355
    size_m: float = 1.0
    camera: Camera = field(default_factory=Camera)
    latency_s: float = 0.1
    control_rate_hz: float | None = None
    navigation: NavigationKind = "gnss"
    rangefinder: Rangefinder | None = None

    def __post_init__(self) -> None:
        __tracebackhide__ = True
        camera: object = self.camera
        if not isinstance(camera, Camera):
            found = type(camera).__name__
            raise LandingSystemError(f"Airframe.camera is of type {found}; expected Camera(...)")
        _check("Airframe", "mass_kg", self.mass_kg, 0.1, 100.0, "kg")
        _check("Airframe", "size_m", self.size_m, 0.1, 5.0, "m")
        _check("Airframe", "latency_s", self.latency_s, 0.0, 5.0, "s")
        if self.control_rate_hz is not None:
            _check("Airframe", "control_rate_hz", self.control_rate_hz, 1.0, MAX_RATE_HZ, "Hz")
        if self.navigation not in get_args(NavigationKind):
            raise LandingSystemError(
                f"Airframe.navigation = {self.navigation!r:.80}; expected "
                f"{listed(get_args(NavigationKind))}"
            )
        rangefinder: object = self.rangefinder
        if rangefinder is not None and not isinstance(rangefinder, Rangefinder):
            found = type(rangefinder).__name__
            raise LandingSystemError(
                f"Airframe.rangefinder is of type {found}; expected Rangefinder(...) or None"
            )


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
    depth float32 (H, W) in metres.  The arrays are read-only.  ``rangefinder_m`` is the distance
    from the camera's place to what lies below along the body's axis; None without a rangefinder,
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


def airframe_of(system: object) -> Airframe:
    """Return the airframe that a landing system (class or instance) declares, or the default.

    Raises LandingSystemError if ``airframe`` is something else.
    """
    airframe = getattr(system, "airframe", None)
    if airframe is None:
        return Airframe()
    if not isinstance(airframe, Airframe):
        what = "a property" if isinstance(airframe, property) else repr(airframe)
        name = getattr(system, "__name__", type(system).__name__)
        raise LandingSystemError(
            f"{name}.airframe is {what[:80]}; expected pytest_garl.Airframe(...) in the class"
        )
    camera, rangefinder = airframe.camera, airframe.rangefinder
    # Rebuilt, so that a subclass cannot change the values after the check.
    return Airframe(
        mass_kg=float(airframe.mass_kg),
        size_m=float(airframe.size_m),
        camera=Camera(
            width_px=int(camera.width_px),
            height_px=int(camera.height_px),
            field_of_view_rad=float(camera.field_of_view_rad),
            rate_hz=float(camera.rate_hz),
        ),
        latency_s=float(airframe.latency_s),
        control_rate_hz=None
        if airframe.control_rate_hz is None
        else float(airframe.control_rate_hz),
        navigation=airframe.navigation,
        rangefinder=None
        if rangefinder is None
        else Rangefinder(least_m=float(rangefinder.least_m), most_m=float(rangefinder.most_m)),
    )
