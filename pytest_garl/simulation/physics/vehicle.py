"""The quadrotor: mass, inertia, motors and drag, in plain floats for the 240 Hz loop.

Figures are those of the DJI Matrice 100: 650 mm diagonal wheelbase and 13-inch
propellers, which make 1 m from tip to tip; 2,355 g with its TB47D battery.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import NamedTuple

from pytest_garl.landing_system import Airframe
from pytest_garl.scenarios.maps.map import Texture

AIR_DENSITY_KGPM3 = 1.225
"""International Standard Atmosphere at sea level."""
REFERENCE_MASS_KG = 2.355
THRUST_PER_MOTOR_N = 20.6
"""2.1 kg per rotor: DJI's figure for the E800 propulsion of this class."""
MOTOR_LAG_S = 0.05
"""Engineering estimate for 13-inch propellers; small racing propellers take about 0.02 s."""
YAW_TORQUE_PER_THRUST_M = 0.016
"""Torque over thrust of a propeller of 0.33 m: c_Q/c_T times the diameter.  Engineering
estimate: about 0.05 D; AirSim's default propeller has 0.058 D."""
DRAG_AREA_M2 = 0.05
"""Drag coefficient 1 on a frontal area of 0.05 m²: engineering estimate for body and arms."""
ROTOR_DRAG_PER_S = 0.10
"""Linear drag of the rotors per unit mass.  Engineering estimate, at the low end: Faessler,
Franchi and Scaramuzza (2018) identify some 0.2 to 0.5 1/s on a small agile quadrotor."""
FEET_FRICTION: dict[Texture, float] = {
    "concrete": 0.7,
    "asphalt": 0.65,
    "grass": 0.35,
    "sand": 0.45,
    "soil": 0.5,
}
"""Coefficient of sliding friction between feet of rubber and a dry ground.

Concrete: 0.6 to 0.85 for rubber on dry concrete (The Engineering ToolBox, "Friction coefficients"),
at the low end because feet are harder than tyres.  Asphalt: 0.65 for tyres on dry asphaltic
concrete (Noon, Engineering Analysis of Vehicular Accidents, 1994).  Grass: 0.35 for tyres on grass
(The Engineering ToolBox); Noon has 0.20 for a wet field.  Sand: 0.35 to 0.55 for concrete on clean
sand (NAVFAC DM-7.2, 1982, friction factors).  Soil: Noon's 0.35 for a dirt road and 0.60 for loose
dirt.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleModel:
    """One airframe's rigid-body constants; inertia is the diagonal, in kg m²."""

    mass_kg: float
    size_m: float
    lever_m: float
    """Distance of a motor from the roll axis, and from the pitch axis."""
    inertia: tuple[float, float, float]
    max_thrust_n: float
    drag_n_per_mps: float
    drag_n_per_mps2: float


def vehicle_model(airframe: Airframe) -> VehicleModel:
    """Scale the reference vehicle to an airframe; the thrust-to-weight ratio is kept.

    Inertia: 60 % of the mass as a solid cylinder of a quarter of the span, 40 % as four
    motors at the arms' ends.
    """
    mass, size = airframe.mass_kg, airframe.size_m
    arm = 0.325 * size
    hub, motors = 0.6 * mass, 0.4 * mass
    radius, height = size / 8, 0.12 * size
    roll = hub * (3 * radius**2 + height**2) / 12 + motors * arm**2 / 2
    yaw = hub * radius**2 / 2 + motors * arm**2
    return VehicleModel(
        mass_kg=mass,
        size_m=size,
        lever_m=arm / math.sqrt(2),
        inertia=(roll, roll, yaw),
        max_thrust_n=THRUST_PER_MOTOR_N * mass / REFERENCE_MASS_KG,
        drag_n_per_mps=ROTOR_DRAG_PER_S * mass,
        drag_n_per_mps2=0.5 * AIR_DENSITY_KGPM3 * (DRAG_AREA_M2 * size**2),
    )


Thrusts = tuple[float, float, float, float]
Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


class Motion(NamedTuple):
    """Pose and motion of the vehicle in the world frame, but the spin (rad/s) in the body's.

    A named tuple, since one is made 240 times a second.
    """

    position_m: Vector
    velocity_mps: Vector
    attitude: Quaternion
    spin_radps: Vector


def lag(thrusts: Thrusts, wanted: Thrusts, model: VehicleModel, dt_s: float) -> Thrusts:
    """Return the motors' thrusts after ``dt_s``: first order, within [0, maximum]."""
    share = _lag_share(dt_s)
    top = model.max_thrust_n
    (a, b, c, d), (wa, wb, wc, wd) = thrusts, wanted
    return (
        a + ((0.0 if wa < 0.0 else top if wa > top else wa) - a) * share,
        b + ((0.0 if wb < 0.0 else top if wb > top else wb) - b) * share,
        c + ((0.0 if wc < 0.0 else top if wc > top else wc) - c) * share,
        d + ((0.0 if wd < 0.0 else top if wd > top else wd) - d) * share,
    )


@functools.cache
def _lag_share(dt_s: float) -> float:
    return 1 - math.exp(-dt_s / MOTOR_LAG_S)


def wrench(thrusts: Thrusts, model: VehicleModel) -> tuple[float, Vector]:
    """Return the thrust along body z and the body torques of motors FL, FR, RR, RL."""
    fl, fr, rr, rl = thrusts
    lever = model.lever_m
    roll = lever * (fl + rl - fr - rr)
    pitch = lever * (rr + rl - fl - fr)
    yaw = YAW_TORQUE_PER_THRUST_M * (fr + rl - fl - rr)
    return fl + fr + rr + rl, (roll, pitch, yaw)


def mix(thrust_n: float, torque: Vector, model: VehicleModel) -> Thrusts:
    """Return the motor thrusts for a wanted collective thrust and body torque."""
    base, lever = thrust_n / 4, 4 * model.lever_m
    roll, pitch = torque[0] / lever, torque[1] / lever
    yaw = torque[2] / (4 * YAW_TORQUE_PER_THRUST_M)
    return (
        base + roll - pitch - yaw,
        base - roll - pitch + yaw,
        base - roll + pitch - yaw,
        base + roll + pitch + yaw,
    )


def drag(air_velocity: Vector, model: VehicleModel) -> Vector:
    """Return the drag force for a velocity relative to the air: linear plus quadratic."""
    vx, vy, vz = air_velocity
    speed = math.sqrt(vx * vx + vy * vy + vz * vz)
    factor = -(model.drag_n_per_mps + model.drag_n_per_mps2 * speed)
    return factor * vx, factor * vy, factor * vz
