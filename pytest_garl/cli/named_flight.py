"""A flight that a command names: a slot of a run, a saved case, or a flight's own file."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path

from pytest_garl.cases.case import Case
from pytest_garl.cases.case_file import load_case
from pytest_garl.cases.corpus import Corpus
from pytest_garl.cases.replay import Replay, replay, system_of
from pytest_garl.cli.check_command import imported_system
from pytest_garl.cli.shared import LEDGER, say
from pytest_garl.errors import GarlError, LedgerError
from pytest_garl.execution.flight_id import FIRST_SLOT, LIVE, OF_CASE
from pytest_garl.execution.stored_ledger import checked_ledger, flown_slots
from pytest_garl.files.run_files import REPEAT_LEDGER
from pytest_garl.files.user_files import read_table
from pytest_garl.flight.flight import Flight
from pytest_garl.flight.flight_file import load
from pytest_garl.landing_system import airframe_of
from pytest_garl.messages import command, shortened
from pytest_garl.reports.films import NO_RECORD, camera_of, recorded_flight, why_no_camera
from pytest_garl.reports.html.flight_task import FlightTask, flight_record_of
from pytest_garl.reports.mcap.export import Export, Place
from pytest_garl.scenarios.files import dump_scenario, parse_scenario
from pytest_garl.scenarios.files import load as load_scenario
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.placed import Placed
from pytest_garl.verdicts.judge import judge
from pytest_garl.verdicts.verdict import DEFAULT_LIMITS

RECORD, CASE = ".npz", ".toml"
_MAPS = (Path("scenarios/maps"),)
_SLOT = re.compile(r".+-g\d{2,}-s\d{2,}")
"""A slot as pytest names it, also with the first digits of its search's key before it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NamedFlight(Export):
    """A recorded flight, and all that is known of it.

    ``how`` says where it comes from.  ``no_pictures`` is why its pictures cannot be drawn again;
    empty if they can.  ``notes`` say what else a user should know.
    """

    how: str = "from its record"
    no_pictures: str = ""
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightName:
    """A flight's name, and the options that say where it is found (``flight_options.py``)."""

    flight: str
    ledger: Path | None
    scenario: Path | None
    system: str | None
    folder: Path

    def find(self, *, pictures: bool = False) -> NamedFlight:
        """Return the flight; raise GarlError if there is none, or several.

        A case is flown again if no ledger has its record.  ``pictures`` refuses one before that if
        its pictures could not be drawn.
        """
        file = Path(self.flight)
        if file.suffix == RECORD:
            return self._of_file(file)
        if self.scenario is not None or self.system is not None:
            raise GarlError(
                "--scenario and --system have no effect here: they say what was flown in a "
                f"flight's file ({RECORD}); a slot and a case know it"
            )
        if file.suffix == CASE:
            return self._of_case(_case_file(file), live=False, pictures=pictures)
        if _SLOT.fullmatch(self.flight):
            return self._of_slot()
        live = self.flight.endswith(LIVE)
        return self._of_case(self._case_named(), live=live, pictures=pictures)

    def _of_slot(self) -> NamedFlight:
        name, path = self.flight, self.ledger or LEDGER
        if not path.is_file():
            raise _no_ledger(path)
        with checked_ledger(path) as opened:
            flights = opened.queries.flights()
            found = [each for each in flights if name in (each.id.slot_id, each.id.name)]
            if not found:
                raise LedgerError(
                    f"{name}: no such flight in {path}, or not flown yet; it holds "
                    f"{flown_slots(opened)}"
                )
            if len(found) > 1:
                lines = "".join(
                    f"\n    {each.id.name}    # {each.system}: "
                    f"{each.signature or each.result.outcome}"
                    for each in found
                )
                raise LedgerError(
                    f"{name}: found {len(found)} flights of this name in {path}; name one by its "
                    f"search:{lines}"
                )
            task = recorded_flight(opened, found[0])
        flight, missing = flight_record_of(task)
        if flight is None:
            lost = missing and not any(each.is_file() for each in task.records)
            hint = _how_to_fly_again(task.name, path) if lost else ""
            raise GarlError(f"{name}: {missing or NO_RECORD}{hint}")
        return _recorded(task, flight)

    def _of_case(self, file: Path, *, live: bool, pictures: bool) -> NamedFlight:
        case, root = load_case(file, _MAPS), Path.cwd()
        reason = "with a live policy"
        if not live:
            found, reason = self._recorded_case(case)
            if found is not None:
                return found
        from pytest_garl.plugin.items.case_tests import case_setup

        unseen = why_no_camera(case_setup(case, root).simulator.name)
        if unseen and pictures:
            raise GarlError(f"{file}: {unseen}")
        say(f"flying {file.stem} again: {reason}", err=True)
        flown = flown_again(file, case, replay(case, root, _MAPS, live=live), root, live=live)
        return replace(flown, place=None, no_pictures=unseen) if unseen else flown

    def _recorded_case(self, case: Case) -> tuple[NamedFlight | None, str]:
        """Return the flight that a case describes if a ledger has its record, or why not."""
        task = self._with_hash(case.evidence.trajectory_sha256, LEDGER.parent, case)
        if task is None or task.job.system.name != case.system:
            return None, f"no record of its flight at {self.ledger or LEDGER}"
        flight, missing = flight_record_of(task)
        if flight is None:
            return None, missing
        # These are also the values of the same flight when it is flown again.
        signature, limits = case.violation.signature, case.limits
        known = _recorded(task, flight)
        return replace(known, name=case.id, signature=signature, limits=limits), ""

    def _of_file(self, file: Path) -> NamedFlight:
        flight, place = load(file), None
        if self.scenario is not None and self.system is not None:
            is_case = "evidence" in read_table(self.scenario).values
            scenario = (
                load_case(self.scenario, _MAPS).scenario
                if is_case
                else load_scenario(self.scenario, _MAPS)
            )
            place = Place(
                placed=Placed(scenario, load_map(scenario.map, _MAPS)),
                camera=airframe_of(imported_system(self.system)).camera,
            )
        elif self.scenario is not None or self.system is not None:
            missing = "--scenario" if self.scenario is None else "--system"
            raise GarlError(
                f"{file}: found no {missing}, expected --scenario and --system together: pictures "
                "need the scenario and the camera that were flown"
            )
        elif task := self._with_hash(flight.sha256, file.absolute().parent.parent):
            return _recorded(task, flight)
        unknown = (
            f"{file}: found a flight that {self.ledger or LEDGER} does not hold. A flight's file "
            "holds neither its scenario nor its camera: name the ledger of its run with --ledger, "
            "or give --scenario=FILE and --system=MODULE:CLASS"
        )
        return NamedFlight(
            name=file.stem,
            flight=flight,
            signature=judge(flight, DEFAULT_LIMITS).signature,
            place=place,
            no_pictures="" if place else unknown,
            notes=("The limits of its test are not known: the default ones judge it.",),
        )

    def _with_hash(self, sha256: str, run: Path, case: Case | None = None) -> FlightTask | None:
        """Return the flight with this trajectory in the ledger that is given, or in those near.

        It is that of ``case`` if several have the trajectory.
        """
        scenario = dump_scenario(case.scenario) if case else ""
        signature = case.violation.signature if case else ""
        if self.ledger is not None and not self.ledger.is_file():
            raise _no_ledger(self.ledger)
        near = {
            path.absolute(): path
            for folder in (run, LEDGER.parent)
            for path in (folder / LEDGER.name, folder / REPEAT_LEDGER)
        }
        for path in [self.ledger] if self.ledger is not None else near.values():
            if not sha256 or not path.is_file():
                continue
            try:
                with checked_ledger(path) as opened:
                    known = opened.queries.flight_with_hash(
                        sha256, scenario=scenario, signature=signature
                    )
                    if known is not None:
                        return recorded_flight(opened, known)
            except LedgerError as error:
                if self.ledger is not None:
                    raise
                # Nobody named it, and the flight may be found without it.
                say(str(error), err=True)
        return None

    def _case_named(self) -> Path:
        """Return the file of the case with this name, as pytest or `garl cases list` prints it."""
        wanted = self.flight.removesuffix(LIVE).removeprefix(OF_CASE).rpartition("/")[2]
        entries = Corpus(self.folder, _MAPS).all_entries()
        found = [entry.path for entry in entries if entry.name == wanted]
        if len(found) == 1:
            return found[0]
        if found:
            files = "".join(f"\n    {path}" for path in found)
            raise GarlError(
                f"{self.flight}: {len(found)} cases have this name; name one by its file:{files}"
            )
        from difflib import get_close_matches

        near = get_close_matches(wanted, [entry.name for entry in entries], n=3)
        hint = f"did you mean {' or '.join(near)}?" if near else "`garl cases list` lists the cases"
        raise GarlError(
            f"{self.flight}: found neither a slot such as court-g03-s17, nor a case of this name "
            f"in {self.folder}, nor a file {CASE} or {RECORD}; {hint}"
        )


def flown_again(
    file: Path, case: Case, replayed: Replay, root: Path, *, live: bool = False
) -> NamedFlight:
    """Return the flight of a case that was replayed; raise GarlError if it left no record."""
    if replayed.flight is None:
        replay = command("garl", "cases", "replay", file)
        raise GarlError(f"{file}: {NO_RECORD}; `{replay}` says how it ends")
    other = " (another flight than the saved one)" if replayed.same_flight is False else ""
    return NamedFlight(
        name=f"{case.id}{LIVE if live else ''}",
        flight=replayed.flight,
        signature=replayed.signature,
        limits=case.limits,
        place=Place(
            placed=Placed(case.scenario, replayed.map),
            camera=airframe_of(system_of(case, root)).camera,
        ),
        how=f"flown again{other}",
    )


def _recorded(task: FlightTask, flight: Flight) -> NamedFlight:
    """Return a flight of a ledger, whose record this is, with what the ledger knows of it."""
    found = NamedFlight(
        # A record has the flight's whole name.
        name=task.records[0].stem,
        flight=flight,
        signature=task.result.signature,
        limits=task.job.limits,
    )
    if unseen := why_no_camera(task.job.simulator.name):
        return replace(found, no_pictures=unseen)
    try:
        map = task.job.load_map()
    except GarlError as error:
        return replace(found, no_pictures=f"its map cannot be read: {error}")
    changed = f"The map {map.name} has changed since the flight: pictures may differ."
    notes = (changed,) if map.sha256 != task.job.map_sha256 else ()
    camera, unseen = None, ""
    try:
        camera = camera_of(task)
    except GarlError as error:
        unseen = str(error)
    scenario = parse_scenario(task.scenario)
    place = Place(placed=Placed(scenario, map), camera=camera)
    return replace(found, place=place, no_pictures=unseen, notes=notes)


def _no_ledger(path: Path) -> LedgerError:
    return LedgerError(
        f"there is no ledger at {path}; run a search first, or name the ledger of one with --ledger"
    )


def _how_to_fly_again(slot: str, ledger: Path) -> str:
    """Return the commands that fly a slot again; none for a ledger that pytest does not read."""
    if ledger.name != LEDGER.name:
        return ""
    where = () if ledger.parent == LEDGER.parent else ("-o", f"garl_dir={ledger.parent}")
    repeat = command("pytest", f"--garl-repeat={slot}", *where)
    return f" To fly it again: {repeat}, then name {slot} with " + command(
        f"--ledger={ledger.with_name(REPEAT_LEDGER)}"
    )


def _case_file(file: Path) -> Path:
    """Return the file if it is a case; raise GarlError if it is none, or a scenario."""
    if not file.is_file():
        raise GarlError(
            f"{file}: found nothing, expected a saved case; `garl cases list` lists them"
        )
    values = read_table(file).values
    if "evidence" not in values:
        slot = FIRST_SLOT.id(shortened(str(values.get("map", "MAP"))))
        raise GarlError(
            f"{file}: found no evidence of a flight, expected a saved case. If it is a scenario, "
            f"fly it first: {command('pytest', f'--garl-repeat={file}')}, then name {slot} with "
            f"--ledger={LEDGER.with_name(REPEAT_LEDGER)}"
        )
    return file
