from pytest_garl.companion.companion_program import CompanionProgram
from pytest_garl.external.external_program import ExternalProgram
from pytest_garl.fiducial import MarkerSpec, NestedMarker
from pytest_garl.flight.flight import Flight
from pytest_garl.landing_system import (
    Abort,
    Airframe,
    AttitudeSetpoint,
    Camera,
    Command,
    Detection,
    Diagnostics,
    Land,
    LandingSystem,
    Mission,
    MotorThrusts,
    Observation,
    PositionSetpoint,
    Rangefinder,
    VehicleState,
    VelocitySetpoint,
)
from pytest_garl.plugin.items.landing import Landing
from pytest_garl.reports.film import save_video
from pytest_garl.scenarios.task import Start
from pytest_garl.simulation.npc_policy import Move, PolicySpec, Situation
from pytest_garl.vehicle.autopilot import ArduCopter
from pytest_garl.vehicle.px4 import Px4Copter
from pytest_garl.verdicts.verdict import Limits

__version__: str

__all__ = [
    "Abort",
    "Airframe",
    "ArduCopter",
    "AttitudeSetpoint",
    "Camera",
    "Command",
    "CompanionProgram",
    "Detection",
    "Diagnostics",
    "ExternalProgram",
    "Flight",
    "Land",
    "Landing",
    "LandingSystem",
    "Limits",
    "MarkerSpec",
    "Mission",
    "MotorThrusts",
    "Move",
    "NestedMarker",
    "Observation",
    "PolicySpec",
    "PositionSetpoint",
    "Px4Copter",
    "Rangefinder",
    "Situation",
    "Start",
    "VehicleState",
    "VelocitySetpoint",
    "limits",
    "save_video",
]

limits = Limits
