"""The 240 Hz loop of one flight: everything that happens in a simulated second."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import Any

from pytest_garl.flight.flight import HOLDS, Crash, Flight, Outcome
from pytest_garl.flight.thresholds import BODY_ABOVE_FEET_M, GRAVITY_MPS2, feet_height_m
from pytest_garl.landing_system import (
    Abort,
    Command,
    Land,
    PositionSetpoint,
    VehicleState,
    VelocitySetpoint,
)
from pytest_garl.scenarios.bodies import rotate
from pytest_garl.scenarios.placed import Placed
from pytest_garl.scenarios.task import HOLD_S
from pytest_garl.simulation.camera.projection import eye_under
from pytest_garl.simulation.contacts import Contacts
from pytest_garl.simulation.environment import changed
from pytest_garl.simulation.ground_periods import GroundPeriods
from pytest_garl.simulation.landing_place import what_lies_under
from pytest_garl.simulation.navigation import Navigation
from pytest_garl.simulation.npc_policy import (
    DECISION_STEP_S,
    EventDirector,
    GeneChange,
    NpcPolicy,
    Situation,
)
from pytest_garl.simulation.physics.flight_control import NO_THRUST, FlightControl
from pytest_garl.simulation.physics.make_world import make_world
from pytest_garl.simulation.physics.npc import Npc
from pytest_garl.simulation.physics.vehicle import (
    FEET_FRICTION,
    Motion,
    Quaternion,
    Thrusts,
    Vector,
    VehicleModel,
    drag,
    lag,
    vehicle_model,
    wrench,
)
from pytest_garl.simulation.physics.wind import Wind
from pytest_garl.simulation.physics.world import PHYSICS_RATE_HZ, World
from pytest_garl.simulation.randomness import generator
from pytest_garl.simulation.rangefinder import Ranging
from pytest_garl.simulation.recorder import Recorder
from pytest_garl.simulation.sensors import Delivery, Sensors
from pytest_garl.simulation.strikes import Strikes
from pytest_garl.simulation.system_under_test.calls import StepGuard, SystemFailedError
from pytest_garl.simulation.system_under_test.ground_truth import Truth, TruthObject
from pytest_garl.simulation.system_under_test.mission import mission_for
from pytest_garl.simulation.system_under_test.observation import estimation_error_m
from pytest_garl.simulation.system_under_test.system import SystemUnderTest

TICK_S = 1 / PHYSICS_RATE_HZ
TICKS_PER_TRACK_SAMPLE = 10
TICKS_PER_NPC_STEP = 4


class Loop:
    """One flight; call ``begin``, then ``tick`` until it returns an outcome."""

    def __init__(
        self,
        placed: Placed,
        system: Callable[[], Any],
        policy: Callable[[], NpcPolicy],
        time_limit_s: float,
        guard: StepGuard | None,
        events: EventDirector | None = None,
    ) -> None:
        scenario, map = placed.scenario, placed.map
        self.scenario, self.map, self._placed = scenario, map, placed
        self._time_limit_s = time_limit_s
        self._holds = scenario.task.start.holds
        allowed_s = min(time_limit_s, HOLD_S) if self._holds else time_limit_s
        self._ticks_allowed = round(allowed_s * PHYSICS_RATE_HZ)
        self._system = SystemUnderTest(system, guard)
        self.camera = self._system.airframe.camera
        self._model = vehicle_model(self._system.airframe)
        self.npcs = [Npc(placed, name, policy()) for name, _ in map.present_objects]
        self._world = make_world(
            self._model,
            map.uav_start_m,
            map.bodies,
            [npc.body for npc in self.npcs],
            FEET_FRICTION[map.ground.texture],
        )
        self._thrusts, self._command = begin_at_start(self._world, self._model, placed)
        self.recorder = Recorder(placed, self.npcs)
        self.moments = self.recorder.moments
        self._strikes = Strikes(scenario, self.moments, events)
        stays = GroundPeriods(self.recorder, self._model, placed.marker_m, self._under)
        self._contacts = Contacts(self._world, self.recorder, self.npcs, self._model.size_m, stays)
        self._control = FlightControl(self._model)
        self._wind = Wind(scenario, map.ground.texture)
        self._navigation = Navigation(scenario, self.moments)
        if self._holds:
            self._command = self._held_place()
        self._wanted_thrusts = NO_THRUST
        self._pending: list[tuple[int, Command]] = []
        ranging = Ranging(scenario, self._system.airframe.rangefinder, self._world)
        self._sensors = Sensors(
            scenario, self.camera, self.recorder, self.npcs, ranging, self.moments
        )
        self._ticks = 0
        self._ticks_per_control = _ticks_per_call(self._system.airframe.control_rate_hz)

    def run(self) -> Flight:
        """Fly to the end and return the record, without hash and versions."""
        crash = None
        try:
            self.begin()
            outcome = self.tick()
            while outcome is None:
                outcome = self.tick()
        except SystemFailedError as error:
            if _is_finite(self._world):
                self._contacts.record_pose(self.recorder.time_s)
            self.recorder.event("crashed", error.crash.message)
            outcome, crash = "crashed", error.crash
        finally:
            self.close()
        outcome, crash = _after_closing(self._system, self.recorder, outcome, crash)
        flight = self.recorder.flight(outcome, crash, self._contacts.touchdowns)
        return dataclasses.replace(flight, rangefinder=self._system.airframe.rangefinder)

    def begin(self) -> None:
        """Reset the NPCs' policies and the landing system."""
        # By the index among all NPCs of the map, so that removing one does not change the others.
        numbers = {name: index for index, (name, _) in enumerate(self.map.all_objects)}
        for npc in self.npcs:
            rng = generator(self.scenario.seed, "objects", numbers[npc.name])
            npc.policy.reset(self.situation(npc), rng)
        self.recorder.begin(*self._world.uav_state()[:3])
        if self._holds:
            self.recorder.event(HOLDS, "holds its place; what the system commands is not flown")
        self._system.start(
            mission_for(
                self._placed,
                self._system.airframe,
                self._time_limit_s,
                error_m=self._navigation.error_m,
            )
        )
        if self._system.needs_camera:
            self._sensors.switch_on(self._placed)

    def close(self) -> None:
        """Free the physics."""
        self._world.close()

    @property
    def out_of_time(self) -> bool:
        """Whether the next ``tick`` returns "not_landed", or "held" of a UAV that holds its place.

        A UAV that has touched down in time may come to rest.
        """
        if self._ticks < self._ticks_allowed:
            return False
        return not self._contacts.settling(self._ticks / PHYSICS_RATE_HZ, self._time_limit_s)

    def tick(self) -> Outcome | None:
        """Advance by 1/240 s; return the outcome once there is one.

        Raises SystemFailedError if the landing system fails, or the UAV's state is not finite.
        """
        tick = self._ticks
        if self.out_of_time:
            if self._holds:
                return "held"
            self.recorder.event("time_out", f"not landed after {self._time_limit_s:g} s")
            if self._system.returns_since_s is None:
                return "not_landed"
            self._tell_of_giving_up()
            return "gave_up"
        self._ticks += 1
        now = tick / PHYSICS_RATE_HZ
        self.recorder.time_s = now
        position, attitude, velocity, spin = self._world.uav_state()
        if not math.isfinite(math.hypot(*position, *attitude, *velocity, *spin)):
            raise self._system.not_finite_error(now)
        if tick % TICKS_PER_NPC_STEP == 0:
            self.moments.update(now, feet_height_m(position[2]))
            self._move_npcs(tick, position, velocity)
        if tick % TICKS_PER_TRACK_SAMPLE == 0:
            self._contacts.record_pose(now)
            if isinstance(self._command, Abort) and self._contacts.gave_up(position):
                self.recorder.event("gave_up", "gave up and climbed clear of everything")
                return "gave_up"
        x, y, z, w = attitude
        motion = Motion(position, velocity, attitude, rotate((-x, -y, -z, w), spin))
        estimate = self._navigation.estimate(tick, motion)
        self._observe(tick, motion, estimate)
        while self._pending and self._pending[0][0] <= tick:
            self._take(self._pending.pop(0)[1])
        if self._holds and self._system.gave_up:
            self._tell_of_giving_up()
            self._contacts.record_pose(now)
            return "gave_up"
        self._actuate(tick, motion, estimate)
        fl, fr, rr, rl = self._thrusts
        return self._contacts.outcome(now, position, attitude, velocity, fl + fr + rr + rl)

    def _actuate(self, tick: int, motion: Motion, estimate: Motion) -> None:
        """Apply the thrusts and the drag of this tick, and step the physics."""
        model, attitude = self._model, motion.attitude
        self._thrusts = lag(self._thrusts, self._thrusts_wanted(tick, estimate), model, TICK_S)
        total, torque = wrench(self._thrusts, model)
        fx, fy, fz = rotate(attitude, (0.0, 0.0, total))
        vx, vy, vz = motion.velocity_mps
        ax, ay, az = self._wind.velocity_mps(tick, motion.position_m, motion.velocity_mps)
        dx, dy, dz = drag((vx - ax, vy - ay, vz - az), model)
        self._world.step(motion.position_m, (fx + dx, fy + dy, fz + dz), rotate(attitude, torque))

    def _thrusts_wanted(self, tick: int, estimate: Motion) -> Thrusts:
        """Return the wanted thrusts of the system's own flight control, or of the simulated one."""
        if self._contacts.motors_stopped:
            return NO_THRUST
        flies_motors = self._system.airframe.control_rate_hz and self._system.has_stepped
        if not flies_motors or isinstance(self._command, Abort):
            on_ground_s = self._contacts.on_ground_s(tick / PHYSICS_RATE_HZ)
            return self._control.thrusts(estimate, self._command, TICK_S, on_ground_s)
        if tick % self._ticks_per_control == 0:
            state = _vehicle_state(tick, estimate, self._thrusts)
            self._wanted_thrusts = self._system.control(state, self._model.max_thrust_n)
        if self._holds:
            # Its own flight control runs, so that it says what it would say, and moves nothing.
            return self._control.thrusts(estimate, self._command, TICK_S)
        return self._wanted_thrusts

    def _move_npcs(self, tick: int, uav_m: Vector, uav_mps: Vector) -> None:
        if tick % round(DECISION_STEP_S * PHYSICS_RATE_HZ) == 0:
            marker_m, view = self._placed.marker_m, self.recorder.last_view
            self._strikes.decide(self.recorder.time_s, uav_m, uav_mps, marker_m, view)
            moves = [npc.decide(self.situation(npc)) for npc in self.npcs]
            self._change([change for move in moves for change in move.changes])
        for npc in self.npcs:
            npc.update(self.recorder.time_s, self.moments.began_s, uav_m, uav_mps)
            npc.advance(TICKS_PER_NPC_STEP / PHYSICS_RATE_HZ, self.npcs)
            self._world.move(npc.name, npc.position_m, npc.yaw_rad, npc.velocity_mps)

    def _change(self, changes: Sequence[GeneChange]) -> None:
        scenario = changed(self.scenario, changes)
        if scenario != self.scenario:
            self.scenario = scenario
            self._sensors.change(scenario)

    def situation(self, npc: Npc) -> Situation:
        """Return what the policy of an NPC may see at this moment."""
        position, _, velocity, _ = self._world.uav_state()
        return Situation(
            time_s=self.recorder.time_s,
            self=npc.state,
            others=tuple(other.state for other in self.npcs if other is not npc),
            uav_position_m=position,
            uav_velocity_mps=velocity,
            marker_position_m=self._placed.marker_m,
            map=self.map,
            scenario=self.scenario,
            moments_s=(*self.moments.began_s, npc.met_s, npc.decided_s),
        )

    def _under(self, place: tuple[float, float]) -> str:
        """Return what lies under the UAV if it touches down at a place at this moment."""
        bodies = (*self.map.bodies, *(npc.body for npc in self.npcs))
        placed = self._placed
        return what_lies_under(place, placed.pad.main, placed.layers, bodies, self.scenario)

    def _truth(self, error_m: Vector) -> Truth:
        """Return the truth in the frame of the estimated position, in which the pilot flies."""
        dx, dy, dz = error_m
        objects = []
        for npc in self.npcs:
            x, y, z = npc.position_m
            velocity = npc.vx_mps, npc.vy_mps
            place = x + dx, y + dy, z + dz
            objects.append(TruthObject(position_m=place, velocity_mps=velocity, type=npc.type))
        x, y = self._placed.marker_m
        return Truth(marker_m=(x + dx, y + dy), objects=tuple(objects), map=self.map)

    def eye(self) -> tuple[Vector, Quaternion]:
        """Return the camera's place and the UAV's attitude."""
        position, attitude, _, _ = self._world.uav_state()
        return eye_under(position, attitude, self.camera.offset_m), attitude

    def _observe(self, tick: int, motion: Motion, estimate: Motion) -> None:
        """Show the landing system what has arrived, and queue its commands for their latency."""
        if self._system.gave_up:
            if self._sensors.takes_picture(tick):
                # The recorded view explains a collision during the climb.
                self.recorder.step(Abort(), self._sensors.look(tick, motion)[1])
            return
        for delivery in self._sensors.deliveries(tick, motion, estimate):
            if not self._system.gave_up:
                self._step(tick, delivery)

    def _step(self, tick: int, delivery: Delivery) -> None:
        if self._system.truth_pilot:
            self._system.truth_pilot.observe_truth(self._truth(self._navigation.error_m))
        command = self._system.step(delivery.observation)
        error_m = estimation_error_m(delivery.observation, delivery.place_m)
        self.recorder.step(command, delivery.content, error_m, delivery.range_m)
        latency_s = self._system.airframe.latency_s
        self._pending.append((tick + round(latency_s * PHYSICS_RATE_HZ), command))

    def _held_place(self) -> Command:
        """Return the command of a UAV that stays at its start, where its navigation says it is."""
        (x, y, z), (dx, dy, dz) = self._placed.start_m, self._navigation.error_m
        return PositionSetpoint(position_m=(x + dx, y + dy, z + dz), yaw_rad=None)

    def _take(self, command: Command) -> None:
        if self._holds:
            return
        if type(command) is not type(self._command):
            if isinstance(command, Abort):
                self._tell_of_giving_up()
            elif isinstance(command, Land):
                self.recorder.event("land_command", "the system said Land()")
        self._command = command
        self._control.remember_yaw(command)

    def _tell_of_giving_up(self) -> None:
        since_s = self._system.returns_since_s
        how = "the system said Abort()" if since_s is None else "the vehicle turned back home"
        self.recorder.event("abort_command", how, since_s)


def _after_closing(
    system: SystemUnderTest, recorder: Recorder, outcome: Outcome, crash: Crash | None
) -> tuple[Outcome, Crash | None]:
    """Close the landing system; an error of that fails a flight that had landed."""
    try:
        system.close()
    except SystemFailedError as error:
        if outcome == "landed":
            recorder.event("crashed", error.crash.message)
            return "crashed", error.crash
        # What ended the flight came first; it stays the finding.
        recorder.event("close_failed", error.crash.message)
    return outcome, crash


def _vehicle_state(tick: int, motion: Motion, thrusts: Thrusts) -> VehicleState:
    return VehicleState(
        time_s=tick / PHYSICS_RATE_HZ,
        position_m=motion.position_m,
        velocity_mps=motion.velocity_mps,
        attitude=motion.attitude,
        angular_velocity_radps=motion.spin_radps,
        thrusts_n=thrusts,
    )


def _is_finite(world: World) -> bool:
    return all(math.isfinite(value) for part in world.uav_state() for value in part)


def _ticks_per_call(rate_hz: float | None) -> int:
    """Return how many physics steps lie between two calls at a rate; 1 without one."""
    return max(1, round(PHYSICS_RATE_HZ / rate_hz)) if rate_hz else 1


def begin_at_start(
    world: World, model: VehicleModel, placed: Placed
) -> tuple[Thrusts, Command | None]:
    """Move the UAV to its start; return its thrusts, and the command until the system's first.

    A UAV that hovers is level and at rest, and wind moves it until its control has learned the
    wind.
    """
    yaw = math.radians(placed.scenario["heading.start_deg"])
    attitude = (0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))
    x, y, height = placed.start_m
    if placed.scenario.task.start.hovers:
        world.place_uav((x, y, height), attitude)
        each = model.mass_kg * GRAVITY_MPS2 / 4
        return (each, each, each, each), VelocitySetpoint(
            velocity_mps=(0.0, 0.0, 0.0), yaw_rad=None
        )
    if yaw:
        world.place_uav((x, y, BODY_ABOVE_FEET_M), attitude)
    return NO_THRUST, None
