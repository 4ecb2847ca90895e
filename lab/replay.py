"""Count in the ledger of a run what evolved and what learned, and breed its searches once more.

    python -m lab.replay .garl/ledger.sqlite

prints for each search how many of its flights are children, whether the flights that they name as
parents were flown before and have their conditions and NPCs, and in how many of the flights with an
NPC that knows of the UAV the learned director decides, and with which weights.  Then the package's
own breeder breeds the search again, on a copy of the ledger, from the results that it holds: all
scenarios must come out as they were flown, with pymoo.  The exit status is 1 if something of that
does not hold, or if less than half of the flights after the control are children, or if the
director decides in less than half of the flights with an NPC that knows of the UAV.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pytest_garl.errors import LedgerError
from pytest_garl.execution.job import parse_job
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queries import LedgerFlight
from pytest_garl.execution.result import Origin
from pytest_garl.files.run_files import ARCHIVE
from pytest_garl.npcs.domain_policy import domain_with_policy
from pytest_garl.reports.search_origins import MoverRecord, mover_record
from pytest_garl.scenarios.chromosome import encode
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.files import dump_scenario, parse_scenario
from pytest_garl.scenarios.genes import ON_ABOVE, Genome
from pytest_garl.search.archive import Knowledge, flown_by, read_archive
from pytest_garl.search.breeder import Breeder
from pytest_garl.search.columns import Columns
from pytest_garl.search.method import SearchPlan, archived_name
from pytest_garl.search.method_catalogue import make_method

LEAST_SHARE = 0.5
NO_NPCS = MoverRecord(director=0, rule=0, gene=0, policy=0, interfering=0, directed=0)


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchCount:
    """What one search bred: numbers of flights.

    ``true_children`` name at least two parents, all of them flown in earlier generations or in the
    archive with which the search began, and have of each a condition or an NPC with all of its
    values.  In ``by_own`` of the flights in which the director decides it has weights that it
    learned in this search.  ``bred_again`` says whether the same scenarios were bred from the
    results, or else what came out.
    """

    name: str
    control: int
    stratified: int
    children: int
    true_children: int
    movers: MoverRecord
    by_own: int
    bred_again: str

    @property
    def after_control(self) -> int:
        """The flights after the control."""
        return self.stratified + self.children


def count(path: Path) -> list[SearchCount]:
    """Count the searches of a ledger, and breed each again on a copy of it."""
    if not path.is_file():
        raise LedgerError(f"there is no ledger at {path}; run a search first")
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / path.name
        for suffix in ("", "-wal"):
            if path.with_name(path.name + suffix).is_file():
                shutil.copy(path.with_name(path.name + suffix), folder)
        ledger = Ledger(copy)
        try:
            return [_count(ledger, search, path.parent) for search, _ in ledger.searches()]
        finally:
            ledger.close()


def _count(ledger: Ledger, search: str, folder: Path) -> SearchCount:
    """Count a search; the archive with which it began lies in a folder."""
    job = parse_job(ledger.job(search) or "")
    key, facts = ledger.facts.searches[search], ledger.facts.reported
    map = job.load_map()
    genome = genome_of(domain_with_policy(key.domain or facts["domain"]), map)
    flights = ledger.queries.flights(search)
    made = _origins(ledger, search, flights)
    own = Knowledge()
    if name := ledger.facts.archive:
        archive = read_archive(folder / ARCHIVE.format(name))
        own = archive.knowledge(search, flown_by(job.dumps()), genome, map)
    known = {each.id.slot_id: (each.id.slot.generation, each.scenario) for each in flights}
    for number, each in enumerate(own.known):
        known[archived_name(number)] = -1, dump_scenario(each.scenario)
    bred = [(flight, origin) for flight, origin in made if origin.how == "bred"]
    taught = [e for e in flights if ledger.facts.director(search, e.id.slot.generation)]
    plan = SearchPlan(
        map=map,
        genome=genome,
        seed=int(facts["seed"]),
        flights=int(facts["budget"]),
        population=int(facts["population"]),
        known=own.known,
        suspects=own.suspects,
    )
    return SearchCount(
        name=key.place,
        control=sum(origin.how == "control" for _, origin in made),
        stratified=sum(origin.how in ("stratified", "replayed") for _, origin in made),
        children=len(bred),
        true_children=sum(_is_child(*each, known, genome) for each in bred),
        movers=mover_record((flight, job.npcs) for flight in flights) or NO_NPCS,
        by_own=(mover_record((flight, job.npcs) for flight in taught) or NO_NPCS).directed,
        bred_again=_bred_again(ledger, search, str(facts["method"]), plan),
    )


def _origins(
    ledger: Ledger, search: str, flights: Sequence[LedgerFlight]
) -> list[tuple[LedgerFlight, Origin]]:
    origins: dict[int, list[Origin]] = {}
    for flight in flights:
        number = flight.id.slot.generation
        origins.setdefault(number, ledger.facts.origins(search, number))
    return [
        (flight, origins[flight.id.slot.generation][flight.id.slot.index])
        for flight in flights
        if flight.id.slot.index < len(origins[flight.id.slot.generation])
    ]


def _is_child(
    flight: LedgerFlight, origin: Origin, known: dict[str, tuple[int, str]], genome: Genome
) -> bool:
    """Whether a flight has of each of two or more earlier flights a condition or an NPC.

    ``known`` are generation and scenario of all flights, by the names that origins have for them.
    """
    parents = [known.get(name) for name in origin.parents]
    generation, columns = flight.id.slot.generation, Columns(genome)
    row = encode(parse_scenario(flight.scenario), genome)
    # A gene that is always there is a condition too.
    acting = [
        each
        for each in columns.slices
        if each.start not in columns.bits or row[each.start] > ON_ABOVE
    ]
    for parent in parents:
        if parent is None or parent[0] >= generation:
            return False
        other = encode(parse_scenario(parent[1]), genome)
        if not any(np.array_equal(row[each], other[each]) for each in acting):
            return False
    return len(parents) >= 2


class _Noted:
    """A method, with the scenarios that it returned."""

    def __init__(self, method: Any) -> None:
        self._method = method
        self.asked: list[Sequence[Any]] = []

    def __getattr__(self, name: str) -> Any:
        return getattr(self._method, name)

    def ask(self) -> Sequence[Any]:
        """Return the next generation, and note it."""
        self.asked.append(self._method.ask())
        return self.asked[-1]


def _bred_again(ledger: Ledger, search: str, name: str, plan: SearchPlan) -> str:
    """Breed a search from its results; return what differs, empty if nothing does."""
    slots: defaultdict[int, list[int]] = defaultdict(list)
    for flight in ledger.queries.flights(search):
        slots[flight.id.slot.generation].append(flight.id.slot.index)
    method = _Noted(make_method(name, plan))
    try:
        Breeder(ledger, search, method, slots).advance()
    except LedgerError as error:
        return str(error)
    left = len(slots) - len(method.asked)
    return f"{left} generations wait for results" if left else ""


def report(counts: Sequence[SearchCount], has_pymoo: bool) -> tuple[str, bool]:
    """Return the counts in words, and whether all holds."""
    lines, problems = [], []
    for each in counts:
        movers = each.movers
        lines += [
            f"{each.name}: {each.control} flights of the control, {each.stratified} stratified, "
            f"{each.children} children ({_share(each.children, each.after_control)} after the "
            f"control)",
            f"  children with conditions or NPCs of two or more flights, all flown in earlier "
            f"generations: {each.true_children} of {each.children}",
            f"  the director decides in {movers.directed} of {movers.interfering} flights with an "
            f"NPC that knows of the UAV, with weights learned in this search in {each.by_own}, "
            f"with those that ship in {movers.directed - each.by_own}; NPCs begin by it "
            f"{movers.director}, by the rule {movers.rule}, by genes {movers.gene}",
            f"  bred again from the results: {each.bred_again or 'the same scenarios'}",
        ]
        if each.bred_again:
            problems.append(f"{each.name} is not bred again")
        if each.true_children < each.children:
            problems.append(f"{each.name} has children that are none")
    children, after = (sum(getattr(e, n) for e in counts) for n in ("children", "after_control"))
    directed, knowing = (
        sum(getattr(each.movers, name) for each in counts) for name in ("directed", "interfering")
    )
    if children < LEAST_SHARE * after or not children:
        problems.append("less than half of the flights after the control are children")
    if directed < LEAST_SHARE * knowing:
        problems.append("the director decides in less than half of the flights with such an NPC")
    if not has_pymoo:
        problems.append("pymoo was not imported")
    lines += [
        "",
        f"all searches: {children} of {after} flights after the control are children "
        f"({_share(children, after)}); the director decides in {directed} of {knowing} flights "
        f"with an NPC that knows of the UAV ({_share(directed, knowing)}); pymoo "
        f"{'bred' if has_pymoo else 'was not imported'}",
        "all holds" if not problems else f"does not hold: {'; '.join(problems)}",
    ]
    return "\n".join(lines), not problems


def _share(part: int, whole: int) -> str:
    return f"{100 * part / whole:.0f} %" if whole else "none"


def main() -> int:
    """Print the counts; return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("ledger", type=Path, nargs="?", default=Path(".garl/ledger.sqlite"))
    try:
        counts = count(parser.parse_args().ledger)
    except LedgerError as error:
        parser.error(str(error))
    text, holds = report(counts, "pymoo" in sys.modules)
    print(text)
    return 0 if holds else 1


if __name__ == "__main__":
    sys.exit(main())
