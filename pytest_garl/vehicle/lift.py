"""Properties of the vehicle that the controller uses."""

from __future__ import annotations

from dataclasses import dataclass

from pytest_garl.airframe import Airframe
from pytest_garl.vehicle.position import GRAVITY_MPS2

REFERENCE_MASS_KG = 2.355
REFERENCE_THRUST_N = 20.6
"""The DJI Matrice 100's mass and the greatest thrust of one of its motors; a vehicle of another
mass is taken to have the same thrust for its weight, as the simulator's has."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Vehicle:
    """A quadrotor in X: its mass and what each of its motors can lift."""

    mass_kg: float
    max_thrust_n: float

    @property
    def hover_throttle(self) -> float:
        """Share of full thrust that carries it: what ArduPilot learns as MOT_THST_HOVER."""
        return self.mass_kg * GRAVITY_MPS2 / (4 * self.max_thrust_n)


def vehicle_of(airframe: Airframe) -> Vehicle:
    """Return the vehicle that an airframe declares."""
    return Vehicle(
        mass_kg=airframe.mass_kg,
        max_thrust_n=REFERENCE_THRUST_N * airframe.mass_kg / REFERENCE_MASS_KG,
    )
