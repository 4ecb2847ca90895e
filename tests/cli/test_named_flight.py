"""Which flight a name means: ``garl film`` and ``garl export`` take the same names for the same."""

from __future__ import annotations

import dataclasses
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
from click.testing import CliRunner

from pytest_garl.cases.case import Case
from pytest_garl.cases.corpus import Corpus, replace_file
from pytest_garl.cases.replay import Replay
from pytest_garl.cli import main
from pytest_garl.cli import named_flight as module
from pytest_garl.cli.named_flight import FlightName, NamedFlight
from pytest_garl.errors import GarlError, ScenarioError
from pytest_garl.execution.reference import Reference
from pytest_garl.flight.flight import Flight
from pytest_garl.flight.flight_file import save
from pytest_garl.plugin.items import case_tests
from pytest_garl.scenarios.files import dumps
from pytest_garl.shrinking.reshrink import CaseSetup
from tests.cases.samples import LAWN
from tests.cases.samples import case as dog_case
from tests.reports.html.test_report import lost
from tests.support.mcap_files import needs_extra
from tests.support.recorded_flights import recorded, seen
from tests.support.report_ledgers import Flown, write_ledger
from tests.support.videos import SCENARIO, Hovers, Video, video

needs_extra()
__all__ = ["video"]
SLOT = "lawn-g00-s00"
FOLDER = Path("scenarios/regressions")
FLIGHT = dataclasses.replace(recorded(steps=seen(range(10))), sha256="ab" * 32)


def find(name: str | Path, ledger: str = "", *, pictures: bool = False) -> NamedFlight:
    given = FlightName(
        flight=str(name),
        ledger=Path(ledger) if ledger else None,
        scenario=None,
        system=None,
        folder=FOLDER,
    )
    return given.find(pictures=pictures)


def refused(*args: str | Path) -> str:
    """Return the error of both commands, which is the same and leaves no file."""
    told = []
    for command in (["film", "-oit.mp4"], ["export", "--mcap=it.mcap"]):
        done = CliRunner().invoke(main, [*command, *map(str, args)], env={"COLUMNS": "200"})
        assert done.exit_code == 1, done.output
        told.append(done.output)
    assert told[0] == told[1]
    assert told[0].startswith("Error: ")
    assert not list(Path.cwd().glob("it.*p*"))
    return told[0]


@pytest.fixture
def run(tmp_path: Path, video: Video, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the ledger of a run in the present folder, whose second flight left no record."""
    monkeypatch.chdir(tmp_path)
    write_ledger(tmp_path, [Flown(result=lost(), flight=video.flight), Flown(result=lost())])
    return Path(".garl/ledger.sqlite")


@pytest.fixture
def case(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the file of a case that is flown by nobody, with the record ``FLIGHT``."""
    monkeypatch.chdir(tmp_path)
    flies(monkeypatch, FLIGHT)
    path = Corpus(FOLDER).save(dog_case())
    assert path is not None
    return path


def flies(
    monkeypatch: pytest.MonkeyPatch, flight: Flight | None, setup: CaseSetup | None = None
) -> None:
    def replay(case: Case, *args: object, live: bool) -> Replay:
        return Replay(
            result="FAILED",
            outcome="collision",
            signature=case.violation.signature,
            description="",
            judged_by="nobody",
            reasons=(),
            flight=flight,
            map=LAWN,
            same_flight=None,
        )

    monkeypatch.setattr(module, "replay", replay)
    monkeypatch.setattr(module, "system_of", lambda case, root: Hovers)
    monkeypatch.setattr(case_tests, "case_setup", lambda case, root: setup or CaseSetup())


def test_a_slot_that_is_not_flown_is_told_with_those_that_are(run: Path) -> None:
    words = refused("lawn-g07-s00")
    assert f"no such flight in {run}, or not flown yet; it holds {SLOT} to lawn-g00-s01" in words
    words = refused(SLOT, "--ledger=no.sqlite")
    assert "there is no ledger at no.sqlite; run a search first, or name" in words


def test_a_missing_record_says_what_to_do(run: Path) -> None:
    shutil.rmtree(run.parent / "flights")
    words = refused(SLOT)
    assert f"expected 01234567-{SLOT}.npz in" in words
    assert "Copy the folder flights beside the ledger" in words
    assert (
        f"To fly it again: pytest --garl-repeat={SLOT}, then name {SLOT} with "
        "--ledger=.garl/repeat.sqlite"
    ) in words
    run.parent.rename("ci")
    words = refused(SLOT, "--ledger=ci/ledger.sqlite")
    assert (
        f"pytest --garl-repeat={SLOT} -o garl_dir=ci, then name {SLOT} with --ledger=ci/" in words
    )
    Path("ci/ledger.sqlite").rename("ci/ledger-previous.sqlite")
    assert "To fly it again" not in refused(SLOT, "--ledger=ci/ledger-previous.sqlite")


def test_a_flight_whose_process_ended_has_no_record(run: Path) -> None:
    words = refused("lawn-g00-s01")
    assert words == "Error: lawn-g00-s01: its process ended before its record was written\n"


def test_a_record_that_a_later_run_wrote_is_not_taken_for_the_flight(
    run: Path, video: Video
) -> None:
    later = dataclasses.replace(video.flight, sha256="f" * 64)
    save(later, run.parent / "flights" / f"01234567-{SLOT}.npz")
    assert "is the record of another flight than the ledger's" in refused(SLOT)


def test_a_slot_of_two_searches_is_named_by_its_search(run: Path) -> None:
    with closing(sqlite3.connect(run)) as opened, opened:
        opened.execute(
            "INSERT INTO search SELECT 'fedcba9876543210', 'other:Stack', map, wanted, job, kind "
            "FROM search"
        )
        columns = "generation, slot, scenario, state, result, sha256"
        opened.execute(
            f"INSERT INTO slot (search, {columns}) SELECT 'fedcba9876543210', {columns} FROM slot"
        )
    words = refused(SLOT)
    assert f"found 2 flights of this name in {run}; name one by its search:" in words
    assert f"\n    01234567-{SLOT}    # my_stack:Hovers: II:lost:descent" in words
    assert f"\n    fedcba98-{SLOT}    # other:Stack: II:lost:descent" in words
    assert find(f"01234567-{SLOT}").name == f"01234567-{SLOT}"


def test_a_map_that_has_changed_since_the_flight_is_noted(run: Path) -> None:
    assert find(SLOT).notes == ()
    with closing(sqlite3.connect(run)) as opened, opened:
        opened.execute("UPDATE search SET job = replace(job, ?, ?)", (LAWN.sha256, "0" * 64))
    assert find(SLOT).notes == ("The map lawn has changed since the flight: pictures may differ.",)


@pytest.mark.parametrize("content", [b"", b"PK not a record"])
def test_a_file_that_is_no_flight_is_named(run: Path, content: bytes) -> None:
    Path("mine.npz").write_bytes(content)
    assert "mine.npz: not a saved flight" in refused("mine.npz")
    assert "nowhere.npz" in refused("nowhere.npz")
    assert "found no --system, expected --scenario" in refused(
        run.parent / "flights" / f"01234567-{SLOT}.npz", "--scenario=mine.npz"
    )


def test_a_case_that_is_not_there_is_told_with_similar_ones(case: Path) -> None:
    words = refused(f"{case.stem}x")
    assert "found neither a slot such as court-g03-s17, nor a case" in words
    assert f"did you mean {case.stem}?" in words
    assert "`garl cases list` lists the cases" in refused("zzz")
    assert "nowhere.toml: found nothing, expected a saved case" in refused("nowhere.toml")
    assert "have no effect here" in refused(case, "--system=my_stack:Hovers")


def test_two_cases_of_one_name_are_told_apart_by_their_files(case: Path) -> None:
    twin = case.parents[1] / "other" / case.name
    twin.parent.mkdir()
    shutil.copy(case, twin)
    words = refused(case.stem)
    assert "2 cases have this name; name one by its file:" in words
    assert f"\n    {twin}\n" in words


def test_a_scenario_file_is_no_case_and_says_how_to_fly_it(run: Path) -> None:
    Path("it.toml").write_text(dumps(SCENARIO, LAWN))
    words = refused("it.toml")
    assert "found no evidence of a flight, expected a saved case" in words
    assert (
        "pytest --garl-repeat=it.toml, then name lawn-g00-s00 with --ledger=.garl/repeat" in words
    )


def test_a_broken_case_says_what_is_wrong_with_it(case: Path) -> None:
    case.write_text("schema = ")
    with pytest.raises(ScenarioError, match="not valid TOML"):
        find(case.stem)


@pytest.mark.parametrize("before", ["", "case-"])
def test_a_case_has_the_camera_of_its_system(case: Path, before: str) -> None:
    found = find(f"{before}{case.stem}")
    assert (found.name, found.how) == (dog_case().id, "flown again")
    assert found.signature == "IV:dog:last-metre:unseen"
    scenario = dog_case().scenario
    camera = Hovers.airframe.camera
    assert found.place is not None
    assert (found.place.placed.scenario, found.place.camera) == (scenario, camera)
    assert found.place.placed.map == LAWN.without(scenario.removed_objects)
    assert find(f"{before}{case.stem}-live").name == f"{dog_case().id}-live"


def test_a_case_of_a_simulator_of_the_users_own_has_no_pictures(
    case: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = Reference(module="my_simulator", file="", qualname="fly")
    flies(monkeypatch, FLIGHT, CaseSetup(simulator=own))
    found = find(case)
    assert found.place is None
    assert found.no_pictures.startswith("flown by my_simulator:fly, a simulator of your own")
    with pytest.raises(GarlError, match="a simulator of your own"):
        find(case, pictures=True)


def test_a_case_whose_process_ended_early_has_no_flight(
    case: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flies(monkeypatch, None)
    with pytest.raises(GarlError, match="its process ended before its record was written"):
        find(case)


def test_a_case_with_a_record_gives_the_same_as_one_that_is_flown_again(case: Path) -> None:
    saved = dog_case()
    evidence = dataclasses.replace(saved.evidence, trajectory_sha256=FLIGHT.sha256)
    file = replace_file(case, dataclasses.replace(saved, evidence=evidence))
    flown = find(file)
    ledger = write_ledger(
        Path.cwd(),
        [Flown(result=lost(), flight=FLIGHT, scenario=saved.scenario)],
        system=saved.system,
    )
    read = find(file)
    assert (flown.how, read.how) == ("flown again", "from its record")
    for key in ("name", "signature", "limits", "place", "notes"):
        assert getattr(read, key) == getattr(flown, key), key
    (record,) = (ledger.parent / "flights").iterdir()
    save(dataclasses.replace(FLIGHT, sha256="f" * 64), record)
    assert find(file).how == "flown again", "a later run wrote over the record"
