"""Flight control as ArduPilot Copter does it, in plain Python floats, usable alone.

TODO
"""

from landing_systems.modules.control_ardupilot.controller import ArduPilotControl, Mode
from landing_systems.modules.control_ardupilot.parameters import (
    ArduPilotParameters,
    RatePid,
    tuned,
)
from landing_systems.modules.control_ardupilot.vehicle import Vehicle, vehicle_of

__all__ = [
    "ArduPilotControl",
    "ArduPilotParameters",
    "Mode",
    "RatePid",
    "Vehicle",
    "tuned",
    "vehicle_of",
]
