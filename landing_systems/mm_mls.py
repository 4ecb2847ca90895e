"""MM-MLS: the learned detector, Ego-Planner, ArduPilot-style control with precision landing."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections import deque
from collections.abc import Callable

import numpy as np

from landing_systems.modules.decision import Decision, DecisionModule, DecisionParameters
from landing_systems.modules.detection_tphyolo.detector import TphYoloDetector
from landing_systems.modules.movement_watch import MovementWatch
from landing_systems.modules.planning_ego import LANDING, EgoPlanner, Setpoint
from pytest_garl import (
    Abort,
    Airframe,
    Command,
    Detection,
    Land,
    Mission,
    MotorThrusts,
    Observation,
    PositionSetpoint,
    VehicleState,
)
from pytest_garl.vehicle import ArduPilotControl, tuned, vehicle_of

AIRFRAME = Airframe(control_rate_hz=240)
PARAMETERS = dataclasses.replace(
    tuned(vehicle_of(AIRFRAME).hover_throttle),
    plnd_enabled=True,
    # With ArduPilot's 1 m/s² and 5 m/s³ a descent at 1.5 m/s is stopped after two seconds and
    # one and a half metres; who runs in is there by then. Both are at most of the ranges that
    # ArduPilot documents (0.5 to 5 m/s², 5 to 50 m/s³).
    wpnav_accel_z=5.0,
    psc_jerk_z=20.0,
)
DECISION = DecisionParameters()
CLEAR_S = 1.0
"""Nothing must have been in the way below for so long before a descent goes on."""
LOOK_EVERY = 2
LOOK_EVERY_WAITING = 5
"""Frames per look of the detector, but for a free descent, in which it looks at each: its network
takes two thirds of a step's time, and flying level five looks a second do, waiting two."""
PATIENCE = 1 / 3
"""Having waited for this share of its time limit for a place that is not free, it goes home."""
BELOW_SEARCH_M = 0.3
"""Lower than the height of the search by this, it makes way; that height is where it waits."""
REPORTED_M, REPORTED = 2.0, 30
"""How near its way an obstacle is reported, and how many cells are: a dog is a dozen, and a record
has room for 30 in each of 1,200 frames."""

Vector = tuple[float, float, float]


class MultiModuleLandingSystem:
    """The third row of the paper's table of landing systems.

    The decision module says where to go, the planner how to get there, the flight control
    flies it.  The last two metres are ArduPilot's precision landing, fed by the detector.
    A descent gives way, straight up, to what stands or moves below.
    """

    airframe = AIRFRAME

    def reset(self, mission: Mission) -> None:
        """Prepare for one flight."""
        self._mission = mission
        self._detector = TphYoloDetector(mission)
        self._decision = DecisionModule(mission, DECISION)
        self._planner = EgoPlanner(LANDING, mission.camera, mission.gps_position_m)
        self._control = ArduPilotControl(self.airframe, PARAMETERS)
        self._orders: deque[tuple[float, Callable[[], None]]] = deque()
        self._watch = MovementWatch(mission)
        self._blocked_s = -math.inf
        self._waited_s, self._stepped_s = 0.0, 0.0
        self._looked, self._look_every = 0, 1
        self._seen: tuple[Detection, ...] = ()

    def step(self, observation: Observation) -> Command:
        """See, decide, plan, order."""
        now = observation.time_s
        x, y, z = (float(value) for value in observation.position_m)
        self._looked += 1
        looks = self._looked >= self._look_every
        if looks:
            self._looked = 0
            self._seen = self._detector.detect(observation)
        seen = self._seen
        self._planner.observe(observation)
        decision = self._decision.decide(now, (x, y, z), seen if looks else None)
        if looks:
            self._tell_target(now, decision, seen)
        since, self._stepped_s = now - self._stepped_s, now
        if self._waited_s > PATIENCE * self._mission.time_limit_s:
            return Abort(diagnostics=decision.diagnostics(seen, note="the place was never free"))
        if decision.phase == "abort":
            return Abort(diagnostics=decision.diagnostics(seen))
        self._look_every = LOOK_EVERY
        if decision.phase == "take-off":
            self._later(now, lambda: self._control.take_off(self._mission.search_altitude_m))
            return PositionSetpoint(
                position_m=decision.goal_m, diagnostics=decision.diagnostics(seen)
            )
        if self._watch.in_the_way(observation):
            self._blocked_s = now
        descends = decision.phase in ("descend", "commit")
        low = z < self._mission.search_altitude_m - BELOW_SEARCH_M
        if now - self._blocked_s < CLEAR_S and (descends or low):
            self._look_every = LOOK_EVERY_WAITING
            self._waited_s += since
            return self._give_way(now, decision, seen, (x, y, z))
        if descends:
            self._look_every = 1
        if decision.phase == "commit":
            self._later(now, self._control.land)
            note = f"precision landing: {self._control.precision.status}"
            return Land(diagnostics=decision.diagnostics(seen, note=note))
        self._planner.set_goal(decision.goal_m)
        plan = self._planner.plan(now, observation.position_m, observation.velocity_mps)
        self._later(now, lambda: self._follow(plan))
        note = str(plan.error or decision.note)
        return PositionSetpoint(
            position_m=plan.position_m,
            diagnostics=decision.diagnostics(
                seen,
                path=plan.path_m,
                note=note,
                obstacles=self._obstacles((x, y, z), decision.goal_m),
            ),
        )

    def control(self, state: VehicleState) -> MotorThrusts:
        """Fly the motors; orders take effect ``latency_s`` after the image they came from."""
        while self._orders and self._orders[0][0] <= state.time_s:
            self._orders.popleft()[1]()
        return self._control.control(state)

    def _later(self, now: float, order: Callable[[], None]) -> None:
        self._orders.append((now + self.airframe.latency_s, order))

    def _follow(self, plan: Setpoint) -> None:
        self._control.guide(
            position=plan.position_m,
            velocity=plan.velocity_mps,
            acceleration=plan.acceleration_mps2,
            yaw=0.0,
        )

    def _tell_target(self, now: float, decision: Decision, seen: tuple[Detection, ...]) -> None:
        """Tell precision landing where the target is seen, once there is one."""
        target = decision.target_m
        if target is None:
            return
        for item in seen:
            near = math.dist(item.position_m[:2], target) <= DECISION.retarget_m
            sure = item.confidence >= DECISION.min_confidence
            if item.marker_id == self._mission.marker_id and near and sure:
                tell = self._control.landing_target
                self._later(now, functools.partial(tell, item.position_m, now))
                return

    def _give_way(
        self, now: float, decision: Decision, seen: tuple[Detection, ...], at: Vector
    ) -> Command:
        """Climb straight up, where the UAV came from, without asking the planner."""
        self._decision.interrupt()
        refuge = (at[0], at[1], max(at[2], self._mission.search_altitude_m))
        self._later(now, functools.partial(self._control.guide, position=refuge, yaw=0.0))
        note, obstacles = "something is in the way below", self._obstacles(at, decision.goal_m)
        return PositionSetpoint(
            position_m=refuge,
            diagnostics=decision.diagnostics(seen, note=note, obstacles=obstacles),
        )

    def _obstacles(self, at: Vector, goal: Vector) -> tuple[Vector, ...]:
        """Return what the planner takes for solid near the straight way, for the record."""
        start, end = np.array(at[:2]), np.array(goal[:2])
        found = self._planner.grid.obstacles_beside(start, end, REPORTED_M, REPORTED)
        return tuple((x, y, z) for x, y, z in found.tolist())
