"""Films of flights: where each is drawn from, why one cannot be drawn, and many at a time."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from pytest_garl.errors import GarlError, SavingError
from pytest_garl.execution.job import parse_job
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queries import LedgerFlight
from pytest_garl.execution.reference import BUILT_IN
from pytest_garl.files.json_values import dataclass_from
from pytest_garl.landing_system import Camera
from pytest_garl.messages import shortened
from pytest_garl.reports.film import save_video
from pytest_garl.reports.html.flight_task import FlightTask, flight_record_of, task_of
from pytest_garl.reports.html.page_workers import in_processes
from pytest_garl.scenarios.files import parse_scenario
from pytest_garl.scenarios.placed import Placed

NO_RECORD = "its process ended before its record was written"


@dataclass(frozen=True, slots=True, kw_only=True)
class FilmTask:
    """A flight of a ledger, and the file of its film.

    ``drawn`` is where a process of its own draws before the film takes its place.
    """

    flight: FlightTask
    file: Path
    drawn: Path | None = None

    @property
    def name(self) -> str:
        """The flight's slot."""
        return self.flight.name


def recorded_flight(ledger: Ledger, flight: LedgerFlight) -> FlightTask:
    """Return a flight of a ledger with all that its film needs."""
    job = parse_job(ledger.job(flight.id.search) or "")
    return task_of(flight, job, ledger.path, ledger.facts.camera(flight.system))


def why_no_camera(simulator: str) -> str:
    """Return why flights of a simulator of a user's own have no camera; empty for the built-in."""
    if simulator == BUILT_IN.name:
        return ""
    return (
        f"flown by {shortened(simulator)}, a simulator of your own, whose camera cannot be drawn "
        "again"
    )


def camera_of(flight: FlightTask) -> Camera:
    """Return the camera that flew; raise GarlError if its pictures cannot be drawn again."""
    if problem := why_no_camera(flight.job.simulator.name):
        raise GarlError(problem)
    if flight.camera is None:
        raise GarlError(
            "the ledger does not name the camera: search again, or fly it with --garl-repeat"
        )
    try:
        return dataclass_from(Camera, dict(flight.camera), "camera")
    except (GarlError, TypeError, ValueError) as error:
        raise GarlError(f"the camera in the ledger is damaged: {error}") from error


def why_no_film(flight: FlightTask) -> str:
    """Return why a flight can have no film, whatever its record holds; empty if it can."""
    try:
        camera_of(flight)
    except GarlError as error:
        return str(error)
    return "" if flight.recorded else NO_RECORD


def draw_film(task: FilmTask) -> None:
    """Draw the film of a flight from its record.

    Raises GarlError, which says what is missing, if that cannot be done.
    """
    flight = task.flight
    camera = camera_of(flight)
    record, missing = flight_record_of(flight)
    if record is None:
        raise GarlError(missing or NO_RECORD)
    scenario, map = parse_scenario(flight.scenario), flight.job.load_map()
    save_video(task.file, record, Placed(scenario, map), camera, flight.result.signature)


def draw_films(
    tasks: Sequence[FilmTask], workers: int, on_done: Callable[[int], None] = lambda done: None
) -> list[str]:
    """Draw films in ``workers`` processes; return for each why it was not drawn, or nothing.

    All films lie in one folder, which is made.  A film is there whole or not at all, also if this
    process is interrupted.  Raises SavingError if the folder cannot be made.
    """
    if not tasks:
        return []
    folder = tasks[0].file.parent
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise SavingError(f"{folder}: no films can be written here ({error})") from error
    # A process that is ended while it draws leaves its unfinished file in here.
    with tempfile.TemporaryDirectory(prefix=".drawn-", dir=folder) as scratch:
        works = [replace(task, drawn=Path(scratch, task.file.name)) for task in tasks]
        return in_processes(_problem_of, works, workers, on_done)


def _problem_of(task: FilmTask) -> str:
    """Draw a film; return why it cannot be drawn, empty if it was."""
    drawn = task.drawn or task.file
    try:
        draw_film(replace(task, file=drawn))
        drawn.replace(task.file)
    except (GarlError, OSError) as error:
        return str(error)
    return ""
