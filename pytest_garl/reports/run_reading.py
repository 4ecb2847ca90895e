"""Read a run: once from its ledger, with the saved cases of its landing systems."""

from __future__ import annotations

import contextlib
import functools
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
from importlib.metadata import version
from pathlib import Path
from types import MappingProxyType

from pytest_garl.cases.case import Case
from pytest_garl.cases.corpus import Corpus
from pytest_garl.errors import LedgerError
from pytest_garl.execution.facts import Facts, SearchKey, search_names
from pytest_garl.execution.job import FlightJob, parse_job
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queries import LedgerFlight
from pytest_garl.execution.result import Origin
from pytest_garl.execution.severity import Severity
from pytest_garl.execution.stored_ledger import checked_ledger
from pytest_garl.files.run_files import RUN_FOLDER
from pytest_garl.messages import command
from pytest_garl.npcs.director_progress import total, total_of_events
from pytest_garl.npcs.event_lessons import learned_kinds
from pytest_garl.reports.control_arm import control_arm, is_control
from pytest_garl.reports.run_record import (
    KindRecord,
    RunCosts,
    RunOptions,
    RunRecord,
    SavedCase,
    SearchRecord,
    place_of,
)
from pytest_garl.reports.search_origins import (
    Made,
    model_record,
    mover_record,
    origin_records,
    strike_record,
)
from pytest_garl.scenarios.files import dump_scenario

_NONE: Mapping[str, tuple[Severity, str]] = MappingProxyType({})


def read_run(path: Path, corpus: Corpus, *, checked: bool = False) -> RunRecord:
    """Return the run in the ledger at ``path``, finished or not.

    ``checked`` has all of it checked before, which takes as long as reading it.  Raises LedgerError
    if there is none, or if it is damaged.
    """
    if not path.is_file():
        raise LedgerError(f"there is no ledger at {path}; run a search first")
    with checked_ledger(path) if checked else contextlib.closing(Ledger(path)) as ledger:
        return run_record_of(ledger, corpus)


def run_record_of(
    ledger: Ledger, corpus: Corpus, *, investigated: Sequence[Case] = (), confirming: int = 0
) -> RunRecord:
    """Return the run in an open ledger, with the causes that the saved cases tell.

    A session that has just flown it knows more: the cases that it investigated, saved or not, and
    how many flights confirmed and shrank them.
    """
    facts, queries = ledger.facts, ledger.queries
    progress, meters = queries.progress(), queries.meters()
    jobs: dict[str, FlightJob] = {}
    searches = _searches(ledger, jobs)
    systems = {search.key.system for search in searches}
    endings = {(s.key.system, s.key.map, kind.signature) for s in searches for kind in s.kinds}
    cases = tuple(_saved_cases(ledger, corpus, systems, endings, jobs))
    return RunRecord(
        ledger=ledger.path,
        version=facts.version or version("pytest-garl"),
        options=RunOptions(**facts.reported),
        began=facts.began,
        ended=facts.ended,
        results_sha256=queries.result_hash(),
        wanted=sum(each.total for each in progress),
        flown=sum(each.flown for each in progress),
        costs=RunCosts(
            flown_again=int(meters.get("retried", 0)),
            beside=int(meters.get("on_demand", 0)),
            twins=facts.twins,
            confirming=confirming,
            flights=int(meters.get("flights", 0)),
            flying_s=meters.get("flying_s", 0.0),
            idle_s=meters.get("idle_s", 0.0),
        ),
        searches=tuple(each.with_cases(cases, investigated) for each in searches),
        names=facts.search_names,
        cases=cases,
        jobs=jobs,
    )


def _searches(ledger: Ledger, jobs: dict[str, FlightJob]) -> list[SearchRecord]:
    """Return the searches that have flights, and add their jobs to ``jobs``."""
    noted = ledger.facts.searches
    flown: dict[SearchKey, list[LedgerFlight]] = {}
    for flight in ledger.queries.flights():
        key = noted.get(flight.id.search, SearchKey(system=flight.system, map=flight.id.map))
        flown.setdefault(key, []).append(flight)
    names = search_names([*noted.values(), *flown])
    wanted: Counter[SearchKey] = Counter()
    for each in ledger.queries.progress():
        wanted[noted.get(each.search, SearchKey(system=each.system, map=each.map))] += each.total
    found = []
    for key, flights in sorted(flown.items()):
        ids = dict.fromkeys(each.id.search for each in flights)
        own = {search: parse_job(ledger.job(search) or "") for search in ids}
        jobs |= own
        repeat = functools.partial(_repeat_command, ledger.path.parent.name, key.files)
        found.append(_search(ledger.facts, key, names[key], wanted[key], flights, own, repeat))
    return found


def _search(
    facts: Facts,
    key: SearchKey,
    name: str,
    wanted: int,
    flights: Sequence[LedgerFlight],
    jobs: Mapping[str, FlightJob],
    repeat: Callable[[str], str],
) -> SearchRecord:
    """Return a search with these flights, and the jobs of them by their key in the ledger.

    ``repeat`` makes the command that repeats a slot.
    """
    # (slot, story) of all violations, by signature.
    violations: dict[str, list[tuple[str, str]]] = {}
    findings: dict[str, list[tuple[str, str]]] = {}
    for flight in flights:
        verdict, slot = flight.result.verdict, flight.id.slot_id
        if verdict.violation:
            violations.setdefault(verdict.ending, []).append((slot, verdict.story))
        for finding in verdict.findings:
            findings.setdefault(finding.signature, []).append((slot, finding.story))
    for each in sorted(facts.user_failures, key=lambda each: each.slot):
        if each.search in jobs:
            violations.setdefault(each.signature, []).append((each.slot, each.message))
    method = facts.method
    control = control_arm(method, flights)
    random = {f.id.slot_id for f in flights if is_control(method, f.id.slot.generation)}
    made = with_origins(facts, flights)
    compares = control is not None and control.later.flights > 0
    generations = sorted({(each.id.search, each.id.slot.generation) for each in flights})
    progress = [found for each in generations if (found := facts.progress(*each))]
    learned = {each: learned_kinds(facts.director(*each)) for each in generations}
    return SearchRecord(
        key=key,
        name=name,
        flights=tuple(flights),
        kinds=kinds_of(
            violations, _lowest_severities(flights), random if compares else None, repeat
        ),
        violating=len({slot for items in violations.values() for slot, _ in items}),
        wanted=wanted,
        findings=kinds_of(findings, repeat=repeat),
        limits=tuple(dict.fromkeys(each.limits for each in jobs.values())),
        npcs=tuple(dict.fromkeys(each.npcs.name for each in jobs.values())),
        control=control,
        origins=origin_records(made),
        model=model_record(made),
        movers=mover_record((flight, jobs[flight.id.search].npcs) for flight in flights),
        director=total(each.npcs for each in progress),
        strikes=strike_record(
            (flight, learned[flight.id.search, flight.id.slot.generation]) for flight in flights
        ),
        event_director=total_of_events(each.events for each in progress),
        camera=facts.camera(key.system),
    )


def _repeat_command(folder: str, files: Sequence[str], slot: str) -> str:
    """Return the command that repeats a slot, called beside the folder of the ledger."""
    words = ["pytest", *files, f"--garl-repeat={slot}"]
    return command(*words, *(() if folder == RUN_FOLDER else ("-o", f"garl_dir={folder}")))


def with_origins(facts: Facts, flights: Sequence[LedgerFlight]) -> Made:
    """Return the flights of which the method tells how their scenarios were made."""
    origins: dict[tuple[str, int], list[Origin]] = {}
    made = []
    for flight in flights:
        search, slot = flight.id.search, flight.id.slot
        key = search, slot.generation
        if key not in origins:
            origins[key] = facts.origins(*key)
        if slot.index < len(origins[key]):
            made.append((flight, origins[key][slot.index]))
    return made


def _saved_cases(
    ledger: Ledger,
    corpus: Corpus,
    systems: Iterable[str],
    endings: Set[tuple[str, str, str]],
    jobs: dict[str, FlightJob],
) -> Iterator[SavedCase]:
    """Yield the saved cases of systems, and add the jobs of their flights to ``jobs``."""
    entries = [entry for system in systems for entry in corpus.entries(system)]
    for entry in sorted(entries, key=lambda entry: entry.path):
        case = entry.case
        if case is None:
            continue
        flight = None
        if place_of(case) in endings:
            flight = ledger.queries.flight_with_hash(
                case.evidence.trajectory_sha256,
                scenario=dump_scenario(case.scenario),
                signature=case.violation.signature,
            )
        if flight is not None:
            jobs[flight.id.search] = parse_job(ledger.job(flight.id.search) or "")
        known = corpus.is_accepted(entry)
        yield SavedCase(path=entry.path, case=case, known=known, flight=flight)


def _lowest_severities(flights: Sequence[LedgerFlight]) -> dict[str, tuple[Severity, str]]:
    """Return the lowest severity of the violations and its first slot, by signature."""
    lowest: dict[str, tuple[Severity, str]] = {}
    for flight in flights:
        result = flight.result
        if result.verdict.violation and result.severity is not None:
            known = lowest.get(result.signature)
            if known is None or result.severity < known[0]:
                lowest[result.signature] = (result.severity, flight.id.slot_id)
    return lowest


def kinds_of(
    stories: Mapping[str, Sequence[tuple[str, str]]],
    severities: Mapping[str, tuple[Severity, str]] = _NONE,
    random_slots: Set[str] | None = None,
    repeat: Callable[[str], str] = lambda slot: "",
) -> tuple[KindRecord, ...]:
    """Return the kinds in (slot, story) by signature, the most frequent first."""
    kinds = []
    for signature, items in stories.items():
        slots = tuple(dict.fromkeys(slot for slot, _ in items))
        severity, severest = severities.get(signature, (None, ""))
        in_control = None if random_slots is None else len(random_slots & {*slots})
        kinds.append(
            KindRecord(
                signature=signature,
                slots=slots,
                story=items[0][1],
                severity=severity,
                severest=severest,
                in_control=in_control,
                random_flights=len(random_slots or ()),
                repeat=repeat(slots[0]),
            )
        )
    return tuple(sorted(kinds, key=lambda each: (-each.count, each.signature)))
