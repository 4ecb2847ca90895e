"""Landings of the surrogate in which one NPC of a grade has a story."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from pytest_garl.landing_system import Airframe
from pytest_garl.npcs.encounter import begins_at
from pytest_garl.npcs.grades import GRADE_LIMITS
from pytest_garl.npcs.training.episode import Episode, draw_episode
from pytest_garl.npcs.training.presets import Surrogate
from pytest_garl.npcs.training.uav_models import (
    AvoidanceParameters,
    AvoidingPilot,
    FlightStyle,
    StraightPilot,
)
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.object_types import BIRD_HEIGHTS_M, OBJECT_TYPES
from pytest_garl.scenarios.placed import Placed, start_genes
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.story import GRADES, LIMITS_S, STORY, with_all_values
from pytest_garl.scenarios.task import Start
from pytest_garl.scenarios.validity import repair

START_HEIGHTS_M = (3.0, 11.0)
START_OFFSET_M = 4.0
LATEST_COMING_S = 8.0
"""An NPC comes at most this long after the start: a descent from 11 m takes 10 to 20 s."""
BEYOND_SIGHT_M = 2.0
"""An NPC starts at most this much farther from the marker than it sees."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GradedLanding:
    """A landing with one NPC, and the UAV that flies it: "straight" or "avoiding"."""

    scenario: Scenario
    map: Map
    pilot: Callable[[], Any]
    airframe: Airframe
    grade: str
    uav: str

    @property
    def npc(self) -> str:
        """The name of its NPC."""
        return self.map.present_objects[0][0]

    def begin(self) -> Episode:
        """Return the landing at its start."""
        return Episode(self.scenario, self.map, self.pilot)

    def with_begin_at(self, moment_s: float) -> GradedLanding:
        """Return the landing with an NPC that begins at a time after the start."""
        return dataclasses.replace(self, scenario=begins_at(self.scenario, self.npc, moment_s))


def draw_graded_landing(surrogate: Surrogate, rng: np.random.Generator) -> GradedLanding:
    """Draw a landing; most begin in the air near the marker, the others with the take-off."""
    map = surrogate.maps[int(rng.integers(len(surrogate.maps)))]
    type_name = surrogate.types[int(rng.integers(len(surrogate.types)))]
    grade = surrogate.grades[int(rng.integers(len(surrogate.grades)))]
    height = float(rng.uniform(*START_HEIGHTS_M))
    scenario, place = draw_episode(map, [type_name], rng)
    scenario = with_story(scenario, place, grade, height, rng)
    style = FlightStyle.drawn(rng)
    avoiding = rng.random() < {"straight": 0.0, "both": 0.5, "avoiding": 1.0}[surrogate.uav]
    avoidance = AvoidanceParameters.drawn(rng) if avoiding else None
    if surrogate.takes_off and rng.random() < surrogate.takes_off:
        task = dataclasses.replace(scenario.task, start=Start())
        scenario = repair(dataclasses.replace(scenario, task=task), place)
    else:
        style = dataclasses.replace(style, cruise_m=height, begins_in_air=True)
    pilot: Any = functools.partial(StraightPilot, style)
    if avoidance is not None:
        pilot = functools.partial(AvoidingPilot, style, avoidance)
    pilot.airframe = surrogate.airframe
    return GradedLanding(
        scenario=scenario,
        map=place,
        pilot=pilot,
        airframe=surrogate.airframe,
        grade=grade,
        uav="straight" if avoidance is None else "avoiding",
    )


def _near(scenario: Scenario, map: Map, name: str, grade: str) -> tuple[float, float]:
    """Return the start of an NPC, moved to where it soon perceives a UAV above the marker."""
    placed = Placed(scenario, map)
    (x, y), (mx, my) = placed.npc(name).start_m, placed.marker_m
    away = math.dist((x, y), (mx, my))
    share = min(1.0, (GRADE_LIMITS[grade].sees_within_m + BEYOND_SIGHT_M) / max(away, 1e-6))
    return mx + share * (x - mx), my + share * (y - my)


def with_story(
    scenario: Scenario, map: Map, grade: str, height_m: float, rng: np.random.Generator
) -> Scenario:
    """Return the scenario with a drawn story of its NPC, and a start in the air."""
    name, kind = map.present_objects[0]
    values = {
        "grade": float(GRADES.index(grade)),
        "delay_s": float(rng.uniform(0, LATEST_COMING_S)),
        "lasts_s": min(LIMITS_S[grade], float(rng.uniform(*STORY["lasts_s"].draws))),
    }
    genes = dict(scenario.genes) | with_all_values(values, name, kind)
    genes |= start_genes(name, _near(scenario, map, name, grade), map)
    if OBJECT_TYPES[kind].flies:
        bird_m = float(rng.uniform(BIRD_HEIGHTS_M[0], height_m))
        genes[f"{name}.height_m"] = bird_m
        genes[f"{name}.stoop_m"] = float(rng.choice([0.0, rng.uniform(0, bird_m)]))
    angle, offset = rng.uniform(0, 2 * math.pi), float(rng.uniform(0, START_OFFSET_M))
    start = Start(
        mode="hover",
        height_m=height_m,
        offset_m=(offset * math.cos(angle), offset * math.sin(angle)),
    )
    task = dataclasses.replace(scenario.task, start=start)
    return repair(dataclasses.replace(scenario, genes=tuple(genes.items()), task=task), map)
