"""The director of a search is trained in a process of its own, which may be begun anew."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from pytest_garl.execution.flight_id import FlightId, Slot
from pytest_garl.execution.fly_and_judge import judged
from pytest_garl.flight.flight import Flight
from pytest_garl.flight.flight_file import save
from pytest_garl.npcs.director_progress import AND_EVENTS, Progress
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.files import dump_scenario
from pytest_garl.scenarios.groups import EVENT_MOMENTS
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.search.teaching import Lessons, Teacher
from pytest_garl.verdicts.verdict import DEFAULT_LIMITS
from tests.execution.flying import Good, job_of
from tests.npcs.test_lessons import Sinks, chasing, flown

pytestmark = pytest.mark.sim


@pytest.fixture(scope="module")
def waiting() -> tuple[Scenario, Flight]:
    decided = float(EVENT_MOMENTS.index("decided"))
    scenario = chasing().replace({"jump.after": decided, "jump.distance_m": 2.0})
    return scenario, flown(scenario)


def test_a_process_that_was_begun_anew_learns_the_same(
    tmp_path: Path, waiting: tuple[Scenario, Flight]
) -> None:
    scenario, flight = waiting
    job = dataclasses.replace(job_of(Good, tmp_path), npcs=policy_spec("graded"))
    for generation in range(2):
        slot = Slot(generation=generation, index=1)
        save(flight, job.record(FlightId(search="s", map=job.map, slot=slot)))
    landed = judged(flight, DEFAULT_LIMITS)
    done = [(dump_scenario(scenario), landed)] * 2
    learned: list[tuple[str, Progress, Progress]] = []
    with Teacher() as teacher:
        for interrupts in (False, True):
            lessons = Lessons(teacher, "s", job, Sinks.airframe)
            assert lessons.director == ""
            first = lessons.learn(0, done)
            assert first.npcs.npcs == first.events.flights == 1, "the other slot has no record"
            if interrupts:
                teacher.close()
            second = lessons.learn(1, done)
            learned.append((lessons.director, first, second))
            teacher.close()
    assert learned[0] == learned[1]
    director, _, second = learned[0]
    assert all(director.split(AND_EVENTS))
    assert second.events.struck == 1
