"""A flight that a command names: a slot of a run, a saved case, or the file of a record."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pytest_garl.errors import CorpusError, GarlError, LedgerError
from pytest_garl.execution.flight_id import Slot
from pytest_garl.execution.job import FlightJob, parse_job
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queries import LedgerFlight
from pytest_garl.execution.reference import BUILT_IN
from pytest_garl.execution.stored_ledger import checked_ledger, read_slot
from pytest_garl.files.json_values import dataclass_from
from pytest_garl.landing_system import Camera, airframe_of
from pytest_garl.messages import listed, shortened, shown
from pytest_garl.regressions.case import Case
from pytest_garl.regressions.case_file import load_case
from pytest_garl.regressions.corpus import Corpus
from pytest_garl.regressions.replay import replay, system_of
from pytest_garl.reports.search_summary import CAMERA
from pytest_garl.scenarios.files import parse_scenario
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.flight import Flight
from pytest_garl.simulation.flight_file import load
from pytest_garl.verdicts.judge import judge
from pytest_garl.verdicts.verdict import DEFAULT_LIMITS, Limits

LEDGER = Path(".garl/ledger.sqlite")
RECORD, CASE = ".npz", ".toml"
_SLOT = re.compile(r"(?:[0-9a-f]{8}-)?(?P<map>.+)-g(?P<generation>\d+)-s(?P<index>\d+)")
"""A slot as pytest names it, or the name of its record, which begins with the search's key."""
_ITEM = "case-"
"""What the ids of items put before a case's name."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NamedFlight:
    """A recorded flight, and all that is known of it.

    ``scenario`` and ``map`` are None if they are not known, or if the flight is one of a simulator
    of the user's own; ``camera`` is the declared one, None if no picture can be drawn again.
    ``map`` is as its file says, with all objects.  ``notes`` say what is missing, and why.
    """

    name: str
    flight: Flight
    signature: str
    limits: Limits
    scenario: Scenario | None = None
    map: Map | None = None
    camera: Camera | None = None
    notes: tuple[str, ...] = ()


def named_flight(name: str, corpus: Corpus, root: Path, ledger: Path | None = None) -> NamedFlight:
    """Return the flight that ``name`` means; raise GarlError if there is none, or several.

    A slot and the file of a record are read; a case, by file or by id, is flown again as from
    ``root``.  ``ledger`` is that of the run; by default the one of the last run there or, for the
    file of a record, the one beside it.
    """
    path = Path(name)
    if path.suffix == RECORD:
        return _of_record(path, ledger, root)
    if path.suffix == CASE:
        if not path.is_file():
            raise GarlError(f"{name}: there is no such file; expected a saved case")
        return _of_case(load_case(path, corpus.map_folders), root, corpus)
    entries = [each for each in corpus.all_entries() if each.name == name.removeprefix(_ITEM)]
    if len(entries) > 1:
        raise CorpusError(
            f"{shown(name)} is the name of several cases: {listed(e.path for e in entries)}; "
            "name one of these files"
        )
    if entries:
        case = entries[0].case
        if case is None:
            raise CorpusError(entries[0].problem)
        return _of_case(case, root, corpus)
    slot = _SLOT.fullmatch(name)
    if slot is None:
        raise GarlError(
            f"found no flight {shown(name)}; expected a slot of the run such as court-g03-s17, a "
            f"saved case (its file or its id; {corpus.folder} holds "
            f"{listed(each.name for each in corpus.all_entries()) or 'none'}), or the file of a "
            f"record ({RECORD})"
        )
    numbers = Slot(generation=int(slot["generation"]), index=int(slot["index"]))
    return _of_slot(name, slot["map"], numbers, ledger or root / LEDGER)


def _of_case(case: Case, root: Path, corpus: Corpus) -> NamedFlight:
    camera = airframe_of(system_of(case, root)).camera
    replayed = replay(case, root, corpus.map_folders)
    flight = replayed.flight
    if flight is None:
        raise GarlError(
            f"case {case.id}: its process ended before the flight was recorded; "
            "`garl cases replay` says how it ends"
        )
    # The simulator of the package notes the versions that determine its bytes.
    if not flight.versions:
        return NamedFlight(
            name=case.id,
            flight=flight,
            signature=replayed.signature,
            limits=case.limits,
            notes=("The case is flown by a simulator of your own: no pictures, no bodies.",),
        )
    return NamedFlight(
        name=case.id,
        flight=flight,
        signature=replayed.signature,
        limits=case.limits,
        scenario=case.scenario,
        map=replayed.map,
        **_camera(flight, camera),
    )


def _of_slot(name: str, map: str, slot: Slot, path: Path) -> NamedFlight:
    if not path.is_file():
        raise LedgerError(
            f"there is no ledger at {path}; run a search first, or name the ledger of one with "
            "--ledger"
        )
    with checked_ledger(path) as ledger:
        found = [f for f in ledger.queries.flights() if name in (f.id.slot_id, f.id.name)]
        if not found:
            # It says which slots there are; those that it knows are not flown yet.
            read_slot(path, map, slot)
            raise LedgerError(f"{name} is not flown in {path}; wait for it, or go on with the run")
        if len(found) > 1:
            raise LedgerError(
                f"{path} holds several flights {name}: "
                f"{listed(f'{each.id.name} ({each.system})' for each in found)}; name one of these"
            )
        (chosen,) = found
        return _stored(ledger, chosen, load(_record(ledger, chosen)))


def _record(ledger: Ledger, found: LedgerFlight) -> Path:
    """Return the file of a record; raise LedgerError, with what to do, if it is missing."""
    if not found.sha256:
        raise LedgerError(
            f"{found.id.slot_id} has no record: its process ended before the flight was recorded"
        )
    beside = found.id.record(ledger.path.parent / "flights")
    places = tuple(dict.fromkeys((beside, _job(ledger, found).record(found.id))))
    path = next((each for each in places if each.is_file()), None)
    if path is None:
        raise LedgerError(
            f"the record of {found.id.slot_id} is missing: expected {beside.name} in "
            f"{' and '.join(str(each.parent) for each in places)}; copy the folder flights beside "
            f"the ledger, or fly it again: pytest --garl-repeat={found.id.slot_id}"
        )
    return path


def _of_record(path: Path, given: Path | None, root: Path) -> NamedFlight:
    """Return a record with what the ledger of its run knows of it, if there is one."""
    flight = load(path)
    if given is not None and not given.is_file():
        raise LedgerError(f"there is no ledger at {given}")
    beside = path.absolute().parent.parent / LEDGER.name
    for place in (given,) if given is not None else (beside, root / LEDGER):
        if place.is_file():
            with checked_ledger(place) as ledger:
                found = ledger.queries.flight_with_hash(flight.sha256)
                if found is not None:
                    return _stored(ledger, found, flight)
    note = (
        "No ledger knows this record, so that its scenario is not known: no pictures, no bodies. "
        "Name the ledger of its run with --ledger."
    )
    return NamedFlight(
        name=path.stem,
        flight=flight,
        signature=judge(flight, DEFAULT_LIMITS).signature,
        limits=DEFAULT_LIMITS,
        notes=(note,),
    )


def _stored(ledger: Ledger, found: LedgerFlight, flight: Flight) -> NamedFlight:
    job = _job(ledger, found)
    place = _place(ledger, found, job, flight)
    return NamedFlight(
        name=found.id.name,
        flight=flight,
        signature=found.signature,
        limits=job.limits,
        **place,
    )


def _job(ledger: Ledger, found: LedgerFlight) -> FlightJob:
    return parse_job(ledger.job(found.id.search) or "")


def _place(ledger: Ledger, found: LedgerFlight, job: FlightJob, flight: Flight) -> dict[str, Any]:
    """Return scenario, map and camera as far as they are known, and notes."""
    if job.simulator != BUILT_IN:
        return {
            "notes": (
                f"Flown by {shortened(job.simulator.name)}, whose camera cannot be drawn again: no "
                "pictures, no bodies.",
            )
        }
    try:
        map = job.load_map()
    except GarlError as error:
        return {"notes": (f"The map cannot be read: no pictures, no bodies. {error}",)}
    known = ledger.fact(f"{CAMERA}{found.system}")
    if known is None:
        seen: dict[str, Any] = {
            "notes": (
                "The ledger does not name the camera, as those of earlier versions: no pictures.",
            )
        }
    else:
        try:
            seen = _camera(flight, dataclass_from(Camera, dict(known), "camera"))
        except (GarlError, TypeError, ValueError) as error:
            seen = {"notes": (f"The ledger's camera cannot be read: no pictures. {error}",)}
    if map.sha256 != job.map_sha256:
        changed = f"The map {map.name} has changed since the flight: pictures may differ."
        seen["notes"] = (*seen["notes"], changed)
    return {"scenario": parse_scenario(found.scenario), "map": map, **seen}


def _camera(flight: Flight, camera: Camera) -> dict[str, Any]:
    """Return the camera, or why no picture can be drawn again."""
    if not flight.steps:
        return {"notes": ("The record holds no camera frames: no pictures.",)}
    # A camera that is on knows how large the marker would be, whatever it shows.
    if not any(step.marker_px > 0 for step in flight.steps):
        return {"notes": ("The landing system used no camera: no pictures.",)}
    return {"camera": camera, "notes": ()}
