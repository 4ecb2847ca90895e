"""The archive: what searches know, in one file that is carried from night to night.

It has the flights of each search, each with its scenario and its result.  A later search of the
same landing system, map, limits, domain and code knows them: its children may have parents among
them, and its model is fitted to them too.  Of any other search only the scenarios are of use in
which something failed: a few of them are flown again, because the results do not hold there.
"""

from __future__ import annotations

import dataclasses
import gzip
import hashlib
import json
import zlib
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pytest_garl.errors import ArchiveError, ScenarioError
from pytest_garl.execution.job import parse_job
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.reference import simulator_sha256
from pytest_garl.execution.result import FlightResult
from pytest_garl.files.atomic import write_bytes_atomically
from pytest_garl.files.json_values import dataclass_from, parse_json
from pytest_garl.files.user_files import read_bytes
from pytest_garl.scenarios.chromosome import decode, encode
from pytest_garl.scenarios.files import parse_scenario
from pytest_garl.scenarios.genes import Genome
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import repair
from pytest_garl.search.method import FlownScenario
from pytest_garl.search.model import MOST_FLIGHTS

FORMAT, VERSION = "pytest-garl-archive", 1
LEAST_OF_A_KIND = 5
"""This many flights of each kind of violation are kept, however many came later."""
MOST_SUSPECTS = 20
"""A search flies again at most this many scenarios that failed elsewhere."""
SHOWN_DIGITS = 12
LARGEST_FILE, LARGEST_TEXT = 64_000_000, 512_000_000
"""Most bytes of the file, and of its text: a flight has some 3 kB of it."""
_GZIP = 31
"""Of ``zlib``: a stream with the header of gzip."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ArchivedFlight:
    """A scenario, as the text of its file, and the result of its flight."""

    scenario: str
    result: FlightResult


@dataclass(frozen=True, slots=True, kw_only=True)
class ArchivedSearch:
    """The flights that are kept of a search, the earliest first.

    ``search`` is its key in ledgers, of landing system, map, limits, task and domain.
    ``flown_by`` is the hash of all else on which its flights depend: the code of landing system and
    simulator, the map's file, the NPC policy.
    """

    search: str
    system: str
    map: str
    flown_by: str
    flights: tuple[ArchivedFlight, ...]

    def after(self, earlier: ArchivedSearch | None) -> ArchivedSearch:
        """Return the search with the flights of an earlier one, if its results hold here."""
        own = {each.scenario for each in self.flights}
        known = earlier.flights if earlier and earlier.flown_by == self.flown_by else ()
        flights = (*(each for each in known if each.scenario not in own), *self.flights)
        return dataclasses.replace(self, flights=tuple(_kept(flights)))


@dataclass(frozen=True, slots=True, kw_only=True)
class Knowledge:
    """What an archive says to one search: the arguments of ``SearchPlan`` of the same names."""

    known: tuple[FlownScenario, ...] = ()
    suspects: tuple[Scenario, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Archive:
    """The searches that are kept, by their order in the file."""

    searches: tuple[ArchivedSearch, ...] = ()

    @property
    def text(self) -> str:
        """The JSON text that the file holds, compressed: the same bytes for equal archives."""
        values = {"format": FORMAT, "version": VERSION, **dataclasses.asdict(self)}
        return json.dumps(values, sort_keys=True, allow_nan=False)

    @property
    def sha256(self) -> str:
        """The hash of the text, by which ledgers and summaries name an archive."""
        return hashlib.sha256(self.text.encode()).hexdigest()[:SHOWN_DIGITS]

    def save(self, path: Path) -> None:
        """Write the file; raise SavingError if that fails."""
        write_bytes_atomically(path, gzip.compress(self.text.encode(), mtime=0))

    def knowledge(self, search: str, flown_by: str, genome: Genome, map: Map) -> Knowledge:
        """Return what it says to a search with these genes on a map."""
        on_map = [each for each in self.searches if each.map == map.name]
        own = [each for each in on_map if each.search == search]
        for each in own:
            if each.flown_by == flown_by:
                known = [
                    FlownScenario(scenario=parse_scenario(flight.scenario), result=flight.result)
                    for flight in each.flights
                ]
                return Knowledge(known=tuple(e for e in known if _is_within(e.scenario, genome)))
        others = [*own, *(each for each in on_map if each.search != search)]
        return Knowledge(suspects=tuple(_suspects(others, genome, map))[:MOST_SUSPECTS])

    def with_ledger(self, ledger: Ledger) -> Archive:
        """Return the archive with the flights of a run's searches."""
        found = {each.search: each for each in self.searches}
        for search, text in ledger.searches():
            job = parse_job(text)
            flights = tuple(
                ArchivedFlight(scenario=each.scenario, result=each.result)
                for each in ledger.queries.flights(search)
                if not each.result.inconclusive
            )
            own = ArchivedSearch(
                search=search,
                system=job.system.name,
                map=job.map,
                flown_by=flown_by(text),
                flights=flights,
            )
            found[search] = own.after(found.get(search))
        return Archive(searches=tuple(found[search] for search in sorted(found)))


def flown_by(job: str) -> str:
    """Return the hash of all on which the flights of a job depend, given the job as JSON."""
    found = parse_job(job)
    # A build server may check a project out elsewhere.
    placeless = dataclasses.replace(
        found,
        system=dataclasses.replace(found.system, file=""),
        simulator=dataclasses.replace(found.simulator, file=""),
    )
    facts = f"{placeless.flown_facts()}{simulator_sha256(found.simulator)}"
    return hashlib.sha256(facts.encode()).hexdigest()


def read_archive(path: Path) -> Archive:
    """Read an archive; raise ArchiveError for a file that is damaged or of another version."""
    remedy = "Remove it: the next search writes a new one"
    packed = read_bytes(path, LARGEST_FILE, ArchiveError, f". {remedy}")
    unpacking = zlib.decompressobj(wbits=_GZIP)
    try:
        content = unpacking.decompress(packed, LARGEST_TEXT)
        if not unpacking.eof:
            raise ArchiveError(
                f"{path}: this archive ends too early, or holds more than {LARGEST_TEXT} bytes of "
                f"text. {remedy}"
            )
        values: Any = parse_json(content)
        if not isinstance(values, dict) or values.pop("format", None) != FORMAT:
            raise ArchiveError(f"{path}: this is no archive of pytest-garl. {remedy}")
        if (version := values.pop("version", None)) != VERSION:
            raise ArchiveError(
                f"{path}: found version {version} of the archive's format, this pytest-garl reads "
                f"version {VERSION}. {remedy}"
            )
        found = dataclass_from(Archive, values)
        for search in found.searches:
            for flight in search.flights:
                parse_scenario(flight.scenario)
    except (ValueError, zlib.error, ScenarioError) as error:
        raise ArchiveError(f"{path}: this archive is damaged: {error}. {remedy}") from error
    return found


def _kept(flights: Sequence[ArchivedFlight]) -> Iterator[ArchivedFlight]:
    """Yield as many flights as a model is fitted to: the latest, and some of each kind."""
    seen: Counter[str] = Counter()
    rare, rest = set[int](), list[int]()
    for place in reversed(range(len(flights))):
        signature = flights[place].result.signature
        seen[signature] += 1
        if signature and seen[signature] <= LEAST_OF_A_KIND:
            rare.add(place)
        else:
            rest.append(place)
    kept = rare.union(rest[: max(0, MOST_FLIGHTS - len(rare))])
    yield from (flights[place] for place in sorted(kept))


def _suspects(searches: Sequence[ArchivedSearch], genome: Genome, map: Map) -> Iterator[Scenario]:
    """Yield a scenario of each kind of violation that lies within the genome: the latest."""
    seen = set[str]()
    for search in searches:
        for flight in reversed(search.flights):
            kind = flight.result.signature
            if kind and kind not in seen:
                scenario = parse_scenario(flight.scenario)
                # Another domain may reach farther.
                if _is_within(scenario, genome):
                    seen.add(kind)
                    row = encode(scenario, genome)
                    yield repair(decode(row, genome, map=map.name, seed=scenario.seed), map)


def _is_within(scenario: Scenario, genome: Genome) -> bool:
    try:
        encode(scenario, genome)
    except ScenarioError:
        return False
    return True
