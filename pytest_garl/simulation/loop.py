"""The 240 Hz loop of one flight: everything that happens in a simulated second."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from pytest_garl.landing_system import (
    Abort,
    Airframe,
    Command,
    Land,
    VehicleState,
)
from pytest_garl.scenarios.bodies import rotate
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.placement import marker_position_m, wind_mps
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.camera.projection import eye_under
from pytest_garl.simulation.camera.renderer import Frame, Renderer
from pytest_garl.simulation.environment import changed
from pytest_garl.simulation.flight import Flight, Outcome
from pytest_garl.simulation.npc_policy import DECISION_STEP_S, Change, ObjectPolicy, Situation
from pytest_garl.simulation.physics.flight_control import FlightControl
from pytest_garl.simulation.physics.npc import MovingObject
from pytest_garl.simulation.physics.vehicle import (
    Motion,
    Quaternion,
    Thrusts,
    Vector,
    drag,
    lag,
    vehicle_model,
    wrench,
)
from pytest_garl.simulation.physics.world import PHYSICS_RATE_HZ, World
from pytest_garl.simulation.randomness import generator
from pytest_garl.simulation.recorder import Recorder
from pytest_garl.simulation.system_under_test.calls import (
    BrokenError,
    StepGuard,
    SystemCalls,
    read_airframe,
)
from pytest_garl.simulation.system_under_test.diagnostics import Room
from pytest_garl.simulation.system_under_test.ground_truth import Truth, TruthObject
from pytest_garl.simulation.system_under_test.mission import mission_for
from pytest_garl.simulation.system_under_test.observation import observe
from pytest_garl.simulation.system_under_test.validation import read_command, read_thrusts

TRACK_EVERY = 10
OBJECTS_EVERY = 4
LANDED_SPEED_MPS = 0.2
LANDED_TILT_RAD = math.radians(20)
LANDED_AFTER_S = 1.0
AIRBORNE_M = 1.0
HARD_TOUCHDOWN_MPS = 2.0
"""Contact speed of a drop from 0.2 m: the least drop height of EASA CS 27.725."""
ABORT_CLEAR_M = 2.0
ABORT_HEIGHT_M = 5.0
CLEAR_OF_CONTACT_M = 2.0
"""What is that far off is not touched before the next sample of the track: the engine need not be
asked.  To meet within 10 steps the two would have to close at 48 m/s."""
POSITION_NOISE_M = 0.02
VELOCITY_NOISE_MPS = 0.05
"""Engineering estimate: RTK gives centimetres; 0.05 m/s is u-blox's stated accuracy (M8)."""


class Loop:
    """One flight under way; ``begin`` it, then ``tick`` until there is an outcome."""

    def __init__(
        self,
        scenario: Scenario,
        system: Callable[[], Any],
        policy: Callable[[], ObjectPolicy],
        map: Map,
        time_limit_s: float,
        guard: StepGuard | None,
    ) -> None:
        self.scenario, self.map = scenario, map
        self.time_limit_s = time_limit_s
        self.last_tick = round(time_limit_s * PHYSICS_RATE_HZ)
        self.make_system = system
        self.calls = SystemCalls(system, guard)
        self.airframe, self._no_airframe = self._read_airframe()
        self.marker = marker_position_m(scenario, map)
        self.model = vehicle_model(self.airframe)
        self.objects = [MovingObject(scenario, map, name, policy()) for name, _ in map.object_names]
        self.world = World(
            self.model, map.uav_start_m, map.bodies, [item.body for item in self.objects]
        )
        self.recorder = Recorder(map, self.objects, self.marker)
        self.control = FlightControl(self.model)
        self.wind = wind_mps(scenario)
        self.pose_rng = generator(scenario.seed, "pose")
        self.thrusts: Thrusts = (0.0, 0.0, 0.0, 0.0)
        self.pending: list[tuple[int, Command]] = []
        self.command: Command | None = None
        self.room = Room()
        self.gave_up = False
        self.airborne = False
        self.landed_since: float | None = None
        self.gaps: dict[str, float] = {}
        self.nothing_near = False
        self.ticks = 0

    def run(self) -> Flight:
        """Fly to the end and return the record, without hash and versions."""
        crash = None
        try:
            self.begin()
            outcome = self.tick()
            while outcome is None:
                outcome = self.tick()
        except BrokenError as broken:
            if self._is_finite():
                self._record_pose(self.recorder.time_s)
            self.recorder.event("crashed", broken.crash.message)
            outcome, crash = "crashed", broken.crash
        finally:
            self.close()
        return self.recorder.flight(outcome, crash)

    def begin(self) -> None:
        """Reset policies and landing system."""
        # By its place among all: who stays at home changes nothing for the others.
        numbers = {name: index for index, (name, _) in enumerate(self.map.residents)}
        for item in self.objects:
            rng = generator(self.scenario.seed, "objects", numbers[item.name])
            item.policy.reset(self.situation(item), rng)
        self._start_system()

    def close(self) -> None:
        """Free the physics."""
        self.world.close()

    def _read_airframe(self) -> tuple[Airframe, BrokenError | None]:
        """Return the airframe, or the default and what ends the flight when it has begun."""
        try:
            return self.calls.ask("airframe", lambda: read_airframe(self.make_system)), None
        except BrokenError as broken:
            return Airframe(), broken

    def _start_system(self) -> None:
        self.recorder.begin(*self.world.uav()[:3])
        if self._no_airframe:
            raise self._no_airframe
        self.system = self.calls.ask("reset", lambda: self.make_system())
        mission = mission_for(self.scenario, self.map, self.airframe, self.time_limit_s)
        self.calls.ask("reset", lambda: self.system.reset(mission))
        self.sees: bool = self.calls.ask(
            "needs_camera", lambda: bool(getattr(self.system, "needs_camera", True))
        )
        self.tells_truth: bool = self.calls.ask(
            "observe_truth", lambda: getattr(self.system, "observe_truth", None) is not None
        )
        camera = self.airframe.camera
        self.renderer = (
            Renderer(self.scenario, self.map, camera, generator(self.scenario.seed, "sensor"))
            if self.sees
            else None
        )
        self.camera_every = max(1, round(PHYSICS_RATE_HZ / camera.rate_hz))
        rate = self.airframe.control_rate_hz
        self.control_every = max(1, round(PHYSICS_RATE_HZ / rate)) if rate else 1
        self.motors: Thrusts = (0.0, 0.0, 0.0, 0.0)

    @property
    def out_of_time(self) -> bool:
        """Whether the next ``tick`` is the one that says so."""
        return self.ticks >= self.last_tick

    def tick(self) -> Outcome | None:
        """Advance by 1/240 s; return the outcome once there is one."""
        tick = self.ticks
        if self.out_of_time:
            self.recorder.event("time_out", f"not landed after {self.time_limit_s:g} s")
            return "not_landed"
        self.ticks += 1
        now = tick / PHYSICS_RATE_HZ
        self.recorder.time_s = now
        position, attitude, velocity, spin = self.world.uav()
        if not math.isfinite(sum(position) + sum(attitude) + sum(velocity) + sum(spin)):
            raise self.calls.nonsense(
                "NotFinite",
                f"after {now:.2f} s the flight is no longer one of finite numbers; expected "
                "commands and an airframe that the physics can follow",
                "step",
            )
        if tick % OBJECTS_EVERY == 0:
            self._move_objects(tick)
        if tick % TRACK_EVERY == 0:
            self._record_pose(now)
            if isinstance(self.command, Abort) and self._clear(position):
                self.recorder.event("aborted", "gave up and climbed clear of everything")
                return "aborted"
        if tick % self.camera_every == 0:
            self._see(tick, position, attitude, velocity)
        while self.pending and self.pending[0][0] <= tick:
            self._take(self.pending.pop(0)[1])
        x, y, z, w = attitude
        self._drive(tick, Motion(position, velocity, attitude, rotate((-x, -y, -z, w), spin)))
        return self._contacts(now, position, attitude, velocity)

    def _drive(self, tick: int, motion: Motion) -> None:
        dt = 1 / PHYSICS_RATE_HZ
        resting = isinstance(self.command, Land) and self.landed_since is not None
        if resting:
            wanted: Thrusts = (0.0, 0.0, 0.0, 0.0)
        elif self.airframe.control_rate_hz and not isinstance(self.command, Abort):
            if tick % self.control_every == 0:
                state = self._state(tick, motion)
                most_n = self.model.max_thrust_n
                self.motors = self.calls.ask(
                    "control", lambda: read_thrusts(self.system.control(state), most_n)
                )
            wanted = self.motors
        else:
            wanted = self.control.thrusts(motion, self.command, dt)
        model, attitude = self.model, motion.attitude
        self.thrusts = lag(self.thrusts, wanted, model, dt)
        total, torque = wrench(self.thrusts, model)
        fx, fy, fz = rotate(attitude, (0.0, 0.0, total))
        (vx, vy, vz), (wind_x, wind_y) = motion.velocity_mps, self.wind
        dx, dy, dz = drag((vx - wind_x, vy - wind_y, vz), model)
        self.world.step(motion.position_m, (fx + dx, fy + dy, fz + dz), rotate(attitude, torque))

    def _state(self, tick: int, motion: Motion) -> VehicleState:
        return VehicleState(
            time_s=tick / PHYSICS_RATE_HZ,
            position_m=motion.position_m,
            velocity_mps=motion.velocity_mps,
            attitude=motion.attitude,
            angular_velocity_radps=motion.spin_radps,
            thrusts_n=self.thrusts,
        )

    def _contacts(
        self, now: float, position: Vector, attitude: Quaternion, velocity: Vector
    ) -> Outcome | None:
        if not self.airborne and position[2] > AIRBORNE_M:
            self.airborne = True
            self.recorder.event("took_off", "left the ground")
        touches = () if self.nothing_near else self.world.touches()
        if not touches:
            self.landed_since = None
            return None
        x, y, _, _ = attitude
        tilt = math.acos(max(-1.0, min(1.0, 1 - 2 * (x * x + y * y))))
        speed = math.sqrt(sum(value * value for value in velocity))
        grounded = False
        for touch in touches:
            if touch.body != "ground":
                approach = self._approach_mps(touch.body, velocity)
                self.recorder.contact(touch.body, touch.position_m, approach, tilt)
                self.gaps[touch.body] = 0.0
                self._record_pose(now)
                return "collision"
            grounded = True
            if self.airborne and not self.recorder.touched_ground:
                self.recorder.contact("ground", touch.position_m, abs(velocity[2]), tilt)
                if abs(velocity[2]) > HARD_TOUCHDOWN_MPS or tilt > LANDED_TILT_RAD:
                    self._record_pose(now)
                    return "collision"
        still = speed < LANDED_SPEED_MPS and tilt < LANDED_TILT_RAD
        if not (self.airborne and grounded and still):
            self.landed_since = None
            return None
        if self.landed_since is None:
            self.landed_since = now
        if now - self.landed_since >= LANDED_AFTER_S:
            self._record_pose(now)
            self.recorder.event("landed", "at rest on the ground")
            return "landed"
        return None

    def _approach_mps(self, body: str, velocity: Vector) -> float:
        """Return the UAV's speed relative to a body: what walks may hit what hovers."""
        moving = next((item for item in self.objects if item.name == body), None)
        vx, vy = (moving.vx_mps, moving.vy_mps) if moving else (0.0, 0.0)
        return math.dist(velocity, (vx, vy, 0.0))

    def _move_objects(self, tick: int) -> None:
        if tick % round(DECISION_STEP_S * PHYSICS_RATE_HZ) == 0:
            moves = [item.decide(self.situation(item)) for item in self.objects]
            self._change([change for move in moves for change in move.changes])
        for item in self.objects:
            item.advance(OBJECTS_EVERY / PHYSICS_RATE_HZ, self.objects)
            self.world.move(
                item.name, item.position_m, item.yaw_rad, (item.vx_mps, item.vy_mps, 0.0)
            )

    def _change(self, changes: Sequence[Change]) -> None:
        scenario = changed(self.scenario, changes)
        if scenario != self.scenario:
            self.scenario = scenario
            if self.renderer:
                self.renderer.change(scenario)

    def situation(self, item: MovingObject) -> Situation:
        """Return what the policy of an object may see at this moment."""
        position, _, velocity, _ = self.world.uav()
        return Situation(
            time_s=self.recorder.time_s,
            self=item.state,
            others=tuple(other.state for other in self.objects if other is not item),
            uav_position_m=position,
            uav_velocity_mps=velocity,
            marker_position_m=self.marker,
            map=self.map,
            scenario=self.scenario,
        )

    def eye(self) -> tuple[Vector, Quaternion]:
        """Return the camera's place and the UAV's attitude."""
        position, attitude, _, _ = self.world.uav()
        return eye_under(position, attitude), attitude

    def _see(self, tick: int, position: Vector, attitude: Quaternion, velocity: Vector) -> None:
        now = tick / PHYSICS_RATE_HZ
        if self.tells_truth and not self.gave_up:
            truth = Truth(
                marker_m=self.marker,
                objects=tuple(
                    TruthObject(
                        position_m=item.position_m,
                        velocity_mps=(item.vx_mps, item.vy_mps),
                        type=item.type,
                    )
                    for item in self.objects
                ),
                map=self.map,
            )
            self.calls.ask("observe_truth", lambda: self.system.observe_truth(truth))
        camera = self.airframe.camera
        if self.renderer:
            eye = eye_under(position, attitude)
            poses = [(item.position_m, item.yaw_rad) for item in self.objects]
            frame = self.renderer.render(eye, attitude, now, poses)
            visible = self.recorder.sight(frame, self.renderer, eye, attitude)
        else:
            frame, visible = _blank(camera.height_px, camera.width_px), (0.0, 0.0, ())
        if self.gave_up:
            # What there was to see explains a collision on the way up.
            self.recorder.step(Abort(), visible)
            return
        noise = self.pose_rng.standard_normal(6)
        observation = observe(
            frame,
            time_s=now,
            position_m=np.array(position) + POSITION_NOISE_M * noise[:3],
            velocity_mps=np.array(velocity) + VELOCITY_NOISE_MPS * noise[3:],
            attitude=np.array(attitude),
        )
        command: Command = self.calls.ask(
            "step", lambda: read_command(self.system.step(observation), self.room)
        )
        self.gave_up = isinstance(command, Abort)
        self.recorder.step(command, visible)
        delay = round(self.airframe.latency_s * PHYSICS_RATE_HZ)
        self.pending.append((tick + delay, command))

    def _take(self, command: Command) -> None:
        if type(command) is not type(self.command) and isinstance(command, Abort | Land):
            word = "abort_command" if isinstance(command, Abort) else "land_command"
            self.recorder.event(word, f"the system said {type(command).__name__}()")
        self.command = command
        self.control.take(command)

    def _is_finite(self) -> bool:
        return all(math.isfinite(value) for part in self.world.uav() for value in part)

    def _clear(self, position: Vector) -> bool:
        return position[2] >= ABORT_HEIGHT_M and all(
            gap >= ABORT_CLEAR_M for gap in self.gaps.values()
        )

    def _record_pose(self, now: float) -> None:
        position, attitude, velocity, _ = self.world.uav()
        gaps = self.world.separations()
        gaps.update({name: 0.0 for name, gap in self.gaps.items() if gap == 0.0})
        self.gaps = gaps
        least = min(gaps.values(), default=math.inf)
        above_ground = position[2] - self.model.size_m
        self.nothing_near = min(least, above_ground) > CLEAR_OF_CONTACT_M
        self.recorder.pose(now, position, attitude, velocity, gaps)


@functools.cache
def _blank(height: int, width: int) -> Frame:
    return Frame(
        paint=lambda: np.zeros((height, width, 3), np.uint8),
        depth_m=np.zeros((height, width), np.float32),
        segmentation=np.zeros((height, width), np.int32),
        pixels=np.zeros(2, np.intp),
    )
