"""Queries on a ledger: progress, results, violations, costs, and the hash of the results."""

from __future__ import annotations

import hashlib
import itertools
import json
import re
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pytest_garl.execution.database import Database
from pytest_garl.execution.flight_id import CompletedFlight, FlightId, Slot
from pytest_garl.execution.result import FlightResult, parse_result
from pytest_garl.scenarios.files import parse_scenario
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.verdicts.ending import ending_of

_ADDRESS = re.compile(r"0x[0-9a-f]+")


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchProgress:
    """How far a search is: slots flown, all slots, and the latest generation."""

    search: str
    system: str
    map: str
    flown: int
    total: int
    generation: int


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightSeconds:
    """Mean wall times of flights in seconds; 0 without such flights."""

    of_search: float
    plain: float
    """Of the search's flights that violated nothing."""
    failing: float
    """Of those that violated a property, and of those that repeat, confirm and shrink them."""
    failing_count: int


@dataclass(frozen=True, slots=True, kw_only=True)
class LedgerFlight:
    """A flight of a search; ``scenario`` is text, ``sha256`` the hash of the trajectory."""

    id: FlightId
    system: str
    scenario: str
    result: FlightResult
    sha256: str

    @property
    def signature(self) -> str:
        """How it ended, as in the result; empty for a flight without violation."""
        return self.result.signature

    @property
    def seed(self) -> int:
        """The seed of the scenario."""
        return parse_scenario(self.scenario).seed

    @property
    def repeatable(self) -> Scenario:
        """The scenario, with what was decided in the flight as its own: it needs no director."""
        return repeatable(self.scenario, self.result)

    def completed(self, folder: Path) -> CompletedFlight:
        """Return the flight with its record, which is in a folder of flights."""
        record = self.id.record(folder)
        return CompletedFlight(result=self.result, sha256=self.sha256, record=record)


def repeatable(scenario: str, result: FlightResult | None) -> Scenario:
    """Return a scenario in text with what was decided in its flight: it needs no director."""
    return parse_scenario(scenario).replace(dict(result.decided) if result else {})


class LedgerQueries:
    """Reads what a ledger holds about its flights."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def progress(self) -> list[SearchProgress]:
        """Return how far each search is."""
        rows = self._database.execute(
            "SELECT search.id, system, map, coalesce(sum(state = 'flown'), 0), wanted, "
            "coalesce(max(generation), 0) FROM search "
            "LEFT JOIN slot ON search.id = slot.search WHERE kind = 'search' "
            "GROUP BY search.id ORDER BY system, map, search.id"
        )
        return [
            SearchProgress(
                search=search,
                system=system,
                map=map,
                flown=flown,
                total=wanted,
                generation=generation,
            )
            for search, system, map, flown, wanted, generation in rows
        ]

    def flights(self, search: str = "") -> list[LedgerFlight]:
        """Return the flights of all searches in slot order, or those of one search."""
        return self._flights("? IN ('', search.id)", search)

    def wanted(self, search: str) -> int:
        """Return the number of flights of a search, those that have not been bred included."""
        row = self._database.execute("SELECT wanted FROM search WHERE id = ?", (search,)).fetchone()
        return int(row[0]) if row else 0

    def left(self) -> int:
        """Return how many flights of searches have no result, those not yet bred included."""
        return sum(each.total - each.flown for each in self.progress())

    def unflown(self, search: str, generation: int) -> int:
        """Return how many of a generation's slots have no result."""
        row = self._database.execute(
            "SELECT count(*) FROM slot WHERE search = ? AND generation = ? AND result IS NULL",
            (search, generation),
        ).fetchone()
        return int(row[0])

    def closed_generations(self, search: str, after: int) -> list[int]:
        """Return the generations after ``after`` that are flown, up to the first that is not.

        A search adds one generation after the other, so no earlier one can follow.
        """
        rows = self._database.execute(
            "SELECT generation, sum(result IS NULL) FROM slot "
            "WHERE search = ? AND generation > ? GROUP BY generation ORDER BY generation",
            (search, after),
        )
        return [row[0] for row in itertools.takewhile(lambda row: not row[1], rows)]

    def violating(self, search: str = "", generation: int | None = None) -> list[LedgerFlight]:
        """Return the flights that violated a property, in slot order: all, or of a generation."""
        return self._flights(
            "json_extract(result, '$.verdict.primary') IS NOT NULL "
            "AND ? IN ('', search.id) AND coalesce(?, generation) = generation",
            search,
            generation,
        )

    def first_of(self, search: str, signature: str) -> LedgerFlight:
        """Return the first flight, in slot order, of those that end with a signature so far."""
        return next(each for each in self.violating(search) if each.signature == signature)

    def flight_with_hash(
        self, sha256: str, *, scenario: str = "", signature: str = ""
    ) -> LedgerFlight | None:
        """Return a flight whose trajectory has a hash: of a search, or flown on demand.

        Several flights may have one trajectory: a UAV that waits for a marker flies alike in fog
        and in dust.  So it is the flight of ``scenario``, else one that ends as ``signature`` says.
        A failed assertion of a user's own is in no flight's result, so any flight may have it.
        """
        if not sha256:
            return None
        found = self._flights("slot.sha256 = ?", sha256, kinds="'search', 'case', 'on_demand'")
        ending = "" if signature.startswith("own:") else ending_of(signature)
        alike = [each for each in found if not ending or ending_of(each.signature) == ending]
        return next((each for each in found if each.scenario == scenario), next(iter(alike), None))

    def _flights(
        self, condition: str, *values: str | int | None, kinds: str = "'search'"
    ) -> list[LedgerFlight]:
        rows = self._database.execute(
            "SELECT search, map, generation, slot, system, scenario, result, sha256 FROM slot "
            f"JOIN search ON search.id = slot.search WHERE kind IN ({kinds}) AND state = 'flown' "
            f"AND {condition} ORDER BY kind DESC, system, map, generation, slot, search",
            values,
        )
        return [
            LedgerFlight(
                id=FlightId(search=search, map=map, slot=Slot(generation=generation, index=index)),
                system=system,
                scenario=scenario,
                result=parse_result(result),
                sha256=sha256 or "",
            )
            for search, map, generation, index, system, scenario, result, sha256 in rows
        ]

    def scenarios(self, generation: int, slot: int, map: str) -> dict[str, Scenario]:
        """Return the scenario of a slot in each search, repeatable if it was flown."""
        rows = self._database.execute(
            "SELECT search.id, scenario, result FROM slot JOIN search ON search.id = slot.search "
            "WHERE kind = 'search' AND map = ? AND generation = ? AND slot = ? ORDER BY search.id",
            (map, generation, slot),
        )
        return {
            search: repeatable(text, parse_result(result) if result else None)
            for search, text, result in rows.fetchall()
        }

    def nearest(self) -> dict[str, tuple[float, str]]:
        """Return each property's smallest decided margin so far, with its unit."""
        rows = self._database.execute(
            "SELECT json_extract(m.value, '$.property') AS name, "
            "min(json_extract(m.value, '$.value')), json_extract(m.value, '$.unit') "
            "FROM slot JOIN search ON search.id = slot.search, "
            "json_each(slot.result, '$.verdict.margins') AS m "
            "WHERE kind = 'search' AND state = 'flown' AND json_extract(m.value, '$.decided') "
            "GROUP BY name"
        )
        return {name: (value, unit) for name, value, unit in rows}

    def violation_counts(self) -> dict[str, int]:
        """Return the number of violations of each type."""
        rows = self._database.execute(
            "SELECT json_extract(result, '$.verdict.violation_type') AS type, count(*) FROM slot "
            "JOIN search ON search.id = slot.search WHERE kind = 'search' "
            "AND state = 'flown' AND type IS NOT NULL GROUP BY type ORDER BY type"
        )
        return dict(rows.fetchall())

    def seconds_by_signature(self) -> dict[tuple[str, str], float]:
        """Return the mean wall time of violations by search and how they ended."""
        rows = self._database.execute(
            "SELECT search.id, json_extract(result, '$.verdict.signature') AS signature, "
            "sum(coalesce(wall_s, 0)), count(*) FROM slot JOIN search ON search.id = slot.search "
            "WHERE kind = 'search' AND state = 'flown' "
            "AND json_extract(result, '$.verdict.primary') IS NOT NULL "
            "GROUP BY search.id, signature"
        )
        sums: dict[tuple[str, str], tuple[float, int]] = {}
        for search, signature, wall_s, count in rows:
            key = search, ending_of(signature)
            before_s, before = sums.get(key, (0.0, 0))
            sums[key] = before_s + wall_s, before + count
        return {key: wall_s / count for key, (wall_s, count) in sums.items()}

    def meters(self) -> dict[str, float]:
        """Return what the run has spent, by the name of the meter."""
        return dict(
            self._database.execute("SELECT name, value FROM meter ORDER BY name").fetchall()
        )

    def seconds_per_flight(self) -> float | None:
        """Return the mean wall time of a flight, or None without flights."""
        row = self._database.execute(
            "SELECT avg(wall_s) FROM slot WHERE state = 'flown'"
        ).fetchone()
        return None if row[0] is None else float(row[0])

    def flight_seconds(self) -> FlightSeconds:
        """Return the mean wall times of the flights so far."""
        row = self._database.execute(
            "SELECT avg(wall_s) FILTER (WHERE kind = 'search'), "
            "avg(wall_s) FILTER (WHERE kind = 'search' AND NOT fails), "
            "avg(wall_s) FILTER (WHERE kind = 'on_demand' OR kind = 'search' AND fails), "
            "count(*) FILTER (WHERE kind = 'on_demand' OR kind = 'search' AND fails) FROM ("
            "SELECT kind, wall_s, json_extract(result, '$.verdict.primary') IS NOT NULL AS fails "
            "FROM slot JOIN search ON search.id = slot.search WHERE state = 'flown')"
        ).fetchone()
        of_search, plain, failing = (float(mean or 0.0) for mean in row[:3])
        return FlightSeconds(
            of_search=of_search, plain=plain, failing=failing, failing_count=int(row[3])
        )

    def flying_s(self, search: str) -> float:
        """Return the sum of the wall times of a search's flights."""
        row = self._database.execute(
            "SELECT coalesce(sum(wall_s), 0) FROM slot WHERE search = ?", (search,)
        ).fetchone()
        return float(row[0])

    def result_hash(self, search: str = "") -> str:
        """Return a hash of all results, or of one search's; two equal runs have the same hash."""
        digest = hashlib.sha256()
        rows = self._database.execute(
            "SELECT system, map, generation, slot, scenario, result, objectives, sha256 FROM slot "
            "JOIN search ON search.id = slot.search WHERE kind = 'search' AND ? IN ('', search.id) "
            "ORDER BY system, map, generation, slot, search",
            (search,),
        )
        for row in rows:
            digest.update(_comparable(row).encode())
        return digest.hexdigest()


def _comparable(row: tuple[Any, ...]) -> str:
    """Return a slot as text, without details that differ between equal runs.

    These are addresses in memory, and the stacks of a process that was ended.
    """
    *before, result, objectives, sha256 = row
    if result is not None:
        values = json.loads(result)
        if values.get("crash"):
            values["crash"].pop("traceback", None)
        result = json.dumps(values, sort_keys=True)
    return _ADDRESS.sub("0x", json.dumps([*before, result, objectives, sha256]))


class FirstViolations:
    """Follows searches, generation by generation.

    The violations of the generation in which a signature occurs first are known as soon as this
    generation and all before it are flown.  They are the same for any number of workers and in a
    resumed run.
    """

    def __init__(self, queries: LedgerQueries) -> None:
        self._queries = queries
        self._latest: dict[str, int] = {}
        """The last generation of each search that was looked at."""
        self._seen: defaultdict[str, set[str]] = defaultdict(set)
        """The signatures of each search."""

    def advance(
        self, search: str, counts: Callable[[LedgerFlight], bool] = lambda flight: True
    ) -> dict[str, list[LedgerFlight]]:
        """Return, by signature, the first violations of those new since this was called last.

        The signatures are in the order in which they are found, their flights in that of the slots.
        Only flights that ``counts`` counts are looked at.
        """
        found: dict[str, list[LedgerFlight]] = {}
        for generation in self._queries.closed_generations(search, self._latest.get(search, -1)):
            self._latest[search] = generation
            seen = frozenset(self._seen[search])
            for flight in self._queries.violating(search, generation):
                if flight.signature not in seen and counts(flight):
                    found.setdefault(flight.signature, []).append(flight)
            self._seen[search].update(found)
        return found
