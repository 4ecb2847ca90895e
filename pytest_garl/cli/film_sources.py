"""Where ``garl film`` finds a flight: in a ledger, by flying a case again, or in its own file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from pytest_garl.cli.cases import say
from pytest_garl.cli.check import imported_system
from pytest_garl.errors import GarlError, LedgerError
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queries import LedgerFlight
from pytest_garl.execution.stored_ledger import checked_ledger
from pytest_garl.files.reading import read_text
from pytest_garl.files.toml import Table, parse
from pytest_garl.landing_system import airframe_of
from pytest_garl.messages import listed
from pytest_garl.regressions.case import Case
from pytest_garl.regressions.case_file import load_case
from pytest_garl.regressions.replay import Replay, replay, system_of
from pytest_garl.reports.films import FilmTask, check_simulator, draw_film, recorded_flight
from pytest_garl.reports.html.flight_task import FlightTask
from pytest_garl.scenarios.files import load as load_scenario
from pytest_garl.scenarios.maps.map import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.flight import Flight
from pytest_garl.simulation.flight_file import load
from pytest_garl.video import save_video

FROM_RECORD = "drawn from its record"
NOT_JUDGED = "not judged"
"""In place of the signature of a flight whose verdict nobody knows."""
MAPS = (Path("scenarios/maps"),)


@dataclass(frozen=True, slots=True, kw_only=True)
class Film:
    """A film to draw.  Each method draws it, and returns in words how, and the flight."""

    path: Path
    last_s: float | None
    ledger: Path
    ledger_given: bool

    def of_slot(self, name: str) -> tuple[str, Flight]:
        """Draw a slot of the ledger from its record."""
        if not self.ledger.is_file():
            raise LedgerError(
                f"there is no ledger at {self.ledger}; run a search first, or name the ledger of "
                "one with --ledger"
            )
        with checked_ledger(self.ledger) as opened:
            task = recorded_flight(opened, self._flight_named(name, opened))
        try:
            return FROM_RECORD, self._draw(task)
        except GarlError as error:
            missing = not any(each.is_file() for each in task.records)
            hint = self._how_to_fly_again(task) if missing else ""
            raise GarlError(f"{name}: {error}{hint}") from error

    def of_case(self, file: Path, *, live: bool = False) -> tuple[str, Flight]:
        """Draw a saved case from the record of its flight if the ledger has it; else fly it."""
        case, root = load_case(file, MAPS), Path.cwd()
        task = None if live else self._recorded_case(case)
        if task is not None and any(record.is_file() for record in task.records):
            return FROM_RECORD, self._draw(task)
        from pytest_garl.plugin.case_tests import case_setup

        try:
            check_simulator(case_setup(case, root).simulator.name)
        except GarlError as error:
            raise GarlError(f"{file}: {error}") from error
        say(f"flying {file.stem} again: no record of its flight at {self.ledger}")
        replayed = replay(case, root, MAPS, live=live)
        flight = draw_replay(self.path, file, case, replayed, root, last_s=self.last_s)
        other = " (another flight than the saved one)" if replayed.same_flight is False else ""
        return f"flown again{other}", flight

    def of_file(self, file: Path, scenario: Path | None, system: str | None) -> tuple[str, Flight]:
        """Draw a flight's own file, whose scenario and camera the ledger knows, or options tell."""
        flight = load(file)
        if scenario is None and system is None:
            task = self._of_record(flight, file)
            if task is None:
                raise GarlError(
                    f"{file}: found a flight that {self.ledger} does not hold. A flight's file "
                    "holds neither its scenario nor its camera: name the ledger of its run with "
                    "--ledger, or give --scenario=FILE and --system=MODULE:CLASS"
                )
            # The named file is the record, wherever the ledger expects one.
            return FROM_RECORD, self._draw(task, file)
        if scenario is None or system is None:
            missing = "--scenario" if scenario is None else "--system"
            raise GarlError(
                f"{file}: found no {missing}, expected --scenario and --system together: a film "
                "needs the scenario and the camera that were flown"
            )
        flown, camera = _scenario_in(scenario), airframe_of(imported_system(system)).camera
        map = load_map(flown.map, MAPS)
        save_video(self.path, flight, flown, map, camera, NOT_JUDGED, last_s=self.last_s)
        return FROM_RECORD, flight

    def _how_to_fly_again(self, task: FlightTask) -> str:
        """Return the commands that fly a slot again; none for a ledger pytest does not read."""
        if self.ledger.name != "ledger.sqlite":
            return ""
        folder = self.ledger.parent
        where = "" if folder == Path(".garl") else f" -o garl_dir={folder}"
        return (
            f" To fly it again: pytest --garl-repeat={task.name}{where}, then garl film "
            f"{task.name} --ledger={folder / 'repeat.sqlite'}"
        )

    def _draw(self, task: FlightTask, record: Path | None = None) -> Flight:
        known = replace(task, records=(record,)) if record is not None else task
        return draw_film(FilmTask(flight=known, file=self.path), self.last_s)

    def _flight_named(self, name: str, ledger: Ledger) -> LedgerFlight:
        flights = ledger.queries.flights()
        found = [each for each in flights if name in (each.id.slot_id, each.id.name)]
        if len(found) == 1:
            return found[0]
        if not found:
            raise LedgerError(
                f"{name}: no such flight in {self.ledger}; it holds {_ranges(flights)}"
            )
        lines = "\n".join(
            f"    garl film {each.id.name}    # {each.system}: "
            f"{each.signature or each.result.outcome}"
            for each in found
        )
        raise GarlError(
            f"{name}: found {len(found)} flights of this name in {self.ledger}; name the one by "
            f"its search:\n{lines}"
        )

    def _recorded_case(self, case: Case) -> FlightTask | None:
        """Return the flight that a case describes, if the ledger has it."""
        try:
            task = self._with_hash(case.evidence.trajectory_sha256, self.ledger)
        except LedgerError as error:
            if self.ledger_given:
                raise
            # It is of no use here, and the case can be flown all the same.
            say(f"{error}")
            return None
        return task if task is not None and task.job.system.name == case.system else None

    def _of_record(self, flight: Flight, file: Path) -> FlightTask | None:
        """Return what a ledger knows of a flight: the one that is named, or those near the file."""
        run = file.absolute().parents[1] if file.parent.name == "flights" else self.ledger.parent
        near = (self.ledger, run / "ledger.sqlite", run / "repeat.sqlite")
        found = (
            self._with_hash(flight.sha256, ledger)
            for ledger in (near[:1] if self.ledger_given else near)
        )
        return next((task for task in found if task is not None), None)

    def _with_hash(self, sha256: str, ledger: Path) -> FlightTask | None:
        """Return a ledger's flight with this trajectory; None without one."""
        if not ledger.is_file() and self.ledger_given:
            raise LedgerError(f"there is no ledger at {ledger}; name another one")
        if not sha256 or not ledger.is_file():
            return None
        with checked_ledger(ledger) as opened:
            known = opened.queries.flight_with_hash(sha256)
            return recorded_flight(opened, known) if known is not None else None


def draw_replay(
    path: Path, file: Path, case: Case, replayed: Replay, root: Path, last_s: float | None = None
) -> Flight:
    """Draw the flight of a case that was flown again; raise GarlError if there is none."""
    if replayed.flight is None:
        raise GarlError(f"{file}: its process ended before the flight was recorded: no video")
    camera = airframe_of(system_of(case, root)).camera
    save_video(
        path,
        replayed.flight,
        case.scenario,
        replayed.map,
        camera,
        replayed.signature,
        last_s=last_s,
    )
    return replayed.flight


def _ranges(flights: Sequence[LedgerFlight]) -> str:
    """Return which slots a ledger holds, as one range for each map."""
    slots: dict[str, list[LedgerFlight]] = {}
    for flight in flights:
        slots.setdefault(flight.id.map, []).append(flight)
    ends = [
        (min(those, key=lambda each: each.id.slot), max(those, key=lambda each: each.id.slot))
        for those in slots.values()
    ]
    return listed(f"{low.id.slot_id} to {high.id.slot_id}" for low, high in ends) or "no flights"


def _scenario_in(file: Path) -> Scenario:
    """Return the scenario of a scenario file, or of a case."""
    table = Table(parse(read_text(file), str(file)), str(file))
    if "evidence" in table.values:
        return load_case(file, MAPS).scenario
    return load_scenario(file, MAPS)
