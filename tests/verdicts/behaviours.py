"""Landing systems with one behaviour each, and the scenes in which they fly."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from pytest_garl.flight.flight import Flight
from pytest_garl.landing_system import (
    Abort,
    Airframe,
    AttitudeSetpoint,
    Command,
    Diagnostics,
    Land,
    Mission,
    Observation,
    PositionSetpoint,
    VelocitySetpoint,
)
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.placed import Placed, start_genes
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.fly import fly

SEARCH_M = 10.0
ARRIVED_M = 0.3
Place = tuple[float, float]
Last = Callable[[Observation], Command]


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """A scenario without objects in clear weather, on one map, but for these genes."""

    map: Map
    scenario: Scenario

    @property
    def marker(self) -> Place:
        """The marker's place, which no landing system is told."""
        return Placed(self.scenario, self.map).marker_m

    def fly(self, route: Route, *, time_limit_s: float = 120.0) -> Flight:
        """Fly a route."""
        return fly(
            self.scenario,
            lambda: route,
            policy_spec("stationary"),
            map=self.map,
            time_limit_s=time_limit_s,
        )


def scene(
    map_name: str = "court",
    genes: Mapping[str, float] | None = None,
    person_on_marker: bool = False,
) -> Scene:
    """Return a scene; the only object that it may have is a person who stands on the marker."""
    map = load_map(map_name)
    scenario = decode(genome_for(map).nominal, genome_for(map), map=map_name, seed=1)
    scenario = scenario.replace(genes or {})
    names = [name for name, _ in map.all_objects]
    if person_on_marker:
        place = Placed(scenario, map).marker_m
        scenario = scenario.replace(start_genes("person-1", place, map))
        names.remove("person-1")
    return Scene(map=map, scenario=scenario.without(*names))


class Route:
    """Climbs, flies to places one after the other, holds over the last one, and ends as told.

    ``last`` returns the commands after the hold.  ``target_m`` is what it reports as its target.
    """

    airframe = Airframe()

    def __init__(
        self,
        *places: Place,
        last: Last,
        hold_s: float = 0.0,
        height_m: float = SEARCH_M,
        target_m: Place | None = None,
    ) -> None:
        self._places, self._last, self._hold_s = places, last, hold_s
        self._height_m = height_m
        self._target = (*target_m, 0.0) if target_m else None

    def reset(self, mission: Mission) -> None:
        """Stand at home."""
        self._home = mission.home_m[:2]
        self._left = list(self._places)
        self._arrived_s: float | None = None
        self._up = False

    def step(self, observation: Observation) -> Command:
        """Fly to the next place, hold, end."""
        x, y, z = (float(value) for value in observation.position_m)
        diagnostics = Diagnostics(target_m=self._target) if self._target else None
        self._up = self._up or z > self._height_m - 0.5
        if not self._up:
            return PositionSetpoint(position_m=(*self._home, self._height_m))
        if self._left and math.dist((x, y), self._left[0]) < ARRIVED_M:
            self._here = self._left.pop(0)
        if self._left:
            goal = (*self._left[0], self._height_m)
            return PositionSetpoint(position_m=goal, diagnostics=diagnostics)
        if self._arrived_s is None:
            self._arrived_s = observation.time_s
        if observation.time_s - self._arrived_s < self._hold_s:
            goal = (*(self._here if self._places else self._home), self._height_m)
            return PositionSetpoint(position_m=goal, diagnostics=diagnostics)
        return self._last(observation)


def give_up(observation: Observation) -> Command:
    """Give up."""
    del observation
    return Abort()


def land(observation: Observation) -> Command:
    """Come down straight."""
    return Land(speed_mps=1.5 if observation.position_m[2] > 2.0 else 0.5)


def fall(observation: Observation) -> Command:
    """Switch the motors off at two metres."""
    if observation.position_m[2] > 2.0:
        return Land(speed_mps=1.5)
    return AttitudeSetpoint(attitude=(0.0, 0.0, 0.0, 1.0), thrust=0.0)


def hover(observation: Observation) -> Command:
    """Stay."""
    del observation
    return VelocitySetpoint(velocity_mps=(0.0, 0.0, 0.0))


def fail(observation: Observation) -> Command:
    """Raise."""
    raise ValueError(f"no plan at {observation.time_s:.1f} s")


def touch_and_give_up(observation: Observation) -> Command:
    """Touch the ground and give up."""
    return Abort() if observation.position_m[2] < 0.25 else land(observation)


def land_sideways(speed_mps: float) -> Last:
    """Return what comes down, and drives on over the ground."""

    def last(observation: Observation) -> Command:
        height = float(observation.position_m[2])
        if height > 1.0:
            return Land(speed_mps=1.5 if height > 2.0 else 0.5)
        return VelocitySetpoint(velocity_mps=(speed_mps, 0.0, -0.5))

    return last


def land_and_drift(speed_mps: float) -> Last:
    """Return what comes down with a drift and stops its motors when it touches the ground."""
    down = False

    def last(observation: Observation) -> Command:
        nonlocal down
        height = float(observation.position_m[2])
        down = down or height < 0.23
        if down:
            return AttitudeSetpoint(attitude=(0.0, 0.0, 0.0, 1.0), thrust=0.0)
        if height > 1.0:
            return Land(speed_mps=1.5 if height > 2.0 else 0.5)
        return VelocitySetpoint(velocity_mps=(speed_mps, 0.0, -0.5))

    return last


def fly_on_and_give_up(place: Place, after_s: float) -> Last:
    """Return what leaves for another place and gives up there."""
    left_s: float | None = None

    def last(observation: Observation) -> Command:
        nonlocal left_s
        left_s = observation.time_s if left_s is None else left_s
        if observation.time_s - left_s > after_s:
            return Abort()
        return PositionSetpoint(position_m=(*place, SEARCH_M))

    return last
