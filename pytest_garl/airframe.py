"""The vehicle that a landing system's class declares: its frame, its camera, its rangefinder.

The frames and units are those of ``landing_system.py``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, get_args

from pytest_garl.errors import LandingSystemError, of_a_user
from pytest_garl.messages import listed

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__tracebackhide__ = of_a_user
MAX_RATE_HZ = 240.0
"""The rate of the physics: nothing can be asked more often."""

MOST_WIDENING = 3.0
"""A lens may show at most this multiple of the width and the height that a pinhole with the same
picture and focal length shows."""
_MOST_PIXELS = 3840 * 2160
Vector = tuple[float, float, float]
BELLY_M: Vector = (0.0, 0.0, -0.05)
"""The place in the body of a camera that is not said to be elsewhere, and of a rangefinder."""
MOST_OFFSET_M = 2.5
"""As far from the body's middle as the largest airframe reaches."""
LOWEST_OFFSET_M = -0.15
"""A camera is above the ground where the UAV stands: its middle is 0.2 m above its feet."""
NavigationKind = Literal["rtk", "gnss", "ideal"]
"""What the vehicle's navigation rests on."""


def _check(
    kind: str, name: str, value: object, low: float, high: float, unit: str, *, whole: bool = False
) -> None:
    """Raise LandingSystemError unless a value is a number in a range; NaN is in none."""
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
    """A pinhole camera on the UAV, by default under its belly, looking along the body's -z axis.

    Image right (+u) is the body's right (-y); image down (+v) is the body's back (-x).
    At zero yaw (nose east) the image's top is east and its right is south.  ``yaw_rad`` turns the
    camera about the body's z axis: with pi/2 the image's top is the body's left.  ``tilt_rad`` then
    tilts it from straight down to what the image's top shows: with pi/2 a camera without yaw looks
    forward.  ``offset_m`` (x, y, z) is its place in the body.  ``distortion`` are
    the coefficients of its lens in OpenCV's order, k1, k2, p1, p2[, k3[, k4, k5, k6]]; none: a
    pinhole.  The default is 320x240 at 10 Hz with 90 degrees of horizontal field
    of view; the paper's code used 640x480.  Raises LandingSystemError for a camera that cannot be
    simulated: fewer than 16 pixels on a side, more than 3840x2160 in all, a field of view
    outside 0.05 to 3 rad (towards pi the image plane grows without limit), a rate outside
    0.1 to 240 Hz, a distortion that folds back within the picture, a yaw beyond half a turn, a tilt
    beyond pi/2, a place beyond 2.5 m or lower than 0.15 m below the body's middle.
    """

    width_px: int = 320
    height_px: int = 240
    field_of_view_rad: float = math.pi / 2
    rate_hz: float = 10.0
    distortion: tuple[float, ...] = ()
    yaw_rad: float = 0.0
    tilt_rad: float = 0.0
    offset_m: Vector = BELLY_M

    def __post_init__(self) -> None:
        for name in ("width_px", "height_px"):
            _check("Camera", name, getattr(self, name), 16, _MOST_PIXELS // 16, "px", whole=True)
        if self.width_px * self.height_px > _MOST_PIXELS:
            raise LandingSystemError(
                f"Camera of {self.width_px} x {self.height_px} px: expected at most "
                f"{_MOST_PIXELS} pixels (3840 x 2160)"
            )
        _check("Camera", "field_of_view_rad", self.field_of_view_rad, 0.05, 3.0, "rad")
        _check("Camera", "rate_hz", self.rate_hz, 0.1, MAX_RATE_HZ, "Hz")
        _check("Camera", "yaw_rad", self.yaw_rad, -math.pi, math.pi, "rad")
        _check("Camera", "tilt_rad", self.tilt_rad, -math.pi / 2, math.pi / 2, "rad")
        object.__setattr__(self, "offset_m", _offset(self.offset_m))
        object.__setattr__(self, "distortion", _coefficients(self.distortion))
        if self.distortion:
            self._check_lens()

    def _check_lens(self) -> None:
        import numpy as np

        from pytest_garl.distortion import undistorted

        edge = np.linspace(-1.0, 1.0, 41)
        half = np.array([self.width_px, self.height_px]) / 2 / self.focal_px
        whole = np.ones_like(edge)
        sides = ((edge, whole), (edge, -whole), (whole, edge), (-whole, edge))
        rim = np.concatenate([np.stack(side, axis=1) for side in sides])
        seen = undistorted(rim * half, self.distortion)
        what = f"Camera.distortion = {self.distortion}"
        if seen is None:
            raise LandingSystemError(
                f"{what}: found a model that folds back within the picture of {self.width_px} x "
                f"{self.height_px} px; expected k1, k2, p1, p2[, k3[, k4, k5, k6]] of a "
                "calibration of this very camera, whose picture grows up to the corners"
            )
        wide = float((np.abs(seen).max(axis=0) / half).max())
        if wide > MOST_WIDENING:
            raise LandingSystemError(
                f"{what}: found a lens that shows {wide:.1f} times what a pinhole shows; expected "
                f"at most {MOST_WIDENING:g} times. A larger field_of_view_rad with a weaker "
                "distortion may describe the same camera"
            )

    @property
    def is_turned(self) -> bool:
        """Whether it looks elsewhere than straight down with the image's top ahead."""
        return self.yaw_rad != 0.0 or self.tilt_rad != 0.0

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


def _offset(found: object) -> Vector:
    """Return a place in the body as plain floats; raise LandingSystemError for others."""
    try:
        x, y, z = (float(each) for each in found)  # type: ignore[attr-defined]
    except (TypeError, ValueError, OverflowError):
        x = math.nan
        y = z = x
    if not (max(abs(x), abs(y), abs(z)) <= MOST_OFFSET_M and z >= LOWEST_OFFSET_M):
        raise LandingSystemError(
            f"Camera.offset_m = {found!r:.80}; expected (x, y, z) in metres from the body's "
            f"middle, x forward, y left, z up, none beyond {MOST_OFFSET_M:g} m and z not below "
            f"{LOWEST_OFFSET_M:g} m"
        )
    return x, y, z


def _coefficients(found: object) -> tuple[float, ...]:
    """Return the coefficients of a lens as plain floats; raise LandingSystemError for others."""
    try:
        values = tuple(float(each) for each in found) if isinstance(found, Sequence) else None
    except (TypeError, ValueError, OverflowError):
        values = None
    if values is None or len(values) not in (0, 4, 5, 8) or not all(map(math.isfinite, values)):
        raise LandingSystemError(
            f"Camera.distortion = {found!r:.80}; expected a tuple of 4, 5 or 8 finite numbers, "
            "k1, k2, p1, p2[, k3[, k4, k5, k6]], or () for none"
        )
    # A lens whose coefficients are all 0 is none.
    return values if any(values) else ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Rangefinder:
    """A laser rangefinder under the belly, which measures along the body's -z axis.

    It reads once per camera frame, and has no reading of what is nearer than ``least_m`` or farther
    than ``most_m``.  The default is LightWare's SF11/C, with the limits that PX4 has for it; a
    TFmini reads 0.3 to 6 m outdoors (ArduPilot's documentation).  Raises LandingSystemError for a
    limit outside 0 to 200 m, and if the lower one is not below the upper one.
    """

    least_m: float = 0.2
    most_m: float = 120.0

    def __post_init__(self) -> None:
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
            distortion=camera.distortion,
            yaw_rad=float(camera.yaw_rad),
            tilt_rad=float(camera.tilt_rad),
            offset_m=camera.offset_m,
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
