"""One flight of a page: read its record, and work out all that the page shows of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pytest_garl.cases.case import NOT_ASKED, Prevention
from pytest_garl.cases.description import describe
from pytest_garl.errors import GarlError
from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.ledger_queries import LedgerFlight
from pytest_garl.execution.reference import BUILT_IN
from pytest_garl.execution.result import FlightResult
from pytest_garl.execution.severity import NO_SEVERITY
from pytest_garl.files.json_values import dataclass_from
from pytest_garl.flight.flight import Flight
from pytest_garl.flight.flight_file import load
from pytest_garl.landing_system import Camera
from pytest_garl.reports.html.flight_tables import (
    ConditionRow,
    condition_rows,
    cut_text,
    diagnostics_rows,
    event_rows,
    nearest_rows,
)
from pytest_garl.reports.html.flight_view import flight_data
from pytest_garl.reports.html.hints import hints_of
from pytest_garl.reports.html.moments import Moment, moments_of
from pytest_garl.reports.html.pictures import Still, film_of, film_uri, stills_of
from pytest_garl.reports.html.sightings_text import sighting_sentences
from pytest_garl.reports.html.turnable_path import scene_data
from pytest_garl.scenarios.files import parse_scenario
from pytest_garl.scenarios.placed import Placed
from pytest_garl.simulation.camera.cover_event import renderer_of
from pytest_garl.simulation.landing_moments import RecordedMoments
from pytest_garl.verdicts.evidence import Evidence


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightTask:
    """A flight that a page shows: all that a process needs to work it out.

    ``records`` are the files in which its record may lie, ``camera`` what the ledger says of the
    landing system's camera, None for a ledger that does not.  ``policy`` names the NPC policy that
    moved the objects when the violation was found.  ``recorded`` is False for a flight whose
    process ended before it left a record.
    """

    name: str
    job: FlightJob
    scenario: str
    result: FlightResult
    sha256: str
    records: tuple[Path, ...]
    camera: Mapping[str, Any] | None
    policy: str
    recorded: bool = True
    prevention: Prevention = NOT_ASKED
    with_film: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class ShownFlight:
    """What a page shows of a flight.

    ``data`` is what path, timeline and cursor draw; None without a record.  ``notes`` say what is
    missing, and why.  ``missing`` is the record that should be there and is not.
    """

    description: str
    data: Mapping[str, Any] | None = None
    stills: tuple[Still, ...] = ()
    thumbnail: str = ""
    film: str = ""
    notes: tuple[str, ...] = ()
    missing: str = ""
    sightings: tuple[str, ...] = ()
    reports_detections: bool = False
    hints: tuple[str, ...] = ()
    conditions: tuple[ConditionRow, ...] = ()
    events: tuple[tuple[float, str], ...] = ()
    nearest: tuple[tuple[str, str, str], ...] = ()
    diagnostics: tuple[tuple[float, str, str], ...] = ()
    traceback: str = ""
    sha256: str = ""
    cpu: str = ""
    versions: tuple[tuple[str, str], ...] = ()


def task_of(
    flight: LedgerFlight, job: FlightJob, ledger: Path, camera: Mapping[str, Any] | None
) -> FlightTask:
    """Return a flight of the ledger at a path with all that is needed to show it.

    Its record may lie beside the ledger, or where it was flown.
    """
    beside = flight.id.record(ledger.parent / "flights")
    return FlightTask(
        name=flight.id.slot_id,
        job=job,
        scenario=flight.scenario,
        result=flight.result,
        sha256=flight.sha256,
        records=tuple(dict.fromkeys((beside, job.record(flight.id)))),
        camera=camera,
        policy=job.npcs.name,
        recorded=bool(flight.sha256),
    )


def shown_flight(task: FlightTask) -> ShownFlight:
    """Return what a page shows of a flight; what cannot be shown is named in the notes."""
    verdict, crash = task.result.verdict, task.result.crash
    severity = task.result.severity or NO_SEVERITY
    conditions, placed, notes = _conditions(task)
    traceback = cut_text(crash.traceback or crash.message) if crash else ""
    flight, missing = flight_record_of(task)
    if flight is None:
        return ShownFlight(
            description=verdict.story,
            notes=(*notes, missing or _NO_RECORD),
            missing=missing,
            hints=hints_of(None, verdict, task.prevention),
            conditions=conditions,
            traceback=traceback,
            sha256=task.sha256,
        )
    evidence = Evidence(flight, task.job.limits)
    moments = moments_of(evidence)
    data = flight_data(evidence, moments)
    drawn = _drawn(task, evidence, placed, moments) if placed else _Drawn()
    return ShownFlight(
        description=describe(flight, verdict, severity),
        data=data | {"scene": drawn.scene, "film_start_s": _film_start_s(flight)},
        stills=drawn.stills,
        thumbnail=drawn.thumbnail,
        film=drawn.film,
        notes=(*notes, *drawn.notes),
        sightings=sighting_sentences(evidence),
        reports_detections=evidence.reports_detections,
        hints=hints_of(evidence, verdict, task.prevention),
        conditions=conditions,
        events=event_rows(flight),
        nearest=nearest_rows(flight),
        diagnostics=diagnostics_rows(flight.steps),
        traceback=traceback,
        sha256=flight.sha256 or task.sha256,
        cpu=flight.cpu,
        versions=flight.versions,
    )


_NO_RECORD = (
    "The process that flew this flight ended before its record was written, so there is neither a "
    "path nor a picture."
)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Drawn:
    """Pictures of a flight, and why some are missing."""

    scene: Mapping[str, Any] | None = None
    stills: tuple[Still, ...] = ()
    thumbnail: str = ""
    film: str = ""
    notes: tuple[str, ...] = ()


def _conditions(task: FlightTask) -> tuple[tuple[ConditionRow, ...], Placed | None, list[str]]:
    """Return the scenario in words and where it is flown, None if its map cannot be read."""
    try:
        map, scenario = task.job.load_map(), parse_scenario(task.scenario)
        return condition_rows(scenario, map, task.policy), Placed(scenario, map), []
    except GarlError as error:
        return (), None, [f"The scenario cannot be shown: {cut_text(str(error), 400)}"]


def flight_record_of(task: FlightTask) -> tuple[Flight | None, str]:
    """Return the flight's record, or why it is missing; an empty reason if there was none."""
    if not task.recorded:
        return None, ""
    path = next((each for each in task.records if each.is_file()), None)
    if path is None:
        folders = " and ".join(str(each.parent) for each in task.records)
        name = task.records[0].name
        return None, (
            f"The record of this flight is missing: expected {name} in {folders}. Copy the folder "
            "flights beside the ledger, and try again."
        )
    try:
        flight = load(path)
    except GarlError as error:
        return None, f"The record of this flight cannot be read: {cut_text(str(error), 400)}"
    if flight.sha256 and flight.sha256 != task.sha256:
        return None, (
            f"{path} is the record of another flight than the ledger's: a later run flew a slot of "
            "this name and wrote over it. Name the ledger of the later run, or search anew."
        )
    return flight, ""


def _film_start_s(flight: Flight) -> float:
    return round(flight.steps[0].time_s, 3) if flight.steps else 0.0


def _drawn(
    task: FlightTask, evidence: Evidence, placed: Placed, moments: tuple[Moment, ...]
) -> _Drawn:
    """Return the pictures of a flight in the built-in simulator."""
    if task.job.simulator != BUILT_IN:
        return _Drawn(
            notes=(
                f"Flown by {cut_text(task.job.simulator.name, 100)}, whose camera cannot be drawn "
                "again: no pictures.",
            )
        )
    try:
        # Without a camera the ground can still be painted.
        camera = dataclass_from(Camera, dict(task.camera), "camera") if task.camera else Camera()
        renderer = renderer_of(placed, camera, RecordedMoments(evidence.flight))
        scene = scene_data(placed.map, renderer)
        if task.camera is None:
            note = "The ledger does not name the camera: no pictures."
            return _Drawn(scene=scene, notes=(note,))
        stills, thumbnail = stills_of(evidence, placed.scenario, renderer, moments)
    except (GarlError, ValueError) as error:
        return _Drawn(notes=(f"No pictures: {cut_text(str(error), 400)}",))
    film, notes = _film(task, evidence.flight, placed, camera) if task.with_film else ("", ())
    return _Drawn(scene=scene, stills=stills, thumbnail=thumbnail, film=film, notes=notes)


def _film(
    task: FlightTask, flight: Flight, placed: Placed, camera: Camera
) -> tuple[str, tuple[str, ...]]:
    """Return the address of the film, or a note that says why there is none."""
    try:
        return film_uri(film_of(flight, placed, camera, task.result.signature)), ()
    except GarlError as error:
        return "", (f"No film: {cut_text(str(error), 400)}",)
