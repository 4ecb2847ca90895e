from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

from pytest_garl import Command, Mission, Observation, PositionSetpoint
from pytest_garl.cases.case import RecordedBehaviour
from pytest_garl.execution.flight_id import CompletedFlight
from pytest_garl.flight.flight import Flight
from pytest_garl.flight.flight_file import load, save
from pytest_garl.landing_system import Airframe, Camera
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.npcs.recorded import recorded_spec
from pytest_garl.scenarios.genes import ENVIRONMENT, genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.placed import Placed
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.search.methods.random import random_scenarios
from pytest_garl.shrinking.case_flights import recorded_behaviour
from pytest_garl.simulation.camera.renderer import Renderer
from pytest_garl.simulation.environment import changed, environment_at
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.npc_policy import Move, PolicySpec, Situation
from pytest_garl.simulation.randomness import generator
from tests.support.results import flight_result

LAWN = load_map("lawn")
SCENARIO = random_scenarios(LAWN, genome_for(LAWN), 3, 0, 1)[0]
SMALL = Camera(width_px=160, height_px=120)
LEVEL = (0.0, 0.0, 0.0, 1.0)


class Hovers:
    """Climbs; keeps what it sees."""

    airframe = Airframe(latency_s=0.0, camera=SMALL)
    seen: ClassVar[list[np.ndarray]] = []

    def reset(self, mission: Mission) -> None:
        self.home = mission.home_m
        self.seen.clear()

    def step(self, observation: Observation) -> Command:
        self.seen.append(observation.image.copy())
        return PositionSetpoint(position_m=(*self.home[:2], 3.0))


class Procrastinates(Hovers):
    """Keeps what it sees without looking at it."""

    kept: ClassVar[list[Observation]] = []

    def reset(self, mission: Mission) -> None:
        self.home = mission.home_m
        self.kept.clear()

    def step(self, observation: Observation) -> Command:
        self.kept.append(observation)
        return PositionSetpoint(position_m=(*self.home[:2], 3.0))


class Weathermaker:
    """Lets it snow on the ground from the third decision on; only the dog's does."""

    known: ClassVar[list[float]] = []

    def reset(self, situation: Situation, rng: np.random.Generator) -> None:
        self.known.clear()

    def decide(self, situation: Situation) -> Move:
        if situation.self.name != "dog-1":
            return Move(x=0.0, y=0.5)
        self.known.append(situation.scenario["environment.road_snow"])
        if situation.time_s < 1.0:
            return Move(x=0.0, y=1.0)
        changes = (("environment.road_snow", 0.4), ("environment.sun_position", -0.02))
        return Move(x=0.0, y=-1.0, changes=changes)


WEATHERMAKER = PolicySpec(name="weathermaker", factory=f"{__name__}:Weathermaker")


def flown(policy: PolicySpec = WEATHERMAKER) -> tuple[Flight, list[np.ndarray]]:
    flight = fly(SCENARIO, Hovers, policy, time_limit_s=3.0)
    return flight, list(Hovers.seen)


def test_an_image_looked_at_after_the_flight_shows_what_the_camera_saw_then() -> None:
    looked_at, seen = flown()
    procrastinated = fly(SCENARIO, Procrastinates, WEATHERMAKER, time_limit_s=3.0)
    assert procrastinated.sha256 == looked_at.sha256
    for observation, image in zip(Procrastinates.kept, seen, strict=True):
        assert (observation.image == image).all()
        assert not observation.image.flags.writeable
    other = np.zeros_like(seen[0])
    assert (dataclasses.replace(Procrastinates.kept[0], image=other).image == other).all()


def test_changes_add_up_and_stay_in_the_genes_range() -> None:
    fog = SCENARIO["environment.fog"]
    more = changed(SCENARIO, [("environment.fog", 0.1), ("environment.fog", 0.2)])
    assert more["environment.fog"] == pytest.approx(fog + 0.3)
    assert changed(SCENARIO, [("environment.fog", 2.0)])["environment.fog"] == 1.0
    assert changed(SCENARIO, [("environment.fog", -2.0)])["environment.fog"] == 0.0
    assert changed(SCENARIO, []) == SCENARIO


@pytest.mark.parametrize("key", ENVIRONMENT)
def test_a_renderer_that_changes_draws_what_one_made_so_would(key: str) -> None:
    renderer, step = _renderer(SCENARIO), -0.3 if key.endswith("sun_position") else 0.3
    scenario = changed(SCENARIO, [(key, step)])
    before = _frame(renderer)
    renderer.change(scenario)
    fresh = _renderer(scenario)
    assert (_frame(renderer) == _frame(fresh)).all()
    assert (_frame(renderer) != before).any()
    # And back, as if nothing had been.
    renderer.change(SCENARIO)
    assert (_frame(renderer) == before).all()
    assert renderer.covered(np.zeros((1, 2))).shape == (1,)


def test_the_ground_is_repainted_only_where_it_looks_different() -> None:
    renderer = _renderer(SCENARIO)
    ground = renderer._ground
    assert ground is not None
    renderer.change(changed(SCENARIO, [("environment.maple_leaf", 0.1)]))
    assert renderer._ground is ground
    renderer.change(changed(SCENARIO, [("environment.fog", 0.1)]))
    assert renderer._ground is not ground
    assert renderer._ground is not None
    assert renderer._ground.unlit is ground.unlit


def test_a_policy_that_changes_the_environment_is_seen_and_recorded() -> None:
    flight, seen = flown()
    still = PolicySpec(
        name="same",
        factory="pytest_garl.npcs.recorded:Recorded",
        arguments=recorded_spec(_moves(flight)).arguments,
    )
    calm, unchanged = flown(still)
    first = [bool((a == b).all()) for a, b in zip(seen, unchanged, strict=True)].index(False)
    # The third decision is at 1 s, the camera's eleventh frame.
    assert first == 10
    (dog,) = [item for item in flight.objects if item.name == "dog-1"]
    assert dog.changes[:2] == (
        (2, "environment.road_snow", 0.4),
        (2, "environment.sun_position", -0.02),
    )
    assert [number for number, _, _ in dog.changes] == [2, 2, 3, 3, 4, 4, 5, 5]
    assert not any(item.changes for item in flight.objects if item.name != "dog-1")
    # The same way was flown, and yet it is another flight.
    assert (flight.uav.position_m == calm.uav.position_m).all()
    assert flight.sha256 != calm.sha256


def test_a_policy_sees_the_present_environment() -> None:
    flown()
    snow = SCENARIO["environment.road_snow"]
    assert Weathermaker.known == pytest.approx([snow, snow, snow, snow + 0.4, snow + 0.8, 1.0])


def test_recorded_changes_fly_the_same_flight_to_the_byte(tmp_path: Path) -> None:
    flight, seen = flown()
    save(flight, tmp_path / "flight.npz")
    done = CompletedFlight(
        result=flight_result(), sha256=flight.sha256, record=tmp_path / "flight.npz"
    )
    behaviour = recorded_behaviour(done, SCENARIO, LAWN)
    assert [name for name, _ in behaviour.changes] == ["dog-1"]
    again, seen_again = flown(recorded_spec(dict(behaviour.moves), dict(behaviour.changes)))
    assert again.sha256 == flight.sha256
    assert all((a == b).all() for a, b in zip(seen, seen_again, strict=True))


def test_changes_survive_the_flights_file(tmp_path: Path) -> None:
    flight, _ = flown()
    save(flight, tmp_path / "flight.npz")
    back = load(tmp_path / "flight.npz")
    assert [item.changes for item in back.objects] == [item.changes for item in flight.objects]


def test_a_file_of_a_flight_that_changed_nothing_says_nothing_of_it(tmp_path: Path) -> None:
    flight = fly(SCENARIO, Hovers, policy_spec("waypoint"), time_limit_s=1.0)
    save(flight, tmp_path / "flight.npz")
    with np.load(tmp_path / "flight.npz") as file:
        assert b'"changes"' not in file["header"].tobytes()
    assert all(item.changes == () for item in load(tmp_path / "flight.npz").objects)
    done = CompletedFlight(result=flight_result(), sha256="", record=tmp_path / "flight.npz")
    assert recorded_behaviour(done, SCENARIO, LAWN) == RecordedBehaviour(
        moves=recorded_behaviour(done, SCENARIO, LAWN).moves
    )


def test_the_environment_at_a_time_is_that_of_the_flight() -> None:
    flight, _ = flown()
    snow = SCENARIO["environment.road_snow"]
    values = [
        environment_at(SCENARIO, flight, time_s)["environment.road_snow"]
        for time_s in (0.0, 0.99, 1.0, 1.49, 1.5, 3.0)
    ]
    assert values == pytest.approx([snow, snow, snow + 0.4, snow + 0.4, snow + 0.8, 1.0])


def _moves(flight: Flight) -> dict[str, list[tuple[float, float]]]:
    return {item.name: [(float(x), float(y)) for x, y in item.moves] for item in flight.objects}


def _renderer(scenario: Scenario) -> Renderer:
    return Renderer(Placed(scenario, LAWN), SMALL, generator(scenario.seed, "sensor"))


def _frame(renderer: Renderer) -> np.ndarray:
    x, y = renderer.marker_m
    poses = [((x + n, y + 1.0, 0.0), 0.3 * n) for n in range(len(LAWN.present_objects))]
    return np.asarray(renderer.render((x, y, 5.0), LEVEL, 1.0, poses).image)
