"""A model of what follows a takeover: the UAV's motion by its flight control, the NPCs' by theirs.

It computes an escape in a hundredth of a flight's time; a real flight confirms it.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pytest_garl.flight.flight import Flight, Track
from pytest_garl.flight.thresholds import GRAVITY_MPS2, feet_height_m
from pytest_garl.landing_system import Airframe, VelocitySetpoint
from pytest_garl.scenarios.bodies import rotate
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.placed import Placed
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.shrinking.clearance import Clearance, ObjectPose
from pytest_garl.simulation.environment import environment_at
from pytest_garl.simulation.landing_moments import LandingMoments
from pytest_garl.simulation.npc_policy import (
    DECISION_STEP_S,
    PolicySpec,
    Situation,
)
from pytest_garl.simulation.physics.flight_control import FlightControl
from pytest_garl.simulation.physics.npc import Npc
from pytest_garl.simulation.physics.vehicle import (
    Motion,
    Quaternion,
    Vector,
    VehicleModel,
    drag,
    lag,
    vehicle_model,
    wrench,
)
from pytest_garl.simulation.physics.wind import MeanWind, mean_wind
from pytest_garl.simulation.physics.world import PHYSICS_RATE_HZ, World
from pytest_garl.simulation.randomness import generator
from pytest_garl.simulation.system_under_test.takeover import Leg, velocity_of

TICK_S = 1 / PHYSICS_RATE_HZ
TICKS_PER_NPC_STEP = 4
TICKS_PER_SAMPLE = 10
"""As in the flight's loop."""
MODEL_KEPT_M = 0.4
"""Distance that a planned escape keeps: the flight control's integral and the pose between two
samples of the track are not known, so a planned escape keeps more than a flown one must."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Chase:
    """A recorded flight with what its NPCs do after a takeover, in the world that measures it.

    ``npcs`` is the policy with which the flight is flown again.
    """

    flight: Flight
    scenario: Scenario
    map: Map
    airframe: Airframe
    npcs: PolicySpec
    world: World


class EscapeModel:
    """The state at one takeover; each escape is computed from it anew."""

    def __init__(self, chase: Chase, from_s: float) -> None:
        self._chase, self.from_s = chase, from_s
        track = chase.flight.uav
        self._index = track.index_at(from_s + 1e-6)
        self._model = vehicle_model(chase.airframe)
        self._wind = mean_wind(chase.scenario, chase.map.ground.texture)
        self._moments, self._known_samples = LandingMoments(chase.flight.moments), 0
        self._npcs = self._warm_npcs()

    def position_m(self, name: str = "") -> Vector:
        """Return where the UAV, or a moving body, is when the escape begins."""
        return _vector(self._track(name).position_m[self._index])

    def escapes(self, legs: tuple[Leg, ...], until_s: float) -> bool:
        """Return whether the UAV keeps clear of everything until a time if it flies the legs."""
        npcs = [_copied(npc) for npc in self._npcs]
        moments = copy.deepcopy(self._moments)
        uav = _Uav(self._model, self._wind, self._first_motion())
        clearance = Clearance(self._chase.world, MODEL_KEPT_M)
        first, last = round(self.from_s * PHYSICS_RATE_HZ), round(until_s * PHYSICS_RATE_HZ)
        scenario = environment_at(self._chase.scenario, self._chase.flight, self.from_s)
        for tick in range(first, last + 1):
            now = tick / PHYSICS_RATE_HZ
            if tick % TICKS_PER_NPC_STEP == 0:
                self._move(npcs, tick, uav.motion, scenario, moments)
            if tick % TICKS_PER_SAMPLE == 0 or tick == first:
                motion = uav.motion
                elapsed_s = now - self.from_s
                if not clearance.holds(elapsed_s, motion.position_m, motion.attitude, _poses(npcs)):
                    return False
            uav.fly(velocity_of(legs, now - self.from_s))
        return True

    def _move(
        self,
        npcs: Sequence[Npc],
        tick: int,
        motion: Motion,
        scenario: Scenario,
        moments: LandingMoments,
    ) -> None:
        moments.update(tick / PHYSICS_RATE_HZ, feet_height_m(motion.position_m[2]))
        if tick % round(DECISION_STEP_S * PHYSICS_RATE_HZ) == 0:
            situations = [
                self._situation(npc, npcs, tick, motion, scenario, moments) for npc in npcs
            ]
            for npc, situation in zip(npcs, situations, strict=True):
                npc.decide(situation)
        for npc in npcs:
            npc.update(
                tick / PHYSICS_RATE_HZ, moments.began_s, motion.position_m, motion.velocity_mps
            )
            npc.advance(TICKS_PER_NPC_STEP / PHYSICS_RATE_HZ, npcs)

    def _situation(
        self,
        own: Npc,
        npcs: Sequence[Npc],
        tick: int,
        motion: Motion,
        scenario: Scenario,
        moments: LandingMoments,
    ) -> Situation:
        return Situation(
            time_s=tick / PHYSICS_RATE_HZ,
            self=own.state,
            others=tuple(other.state for other in npcs if other is not own),
            uav_position_m=motion.position_m,
            uav_velocity_mps=motion.velocity_mps,
            marker_position_m=self._chase.flight.marker_position_m,
            map=self._chase.map,
            scenario=scenario,
            moments_s=(*moments.began_s, own.met_s, own.decided_s),
        )

    def _warm_npcs(self) -> list[Npc]:
        """Return the NPCs as they are at the takeover, their policies after the whole flight."""
        chase = self._chase
        numbers = {name: index for index, (name, _) in enumerate(chase.map.all_objects)}
        placed = Placed(chase.scenario, chase.map)
        npcs = [Npc(placed, item.name, chase.npcs.make()) for item in chase.flight.objects]
        step = round(DECISION_STEP_S * PHYSICS_RATE_HZ)
        decisions = math.ceil(self.from_s / DECISION_STEP_S - 1e-9)
        for number in range(max(1, decisions)):
            tick = number * step
            index = int(np.searchsorted(chase.flight.uav.time_s, tick * TICK_S - 1e-6))
            index = min(index, len(chase.flight.uav.time_s) - 1)
            self._follow(npcs, index)
            self._place(npcs, index)
            motion = self._motion(index)
            scenario = environment_at(chase.scenario, chase.flight, tick * TICK_S - 1e-6)
            situations = [
                self._situation(npc, npcs, tick, motion, scenario, self._moments) for npc in npcs
            ]
            for npc, situation in zip(npcs, situations, strict=True):
                if number == 0:
                    rng = generator(chase.scenario.seed, "objects", numbers[npc.name])
                    npc.policy.reset(situation, rng)
                npc.decide(situation)
        self._follow(npcs, self._index)
        self._place(npcs, self._index)
        for npc, item in zip(npcs, chase.flight.objects, strict=True):
            speeds = np.hypot(*item.track.velocity_mps[: self._index, :2].T)
            npc.spend_reserve(speeds.tolist(), TICKS_PER_SAMPLE * TICK_S)
        return npcs

    def _follow(self, npcs: Sequence[Npc], index: int) -> None:
        """Follow the flight up to a sample of its track."""
        track = self._chase.flight.uav
        known = self._known_samples
        for each in range(known, index + 1):
            self._moments.update(
                float(track.time_s[each]), feet_height_m(float(track.position_m[each, 2]))
            )
        self._known_samples = max(known, index + 1)
        for npc in npcs:
            uav_m = _vector(track.position_m[index])
            velocity = _vector(track.velocity_mps[index])
            npc.update(float(track.time_s[index]), self._moments.began_s, uav_m, velocity)

    def _place(self, npcs: Sequence[Npc], index: int) -> None:
        for npc, item in zip(npcs, self._chase.flight.objects, strict=True):
            vx, vy, _ = _vector(item.track.velocity_mps[index])
            _, _, sine, cosine = (float(value) for value in item.track.attitude[index])
            place = _vector(item.track.position_m[index])
            npc.place(place, (vx, vy), 2 * math.atan2(sine, cosine))

    def _first_motion(self) -> Motion:
        """Return the UAV's motion at the takeover: the sample before it, moved on."""
        motion = self._motion(self._index)
        late_s = self.from_s - float(self._chase.flight.uav.time_s[self._index])
        (x, y, z), (vx, vy, vz) = motion.position_m, motion.velocity_mps
        return motion._replace(position_m=(x + vx * late_s, y + vy * late_s, z + vz * late_s))

    def _motion(self, index: int) -> Motion:
        track = self._chase.flight.uav
        qx, qy, qz, qw = (float(value) for value in track.attitude[index])
        return Motion(
            _vector(track.position_m[index]),
            _vector(track.velocity_mps[index]),
            (qx, qy, qz, qw),
            (0.0, 0.0, 0.0),
        )

    def _track(self, name: str) -> Track:
        flight = self._chase.flight
        return next((item.track for item in flight.objects if item.name == name), flight.uav)


class _Uav:
    """The UAV's rigid body: motors with lag, drag, gravity; it follows commanded velocities."""

    def __init__(self, model: VehicleModel, wind: MeanWind, motion: Motion) -> None:
        self._model, self._wind, self.motion = model, wind, motion
        self._control = FlightControl(model)
        x, y, z, w = motion.attitude
        self._yaw_rad = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        hover = model.mass_kg * GRAVITY_MPS2 / 4
        self._thrusts = (hover, hover, hover, hover)

    def fly(self, velocity: Vector) -> None:
        """Follow a velocity for one tick."""
        model, motion = self._model, self.motion
        command = VelocitySetpoint(velocity_mps=velocity, yaw_rad=self._yaw_rad)
        wanted = self._control.thrusts(motion, command, TICK_S)
        self._thrusts = lag(self._thrusts, wanted, model, TICK_S)
        total, torque = wrench(self._thrusts, model)
        fx, fy, fz = rotate(motion.attitude, (0.0, 0.0, total))
        vx, vy, vz = motion.velocity_mps
        # Without gusts: those of the flight depend on the way that it takes.
        ax, ay, _ = self._wind.at(motion.position_m[2])
        dx, dy, dz = drag((vx - ax, vy - ay, vz), model)
        mass = model.mass_kg
        vx, vy = vx + (fx + dx) / mass * TICK_S, vy + (fy + dy) / mass * TICK_S
        vz += ((fz + dz) / mass - GRAVITY_MPS2) * TICK_S
        x, y, z = motion.position_m
        spin = _spun(motion.spin_radps, torque, model.inertia)
        self.motion = Motion(
            (x + vx * TICK_S, y + vy * TICK_S, max(0.0, z + vz * TICK_S)),
            (vx, vy, vz),
            _turned(motion.attitude, spin),
            spin,
        )


def _spun(spin: Vector, torque: Vector, inertia: Vector) -> Vector:
    """Return the spin after a tick, by Euler's equations in the body's frame."""
    (p, q, r), (ix, iy, iz) = spin, inertia
    return (
        p + (torque[0] - (iz - iy) * q * r) / ix * TICK_S,
        q + (torque[1] - (ix - iz) * r * p) / iy * TICK_S,
        r + (torque[2] - (iy - ix) * p * q) / iz * TICK_S,
    )


def _turned(attitude: Quaternion, spin: Vector) -> Quaternion:
    """Return the attitude after a tick with a spin in the body's frame."""
    (x, y, z, w), (p, q, r), half = attitude, spin, TICK_S / 2
    x, y, z, w = (
        x + half * (w * p + y * r - z * q),
        y + half * (w * q + z * p - x * r),
        z + half * (w * r + x * q - y * p),
        w - half * (x * p + y * q + z * r),
    )
    length = math.sqrt(x * x + y * y + z * z + w * w)
    return x / length, y / length, z / length, w / length


def _copied(npc: Npc) -> Npc:
    """Return an NPC that moves on by itself; what it shares with the other never changes."""
    own = copy.copy(npc)
    own.policy, own.moves, own.changes = copy.deepcopy(npc.policy), [*npc.moves], [*npc.changes]
    own.bird_path = copy.copy(npc.bird_path)
    return own


def _poses(npcs: Sequence[Npc]) -> list[ObjectPose]:
    return [(npc.name, npc.position_m, npc.yaw_rad) for npc in npcs]


def _vector(values: np.ndarray) -> Vector:
    x, y, z = (float(value) for value in values)
    return x, y, z
