"""Facts of a run: what its processes, and those that report it later, tell each other.

A fact is a row of the ledger's table ``run``.  Each has a method here that notes it and one that
returns it, so that no other module knows its key.  The processes of xdist share the ledger: what
one claims first, the others see.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from pytest_garl.airframe import Camera
from pytest_garl.errors import LedgerError
from pytest_garl.execution.database import Database
from pytest_garl.files.json_values import parse_json

_SESSION = "session "
"""Begins the keys of facts that hold for one session of pytest; a resumed run forgets them."""
_TWIN = "twin "
_VERSION, _SOURCES = "version", "sources of pytest-garl"
_REPORTED = ("seed", "budget", "method", "population", "domain", "npcs", "python")


@dataclasses.dataclass(frozen=True, slots=True)
class Facts:
    """The facts in the database of a ledger, which lies at ``path``."""

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
        seed: int,
        budget: int | None,
        method: str | None,
        population: int | None,
        map: str,
        domain: str,
        npcs: str | None,
    ) -> dict[str, Any]:
        """Return what must be equal when a run is resumed."""
        named = {_VERSION: version, _SOURCES: package_sha256, "python": python, "seed": seed}
        wanted = {"budget": budget, "method": method, "population": population}
        return {**named, **wanted, "map": map, "domain": domain, "npcs": npcs}

    @property
    def reported(self) -> dict[str, Any]:
        """Seed, budget, method, population, domain, NPC policy and Python of the run."""
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

    def note_files(self, system: str, map: str, files: Iterable[str]) -> None:
        """Note which test files fly a system on a map."""
        self._set(f"files of {system} on {map}", " ".join(sorted(files)))

    def files(self, system: str, map: str) -> tuple[str, ...]:
        """Return the test files that fly a system on a map."""
        return tuple(str(self._get(f"files of {system} on {map}") or "").split())

    def note_domains(self, system: str, map: str, labels: Iterable[str]) -> None:
        """Note in which domains, too, a system is flown on a map."""
        self._set(_domains(system, map), sorted({*self.domains(system, map), *labels}))

    def domains(self, system: str, map: str) -> tuple[str, ...]:
        """Return the domains in which a system is flown on a map."""
        return tuple(self._get(_domains(system, map)) or ())

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

    def note_user_failures(self, failures: Sequence[Mapping[str, Any]]) -> None:
        """Note the failed assertions about users' own properties."""
        self._set("own failures", [dict(each) for each in failures])

    @property
    def user_failures(self) -> Sequence[Mapping[str, Any]]:
        """The failed assertions about users' own properties."""
        found: Sequence[Mapping[str, Any]] = self._get("own failures") or ()
        return found

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

    def _text(self, key: str) -> str | None:
        found = self._get(key)
        return None if found is None else str(found)

    def _get(self, key: str) -> Any:
        row = self.database.execute("SELECT value FROM run WHERE key = ?", (key,)).fetchone()
        try:
            return None if row is None else parse_json(row[0])
        except ValueError as error:
            raise LedgerError(f"{self.path}: the fact {key!r} is damaged: {error}") from error


def _domains(system: str, map: str) -> str:
    return f"domains of {system} on {map}"


def _failure(key: str) -> str:
    return f"{_SESSION}failure {key}"


def _in_utc(at: datetime | None) -> str:
    return (at or datetime.now(UTC)).isoformat(timespec="seconds")
