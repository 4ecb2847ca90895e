"""The commands of a landing system, and its diagnostics.

The frames and units are those of ``landing_system.py``.
"""

from __future__ import annotations

from dataclasses import dataclass

WORLD_M = 1_000.0
"""No coordinate of a setpoint may be farther than this from the map's centre.  Maps are some tens
of metres wide: what is beyond is a mistake in units or an estimate that diverged."""
MAX_SPEED_MPS = 100.0
"""No commanded speed may be higher: no multirotor is so fast."""
LEAST_ASKED_ACCELERATION_MPS2, MOST_ASKED_ACCELERATION_MPS2 = 0.1, 10.0
LEAST_ASKED_TILT_RAD, MOST_ASKED_TILT_RAD = 0.02, 0.61
"""Limits of a setpoint's own limits.  Below the low ones a UAV does not stop within the map; 35
degrees is the largest tilt that the Matrice 100's data sheet allows."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Detection:
    """One marker that the landing system believes to see.

    ``position_m`` is the estimate of its centre in the world frame; ``corners_px`` are
    (u, v) pairs clockwise from the top left.  ``confidence`` is any finite number, by custom from
    0 to 1; reports show it.
    """

    marker_id: int
    confidence: float
    position_m: tuple[float, float, float]
    corners_px: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Diagnostics:
    """The view of a landing system on its flight, for reports and videos; optional.

    ``phase`` is the system's own name for its present activity (100 characters are kept);
    ``target_m`` (x, y, z) is the place that it takes for the marker; ``planned_path_m`` are the
    (x, y, z) points of its plan, at most 1,000, of which 100 are kept; ``obstacles_m`` are the
    centres of what it takes for solid near its way, as many, and None if it does not say; ``note``
    is a sentence for a reader (1,000 characters are kept).  At most 100 detections a frame.
    All numbers are finite: a NaN here is a finding, as it is in a command.  A flight's record
    keeps paths, obstacles, corners and notes until 6 MB are full; phases, detections and targets
    that fill 18 MB more are a finding.
    """

    phase: str = ""
    detections: tuple[Detection, ...] = ()
    target_m: tuple[float, float, float] | None = None
    planned_path_m: tuple[tuple[float, float, float], ...] = ()
    note: str = ""
    obstacles_m: tuple[tuple[float, float, float], ...] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class PositionSetpoint:
    """Fly to ``position_m`` (x, y, z), no faster than ``speed_mps``, nose at ``yaw_rad``.

    ``yaw_rad=None`` holds the yaw that was commanded last, at first that of the start.
    ``acceleration_mps2`` limits how fast the velocity changes, braking included; ``tilt_rad``
    limits the tilt, and so the wind against which the UAV holds its place.  ``None`` leaves these
    limits to the flight control: 4 m/s² along each axis, 25 degrees.

    No coordinate beyond 1,000 m; more than 0 and at most 100 m/s; at least 0.1 and at most 10 m/s²;
    at least 0.02 and at most 0.61 rad (35 degrees, the rating of the Matrice 100).
    """

    position_m: tuple[float, float, float]
    speed_mps: float = 3.0
    yaw_rad: float | None = 0.0
    acceleration_mps2: float | None = None
    tilt_rad: float | None = None
    diagnostics: Diagnostics | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class VelocitySetpoint:
    """Fly at ``velocity_mps`` (vx, vy, vz) in the world frame, nose at ``yaw_rad``.

    ``yaw_rad=None`` holds the yaw that was commanded last, at first that of the start.  No
    component beyond 100 m/s.
    """

    velocity_mps: tuple[float, float, float]
    yaw_rad: float | None = 0.0
    diagnostics: Diagnostics | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class AttitudeSetpoint:
    """Hold ``attitude`` (x, y, z, w) with collective ``thrust`` as a share of the maximum.

    The quaternion's length is 0.9 to 1.1 and is made 1; the thrust is 0 to 1.
    """

    attitude: tuple[float, float, float, float]
    thrust: float
    diagnostics: Diagnostics | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Land:
    """Descend straight down at ``speed_mps``; the motors stop 1.4 s after the touchdown.

    The nose stays at the yaw that was commanded last, at first that of the start.  More than 0 and
    at most 100 m/s; the flight control descends at 4 m/s at the most.
    """

    speed_mps: float = 0.5
    diagnostics: Diagnostics | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Abort:
    """Give up the landing: the flight control climbs away and the flight ends when clear.

    The nose stays at the yaw that was commanded last, at first that of the start.  It is the last
    command: ``step`` is not called again.
    """

    diagnostics: Diagnostics | None = None


Command = PositionSetpoint | VelocitySetpoint | AttitudeSetpoint | Land | Abort
