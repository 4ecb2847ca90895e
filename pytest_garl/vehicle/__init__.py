"""Flight control as ArduPilot Copter does it, in plain Python floats, usable alone.

As ArduPilot: the cascade position -> velocity -> acceleration -> thrust direction -> body rates
-> motors with its default gains, filters, limits and parameter names; square-root controllers;
targets shaped with bounded acceleration and jerk; feed-forward of the shaped targets; the
attitude error split into thrust direction and heading; the mixer's priorities; the motors'
spool states; take-off by a throttle ramp; GUIDED setpoints of position, velocity, acceleration
and heading; LAND with its speeds; precision landing (``PLND_*``) with its estimator, retries and
failures; the land detector.  Written from the published parameter and mode documentation and
from the formulas, not from ArduPilot's source, so details may differ.

Not reproduced: the EKF and all sensors (the state is what the simulator's inertial sensors
know, without noise), gyro and notch filters, ``MOT_SPIN_*``, ``MOT_THST_EXPO`` and the battery's
voltage (a motor takes newtons here), learning of the hover throttle, the pilot's sticks,
waypoint missions and S-curves, terrain following, fences, avoidance and all failsafes but those
of precision landing, arming checks, and ``SMAX``, ``PDMX``, ``D_FF`` of the PIDs.

The rate: ArduPilot runs at 400 Hz.  Declare 240 Hz, the rate of the simulator's physics; filter
coefficients follow from it, and 120 Hz flies as well.  Frames are the project's: z up, y left,
headings counter-clockwise from east, where ArduPilot has north, east, down.  Values are in metres,
seconds and radians, throttles from 0 to 1.

    control = ArduPilotControl(Airframe(control_rate_hz=240), parameters)
    control.take_off(10.0)
    control.guide(position=(5.0, 0.0, 10.0), yaw=0.0)
    control.land()
    thrusts = control.control(state)         # at the control rate, from the first moment on

Orders act at the next control step.  A landing system whose airframe declares a ``latency_s``
holds its own orders back for that long, since the simulator delays commands only.
"""

from pytest_garl.vehicle.controller import ArduPilotControl, Mode
from pytest_garl.vehicle.lift import Vehicle, vehicle_of
from pytest_garl.vehicle.parameters import (
    ArduPilotParameters,
    RatePid,
    tuned,
)

__all__ = [
    "ArduPilotControl",
    "ArduPilotParameters",
    "Mode",
    "RatePid",
    "Vehicle",
    "tuned",
    "vehicle_of",
]
