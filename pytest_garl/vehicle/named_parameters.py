"""Parameters by the names and in the units of ArduPilot, as ``PARAM_SET`` has them."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping
from difflib import get_close_matches

from pytest_garl.errors import LandingSystemError
from pytest_garl.vehicle.parameters import ArduPilotParameters, RatePid, tuned

_CENTI = {
    "wpnav_speed",
    "wpnav_speed_up",
    "wpnav_speed_dn",
    "wpnav_accel",
    "wpnav_accel_z",
    "land_speed",
    "land_speed_high",
    "land_alt_low",
    "psc_velxy_imax",
}
"""Fields in metres of what ArduPilot stores in centimetres."""
_CENTIDEGREES = {
    "angle_max",
    "atc_accel_r_max",
    "atc_accel_p_max",
    "atc_accel_y_max",
    "atc_slew_yaw",
}
OF_MODES = {
    "RTL_ALT": 1500.0,
    "RTL_LOIT_TIME": 5000.0,
    "WP_YAW_BEHAVIOR": 2.0,
    "SYSID_THISMAV": 1.0,
    "ARMING_CHECK": 1.0,
    "DISARM_DELAY": 10.0,
    "PLND_TYPE": 1.0,
}
"""Parameters that the modes read, and a few that programs ask for, with ArduPilot's defaults."""


class Parameters:
    """All parameters of one vehicle; ``flown`` are those of the flight control.

    A gain acts from the next start on, a speed or what concerns landing at once, as the flight
    control reads it.  A name that nothing here reads is kept and reported, as ArduPilot keeps it.
    """

    def __init__(self, hover_throttle: float, changes: Mapping[str, float]) -> None:
        self.flown: ArduPilotParameters = tuned(hover_throttle)
        self._others = dict(OF_MODES)
        for name, value in changes.items():
            self.set(name, value)

    def __getitem__(self, name: str) -> float:
        return dict(self.items())[name]

    def items(self) -> Iterator[tuple[str, float]]:
        """Yield names and values in ArduPilot's units, in the order of the names."""
        yield from sorted({**dict(_flown_items(self.flown)), **self._others}.items())

    def set(self, name: str, value: float) -> None:
        """Take a value in ArduPilot's unit."""
        name = name.upper()
        field, _, inner = _field_of(name)
        known = getattr(self.flown, field, None)
        if isinstance(known, RatePid):
            new: object = dataclasses.replace(known, **{inner: float(value)})
        elif known is None:
            self._others[name] = float(value)
            return
        else:
            new = type(known)(value * _unit(field))
        # Of this vehicle alone: its loops hold this very object and shall read the new value.
        object.__setattr__(self.flown, field, new)


def check_names(changes: Mapping[str, float]) -> None:
    """Raise LandingSystemError for a name or a value that the vehicle does not have."""
    known = {**dict(_flown_items(ArduPilotParameters())), **OF_MODES}
    for name, value in changes.items():
        if name not in known:
            near = get_close_matches(str(name).upper(), known, n=1)
            hint = f"; did you mean {near[0]}?" if near else ""
            raise LandingSystemError(
                f"parameters: found {name!r}, which nothing here reads{hint}; it reads "
                + ", ".join(sorted(known))
            )
        if not isinstance(value, int | float) or not math.isfinite(value):
            raise LandingSystemError(f"parameters: {name} = {value!r}: expected a finite number")
    try:
        dataclasses.replace(Parameters(0.3, changes).flown)
    except ValueError as error:
        raise LandingSystemError(f"parameters: {error}") from error


def _flown_items(flown: ArduPilotParameters) -> Iterator[tuple[str, float]]:
    for field in dataclasses.fields(flown):
        value = getattr(flown, field.name)
        if isinstance(value, RatePid):
            for inner in dataclasses.fields(value):
                name = f"{field.name}_{inner.name}".upper()
                yield name, float(getattr(value, inner.name))
        else:
            yield field.name.upper(), round(float(value) / _unit(field.name), 6)


def _field_of(name: str) -> tuple[str, str, str]:
    """Return the field of a name, and the field inside of it if it is one of a rate loop."""
    lower = name.lower()
    outer, separator, inner = lower.rpartition("_")
    return (outer, separator, inner) if outer.startswith("atc_rat_") else (lower, "", "")


def _unit(field: str) -> float:
    if field in _CENTI:
        return 0.01
    return math.radians(0.01) if field in _CENTIDEGREES else 1.0
