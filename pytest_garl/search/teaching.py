"""The director learns the landing system: weights for each generation, from the flights before it.

It is trained in a process that computes as a worker does, beside the flights.
"""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pytest_garl.airframe import Airframe
from pytest_garl.execution.flight_id import FlightId, Slot
from pytest_garl.execution.job import FlightJob, parse_job
from pytest_garl.execution.result import FlightResult
from pytest_garl.execution.separate_process import AskedProcess, answer_questions
from pytest_garl.files.json_values import dataclass_from
from pytest_garl.npcs.director_progress import Outcome, Progress
from pytest_garl.search.objectives import near_miss

if TYPE_CHECKING:
    from pytest_garl.npcs.search_directors import SearchDirectors


BODY_WORTH = 0.25
"""Worth of a collision with a moving body: nobody may have been able to prevent it, and who moved
that body decided as well."""
NEAR_MISS_WORTH = 0.1
"""Worth of a flight that violates nothing by a hair: the smallest margin decides where nothing
happens."""


def outcome_of(result: FlightResult) -> Outcome:
    """Return what a director of events learns of the end of a flight."""
    verdict = result.verdict
    if verdict.violation:
        return Outcome(violates=True, worth=BODY_WORTH if verdict.violation_type == "IV" else 1.0)
    return Outcome(violates=False, worth=NEAR_MISS_WORTH * near_miss(result)[1])


class Teacher(AskedProcess):
    """Trains the directors of a run's searches; close it at the end."""

    def __init__(self) -> None:
        super().__init__(__name__, "that trains the director")


class Lessons:
    """The lessons of one search: what its director learned from its flights so far."""

    def __init__(self, teacher: Teacher, search: str, job: FlightJob, airframe: Airframe) -> None:
        self._teacher, self._search, self._job = teacher, search, job
        self._about = {
            "search": search,
            "job": job.dumps(),
            "airframe": dataclasses.asdict(airframe),
        }
        self._flown: list[Sequence[tuple[str, str, dict[str, Any]]]] = []
        """Scenario, record and outcome of the flights of each generation."""
        self.director = ""
        """The weights; empty for those that ship, until a flight taught something."""

    def learn(self, generation: int, flown: Sequence[tuple[str, FlightResult | None]]) -> Progress:
        """Learn from the flights of a generation: their scenarios in text, in slot order."""
        map, records = self._job.map, []
        for index, (text, result) in enumerate(flown):
            slot = Slot(generation=generation, index=index)
            record = self._job.record(FlightId(search=self._search, map=map, slot=slot))
            if record.is_file() and result is not None:
                outcome = dataclasses.asdict(outcome_of(result))
                records.append((text, str(record), outcome))
        self._flown.append(records)
        # A process that was begun anew, after an interruption, learns all generations again.
        known = self._teacher.ask({**self._about, "flights": None})["generations"]
        for flights in self._flown[known:]:
            answer = self._teacher.ask({**self._about, "flights": flights})
        self.director = answer["director"]
        return dataclass_from(Progress, answer["progress"])


class _Pupils:
    """The directors of the searches, in the process that trains them."""

    def __init__(self) -> None:
        self._directors: dict[str, SearchDirectors] = {}
        self._generations: Counter[str] = Counter()

    def answer(self, question: dict[str, Any]) -> dict[str, Any]:
        """Learn from flights; without any, say how many generations a search has learned from."""
        from pytest_garl.flight.flight_file import load
        from pytest_garl.npcs.search_directors import SearchDirectors
        from pytest_garl.scenarios.files import parse_scenario

        search, flights = question["search"], question["flights"]
        if flights is None:
            return {"generations": self._generations[search]}
        if search not in self._directors:
            map = parse_job(question["job"]).load_map()
            airframe = dataclass_from(Airframe, question["airframe"])
            self._directors[search] = SearchDirectors(map, airframe)
        flown = [
            (parse_scenario(text), load(Path(file)), dataclass_from(Outcome, outcome))
            for text, file, outcome in flights
        ]
        progress = self._directors[search].learn(flown)
        self._generations[search] += 1
        return {
            "director": self._directors[search].text,
            "progress": dataclasses.asdict(progress),
        }


if __name__ == "__main__":
    answer_questions(_Pupils().answer)
