"""pytest-garl finds the ways in which a marker-based UAV landing system fails.

The names below are all that users need; every other module is internal and may change.  They are
loaded when first used, because every pytest run imports this package.  ``__init__.pyi`` has their
types.
"""

from __future__ import annotations

import importlib

__version__ = "0.2.0.dev0"

_HOMES = {
    "pytest_garl.airframe": ("Airframe", "Camera", "Rangefinder"),
    "pytest_garl.external.external_program": ("ExternalProgram",),
    "pytest_garl.companion.companion_program": ("CompanionProgram",),
    "pytest_garl.fiducial": ("MarkerSpec", "NestedMarker"),
    "pytest_garl.landing_system": (
        "Abort",
        "AttitudeSetpoint",
        "Command",
        "Detection",
        "Diagnostics",
        "Land",
        "LandingSystem",
        "Mission",
        "MotorThrusts",
        "Observation",
        "PositionSetpoint",
        "VehicleState",
        "VelocitySetpoint",
    ),
    "pytest_garl.plugin.items.landing": ("Landing",),
    "pytest_garl.scenarios.task": ("Start",),
    "pytest_garl.flight.flight": ("Flight",),
    "pytest_garl.simulation.npc_policy": ("Move", "PolicySpec", "Situation"),
    "pytest_garl.vehicle.autopilot": ("ArduCopter",),
    "pytest_garl.vehicle.px4": ("Px4Copter",),
    "pytest_garl.verdicts.verdict": ("Limits", "limits"),
    "pytest_garl.reports.film": ("save_video",),
}
"""Where each public name is defined."""
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}

__all__ = sorted(_HOME_OF)


def __getattr__(name: str) -> object:
    if name not in _HOME_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found: object = getattr(importlib.import_module(_HOME_OF[name]), name)
    return found
