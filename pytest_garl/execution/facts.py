"""Facts of a run: what its processes, and those that report it later, tell each other.

A fact is a row of the ledger's table ``run``.  Each has a method here that notes it and one that
returns it, so that no other module knows its key.  The processes of xdist share the ledger: what
one claims first, the others see.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TypeVar

from pytest_garl.airframe import Camera
from pytest_garl.errors import LedgerError
from pytest_garl.execution.database import Database
from pytest_garl.execution.result import Origin
from pytest_garl.files.json_values import dataclass_from, parse_json
from pytest_garl.npcs.director_progress import Progress

T = TypeVar("T")
_SESSION = "session "
"""Begins the keys of facts that hold for one session of pytest; a resumed run forgets them."""
_TWIN = "twin "
_SEARCH = "search "
_KNOWLEDGE = "knowledge of "
_USER_FAILURES = "own failures"
_VERSION, _SOURCES, _ARCHIVE = "version", "sources of pytest-garl", "archive"
_REPORTED = (
    "seed",
    "budget",
    "method",
    "population",
    "domain",
    "npcs",
    "engine",
    "python",
    "archive",
)


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True, order=True)
class SearchKey:
    """A landing system on a map, the domain of its scenarios, and the tests that judge its flights.

    ``tests`` are node ids with their parameters but the slot.  A repeated scenario has no domain,
    and a search that no test asked for has neither.
    """

    system: str
    map: str
    domain: str = ""
    tests: tuple[str, ...] = ()

    @property
    def class_name(self) -> str:
        """The name of the landing system's class."""
        return self.system.split(":")[-1]

    @property
    def place(self) -> str:
        """The name of a search that is the only one of its landing system on its map."""
        return f"{self.class_name} on {self.map}"

    @property
    def files(self) -> tuple[str, ...]:
        """The files of the tests."""
        return tuple(sorted({test.partition("::")[0] for test in self.tests}))


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class FailedFlightAssertion:
    """A failed assertion about a user's own property, in the flight of a slot.

    ``search`` is the key of its search in the ledger.
    """

    search: str
    slot: str
    signature: str
    message: str


@dataclasses.dataclass(frozen=True, slots=True)
class Facts:
    """The facts in the database of a ledger at ``path``; a damaged one is a LedgerError."""

    database: Database
    path: Path

    # Of the run: what must be equal when it is resumed, and when it was flown.

    def note_run(self, facts: Mapping[str, Any]) -> None:
        """Note the facts with which a run begins, by their names in messages."""
        rows = [(key, json.dumps(value)) for key, value in sorted(facts.items())]
        self.database.executemany("INSERT INTO run VALUES (?, ?)", rows)

    def of_run(self, names: Iterable[str]) -> dict[str, Any]:
        """Return the facts with which the run began that have these names, None if it has none."""
        return {name: self._get(name) for name in names}

    @staticmethod
    def that_identify(
        *,
        version: str,
        package_sha256: str,
        python: str,
        engine: str,
        seed: int,
        budget: int | None,
        method: str | None,
        population: int | None,
        map: str,
        domain: str,
        npcs: str | None,
        archive: str | None,
        use: str | None,
    ) -> dict[str, Any]:
        """Return what must be equal when a run is resumed."""
        named = {_VERSION: version, _SOURCES: package_sha256, "python": python, "engine": engine}
        wanted = {"seed": seed, "budget": budget, "method": method, "population": population}
        places = {"map": map, "domain": domain, "npcs": npcs}
        return {**named, **wanted, **places, _ARCHIVE: archive, "model of use": use}

    @property
    def reported(self) -> dict[str, Any]:
        """Seed, budget, method, population, domain, NPC policy, Python and archive of the run."""
        return self.of_run(_REPORTED)

    @property
    def ledger_version(self) -> Any:
        """The version of the ledger's format."""
        return self._get("ledger")

    @property
    def version(self) -> str | None:
        """The version of this package that flew the run."""
        return self._text(_VERSION)

    @property
    def package_sha256(self) -> str | None:
        """The first digits of the hash of the sources that flew the run."""
        return self._text(_SOURCES)

    @property
    def method(self) -> str | None:
        """The search method; None in a run that repeats a scenario."""
        return self._text("method")

    @property
    def domain(self) -> str | None:
        """The session's domain."""
        return self._text("domain")

    @property
    def archive(self) -> str | None:
        """The hash of the archive that the run began with, None without one."""
        return self._text(_ARCHIVE)

    def note_knowledge(self, search: str, known: int, suspects: int) -> None:
        """Note how many flights of the archive a search knows, and how many it flies again."""
        self._set(f"{_KNOWLEDGE}{search}", [known, suspects])

    @property
    def knowledge(self) -> tuple[int, int]:
        """How many flights of the archive all searches know, and how many they fly again."""
        found = [
            self._get(key)
            for (key,) in self.database.execute(
                "SELECT key FROM run WHERE substr(key, 1, ?) = ?", (len(_KNOWLEDGE), _KNOWLEDGE)
            )
        ]
        return sum(int(known) for known, _ in found), sum(int(again) for _, again in found)

    def note_began(self, at: datetime | None = None) -> None:
        """Note when the run begins: at a time in UTC, or now."""
        self._set("began", _in_utc(at))

    def note_ended(self, at: datetime | None = None) -> None:
        """Note when the run has ended."""
        self._set("ended", _in_utc(at))

    @property
    def began(self) -> str | None:
        """When the run began, in UTC."""
        return self._text("began")

    @property
    def ended(self) -> str | None:
        """When the run ended, in UTC; None while it goes on, and if it was killed."""
        return self._text("ended")

    def note_earlier_flight_s(self, seconds: float) -> None:
        """Note the wall time of a flight in the run before in this folder."""
        self._set("seconds_per_flight", seconds)

    @property
    def earlier_flight_s(self) -> float | None:
        """The wall time of a flight in the run before in this folder."""
        known = self._get("seconds_per_flight")
        return float(known) if isinstance(known, int | float) else None

    # Of a search: a system on a map.

    def note_selected(self, flights: int) -> None:
        """Note how many flights of searches the selected tests want."""
        self._set("selected flights", flights)

    @property
    def selected(self) -> int:
        """How many flights of searches the selected tests want."""
        return int(self._get("selected flights") or 0)

    def note_search(self, search: str, key: SearchKey) -> None:
        """Note what identifies a search to people: by its key in the ledger nobody knows it."""
        self._set(f"{_SEARCH}{search}", dataclasses.asdict(key))

    @property
    def searches(self) -> dict[str, SearchKey]:
        """What identifies each search that tests asked for, by its key in the ledger."""
        rows = self.database.execute(
            "SELECT key FROM run WHERE substr(key, 1, ?) = ? ORDER BY key",
            (len(_SEARCH), _SEARCH),
        )
        return {
            key.removeprefix(_SEARCH): self._typed(SearchKey, key, self._get(key))
            for (key,) in rows
        }

    @property
    def search_names(self) -> dict[str, str]:
        """What texts call each of these searches."""
        searches = self.searches
        names = search_names(searches.values())
        return {search: names[key] for search, key in searches.items()}

    def note_camera(self, system: str, camera: Camera) -> None:
        """Note the camera of a landing system, so that a report can draw its frames again."""
        self._set(f"camera of {system}", dataclasses.asdict(camera))

    def camera(self, system: str) -> Mapping[str, Any] | None:
        """Return what is noted of a system's camera, None of a simulator of a user's own."""
        found: Mapping[str, Any] | None = self._get(f"camera of {system}")
        return found

    def first_known_cases(self, search: str, names: Sequence[str]) -> Sequence[str]:
        """Note which cases are known when a search begins; return those that were noted first."""
        found: Sequence[str] = self._first(f"cases known before the search {search}", [*names])
        return found

    def note_twin(self, twin: str, search: str) -> None:
        """Note that a flight is the twin of one of a search."""
        self._first(f"{_TWIN}{twin}", search)

    @property
    def twins(self) -> int:
        """How many twins were flown."""
        row = self.database.execute(
            "SELECT count(*) FROM run WHERE substr(key, 1, ?) = ?", (len(_TWIN), _TWIN)
        ).fetchone()
        return int(row[0])

    def note_violated_probes(self, search: str, probes: Sequence[tuple[str, str]]) -> None:
        """Note the signature and the trajectory's hash of each probe that a system violates."""
        self._set(f"violated probes of {search}", [[*each] for each in probes])

    def violated_probes(self, search: str) -> Sequence[tuple[str, str]]:
        """Return (signature, trajectory's hash) of each probe that a system violates."""
        return [(str(a), str(b)) for a, b in self._get(f"violated probes of {search}") or ()]

    def note_origins(self, search: str, generation: int, origins: Sequence[Origin]) -> None:
        """Note how the scenarios of a generation were made, by their slots."""
        self._first(_origins(search, generation), [dataclasses.asdict(each) for each in origins])

    def origins(self, search: str, generation: int) -> list[Origin]:
        """Return how the scenarios of a generation were made; none if its method does not say."""
        key = _origins(search, generation)
        return [self._typed(Origin, key, each) for each in self._get(key) or ()]

    def note_director(self, search: str, generation: int, director: str) -> None:
        """Note the weights that decide in a generation when NPCs begin and events strike."""
        self._first(_director(search, generation), director)

    def director(self, search: str, generation: int) -> str:
        """Return what decides in the flights of a generation; empty for the weights that ship."""
        return self._text(_director(search, generation)) or ""

    def note_progress(self, search: str, generation: int, progress: Progress) -> None:
        """Note what a generation says of the directors with which it was flown."""
        self._first(_progress(search, generation), dataclasses.asdict(progress))

    def progress(self, search: str, generation: int) -> Progress | None:
        """Return what a generation says of its directors; None if nothing learned from it."""
        key = _progress(search, generation)
        found = self._get(key)
        return None if found is None else self._typed(Progress, key, found)

    def note_user_failures(self, failures: Iterable[FailedFlightAssertion]) -> None:
        """Note the failed assertions about users' own properties."""
        self._set(_USER_FAILURES, [dataclasses.asdict(each) for each in failures])

    @property
    def user_failures(self) -> list[FailedFlightAssertion]:
        """The failed assertions about users' own properties."""
        return [
            self._typed(FailedFlightAssertion, _USER_FAILURES, e)
            for e in self._get(_USER_FAILURES) or ()
        ]

    # Of a session: a resumed run forgets them, because its tests run again.

    def forget_session(self) -> None:
        """Forget what holds for one session only."""
        self.database.execute("DELETE FROM run WHERE key LIKE ?", (f"{_SESSION}%",))

    def claim_slot(self, search: str, slot: str, nodeid: str) -> bool:
        """Claim a slot for an item; return whether no other item claimed it earlier."""
        return bool(self._first(f"{_SESSION}slot {search} {slot}", nodeid) == nodeid)

    def claim_failure(self, key: str, slot: str, nodeid: str) -> tuple[str, str]:
        """Claim a failure for an item and its slot; return (slot, item) that claimed it first."""
        first_slot, first_nodeid = self._first(_failure(key), [slot, nodeid])
        return str(first_slot), str(first_nodeid)

    def claimed_failure(self, key: str) -> tuple[str, str] | None:
        """Return (slot, item) that claimed a failure, None if nobody has."""
        found = self._get(_failure(key))
        return None if found is None else (str(found[0]), str(found[1]))

    def note_ran(self, nodeid: str) -> None:
        """Note that a test has run; its claims are noted by then."""
        self._set(f"{_SESSION}ran {nodeid}", True)

    def has_run(self, nodeid: str) -> bool:
        """Return whether a test has run in any process."""
        return bool(self._get(f"{_SESSION}ran {nodeid}"))

    def first_passed_probes(self, keys: Sequence[str]) -> Sequence[str]:
        """Note which probes had passed when the session began; return what was noted first."""
        found: Sequence[str] = self._first(f"{_SESSION}passed probes", [*keys])
        return found

    def note_interrupted(self) -> None:
        """Note that the session's main process was interrupted."""
        self._set(f"{_SESSION}interrupted", True)

    @property
    def interrupted(self) -> bool:
        """Whether the session's main process was interrupted."""
        return bool(self._get(f"{_SESSION}interrupted"))

    def _set(self, key: str, value: Any) -> None:
        self.database.execute("INSERT OR REPLACE INTO run VALUES (?, ?)", (key, json.dumps(value)))

    def _first(self, key: str, value: Any) -> Any:
        """Set a fact unless it is set already; return its value."""
        self.database.execute("INSERT OR IGNORE INTO run VALUES (?, ?)", (key, json.dumps(value)))
        return self._get(key)

    def _typed(self, kind: type[T], key: str, value: Any) -> T:
        try:
            return dataclass_from(kind, value)
        except ValueError as error:
            raise self._damaged(key, error) from error

    def _text(self, key: str) -> str | None:
        found = self._get(key)
        return None if found is None else str(found)

    def _get(self, key: str) -> Any:
        row = self.database.execute("SELECT value FROM run WHERE key = ?", (key,)).fetchone()
        try:
            return None if row is None else parse_json(row[0])
        except ValueError as error:
            raise self._damaged(key, error) from error

    def _damaged(self, key: str, error: ValueError) -> LedgerError:
        return LedgerError(f"{self.path}: the fact {key!r} is damaged: {error}")


def _origins(search: str, generation: int) -> str:
    return f"origins of {search} {generation}"


def _director(search: str, generation: int) -> str:
    return f"director of {search} {generation}"


def _progress(search: str, generation: int) -> str:
    return f"progress of the director of {search} {generation}"


def _failure(key: str) -> str:
    return f"{_SESSION}failure {key}"


def _in_utc(at: datetime | None) -> str:
    return (at or datetime.now(UTC)).isoformat(timespec="seconds")


_PARTS: tuple[Callable[[SearchKey], str], ...] = (
    lambda key: key.system.partition(":")[0],
    lambda key: f"domain {key.domain}" if key.domain else "no domain",
    lambda key: ", ".join(key.files),
    lambda key: ", ".join(key.tests),
)
"""What tells searches apart, the shortest text first."""


def search_names(keys: Iterable[SearchKey]) -> dict[SearchKey, str]:
    """Return what texts call each of the searches of a run.

    That is ``System on map``, and for searches that share it what tells them apart:
    ``System on map (domain calm)``.
    """
    names = {key: key.place for key in keys}
    for part in _PARTS:
        told: dict[str, set[str]] = {}
        for key, name in names.items():
            told.setdefault(name, set()).add(part(key))
        names = {
            key: f"{name} ({part(key)})" if len(told[name]) > 1 else name
            for key, name in names.items()
        }
    return names
